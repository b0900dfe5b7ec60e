//! Locks on single bytes of an open file. The kernel releases them when their holder dies.
//!
//! They belong to the open file and not to the process. So two buses in one process exclude each
//! other as two processes do, and no process id has to be trusted. To unlock, this module names the
//! byte; to close the file is not enough, because a child that is just being forked shares the open
//! file until it executes its program.

#![allow(
    unsafe_code,
    reason = "rustix has locks for whole files only, and those belong to the process"
)]

use core::ffi::c_int;
use std::fs::File;
use std::io::{Error, ErrorKind};
use std::os::fd::AsRawFd;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Shared,
    Exclusive,
}

/// Locks a byte, or changes the kind of the lock held on it; false if another open file holds it.
pub(super) fn try_lock(file: &File, byte: u64, kind: Kind) -> Result<bool, Error> {
    let kind = match kind {
        Kind::Shared => libc::F_RDLCK,
        Kind::Exclusive => libc::F_WRLCK,
    };
    match command(file, libc::F_OFD_SETLK, byte, kind) {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == ErrorKind::WouldBlock => Ok(false),
        Err(error) => Err(error),
    }
}

/// Unlocks a byte. The byte need not be locked.
pub(super) fn unlock(file: &File, byte: u64) {
    // Unlocking fails only when the kernel has no memory for its list. Closing the file then
    // unlocks.
    let _ = command(file, libc::F_OFD_SETLK, byte, libc::F_UNLCK);
}

/// Whether another open file holds a byte exclusively.
pub(super) fn is_held(file: &File, byte: u64) -> Result<bool, Error> {
    let met = command(file, libc::F_OFD_GETLK, byte, libc::F_RDLCK)?;
    Ok(met != libc::F_UNLCK)
}

/// Calls `fcntl` once; returns the kind of lock that the call leaves in its argument.
fn command(file: &File, command: c_int, byte: u64, kind: c_int) -> Result<c_int, Error> {
    let mut lock = libc::flock {
        // The constants are small. The field's type differs between machines.
        l_type: kind as libc::c_short,
        l_whence: libc::SEEK_SET as libc::c_short,
        l_start: byte as libc::off_t,
        l_len: 1,
        l_pid: 0,
    };
    loop {
        // SAFETY: the descriptor is open while `file` is borrowed, and `lock` is a complete `flock`
        // that only this call reads and writes.
        let done = unsafe { libc::fcntl(file.as_raw_fd(), command, &raw mut lock) };
        if done == 0 {
            return Ok(c_int::from(lock.l_type));
        }
        let error = Error::last_os_error();
        if error.kind() != ErrorKind::Interrupted {
            return Err(error);
        }
    }
}
