//! The bus to the outside: figures for Prometheus.
//!
//! ```text
//!            2 ms                              on request
//!   bus ───────────> listener ──> Figures <──────────────── /metrics: Prometheus
//! ```
//!
//! - `listener`: polls every topic, also those that are opened later. It is an observer: nobody
//!   wakes it, and it costs each writer one queue entry.
//! - `figures`: what is known of the robot, from stamps and from what bridge and logic publish.
//! - `exposition`: that as Prometheus text.
//! - `http`: the server, in a thread of its own.
//! - `processes`: what each process of the robot takes of the machine.
//!
//! It never writes to the bus, and nobody waits for it. Whoever asks gets what was known at the last
//! poll; nothing is sampled away, and what the gateway itself has missed is a figure, too.

#![forbid(unsafe_code)]

mod exposition;
mod figures;
mod http;
mod listener;
mod processes;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lager_ports::{Bus, IntrospectError, ReceiveError, Shutdown, StopPage, Watchdog};

use figures::Figures;

/// Where Prometheus finds the figures unless somebody says otherwise.
pub const USUAL_METRICS: &str = "127.0.0.1:7430";

/// The dashboard for Grafana, to be imported there: every query in it is of a figure that there is.
pub const DASHBOARD: &str = include_str!("../grafana.json");

/// Why there is no gateway.
#[derive(Debug, thiserror::Error)]
pub enum GatewayError {
    /// The address cannot be had.
    #[error("the metrics cannot be had at {address}: {error}; choose another one with --metrics")]
    Listen {
        /// Which.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// The system does not let it run.
    #[error("the gateway cannot run: {0}")]
    Run(#[from] io::Error),
    /// The bus could not be looked at.
    #[error(transparent)]
    Look(#[from] IntrospectError),
    /// A topic could not be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// Nothing will come any more.
    #[error("the bus was damaged and has been cleared since the gateway joined it; start it again")]
    Cleared,
}

/// A gateway that has its address and does not answer yet.
#[derive(Debug)]
pub struct Gateway {
    metrics: TcpListener,
}

impl Gateway {
    /// Listens at `metrics`. Everybody who reaches that address may read the figures; nobody can
    /// do anything else there.
    ///
    /// # Errors
    /// The address cannot be had.
    pub fn open(metrics: SocketAddr) -> Result<Self, GatewayError> {
        let listener = TcpListener::bind(metrics).and_then(|listener| {
            listener.set_nonblocking(true)?;
            Ok(listener)
        });
        let metrics = listener.map_err(|error| GatewayError::Listen {
            address: metrics,
            error,
        })?;
        Ok(Self { metrics })
    }

    /// Where it answers.
    ///
    /// # Errors
    /// The system does not say.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.metrics.local_addr()
    }

    /// Reads the robot of `bus` and answers until `shutdown` is requested.
    ///
    /// # Errors
    /// The bus cannot be read any more, or the system does not let it run.
    pub fn run(
        self,
        bus: &Bus,
        watchdog: &Watchdog,
        shutdown: &Shutdown,
    ) -> Result<(), GatewayError> {
        let shared = Shared {
            figures: Arc::new(Mutex::new(Figures::new(bus.robot().as_str()))),
            stop_word: bus.place().folder_of(bus.robot()).join(StopPage::FILE),
        };
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let served = {
                let shared = shared.clone();
                let (over, metrics) = (&over, self.metrics);
                std::thread::Builder::new()
                    .name("http".to_owned())
                    .spawn_scoped(scope, move || http::serve(metrics, shared, over))?
            };
            let listened =
                listener::listen(bus, watchdog, shutdown, &shared, || served.is_finished());
            over.store(true, Ordering::Relaxed);
            let served = served.join().expect("the server does not panic");
            listened?;
            Ok(served?)
        })
    }
}

/// What listener and server share.
#[derive(Clone, Debug)]
pub(crate) struct Shared {
    figures: Arc<Mutex<Figures>>,
    /// Where the robot's stop word lies.
    pub(crate) stop_word: std::path::PathBuf,
}

impl Shared {
    pub(crate) fn figures(&self) -> MutexGuard<'_, Figures> {
        self.figures.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
