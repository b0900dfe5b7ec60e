//! The bus to the outside: figures for Prometheus, live views for Foxglove, and the samples
//! themselves for listeners on other computers, over Zenoh.
//!
//! ```text
//!         1 to 50 ms                            on request
//!   bus ───────────> listener ──> Figures <──────────────── /metrics: Prometheus
//!                       ├───────> Live ───── as they come ─────────> Foxglove
//!                       └───────> Carrier ── as they come ─────────> Zenoh
//! ```
//!
//! - `listener`: polls every topic, also those that are opened later. It is an observer: nobody
//!   wakes it, and it costs each writer one queue entry.
//! - `figures`: the robot's figures, from stamps and from the states that bridge and logic publish.
//! - `exposition`: the figures as Prometheus text.
//! - `http`: the server, in a thread of its own.
//! - `live`: every sample as JSON, and pictures of the robot, for viewers; only with the feature
//!   `foxglove`.
//! - `carried`: every sample as it is, to `lager_remote::Carrier`; only with the feature `zenoh`.
//! - `processes`: processor time and memory of each process of the robot.
//!
//! In place of the bus, the figures and views can be those of a robot elsewhere, from its own gateway.
//!
//! It never writes to the bus: what it reads is a [`Place`], which has no writers. Nobody waits for it. A request gets the figures of the last
//! poll. The listener reads every sample; if it has missed some, a figure says so.

#![forbid(unsafe_code)]

#[cfg(feature = "zenoh")]
mod carried;
mod exposition;
mod figures;
mod http;
mod listener;
#[cfg(feature = "foxglove")]
mod live;
mod processes;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lager_home::UnitName;
use lager_ports::{IntrospectError, Place, PlaceError, PortError, ReceiveError};
use lager_remote::Settings;
use lager_wake::{Shutdown, Watchdog};
use tokio::runtime::Runtime;

use figures::Figures;
use listener::{Outlet, Shown, Viewer};

pub use lager_remote::USUAL_ZENOH;

/// Where Prometheus finds the figures by default.
pub const USUAL_METRICS: &str = "127.0.0.1:7430";

/// Where Foxglove looks for a robot by default.
pub const USUAL_FOXGLOVE: &str = "127.0.0.1:8765";

/// Whether this program was built with the server for Foxglove.
pub const HAS_FOXGLOVE: bool = cfg!(feature = "foxglove");

/// Whether this program was built with what speaks Zenoh.
pub const HAS_ZENOH: bool = cfg!(feature = "zenoh");

/// The dashboard for Grafana, to import there. Every query in it uses figures that exist.
pub const DASHBOARD: &str = include_str!("../grafana.json");

/// The layout for Foxglove, to import there. Every topic and field in it exists.
pub const LAYOUT: &str = include_str!("../foxglove.json");

