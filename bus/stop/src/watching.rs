//! The thread that watches the stop word's file, so that the bridge's main loop needs no system
//! call for it. It sleeps until the file is written to, removed, replaced or cut short. Then it
//! mends the file and rings. A file that is removed, replaced or cut short stops the robot.
//!
//! It watches the file, its folder, and the folder above, which may be moved. If the kernel has no
//! watch to give, the thread looks every 20 ms.

use std::fmt;
use std::io::{Error, ErrorKind};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;

use lager_topics::StopCause;
use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};
use rustix::fs::inotify::{self, CreateFlags, WatchFlags};

use super::mapping::{Identity, Page};
use crate::StopError;

/// How often the thread looks without a watch, and after a failure.
const LOOK: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 20_000_000,
};

/// The watching thread; it ends when this is dropped.
pub(crate) struct WatchingThread {
    end: Option<Arc<OwnedFd>>,
    thread: Option<JoinHandle<()>>,
}

impl WatchingThread {
    /// Watches the file of `page`, and rings at every change of it.
    ///
    /// Without the thread, the bridge still reads the word but does not notice a removed file.
    pub(crate) fn start(page: Arc<Page>, ring: impl Fn() + Send + 'static) -> Self {
        let started = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)
            .map_err(Error::from)
            .map(Arc::new)
            .and_then(|end| {
                let told = Arc::clone(&end);
                let thread = std::thread::Builder::new().name("stop-word".to_owned());
                let thread = thread.spawn(move || run(&page, &ring, &told))?;
                Ok((end, thread))
            });
        match started {
            Ok((end, thread)) => Self {
                end: Some(end),
                thread: Some(thread),
            },
            Err(error) => {
                tracing::error!("the stop word is not watched: {error}");
                Self {
                    end: None,
                    thread: None,
                }
            }
        }
    }
}

impl Drop for WatchingThread {
    fn drop(&mut self) {
        if let Some(end) = &self.end {
            let _ = rustix::io::write(end, &1_u64.to_ne_bytes());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl fmt::Debug for WatchingThread {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("WatchingThread")
            .finish_non_exhaustive()
    }
}

fn run(page: &Page, ring: &impl Fn(), end: &OwnedFd) {
    let mut mapped = page.opened;
    let mut watch = None;
    let mut complained = false;
    loop {
        match look(page, mapped, watch.take()) {
            Ok(seen) => {
                mapped = seen.0;
                watch = Some(seen.1);
                complained = false;
            }
            Err(error) => {
                // No other process can reach the mapped page, and no new file can be put in its
                // place.
                if !page.path().exists() {
                    page.stop(StopCause::WordRemoved);
                }
                if !complained {
                    complained = true;
                    tracing::error!("{}", StopError::new(page.path(), &error));
                }
            }
        }
        ring();
        let at_most = watch.is_none().then_some(LOOK);
        let mut fds = vec![PollFd::new(end, PollFlags::IN)];
        fds.extend(watch.iter().map(|watch| PollFd::new(watch, PollFlags::IN)));
        let _ = poll(&mut fds, at_most.as_ref());
        if !fds[0].revents().is_empty() {
            return;
        }
        drop(fds);
        if let Some(watch) = &watch {
            drain(watch);
        }
    }
}

/// Looks after the file, and watches it from before the last look on.
fn look(
    page: &Page,
    mut mapped: Identity,
    mut watch: Option<OwnedFd>,
) -> Result<(Identity, OwnedFd), Error> {
    loop {
        let seen = page.verify(mapped)?;
        match watch {
            Some(watch) if seen == mapped => return Ok((seen, watch)),
            // The watch does not report what happened before it began, so look again.
            _ => {
                watch = match listen(page.path()) {
                    Err(error) if error.kind() == ErrorKind::NotFound => None,
                    listening => Some(listening?),
                };
            }
        }
        mapped = seen;
    }
}

/// A watch on the file at `path` and on the two folders that it lies in.
fn listen(path: &Path) -> Result<OwnedFd, Error> {
    let watch = inotify::init(CreateFlags::CLOEXEC | CreateFlags::NONBLOCK)?;
    let gone = WatchFlags::DELETE_SELF | WatchFlags::MOVE_SELF;
    let file = gone | WatchFlags::MODIFY | WatchFlags::ATTRIB;
    inotify::add_watch(&watch, path, file)?;
    let names = WatchFlags::CREATE | WatchFlags::MOVED_TO | WatchFlags::ONLYDIR;
    let mut folders = path.ancestors().skip(1);
    if let Some(folder) = folders.next() {
        inotify::add_watch(&watch, folder, gone | names)?;
    }
    if let Some(above) = folders.next() {
        inotify::add_watch(&watch, above, gone | WatchFlags::ONLYDIR)?;
    }
    Ok(watch)
}

/// Discards the events: each of them only means that the thread must look.
fn drain(watch: &OwnedFd) {
    let mut events = [0_u8; 4096];
    while matches!(rustix::io::read(watch, &mut events), Ok(1..)) {}
}
