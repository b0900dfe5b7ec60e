//! A sentence for a tool that touches a missing part of a shared file: somebody cut the file short,
//! or `/dev/shm` was full when its first use had to find room for it. The kernel then sends SIGBUS,
//! and without this the shell says only "bus error".

#![allow(
    unsafe_code,
    reason = "a handler of signals may only do what is safe within one, which the compiler does not check"
)]

use anyhow::{Context, Result};
use signal_hook::consts::SIGBUS;

/// What is said; made beforehand, since a handler must not allocate.
const SAID: &[u8] =
    b"lager: a shared file of the bus was cut short, or /dev/shm is full (SIGBUS); \
`lager doctor` says which, and `lager doctor --fix` mends the bus\n";

/// From now on SIGBUS ends this process with a sentence.
pub fn say_so() -> Result<()> {
    let end = || {
        // SAFETY: the pointer and the length are those of a constant.
        unsafe { libc::write(libc::STDERR_FILENO, SAID.as_ptr().cast(), SAID.len()) };
        // SAFETY: it ends the process at once and runs nothing of it.
        unsafe { libc::_exit(1) };
    };
    // SAFETY: `write` and `_exit` are all it calls, and both may be called in a handler.
    let registered = unsafe { signal_hook::low_level::register(SIGBUS, end) };
    registered.context("cannot listen to signals")?;
    Ok(())
}
