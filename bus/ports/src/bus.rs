//! A process's membership on the bus.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use iceoryx2::config::Config;
use iceoryx2::node::NodeCreationFailure;
use iceoryx2::prelude::{
    LogLevel, Node, NodeBuilder, NodeName, PortName, SignalHandlingMode, set_log_level,
};
use lager_topics::Role;

use crate::clock::{self, Clock};
use crate::config::BusConfig;
use crate::descriptions::Descriptions;
use crate::doorbell::{self, Board};
use crate::error::OpenError;
use crate::here::Here;
use crate::mend;
use crate::name::{self, RobotName};
use crate::place::Place;
use crate::shortage::Shortage;
use crate::sweep;
use crate::transport::Ipc;

/// A process's membership on the bus; clones share it.
///
/// It may be sent to any thread. Ports are made from it in the thread that uses them and stay
/// there.
#[derive(Clone)]
pub struct Bus {
    shared: Arc<Shared>,
}

struct Shared {
    node: Here<Node<Ipc>>,
    place: Place,
    config: Config,
    robot: RobotName,
    role: Role,
    clock: clock::Source,
    port_name: PortName,
    board: Board,
    /// As they were at the last look.
    descriptions: Mutex<Descriptions>,
}

impl Bus {
    /// Joins the bus as `role`, after sweeping what killed processes left behind.
    ///
    /// No signal handler is installed.
    ///
    /// # Errors
    /// The configuration is not usable, or the bus's files or the body's clock are not.
    pub fn open(config: &BusConfig, role: Role) -> Result<Self, OpenError> {
        // Half a bus would be made, which looks damaged to everybody else.
        if let Some(shortage) = Shortage::of_any_port() {
            return Err(OpenError::Short(shortage));
        }
        let place = config.place()?;
        let transport = config.transport(&place)?;
        let clock = clock::Source::new(config.speed, config.clock.as_deref())?;
        set_log_level(log_level());
        // Before anything is opened that could be waited for.
        mend::refuse_foreign(&place)?;
        let mut descriptions = Descriptions::default();
        mend::unfinished(&place, &mut descriptions);
        let node = make_node(&transport, &place, &config.robot, role)?;
        mend::protect(&place);
        // What cannot be listed now is left to the next sweep.
        let _ = sweep::dead_nodes(&transport);
        doorbell::sweep_all(&place);
        place.sweep_locks();
        let port_name = PortName::new(&name::port(role, std::process::id()))
            .expect("a role and a number fit into a port's name");
        Ok(Self {
            shared: Arc::new(Shared {
                node: Here::new(node),
                board: Board::of(&place, &config.robot),
                place,
                config: transport,
                robot: config.robot.clone(),
                role,
                clock,
                port_name,
                descriptions: Mutex::new(descriptions),
            }),
        })
    }

    /// A clock that shows the robot's time.
    pub fn clock(&self) -> Clock {
        Clock::new(self.shared.clock.clone())
    }

    /// The robot's name.
    pub fn robot(&self) -> &RobotName {
        &self.shared.robot
    }

    /// Where the bus lives.
    pub fn place(&self) -> &Place {
        &self.shared.place
    }

    /// What this process is on the bus.
    pub fn role(&self) -> Role {
        self.shared.role
    }

    /// Removes what killed processes left behind, and returns how many processes there were. If
    /// another process is sweeping at the same moment, this waits for it, at most 100 ms for each
    /// dead process.
    ///
    /// Samples a killed writer has sent stay with subscribers that have received from it before,
    /// until they are drained; a keeper should still drain first ([`crate::Keeper::remember`]).
    pub fn sweep(&self) -> usize {
        mend::unfinished(&self.shared.place, &mut self.descriptions());
        doorbell::sweep(&self.shared.place, &self.shared.robot);
        sweep::dead_nodes(&self.shared.config).unwrap_or_default()
    }

    /// Whether others can still find this process on the bus. They cannot after the bus was
    /// cleared, or after its files were removed.
    pub fn is_listed(&self) -> bool {
        self.shared.place.is_current() && sweep::is_listed(&self.shared.config, &self.shared.node)
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
            .field("robot", &self.shared.robot)
            .field("role", &self.shared.role)
            .finish_non_exhaustive()
    }
}

fn make_node(
    config: &Config,
    place: &Place,
    robot: &RobotName,
    role: Role,
) -> Result<Node<Ipc>, OpenError> {
    let name = NodeName::new(&name::node(robot, role, std::process::id()))
        .expect("robot, role and number fit into a node's name");
    NodeBuilder::new()
        .name(&name)
        .config(config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Ipc>()
        .map_err(|failure| {
            if let Some(shortage) = Shortage::now() {
                return OpenError::Short(shortage);
            }
            let folder = place.folder().to_owned();
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
