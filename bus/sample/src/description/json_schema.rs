//! A described layout as JSON Schema, for tools that know JSON and nothing of this project.
//!
//! The schema fits the output of [`Described`](super::Described) and of the payload's own type,
//! which may end lists early and leaves out `reserved` fields. Each type is one word, because
//! Foxglove reads no unions. So two kinds of sample do not fit their schema, and no program of this
//! project writes them: a code that no variant has, which JSON shows as its number, and a fraction
//! that is not a number, which JSON shows as null.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::{Description, Kind, Number, Record, shown};

impl Description {
    /// The JSON Schema (2020-12) of a payload, which serde can serialize.
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
        let Some((least, greatest)) = self.range() else {
            return map.serialize_entry("type", "number");
        };
        map.serialize_entry("type", "integer")?;
        map.serialize_entry("minimum", &least)?;
        map.serialize_entry("maximum", &greatest)
    }
}
