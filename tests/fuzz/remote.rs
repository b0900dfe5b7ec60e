//! A fuzz target: any bytes as what a gateway and its listeners say to each other, under the ordinary
//! tests' laws.
//!
//! ```text
//! cargo +nightly fuzz run --fuzz-dir tests/fuzz remote /tmp/found services/remote/tests/corpus
//! ```

#![no_main]

#[path = "../../services/remote/tests/parsed/laws.rs"]
mod laws;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    laws::hold(bytes);
});
