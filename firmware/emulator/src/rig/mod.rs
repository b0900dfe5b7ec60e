//! Joins both chips, their wires and the world, in chip time.
//!
//! ```text
//!   Pi <--PiLine--> sensor chip --ExDe: data, sync--> steering chip <--PiLine--> Pi
//!                    ^    ^     <--return sync------    |       |
//!              multiplexer IR                         motors  servo wire
//!                    '----'------- lager_plant::World ---'------'
//! ```
//! The chips run in lock-step: the chip that acts first runs until the other one acts; while both
//! are awake they alternate instruction by instruction. A sleeping chip is left alone, until an
//! edge on a wire brings it up to the edge's cycle. So a run depends only on the images, the
//! options, and the bytes written and their times; how the caller divides the time does not matter.
//!
//! It reads no clock and does no input or output; the shell does.

mod boards;
mod line;
mod servos;

use core::cell::{Cell, Ref, RefCell, RefMut};
use core::time::Duration;
use std::rc::Rc;

use lager_pins::{sensor as at_sensor, steering as at_steering};
use lager_plant::arm::RESTING;
use lager_plant::noise::{Noise, START_STREAM};
use lager_plant::{Build, Make, Snapshot, Warehouse, WarehouseError, World, WorldState};
use thiserror::Error;

use crate::chip::{Chip, FREQUENCY, Image, ImageError, ResetLine, Wire, wire};

pub use boards::{Conversion, Input, MotorChange};
pub use servos::{ServoByte, ServoWire};

use boards::{Motors, SensorInputs};
use line::PiLine;

/// The steering board's channel of the battery.
const BATTERY: u8 = at_steering::BATTERY.bit;
/// The boards start at most this many cycles apart: 5 ms.
const START_SPREAD: u64 = FREQUENCY / 200;

/// One of the two boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Board {
    /// Line sensors, IR ranger, ExDe's sender.
    Sensor,
    /// Motors, arm, ExDe's receiver.
    Steering,
}

impl Board {
    /// Both, in the order of their names.
    pub const BOTH: [Self; 2] = [Self::Sensor, Self::Steering];

    /// Its name in sentences and file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Steering => "steering",
        }
    }
}

/// The images of both boards.
#[derive(Clone, Debug)]
pub struct Images {
    /// The sensor board's.
    pub sensor: Image,
    /// The steering board's.
    pub steering: Image,
}

/// Options of a rig.
#[derive(Clone, Debug)]
pub struct RigOptions {
    /// The warehouse of the world.
    pub warehouse: Warehouse,
    /// Chooses every imperfection: the same seed is the same robot.
    pub seed: u64,
    /// The kind of imperfections.
    pub make: Make,
    /// How the robot is built. Its boards do not know that unless they are told.
    pub build: Build,
    /// Baud rate of the Pi's ends of both lines.
    pub baud: u32,
}

