//! The whole world in one value, which the boards' pins are connected to.
//!
//! It advances in steps of one millisecond, always at the same instants, however the caller divides
//! the time. So a run depends only on the seed and on the boards. It never decides anything that a
//! board or a person decides.

use core::time::Duration;

use lager_floor::Edge;
use lager_orders::Levels;
use serde::{Deserialize, Serialize};

use crate::arm::{self, SERVOS};
use crate::battery::Battery;
use crate::body::Pose;
use crate::build::Build;
use crate::contact::Contact;
use crate::goods::{self, Good, Goods};
use crate::ir::IrRanger;
use crate::line::LineSensor;
use crate::make::Make;
use crate::motor::Motor;
use crate::noise::Noise;
use crate::obstacles::{HandsOff, Obstacles, Standing};
use crate::scene::{self, Block};
use crate::servo::ServoBus;
use crate::tape::Tape;
use crate::validate::{WarehouseError, room_for_things};
use crate::warehouse::Warehouse;
use crate::weave::Weave;

/// The body's contacts and the battery are calculated only once in so many steps.
const SELDOM: u64 = 5;
/// How inexactly people put the robot down, in mm and rad.
const PLACING: f64 = 3.0;
const PLACING_ANGLE: f64 = 0.015;

/// Numbers of the noise streams.
mod stream {
    pub(super) const LEFT_MOTOR: u64 = 1;
    pub(super) const RIGHT_MOTOR: u64 = 2;
    pub(super) const LINE: u64 = 3;
    pub(super) const IR: u64 = 4;
    pub(super) const PLACING: u64 = 5;
    pub(super) const BATTERY: u64 = 6;
    pub(super) const GRIP: u64 = 7;
    pub(super) const SERVOS: u64 = 8;
    pub(super) const INPUT: u64 = 9;
}

/// The part of a world that is kept, to go on with it elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldState {
    /// Time since the start of the world.
    pub time: Duration,
    /// The robot's pose.
    pub pose: Pose,
    /// Speeds of the left and the right wheels in mm/s.
    pub wheel_speeds: [f64; 2],
    /// Position of servo n at index n - 1, 0..=1023.
    pub servo_positions: [u16; SERVOS],
    /// The goods.
    pub goods: Vec<Good>,
    /// The part of the battery's charge that is left, 0 to 1.
    pub battery_charge: f64,
    /// How often the body has hit something.
    pub collisions: u32,
    /// The things on edges.
    pub obstacles: Vec<Standing>,
    /// Whether the contacts of reset and mode are closed.
    pub closed: [bool; 2],
    /// What the Pi's lines for buttons show.
    pub levels: Levels,
}

/// The true state of the robot, which its own boards do not know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// The kept part of the world.
    pub world: WorldState,
    /// Duties at the left and the right motor, negative backwards.
    pub duties: [i16; 2],
    /// The product in the claw.
    pub carrying: Option<i32>,
}

/// A warehouse with a robot in it.
#[derive(Clone, Debug)]
pub struct World {
    build: Build,
    /// Somebody holds the robot above the floor, so its wheels turn and it stays.
    lifted: bool,
    /// A person holds goods between the jaws.
    is_filled: bool,
    /// Whether a person has closed the contacts of reset and mode.
    closed: [bool; 2],
    /// What an input shows that hangs at nothing.
    floating: Noise,
    tape: Tape,
    blocks: Vec<Block>,
    obstacles: Obstacles,
    goods: Goods,
    pose: Pose,
    contact: Contact,
    weave: Weave,
    left: Motor,
    right: Motor,
    duties: [i16; 2],
    battery: Battery,
    line: LineSensor,
    ir: IrRanger,
    servos: ServoBus,
    /// The servos' positions, and the claw at these positions.
    arm: ([f64; SERVOS], arm::Claw),
    now_ns: u64,
}

impl World {
    /// The length of the steps in which the world advances.
    pub const STEP: Duration = Duration::from_millis(1);
    const STEP_NS: u64 = 1_000_000;
    /// The time between two reports of where a simulated robot really is, in robot time.
    pub const TRUTH_PERIOD: Duration = Duration::from_millis(20);

