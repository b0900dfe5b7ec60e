//! [`Description`]: a payload's layout as text, by which tools read and make samples.
//!
//! The text travels with a topic's service, so that a tool shows samples of a topic that it was not
//! built with. The text gives each type in full once, and by its name after that:
//!
//! ```text
//! Weather{wind:u32,sky:Sky<Clear,Cloudy,7=Fog>,gusts:[Gust{mm_s:u16,sky:Sky};4]}
//! ```
//!
//! A variant without a number has the code after the one before it; the first has 0.
//!
//! **Invariant:** the text comes from another process and may be anything. Reading it allocates no
//! more memory than the text is long, and only a sample of exactly the described size is read.

mod fill;
mod json_schema;
mod path;

pub use path::NoField;

use core::fmt::{self, Write};
use std::collections::HashMap;
use std::sync::Arc;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::schema::{FieldInfo, Make, Payload};

/// The deepest nesting of types that any payload may have.
const DEEPEST: usize = 16;

/// The text that describes a type.
pub fn describe(make: &Make) -> String {
    let mut text = String::new();
    write(&mut text, &mut HashMap::new(), make);
    text
}

fn write(text: &mut String, known: &mut HashMap<&'static str, Make>, make: &Make) {
    let name = match make {
        Make::Number(name) => return text.push_str(name),
        Make::List(element, length) => {
            text.push('[');
            write(text, known, element);
            // Writing to a String cannot fail.
            let _ = write!(text, ";{length}]");
            return;
        }
        Make::Tag { name, .. } => name,
        Make::Record(info) => info.name(),
    };
    text.push_str(name);
    if known.get(name) == Some(make) {
        return;
    }
    match make {
        Make::Record(info) => write_fields(text, known, info.fields),
        Make::Tag { variants, .. } => write_variants(text, variants),
        Make::Number(_) | Make::List(..) => (),
    }
    known.insert(name, *make);
}

fn write_fields(text: &mut String, known: &mut HashMap<&'static str, Make>, fields: &[FieldInfo]) {
    for (place, field) in fields.iter().enumerate() {
        text.push(if place == 0 { '{' } else { ',' });
        text.push_str(field.name);
        text.push(':');
        write(text, known, &field.make);
    }
    text.push('}');
}

fn write_variants(text: &mut String, variants: &[(u8, &str)]) {
    text.push('<');
    let mut next = 0;
    for (place, (code, name)) in variants.iter().enumerate() {
        if place > 0 {
            text.push(',');
        }
        if u16::from(*code) != next {
            let _ = write!(text, "{code}=");
        }
        text.push_str(name);
        next = u16::from(*code) + 1;
    }
    text.push('>');
}

/// A layout that was read from its text.
#[derive(Clone, Debug)]
pub struct Description {
    name: String,
    record: Arc<Record>,
    text: Arc<str>,
}

#[derive(Debug)]
struct Record {
    fields: Vec<(String, Kind)>,
    size: usize,
}

type Variants = Arc<Vec<(u8, String)>>;

#[derive(Clone, Debug)]
enum Kind {
    Number(Number),
    List(Box<Kind>, usize),
    Tag(Variants),
    Record(Arc<Record>),
}

macro_rules! numbers {
    ($($variant:ident = $type:ident),*) => {
        #[derive(Clone, Copy, Debug)]
        #[allow(non_camel_case_types)]
        enum Number { $($variant),* }

        impl Number {
            fn of(name: &str) -> Option<Self> {
                match name {
                    $( stringify!($type) => Some(Self::$variant), )*
                    _ => None,
                }
            }

            const fn size(self) -> usize {
                match self {
                    $( Self::$variant => size_of::<$type>(), )*
                }
            }

            /// The least and the greatest whole number; `None` for types with fractions.
            fn range(self) -> Option<(i128, i128)> {
                let limits = match self {
                    $( Self::$variant => ($type::MIN as i128, $type::MAX as i128), )*
                };
                (!matches!(self, Self::F32 | Self::F64)).then_some(limits)
            }

            /// Writes a whole number, if this type can have it.
            fn put_whole(self, value: i128, to: &mut [u8]) -> bool {
                let is_within = |(least, greatest)| (least..=greatest).contains(&value);
                let fits = self.range().is_none_or(is_within);
                if fits {
                    match self {
                        $( Self::$variant => {
                            to.copy_from_slice(&(value as $type).to_ne_bytes());
                        } )*
                    }
                }
                fits
            }

            fn serialize<S: Serializer>(self, bytes: &[u8], to: S) -> Result<S::Ok, S::Error> {
                match self {
                    $( Self::$variant => {
                        let bytes = bytes.first_chunk().copied().unwrap_or_default();
                        $type::from_ne_bytes(bytes).serialize(to)
                    } )*
                }
            }
        }
    };
}

