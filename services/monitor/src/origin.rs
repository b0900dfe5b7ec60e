//! [`Origin`]: a place whose samples the tools show, and what `top` wants to know of it besides.

use std::time::Duration;

use lager_home::Clock;
use lager_ports::{Bus, NodeInfo, NodeState, Place};
use lager_stop::{Stop, StopPage, StopWord};

use crate::ToolError;
use crate::life::{Failing, Life};

/// The services that write a sign of life, because nothing on the bus shows that they live.
const SIGNING: [&str; 3] = ["comm", "station", "gateway"];

/// A place whose samples the tools show: the bus, or a robot's gateway.
pub trait Origin: Place<OpenError: Into<ToolError>, LookError: Into<ToolError>> {
    /// The processes on the robot's bus, as far as this place lists them.
    ///
    /// # Errors
    /// They cannot be listed.
    fn processes(&self) -> Result<Vec<NodeInfo>, ToolError>;

    /// What of the robot stands still. `nodes` are its processes.
    #[doc(hidden)]
    fn failing(&self, nodes: &[NodeInfo]) -> Vec<Failing>;

    /// Whether a process runs. `nodes` are the robot's.
    #[doc(hidden)]
    fn life(&self, nodes: &[NodeInfo], pid: u32) -> Life;

    /// The stop that is set, as the stop word tells it; `None` where nobody can read that.
    fn stop(&self) -> Option<Stop>;
}

impl Origin for Bus {
    fn processes(&self) -> Result<Vec<NodeInfo>, ToolError> {
        Ok(self.nodes()?)
    }

    fn failing(&self, nodes: &[NodeInfo]) -> Vec<Failing> {
        failing(self, nodes)
    }

    fn life(&self, nodes: &[NodeInfo], pid: u32) -> Life {
        let node = nodes.iter().find(|node| node.pid == pid);
        match node.map(|node| node.state) {
            Some(NodeState::Stale) => Life::Dead,
            _ => life(pid),
        }
    }

    fn stop(&self) -> Option<Stop> {
        let word = self.home().unit(self.unit()).join(StopPage::FILE);
        StopWord::read(&word).ok().flatten()?.stop()
    }
}

#[cfg(feature = "zenoh")]
impl Origin for lager_remote::Remote {
    fn processes(&self) -> Result<Vec<NodeInfo>, ToolError> {
        Ok(Vec::new())
    }

    fn failing(&self, _nodes: &[NodeInfo]) -> Vec<Failing> {
        let gateway = |silent| Failing {
            who: "gateway".to_owned(),
            pid: 0,
            silent: Some(silent),
        };
        self.silence().map(gateway).into_iter().collect()
    }

    fn life(&self, _nodes: &[NodeInfo], _pid: u32) -> Life {
        // The gateway lists a process for as long as the bus does.
        Life::Alive
    }

    fn stop(&self) -> Option<Stop> {
        None
    }
}

/// The processes of the robot and of its tools that stand still.
fn failing(bus: &Bus, nodes: &[NodeInfo]) -> Vec<Failing> {
    let (place, robot) = (bus.home(), bus.unit());
    let mut found: Vec<Failing> = Vec::new();
    let mut add = |who: &str, pid: u32, silent: Option<Duration>| {
        if found.iter().all(|failing| failing.pid != pid) {
            let who = who.to_owned();
            found.push(Failing { who, pid, silent });
        }
    };
    let holders = place.up().remove(robot).unwrap_or_default();
    for holder in holders.iter().filter(|holder| holder.frozen) {
        add(&holder.what, holder.pid, None);
    }
    let now_ns = Clock::monotonic_ns();
    for who in SIGNING {
        let Some(sign) = place.sign_of(robot, who) else {
            continue;
        };
        match life(sign.pid) {
            Life::Frozen => add(who, sign.pid, None),
            Life::Alive if sign.is_old(now_ns) => {
                let silent = Duration::from_nanos(now_ns.saturating_sub(sign.at_ns));
                add(who, sign.pid, Some(silent));
            }
            _ => {}
        }
    }
    for node in nodes {
        if node.unit.as_ref() == Some(robot)
            && let Some(part) = &node.part
            && life(node.pid) == Life::Frozen
        {
            add(part, node.pid, None);
        }
    }
    found
}

/// Whether a process runs, as the kernel says.
fn life(pid: u32) -> Life {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // The state follows the name, which is in parentheses and may contain anything.
    let state = stat
        .rsplit(") ")
        .next()
        .and_then(|rest| rest.chars().next());
    match state {
        Some('T' | 't') => Life::Frozen,
        Some('Z' | 'X') | None => Life::Dead,
        _ => Life::Alive,
    }
}
