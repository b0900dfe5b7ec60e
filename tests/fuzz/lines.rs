//! Any bytes as lines of the text languages, held to the laws that the ordinary tests ask for:
//!
//! ```text
//! cargo +nightly fuzz run --fuzz-dir tests/fuzz lines /tmp/found bus/lines/tests/corpus
//! ```
//!
//! What it finds goes to the first folder; what is worth keeping, to the second one.

#![no_main]

#[path = "../../bus/lines/tests/lines/laws.rs"]
mod laws;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    laws::hold(bytes);
});