    /// The warehouse at its start: the robot at the delivery node, the arm at `servo_positions`.
    /// `seed` chooses all imperfections that `make` allows.
    ///
    /// # Errors
    /// The warehouse cannot be built.
    pub fn new(
        warehouse: &Warehouse,
        seed: u64,
        make: Make,
        servo_positions: [u16; SERVOS],
    ) -> Result<Self, WarehouseError> {
        warehouse.validate()?;
        let noise = |stream| Noise::new(seed, stream);
        let mut hand = noise(stream::PLACING);
        let start = scene::start(warehouse);
        let pose = Pose {
            x: start.x + hand.spread(PLACING),
            y: start.y + hand.spread(PLACING),
            heading: start.heading + hand.spread(PLACING_ANGLE),
        };
        let tape = Tape::new(warehouse);
        let [low, high] = tape.extent();
        let mut blocks = scene::blocks(warehouse);
        blocks.extend(scene::walls(low, high));
        let servos = ServoBus::sagging(servo_positions, noise(stream::SERVOS), make);
        let positions = servos.positions();
        Ok(Self {
            build: Build::default(),
            lifted: false,
            is_filled: false,
            closed: [false; 2],
            floating: noise(stream::INPUT),
            tape,
            blocks,
            obstacles: Obstacles::new(warehouse),
            goods: Goods::new(warehouse, noise(stream::GRIP), make),
            contact: Contact::new(pose),
            weave: Weave::default(),
            pose,
            left: Motor::new(noise(stream::LEFT_MOTOR), make),
            right: Motor::new(noise(stream::RIGHT_MOTOR), make),
            duties: [0; 2],
            battery: Battery::new(noise(stream::BATTERY), make),
            line: LineSensor::new(noise(stream::LINE), make, warehouse.floor),
            ir: IrRanger::new(noise(stream::IR), make),
            servos,
            arm: (positions, arm::claw(&positions)),
            now_ns: 0,
        })
    }

    /// The same world with a robot that is built otherwise.
    #[must_use]
    pub fn built(mut self, build: Build) -> Self {
        self.build = build;
        self.left.set_gear(build.gear);
        self.right.set_gear(build.gear);
        self.ir.set_model(build.ranger);
        self.servos.fit(&build.arm);
        self
    }

