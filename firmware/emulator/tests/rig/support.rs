//! A rig on the real images, and a Pi at each end.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use lager_emulator::chip::{FREQUENCY, Image};
use lager_emulator::pi::{self, Pi};
use lager_emulator::rig::{Board, Images, Rig, RigOptions};
use lager_plant::{Make, Pose, Warehouse};
use lager_wire::{BoardStatus, Command, Payload, SteerData, WheelCommand};

/// The default baud rate of the Pi's lines, and the original's.
pub(crate) const FAST: u32 = 500_000;
pub(crate) const SLOW: u32 = 9_600;

/// Where `firmware/avr` puts its images, unless the environment says otherwise.
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

/// The images for a baud rate, read once.
fn images(baud: u32) -> &'static Images {
    static FAST_ONES: OnceLock<Images> = OnceLock::new();
    static SLOW_ONES: OnceLock<Images> = OnceLock::new();
    match baud {
        FAST => FAST_ONES.get_or_init(|| read(&folder())),
        _ => SLOW_ONES.get_or_init(|| read(&folder().join("9600"))),
    }
}

/// How the tests build their robot.
fn options(seed: u64, baud: u32) -> RigOptions {
    RigOptions {
        warehouse: Warehouse::builtin("small").expect("it is built in"),
        seed,
        make: Make::Nominal,
        baud,
    }
}

/// The robot and the Pi.
pub(crate) struct Robot {
    pub(crate) rig: Rig,
    pub(crate) sensor: Pi,
    pub(crate) steering: Pi,
}

impl Robot {
    /// Power comes on.
    pub(crate) fn new(seed: u64) -> Self {
        Self::at(FAST, seed)
    }

    /// The same with the lines to the Pi at another baud rate.
    pub(crate) fn at(baud: u32, seed: u64) -> Self {
        Self {
            rig: Rig::new(images(baud), &options(seed, baud)).expect("the rig is sound"),
            sensor: Pi::new(Board::Sensor),
            steering: Pi::new(Board::Steering),
        }
    }

    /// Power is on and both boards have shaken hands, with the Pi and with each other.
    pub(crate) fn up(seed: u64) -> Self {
        let mut robot = Self::new(seed);
        robot.run(Duration::from_millis(500));
        assert!(robot.sensor.is_up() && robot.steering.is_up());
        robot
    }

    /// Up, and driving straight ahead without looking at the line.
    pub(crate) fn driving(seed: u64) -> Self {
        let mut robot = Self::up(seed);
        robot.wheels(WheelCommand::ManualForward);
        robot.run(Duration::from_millis(100));
        assert_eq!(robot.rig.duties(), [100, 100]);
        robot
    }

    /// The robot on its first edge, this far left of the line.
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

    /// Runs until both motors are off; the cycle of that, at most `limit` ahead.
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

    /// Runs until the steering board tells how it is, and that.
    pub(crate) fn steering_status(&mut self) -> BoardStatus {
        self.steering.packets.clear();
        self.run(Duration::from_millis(1_100));
        status(&self.steering).expect("it tells twice a second")
    }
}

/// The latest board status that has arrived.
pub(crate) fn status(pi: &Pi) -> Option<BoardStatus> {
    pi.packets
        .iter()
        .rev()
        .find_map(|arrived| match arrived.packet.payload {
            Payload::BoardStatus(status) => Some(status),
            _ => None,
        })
}

/// Cycles of so many milliseconds.
pub(crate) const fn milliseconds(count: u64) -> u64 {
    FREQUENCY * count / 1_000
}
