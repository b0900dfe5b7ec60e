//! `[gateway]`: what programs outside are shown of the robot.

use std::net::SocketAddr;

use lager_gateway::Addresses;
use serde::{Deserialize, Serialize};

use crate::address::in_config;

/// `[gateway]`: what programs outside are shown of the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GatewaySection {
    /// Where Prometheus reads figures; unset, nowhere.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "in_config"
    )]
    pub metrics: Option<SocketAddr>,
    /// Where Foxglove looks on; unset, nowhere.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "in_config"
    )]
    pub foxglove: Option<SocketAddr>,
}

impl GatewaySection {
    /// Whether `up` starts a gateway.
    pub fn is_wanted(&self) -> bool {
        self.addresses() != Addresses::default()
    }

    /// The same for the gateway.
    pub fn addresses(&self) -> Addresses {
        Addresses {
            metrics: self.metrics,
            foxglove: self.foxglove,
        }
    }
}
