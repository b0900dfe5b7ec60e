//! Where a station listens and what it is told, and why there is none.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;

use lager_lines::secret::Secrets;
use lager_lines::{Called, Name, ProductId, UnknownProduct};
use thiserror::Error;

use crate::files::{HeldBy, ReadError};
use crate::station::WishRefused;
use crate::warehouse::{LoadError, Warehouse, WarehouseError};

/// Where a station listens and what it knows.
#[derive(Debug)]
pub struct ServerConfig {
    /// What the station calls itself.
    pub name: Name,
    /// Where robots connect.
    pub listen: Listen,
    /// By what robots prove who they are; where there are none they are taken at their word.
    pub secrets: Secrets,
    /// Where a GaG connects, if one may.
    pub gag: Option<PathBuf>,
    /// The file of the warehouse, in which changes are saved. It need not be there yet.
    pub warehouse: Option<PathBuf>,
    /// The warehouse as long as it has no file. Without it a GaG or another user of the station
    /// describes the warehouse.
    pub otherwise: Option<Warehouse>,
    /// The file of the robots' queues.
    pub queues: Option<PathBuf>,
    /// What robots are to fetch after what waits for them already. A name needs the warehouse's
    /// file.
    pub fetch: Vec<(Name, Called)>,
}

/// Where robots connect.
#[derive(Debug)]
pub enum Listen {
    /// At an address; port 0 is one that is free.
    At(SocketAddr),
    /// At a socket that listens already.
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
    /// The warehouse's file is none.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The queues' file is not read.
    #[error(transparent)]
    Queues(#[from] ReadError),
    /// Another station saves in that file.
    #[error(transparent)]
    Held(#[from] HeldBy),
    /// There can be no such warehouse.
    #[error(transparent)]
    Warehouse(#[from] WarehouseError),
    /// Nothing is called so.
    #[error("robot {robot} is not told to fetch {}: {why}", .why.called)]
    Called {
        /// Which.
        robot: Name,
        /// Why not.
        why: UnknownProduct,
    },
    /// A robot cannot be told to fetch that.
    #[error("robot {robot} is not told to fetch product {product}: {why}")]
    Fetch {
        /// Which.
        robot: Name,
        /// What.
        product: ProductId,
        /// Why not.
        why: WishRefused,
    },
    /// The machine does not let it wait.
    #[error("the station cannot go on: {0}")]
    Machine(#[from] io::Error),
}
