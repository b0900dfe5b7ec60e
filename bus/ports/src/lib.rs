//! Typed publishers, subscribers and waiting: the only crate that opens iceoryx2.
