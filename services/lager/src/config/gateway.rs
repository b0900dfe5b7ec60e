//! `[gateway]`: where programs outside the robot may look at it.

use std::net::SocketAddr;

use lager_gateway::Addresses;

use super::section::section;
use crate::address::in_config;

section! {
    "gateway"
    /// What the robot shows to programs outside.
    pub struct GatewaySection {
        /// Where Prometheus reads the robot's figures, such as 127.0.0.1:7430. Everybody who can
        /// reach that address may read them. Unset, nowhere.
        #[serde(deserialize_with = "in_config")]
        pub metrics: Option<SocketAddr> = None,
        /// Where Foxglove connects, such as 127.0.0.1:8765. Everybody who can reach that address
        /// may look, and so may every page in a browser of that machine. The program must be built
        /// with the feature foxglove.
        #[serde(deserialize_with = "in_config")]
        pub foxglove: Option<SocketAddr> = None,
    }
}

impl GatewaySection {
    /// Whether `up` starts a gateway.
    pub fn is_wanted(&self) -> bool {
        self.addresses() != Addresses::default()
    }

    /// The section in the form of the gateway.
    pub fn addresses(&self) -> Addresses {
        Addresses {
            metrics: self.metrics,
            foxglove: self.foxglove,
        }
    }
}
