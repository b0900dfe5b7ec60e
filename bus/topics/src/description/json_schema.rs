//! A described layout as JSON Schema, for tools that know JSON and nothing of this project.
//!
//! It fits what [`Described`](super::Described) writes and what the payload's own type writes, in
//! which a list may end early and `reserved` fields are left out. Each type says one word, since
//! Foxglove reads no unions. So two samples fit no schema, and no program of ours writes one: a code
//! that no variant has, which JSON shows as its number, and a fraction that is no number, which
//! JSON shows as null.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::{Description, Kind, Number, Record, shown};

impl Description {
    /// The JSON Schema (2020-12) of a payload, to be written by serde.
    pub fn json_schema(&self) -> impl Serialize + '_ {
        OfRecord(&self.record)
    }
}

struct OfRecord<'a>(&'a Record);

struct Of<'a>(&'a Kind);

struct Properties<'a>(&'a Record);

impl Serialize for OfRecord<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let names: Vec<&str> = shown(self.0).map(|(name, _)| name.as_str()).collect();
        let mut map = to.serialize_map(None)?;
        map.serialize_entry("type", "object")?;
        map.serialize_entry("properties", &Properties(self.0))?;
        map.serialize_entry("required", &names)?;
        map.end()
    }
}

impl Serialize for Properties<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(shown(self.0).map(|(name, kind)| (name, Of(kind))))
    }
}

impl Serialize for Of<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        if let Kind::Record(record) = self.0 {
            return OfRecord(record).serialize(to);
        }
        let mut map = to.serialize_map(None)?;
        match self.0 {
            Kind::Record(_) => {}
            Kind::Number(number) => number.schema(&mut map)?,
            Kind::Tag(variants) => {
                let names: Vec<&str> = variants.iter().map(|(_, name)| name.as_str()).collect();
                map.serialize_entry("type", "string")?;
                map.serialize_entry("enum", &names)?;
            }
            Kind::List(element, length) => {
                map.serialize_entry("type", "array")?;
                map.serialize_entry("items", &Of(element))?;
                map.serialize_entry("maxItems", length)?;
            }
        }
        map.end()
    }
}

impl Number {
    fn schema<M: SerializeMap>(self, map: &mut M) -> Result<(), M::Error> {
        let (least, greatest) = match self {
            Self::F32 | Self::F64 => return map.serialize_entry("type", "number"),
            Self::U8 => (0, u64::from(u8::MAX)),
            Self::U16 => (0, u64::from(u16::MAX)),
            Self::U32 => (0, u64::from(u32::MAX)),
            Self::U64 => (0, u64::MAX),
            Self::I8 => (i64::from(i8::MIN), i8::MAX as u64),
            Self::I16 => (i64::from(i16::MIN), i16::MAX as u64),
            Self::I32 => (i64::from(i32::MIN), i32::MAX as u64),
            Self::I64 => (i64::MIN, i64::MAX as u64),
        };
        map.serialize_entry("type", "integer")?;
        map.serialize_entry("minimum", &least)?;
        map.serialize_entry("maximum", &greatest)
    }
}
