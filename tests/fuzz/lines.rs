//! Any bytes as lines of the text languages, held to the laws that the ordinary tests ask for:
//!
//! ```text
//! cargo +nightly fuzz run --fuzz-dir tests/fuzz lines /tmp/found bus/lines/tests/corpus
//! ```
//!
//! What it finds goes to the first folder; what is worth keeping, to the second one.
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
