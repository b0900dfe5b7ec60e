//! Prints a sentence when this program touches a missing part of a shared file: somebody has cut
//! the file short, or `/dev/shm` is full. The kernel then sends SIGBUS, and without this handler
//! the shell says only "bus error".

#![allow(
    unsafe_code,
    reason = "a handler of signals may only do what is safe within one, which the compiler does not check"
)]

use anyhow::{Context, Result};
use signal_hook::consts::SIGBUS;

/// The sentences, made beforehand because a signal handler must not allocate.
const CUT: &[u8] = b"lager: a shared file of the bus was cut short (SIGBUS); \
`lager doctor --fix` mends the bus\n";
const FULL: &[u8] = b"lager: /dev/shm is full (ENOSPC, SIGBUS); `lager doctor --fix` removes what \
dead processes left there, `mount -o remount,size=256M /dev/shm` enlarges it\n";

/// If less than this is free, in bytes, the cause is a full `/dev/shm`.
const LEFT: u64 = 64 * 1024;

/// From now on SIGBUS ends this process with a sentence.
pub fn say_so() -> Result<()> {
    let end = || {
        let said = if is_full() { FULL } else { CUT };
        // SAFETY: the pointer and the length are those of a constant.
        unsafe { libc::write(libc::STDERR_FILENO, said.as_ptr().cast(), said.len()) };
        // SAFETY: it ends the process at once and runs nothing of it.
        unsafe { libc::_exit(1) };
    };
    // SAFETY: `statfs`, `write` and `_exit` are all it calls. The last two may be called in a
    // handler, and the first is a bare system call.
    let registered = unsafe { signal_hook::low_level::register(SIGBUS, end) };
    registered.context("cannot listen to signals")?;
    Ok(())
}

/// Whether `/dev/shm` has no room left.
fn is_full() -> bool {
    let mut found = core::mem::MaybeUninit::<libc::statfs>::zeroed();
    // SAFETY: the path is a constant that ends with a zero, and there is room for the answer.
    let asked = unsafe { libc::statfs(c"/dev/shm".as_ptr(), found.as_mut_ptr()) };
    // SAFETY: zeros are one, and the call has written nothing else into it.
    let found = unsafe { found.assume_init() };
    let block = u64::try_from(found.f_bsize).unwrap_or_default();
    asked == 0 && found.f_bavail.saturating_mul(block) < LEFT
}
