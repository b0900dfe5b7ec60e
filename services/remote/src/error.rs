//! [`RemoteError`]: why nothing can be heard of a robot elsewhere.

use std::path::PathBuf;
use std::time::Duration;

use lager_home::UnitName;
use lager_sample::DescriptionError;

use crate::endpoint::Endpoint;
use crate::session::ZenohError;

/// How long a gateway has for an answer.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);
/// The largest payload that is read, in bytes. The largest of the robot's table is far smaller.
pub(crate) const LARGEST: usize = 16 << 20;

/// Why nothing can be heard of a robot.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// TLS needs certificates.
    #[error(
        "{0} needs certificates; name authority, certificate and key of this listener in \
         [gateway.zenoh], as `lager keys` makes them"
    )]
    NoProof(Endpoint),
    /// A file of the certificates cannot be read.
    #[error("cannot read {file}: {error}; `lager keys` makes it")]
    Proof {
        /// Which.
        file: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// There is no connection.
    #[error(
        "no connection to {endpoint}: {cause}; `lager gateway --zenoh ENDPOINT` on the robot says \
         where it listens"
    )]
    Connect {
        /// Where.
        endpoint: Endpoint,
        /// Why, in Zenoh's words if it has told no more.
        cause: String,
    },
    /// The gateway is there and says nothing of this robot.
    #[error(
        "no gateway of the robot `{robot}` answers at {endpoint}: another robot is there, or its \
         certificate is not that of `{robot}`; --name chooses another robot"
    )]
    Silent {
        /// Which robot.
        robot: UnitName,
        /// Where.
        endpoint: Endpoint,
    },
    /// The gateway does not carry the topic.
    #[error("`{topic}` is not sent by the gateway of `{robot}`; it sends {}", .carried.join(", "))]
    NotCarried {
        /// Which.
        topic: String,
        /// Of which robot.
        robot: UnitName,
        /// What it carries.
        carried: Vec<String>,
    },
    /// The layout is none.
    #[error("`{topic}`: {error}")]
    Layout {
        /// Of which topic.
        topic: String,
        /// Why.
        error: DescriptionError,
    },
    /// A payload would be too large.
    #[error("`{topic}` has payloads of {bytes} bytes, more than {LARGEST}, and is not read")]
    TooLarge {
        /// Which.
        topic: String,
        /// How large.
        bytes: usize,
    },
    /// Zenoh cannot.
    #[error("Zenoh cannot: {0}")]
    Zenoh(#[from] ZenohError),
    /// The system gives no thread.
    #[error("no thread can be started for the gateway: {0}")]
    Thread(std::io::Error),
    /// Somebody has ended it.
    #[error("interrupted")]
    Ended,
}
