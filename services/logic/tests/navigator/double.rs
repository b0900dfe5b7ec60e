//! A double of everything below logic: a robot on the same grid, moved by the orders, and a bridge
//! with leases. Geometry decides what the sensors see; the constants are the document's.
//!
//! It is small on purpose: steps of 5 ms, tape with sharp edges, wheels with lag and a wrong gain.
//! It shares no code with the boards' programs. It follows its line by the regulator that the
//! document gives for the steering board, and learns in the same way how unequal its wheels are.

use std::time::Duration;

use lager_floor::Heading;
use lager_topics::{Finish, Origin, SERVO_UNKNOWN, SteeringOrder, SteeringReport, WarehouseMap};
use lager_wire::{ArmCommand, Command, LineState, SteerFlags, WheelCommand};

use crate::floor::{Exit, Floor, Obstacle, Point};

/// The time of one step of the world.
pub(crate) const STEP: Duration = Duration::from_millis(5);
const LEASE: Duration = Duration::from_millis(120);
const QUARTER: Duration = Duration::from_millis(3000);
const DROP: Duration = Duration::from_millis(1500);
const ARM_STEP: Duration = Duration::from_millis(40);
const AHEAD: f64 = 160.0;
const CRUISE: f64 = 73.3;
const TRACK: f64 = 280.0;
const LAG: f64 = 0.06;

/// The servos' positions when the arm carries something.
pub(crate) const CARRYING: [u16; 8] = [512, 600, 423, 400, 623, 512, 512, 399];

/// The disturbances of a trial.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trouble {
    /// The time between line frames, in ms.
    pub(crate) frame_ms: u64,
    /// The number of lost frames in 1000.
    pub(crate) lost: u64,
    /// The number of frames in 1000 that show a wrong state.
    pub(crate) noise: u64,
    /// The wrong gains of the left and the right motor.
    pub(crate) gains: (f64, f64),
}

impl Trouble {
    pub(crate) const NONE: Self = Self {
        frame_ms: 10,
        lost: 0,
        noise: 0,
        gains: (1.0, 1.0),
    };
}

/// How unequal the wheels are: the learnt correction on straight lines, in duty steps.
#[derive(Clone, Copy, Debug, Default)]
struct Sides {
    mean: f64,
    /// The number of steps for which the robot has followed its line.
    followed: u32,
    /// The steps in which the line's end still belongs to the last tape across it; counts down.
    since_bar: u32,
    /// The robot has passed the bar and no mark since, so this line may be curved.
    beside_grid: bool,
    /// The correction in use: the mean at the last mark of the grid.
    bias: f64,
    /// The correction in use before that mark.
    before: f64,
}

impl Sides {
    fn observe(&mut self, correction: f64, state: LineState) {
        let was_bar = self.since_bar > 0;
        self.since_bar = match state {
            LineState::FourWay => 30,
            _ => self.since_bar.saturating_sub(1),
        };
        match state {
            LineState::StationToLeft | LineState::StationToRight | LineState::FourWay => {
                if self.beside_grid {
                    self.beside_grid = false;
                    self.pause();
                } else if self.followed > 900 {
                    self.before = self.bias;
                    self.bias = self.mean;
                    self.followed = 600;
                }
            }
            // The last mark was not a crossing but the delivery's bar, perhaps left at an angle.
            LineState::DropStation | LineState::NotOnLine
                if was_bar || state == LineState::DropStation =>
            {
                if !self.beside_grid {
                    self.bias = self.before;
                }
                self.beside_grid = true;
            }
            _ => {
                self.followed += 1;
                // In the first 3 s the robot still comes to the middle of its line.
                if self.followed > 600 {
                    self.mean += (correction.clamp(-12.0, 12.0) - self.mean) / 256.0;
                }
            }
        }
    }

    /// For a time in which the robot does not follow a line.
    fn pause(&mut self) {
        self.mean = self.bias;
        self.followed = 0;
    }
}

/// An order that is carried out.
#[derive(Clone, Copy, Debug)]
struct Work {
    id: u32,
    command: Command,
    lease: Duration,
    since: Duration,
    /// For turns: the number of states in a row without tape under the centre.
    clear: u32,
}

