//! What other threads see of the station and do with it.
//!
//! The station is behind one lock. No thread holds the lock while it waits for a peer or for the
//! disk.

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use lager_lines::Name;

use crate::station::{Station, Wish, WishRefused};
use crate::warehouse::{Warehouse, WarehouseError};

/// The station, for any thread; clones are of the same one.
#[derive(Clone, Debug)]
pub struct Handle {
    shared: Arc<Shared>,
}

#[derive(Debug)]
pub(crate) struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    /// Wakes the thread of the sockets.
    waker: UnixStream,
}

#[derive(Debug)]
struct State {
    station: Station,
    /// Grows with whatever may have changed.
    revision: u64,
}

impl Handle {
    pub(crate) fn new(station: Station, waker: UnixStream) -> Self {
        Self {
            shared: Arc::new(Shared {
                state: Mutex::new(State {
                    station,
                    revision: 0,
                }),
                changed: Condvar::new(),
                waker,
            }),
        }
    }

    /// Does what a person wants of a robot.
    ///
    /// # Errors
    ///
    /// When it cannot be done; nothing has changed then.
    pub fn wish(&self, robot: &Name, wish: Wish) -> Result<(), WishRefused> {
        let result = self.change(|station| station.wish(robot, wish));
        self.wake();
        result
    }

    /// Gives the station another warehouse, which is then saved.
    ///
    /// # Errors
    ///
    /// When there can be no such warehouse.
    pub fn set_warehouse(&self, warehouse: Warehouse) -> Result<(), WarehouseError> {
        let result = self.change(|station| station.set_warehouse(warehouse));
        self.wake();
        result
    }

    /// Looks at the station, which stands still meanwhile: copy, do not work.
    pub fn look<R>(&self, look: impl FnOnce(&Station) -> R) -> R {
        look(&self.lock().station)
    }

    /// The number of the last change: equal numbers mean equal content.
    pub fn revision(&self) -> u64 {
        self.lock().revision
    }

    /// Waits until the number of the last change is another one than `seen`, at most `timeout`, and
    /// returns it.
    pub fn wait(&self, seen: u64, timeout: Duration) -> u64 {
        let shared = &self.shared;
        let waited = shared
            .changed
            .wait_timeout_while(self.lock(), timeout, |state| state.revision == seen);
        waited.unwrap_or_else(PoisonError::into_inner).0.revision
    }

    /// Takes from the station what nobody sees.
    pub(crate) fn take<R>(&self, take: impl FnOnce(&mut Station) -> R) -> R {
        take(&mut self.lock().station)
    }

    /// Changes the station and tells who waits.
    pub(crate) fn change<R>(&self, change: impl FnOnce(&mut Station) -> R) -> R {
        let mut state = self.lock();
        state.revision += 1;
        let result = change(&mut state.station);
        drop(state);
        self.shared.changed.notify_all();
        result
    }

    fn wake(&self) {
        // One that is full wakes as well.
        let _ = (&self.shared.waker).write(&[0]);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // It is never left half changed: a panic below comes from the handling of one line.
        let state = self.shared.state.lock();
        state.unwrap_or_else(PoisonError::into_inner)
    }
}