/// Why there is no gateway.
#[derive(Debug, thiserror::Error)]
pub enum GatewayError {
    /// An address is not free.
    #[error("{address} cannot be had: {error}; choose another address with {flag}")]
    Listen {
        /// What chooses it.
        flag: &'static str,
        /// Which.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// The program cannot speak to Foxglove.
    #[error(
        "this program was built without what speaks to Foxglove; build one that has it with \
         `cargo build --release --features foxglove`"
    )]
    NoFoxglove,
    /// The program cannot speak Zenoh.
    #[error(
        "this program was built without what speaks Zenoh; build one that has it with `cargo build \
         --release --features zenoh`"
    )]
    NoZenoh,
    /// It cannot listen where listeners are to find it.
    #[cfg(feature = "zenoh")]
    #[error(transparent)]
    Carrier(#[from] lager_remote::CarrierError),
    /// The system does not let it run.
    #[error("the gateway cannot run: {0}")]
    Run(#[from] io::Error),
    /// The state of the bus could not be read.
    #[error(transparent)]
    Look(#[from] IntrospectError),
    /// A topic could not be opened.
    #[error(transparent)]
    Open(#[from] PortError),
    /// The place elsewhere where the samples come from says why.
    #[error(transparent)]
    Elsewhere(Box<dyn std::error::Error + Send + Sync>),
    /// A topic could not be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The bus is another one now, so no sample will come any more.
    #[error("the bus was damaged and replaced since the gateway joined it; start it again")]
    Cleared,
}

impl From<PlaceError> for GatewayError {
    fn from(error: PlaceError) -> Self {
        match error {
            PlaceError::Open(error) => Self::Open(error),
            PlaceError::Look(error) => Self::Look(error),
            PlaceError::Elsewhere(error) => Self::Elsewhere(error),
        }
    }
}

impl GatewayError {
    fn listen(flag: &'static str, address: SocketAddr, error: io::Error) -> Self {
        Self::Listen {
            flag,
            address,
            error,
        }
    }
}

/// Where programs outside find the robot. Everybody who can reach an address may look, and can do
/// nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Addresses {
    /// The figures for Prometheus.
    pub metrics: Option<SocketAddr>,
    /// The live views for Foxglove.
    pub foxglove: Option<SocketAddr>,
    /// The samples for listeners on other computers.
    pub zenoh: Option<Settings>,
}

impl Addresses {
    /// Refuses addresses that a gateway could not use at this moment.
    ///
    /// # Errors
    /// An address is taken, or this program cannot speak to Foxglove or Zenoh.
    pub fn may_be_had(&self, robot: &UnitName) -> Result<(), GatewayError> {
        if self.foxglove.is_some() && !HAS_FOXGLOVE {
            return Err(GatewayError::NoFoxglove);
        }
        if self.zenoh.is_some() && !HAS_ZENOH {
            return Err(GatewayError::NoZenoh);
        }
        let wanted = [("--metrics", self.metrics), ("--foxglove", self.foxglove)];
        // Held together, as one address cannot be both.
        let mut held = Vec::new();
        for (flag, address) in wanted {
            if let Some(address) = address {
                held.push(bind(flag, address)?);
            }
        }
        #[cfg(feature = "zenoh")]
        if let Some(settings) = &self.zenoh {
            lager_remote::may_be_had(settings, robot)?;
        }
        #[cfg(not(feature = "zenoh"))]
        let _ = robot;
        Ok(())
    }
}

fn bind(flag: &'static str, address: SocketAddr) -> Result<TcpListener, GatewayError> {
    TcpListener::bind(address).map_err(|error| GatewayError::listen(flag, address, error))
}

/// A gateway that has its addresses and does not answer yet.
pub struct Gateway {
    runtime: Runtime,
    at: Addresses,
    metrics: Option<TcpListener>,
    shown: Shown,
}

impl Gateway {
    /// Listens at the addresses that are `wanted`, for whoever wants to look at `robot`.
    ///
    /// # Errors
    /// An address is not free, or this program cannot speak to Foxglove or Zenoh.
    pub fn open(wanted: Addresses, robot: &UnitName) -> Result<Self, GatewayError> {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_all().build()?;
        let mut at = Addresses::default();
        let mut metrics = None;
        if let Some(address) = wanted.metrics {
            let listener = bind("--metrics", address)?;
            listener.set_nonblocking(true)?;
            at.metrics = Some(listener.local_addr()?);
            metrics = Some(listener);
        }
        let mut shown = Shown::default();
        if let Some(address) = wanted.foxglove {
            let (live, address) = open_live(address, robot.as_str(), &runtime)?;
            at.foxglove = Some(address);
            shown.viewer = Some(live);
        }
        if let Some(settings) = wanted.zenoh {
            shown.outlet = Some(open_outlet(&settings, robot)?);
            at.zenoh = Some(settings);
        }
        Ok(Self {
            runtime,
            at,
            metrics,
            shown,
        })
    }

    /// Where it answers.
    pub fn addresses(&self) -> &Addresses {
        &self.at
    }

    /// Reads the robot at `place`, its bus or its gateway elsewhere, and answers until `shutdown` is
    /// requested. `stop_word` is where the robot's stop word lies, if it is here.
    ///
    /// A place has no writers, so nothing in this crate could write to a bus.
    ///
    /// # Errors
    /// The robot cannot be read any more, or the system does not let it run.
    pub fn run(
        self,
        place: &impl Place,
        stop_word: Option<PathBuf>,
        watchdog: &Watchdog,
        shutdown: &Shutdown,
    ) -> Result<(), GatewayError> {
        let shared = Shared {
            figures: Arc::new(Mutex::new(Figures::new(place.unit().as_str()))),
            stop_word,
        };
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let served = {
                let shared = shared.clone();
                let (over, runtime, metrics) = (&over, &self.runtime, self.metrics);
                std::thread::Builder::new()
                    .name("http".to_owned())
                    .spawn_scoped(scope, move || http::serve(runtime, metrics, shared, over))?
            };
            let is_over = || served.is_finished();
            let listened =
                listener::listen(place, watchdog, shutdown, &shared, self.shown, is_over);
            over.store(true, Ordering::Relaxed);
            let served = served.join().expect("the server does not panic");
            listened?;
            Ok(served?)
        })
    }
}