numbers!(
    U8 = u8,
    U16 = u16,
    U32 = u32,
    U64 = u64,
    I8 = i8,
    I16 = i16,
    I32 = i32,
    I64 = i64,
    F32 = f32,
    F64 = f64
);

/// The text describes no payload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DescriptionError {
    /// The byte at which the text stops making sense.
    pub at: usize,
    /// What should stand there.
    pub expected: &'static str,
}

impl fmt::Display for DescriptionError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at, expected } = self;
        write!(
            formatter,
            "the topic's description is not readable: {expected} is missing at byte {at}"
        )
    }
}

impl std::error::Error for DescriptionError {}

impl Description {
    /// Reads a text that [`describe`] has written.
    ///
    /// # Errors
    /// The text describes no payload.
    pub fn parse(text: &str) -> Result<Self, DescriptionError> {
        let mut parser = Parser {
            text,
            at: 0,
            known: HashMap::new(),
        };
        let name = parser.name("a struct's name")?.to_owned();
        let Kind::Record(record) = parser.named(&name, 0)? else {
            return Err(parser.error("a struct"));
        };
        if parser.at < text.len() {
            return Err(parser.error("the end"));
        }
        let text = text.into();
        Ok(Self { name, record, text })
    }

    /// The description of a payload that this build has.
    ///
    /// # Panics
    /// Never, because this can read what [`describe`] writes.
    pub fn of<P: Payload>() -> Self {
        Self::of_make(&P::MAKE)
    }

    /// The description of a payload of which the make is given.
    ///
    /// # Panics
    /// `make` is not the make of a payload.
    pub fn of_make(make: &Make) -> Self {
        Self::parse(&describe(make)).expect("our own description")
    }

    /// The payload's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text that this description was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The fields that tools show of a sample, in memory order.
    pub fn fields(&self) -> impl Iterator<Item = &str> {
        shown(&self.record).map(|(name, _)| name.as_str())
    }

    /// The size of one payload in bytes.
    pub fn size(&self) -> usize {
        self.record.size
    }

    /// A payload for serde to serialize; `None` if the payload has another length than `bytes`.
    pub fn read<'a>(&'a self, bytes: &'a [u8]) -> Option<Described<'a>> {
        let payload = Shown::Record(&self.record);
        (bytes.len() == self.record.size).then_some(Described { payload, bytes })
    }
}

fn shown(record: &Record) -> impl Iterator<Item = &(String, Kind)> {
    let fields = record.fields.iter();
    fields.filter(|(name, _)| !name.starts_with("reserved"))
}

/// A payload, or a part of one, with its description.
#[derive(Clone, Copy, Debug)]
pub struct Described<'a> {
    payload: Shown<'a>,
    bytes: &'a [u8],
}

impl<'a> Described<'a> {
    /// The bytes as they lie in memory.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}

#[derive(Clone, Copy, Debug)]
enum Shown<'a> {
    Record(&'a Record),
    Field(&'a Kind),
}

impl Serialize for Described<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let bytes = self.bytes;
        match self.payload {
            Shown::Record(record) => write_record(record, bytes, to),
            Shown::Field(Kind::Record(record)) => write_record(record, bytes, to),
            Shown::Field(Kind::Number(number)) => number.serialize(bytes, to),
            Shown::Field(Kind::Tag(variants)) => {
                let code = bytes.first().copied().unwrap_or_default();
                match variants.iter().find(|(known, _)| *known == code) {
                    Some((_, name)) => to.serialize_str(name),
                    None => to.serialize_u8(code),
                }
            }
            Shown::Field(Kind::List(element, _)) => {
                let payload = Shown::Field(element);
                let elements = bytes.chunks_exact(element.size());
                to.collect_seq(elements.map(|bytes| Described { payload, bytes }))
            }
        }
    }
}

