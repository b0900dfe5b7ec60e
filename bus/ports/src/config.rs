//! [`BusConfig`]: which bus a process joins, and the transport's limits there.
//!
//! A reader that looks for samples also visits a place for each writer that has ended. iceoryx2 has
//! 128 such places. This bus has 16, which made a look that finds no sample four times as fast.

use core::time::Duration;
use std::path::PathBuf;

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path, SemanticString};
use lager_home::{Home, HomeError, UnitName};
use lager_sample::Application;

use crate::error::OpenError;

/// Which bus a process joins.
#[derive(Clone, Debug)]
pub struct BusConfig {
    /// The application to which the bus belongs.
    pub application: &'static Application,
    /// The unit.
    pub unit: UnitName,
    /// How many times as fast as real time the unit's clock runs: 1 for a real robot, more for a
    /// simulated one that is to be fast.
    pub speed: f64,
    /// The page of shared memory in which an emulated robot publishes its time. The unit's clock
    /// then follows it, at most `speed` times as fast as real time. Otherwise `None`.
    pub clock: Option<PathBuf>,
    /// The folder in which the bus lives; processes with different folders never meet. `None` is
    /// `/run/lager` where that is this user's, else `/dev/shm/lager-<uid>`. Must be short, since
    /// sockets live below it.
    pub folder: Option<PathBuf>,
}

impl BusConfig {
    /// The bus of the application's unit `r1`, in real time.
    pub fn of(application: &'static Application) -> Self {
        Self {
            application,
            unit: UnitName::default(),
            speed: 1.0,
            clock: None,
            folder: None,
        }
    }
}

/// How many writers that have ended may still have unread samples at one reader; beyond that the
/// samples of the oldest are dropped. See the head of this file.
const GONE: usize = 16;

impl BusConfig {
    /// Where the bus lives; the folder is made if it is missing.
    ///
    /// # Errors
    /// The folder cannot be used, or is not this user's alone.
    pub fn home(&self) -> Result<Home, OpenError> {
        Ok(Home::open(self.application.family, self.folder.as_deref())?)
    }

    /// What other programs need to join this bus with iceoryx2 itself: a whole `iceoryx2.toml`.
    ///
    /// # Errors
    /// The folder cannot be used.
    pub fn iceoryx2_toml(&self) -> Result<String, OpenError> {
        let config = self.transport(&self.home()?)?;
        Ok(toml::to_string(&config).expect("the transport reads its configuration from TOML"))
    }

    /// The transport's configuration at `home`; nothing is read from files or the environment.
    pub(crate) fn transport(&self, home: &Home) -> Result<Config, OpenError> {
        if !(self.speed.is_finite() && self.speed > 0.0) {
            return Err(OpenError::Speed(self.speed));
        }
        let mut config = Config::default();
        config.global.prefix = FileName::new(home.prefix().as_bytes())
            .expect("letters, digits and underscores are a file's name");
        let root = home.transport_folder();
        let path = Path::new(root.as_os_str().as_encoded_bytes())
            .map_err(|_| HomeError::RelativeFolder(home.folder().to_owned()))?;
        config.global.set_root_path(&path);
        // Creating a service takes microseconds; a process that takes longer is dead.
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
    fn a_speed_that_is_no_speed_is_refused() {
        for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let config = BusConfig {
                speed,
                folder: Some(format!("/dev/shm/lpspeed{}", std::process::id()).into()),
                ..BusConfig::of(&crate::name::tests::WEATHER)
            };
            let home = config.home().unwrap();
            let refused = config.transport(&home);
            home.remove();
            assert!(matches!(refused, Err(OpenError::Speed(_))));
        }
    }
}
