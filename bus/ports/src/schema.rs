//! What a service says of its samples, in its attributes.
//!
//! `lager.schema` holds two hashes of layouts; a process that has others is refused. Only who
//! creates a topic adds `lager.fields.0` to `.6`, the description of the payload in pieces, by
//! which tools read samples that they have no type for. Nobody requires it, so that a process of
//! plain iceoryx2 may create a topic without it.

use std::fmt::Write;

use iceoryx2::prelude::{AttributeSpecifier, AttributeVerifier, SemanticString};
use iceoryx2::service::attribute::{AttributeKey, AttributeSet, AttributeValue};
use lager_topics::{Description, Make, Schema, Stamp, describe};

use crate::fault::Difference;

const SCHEMA: &str = "lager.schema";
const FIELDS: &str = "lager.fields.";

/// Bytes of one attribute's value.
const PIECE: usize = 256;
/// Attributes of a service besides the schema.
const PIECES: usize = 7;

/// What both sides must share: a difference refuses the service.
pub(crate) fn required(layout: [u64; 2]) -> AttributeVerifier {
    AttributeVerifier::new()
        .require(&key(SCHEMA), &hashes(layout))
        .expect("one attribute fits")
}

/// What a topic's creator says of it. A description that is too long is left out, and the topic can
/// then be read only by who has its type.
pub(crate) fn stated(make: &Make, layout: [u64; 2]) -> AttributeSpecifier {
    let mut stated = AttributeSpecifier::new()
        .define(&key(SCHEMA), &hashes(layout))
        .expect("one attribute fits");
    let text = describe(make);
    if text.len() > PIECE * PIECES {
        return stated;
    }
    for (number, piece) in text.as_bytes().chunks(PIECE).enumerate() {
        let value = AttributeValue::new(piece).expect("a piece is neither empty nor too long");
        stated = stated
            .define(&key(&format!("{FIELDS}{number}")), &value)
            .expect("seven more attributes fit");
    }
    stated
}

/// The description that a topic's creator gave, if the topic has this build's header.
pub(crate) fn described(attributes: &AttributeSet) -> Result<Description, Difference> {
    let value = |name: &str| attributes.key_value(&key(name), 0);
    let schema = value(SCHEMA).ok_or(Difference::Undescribed)?;
    let mut header = String::new();
    // Writing to a String cannot fail.
    let _ = write!(header, ".{:016x}", Stamp::HASH);
    if !schema.as_bytes().ends_with(header.as_bytes()) {
        return Err(Difference::Schema);
    }
    let mut text = Vec::new();
    for number in 0..PIECES {
        match value(&format!("{FIELDS}{number}")) {
            Some(piece) => text.extend_from_slice(piece.as_bytes()),
            None => break,
        }
    }
    let text = core::str::from_utf8(&text).map_err(|_| Difference::Undescribed)?;
    Description::parse(text).map_err(|_| Difference::Undescribed)
}

fn key(name: &str) -> AttributeKey {
    AttributeKey::new(name.as_bytes()).expect("the key is short and not empty")
}

fn hashes([first, second]: [u64; 2]) -> AttributeValue {
    AttributeValue::new(format!("{first:016x}.{second:016x}").as_bytes())
        .expect("two hashes are short and not empty")
}
