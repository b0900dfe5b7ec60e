//! Writes and reads the attributes in which a service states the layout of its samples.
//!
//! `lager.schema` holds two hashes of layouts; a process with other hashes may not open the
//! service. The process that creates a topic adds `lager.fields.0` to `.6`: the description of the
//! payload in pieces. Tools without the payload's type read samples by this description. No process
//! demands a description, so a program of plain iceoryx2 can create a topic without one.

use std::fmt::Write;

use iceoryx2::prelude::{AttributeSpecifier, AttributeVerifier, SemanticString};
use iceoryx2::service::attribute::{AttributeKey, AttributeSet, AttributeValue};
use lager_sample::{Description, Make, Schema, Stamp, describe};

use crate::fault::Difference;

const SCHEMA: &str = "lager.schema";
const FIELDS: &str = "lager.fields.";

/// Bytes of one attribute's value.
const PIECE: usize = 256;
/// Attributes for the description, besides `lager.schema`.
const PIECES: usize = 7;

/// The attribute in which both sides must agree; otherwise the service cannot be opened.
pub(crate) fn required(layout: [u64; 2]) -> AttributeVerifier {
    AttributeVerifier::new()
        .require(&key(SCHEMA), &hashes(layout))
        .expect("one attribute fits")
}

/// The attributes of a topic that this process creates. A description that is too long is left out;
/// then only programs with the payload's type can read the topic.
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

/// The description that a topic's creator stated, if the topic's header is the one of this build.
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
