//! `lager simulate`: the flags of a robot in virtual time.

use std::ops::RangeInclusive;

use clap::Args;
use lager_lines::Called;

use super::values;

/// `lager simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Seeds to run, one run each: `7` or `1..20` (both ends run)
    #[arg(long, value_name = "A..B", default_value = "1", allow_negative_numbers = true, value_parser = values::seeds, help_heading = "Body")]
    pub seeds: RangeInclusive<u64>,
    /// Built-in warehouse, or file of a warehouse; may be given several times
    #[arg(long, value_name = "FILE", help_heading = "Mission")]
    pub warehouse: Vec<String>,
    /// The goods to fetch, by number or name, in this order [default: the first of the
    /// warehouse]
    #[arg(long, value_name = "GOODS", value_delimiter = ',', allow_negative_numbers = true, value_parser = values::product, help_heading = "Mission")]
    pub mission: Vec<Called>,
    /// The battery's charge at the start [default: the seed chooses it]
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true, value_parser = values::percent, help_heading = "Body")]
    pub battery: Option<u8>,
    /// Calibrate the line sensors first, as a person does
    #[arg(long, help_heading = "Body")]
    pub calibrate: bool,
    /// Give up after this much virtual time
    #[arg(long, value_name = "SECONDS", default_value_t = 3600, allow_negative_numbers = true, value_parser = values::limit, help_heading = "Mission")]
    pub limit: u64,
    /// How many things come and go on the robot's ways; squares must be 50 cm or more
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = values::obstacles, help_heading = "Body")]
    pub obstacles: u32,
    /// Print one line of JSON for each run
    #[arg(long, help_heading = "Output")]
    pub json: bool,
}
