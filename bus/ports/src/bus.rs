//! [`Bus`]: a process's membership on the bus. Every process opens one and makes its ports from it.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use iceoryx2::config::Config;
use iceoryx2::node::NodeCreationFailure;
use iceoryx2::prelude::{
    LogLevel, Node, NodeBuilder, NodeName, PortName, SignalHandlingMode, set_log_level,
};
use lager_home::{Clock, ClockSource, Descriptions, Home, Shortage, UnitName};
use lager_sample::{Application, Part};
use lager_wake::Board;

use crate::config::BusConfig;
use crate::error::OpenError;
use crate::here::Here;
use crate::name;
use crate::sweep;
use crate::transport::Ipc;

/// A process's membership on the bus; clones share it.
///
/// It may be sent to any thread. The ports made from it stay in the thread that makes them.
#[derive(Clone)]
pub struct Bus {
    shared: Arc<Shared>,
}

struct Shared {
    node: Here<Node<Ipc>>,
    home: Home,
    config: Config,
    application: &'static Application,
    unit: UnitName,
    part: Part,
    clock: ClockSource,
    port_name: PortName,
    board: Board,
    /// The descriptions that processes stated when they were last read.
    descriptions: Mutex<Descriptions>,
}

impl Bus {
    /// Joins the bus as `part`, after sweeping what killed processes left behind.
    ///
    /// Installs no signal handler.
    ///
    /// # Errors
    /// The configuration, the bus's files or the unit's clock cannot be used.
    pub fn open(config: &BusConfig, part: impl Into<Part>) -> Result<Self, OpenError> {
        Self::join(config, part.into())
    }

    fn join(config: &BusConfig, part: Part) -> Result<Self, OpenError> {
        // If files may not become long enough for a port (ulimit -f), this process would create
        // half a bus, and every other process would take it for damaged.
        if let Some(shortage) = Shortage::of_any_port() {
            return Err(OpenError::Short(shortage));
        }
        let home = config.home()?;
        let transport = config.transport(&home)?;
        let clock = ClockSource::new(config.speed, config.clock.as_deref())?;
        set_log_level(log_level());
        // First, because opening a file of another user could wait without end.
        lager_home::refuse_foreign(&home)?;
        let mut descriptions = Descriptions::default();
        lager_home::unfinished(&home, &mut descriptions);
        let node = make_node(&transport, &home, config, part)?;
        lager_home::protect(&home);
        // The next sweep finds the processes that cannot be listed now.
        let _ = sweep::dead_nodes(&transport);
        lager_wake::sweep_all(&home);
        home.sweep_locks();
        let port_name = PortName::new(&name::port(part, std::process::id()))
            .expect("a part and a number fit into a port's name");
        Ok(Self {
            shared: Arc::new(Shared {
                node: Here::new(node),
                board: Board::of(&home, &config.unit),
                home,
                config: transport,
                application: config.application,
                unit: config.unit.clone(),
                part,
                clock,
                port_name,
                descriptions: Mutex::new(descriptions),
            }),
        })
    }

    /// A clock that shows the unit's time.
    pub fn clock(&self) -> Clock {
        Clock::new(&self.shared.clock)
    }

    /// The unit's name.
    pub fn unit(&self) -> &UnitName {
        &self.shared.unit
    }

    /// The folder and the names of this bus.
    pub fn home(&self) -> &Home {
        &self.shared.home
    }

    /// The application to which this bus belongs.
    pub fn application(&self) -> &'static Application {
        self.shared.application
    }

    /// The part that this process plays on the bus.
    pub fn part(&self) -> Part {
        self.shared.part
    }

    /// Removes what killed processes left behind, and returns the number of these processes. If
    /// another process is sweeping, this call waits for it, at most 100 ms for each dead process.
    ///
    /// A reader keeps the unread samples of a killed writer from which it has received before. A
    /// keeper must still receive them before it sweeps ([`crate::Keeper::remember`]).
    pub fn sweep(&self) -> usize {
        lager_home::unfinished(&self.shared.home, &mut self.descriptions());
        lager_wake::sweep(&self.shared.home, &self.shared.unit);
        sweep::dead_nodes(&self.shared.config).unwrap_or_default()
    }

    /// Whether others can still find this process on the bus. They cannot after the bus was
    /// cleared, or after its files were removed.
    pub fn is_listed(&self) -> bool {
        self.shared.home.is_current() && sweep::is_listed(&self.shared.config, &self.shared.node)
    }

    pub(crate) fn node(&self) -> &Node<Ipc> {
        &self.shared.node
    }

    pub(crate) fn transport(&self) -> &Config {
        &self.shared.config
    }

    pub(crate) fn board(&self) -> &Board {
        &self.shared.board
    }

    pub(crate) fn descriptions(&self) -> MutexGuard<'_, Descriptions> {
        let descriptions = self.shared.descriptions.lock();
        descriptions.unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn port_name(&self) -> &PortName {
        &self.shared.port_name
    }
}

impl fmt::Debug for Bus {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Bus")
            .field("unit", &self.shared.unit)
            .field("part", &self.shared.part)
            .finish_non_exhaustive()
    }
}

fn make_node(
    config: &Config,
    home: &Home,
    bus: &BusConfig,
    part: Part,
) -> Result<Node<Ipc>, OpenError> {
    let name = name::node(bus.application, &bus.unit, part, std::process::id());
    let name = NodeName::new(&name).expect("all of it fits into a node's name");
    NodeBuilder::new()
        .name(&name)
        .config(config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Ipc>()
        .map_err(|failure| {
            if let Some(shortage) = Shortage::now() {
                return OpenError::Short(shortage);
            }
            let folder = home.folder().to_owned();
            match failure {
                NodeCreationFailure::InsufficientPermissions => OpenError::Permission { folder },
                other => OpenError::Transport {
                    fault: other.into(),
                    folder,
                },
            }
        })
}

/// Silences iceoryx2 unless the log filter names it: it reports faults that `ports` handles itself.
fn log_level() -> LogLevel {
    // The target under which iceoryx2 hands its messages to `tracing`.
    const TARGET: &str = "iceoryx2_bb_loggers::tracing";
    if tracing::enabled!(target: TARGET, tracing::Level::TRACE) {
        LogLevel::Trace
    } else if tracing::enabled!(target: TARGET, tracing::Level::DEBUG) {
        LogLevel::Debug
    } else {
        LogLevel::Fatal
    }
}
