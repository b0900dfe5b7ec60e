//! Where a bus lives: its folder and names, its clock, and its processes' locks and signs of life.
//!
//! This crate never opens the bus. So all of it works where the bus does not: when the bus's files
//! are gone or damaged, when every place on it is taken, and when no process answers.
//!
//! * [`Home`] is the folder. A unit, such as a robot, has a [`UnitName`] and a folder of its own.
//! * [`Lock`] says which process plays a part. [`Home::up`] says which processes run.
//! * [`Watched`] is a service that a supervisor keeps alive. [`Home::asked`] is what people have
//!   ordered in a terminal.
//! * [`Clock`] shows the unit's time. [`Life`] is a process's sign that it goes on, and [`Chance`]
//!   says for how much of a silence the process could have run at all.
//! * [`mend()`] removes the files that killed processes have left. [`Inventory`] notices missing
//!   files, [`BusWatch`] every change. [`Shortage`] says which resource is used up.

mod asked;
mod chance;
mod changes;
mod clock;
mod descriptions;
mod error;
mod home;
mod in_use;
mod inventory;
mod life;
mod lock;
mod mend;
mod name;
mod presence;
mod shortage;
mod watched;

pub use chance::{Chance, ChanceClock};
pub use changes::BusWatch;
pub use clock::{Clock, ClockError, ClockSource};
pub use descriptions::Descriptions;
pub use error::HomeError;
pub use home::{Home, LONGEST_SOCKET, OtherHome, other_homes};
pub use in_use::remove_unused;
pub use inventory::Inventory;
pub use life::{Life, Sign};
pub use lock::{Lock, LockError};
pub use mend::{Mended, damaged, mend, protect, refuse_foreign, unfinished};
pub use name::{UnitName, UnitNameError};
pub use presence::Holder;
pub use shortage::{SHARED_MEMORY, Shortage};
pub use watched::Watched;