/// The robot with its two boards and the bridge.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) floor: Floor,
    pub(crate) trouble: Trouble,
    /// The things on the floor.
    pub(crate) obstacles: Vec<Obstacle>,
    /// How far the ranger sees, in cm; `None` = it is dead.
    pub(crate) sees_cm: Option<u8>,
    /// The body has run into a thing.
    pub(crate) touched: bool,
    random: u64,
    pub(crate) now: Duration,
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Degrees, counter-clockwise from +x.
    pub(crate) angle: f64,
    wheels: (f64, f64),
    duties: (f64, f64),
    work: Option<Work>,
    finished: (u32, Finish),
    replaced: u32,
    /// The last error, in half sensor distances, positive = the line is to the right.
    error: i8,
    /// The errors of the last two steps, the newer first.
    past: [f64; 2],
    sides: Sides,
    after_bar: bool,
    pub(crate) autonomous: bool,
    pub(crate) stopped: bool,
    /// How many of the next one-shot orders it refuses.
    pub(crate) refuse: u32,
    /// Setpoints that turn the wheels end with this finish at once; with `Finish::None`, silently.
    pub(crate) refuses_to_drive: Option<Finish>,
    /// The board's reports do not reach the bridge.
    pub(crate) silent: bool,
    /// Positions of the servos, and the load of the claw.
    pub(crate) servos: [u16; 8],
    pub(crate) claw_load: i16,
    /// The servos that have not reported since the board started.
    unheard: [bool; 8],
    /// The number of the link's life.
    life: u32,
    pub(crate) battery: u8,
    /// The base's position at which the claw closes on the goods; `None` = there are none.
    pub(crate) goods_at: Option<u16>,
    /// The claw holds the goods.
    holds: bool,
    /// The duty with which the operator drives in manual mode.
    pub(crate) manual_duty: f64,
    /// The bridge's sum of that: duty × µs of both motors.
    pub(crate) driven_by_hand: u64,
    /// The codes of the turns and drops that began.
    pub(crate) begun: Vec<u8>,
    pub(crate) frames_sent: u64,
}

impl Body {
    pub(crate) fn new(map: &WarehouseMap, exit: Exit, trouble: Trouble, seed: u64) -> Self {
        let floor = Floor::new(map, exit);
        Self {
            x: f64::from(map.delivery_x) * floor.side,
            y: f64::from(map.delivery_y) * floor.side,
            angle: if map.delivery_x == 0 { 0.0 } else { 180.0 },
            floor,
            trouble,
            obstacles: Vec::new(),
            sees_cm: Some(80),
            touched: false,
            random: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
            now: Duration::ZERO,
            wheels: (0.0, 0.0),
            duties: (0.0, 0.0),
            work: None,
            finished: (0, Finish::None),
            replaced: 0,
            error: 0,
            past: [0.0; 2],
            sides: Sides::default(),
            after_bar: false,
            autonomous: true,
            stopped: false,
            refuse: 0,
            refuses_to_drive: None,
            silent: false,
            servos: CARRYING,
            claw_load: -311,
            unheard: [false; 8],
            life: 1,
            battery: 111,
            goods_at: None,
            holds: false,
            manual_duty: 0.0,
            driven_by_hand: 0,
            begun: Vec::new(),
            frames_sent: 0,
        }
    }