#[cfg(feature = "foxglove")]
fn open_live(
    address: SocketAddr,
    robot: &str,
    runtime: &Runtime,
) -> Result<(Box<dyn Viewer>, SocketAddr), GatewayError> {
    let live = live::Live::open(address, robot, runtime)?;
    let address = live.address();
    Ok((Box::new(live), address))
}

#[cfg(not(feature = "foxglove"))]
fn open_live(
    _address: SocketAddr,
    _robot: &str,
    _runtime: &Runtime,
) -> Result<(Box<dyn Viewer>, SocketAddr), GatewayError> {
    Err(GatewayError::NoFoxglove)
}

#[cfg(feature = "zenoh")]
fn open_outlet(settings: &Settings, robot: &UnitName) -> Result<Box<dyn Outlet>, GatewayError> {
    Ok(Box::new(lager_remote::Carrier::open(settings, robot)?))
}

#[cfg(not(feature = "zenoh"))]
fn open_outlet(_settings: &Settings, _robot: &UnitName) -> Result<Box<dyn Outlet>, GatewayError> {
    Err(GatewayError::NoZenoh)
}

/// What listener and server share.
#[derive(Clone, Debug)]
pub(crate) struct Shared {
    figures: Arc<Mutex<Figures>>,
    /// Where the robot's stop word lies, if it is here.
    pub(crate) stop_word: Option<PathBuf>,
}

impl Shared {
    pub(crate) fn figures(&self) -> MutexGuard<'_, Figures> {
        self.figures.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use lager_journal::View;
    use lager_sample::{Description, Topic};
    use lager_topics::{TopicVisitor, visit};
    use serde_json::Value;

    use super::LAYOUT;

    struct Describe;

    impl TopicVisitor for Describe {
        type Output = Description;

        fn visit<T: Topic>(self) -> Description {
            Description::of::<T::Payload>()
        }
    }

    /// What stands at any depth under this name.
    fn under<'a>(name: &str, value: &'a Value, found: &mut Vec<&'a Value>) {
        if let Value::Object(members) = value {
            found.extend(members.get(name));
        }
        let members = value.as_object().into_iter().flat_map(|of| of.values());
        for inner in members.chain(value.as_array().into_iter().flatten()) {
            under(name, inner, found);
        }
    }

    #[test]
    fn every_topic_and_field_of_the_layout_is_there_and_every_panel_has_its_place() {
        let layout: Value = serde_json::from_str(LAYOUT).expect("JSON");
        let panels = &layout["configById"];
        let of = |names: &[&str]| {
            let mut found = Vec::new();
            names
                .iter()
                .for_each(|name| under(name, panels, &mut found));
            found
        };
        let is_view = |name: &str| View::ALL.iter().any(|view| view.topic() == name);
        let mut views = 0;
        for topics in of(&["topics"]) {
            for name in topics.as_object().expect("by name").keys() {
                assert!(is_view(name), "{name}");
                views += 1;
            }
        }
        for name in of(&["topicToRender"]) {
            assert!(is_view(name.as_str().expect("a name")), "{name}");
            views += 1;
        }
        assert_eq!(
            views,
            View::ALL.len() - 1,
            "all but the frames, which have no panel"
        );
        let paths = of(&["topicPath", "value"]);
        assert!(paths.len() > 8);
        for path in paths {
            let path = path.as_str().expect("a path");
            let (topic, field) = path.split_once(".payload").expect("a payload");
            let description = visit(topic, Describe).unwrap_or_else(|_| panic!("{path}"));
            if let Some(field) = field.strip_prefix('.') {
                description
                    .must_have(field)
                    .unwrap_or_else(|no| panic!("{no}"));
            }
        }
        let mut placed = Vec::new();
        for side in ["first", "second"] {
            under(side, &layout["layout"], &mut placed);
        }
        let mut placed: Vec<&str> = placed.into_iter().filter_map(Value::as_str).collect();
        placed.sort_unstable();
        let mut known: Vec<&String> = panels.as_object().expect("by name").keys().collect();
        known.sort_unstable();
        assert_eq!(placed, known);
    }
}