fn write_record<S: Serializer>(record: &Record, bytes: &[u8], to: S) -> Result<S::Ok, S::Error> {
    let mut map = to.serialize_map(None)?;
    let mut left = bytes;
    for (name, kind) in &record.fields {
        let (bytes, behind) = left.split_at(kind.size());
        left = behind;
        if !name.starts_with("reserved") {
            let payload = Shown::Field(kind);
            map.serialize_entry(name, &Described { payload, bytes })?;
        }
    }
    map.end()
}

impl Kind {
    /// The size in bytes; at least 1 and without overflow, as the parser has checked.
    fn size(&self) -> usize {
        match self {
            Self::Number(number) => number.size(),
            Self::List(element, length) => element.size() * length,
            Self::Tag(_) => 1,
            Self::Record(record) => record.size,
        }
    }
}

struct Parser<'text> {
    text: &'text str,
    at: usize,
    known: HashMap<String, Kind>,
}

impl<'text> Parser<'text> {
    fn error(&self, expected: &'static str) -> DescriptionError {
        let at = self.at;
        DescriptionError { at, expected }
    }

    fn left(&self) -> &'text str {
        &self.text[self.at..]
    }

    fn takes(&mut self, mark: char) -> bool {
        let is_there = self.left().starts_with(mark);
        self.at += usize::from(is_there) * mark.len_utf8();
        is_there
    }

    fn name(&mut self, expected: &'static str) -> Result<&'text str, DescriptionError> {
        let left = self.left();
        let ends = |c: char| !(c.is_alphanumeric() || c == '_');
        let name = &left[..left.find(ends).unwrap_or(left.len())];
        if name.is_empty() {
            return Err(self.error(expected));
        }
        self.at += name.len();
        Ok(name)
    }

    fn kind(&mut self, depth: usize) -> Result<Kind, DescriptionError> {
        if depth > DEEPEST {
            return Err(self.error("a simpler type"));
        }
        if !self.takes('[') {
            let name = self.name("a type")?;
            return self.named(name, depth);
        }
        let element = self.kind(depth + 1)?;
        if !self.takes(';') {
            return Err(self.error("`;`"));
        }
        let length: usize = self.number()?;
        let fits = length.checked_mul(element.size());
        if fits.is_none_or(|size| size == 0) || !self.takes(']') {
            return Err(self.error("a length and `]`"));
        }
        Ok(Kind::List(Box::new(element), length))
    }

    fn number<N: core::str::FromStr>(&mut self) -> Result<N, DescriptionError> {
        let digits = self.name("a number")?;
        digits.parse().map_err(|_| self.error("a number"))
    }

    /// The type called `name`, whose contents follow unless the type is known already.
    fn named(&mut self, name: &str, depth: usize) -> Result<Kind, DescriptionError> {
        if let Some(number) = Number::of(name) {
            return Ok(Kind::Number(number));
        }
        let kind = if self.takes('{') {
            Kind::Record(Arc::new(self.record(depth)?))
        } else if self.takes('<') {
            Kind::Tag(Arc::new(self.variants()?))
        } else {
            let known = self.known.get(name).cloned();
            return known.ok_or_else(|| self.error("the type's contents"));
        };
        self.known.insert(name.to_owned(), kind.clone());
        Ok(kind)
    }

    fn record(&mut self, depth: usize) -> Result<Record, DescriptionError> {
        let (mut fields, mut size) = (Vec::new(), 0_usize);
        loop {
            let name = self.name("a field's name")?.to_owned();
            if !self.takes(':') {
                return Err(self.error("`:`"));
            }
            let kind = self.kind(depth + 1)?;
            size = size
                .checked_add(kind.size())
                .ok_or_else(|| self.error("a smaller type"))?;
            fields.push((name, kind));
            if self.takes('}') {
                return Ok(Record { fields, size });
            }
            if !self.takes(',') {
                return Err(self.error("`,` or `}`"));
            }
        }
    }

    fn variants(&mut self) -> Result<Vec<(u8, String)>, DescriptionError> {
        let mut variants = Vec::new();
        let mut next = Some(0_u8);
        while !self.takes('>') {
            let mut name = self.name("a variant's name")?;
            if self.takes('=') {
                next = Some(name.parse().map_err(|_| self.error("a code"))?);
                name = self.name("a variant's name")?;
            }
            let code = next.ok_or_else(|| self.error("a code up to 255"))?;
            variants.push((code, name.to_owned()));
            next = code.checked_add(1);
            if !self.takes(',') && !self.left().starts_with('>') {
                return Err(self.error("`,` or `>`"));
            }
        }
        Ok(variants)
    }
}
