//! `[realtime]`: priorities, memory and cores of the services. Refuses settings that leave too
//! little to other programs. The simulated robot never competes with the path.

use lager_topics::Role;

use super::section::section;
use super::{Config, Waiting};
use crate::realtime::{CoreSet, RealtimeError, Wanted, allowed_cores, refuse_starvation};

section! {
    "realtime"
    /// What bridge and logic, the services on the path from sensor to steering, ask of the machine.
    pub struct RealtimeSection {
        /// Priority of the bridge under SCHED_FIFO, 1 to 99; 0 is the normal scheduler. Logic gets
        /// one less and the bridge's readers two less, at least 1, unless they wait by spinning.
        /// Choose at most 49: on a PREEMPT_RT kernel the interrupt threads that bring the boards'
        /// bytes have 50.
        /// Needs LimitRTPRIO= in the systemd unit, `ulimit -r`, or CAP_SYS_NICE: `lager doctor` tries it.
        pub priority: u8 = 0,
        /// Keep all memory of bridge and logic in RAM (mlockall): some 23 MiB each, of which they share
        /// the program's 17 MiB. 9 MiB each would not be in RAM otherwise.
        /// Needs LimitMEMLOCK= in the systemd unit, `ulimit -l`, or CAP_IPC_LOCK: `lager doctor` tries it.
        pub lock_memory: bool = false,
        pub cores: CoresSection = CoresSection::default(),
    }
}

section! {
    "realtime.cores"
    /// The cores each service may run on, by number from 0; none means any. On one core, such as
    /// bridge = [3] and logic = [3], they wake each other sooner than across two. With "spin" or
    /// "adaptive" each needs its own. isolcpus=3 on the kernel's command line keeps all other
    /// programs away from core 3.
    pub struct CoresSection {
        /// The services on the path.
        pub bridge: CoreSet = CoreSet::default(),
        pub logic: CoreSet = CoreSet::default(),
        /// The simulated robot stands for boards with processors of their own. It can only have
        /// cores.
        pub simulator: CoreSet = CoreSet::default(),
    }
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

    /// The services that can have priority and locked memory.
    pub const ON_PATH: [Role; 2] = [Role::Bridge, Role::Logic];

    /// What the process of `role` asks of the machine.
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
    /// Refuses services that never sleep, at a real-time priority, on so many cores that other
    /// programs get none. Each of `roles` comes with what its process asks of the machine.
    ///
    /// # Errors
    /// Such a refusal, as a [`RealtimeError`].
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
