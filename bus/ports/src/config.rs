//! Which bus a process joins.

use core::time::Duration;
use std::path::PathBuf;

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path, SemanticString};

use crate::error::OpenError;
use crate::name::RobotName;

/// Which bus a process joins. The default is robot `r1` in real time.
#[derive(Clone, Debug, PartialEq)]
pub struct BusConfig {
    /// The robot.
    pub robot: RobotName,
    /// Robot time per real time: 1 for a real body, more for a hurried simulated one.
    pub speed: f64,
    /// The page in which an emulated body publishes its time; robot time follows it, and `speed`
    /// is the fastest it runs. `None` for any other body.
    pub clock: Option<PathBuf>,
    /// What the names of shared-memory files begin with; processes with different prefixes never
    /// meet. `None` is the machine's common bus.
    pub prefix: Option<String>,
    /// Where the bus keeps its files; processes with different roots never meet. `None` is the
    /// machine's common bus. Must be short, since sockets live below it.
    pub root: Option<PathBuf>,
}

impl Default for BusConfig {
    fn default() -> Self {
        Self {
            robot: RobotName::default(),
            speed: 1.0,
            clock: None,
            prefix: None,
            root: None,
        }
    }
}

/// The longest path of a socket, in bytes.
const LONGEST_SOCKET: usize = 107;

/// What a socket's path needs besides root and prefix: `/`, a 128-bit number, `.event`.
const BELOW_ROOT: usize = 1 + 39 + 6;

/// Writers that are gone while their last samples wait for a reader: of more than these the samples
/// of the oldest are dropped. Each look of a reader passes all their places, so the transport's 128
/// made an empty look four times as slow.
const GONE: usize = 16;

impl BusConfig {
    /// The transport's configuration; nothing is read from files or the environment.
    pub(crate) fn transport(&self) -> Result<Config, OpenError> {
        if !(self.speed.is_finite() && self.speed > 0.0) {
            return Err(OpenError::Speed(self.speed));
        }
        let mut config = Config::default();
        if let Some(prefix) = &self.prefix {
            config.global.prefix =
                FileName::new(prefix.as_bytes()).map_err(|_| OpenError::Prefix(prefix.clone()))?;
        }
        if let Some(root) = &self.root {
            let bytes = root.as_os_str().as_encoded_bytes();
            let path = Path::new(bytes)
                .ok()
                .filter(|_| root.is_absolute())
                .ok_or_else(|| OpenError::Root(root.clone()))?;
            let prefix_length = config.global.prefix.len();
            if bytes.len() + prefix_length + BELOW_ROOT > LONGEST_SOCKET {
                return Err(OpenError::RootTooLong {
                    root: root.clone(),
                    limit: LONGEST_SOCKET.saturating_sub(BELOW_ROOT + prefix_length),
                });
            }
            config.global.set_root_path(&path);
        }
        // Creating a service takes microseconds; who takes longer is dead.
        config.global.creation_timeout = Duration::from_millis(500);
        // `ports` sweeps at `Bus::open` and whenever a limit is met; doing it again for each
        // service would only make opening slow.
        config.global.service.cleanup_dead_nodes_on_open = false;
        let defaults = &mut config.defaults;
        defaults
            .publish_subscribe
            .subscriber_expired_connection_buffer = GONE;
        defaults.request_response.client_expired_connection_buffer = GONE;
        defaults.request_response.server_expired_connection_buffer = GONE;
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relative_or_long_root_is_refused() {
        let with_root = |root: &str| {
            BusConfig {
                root: Some(root.into()),
                ..BusConfig::default()
            }
            .transport()
            .map(|_| ())
            .unwrap_err()
            .to_string()
        };
        assert!(with_root("var/lager").contains("absolute"));
        let long = format!("/tmp/{}", "x".repeat(80));
        assert!(
            with_root(&long).contains("too long"),
            "{}",
            with_root(&long)
        );
    }

    #[test]
    fn a_prefix_with_a_slash_is_refused() {
        let config = BusConfig {
            prefix: Some("a/b".to_owned()),
            ..BusConfig::default()
        };
        assert!(matches!(config.transport(), Err(OpenError::Prefix(_))));
    }

    #[test]
    fn a_speed_that_is_no_speed_is_refused() {
        for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let config = BusConfig {
                speed,
                ..BusConfig::default()
            };
            assert!(matches!(config.transport(), Err(OpenError::Speed(_))));
        }
    }
}
