//! tracefs where nobody has mounted it: a mount that only this process sees, and that ends with it.
//!
//! It is apart because rustix, as this tree builds it, has no calls for this, so it is the one file
//! here with `unsafe`.
#![allow(unsafe_code, reason = "three system calls without a safe wrapper here")]

use std::ffi::CStr;
use std::io;
use std::os::fd::{AsRawFd as _, FromRawFd as _, OwnedFd};

/// Mounts tracefs at no place of the file system. The folder is `/proc/self/fd/N`.
///
/// # Errors
/// This user may not mount, or the kernel has no tracefs.
pub(crate) fn tracefs() -> io::Result<OwnedFd> {
    const NAME: &CStr = c"tracefs";
    /// The command that makes the file system, from linux/mount.h.
    const CREATE: libc::c_uint = 6;
    const CLOSE_ON_EXEC: libc::c_uint = 1;
    // SAFETY: the name ends with 0 and outlives the call.
    let opened = unsafe { libc::syscall(libc::SYS_fsopen, NAME.as_ptr(), CLOSE_ON_EXEC) };
    let opened = owned(opened)?;
    let nothing = core::ptr::null::<libc::c_char>();
    // SAFETY: this command takes neither key nor value, so both are null.
    let made = unsafe {
        libc::syscall(
            libc::SYS_fsconfig,
            opened.as_raw_fd(),
            CREATE,
            nothing,
            nothing,
            0,
        )
    };
    if made < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: it takes three numbers, and the first is an open descriptor.
    let mounted = unsafe { libc::syscall(libc::SYS_fsmount, opened.as_raw_fd(), CLOSE_ON_EXEC, 0) };
    owned(mounted)
}

fn owned(number: libc::c_long) -> io::Result<OwnedFd> {
    match i32::try_from(number) {
        // SAFETY: the kernel has just made this descriptor, and nobody else has its number.
        Ok(number) if number >= 0 => Ok(unsafe { OwnedFd::from_raw_fd(number) }),
        _ => Err(io::Error::last_os_error()),
    }
}
