//! Makes the bytes of a payload from a text that people write: JSON, or any other format of serde.
//!
//! An error names the field and the values that it can have: `invalid value: integer 300, expected
//! a whole number from 0 to 255 in `sensor.version``. A field that the text leaves out keeps its
//! bytes, and a list may end early. A name that no field has is an error, and so is the name of a
//! `reserved` field, which tools do not show.

use core::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};

use super::{Description, Kind, Number, Record, Variants, shown};

impl Description {
    /// Reads a payload into `bytes`. A field that the text does not name keeps its bytes.
    ///
    /// # Errors
    /// The text names a field that does not exist, or a value that its field cannot have, or
    /// `bytes` has another length than a payload.
    pub fn fill<'de, D: Deserializer<'de>>(
        &self,
        payload: D,
        bytes: &mut [u8],
    ) -> Result<(), D::Error> {
        if bytes.len() != self.size() {
            return Err(D::Error::invalid_length(bytes.len(), &"a payload's bytes"));
        }
        let path = Path::Payload(&self.name);
        let record = Fields(&self.record, bytes, path);
        payload.deserialize_any(record)
    }
}

/// The path of a value in a payload.
#[derive(Clone, Copy)]
enum Path<'a> {
    Payload(&'a str),
    Field(&'a Path<'a>, &'a str),
    Element(&'a Path<'a>, usize),
}

impl fmt::Display for Path<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Payload(name) => formatter.write_str(name),
            Self::Field(Self::Payload(_), name) => formatter.write_str(name),
            Self::Field(path, name) => write!(formatter, "{path}.{name}"),
            Self::Element(path, place) => write!(formatter, "{path}.{place}"),
        }
    }
}

/// One value of any kind.
struct Fill<'a>(&'a Kind, &'a mut [u8], Path<'a>);

impl<'de> DeserializeSeed<'de> for Fill<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        let Self(kind, bytes, path) = self;
        match kind {
            Kind::Number(number) => from.deserialize_any(OfNumber(*number, bytes, path)),
            Kind::List(element, length) => {
                from.deserialize_any(Elements(element, *length, bytes, path))
            }
            Kind::Tag(variants) => from.deserialize_any(OfTag(variants, bytes, path)),
            Kind::Record(record) => from.deserialize_any(Fields(record, bytes, path)),
        }
    }
}

struct Fields<'a>(&'a Record, &'a mut [u8], Path<'a>);

impl<'de> Visitor<'de> for Fields<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(record, _, path) = self;
        let names: Vec<&str> = shown(record).map(|(name, _)| name.as_str()).collect();
        write!(
            formatter,
            "an object with {} for `{path}`",
            names.join(", ")
        )
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Self(record, bytes, path) = self;
        let mut seen = Vec::new();
        while let Some(name) = map.next_key::<String>()? {
            let there = || {
                let names: Vec<&str> = shown(record).map(|(name, _)| name.as_str()).collect();
                names.join(", ")
            };
            let Some((at, kind)) = record.field(&name) else {
                return Err(A::Error::custom(format_args!(
                    "`{path}` has no field `{name}`; its fields are {}",
                    there()
                )));
            };
            if seen.contains(&at) {
                let what = format_args!("`{name}` stands twice in `{path}`");
                return Err(A::Error::custom(what));
            }
            seen.push(at);
            let bytes = &mut bytes[at..at + kind.size()];
            map.next_value_seed(Fill(kind, bytes, Path::Field(&path, &name)))?;
        }
        Ok(())
    }
}

impl Record {
    /// The offset of a field in bytes, and its kind; `None` for a field that tools do not show.
    fn field(&self, wanted: &str) -> Option<(usize, &Kind)> {
        let mut at = 0;
        for (name, kind) in &self.fields {
            if name == wanted && !name.starts_with("reserved") {
                return Some((at, kind));
            }
            at += kind.size();
        }
        None
    }
}

struct Elements<'a>(&'a Kind, usize, &'a mut [u8], Path<'a>);

impl<'de> Visitor<'de> for Elements<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(_, length, _, path) = self;
        write!(formatter, "a list of at most {length} in `{path}`")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        let Self(element, length, bytes, path) = self;
        for (place, bytes) in bytes.chunks_exact_mut(element.size()).enumerate() {
            let seed = Fill(element, bytes, Path::Element(&path, place));
            if list.next_element_seed(seed)?.is_none() {
                return Ok(());
            }
        }
        match list.next_element::<serde::de::IgnoredAny>()? {
            None => Ok(()),
            Some(_) => {
                let expected = format!("a list of at most {length} in `{path}`");
                Err(A::Error::invalid_length(length + 1, &expected.as_str()))
            }
        }
    }
}

struct OfTag<'a>(&'a Variants, &'a mut [u8], Path<'a>);

impl Visitor<'_> for OfTag<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(variants, _, path) = self;
        let names: Vec<&str> = variants.iter().map(|(_, name)| name.as_str()).collect();
        write!(
            formatter,
            "one of {}, or a code from 0 to 255, in `{path}`",
            names.join(", ")
        )
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        let named = |(_, name): &&(u8, String)| name.eq_ignore_ascii_case(text);
        match self.0.iter().find(named) {
            Some((code, _)) => self.1.fill(*code),
            None => return Err(E::invalid_value(Unexpected::Str(text), &self)),
        }
        Ok(())
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<(), E> {
        match u8::try_from(number) {
            Ok(code) => self.1.fill(code),
            Err(_) => return Err(E::invalid_value(Unexpected::Unsigned(number), &self)),
        }
        Ok(())
    }
}

struct OfNumber<'a>(Number, &'a mut [u8], Path<'a>);

impl Visitor<'_> for OfNumber<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number, _, path) = self;
        match number.range() {
            Some((least, greatest)) => write!(
                formatter,
                "a whole number from {least} to {greatest} in `{path}`"
            ),
            None => write!(formatter, "a number in `{path}`"),
        }
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        match self.0.put_whole(value.into(), self.1) {
            true => Ok(()),
            false => Err(E::invalid_value(Unexpected::Unsigned(value), &self)),
        }
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<(), E> {
        match self.0.put_whole(value.into(), self.1) {
            true => Ok(()),
            false => Err(E::invalid_value(Unexpected::Signed(value), &self)),
        }
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<(), E> {
        match self.0.put_fraction(value, self.1) {
            true => Ok(()),
            false => Err(E::invalid_value(Unexpected::Float(value), &self)),
        }
    }

    /// JSON shows a fraction that is not a number as null.
    fn visit_unit<E: Error>(self) -> Result<(), E> {
        match self.0.put_fraction(f64::NAN, self.1) {
            true => Ok(()),
            false => Err(E::invalid_type(Unexpected::Unit, &self)),
        }
    }
}

impl Number {
    /// Writes a fraction, if this type can hold a fraction of that size.
    fn put_fraction(self, value: f64, to: &mut [u8]) -> bool {
        match self {
            Self::F64 => to.copy_from_slice(&value.to_ne_bytes()),
            Self::F32 if value.is_finite() && !(value as f32).is_finite() => return false,
            Self::F32 => to.copy_from_slice(&(value as f32).to_ne_bytes()),
            _ => return false,
        }
        true
    }
}
