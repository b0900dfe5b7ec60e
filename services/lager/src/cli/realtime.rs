//! The flags for real time, of `up` and of each service. They go over the configuration.

use std::str::FromStr;

use clap::Args;
use lager_supervisor::Parent;
use lager_topics::Role;

use crate::config::RealtimeSection;
use crate::realtime::{CoreSet, CoreSetError, HIGHEST_PRIORITY, Wanted};

/// What a process on the path may ask of the machine.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Real time")]
pub struct RealtimeArgs {
    /// Run at this priority of SCHED_FIFO, 1..99; 0 is the normal scheduler
    #[arg(long, value_name = "PRIORITY", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(0..=i64::from(HIGHEST_PRIORITY)))]
    pub realtime: Option<u8>,
    /// Keep all memory of the process in RAM, never in swap
    #[arg(long)]
    pub lock_memory: bool,
}

impl RealtimeArgs {
    /// Lets the flags replace values of the configuration.
    fn apply(&self, priority: &mut u8, lock_memory: &mut bool) {
        *priority = self.realtime.unwrap_or(*priority);
        *lock_memory |= self.lock_memory;
    }
}

/// The same for `lager up`, where each service may have cores of its own.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Real time")]
pub struct UpRealtimeArgs {
    /// Priority and memory
    #[command(flatten)]
    pub common: RealtimeArgs,
    /// Bind a service to cores, such as bridge=0 or logic=1,2; without a name bridge and logic
    #[arg(long, value_name = "[SERVICE=]N")]
    pub core: Vec<CoreChoice>,
}

impl UpRealtimeArgs {
    /// Lets the flags replace values of the configuration's section. The last choice for a service
    /// counts.
    pub fn apply(&self, section: &mut RealtimeSection) {
        self.common
            .apply(&mut section.priority, &mut section.lock_memory);
        for CoreChoice { role, cores } in &self.core {
            let chosen = match role {
                Some(role) => std::slice::from_ref(role),
                None => &RealtimeSection::ON_PATH,
            };
            for role in chosen {
                section.choose_cores(*role, cores.clone());
            }
        }
    }
}

/// `bridge=0`, or `0` for bridge and logic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CoreChoice {
    role: Option<Role>,
    cores: CoreSet,
}

impl FromStr for CoreChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (role, cores) = match text.split_once('=') {
            None => (None, text),
            Some(("bridge", cores)) => (Some(Role::Bridge), cores),
            Some(("logic", cores)) => (Some(Role::Logic), cores),
            Some(("simulator", cores)) => (Some(Role::Simulator), cores),
            Some((other, _)) => {
                return Err(format!(
                    "`{other}` is not a service that can have cores of its own; bridge, logic and simulator can"
                ));
            }
        };
        let cores = cores
            .parse()
            .map_err(|error: CoreSetError| error.to_string())?;
        Ok(Self { role, cores })
    }
}

/// What `up` tells a service besides the configuration.
#[derive(Debug, Args)]
pub struct ServiceArgs {
    /// Resume from the state that the supervisor kept of the previous process
    #[arg(long)]
    pub resume: bool,
    /// End when the supervisor ends: its process, and its start in ns of the monotonic clock
    #[arg(long, value_name = "PID@NS")]
    pub parent: Option<Parent>,
    /// Priority and memory
    #[command(flatten)]
    pub realtime: RealtimeArgs,
    /// Bind this process to cores, such as 1 or 2,3
    #[arg(long, value_name = "N", help_heading = "Real time")]
    pub core: Option<CoreSet>,
}

impl ServiceArgs {
    /// Lets the flags replace the configuration's values for this service.
    pub fn apply(&self, wanted: &mut Wanted) {
        self.realtime
            .apply(&mut wanted.priority, &mut wanted.lock_memory);
        if let Some(cores) = &self.core {
            wanted.cores.clone_from(cores);
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::{Cli, Command};

    fn section(flags: &[&str]) -> RealtimeSection {
        let words = ["lager", "up"].iter().chain(flags);
        let Command::Up(up) = Cli::parse_from(words).command else {
            unreachable!("`up` was asked for");
        };
        let mut section = RealtimeSection {
            priority: 5,
            ..RealtimeSection::default()
        };
        up.realtime.apply(&mut section);
        section
    }

    #[test]
    fn flags_of_up_go_over_the_configuration() {
        assert_eq!(section(&[]).priority, 5);
        assert_eq!(section(&["--realtime", "0"]).priority, 0);
        let all = section(&[
            "--realtime",
            "20",
            "--lock-memory",
            "--core",
            "1",
            "--core",
            "bridge=0,2",
        ]);
        assert_eq!((all.priority, all.lock_memory), (20, true));
        let cores = |role| all.wanted(role).cores.to_string();
        assert_eq!(cores(Role::Bridge), "0,2");
        assert_eq!(cores(Role::Logic), "1");
        assert_eq!(cores(Role::Simulator), "");
    }

    #[test]
    fn wrong_flags_are_refused_with_a_sentence() {
        for (flags, words) in [
            (["--realtime", "100"], "0..=99"),
            (["--core", "operator=1"], "bridge, logic and simulator"),
            (["--core", "bridge=x"], "from 0"),
        ] {
            let words_of_up = ["lager", "up"].iter().chain(&flags);
            let said = Cli::try_parse_from(words_of_up)
                .expect_err("wrong")
                .to_string();
            assert!(said.contains(words), "{said}");
        }
    }
}
