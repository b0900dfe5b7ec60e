//! The command line of `lager keys`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// `lager keys`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager keys authority                             once; keep keys/authority.key where you made it
  lager keys robot r1 --address 192.168.1.4        for the robot: authority.pem, r1.pem and r1.key
  lager keys listener dash                         for a listener: authority.pem, dash.pem and dash.key
  lager keys router --address 192.168.1.9          for a router: authority.pem, router.pem, router.key

Name the three files in [gateway.zenoh] of the configuration, on the robot and where you listen. Who
has a key that this authority has signed may listen to all of its robots. Nothing is overwritten.")]
pub struct KeysArgs {
    /// For whom
    #[command(subcommand)]
    pub command: KeysCommand,
    /// Where the files are
    #[arg(long, global = true, value_name = "FOLDER", default_value = "keys")]
    pub folder: PathBuf,
    /// For how many days it holds
    #[arg(long, global = true, value_name = "DAYS", default_value_t = 365, value_parser = clap::value_parser!(i64).range(1..=7_300))]
    pub days: i64,
}

/// For whom a certificate is made.
#[derive(Debug, Subcommand)]
pub enum KeysCommand {
    /// The authority that signs all others
    Authority,
    /// A robot, by its name
    Robot {
        /// The robot's name, as in the configuration
        robot: String,
        /// An address or a host name at which listeners call it; may be given several times
        #[arg(long, value_name = "HOST")]
        address: Vec<String>,
    },
    /// A router, to which robots bring what they send
    Router {
        /// An address or a host name at which robots and listeners call it; may be given several times
        #[arg(long, value_name = "HOST")]
        address: Vec<String>,
    },
    /// A listener, by a name of your choice
    Listener {
        /// The listener's name
        listener: String,
    },
}
