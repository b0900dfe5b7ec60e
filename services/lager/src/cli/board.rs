//! The command line of the boards' images.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use lager_loader::fuses;
use lager_wire::Callsign;

use super::values;
use crate::config::flag;

/// `lager board`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  lager board update                                       both boards, wherever they are plugged in
  lager board update --port /dev/ttyUSB0 --port /dev/ttyUSB1
  lager board update --image new/sensor.hex                the sensor board only
  lager board reset steering
  lager board flash sensor --programmer usbasp --dry-run   only show what it would do
  lager board flash sensor --programmer atmelice --bit-clock 10

Updates and resets work while the robot is up, too: it is stopped, lends the boards' ports meanwhile, and
stands afterwards until `lager resume`.")]
pub struct BoardArgs {
    /// What to do
    #[command(subcommand)]
    pub command: BoardCommand,
}

/// What to do with the boards.
#[derive(Debug, Subcommand)]
pub enum BoardCommand {
    /// Give the boards new images over their serial ports, verify them and start them
    #[command(after_help = "Examples:
  lager board update
  lager board update --port /dev/ttyUSB0 --port /dev/ttyUSB1
  lager board update --image new/sensor.hex --image new/steering.hex

The boards say who they are, so it does not matter which board is at which port, and each gets its own
image. Everything that can be wrong with an image or a board is found before the first page is erased.
A board whose update broke off, even by a power cut, waits in its bootloader: run the command again.
The boards keep their settings.")]
    Update(UpdateArgs),
    /// Give a board its bootloader and fuses with a programmer (ISP or JTAG), once for each board
    #[command(after_help = "Examples:
  lager board flash sensor --programmer usbasp
  lager board flash steering --programmer stk500v2 --port /dev/ttyACM0
  lager board flash sensor --programmer jtagice3 --port usb --dry-run
  lager board flash sensor --programmer usbasp --bit-clock 10   a new chip runs at 1 MHz, so slowly
  lager board flash sensor --programmer usbasp --clock external  an oscillator in place of the crystal

It runs avrdude, which must be installed; `avrdude -c ?` lists the programmers. It reads the chip's
signature first and leaves another chip alone. It erases the board's program and keeps its settings.
`lager board update` then gives the board its program.")]
    Flash(FlashArgs),
    /// Restart a board; its motors are off from then on
    Reset(ResetArgs),
}

/// Which ports.
#[derive(Debug, Args)]
pub struct PortArgs {
    /// A serial port with a board, in place of those of the configuration's `[serial]`; may be given
    /// twice
    #[arg(long, value_name = "PORT")]
    pub port: Vec<PathBuf>,
    #[arg(
        long,
        value_name = "BAUD",
        allow_negative_numbers = true,
        value_parser = values::baud,
        help = flag("serial", "baud")
    )]
    pub baud: Option<u32>,
}

/// `lager board update`.
#[derive(Debug, Args)]
pub struct UpdateArgs {
    /// An image's .hex file; only its board gets one then. May be given twice [default: the images
    /// that came with this program, or that `firmware/avr/build` has built]
    #[arg(long, value_name = "FILE")]
    pub image: Vec<PathBuf>,
    /// Where the boards are
    #[command(flatten)]
    pub ports: PortArgs,
}

/// `lager board flash`.
#[derive(Debug, Args)]
pub struct FlashArgs {
    /// The board whose chip the programmer is connected to
    pub board: Board,
    /// The programmer, by avrdude's name for it
    #[arg(long, value_name = "NAME")]
    pub programmer: String,
    /// The programmer's port, if avrdude needs one, such as usb or /dev/ttyACM0
    #[arg(long, value_name = "PORT")]
    pub port: Option<String>,
    /// How long a bit takes on the programmer's wires, in microseconds [default: avrdude's]
    #[arg(long, value_name = "US", allow_negative_numbers = true, value_parser = values::bit_clock)]
    pub bit_clock: Option<f64>,
    /// Where the board's clock of 16 MHz comes from
    #[arg(long, value_name = "SOURCE", default_value = "crystal")]
    pub clock: BoardClock,
    /// The bootloader's .hex file [default: the board's own, beside the images]
    #[arg(long, value_name = "FILE")]
    pub loader: Option<PathBuf>,
    /// Show the commands and run none of them
    #[arg(long)]
    pub dry_run: bool,
}

/// `lager board reset`.
#[derive(Debug, Args)]
pub struct ResetArgs {
    /// The board
    pub board: Board,
    /// Where the boards are
    #[command(flatten)]
    pub ports: PortArgs,
}

/// What gives a board its clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BoardClock {
    /// A crystal at XTAL1 and XTAL2
    Crystal,
    /// An oscillator at XTAL1. A chip that was told so and has none answers no programmer
    External,
}

impl BoardClock {
    /// The chip's low fuse.
    pub fn low_fuse(self) -> u8 {
        match self {
            Self::Crystal => fuses::LOW,
            Self::External => fuses::LOW_EXTERNAL,
        }
    }
}

/// A board, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The sensor board
    Sensor,
    /// The steering board
    Steering,
}

impl Board {
    /// Its callsign on the wire.
    pub fn callsign(self) -> Callsign {
        match self {
            Self::Sensor => Callsign::Sensor,
            Self::Steering => Callsign::Steering,
        }
    }
}
