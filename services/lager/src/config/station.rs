//! `[station]`: the external computer that the robot talks to.

use std::net::SocketAddr;

use serde::{Deserialize, Serialize};

/// `[station]`: the external computer that the robot talks to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StationSection {
    /// Whether there is one. Where there is none `up` tells the robot its warehouse.
    pub wanted: bool,
    /// Host and port of one that runs already; unset, `up` starts one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// Where a station that `up` starts shows its panel; unset, `up` chooses.
    #[serde(skip_serializing_if = "Option::is_none")]
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
            panel: None,
        }
    }
}
