//! The whole world in one value: what the boards' pins are connected to.
//!
//! It advances in steps of one millisecond, always at the same instants, however the caller cuts
//! the time; so a run depends on the seed and on what the boards do, and on nothing else. It
//! never decides anything a board or a person decides.

use core::time::Duration;

use crate::arm::{self, SERVOS};
use crate::body::Pose;
use crate::goods::{Good, Goods};
use crate::ir::IrRanger;
use crate::line::LineSensor;
use crate::motor::Motor;
use crate::noise::Noise;
use crate::scene::{self, Block};
use crate::servo::ServoBus;
use crate::tape::Tape;
use crate::validate::WarehouseError;
use crate::warehouse::Warehouse;

/// How inexactly people put the robot down, in mm and rad.
const PLACING: f64 = 3.0;
const PLACING_ANGLE: f64 = 0.015;

/// The streams of noise.
mod stream {
    pub(super) const LEFT_MOTOR: u64 = 1;
    pub(super) const RIGHT_MOTOR: u64 = 2;
    pub(super) const LINE: u64 = 3;
    pub(super) const IR: u64 = 4;
    pub(super) const PLACING: u64 = 5;
}

/// What is worth keeping of a world, to go on with it elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldState {
    /// Time since the start of the world.
    pub time: Duration,
    /// Where the robot stands.
    pub pose: Pose,
    /// Speeds of the left and the right wheels in mm/s.
    pub wheel_speeds: [f64; 2],
    /// Position of servo n at index n - 1, 0..=1023.
    pub servo_positions: [u16; SERVOS],
    /// The goods.
    pub goods: Vec<Good>,
}

/// A warehouse with a robot in it.
#[derive(Clone, Debug)]
pub struct World {
    tape: Tape,
    blocks: Vec<Block>,
    goods: Goods,
    pose: Pose,
    left: Motor,
    right: Motor,
    duties: [i16; 2],
    line: LineSensor,
    ir: IrRanger,
    servos: ServoBus,
    now_ns: u64,
}

impl World {
    /// The step in which the world advances.
    pub const STEP: Duration = Duration::from_millis(1);
    const STEP_NS: u64 = 1_000_000;

    /// The warehouse at its start, the robot at the delivery node, the arm at
    /// `servo_positions`. `seed` chooses all imperfections.
    ///
    /// # Errors
    /// The warehouse cannot be built.
    pub fn new(
        warehouse: &Warehouse,
        seed: u64,
        servo_positions: [u16; SERVOS],
    ) -> Result<Self, WarehouseError> {
        warehouse.validate()?;
        let mut hand = Noise::new(seed, stream::PLACING);
        let start = scene::start(warehouse);
        Ok(Self {
            tape: Tape::new(warehouse),
            blocks: scene::blocks(warehouse),
            goods: Goods::new(warehouse),
            pose: Pose {
                x: start.x + hand.spread(PLACING),
                y: start.y + hand.spread(PLACING),
                heading: start.heading + hand.spread(PLACING_ANGLE),
            },
            left: Motor::new(Noise::new(seed, stream::LEFT_MOTOR)),
            right: Motor::new(Noise::new(seed, stream::RIGHT_MOTOR)),
            duties: [0; 2],
            line: LineSensor::new(Noise::new(seed, stream::LINE)),
            ir: IrRanger::new(Noise::new(seed, stream::IR)),
            servos: ServoBus::new(servo_positions),
            now_ns: 0,
        })
    }

