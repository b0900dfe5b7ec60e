//! `[station]`: the external computer that the robot talks to, and `[comm]`: how.

use std::net::SocketAddr;
use std::path::PathBuf;

use lager_comm::LinkLost;
use serde::{Deserialize, Serialize};

use crate::address::in_config;

/// `[station]`: the external computer that the robot talks to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StationSection {
    /// Whether there is one. Where there is none `up` tells the robot its warehouse.
    pub wanted: bool,
    /// Host and port of one that runs already; unset, `up` starts one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// Where robots connect to a station that `up` starts; unset, `up` chooses.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "in_config"
    )]
    pub listen: Option<SocketAddr>,
    /// The socket at which a GaG connects to it; unset, it is in the robot's folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gag: Option<PathBuf>,
    /// The file in which it keeps the warehouse; unset, `up` chooses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warehouse: Option<PathBuf>,
    /// The file in which it keeps what waits to be fetched; unset, `up` chooses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub queue: Option<PathBuf>,
    /// Where a station that `up` starts shows its panel; unset, `up` chooses.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "in_config"
    )]
    pub panel: Option<SocketAddr>,
}

impl StationSection {
    /// Where a station listens unless somebody says otherwise.
    pub const USUAL: &str = "127.0.0.1:7420";
    /// Where a panel answers unless somebody says otherwise.
    pub const USUAL_PANEL: &str = "127.0.0.1:7410";
}

impl Default for StationSection {
    fn default() -> Self {
        Self {
            wanted: true,
            address: None,
            listen: None,
            gag: None,
            warehouse: None,
            queue: None,
            panel: None,
        }
    }
}

/// `[comm]`: how the robot talks to it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CommSection {
    /// The file of the secret by which robot and station prove who they are; unset, a station that
    /// `up` starts and the robot have one of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub secret: Option<PathBuf>,
    /// What it does in autonomous mode while it is out of reach.
    pub link_lost: WithoutLink,
}

/// What a robot does in autonomous mode without its external computer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WithoutLink {
    /// It goes on with its orders.
    #[default]
    GoOn,
    /// It ends the edge and stands until the link is there again.
    Stand,
}

impl From<WithoutLink> for LinkLost {
    fn from(wanted: WithoutLink) -> Self {
        match wanted {
            WithoutLink::GoOn => Self::GoOn,
            WithoutLink::Stand => Self::Stand,
        }
    }
}
