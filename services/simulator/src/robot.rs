//! The pure robot: its world, both boards and their wires, driven by events in virtual time.
//!
//! ```text
//!   Pi <==serial line==> sensor board ---ExDe---> steering board <==serial line==> Pi
//!                             |                      |      |
//!                         line, IR                motors  servos
//!                             '------- World --------'------'
//! ```
//! Between two events nothing changes that a board could notice, so time jumps from event to event.
//! Events are a step that a board asked for, a byte that arrives, the end of a transmission, and an
//! edge on ExDe. At the same instant the sensor board comes first. A run depends on the warehouse,
//! the options, and the written bytes with their times; it does not depend on how the caller
//! divides the time.
//!
//! It reads no clock, and makes none of the boards' decisions.

use core::time::Duration;

use lager_ax12::table::MAX_POSITION;
use lager_control::{SensorConfig, SensorUnit, SteeringConfig, SteeringUnit};
use lager_plant::arm::SERVOS;
use lager_plant::noise::{Noise, START_STREAM};
use lager_plant::{
    Build, Hand, HandsOff, Make, Pose, Snapshot, Warehouse, WarehouseError, World, WorldState,
};
use lager_wire::{ArmValues, ResetCause};

use crate::boards::{SensorPins, SteeringPins};
use crate::exde::ExDe;
use crate::running::{Running, START_UP_NS};
use crate::uart::Uart;

/// The middle of a servo's range.
const REST: u16 = 512;

/// The two serial lines, each with the name of its board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wire {
    /// The line to the sensor board.
    Sensor,
    /// The line to the steering board.
    Steering,
}

/// The options of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotOptions {
    /// The seed of every imperfection: the same seed is the same robot.
    pub seed: u64,
    /// The number of things that come and go on the floor.
    pub obstacles: u32,
    /// Which imperfections the robot has.
    pub make: Make,
    /// How the robot is built. Its boards do not know that unless they are told.
    pub build: Build,
    /// Baud rate of both serial lines.
    pub baud: u32,
    /// The reason that the boards give for their first start.
    pub cause: ResetCause,
    /// The sensor board's constants.
    pub sensor: SensorConfig,
    /// The steering board's constants.
    pub steering: SteeringConfig,
}

impl Default for RobotOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            obstacles: 0,
            make: Make::Varied,
            build: Build::default(),
            baud: 500_000,
            cause: ResetCause::PowerOn,
            sensor: SensorConfig::default(),
            steering: SteeringConfig::default(),
        }
    }
}

/// A robot in its warehouse.
#[derive(Debug)]
pub struct Robot {
    world: World,
    sensor: Running<SensorUnit>,
    steering: Running<SteeringUnit>,
    exde: ExDe,
    options: RobotOptions,
    now_ns: u64,
    /// The time of the world's next step.
    world_due_ns: u64,
}

impl Robot {
    /// A robot at the start of a warehouse; its boards are about to start.
    ///
    /// # Errors
    /// The warehouse cannot be built, or has no room for things on its ways.
    pub fn new(warehouse: &Warehouse, options: RobotOptions) -> Result<Self, WarehouseError> {
        let mut spread = Noise::new(options.seed, START_STREAM);
        let mut starts_ns = || START_UP_NS + spread.bits() % 5_000 * 1_000;
        let pose = resting_arm(&options.steering.arm.profile);
        let world = World::new(warehouse, options.seed, options.make, pose)?;
        let mut world = world.built(options.build);
        world.scatter_obstacles(options.obstacles, options.seed)?;
        Ok(Self {
            world,
            sensor: Running::new(options.baud, options.cause, starts_ns()),
            steering: Running::new(options.baud, options.cause, starts_ns()),
            exde: ExDe::default(),
            options,
            now_ns: 0,
            world_due_ns: 0,
        })
    }

    /// Continues in a saved world. The boards start again, at the saved time.
    pub fn resume(&mut self, state: &WorldState) {
        self.world.restore(state);
        self.now_ns = state.time.as_nanos() as u64;
        self.world_due_ns = self.now_ns;
        self.reset_board(Wire::Sensor, ResetCause::External);
        self.reset_board(Wire::Steering, ResetCause::External);
    }

