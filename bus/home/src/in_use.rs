//! Asks the kernel whether any process has a file open, and removes files that none has open.
//!
//! The kernel gives a process the sole use of a file (`F_SETLEASE`) only if no other process has
//! the file open or mapped, in any container or namespace. While that lasts, a process that opens
//! the file waits. So this guesses nothing from ages or process ids. A process has every file of
//! the transport open for as long as it uses the file, also while it makes the file. So a file that
//! a process can have alone was left behind.

#![allow(
    unsafe_code,
    reason = "F_SETLEASE is a request to fcntl that rustix has no call for"
)]

use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Linux's number for this request, which `libc` lacks.
const F_SETSIG: i32 = 10;

/// Removes a file if no process has it open; returns whether it did.
pub fn remove_unused(path: &Path) -> bool {
    let Ok(file) = open(path) else {
        return false;
    };
    // Dropping `file` ends the sole use.
    have_alone(&file).is_ok() && std::fs::remove_file(path).is_ok()
}

/// Whether a process has a file open. A file that cannot be opened counts as used.
pub(crate) fn is_used(path: &Path) -> bool {
    match open(path) {
        Ok(file) => have_alone(&file).is_err(),
        Err(error) => error.kind() != ErrorKind::NotFound,
    }
}

/// An unfinished segment can only be opened for writing, a finished description only for reading.
fn open(path: &Path) -> Result<File, Error> {
    let how = |options: &mut OpenOptions| {
        // Never waits for a process that has the file alone, nor for the other end of a pipe.
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

fn have_alone(file: &File) -> Result<(), Error> {
    let ask = |request, argument: i32| {
        // SAFETY: the descriptor is open, and both requests take a number.
        match unsafe { libc::fcntl(file.as_raw_fd(), request, argument) } {
            -1 => Err(Error::last_os_error()),
            _ => Ok(()),
        }
    };
    // If a process opens the file meanwhile, the kernel sends this process a signal. The default,
    // SIGIO, would end it; SIGURG is ignored.
    ask(F_SETSIG, libc::SIGURG)?;
    ask(libc::F_SETLEASE, libc::F_WRLCK)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

    use super::*;

    fn scene(name: &str) -> PathBuf {
        let path = Path::new("/dev/shm").join(format!("lpused{}{name}", std::process::id()));
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
