//! [`Chips`]: the GPIO chips of this machine's kernel.

use core::time::Duration;
use std::io;
use std::path::{Path, PathBuf};

use gpiocdev::Request;
use gpiocdev::chip::{Chip, chips};
use gpiocdev::line::{Bias, Direction, EdgeDetection, EdgeKind, Value, Values};
use gpiocdev::request::Config;
use lager_orders::{Contact, Level, Levels};

use super::{ButtonsConfig, Gpio, Lines, Movement, Survey};

/// The lines of the Pi's header on which nothing but buttons is expected: without those of serial
/// ports, I2C and SPI, which other programs may use.
const FREE: [u8; 17] = [
    4, 5, 6, 12, 13, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27,
];
/// What the labels of the chips begin with to which the header of a Pi is connected.
const HEADERS: [&str; 2] = ["pinctrl-bcm2", "pinctrl-rp1"];
/// How long a line takes to follow its resistor.
const SETTLES: Duration = Duration::from_millis(2);

/// The chips of this machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Chips;

impl Gpio for Chips {
    fn open(&self, config: &ButtonsConfig) -> io::Result<Box<dyn Lines + '_>> {
        let mut request = Request::builder();
        request.on_chip(&config.chip).with_consumer("lager");
        for Contact { line, closed } in config.reset.into_iter().chain(config.switch) {
            // Without a contact its line goes where an open one would be.
            request.with_line(line.into()).as_input();
            match closed {
                Level::Low => request.as_active_low().with_bias(Bias::PullUp),
                Level::High => request.as_active_high().with_bias(Bias::PullDown),
            };
            request
                .with_edge_detection(EdgeDetection::BothEdges)
                .with_debounce_period(config.debounce);
        }
        Ok(Box::new(Watched(
            request.request().map_err(io::Error::other)?,
        )))
    }

    fn survey(&self) -> io::Result<Box<dyn Survey + '_>> {
        for path in chips().map_err(io::Error::other)? {
            let chip = Chip::from_path(&path).map_err(io::Error::other)?;
            let label = chip.info().map_err(io::Error::other)?.label;
            if HEADERS.iter().any(|header| label.starts_with(header)) {
                return Ok(Box::new(Header::open(&chip, path)?));
            }
        }
        Err(io::Error::new(
            io::ErrorKind::NotFound,
            "this machine has no chip with the header of a Raspberry Pi",
        ))
    }
}

/// Lines that the kernel debounces.
struct Watched(Request);

impl Lines for Watched {
    fn is_closed(&self, line: u8) -> io::Result<bool> {
        let value = self.0.value(line.into()).map_err(io::Error::other)?;
        Ok(value == Value::Active)
    }

    fn movement(&self, patience: Duration) -> io::Result<Option<Movement>> {
        if !(self.0.wait_edge_event(patience)).map_err(io::Error::other)? {
            return Ok(None);
        }
        let edge = self.0.read_edge_event().map_err(io::Error::other)?;
        Ok(Some(Movement {
            line: u8::try_from(edge.offset).map_err(io::Error::other)?,
            // A line is active while its contact is closed.
            is_closed: edge.kind == EdgeKind::Rising,
            at_ns: edge.timestamp_ns,
        }))
    }
}

/// The free lines of the header, each as an input. Whether something drives a line shows when its
/// resistor pulls it up and then down: a line that follows is open.
struct Header {
    request: Request,
    lines: Vec<u8>,
    chip: u8,
}

impl Header {
    fn open(chip: &Chip, path: PathBuf) -> io::Result<Self> {
        let is_free = |line: &u8| {
            let info = chip.line_info((*line).into());
            info.is_ok_and(|info| !info.used && info.direction == Direction::Input)
        };
        let lines: Vec<u8> = FREE.into_iter().filter(is_free).collect();
        if lines.is_empty() {
            return Err(io::Error::new(
                io::ErrorKind::AddrInUse,
                "other programs have all lines of the header",
            ));
        }
        let config = pulled(&lines, Bias::PullUp);
        let mut request = Request::from_config(config);
        let request = request.on_chip(&path).with_consumer("lager").request();
        Ok(Self {
            request: request.map_err(io::Error::other)?,
            lines,
            chip: number(&path),
        })
    }

    /// The lines that are high while resistors pull them this way.
    fn high(&self, bias: Bias) -> io::Result<Values> {
        let config = pulled(&self.lines, bias);
        self.request
            .reconfigure(&config)
            .map_err(io::Error::other)?;
        std::thread::sleep(SETTLES);
        let mut values = Values::default();
        self.request.values(&mut values).map_err(io::Error::other)?;
        Ok(values)
    }
}

impl Survey for Header {
    fn levels(&mut self) -> io::Result<Levels> {
        let up = self.high(Bias::PullUp)?;
        let down = self.high(Bias::PullDown)?;
        let is_high = |values: &Values, line: u8| values.get(line.into()) == Some(Value::Active);
        let mut levels = Levels::default();
        for line in &self.lines {
            let level = match (is_high(&up, *line), is_high(&down, *line)) {
                (true, true) => Some(Level::High),
                (false, false) => Some(Level::Low),
                _ => None,
            };
            levels.set(*line, level);
        }
        Ok(levels)
    }

    fn chip(&self) -> u8 {
        self.chip
    }
}

fn pulled(lines: &[u8], bias: Bias) -> Config {
    let offsets: Vec<u32> = lines.iter().map(|line| u32::from(*line)).collect();
    let mut config = Config::default();
    config.with_lines(&offsets).as_input().with_bias(bias);
    config
}

/// The number at the end of a chip's path.
fn number(path: &Path) -> u8 {
    let name = path.to_string_lossy();
    let digits = name.trim_start_matches(|letter: char| !letter.is_ascii_digit());
    digits.parse().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chip_has_the_number_of_its_path() {
        for (path, wanted) in [("/dev/gpiochip0", 0), ("/dev/gpiochip14", 14)] {
            assert_eq!(number(Path::new(path)), wanted);
        }
    }

    #[test]
    fn no_line_of_a_bus_is_taken_for_a_button() {
        for (what, lines) in [
            ("the header's EEPROM", [0, 1]),
            ("I2C", [2, 3]),
            ("the serial port", [14, 15]),
            ("SPI", [8, 9]),
            ("SPI", [10, 11]),
        ] {
            assert!(!lines.iter().any(|line| FREE.contains(line)), "{what}");
        }
    }
}
