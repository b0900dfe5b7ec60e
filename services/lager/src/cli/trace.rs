//! The command line of `lager trace`.

use std::path::PathBuf;

use clap::Args;

use super::values;

/// `lager trace`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  sudo lager trace                              frames that took longer than 1 ms, for 10 s
  sudo lager trace --late 200us --out late.json    also a file that ui.perfetto.dev opens

A frame's way begins when the bridge reads it and ends when logic sleeps again, or the bridge, if
logic woke it. Each late frame gets one cause: an interrupt, another thread, a sleeping core, a
hypervisor, a page fault, the kernel's serial worker, our own code, a stop by a signal. It needs
root. The kernel's events cost each change of thread about a microsecond meanwhile.")]
pub struct TraceArgs {
    /// Frames that take longer than this are late
    #[arg(long, value_name = "TIME", default_value = "1ms", value_parser = lager_tracer::limit)]
    pub late: u64,
    /// How many seconds to look
    #[arg(long, value_name = "SECONDS", default_value = "10", allow_negative_numbers = true, value_parser = values::seconds)]
    pub duration: f64,
    /// Draw the latest frames into a file that ui.perfetto.dev opens
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Print one line of JSON instead of a table
    #[arg(long, help_heading = "Output")]
    pub json: bool,
}
