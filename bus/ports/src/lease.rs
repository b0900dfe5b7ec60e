//! Whether any process has a file open: the kernel answers that with a write lease.
//!
//! The kernel grants a write lease on a file only if no other process has it open or mapped, in any
//! container or namespace; while the lease lasts, a process that opens the file waits. So a file
//! under a lease has no users, and nothing needs to be guessed from ages or process ids. Every file
//! of the transport is open in its process for as long as the process uses it, also while it makes
//! the file: a file that can be leased has been left behind.

#![allow(
    unsafe_code,
    reason = "leases are asked for by fcntl, which rustix has no calls for"
)]

use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Linux's number for the request; `libc` has none.
const F_SETSIG: i32 = 10;

/// Removes a file that no process has open; returns whether it did.
pub(crate) fn remove_unused(path: &Path) -> bool {
    let Ok(file) = open(path) else {
        return false;
    };
    // It ends with the file.
    lease(&file).is_ok() && std::fs::remove_file(path).is_ok()
}

/// Whether a process has a file open. A file that cannot be asked about counts as used.
pub(crate) fn is_used(path: &Path) -> bool {
    match open(path) {
        Ok(file) => lease(&file).is_err(),
        Err(error) => error.kind() != ErrorKind::NotFound,
    }
}

/// An unfinished segment can only be written, a finished description can only be read.
fn open(path: &Path) -> Result<File, Error> {
    let how = |options: &mut OpenOptions| {
        // Never waits: for a lease of somebody else, or for a pipe's other end.
        options
            .custom_flags(libc::O_NONBLOCK | libc::O_NOFOLLOW)
            .open(path)
    };
    match how(OpenOptions::new().read(true)) {
        Err(error) if error.kind() == ErrorKind::PermissionDenied => {
            how(OpenOptions::new().write(true))
        }
        opened => opened,
    }
}

fn lease(file: &File) -> Result<(), Error> {
    let ask = |request, argument: i32| {
        // SAFETY: the descriptor is open, and both requests take a number.
        match unsafe { libc::fcntl(file.as_raw_fd(), request, argument) } {
            -1 => Err(Error::last_os_error()),
            _ => Ok(()),
        }
    };
    // If a process opens the file meanwhile, the kernel sends this signal instead of SIGIO, which
    // would end this process; this one is ignored.
    ask(F_SETSIG, libc::SIGURG)?;
    ask(libc::F_SETLEASE, libc::F_WRLCK)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

    use super::*;

    fn scene(name: &str) -> PathBuf {
        let path = Path::new("/dev/shm").join(format!("lplease{}{name}", std::process::id()));
        std::fs::write(&path, [7; 100]).unwrap();
        path
    }

    #[test]
    fn a_file_is_used_while_anybody_reads_writes_or_maps_it() {
        let path = scene("a");
        assert!(!is_used(&path));
        for write in [false, true] {
            let file = OpenOptions::new().read(true).write(write).open(&path);
            let file = file.unwrap();
            assert!(is_used(&path) && !remove_unused(&path));
            // SAFETY: a fresh mapping at an address of the kernel's choice.
            let place = unsafe {
                mmap(
                    core::ptr::null_mut(),
                    100,
                    ProtFlags::READ,
                    MapFlags::SHARED,
                    &file,
                    0,
                )
                .unwrap()
            };
            drop(file);
            assert!(is_used(&path) && !remove_unused(&path));
            // SAFETY: mapped above and referred to by nobody.
            unsafe { munmap(place, 100).unwrap() };
            assert!(!is_used(&path));
        }
        assert!(remove_unused(&path));
        assert!(!path.exists() && !is_used(&path));
    }

    #[test]
    fn who_opens_a_file_that_is_looked_at_is_not_disturbed() {
        let path = scene("b");
        std::thread::scope(|scope| {
            let looker = scope.spawn(|| {
                for _ in 0..2000 {
                    is_used(&path);
                }
            });
            while !looker.is_finished() {
                drop(File::open(&path).unwrap());
            }
        });
        assert!(remove_unused(&path));
    }
}