    /// Robot time since the start of the world.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns)
    }

    /// Advances to `now`; does nothing if `now` is in the past.
    pub fn advance_to(&mut self, now: Duration) {
        let target = now.as_nanos() as u64;
        loop {
            let boards = self.next_of_boards();
            if self.run_wires(boards.min(target.saturating_add(1))) {
                continue;
            }
            if boards > target {
                break;
            }
            self.handle(boards);
        }
        self.settle(target);
    }

    /// Advances until a whole packet has arrived at the Pi, at most to `limit`, and returns the
    /// time reached. This takes less processor time than a look after every event.
    pub fn advance_to_output(&mut self, limit: Duration) -> Duration {
        let limit = limit.as_nanos() as u64;
        loop {
            let ends = [
                self.sensor.chip.uart.next_end(self.now_ns),
                self.steering.chip.uart.next_end(self.now_ns),
            ];
            let end = ends.into_iter().flatten().min().unwrap_or(u64::MAX);
            let boards = self.next_of_boards();
            if self.run_wires(boards.min(end).min(limit.saturating_add(1))) {
                continue;
            }
            let next = boards.min(self.exde.next_event());
            if end.min(next) > limit {
                self.settle(limit);
                return self.now();
            }
            if end < next {
                self.settle(end);
                return self.now();
            }
            self.handle(next);
            if end == next {
                return self.now();
            }
        }
    }

    /// The time of the next event.
    pub fn next_event(&self) -> Duration {
        Duration::from_nanos(self.next_of_boards().min(self.exde.next_event()))
    }

    /// Bytes that the Pi writes to a board. They go over the line at the baud rate from now on.
    pub fn write(&mut self, wire: Wire, bytes: &[u8]) {
        let now = self.now_ns;
        self.uart(wire).write(now, bytes);
    }

    /// Appends the bytes that have arrived at the Pi by now.
    pub fn read(&mut self, wire: Wire, into: &mut Vec<u8>) {
        let now = self.now_ns;
        self.uart(wire).read(now, into);
    }

    /// The true state of the robot and its world.
    pub fn truth(&self) -> Snapshot {
        Snapshot {
            world: WorldState {
                time: self.now(),
                ..self.world.state()
            },
            duties: self.world.duties(),
            carrying: self.world.goods().held(),
        }
    }

    /// What a board keeps without power.
    pub fn eeprom(&self, wire: Wire) -> &[u8] {
        match wire {
            Wire::Sensor => &self.sensor.chip.eeprom,
            Wire::Steering => &self.steering.chip.eeprom,
        }
    }

    /// Has a board that has not started yet find this in its EEPROM; what is missing was never
    /// written.
    pub fn set_eeprom(&mut self, wire: Wire, content: &[u8]) {
        let eeprom = match wire {
            Wire::Sensor => &mut self.sensor.chip.eeprom,
            Wire::Steering => &mut self.steering.chip.eeprom,
        };
        for (byte, kept) in eeprom.iter_mut().zip(content) {
            *byte = *kept;
        }
    }

    /// Resets a board now. The steering board's motors go off at once.
    pub fn reset_board(&mut self, wire: Wire, cause: ResetCause) {
        let now = self.now_ns;
        match wire {
            Wire::Sensor => {
                self.sensor.reset(now, cause);
                self.exde.release_sender();
            }
            Wire::Steering => {
                self.steering.reset(now, cause);
                self.exde.release_receiver();
                self.world.set_motors(0, 0);
            }
        }
    }

    /// Makes a board's program hang; its watchdog will reset it.
    pub fn hang_board(&mut self, wire: Wire) {
        match wire {
            Wire::Sensor => self.sensor.hung = self.sensor.unit.is_some(),
            Wire::Steering => self.steering.hung = self.steering.unit.is_some(),
        }
    }

    /// Cuts a serial cable, or mends it.
    pub fn cut(&mut self, wire: Wire, cut: bool) {
        let now = self.now_ns;
        self.uart(wire).set_cut(cut, now);
    }

    /// Bytes of noise that arrive at the Pi now.
    pub fn disturb_pi(&mut self, wire: Wire, bytes: &[u8]) {
        let now = self.now_ns;
        self.uart(wire).disturb_pi(now, bytes);
    }

    /// Puts the robot at `pose`, at rest.
    pub fn place(&mut self, pose: Pose) {
        self.world.place(pose);
    }

    /// Changes the world as a person's hands would.
    ///
    /// # Errors
    /// The reason why the world stays as it is.
    pub fn obey(&mut self, hand: Hand) -> Result<(), HandsOff> {
        hand.act(&mut self.world)
    }

    /// The world, for tests and tools that read it.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The world, for tests that put faults into it.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// The number of bytes lost on a serial line because a reader, room or the cable was missing.
    pub fn dropped(&self, wire: Wire) -> u64 {
        match wire {
            Wire::Sensor => self.sensor.chip.uart.dropped(),
            Wire::Steering => self.steering.chip.uart.dropped(),
        }
    }

    fn uart(&mut self, wire: Wire) -> &mut Uart {
        match wire {
            Wire::Sensor => &mut self.sensor.chip.uart,
            Wire::Steering => &mut self.steering.chip.uart,
        }
    }

    /// The time of the next event of a board, other than a word on ExDe.
    fn next_of_boards(&self) -> u64 {
        let servo = match (self.steering.unit.is_some(), self.world.next_servo_byte()) {
            (true, Some(at)) => at.as_nanos() as u64,
            _ => u64::MAX,
        };
        let servo = if servo > self.now_ns { servo } else { u64::MAX };
        self.sensor
            .next_event(self.now_ns)
            .min(self.steering.next_event(self.now_ns))
            .min(servo)
    }

    /// Runs the wires of ExDe until `before`, or until a board notices something; returns whether
    /// one did. Of a word's steps, boards notice only the last.
    fn run_wires(&mut self, before: u64) -> bool {
        while self.exde.next_event() < before {
            let now = self.exde.next_event().max(self.now_ns);
            self.settle(now);
            self.exde.interrupt(now, self.steering.clock_us(now));
            if self.exde.sent || self.exde.arrived {
                self.step_boards(now);
                return true;
            }
        }
        false
    }

    /// Advances the time, without an event of a board.
    fn settle(&mut self, now: u64) {
        if now > self.now_ns {
            self.now_ns = now;
            if now >= self.world_due_ns {
                self.world.advance_to(Duration::from_nanos(now));
                self.world_due_ns = (self.world.now() + World::STEP).as_nanos() as u64;
            }
        }
    }

    /// Handles everything that happens at `at`, or now if `at` is in the past.
    fn handle(&mut self, at: u64) {
        let now = at.max(self.now_ns);
        self.settle(now);
        if self.sensor.is_bitten(now) {
            self.reset_board(Wire::Sensor, ResetCause::Watchdog);
        }
        if self.steering.is_bitten(now) {
            self.reset_board(Wire::Steering, ResetCause::Watchdog);
        }
        if self.exde.next_event() <= now {
            self.exde.interrupt(now, self.steering.clock_us(now));
        }
        self.step_boards(now);
    }

    /// Steps the boards that have work, the sensor board first.
    fn step_boards(&mut self, now: u64) {
        if self.sensor.wants(now, self.exde.sent) {
            self.step_sensor(now);
        }
        let servo = self
            .world
            .next_servo_byte()
            .is_some_and(|at| at.as_nanos() as u64 <= now);
        if self.steering.wants(now, self.exde.arrived || servo) {
            self.step_steering(now);
        }
    }

    fn step_sensor(&mut self, now: u64) {
        self.exde.sent = false;
        if self.sensor.unit.is_none() {
            self.exde.start_sender(now);
        }
        self.sensor.come_to(now);
        let Running { unit, chip, .. } = &mut self.sensor;
        let mut pins = SensorPins {
            chip,
            world: &mut self.world,
            exde: &mut self.exde,
        };
        let unit = unit.get_or_insert_with(|| SensorUnit::new(&pins, self.options.sensor));
        let wanted_us = unit.step(&mut pins);
        self.sensor.plan(wanted_us);
        if core::mem::take(&mut self.sensor.chip.resets) {
            self.reset_board(Wire::Sensor, ResetCause::Ordered);
        }
    }

    fn step_steering(&mut self, now: u64) {
        self.exde.arrived = false;
        if self.steering.unit.is_none() {
            self.exde.start_receiver();
        }
        self.steering.come_to(now);
        let Running { unit, chip, .. } = &mut self.steering;
        let mut pins = SteeringPins {
            chip,
            world: &mut self.world,
            exde: &mut self.exde,
        };
        let unit = unit.get_or_insert_with(|| SteeringUnit::new(&pins, self.options.steering));
        let wanted_us = unit.step(&mut pins);
        self.steering.plan(wanted_us);
        if core::mem::take(&mut self.steering.chip.resets) {
            self.reset_board(Wire::Steering, ResetCause::Ordered);
        }
    }
}

/// The servos' first positions: the neutral pose, with the claw open.
fn resting_arm(arm: &ArmValues) -> [u16; SERVOS] {
    let pose = arm.neutral();
    let facing = |position: u16| MAX_POSITION - position;
    [
        pose.base,
        pose.shoulder,
        facing(pose.shoulder),
        pose.elbow,
        facing(pose.elbow),
        pose.wrist,
        REST,
        arm.gripper_open(),
    ]
}
