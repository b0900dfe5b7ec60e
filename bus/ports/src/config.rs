//! Which bus a process joins, and the transport's limits there.
//!
//! A reader visits the places of writers that are gone each time it looks for samples. iceoryx2
//! has 128 such places and this bus has 16, which made a look that finds nothing four times as
//! fast.

use core::time::Duration;
use std::path::PathBuf;

use iceoryx2::config::Config;

use crate::error::OpenError;
use crate::name::RobotName;
use crate::place::Place;

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
    /// The folder in which the bus lives; processes with different folders never meet. `None` is
    /// `/run/lager` where that is this user's, else `/dev/shm/lager-<uid>`. Must be short, since
    /// sockets live below it.
    pub folder: Option<PathBuf>,
}

impl Default for BusConfig {
    fn default() -> Self {
        Self {
            robot: RobotName::default(),
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
    pub fn place(&self) -> Result<Place, OpenError> {
        Place::open(self.folder.as_deref())
    }

    /// What other programs need to join this bus with iceoryx2 itself: a whole `iceoryx2.toml`.
    ///
    /// # Errors
    /// The folder cannot be used.
    pub fn iceoryx2_toml(&self) -> Result<String, OpenError> {
        let config = self.transport(&self.place()?)?;
        Ok(toml::to_string(&config).expect("the transport reads its configuration from TOML"))
    }

    /// The transport's configuration at `place`; nothing is read from files or the environment.
    pub(crate) fn transport(&self, place: &Place) -> Result<Config, OpenError> {
        if !(self.speed.is_finite() && self.speed > 0.0) {
            return Err(OpenError::Speed(self.speed));
        }
        let mut config = Config::default();
        place.furnish(&mut config)?;
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
                ..BusConfig::default()
            };
            let place = config.place().unwrap();
            let refused = config.transport(&place);
            place.remove();
            assert!(matches!(refused, Err(OpenError::Speed(_))));
        }
    }
}
