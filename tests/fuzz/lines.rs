//! A fuzz target: any bytes as lines of the text languages, under the ordinary tests' laws.
//!
//! ```text
//! cargo +nightly fuzz run --fuzz-dir tests/fuzz lines /tmp/found bus/lines/tests/corpus
//! ```
//!
//! New findings go to the first folder. Copy those worth keeping to the second one.
//!
//! It is a workspace of its own, because only a nightly compiler builds it. The corpus and the laws
//! belong to the ordinary tests of `lager-lines`, which mutate the corpus deterministically: ten
//! thousand times, or as often as `tests/soak lines` says.

#![no_main]

#[path = "../../bus/lines/tests/lines/laws.rs"]
mod laws;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    laws::hold(bytes);
});
