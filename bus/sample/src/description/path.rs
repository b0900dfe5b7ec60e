//! Finds fields by their dotted path, such as `sensor.bad_crc` or `orders.0.product`.

use core::fmt;

use super::{Description, Kind, Record, shown};

/// The path leads to no field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoField {
    /// The path.
    pub path: String,
    /// The part of the path that exists; empty if the path's first part is wrong.
    pub known: String,
    /// What could stand after that part.
    pub there: String,
}

impl fmt::Display for NoField {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, known, there } = self;
        let whose = match known.as_str() {
            "" => "the payload".to_owned(),
            known => format!("`{known}`"),
        };
        write!(formatter, "there is no field `{path}`; {whose} has {there}")
    }
}

impl core::error::Error for NoField {}

impl Description {
    /// Checks that `path` leads to a field that tools show. A number is a place in a list.
    ///
    /// # Errors
    /// The path leads to no such field.
    pub fn must_have(&self, path: &str) -> Result<(), NoField> {
        let mut at = Kind::Record(self.record.clone());
        let mut known = String::new();
        for part in path.split('.') {
            let next = match &at {
                Kind::Record(record) => {
                    let mut fields = shown(record);
                    fields.find(|(name, _)| name == part).map(|(_, kind)| kind)
                }
                Kind::List(element, length) => {
                    let place: Option<usize> = part.parse().ok();
                    place.filter(|place| place < length).map(|_| &**element)
                }
                Kind::Number(_) | Kind::Tag(_) => None,
            };
            let Some(next) = next.cloned() else {
                let (path, there) = (path.to_owned(), at.there());
                return Err(NoField { path, known, there });
            };
            if !known.is_empty() {
                known.push('.');
            }
            known.push_str(part);
            at = next;
        }
        Ok(())
    }
}

impl Kind {
    /// What may follow it in a path, in words.
    fn there(&self) -> String {
        match self {
            Self::Record(record) => names(record),
            Self::List(_, length) => format!("the places 0 to {}", length - 1),
            Self::Number(_) | Self::Tag(_) => "no parts".to_owned(),
        }
    }
}

fn names(record: &Record) -> String {
    let names: Vec<&str> = shown(record).map(|(name, _)| name.as_str()).collect();
    names.join(", ")
}
