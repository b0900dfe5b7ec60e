//! A board alone on a bench: its chip with bootloader and application, and its line to the Pi.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::rc::Rc;
use std::time::Duration;

use lager_emulator::chip::{Chip, FREQUENCY, Image as ChipImage, ResetLine, UsartId};
use lager_loader::{BOOT_SECTION, Header, Image, Line, crc_step};
use lager_wire::Callsign;

/// Cycles of a bit at 500 000 Bd, and of a byte.
const BIT: u64 = 32;
const BYTE: u64 = 10 * BIT;
/// How long the chip runs before the Pi looks again.
const STEP: u64 = 2 * BYTE;

/// The folder of the images: that of `firmware/avr`, or the one that LAGER_IMAGES names.
pub(crate) fn folder() -> PathBuf {
    std::env::var_os("LAGER_IMAGES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../avr/target/images"),
        PathBuf::from,
    )
}

pub(crate) fn name(role: Callsign) -> &'static str {
    match role {
        Callsign::Sensor => "sensor",
        _ => "steering",
    }
}

/// A board's image as it is built.
pub(crate) fn image(role: Callsign) -> Image {
    let path = folder().join(format!("{}.hex", name(role)));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}; build the images with firmware/avr/build",
            path.display()
        )
    });
    Image::from_hex(&text).expect("the build makes whole images")
}

/// An image with another build number and some pages more, so that every page differs from
/// `image` or is new. It does not run.
pub(crate) fn other(image: &Image, build: u16) -> Image {
    let mut bytes: Vec<u8> = image.bytes().iter().map(|byte| !byte).collect();
    bytes.extend([0xA5; 700]);
    Image::from_bytes(stamped(bytes, image.role(), build)).expect("it is whole")
}

/// Gives bytes the header of an image.
pub(crate) fn stamped(mut bytes: Vec<u8>, role: Callsign, build: u16) -> Vec<u8> {
    let mut header = Header::of(role);
    header[6..8].copy_from_slice(&build.to_le_bytes());
    header[8..12].copy_from_slice(&(bytes.len() as u32).to_le_bytes());
    let at = Header::AT as usize;
    bytes[at..at + Header::LENGTH].copy_from_slice(&header);
    let crc = bytes
        .iter()
        .fold(u32::MAX, |crc, byte| crc_step(crc, *byte));
    bytes[at + 12..at + 16].copy_from_slice(&(!crc).to_le_bytes());
    bytes
}

/// The little application `starts.S`, as an image for this board.
pub(crate) fn starts(role: Callsign, test: &str) -> Image {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images/starts.S");
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("starts-{test}.elf"));
    let raw = out.with_extension("bin");
    for (program, arguments) in [
        ("avr-gcc", vec!["-mmcu=atmega1284p", "-nostartfiles", "-o"]),
        ("avr-objcopy", vec!["-O", "binary", "-j", ".text"]),
    ] {
        let mut command = Command::new(program);
        command.args(arguments);
        let files = if program == "avr-gcc" {
            [&out, &source]
        } else {
            [&out, &raw]
        };
        let status = command.args(files).status().expect("avr-gcc is installed");
        assert!(status.success());
    }
    let bytes = std::fs::read(raw).expect("it was just written");
    Image::from_bytes(stamped(bytes, role, 1)).expect("it is whole")
}

/// A board.
pub(crate) struct Bench {
    pub(crate) chip: Rc<Chip>,
    arrived: Rc<RefCell<VecDeque<u8>>>,
    /// The cycle in which the line is free again.
    free: Cell<u64>,
    /// When somebody pulls the plug.
    pub(crate) cut: Option<Cut>,
    /// How many pages the chip has begun to erase or to write since power came on.
    begun: usize,
    programs: bool,
}

/// The moment at which power goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// While the chip erases or writes a page for this time, from 1: odd times erase.
    pub(crate) operation: usize,
    /// How far it has come then; `None`: it has just finished.
    pub(crate) after: Option<Duration>,
}

impl Bench {
    /// A board with its bootloader and this application; power comes on now.
    pub(crate) fn new(role: Callsign, application: Option<&Image>) -> Self {
        let path = folder().join(format!("{}-loader.elf", name(role)));
        let loader = ChipImage::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let both = match application {
            Some(image) => loader.with(&ChipImage::from_bytes(image.bytes().to_vec())),
            None => loader,
        };
        let chip = Chip::new(&both, 0, 1).expect("simavr knows the chip");
        let arrived = Rc::new(RefCell::new(VecDeque::new()));
        let end = Rc::clone(&arrived);
        chip.on_sent(UsartId::Zero, move |sent| {
            end.borrow_mut().push_back(sent.byte);
        });
        Self {
            chip,
            arrived,
            free: Cell::new(0),
            cut: None,
            begun: 0,
            programs: false,
        }
    }

    pub(crate) fn run(&mut self, time: Duration) {
        self.chip.run_until(self.chip.cycle() + cycles(time));
    }

    /// Power goes and comes back.
    pub(crate) fn power(&mut self) {
        self.chip.reset(ResetLine::Power);
        self.arrived.borrow_mut().clear();
        self.free.set(0);
        self.cut = None;
        self.begun = 0;
        self.programs = false;
    }

    /// Runs the chip one step. `false`: power is gone.
    fn step(&mut self, until: u64) -> bool {
        let now = self.chip.cycle();
        self.chip.run_until((now + STEP).min(until));
        let programs = self.chip.is_programming();
        let ended = self.programs && !programs;
        self.begun += usize::from(programs && !self.programs);
        self.programs = programs;
        let Some(cut) = self.cut.filter(|cut| cut.operation == self.begun) else {
            return true;
        };
        match cut.after {
            Some(after) => self.run(after),
            None if ended => {}
            None => return true,
        }
        false
    }

    /// The boot section, byte for byte.
    pub(crate) fn boot_section(&self) -> Vec<u8> {
        self.chip.flash()[BOOT_SECTION as usize..].to_vec()
    }

    /// What the application `starts.S` has noted: how often it started.
    pub(crate) fn starts(&self) -> u8 {
        self.chip.memory(0x3F00, 1)[0]
    }

    /// Takes everything that has arrived at the Pi.
    pub(crate) fn take(&self) -> Vec<u8> {
        self.arrived.borrow_mut().drain(..).collect()
    }
}

impl Line for Bench {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        for &byte in bytes {
            let from = self.free.get().max(self.chip.cycle());
            self.chip.send_to(UsartId::Zero, from, byte, BIT as f64);
            self.free.set(from + BYTE);
        }
        Ok(())
    }

    fn receive(&mut self, within: Duration) -> io::Result<Option<u8>> {
        let until = self.chip.cycle() + cycles(within);
        loop {
            if let Some(byte) = self.arrived.borrow_mut().pop_front() {
                return Ok(Some(byte));
            }
            let now = self.chip.cycle();
            if now >= until {
                return Ok(None);
            }
            if !self.step(until) {
                return Err(io::Error::other("the power is gone"));
            }
        }
    }

    fn now(&self) -> Duration {
        Duration::from_nanos(self.chip.cycle() * 125 / 2)
    }
}

/// Whole cycles of a time.
pub(crate) fn cycles(time: Duration) -> u64 {
    time.as_micros() as u64 * (FREQUENCY / 1_000_000)
}
