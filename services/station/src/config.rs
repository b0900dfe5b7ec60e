//! The configuration of a station, and the reasons why one cannot start.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;

use lager_floor::ProductId;
use lager_lines::secret::Secrets;
use lager_lines::{Called, Name, UnknownProduct};
use lager_orders::Reason;
use lager_plant::Warehouse;
use thiserror::Error;

use crate::files::{HeldBy, ReadError};
use crate::station::WishRefused;
use crate::warehouse::LoadError;

/// Where a station listens and what it knows.
#[derive(Debug)]
pub struct ServerConfig {
    /// What the station calls itself.
    pub name: Name,
    /// Where robots connect.
    pub listen: Listen,
    /// The secrets by which robots prove their names. Without secrets the station believes every
    /// robot.
    pub secrets: Secrets,
    /// Where a GaG connects, if one may.
    pub gag: Option<PathBuf>,
    /// The file of the warehouse, in which changes are saved. It need not be there yet.
    pub warehouse: Option<PathBuf>,
    /// The warehouse to use while there is no file. Without it a GaG or a person describes the
    /// warehouse.
    pub otherwise: Option<Warehouse>,
    /// The file of the robots' queues.
    pub queues: Option<PathBuf>,
    /// The folder of the history; `None` keeps none. See [`History`](crate::History).
    pub history: Option<PathBuf>,
    /// The products that robots fetch after those that wait already. A product's name needs the
    /// warehouse's file.
    pub fetch: Vec<(Name, Called)>,
}

/// Where robots connect.
#[derive(Debug)]
pub enum Listen {
    /// At an address. Port 0 takes any free port.
    At(SocketAddr),
    /// At a socket that somebody else has opened.
    On(TcpListener),
}

/// Why there is no station.
#[derive(Debug, Error)]
pub enum ServerError {
    /// Robots could not connect.
    #[error("cannot listen for robots at {at}: {error}; --listen takes another address")]
    Listen {
        /// Where.
        at: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// A GaG could not connect.
    #[error("cannot listen for a GaG at {}: {error}; --gag takes another path", .path.display())]
    Gag {
        /// Where.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Somebody else listens there.
    #[error("another station listens for a GaG at {}; end it, or give --gag another path", .path.display())]
    GagInUse {
        /// Where.
        path: PathBuf,
    },
    /// The warehouse's file holds something else.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// Nobody can read the queues' file.
    #[error(transparent)]
    Queues(#[from] ReadError),
    /// Another station saves in that file.
    #[error(transparent)]
    Held(#[from] HeldBy),
    /// Such a warehouse cannot exist.
    #[error(transparent)]
    Warehouse(#[from] Reason),
    /// No product has this name.
    #[error("robot {robot} is not told to fetch {}: {why}", .why.called)]
    Called {
        /// Which.
        robot: Name,
        /// Why not.
        why: UnknownProduct,
    },
    /// A robot cannot be told to fetch that.
    #[error("robot {robot} is not told to fetch goods {product}: {why}")]
    Fetch {
        /// Which.
        robot: Name,
        /// What.
        product: ProductId,
        /// Why not.
        why: WishRefused,
    },
    /// The system does not let the station wait for its sockets.
    #[error("the station cannot go on: {0}")]
    Machine(#[from] io::Error),
}
