//! The kernel's description of an event: the file `format` of its folder in tracefs.
//!
//! Kernels differ in the fields of an event, their places and the bits of a thread's state, so each
//! kernel's own description is read. This file reads text and opens nothing.

/// The description of one event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Format {
    /// The event's name, such as `sched_switch`.
    pub name: String,
    /// The number that stands in front of each such event.
    pub id: u16,
    /// Its fields, those that all events have included.
    pub fields: Vec<Field>,
    /// The names of bits in the order of the text, such as `(4, "T")`.
    pub bits: Vec<(u64, String)>,
}

/// Where a field stands in an event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Bytes from the beginning of the event.
    pub offset: usize,
    /// Its length in bytes.
    pub size: usize,
    /// Whether it holds the place and length of a text behind the event's fields.
    pub elsewhere: bool,
}

/// Why a description was not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// A line that every description has is not there.
    #[error("the description of an event has no line `{0}`")]
    Missing(&'static str),
    /// A field has no name, offset or size.
    #[error("the description of an event has a field that is not understood: {0}")]
    Field(String),
}

impl Format {
    /// Reads a description.
    ///
    /// # Errors
    /// It is no description of an event.
    pub fn parse(text: &str) -> Result<Self, FormatError> {
        let after = |start: &'static str| {
            let line = text.lines().find_map(|line| line.strip_prefix(start));
            line.map(str::trim).ok_or(FormatError::Missing(start))
        };
        let id = after("ID:")?.parse();
        let fields = text.lines().map(str::trim);
        let fields = fields.filter(|line| line.starts_with("field:"));
        Ok(Self {
            name: after("name:")?.to_owned(),
            id: id.map_err(|_| FormatError::Missing("ID:"))?,
            fields: fields
                .map(|line| field(line).ok_or_else(|| FormatError::Field(line.to_owned())))
                .collect::<Result<_, _>>()?,
            bits: bits(text.split_once("print fmt:").map_or("", |(_, print)| print)),
        })
    }

    /// The field of that name.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }

    /// The bit with that name, such as `T`.
    pub fn bit(&self, name: &str) -> Option<u64> {
        let bit = self.bits.iter().find(|(_, own)| own == name);
        bit.map(|(bit, _)| *bit)
    }
}

/// `field:char prev_comm[16]; offset:8; size:16; signed:0;`, with a tab behind each semicolon.
fn field(line: &str) -> Option<Field> {
    let mut parts = line.split(';').map(str::trim);
    let declared = parts.next()?.strip_prefix("field:")?;
    let number = |name: &str| {
        let part = line.split(';').map(str::trim);
        let mut part = part.filter_map(|part| part.strip_prefix(name));
        part.next()?.parse().ok()
    };
    let name = declared.split_whitespace().next_back()?;
    let name = name.split('[').next()?.trim_start_matches('*');
    (!name.is_empty()).then_some(())?;
    Some(Field {
        name: name.to_owned(),
        offset: number("offset:")?,
        size: number("size:")?,
        elsewhere: declared.starts_with("__data_loc"),
    })
}

/// All `{ 0x00000004, "T" }` of a text.
fn bits(print: &str) -> Vec<(u64, String)> {
    let inside = print.split('{').skip(1);
    let pair = |inside: &str| {
        let (number, name) = inside.split('}').next()?.split_once(',')?;
        let number = number.trim();
        let bit = match number.strip_prefix("0x") {
            Some(digits) => u64::from_str_radix(digits, 16).ok()?,
            None => number.parse().ok()?,
        };
        Some((bit, name.trim().trim_matches('"').to_owned()))
    };
    inside.filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SWITCH: &str = "name: sched_switch
ID: 372
format:
\tfield:unsigned short common_type;\toffset:0;\tsize:2;\tsigned:0;
\tfield:int common_pid;\toffset:4;\tsize:4;\tsigned:1;

\tfield:char prev_comm[16];\toffset:8;\tsize:16;\tsigned:0;
\tfield:long prev_state;\toffset:32;\tsize:8;\tsigned:1;
\tfield:__data_loc char[] name;\toffset:12;\tsize:4;\tsigned:0;
\tfield:void * hrtimer;\toffset:8;\tsize:8;\tsigned:0;

print fmt: \"%s\", __print_flags(REC->prev_state, \"|\", { 0x00000001, \"S\" }, { 0x00000004, \"T\" }), 1
";

    #[test]
    fn places_and_bits_are_those_of_the_kernels_text() {
        let format = Format::parse(SWITCH).expect("a description");
        assert_eq!((format.name.as_str(), format.id), ("sched_switch", 372));
        let place = |name| {
            let field = format.field(name).expect("a field");
            (field.offset, field.size, field.elsewhere)
        };
        assert_eq!(place("common_pid"), (4, 4, false));
        assert_eq!(place("prev_comm"), (8, 16, false));
        assert_eq!(place("prev_state"), (32, 8, false));
        assert_eq!(place("name"), (12, 4, true));
        assert_eq!(place("hrtimer"), (8, 8, false));
        assert_eq!(format.field("nobody"), None);
        assert_eq!([format.bit("T"), format.bit("D")], [Some(4), None]);
    }

    #[test]
    fn what_is_no_description_is_refused() {
        let missing = |text| Format::parse(text).expect_err("no description");
        assert_eq!(missing("ID: 3\n"), FormatError::Missing("name:"));
        assert_eq!(missing("name: a\n"), FormatError::Missing("ID:"));
        let wrong = "name: a\nID: 3\n field:int x; size:4;\n";
        assert!(matches!(missing(wrong), FormatError::Field(_)));
    }
}
