//! A rig on the real images with a Pi at each end.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use lager_emulator::chip::{FREQUENCY, Image};
use lager_emulator::pi::{self, Pi};
use lager_emulator::rig::{Board, Images, Rig, RigOptions};
use lager_plant::{Build, Make, Pose, Warehouse};
use lager_wire::{BoardStatus, Command, Payload, SteerData, WheelCommand};

/// The default baud rate of the Pi's lines, and the original robot's.
pub(crate) const FAST: u32 = 500_000;
pub(crate) const SLOW: u32 = 9_600;

/// The folder of the images: that of `firmware/avr`, or the one that LAGER_IMAGES names.
fn folder() -> PathBuf {
    std::env::var_os("LAGER_IMAGES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../avr/target/images"),
        PathBuf::from,
    )
}

fn read(folder: &Path) -> Images {
    let read =
        |name: &str| Image::read(&folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
    Images {
        sensor: read("sensor.elf"),
        steering: read("steering.elf"),
    }
}

/// The images for a baud rate; they are read once.
fn images(baud: u32) -> &'static Images {
    static FAST_ONES: OnceLock<Images> = OnceLock::new();
    static SLOW_ONES: OnceLock<Images> = OnceLock::new();
    match baud {
        FAST => FAST_ONES.get_or_init(|| read(&folder())),
        _ => SLOW_ONES.get_or_init(|| read(&folder().join("9600"))),
    }
}

/// Options of the tests' robot.
fn options(seed: u64, baud: u32) -> RigOptions {
    RigOptions {
        warehouse: Warehouse::builtin("small").expect("it is built in"),
        seed,
        make: Make::Nominal,
        build: Build::default(),
        baud,
    }
}

/// The robot, and the Pi's two ends.
pub(crate) struct Robot {
    pub(crate) rig: Rig,
    pub(crate) sensor: Pi,
    pub(crate) steering: Pi,
}

impl Robot {
    /// A robot whose power comes on now, at the default baud rate.
    pub(crate) fn new(seed: u64) -> Self {
        Self::at(FAST, seed)
    }

    /// A robot whose lines to the Pi have another baud rate.
    pub(crate) fn at(baud: u32, seed: u64) -> Self {
        Self {
            rig: Rig::new(images(baud), &options(seed, baud)).expect("the rig is sound"),
            sensor: Pi::new(Board::Sensor),
            steering: Pi::new(Board::Steering),
        }
    }

    /// A robot whose boards have shaken hands with the Pi and with each other.
    pub(crate) fn up(seed: u64) -> Self {
        let mut robot = Self::new(seed);
        robot.run(Duration::from_millis(500));
        assert!(robot.sensor.is_up() && robot.steering.is_up());
        robot
    }

    /// A connected robot that drives straight ahead without following the line.
    pub(crate) fn driving(seed: u64) -> Self {
        let mut robot = Self::up(seed);
        robot.wheels(WheelCommand::ManualForward);
        robot.run(Duration::from_millis(100));
        assert_eq!(robot.rig.duties(), [100, 100]);
        robot
    }

    /// Puts the robot on its first edge, this far to the left of the line, in mm.
    pub(crate) fn place(&mut self, left: f64) {
        let pose = Pose {
            x: 60.0,
            y: left,
            heading: 0.0,
        };
        self.rig.world_mut().place(pose);
    }

    pub(crate) fn wheels(&mut self, command: WheelCommand) -> u8 {
        self.steering.order(&mut self.rig, Command::Wheel(command))
    }

    pub(crate) fn run(&mut self, time: Duration) {
        pi::run_for(
            &mut self.rig,
            &mut [&mut self.sensor, &mut self.steering],
            time,
        );
    }

    /// Runs until both motors are off, at most for `limit`. Returns the cycle of that.
    pub(crate) fn run_until_off(&mut self, limit: Duration) -> Option<u64> {
        self.rig.take_motor_changes();
        self.run(limit);
        self.rig
            .take_motor_changes()
            .iter()
            .find(|change| change.duties == [0, 0])
            .map(|change| change.cycle)
    }

    /// The latest report of the steering board.
    pub(crate) fn report(&self) -> SteerData {
        self.steering.steer_data().expect("there was a report")
    }

    /// Runs until the steering board sends its status, and returns it.
    pub(crate) fn steering_status(&mut self) -> BoardStatus {
        self.steering.packets.clear();
        self.run(Duration::from_millis(1_100));
        status(&self.steering).expect("it tells twice a second")
    }
}

/// The latest board status from a board.
pub(crate) fn status(pi: &Pi) -> Option<BoardStatus> {
    pi.packets
        .iter()
        .rev()
        .find_map(|arrived| match arrived.packet.payload {
            Payload::BoardStatus(status) => Some(status),
            _ => None,
        })
}

/// This many milliseconds, in cycles.
pub(crate) const fn milliseconds(count: u64) -> u64 {
    FREQUENCY * count / 1_000
}