    fn random(&mut self, below: u64) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) % below
    }

    /// The bridge takes an order.
    pub(crate) fn order(&mut self, order: &SteeringOrder) {
        if !self.autonomous || self.stopped || order.id == self.finished.0 {
            return;
        }
        let command = Command::from_code(order.code).unwrap();
        if let Some(work) = &mut self.work
            && work.id == order.id
        {
            assert_eq!(work.command, command, "one id, two commands");
            work.lease = self.now + LEASE;
            return;
        }
        assert!(
            order.id > self.replaced && order.id > self.finished.0,
            "id {} is not new",
            order.id
        );
        if let Some(work) = self.work.take() {
            // Logic must wait for a turn's end, unless no report of the end can come.
            let given_up = self.silent && command == Command::Wheel(WheelCommand::Standby);
            assert!(
                !work.command.is_one_shot() || given_up,
                "a one-shot order was not waited for"
            );
            self.replaced = work.id;
        }
        if command.is_one_shot() {
            self.begun.push(order.code);
            if self.refuse > 0 {
                self.refuse -= 1;
                self.finished = (order.id, Finish::Refused);
                return;
            }
        }
        let drives = !command.is_one_shot() && command != Command::Wheel(WheelCommand::Standby);
        if let Some(finish) = self.refuses_to_drive.filter(|_| drives) {
            if finish != Finish::None {
                self.finished = (order.id, finish);
            }
            return;
        }
        self.work = Some(Work {
            id: order.id,
            command,
            lease: self.now + LEASE,
            since: self.now,
            clear: 0,
        });
    }

    /// Ends the order that is carried out.
    pub(crate) fn end_work(&mut self, finish: Finish) {
        if let Some(work) = self.work.take() {
            self.finished = (work.id, finish);
        }
    }

    pub(crate) fn bits(&self) -> [bool; 11] {
        core::array::from_fn(|index| {
            let right = (index as f64 - 5.0) * 7.0;
            self.floor.is_tape(self.point(AHEAD, right))
        })
    }

    /// Makes one step of 5 ms; returns the line frame that reaches logic now, if there is one.
    pub(crate) fn step(&mut self) -> Option<LineState> {
        self.now += STEP;
        let bits = self.bits();
        let state = self.classify(&bits);
        self.control(&bits, state);
        self.roll();
        if !(self.now.as_millis() as u64 / 5).is_multiple_of(self.trouble.frame_ms / 5) {
            return None;
        }
        if self.random(1000) < self.trouble.lost {
            return None;
        }
        self.frames_sent += 1;
        if self.random(1000) < self.trouble.noise {
            let codes = [
                LineState::StationToLeft,
                LineState::StationToRight,
                LineState::FourWay,
                LineState::NotOnLine,
                LineState::DropStation,
                LineState::LeftOfLine,
            ];
            return Some(codes[self.random(6) as usize]);
        }
        Some(state)
    }

    fn classify(&mut self, bits: &[bool; 11]) -> LineState {
        let run = |from_left: bool| {
            let mut count = 0;
            for index in 0..11 {
                let at = if from_left { index } else { 10 - index };
                if !bits[at] {
                    break;
                }
                count += 1;
            }
            count >= 5
        };
        let seen: Vec<f64> = (0..11)
            .filter(|index| bits[*index])
            .map(|index| (index as f64 - 5.0) * 2.0)
            .collect();
        let (left, right) = (run(true), run(false));
        if seen.is_empty() {
            self.error = if self.error >= 0 { 10 } else { -10 };
            return if self.after_bar {
                LineState::DropStation
            } else {
                LineState::NotOnLine
            };
        }
        self.after_bar = left && right;
        match (left, right) {
            (true, true) => LineState::FourWay,
            (true, false) => LineState::StationToLeft,
            (false, true) => LineState::StationToRight,
            (false, false) => {
                let error = seen.iter().sum::<f64>() / seen.len() as f64;
                self.error = error.round() as i8;
                match error {
                    error if error.abs() <= 2.0 => LineState::OnLine,
                    error if error > 0.0 => LineState::LeftOfLine,
                    _ => LineState::RightOfLine,
                }
            }
        }
    }

    fn control(&mut self, bits: &[bool; 11], state: LineState) {
        if let Some(work) = self.work
            && (work.lease < self.now || self.stopped || !self.autonomous)
        {
            self.end_work(Finish::Aborted);
        }
        let is_mark = matches!(
            state,
            LineState::StationToLeft | LineState::StationToRight | LineState::FourWay
        );
        // The regulator: P, which counts twice under the outer sensors, and D over 10 ms.
        let error = f64::from(self.error);
        let beyond = error - error.clamp(-5.0, 5.0);
        let correction = match is_mark {
            true => 0.0,
            false => 2.0 * (error + beyond) + 2.0 * (error - self.past[1]),
        };
        self.past = [error, self.past[0]];
        let bias = self.sides.bias;
        let correction = correction + bias;
        let Some(work) = &mut self.work else {
            self.sides.pause();
            self.duties = (self.manual_duty, self.manual_duty);
            if !self.autonomous {
                self.driven_by_hand += 2 * self.manual_duty.abs() as u64 * STEP.as_micros() as u64;
            }
            return;
        };
        match work.command {
            Command::Wheel(WheelCommand::ActiveForward) => {
                self.sides.observe(correction, state);
            }
            _ => self.sides.pause(),
        }
        let alike =
            |left: f64, right: f64| (left + bias * left.signum(), right - bias * right.signum());
        let age = self.now - work.since;
        self.duties = match work.command {
            Command::Wheel(WheelCommand::ActiveForward) => (100.0 + correction, 100.0 - correction),
            Command::Wheel(WheelCommand::ManualForward) => alike(100.0, 100.0),
            Command::Wheel(WheelCommand::ManualBackward) => alike(-100.0, -100.0),
            Command::Wheel(turn @ (WheelCommand::LeftPerp | WheelCommand::RightPerp)) => {
                let on_tape = bits[4] || bits[5] || bits[6];
                let was_clear = work.clear >= 2;
                work.clear = if on_tape { 0 } else { work.clear + 1 };
                if (on_tape && was_clear) || age >= QUARTER {
                    self.end_work(Finish::Done);
                    (0.0, 0.0)
                } else if turn == WheelCommand::LeftPerp {
                    alike(-100.0, 100.0)
                } else {
                    alike(100.0, -100.0)
                }
            }
            Command::Arm(ArmCommand::Drop) => {
                if age >= DROP {
                    self.end_work(Finish::Done);
                }
                (0.0, 0.0)
            }
            Command::Arm(step) => {
                if age >= ARM_STEP {
                    self.end_work(Finish::Done);
                    self.move_arm(step);
                }
                (0.0, 0.0)
            }
            Command::Wheel(_) => (0.0, 0.0),
        };
    }

    /// Restarts the steering board: its command is cut short, and the arm sags. The board knows a
    /// servo's position again only when it moves the servo.
    pub(crate) fn restart_board(&mut self) {
        self.end_work(Finish::Aborted);
        self.life += 1;
        self.unheard = [true; 8];
        (self.servos[1], self.servos[3]) = (self.servos[1] - 30, self.servos[3] - 30);
        self.claw_load = 0;
    }

    /// Moves the arm by one step.
    fn move_arm(&mut self, step: ArmCommand) {
        let [base, shoulder, elbow, claw] = [0, 1, 3, 7];
        let moved = match step {
            ArmCommand::Left | ArmCommand::Right => base,
            ArmCommand::Up | ArmCommand::Down => shoulder,
            ArmCommand::Out | ArmCommand::In => elbow,
            _ => claw,
        };
        self.unheard[moved] = false;
        let aimed = |at: u16| at.abs_diff(self.servos[base]) <= 10;
        let low = self.servos[shoulder] < 320 && self.servos[elbow] > 480;
        let at_the_goods = low && self.goods_at.is_some_and(aimed);
        match step {
            ArmCommand::Left => self.servos[base] += 4,
            ArmCommand::Right => self.servos[base] -= 4,
            ArmCommand::Up => self.servos[shoulder] += 4,
            ArmCommand::Down => self.servos[shoulder] -= 4,
            ArmCommand::Out => self.servos[elbow] += 4,
            ArmCommand::In => self.servos[elbow] -= 4,
            ArmCommand::Release => {
                if self.holds && !at_the_goods {
                    // The goods fall to the floor.
                    self.goods_at = None;
                }
                self.holds = false;
                (self.servos[claw], self.claw_load) = (512, 0);
            }
            ArmCommand::Squeeze => {
                self.holds |= at_the_goods;
                let closed = if self.holds { (399, -311) } else { (210, -20) };
                (self.servos[claw], self.claw_load) = closed;
            }
            _ => {}
        }
    }

    fn roll(&mut self) {
        let seconds = STEP.as_secs_f64();
        let speed = CRUISE / 100.0;
        let aims = (
            self.duties.0.clamp(-255.0, 255.0) * speed * self.trouble.gains.0,
            self.duties.1.clamp(-255.0, 255.0) * speed * self.trouble.gains.1,
        );
        self.wheels.0 += (aims.0 - self.wheels.0) * seconds / LAG;
        self.wheels.1 += (aims.1 - self.wheels.1) * seconds / LAG;
        let forward = (self.wheels.0 + self.wheels.1) / 2.0 * seconds;
        let (sin, cos) = self.angle.to_radians().sin_cos();
        self.x += forward * cos;
        self.y += forward * sin;
        self.angle += ((self.wheels.1 - self.wheels.0) / TRACK * seconds).to_degrees();
        self.touched |= !self.obstacles.is_empty() && self.touches();
    }

    /// The point of the floor at this place in the robot's coordinates.
    fn point(&self, ahead: f64, right: f64) -> Point {
        let (sin, cos) = self.angle.to_radians().sin_cos();
        (
            self.x + ahead * cos + right * sin,
            self.y + ahead * sin - right * cos,
        )
    }

    fn is_in_an_obstacle(&self, (x, y): Point) -> bool {
        let within = |low: Point, high: Point| {
            (low.0..=high.0).contains(&x) && (low.1..=high.1).contains(&y)
        };
        self.obstacles.iter().any(|(low, high)| within(*low, *high))
    }

    /// Whether the body touches a thing.
    fn touches(&self) -> bool {
        [170.0, 30.0, -110.0]
            .into_iter()
            .flat_map(|ahead| [-90.0, 0.0, 90.0].map(|right| (ahead, right)))
            .any(|(ahead, right)| self.is_in_an_obstacle(self.point(ahead, right)))
    }

    /// The ranger's value: cm to the thing ahead, 255 = nothing in sight.
    pub(crate) fn range_cm(&self) -> Option<u8> {
        let is_there =
            |cm: &u8| self.is_in_an_obstacle(self.point(100.0 + 10.0 * f64::from(*cm), 0.0));
        let reach = self.sees_cm?;
        Some((0..reach).find(is_there).unwrap_or(255))
    }

    /// The steering board's report as the bridge publishes it.
    pub(crate) fn report(&self) -> SteeringReport {
        let mut flags = SteerFlags(0);
        if self.duties.0 < 0.0 {
            flags.insert(SteerFlags::LEFT_REVERSE);
        }
        if self.duties.1 < 0.0 {
            flags.insert(SteerFlags::RIGHT_REVERSE);
        }
        let heard = |servo: usize| match self.unheard[servo] {
            true => SERVO_UNKNOWN,
            false => self.servos[servo],
        };
        SteeringReport {
            link_epoch: self.life,
            finished_id: self.finished.0,
            finish: self.finished.1.into(),
            finished_origin: Origin::Logic.into(),
            current_id: self.work.map_or(0, |work| work.id),
            current_origin: Origin::Logic.into(),
            left_duty: self.duties.0.abs() as u8,
            right_duty: self.duties.1.abs() as u8,
            flags: flags.0,
            battery_decivolts: self.battery,
            age_ms: 0,
            servo_position: std::array::from_fn(heard),
            servo_load: [0, 0, 0, 0, 0, 0, 0, self.claw_load],
            ..SteeringReport::default()
        }
    }

    /// The distance from the axle to a point, in mm.
    pub(crate) fn distance_to(&self, (x, y): Point) -> f64 {
        (self.x - x).hypot(self.y - y)
    }

    /// The angle between the robot and a heading, in degrees.
    pub(crate) fn degrees_off(&self, heading: Heading) -> f64 {
        let wanted = match heading {
            Heading::Right => 0.0,
            Heading::Up => 90.0,
            Heading::Left => 180.0,
            Heading::Down => 270.0,
        };
        let off = (self.angle - wanted).rem_euclid(360.0);
        off.min(360.0 - off)
    }
}
