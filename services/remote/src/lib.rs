//! The robot's topics for listeners on other computers, over Zenoh: both ends.
//!
//! ```text
//!   bus ──> gateway: Carrier ──limit──> Zenoh ──> Remote, Listening: a listener ──> tools
//!                     └─ numbers and counts what it sends          └─ Ledger: what is missing, where
//! ```
//!
//! - `key` and `note` are what programs in other languages need to know: where samples are found, and
//!   what stands beside each of them.
//! - `limit`, `allowed`, `endpoint`, `settings`, `told` and `ledger` are pure.
//! - `clocks` is pure, too: how far apart the robot's clock and this machine's are.
//! - `place` makes a gateway a place like a bus, so that tools have one code for both.
//! - `session`, `robot`, `router`, `remote` and `listener` speak to the network; only with the feature `zenoh`.
//!
//! **A listener only listens.** The robot's end has no bus and gets samples from whoever reads one.
//! Its rules let listeners subscribe and ask, and refuse everything else that Zenoh could carry.

#![forbid(unsafe_code)]

mod allowed;
mod clocks;
mod endpoint;
mod key;
mod ledger;
mod limit;
mod note;
mod settings;
mod told;

#[cfg(feature = "zenoh")]
mod causes;
#[cfg(feature = "zenoh")]
mod certificates;
#[cfg(feature = "zenoh")]
mod error;
#[cfg(feature = "zenoh")]
mod heard;
#[cfg(feature = "zenoh")]
mod listener;
#[cfg(feature = "zenoh")]
mod place;
#[cfg(feature = "zenoh")]
mod remote;
#[cfg(feature = "zenoh")]
mod robot;
#[cfg(feature = "zenoh")]
mod router;
#[cfg(feature = "zenoh")]
mod session;
#[cfg(feature = "zenoh")]
mod typed;

pub use allowed::{Allowed, AllowedError};
#[cfg(feature = "zenoh")]
pub use causes::causes;
#[cfg(feature = "zenoh")]
pub use certificates::{AUTHORITY, CertificateError, Holder, Made, make};
pub use clocks::{Clocks, Offset};
pub use endpoint::{Endpoint, EndpointError, HostPort, USUAL_ZENOH};
#[cfg(feature = "zenoh")]
pub use error::RemoteError;
pub use key::{Keys, is_carried};
pub use ledger::{Account, Heard, Ledger};
pub use limit::{Limit, Verdict};
#[cfg(feature = "zenoh")]
pub use listener::Listening;
pub use note::{Counts, Note, NoteError, layout_number};
#[cfg(feature = "zenoh")]
pub use remote::{Hub, Remote};
#[cfg(feature = "zenoh")]
pub use robot::{Carrier, CarrierError, may_be_had};
#[cfg(feature = "zenoh")]
pub use router::Router;
#[cfg(feature = "zenoh")]
pub use session::ZenohError;
pub use settings::{Proof, Settings, SettingsError};
pub use told::{About, Beat, Ends, Kind, RobotTime, Time, Told};
#[cfg(feature = "zenoh")]
pub use typed::Typed;

/// For tests that listen as any other program does.
#[cfg(feature = "zenoh")]
#[doc(hidden)]
pub use zenoh;
