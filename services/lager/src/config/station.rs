//! `[station]`: the external computer that the robot talks to. `[comm]`: how it talks to it.

use std::net::SocketAddr;
use std::path::PathBuf;

use lager_comm::LinkLost;

use super::section::section;
use crate::address::in_config;

section! {
    "station"
    /// The external computer that the robot talks to.
    pub struct StationSection {
        /// Whether the robot has an external computer, which tells it its warehouse and its orders.
        /// If not, `lager up` tells it its warehouse.
        pub wanted: bool = true,
        /// Host and port of one that runs already. Unset, `lager up` starts one at 127.0.0.1:7420,
        /// or at another port if that one is taken.
        pub address: Option<String> = None,
        /// Where the one that `lager up` starts listens for robots, instead of that address.
        #[serde(deserialize_with = "in_config")]
        pub listen: Option<SocketAddr> = None,
        /// The path of its socket for a GaG. Unset, it is in the robot's folder of the bus.
        pub gag: Option<PathBuf> = None,
        /// The file in which it keeps the warehouse that was saved in the panel. Unset, the file
        /// that `warehouse` names; for a built-in warehouse, NAME.toml in the state folder.
        pub warehouse: Option<PathBuf> = None,
        /// The file in which it keeps the orders that wait. Unset, queue.toml in the state folder.
        pub queue: Option<PathBuf> = None,
        /// Whether it keeps the last day of the robot's states and events, 192 MiB at most, in the
        /// folder history in the state folder.
        pub history: bool = true,
        /// Where its operator panel answers browsers of this machine. Unset, 127.0.0.1:7410, or
        /// another port if that one is taken.
        #[serde(deserialize_with = "in_config")]
        pub panel: Option<SocketAddr> = None,
    }
}

impl StationSection {
    /// Where a station listens by default.
    pub const USUAL: &str = "127.0.0.1:7420";
    /// Where a panel answers by default.
    pub const USUAL_PANEL: &str = "127.0.0.1:7410";
}

section! {
    "comm"
    /// How the robot talks to it.
    pub struct CommSection {
        /// The file of the secret by which the robot and its external computer recognise each
        /// other: one secret, or a line `<name> <secret>` for each robot, with mode 0600. Unset, a
        /// station that `lager up` starts shares a new secret with the robot; at [station] address
        /// the robot believes whoever answers.
        pub secret: Option<PathBuf> = None,
        /// What the robot does in autonomous mode when it cannot reach the external computer:
        /// "go-on" (it carries out its orders) or "stand" (it drives to the next crossing and
        /// stands there until the link is back). In manual mode it stands at once.
        pub link_lost: LinkLost = LinkLost::GoOn,
    }
}