    /// Time since the start of the world, a whole number of steps.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns)
    }

    /// Advances to the last step at or before `now`. Time never goes back.
    pub fn advance_to(&mut self, now: Duration) {
        let now = now.as_nanos() as u64;
        while self.now_ns + Self::STEP_NS <= now {
            self.now_ns += Self::STEP_NS;
            self.step();
        }
    }

    /// Sets the duties at the left and the right driver, -255..=255, negative backwards.
    pub fn set_motors(&mut self, left: i16, right: i16) {
        self.duties = self.build.motors([left, right]);
        self.left.set_duty(self.duties[0]);
        self.right.set_duty(self.duties[1]);
        self.feed(0.0);
    }

    /// The battery's voltage now.
    pub fn battery_volts(&self) -> f64 {
        self.battery.volts()
    }

    /// The voltage at the steering board's input for the battery: a quarter of the battery's, or
    /// anything without a divider.
    pub fn battery_input_volts(&mut self) -> f64 {
        if self.build.divider {
            self.battery.volts() / 4.0
        } else {
            2.5 + self.floating.spread(2.5)
        }
    }

    /// Sets the battery's charge, 0 to 1; for a robot as drawn the voltage does not change.
    pub fn set_battery_charge(&mut self, charge: f64) {
        self.battery.set_charge(charge);
        self.feed(0.0);
    }

    /// How often the body has hit something.
    pub fn collisions(&self) -> u32 {
        self.contact.collisions()
    }

    /// The largest lateral error after the first metre, in mm ([`crate::weave`]).
    pub fn worst_lateral_mm(&self) -> f64 {
        self.weave.worst()
    }

    /// From now on `count` things appear on random edges and disappear again.
    ///
    /// # Errors
    /// The edges are too short for a robot to turn beside a thing.
    pub fn scatter_obstacles(&mut self, count: u32, seed: u64) -> Result<(), WarehouseError> {
        if count > 0 {
            room_for_things(self.obstacles.side_cm())?;
        }
        self.obstacles.scatter(count, seed);
        Ok(())
    }

    /// Puts a thing on an edge; a thing that stands there already stays.
    ///
    /// # Errors
    /// The warehouse has no such edge, its edges are too short, the robot is there, or too many
    /// things stand already.
    pub fn put_obstacle(&mut self, edge: Edge) -> Result<(), HandsOff> {
        self.obstacles.put(edge, &self.pose, &mut self.blocks)
    }

    /// Takes the thing on an edge away.
    ///
    /// # Errors
    /// The warehouse has no such edge, or nothing stands there.
    pub fn take_obstacle(&mut self, edge: Edge) -> Result<(), HandsOff> {
        self.obstacles.take(edge, &mut self.blocks)
    }

    /// Counts changes of goods and things, so that a publisher can see each of them.
    pub fn changes(&self) -> u64 {
        self.goods.changes() + self.obstacles.changes()
    }

    /// The duties at the left and the right motor.
    pub fn duties(&self) -> [i16; 2] {
        self.duties
    }

    /// One conversion of a line sensor, 0 = leftmost: 8 bits, high over tape unless the robot is
    /// built otherwise.
    pub fn read_line(&mut self, channel: u8) -> u8 {
        let reading = self.line.read(channel, &self.pose, &self.tape);
        if self.build.dark_is_low {
            !reading
        } else {
            reading
        }
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

    /// The robot's pose.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Lifts the robot off the floor, where its wheels turn freely.
    pub fn lift(&mut self) {
        self.lifted = true;
    }

    /// Holds something wide in front of the ranger, so far away, in mm, until the robot is put down.
    pub fn hold_before_ranger(&mut self, millimetres: f64) {
        self.ir.hold(Some(millimetres));
    }

    /// Holds a piece of goods between the jaws, or takes it away.
    pub fn fill_claw(&mut self, is_there: bool) {
        self.is_filled = is_there;
    }

    /// Closes or opens the contact of reset (0) or mode (1), as a person's finger does.
    pub fn press(&mut self, button: usize, is_closed: bool) {
        if let Some(contact) = self.closed.get_mut(button) {
            *contact = is_closed;
        }
    }

    /// What the Pi's lines for buttons show.
    pub fn levels(&self) -> Levels {
        self.build.buttons.levels(self.closed)
    }

    /// Puts the robot at a pose, at rest, with nothing held in front of it.
    pub fn place(&mut self, pose: Pose) {
        self.lifted = false;
        self.ir.hold(None);
        self.pose = pose;
        self.contact.place(pose);
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
        self.arm.1
    }

    /// The part of the world that is kept.
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
            battery_charge: self.battery.charge(),
            collisions: self.contact.collisions(),
            obstacles: self.obstacles.standing().to_vec(),
            closed: self.closed,
            levels: self.levels(),
        }
    }

    /// Goes on from a kept state: time, pose, servos, goods, obstacles and battery; the motors are
    /// off.
    pub fn restore(&mut self, state: &WorldState) {
        self.now_ns = state.time.as_nanos() as u64 / Self::STEP_NS * Self::STEP_NS;
        self.pose = state.pose;
        self.contact.place(state.pose);
        self.contact.set_collisions(state.collisions);
        self.closed = state.closed;
        self.battery.set_charge(state.battery_charge);
        self.set_motors(0, 0);
        self.left.set_speed(state.wheel_speeds[0]);
        self.right.set_speed(state.wheel_speeds[1]);
        self.servos.set_positions(state.servo_positions);
        self.move_claw();
        self.goods.restore(&state.goods);
        self.obstacles
            .restore(&state.obstacles, self.now_ns, &mut self.blocks);
    }

    fn step(&mut self) {
        let seconds = Self::STEP_NS as f64 / 1e9;
        let seldom = self.now_ns.is_multiple_of(SELDOM * Self::STEP_NS);
        if seldom {
            self.feed(seconds * SELDOM as f64);
        }
        self.left.step(seconds);
        self.right.step(seconds);
        let (left, right) = (self.left.speed(), self.right.speed());
        if !self.lifted && (left != 0.0 || right != 0.0) {
            self.pose = self.pose.moved(left, right, seconds);
            if seldom {
                self.touch(seconds * SELDOM as f64);
            }
        }
        let between = match self.is_filled {
            true => goods::SIDE,
            false => self.goods.narrowest(),
        };
        self.servos.step(seconds, arm::claw_position(between));
        self.move_claw();
        let claw = self.claw();
        self.goods.step(seconds, &self.pose, &claw, &self.tape);
        self.obstacles
            .step(self.now_ns, &self.pose, &mut self.blocks);
        self.ir.step(self.now_ns, &self.pose, &self.blocks);
    }

    /// Moves the claw with the servos; most of the time they stand still.
    fn move_claw(&mut self) {
        let positions = self.servos.positions();
        if positions != self.arm.0 {
            self.arm = (positions, arm::claw(&positions));
        }
    }

    /// Discharges the battery and sets the motors' supply.
    fn feed(&mut self, seconds: f64) {
        self.battery.step(seconds, self.duties);
        self.left.set_supply(self.battery.volts());
        self.right.set_supply(self.battery.volts());
    }

    /// Stops the body at obstacles, and lets it push goods.
    fn touch(&mut self, seconds: f64) {
        let goods = self.goods.list_mut();
        let (pose, pushed) = self
            .contact
            .resolve(self.pose, &self.blocks, goods, self.now_ns);
        self.pose = pose;
        if pushed {
            self.goods.pushed(&self.tape);
        }
        let way = f64::midpoint(self.left.speed(), self.right.speed()) * seconds;
        self.weave.step(&self.pose, self.duties, way, &self.tape);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(seed: u64) -> World {
        World::new(
            &Warehouse::builtin("small").unwrap(),
            seed,
            Make::Nominal,
            arm::RESTING,
        )
        .unwrap()
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
    fn a_lifted_robot_turns_its_wheels_and_stays_until_it_is_put_down() {
        let mut world = world(1);
        let start = world.pose();
        world.lift();
        assert_eq!(drive_on(&mut world), start);
        assert!(world.state().wheel_speeds[0] > 0.0);
        world.place(start);
        world.advance_to(Duration::from_secs(11));
        assert_ne!(world.pose(), start);
    }

    #[test]
    fn a_thing_on_an_edge_stops_the_body_and_is_a_collision() {
        let mut world = world(1);
        world.scatter_obstacles(40, 1).expect("there is room");
        let pose = drive_on(&mut world);
        assert_eq!(world.state().collisions, 1);
        // On the second edge: nobody puts a thing in front of the robot.
        assert!((520.0..560.0).contains(&pose.x), "{pose:?}");
    }

    /// Drives straight ahead for ten seconds at the standard duty.
    fn drive_on(world: &mut World) -> Pose {
        world.set_motors(100, 100);
        world.advance_to(Duration::from_secs(10));
        world.pose()
    }

    #[test]
    fn nothing_comes_and_goes_on_ways_so_short_that_a_robot_could_not_turn_beside_it() {
        let short = Warehouse {
            side_length_cm: 49,
            ..Warehouse::builtin("small").unwrap()
        };
        let mut world = World::new(&short, 1, Make::Nominal, arm::RESTING).unwrap();
        let refused = Err(WarehouseError::NoRoomForThings(49));
        assert_eq!(world.scatter_obstacles(1, 1), refused);
        assert_eq!(world.scatter_obstacles(0, 1), Ok(()));
    }

    #[test]
    fn without_things_nothing_is_touched() {
        let mut world = world(1);
        assert!(drive_on(&mut world).x > 600.0);
        assert_eq!(world.state().collisions, 0);
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