    /// Time since the start of the world, a whole number of steps.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns)
    }

    /// Advances to the last step that is not after `now`. Time never goes back.
    pub fn advance_to(&mut self, now: Duration) {
        let now = now.as_nanos() as u64;
        while self.now_ns + Self::STEP_NS <= now {
            self.now_ns += Self::STEP_NS;
            self.step();
        }
    }

    /// Sets the duties of the left and the right motor, -255..=255, negative backwards.
    pub fn set_motors(&mut self, left: i16, right: i16) {
        self.duties = [left, right];
        self.left.set_duty(left);
        self.right.set_duty(right);
    }

    /// The duties at the left and the right motor.
    pub fn duties(&self) -> [i16; 2] {
        self.duties
    }

    /// One conversion of a line sensor, 0 = leftmost: 8 bits, high over tape.
    pub fn read_line(&mut self, channel: u8) -> u8 {
        self.line.read(channel, &self.pose, &self.tape)
    }

    /// One conversion of the IR ranger: 10 bits at 5 V.
    pub fn read_ir(&self) -> u16 {
        self.ir.adc()
    }

    /// The servos' wire.
    pub fn servos(&mut self) -> &mut ServoBus {
        &mut self.servos
    }

    /// When the next byte of a servo arrives.
    pub fn next_servo_byte(&self) -> Option<Duration> {
        self.servos.next_byte()
    }

    /// Where the robot stands.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Puts the robot somewhere, at rest.
    pub fn place(&mut self, pose: Pose) {
        self.pose = pose;
        self.left.set_speed(0.0);
        self.right.set_speed(0.0);
    }

    /// The goods.
    pub fn goods(&self) -> &Goods {
        &self.goods
    }

    /// The tape.
    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    /// The claw in the robot's coordinates.
    pub fn claw(&self) -> arm::Claw {
        arm::claw(&self.servos.positions())
    }

    /// What is worth keeping.
    pub fn state(&self) -> WorldState {
        WorldState {
            time: self.now(),
            pose: self.pose,
            wheel_speeds: [self.left.speed(), self.right.speed()],
            servo_positions: self
                .servos
                .positions()
                .map(|position| position.round() as u16),
            goods: self.goods.list().to_vec(),
        }
    }

    /// Goes on from a kept state: time, pose, servos and goods; the motors are off.
    pub fn restore(&mut self, state: &WorldState) {
        self.now_ns = state.time.as_nanos() as u64 / Self::STEP_NS * Self::STEP_NS;
        self.pose = state.pose;
        self.set_motors(0, 0);
        self.left.set_speed(state.wheel_speeds[0]);
        self.right.set_speed(state.wheel_speeds[1]);
        self.servos.set_positions(state.servo_positions);
        self.goods.restore(&state.goods);
    }

    fn step(&mut self) {
        let seconds = Self::STEP_NS as f64 / 1e9;
        self.left.step(seconds);
        self.right.step(seconds);
        let (left, right) = (self.left.speed(), self.right.speed());
        if left != 0.0 || right != 0.0 {
            self.pose = self.pose.moved(left, right, seconds);
        }
        self.servos
            .step(seconds, arm::claw_position(self.goods.narrowest()));
        let claw = self.claw();
        self.goods.step(&self.pose, &claw, &self.tape);
        self.ir.step(self.now_ns, &self.pose, &self.blocks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: [u16; SERVOS] = [512, 600, 423, 400, 623, 512, 512, 512];

    fn world(seed: u64) -> World {
        World::new(&Warehouse::builtin("small").unwrap(), seed, ARM).unwrap()
    }

    fn drive(world: &mut World, step: Duration, end: Duration) -> Pose {
        world.set_motors(100, 110);
        let mut now = world.now();
        while now < end {
            now = (now + step).min(end);
            world.advance_to(now);
        }
        world.pose()
    }

    #[test]
    fn a_run_depends_on_the_seed_and_not_on_how_time_is_cut() {
        let end = Duration::from_millis(2_000);
        let run =
            |seed, microseconds| drive(&mut world(seed), Duration::from_micros(microseconds), end);
        assert_eq!(run(1, 2_000_000), run(1, 333));
        assert_ne!(run(1, 2_000_000), run(2, 2_000_000));
    }

    #[test]
    fn a_kept_world_goes_on_where_it_was() {
        let mut first = world(1);
        drive(&mut first, World::STEP, Duration::from_millis(1_500));
        let mut second = world(1);
        second.restore(&first.state());
        assert_eq!(second.state(), first.state());
        assert_eq!(second.duties(), [0, 0]);
        let rest = second.now() + Duration::from_secs(1);
        second.advance_to(rest);
        let (from, to) = (first.pose(), second.pose());
        let rolled = (to.x - from.x).hypot(to.y - from.y);
        assert!((1.0..15.0).contains(&rolled), "it rolls out: {rolled} mm");
    }

    #[test]
    fn a_robot_is_put_down_near_the_start() {
        for seed in 0..20 {
            let pose = world(seed).pose();
            assert!(
                pose.x.hypot(pose.y) < 5.0 && pose.heading.abs() < 0.02,
                "{pose:?}"
            );
            assert_ne!(pose, Pose::default());
        }
    }
}