/// Why a rig cannot be built.
#[derive(Debug, Error)]
pub enum RigError {
    /// The warehouse cannot be built.
    #[error(transparent)]
    Warehouse(#[from] WarehouseError),
    /// An image cannot be loaded.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// Converts between world time and the chips' cycles.
#[derive(Debug, Default)]
pub(crate) struct Epoch(Cell<u64>);

impl Epoch {
    /// World time at a cycle.
    pub(crate) fn world(&self, cycle: u64) -> Duration {
        Duration::from_nanos(self.0.get() + nanoseconds(cycle))
    }

    /// The first cycle at or after a world time.
    pub(crate) fn cycle(&self, world: Duration) -> u64 {
        let since = (world.as_nanos() as u64).saturating_sub(self.0.get());
        (since * 2).div_ceil(125)
    }
}

/// Whole nanoseconds of a number of cycles.
pub fn nanoseconds(cycles: u64) -> u64 {
    // 62.5 ns a cycle.
    cycles * 125 / 2
}

/// Whole cycles of a time.
pub fn cycles(time: Duration) -> u64 {
    time.as_nanos() as u64 * 2 / 125
}

/// The three wires between the boards.
pub struct ExDe {
    /// From the sensor board.
    pub data: Rc<Wire>,
    /// From the sensor board.
    pub sync: Rc<Wire>,
    /// From the steering board.
    pub return_sync: Rc<Wire>,
}

/// The robot on its real images.
pub struct Rig {
    sensor: Rc<Chip>,
    steering: Rc<Chip>,
    world: Rc<RefCell<World>>,
    epoch: Rc<Epoch>,
    inputs: Rc<SensorInputs>,
    motors: Rc<Motors>,
    servos: Rc<ServoWire>,
    lines: [Rc<PiLine>; 2],
    exde: ExDe,
    cycle: u64,
}

impl Rig {
    /// Both boards at the start of a warehouse; power comes on now.
    ///
    /// # Errors
    /// The warehouse cannot be built or a chip cannot be made.
    pub fn new(images: &Images, options: &RigOptions) -> Result<Self, RigError> {
        let mut spread = Noise::new(options.seed, START_STREAM);
        let mut delay = || spread.bits() % START_SPREAD;
        let sensor = Chip::new(&images.sensor, delay(), options.seed)?;
        let steering = Chip::new(&images.steering, delay(), !options.seed)?;
        let world = World::new(&options.warehouse, options.seed, options.make, RESTING)?
            .built(options.build);
        let world = Rc::new(RefCell::new(world));
        let epoch = Rc::new(Epoch::default());
        let inputs = boards::connect_inputs(&sensor, &world, &epoch);
        let battery = Rc::clone(&world);
        steering.on_conversion(move |channel, _| match channel {
            BATTERY => (battery.borrow_mut().battery_input_volts() * 1_000.0) as u32,
            _ => 0,
        });
        let motors = boards::connect_motors(&steering, &world, &epoch);
        let servos = servos::connect(&steering, &world, &epoch);
        let exde = ExDe {
            data: wire(
                &sensor,
                at_sensor::EXDE_DATA,
                &steering,
                at_steering::EXDE_DATA,
            ),
            sync: wire(
                &sensor,
                at_sensor::EXDE_SYNC,
                &steering,
                at_steering::EXDE_SYNC,
            ),
            return_sync: wire(
                &steering,
                at_steering::EXDE_RETURN,
                &sensor,
                at_sensor::EXDE_RETURN,
            ),
        };
        let lines = [&sensor, &steering].map(|chip| PiLine::connect(chip, options.baud));
        Ok(Self {
            sensor,
            steering,
            world,
            epoch,
            inputs,
            motors,
            servos,
            lines,
            exde,
            cycle: 0,
        })
    }

    /// Goes on from a kept world: power comes on again at the kept time. Call it before the rig has
    /// run.
    pub fn resume(&mut self, state: &WorldState) {
        self.world.borrow_mut().restore(state);
        let now = state.time.as_nanos() as u64;
        self.epoch
            .0
            .set(now.saturating_sub(nanoseconds(self.cycle)));
    }

    /// Cycles since power came on.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Time since power came on.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(nanoseconds(self.cycle))
    }

    /// Time since the start of the world. After [`Rig::resume`] it differs from [`Rig::now`].
    pub fn world_time(&self) -> Duration {
        self.epoch.world(self.cycle)
    }

    /// The true state of the robot and the goods.
    pub fn truth(&self) -> Snapshot {
        let world = self.world.borrow();
        Snapshot {
            world: WorldState {
                time: self.world_time(),
                ..world.state()
            },
            duties: self.duties(),
            carrying: world.goods().held(),
        }
    }

    /// Runs both chips for `time`.
    pub fn run_for(&mut self, time: Duration) {
        self.run_until(self.cycle + cycles(time));
    }

    /// Runs both chips to a cycle; a cycle in the past does nothing.
    pub fn run_until(&mut self, target: u64) {
        loop {
            let (sensor, steering) = (self.sensor.next_action(), self.steering.next_action());
            // The chip that acts first runs until the other acts at most; a sleeping chip is left
            // alone.
            let (first, at, other) = if sensor <= steering {
                (&self.sensor, sensor, steering)
            } else {
                (&self.steering, steering, sensor)
            };
            if at >= target {
                break;
            }
            first.run_until(other.clamp(at + 1, target));
        }
        self.sensor.run_until(target);
        self.steering.run_until(target);
        self.cycle = self.cycle.max(target);
        self.advance_world();
    }

    /// The Pi writes to a board; the bytes leave one after the other at the baud rate.
    pub fn write(&mut self, board: Board, bytes: &[u8]) {
        self.lines[board as usize].write(self.chip(board), self.cycle, bytes);
    }

    /// Takes the bytes that have arrived at the Pi, each with the cycle in which its stop bit
    /// ended.
    pub fn read(&mut self, board: Board) -> Vec<(u64, u8)> {
        self.lines[board as usize].take(self.cycle)
    }

    /// Records every byte that the Pi writes from now on.
    pub fn record_written(&mut self) {
        for line in &self.lines {
            line.record();
        }
    }

    /// The bytes written to a board since the last call, each with the cycle in which its stop bit
    /// ends.
    pub fn take_written(&mut self, board: Board) -> Vec<(u64, u8)> {
        self.lines[board as usize].take_written()
    }

    /// The baud rate of a board's last frame, if the Pi's end has another one.
    pub fn foreign_baud(&self, board: Board) -> Option<u32> {
        self.lines[board as usize].foreign_baud()
    }

    /// Cuts or mends a board's cable to the Pi.
    pub fn cut(&mut self, board: Board, cut: bool) {
        self.lines[board as usize].cut(cut);
    }

    /// A board's chip.
    pub fn chip(&self, board: Board) -> &Rc<Chip> {
        match board {
            Board::Sensor => &self.sensor,
            Board::Steering => &self.steering,
        }
    }

    /// Resets a board now.
    pub fn reset(&mut self, board: Board, line: ResetLine) {
        self.chip(board).reset(line);
    }

    /// Makes a board's main loop hang.
    pub fn hang(&mut self, board: Board) {
        self.chip(board).hang();
    }

    /// Makes a board's main loop hang with interrupts off.
    pub fn hang_with_interrupts_off(&mut self, board: Board) {
        self.chip(board).hang_with_interrupts_off();
    }

    /// The wires between the boards.
    pub fn exde(&self) -> &ExDe {
        &self.exde
    }

    /// The servos' wire.
    pub fn servo_wire(&self) -> &ServoWire {
        &self.servos
    }

    /// The world, at the present time.
    pub fn world(&self) -> Ref<'_, World> {
        self.world.borrow()
    }

    /// The world, for tests that change it.
    pub fn world_mut(&mut self) -> RefMut<'_, World> {
        self.world.borrow_mut()
    }

    /// Duties at the left and the right motor driver, negative backwards.
    pub fn duties(&self) -> [i16; 2] {
        self.motors.duties()
    }

    /// The changes of the duties since the last call.
    pub fn take_motor_changes(&mut self) -> Vec<MotorChange> {
        self.motors.take_changes()
    }

    /// Records every conversion of the sensor board from now on.
    pub fn record_conversions(&mut self) {
        self.inputs.record();
    }

    /// The conversions recorded since the last call.
    pub fn take_conversions(&mut self) -> Vec<Conversion> {
        self.inputs.take()
    }

    /// Cycles of one byte at the Pi's baud rate.
    pub fn byte_cycles(&self) -> u64 {
        self.lines[0].byte_cycles()
    }

    fn advance_world(&self) {
        let now = self.epoch.world(self.cycle);
        self.world.borrow_mut().advance_to(now);
    }
}
