//! The command line of a report.

use std::path::PathBuf;

use clap::Args;

/// `lager report`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager report                               into lager-report-ROBOT-DATE.tar.gz
  lager report --out fault.tar.gz
  lager report --recording tour.mcap         with the last two minutes of a recording
  sudo lager report                          with the journal of a robot that systemd started

The file has the logs, the configuration, what `lager doctor` says, the events of the last day, the
end of a recording and the versions. It works while the robot is down or hangs, and report.txt in it
says what could not be had. Secrets, tokens, passwords, network names, hardware addresses and the
name of your home folder are left out. Look into it before you hand it on; `tar tzf FILE` lists
what is in it.")]
pub struct ReportArgs {
    /// The file to write, which must not exist yet [default: lager-report-ROBOT-DATE.tar.gz]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// A recording, whose last two minutes are put in [default: the newest ROBOT-*.mcap in this
    /// folder, if there is one]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub recording: Option<PathBuf>,
}
