//! `[realtime]`: who gets what of the machine, and what would leave too little to the others.

use lager_topics::Role;
use serde::{Deserialize, Serialize};

use super::{Config, Waiting};
use crate::realtime::{CoreSet, RealtimeError, Wanted, allowed_cores, refuse_starvation};

/// `[realtime]`: what bridge and logic, the services on the path from sensor to steering, want of
/// the machine.
///
/// The simulated robot stands for boards that have processors of their own: it never competes
/// with the path, and only a core can be chosen for it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RealtimeSection {
    /// Priority under `SCHED_FIFO`, 1 to 99; 0 is the normal scheduler.
    pub priority: u8,
    /// Keep all their memory from being paged out.
    pub lock_memory: bool,
    /// The cores each may run on.
    pub cores: CoresSection,
}

/// `[realtime.cores]`: the cores of each service, empty for any.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CoresSection {
    /// Cores of the bridge.
    pub bridge: CoreSet,
    /// Cores of logic.
    pub logic: CoreSet,
    /// Cores of the simulated robot.
    pub simulator: CoreSet,
}

impl RealtimeSection {
    /// Binds the process of `role` to `cores`.
    pub fn choose_cores(&mut self, role: Role, cores: CoreSet) {
        match role {
            Role::Bridge => self.cores.bridge = cores,
            Role::Logic => self.cores.logic = cores,
            Role::Simulator => self.cores.simulator = cores,
            _ => {}
        }
    }

    /// The services that priority and locked memory are for.
    pub const ON_PATH: [Role; 2] = [Role::Bridge, Role::Logic];

    /// What the process of `role` wants.
    pub fn wanted(&self, role: Role) -> Wanted {
        let on_path = Self::ON_PATH.contains(&role);
        Wanted {
            priority: if on_path { self.priority } else { 0 },
            short_slices: on_path,
            lock_memory: on_path && self.lock_memory,
            cores: match role {
                Role::Bridge => self.cores.bridge.clone(),
                Role::Logic => self.cores.logic.clone(),
                Role::Simulator => self.cores.simulator.clone(),
                _ => CoreSet::default(),
            },
        }
    }
}

impl Config {
    /// Refuses what would leave nothing to the others: services that never sleep, at a real-time
    /// priority, on too many cores. Each of `roles` has beside it what its process wants.
    ///
    /// # Errors
    /// That, as a [`RealtimeError`].
    pub fn refuse_starvation(&self, roles: &[(Role, Wanted)]) -> Result<(), RealtimeError> {
        let spinners: Vec<CoreSet> = roles
            .iter()
            .filter(|(role, wanted)| {
                self.bus.waiting == Waiting::Spin
                    && RealtimeSection::ON_PATH.contains(role)
                    && wanted.priority > 0
            })
            .map(|(_, wanted)| wanted.cores.clone())
            .collect();
        if spinners.is_empty() {
            return Ok(());
        }
        refuse_starvation(&spinners, &allowed_cores()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_time_is_for_the_path_and_cores_are_for_each() {
        let config: Config = toml::from_str(
            "[realtime]\npriority = 20\nlock_memory = true\ncores = { logic = [1], simulator = [0] }",
        )
        .expect("valid TOML");
        let wanted = |role| {
            let wanted = config.realtime.wanted(role);
            (
                wanted.priority,
                wanted.lock_memory,
                wanted.cores.to_string(),
            )
        };
        assert_eq!(wanted(Role::Bridge), (20, true, String::new()));
        assert_eq!(wanted(Role::Logic), (20, true, "1".into()));
        assert_eq!(wanted(Role::Simulator), (0, false, "0".into()));
        assert_eq!(wanted(Role::Supervisor), (0, false, String::new()));
    }
}
