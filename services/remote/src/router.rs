//! [`Router`]: where the gateways of many robots bring what they send, and listeners get it. It is
//! Zenoh's own router; it has no bus, keeps nothing and reads nothing.

use lager_home::UnitName;
use zenoh::{Session, Wait};

use crate::endpoint::Endpoint;
use crate::robot::{CarrierError, may_listen, open_to_group, proves};
use crate::session;
use crate::settings::Proof;

/// A router that listens.
#[derive(Debug)]
pub struct Router {
    session: Session,
}

impl Router {
    /// Listens at `endpoint`, for `robots` and for listeners.
    ///
    /// # Errors
    /// It cannot listen there, or its certificate is none of a router.
    pub fn open(
        endpoint: &Endpoint,
        robots: &[UnitName],
        proof: Option<&Proof>,
    ) -> Result<Self, CarrierError> {
        if let (Endpoint::Tls(_), Some(proof)) = (endpoint, proof) {
            proves(proof, session::ROUTER).map_err(|error| match error {
                CarrierError::OtherRobot { file, .. } => CarrierError::NoRouter(file),
                error => error,
            })?;
        }
        may_listen(endpoint)?;
        let config = session::of_router(endpoint, robots, proof);
        let session = session::open(&config).map_err(|error| CarrierError::Zenoh {
            endpoint: endpoint.to_string(),
            error,
        })?;
        open_to_group(endpoint)?;
        Ok(Self { session })
    }
}

impl Drop for Router {
    fn drop(&mut self) {
        if let Err(error) = self.session.close().wait() {
            tracing::debug!("the session did not close: {error}");
        }
    }
}
