//! The scripted operator: what a person would do at the panel, as a pure state machine.
//!
//! It sees only what a person sees (link health, what logic is doing, what the steering board
//! reports) and acts only through the commands and signals a person has: mode, order, arm
//! commands, "picked". It is apart from `up` because `simulate` plays the same script in virtual
//! time.
//!
//! ```text
//!  TakeOver --mode is autonomous--> Ordering --logic took the order--> Underway
//!     ^                                ^                                  | logic waits at the station
//!     |                                |                                  v
//!   start                              |          +-- nothing in the claw -- Picking
//!                                      |          +--> (aim elsewhere) --------^  | held
//!                                      |                                          v
//!                                      +---- delivered ---- Carried <-------- Signalling
//! ```

use core::time::Duration;

use lager_topics::{
    Ask, AskKind, Finish, Health, Input, InputKind, Mode, NavigatorStatus, Order, OrderKind,
    Origin, Phase, SERVO_UNKNOWN, SteeringOrder, SteeringReport,
};
use lager_wire::{ArmCommand, Command};

/// How often a wish that shows no effect is repeated.
const REPEAT: Duration = Duration::from_millis(500);
/// How often a running arm command is renewed; its lease is 120 ms.
const RENEW: Duration = Duration::from_millis(40);
/// How long logic may be stuck before the operator gives the mission up.
const STUCK: Duration = Duration::from_secs(10);
/// The position of the claw's servo when it is closed on nothing.
const CLAW_CLOSED: u16 = 210;
/// How far the claw must stay from closed to be holding something, in servo units.
const HELD_MARGIN: u16 = 40;
/// A joint is where it should be when no further step would bring it nearer.
const NEAR: i32 = 2;
/// Steps for one joint after which something must be wrong with the arm.
const MOST_STEPS: u16 = 400;

/// The arm's joints and the claw, by their place in the reports.
const BASE: Joint = Joint {
    servo: 0,
    raise: ArmCommand::Left,
    lower: ArmCommand::Right,
};
const SHOULDER: Joint = Joint {
    servo: 1,
    raise: ArmCommand::Up,
    lower: ArmCommand::Down,
};
const ELBOW: Joint = Joint {
    servo: 3,
    raise: ArmCommand::Out,
    lower: ArmCommand::In,
};
const CLAW: usize = 7;

/// One joint, and the commands that step it.
#[derive(Clone, Copy, Debug)]
struct Joint {
    servo: usize,
    raise: ArmCommand,
    lower: ArmCommand,
}

/// One move of the routine.
#[derive(Clone, Copy, Debug)]
enum Move {
    /// Give a command once.
    Once(ArmCommand),
    /// Step a joint until it stands at a position.
    Bring(Joint, u16),
}

/// Opens the claw and brings it around goods that stand as they should, 250 mm ahead of the axle.
/// The base comes first; where to, the attempt says.
const REACH: [Move; 4] = [
    Move::Once(ArmCommand::Release),
    Move::Bring(ELBOW, 488),
    Move::Bring(SHOULDER, 311),
    Move::Once(ArmCommand::Squeeze),
];
/// Lifts the claw to where it is carried while the robot drives.
const LIFT: [Move; 3] = [
    Move::Bring(SHOULDER, 600),
    Move::Bring(ELBOW, 400),
    Move::Bring(BASE, 512),
];
/// Where to aim at each attempt: straight ahead first, then 20 and 40 mm to either side.
const AIMS: [u16; 5] = [512, 533, 491, 554, 470];
/// How often the operator tries before giving up.
const ATTEMPTS: usize = AIMS.len();

/// What the operator sees: the last of each, nothing before the first.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// The links and who steers.
    pub health: Option<Health>,
    /// What logic is doing.
    pub status: Option<NavigatorStatus>,
    /// The steering board's last report.
    pub report: Option<SteeringReport>,
    /// The order that logic refused last.
    pub refused: Option<u32>,
    /// What was last said in words.
    pub thought: String,
}

/// One thing the operator does.
#[derive(Clone, Copy, Debug)]
pub enum Act {
    /// Asks the bridge.
    Ask(Ask),
    /// Orders a product.
    Order(Order),
    /// Gives an arm command.
    Steer(SteeringOrder),
    /// Presses a button.
    Press(Input),
}

/// The script and where it stands.
#[derive(Debug)]
pub struct ScriptedOperator {
    mission: Vec<i32>,
    delivered: Vec<i32>,
    step: Step,
    acted: Option<Duration>,
    stuck_since: Option<Duration>,
    next_id: u32,
}

#[derive(Debug)]
enum Step {
    TakeOver,
    Ordering { order: u32 },
    Underway { order: u32 },
    Picking { order: u32, picking: Picking },
    Signalling { order: u32 },
    Carried { order: u32, delivered_before: u32 },
    Finished,
    Failed(String),
}

/// The arm routine under way.
#[derive(Debug)]
struct Picking {
    attempt: usize,
    stage: Stage,
    /// What is still to be done, the next last.
    moves: Vec<Move>,
    /// Steps given for the move at hand.
    steps: u16,
    current: Option<SteeringOrder>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Reaching,
    Lifting,
}

impl ScriptedOperator {
    /// A script that has `mission` fetched in its order. Ids start at `first_id`.
    pub fn new(mission: Vec<i32>, first_id: u32) -> Self {
        Self {
            mission,
            delivered: Vec::new(),
            step: Step::TakeOver,
            acted: None,
            stuck_since: None,
            next_id: first_id,
        }
    }

    /// The products delivered so far, in order.
    pub fn delivered(&self) -> &[i32] {
        &self.delivered
    }

    /// `Some` once the mission has ended: delivered, or failed with the reason.
    pub fn outcome(&self) -> Option<Result<(), &str>> {
        match &self.step {
            Step::Finished => Some(Ok(())),
            Step::Failed(why) => Some(Err(why)),
            _ => None,
        }
    }

    /// Looks, and does at most one thing.
    pub fn step(&mut self, now: Duration, seen: &Seen) -> Option<Act> {
        let (health, status) = (seen.health?, seen.status?);
        if self.is_stuck(now, &status) && self.outcome().is_none() {
            self.step = Step::Failed(format!(
                "logic is stuck and waits for a person: {}",
                seen.thought
            ));
        }
        if let Some(next) = self.advance(&health, &status, seen) {
            self.step = next;
            self.acted = None;
        }
        let pause = match &self.step {
            Step::Picking { picking, .. } if picking.current.is_none() => Duration::ZERO,
            Step::Picking { .. } => RENEW,
            _ => REPEAT,
        };
        if self.acted.is_some_and(|acted| now < acted + pause) {
            return None;
        }
        let act = self.act(&health, seen)?;
        self.acted = Some(now);
        Some(act)
    }

    /// The step that what is seen leads to, if it is another one.
    fn advance(&mut self, health: &Health, status: &NavigatorStatus, seen: &Seen) -> Option<Step> {
        let phase = status.phase.get()?;
        match &mut self.step {
            Step::TakeOver => {
                let ready = health.mode.get() == Some(Mode::Autonomous)
                    && health.sensor.up != 0
                    && health.steering.up != 0;
                ready.then(|| self.next_order())
            }
            Step::Ordering { order } => (status.order_id == *order && accepted(phase))
                .then_some(Step::Underway { order: *order }),
            Step::Underway { .. } if phase == Phase::WaitingForOrder => Some(given_up(seen)),
            Step::Underway { order } if phase == Phase::Picking => Some(Step::Picking {
                order: *order,
                picking: Picking::new(),
            }),
            Step::Picking { order, picking } => match picking.advance(seen.report.as_ref()?) {
                Grip::Trying => None,
                Grip::Held => Some(Step::Signalling { order: *order }),
                Grip::Jammed => Some(Step::Failed(
                    "a joint of the arm does not get where it should".into(),
                )),
                Grip::Empty => Some(Step::Failed(format!(
                    "the claw closed on nothing {ATTEMPTS} times at the station of product {}",
                    status.product
                ))),
            },
            Step::Signalling { order } if phase != Phase::Picking => Some(Step::Carried {
                order: *order,
                delivered_before: status.delivered,
            }),
            Step::Carried {
                order,
                delivered_before,
            } if status.delivered != *delivered_before && status.order_id == *order => {
                self.delivered.push(self.mission[self.delivered.len()]);
                Some(self.next_order())
            }
            Step::Carried { .. } if phase == Phase::WaitingForOrder => Some(given_up(seen)),
            _ => None,
        }
    }

    fn is_stuck(&mut self, now: Duration, status: &NavigatorStatus) -> bool {
        if status.phase.get() != Some(Phase::Stuck) {
            self.stuck_since = None;
            return false;
        }
        now - *self.stuck_since.get_or_insert(now) >= STUCK
    }

    fn next_order(&mut self) -> Step {
        if self.delivered.len() == self.mission.len() {
            return Step::Finished;
        }
        Step::Ordering { order: self.id() }
    }

    /// What the step wants done now.
    fn act(&mut self, health: &Health, seen: &Seen) -> Option<Act> {
        match &mut self.step {
            Step::TakeOver if health.mode.get() != Some(Mode::Autonomous) => Some(Act::Ask(Ask {
                kind: AskKind::SetMode.into(),
                mode: Mode::Autonomous.into(),
                ..Ask::default()
            })),
            Step::Ordering { order } => Some(Act::Order(Order {
                id: *order,
                product: self.mission[self.delivered.len()],
            })),
            Step::Picking { picking, .. } => {
                let id = self.next_id;
                let (order, fresh) = picking.order(id, seen.report.as_ref()?)?;
                self.next_id += u32::from(fresh);
                Some(Act::Steer(order))
            }
            Step::Signalling { order } => Some(Act::Press(Input {
                kind: InputKind::PickupDone.into(),
                order_id: *order,
                ..Input::default()
            })),
            _ => None,
        }
    }

    fn id(&mut self) -> u32 {
        self.next_id += 1;
        self.next_id
    }
}

fn given_up(seen: &Seen) -> Step {
    Step::Failed(format!("logic has given the order up: {}", seen.thought))
}

/// Whether logic is at work on the order it shows.
fn accepted(phase: Phase) -> bool {
    !matches!(phase, Phase::WaitingForMap | Phase::WaitingForOrder)
}

/// What the claw has come to.
enum Grip {
    Trying,
    Held,
    Empty,
    Jammed,
}

impl Picking {
    fn new() -> Self {
        Self {
            attempt: 0,
            stage: Stage::Reaching,
            moves: reach(AIMS[0]),
            steps: 0,
            current: None,
        }
    }

    /// Takes note of the steering board's report and goes on when a move has ended.
    fn advance(&mut self, report: &SteeringReport) -> Grip {
        if let Some(order) = &self.current {
            let finished = report.finished_origin.get() == Some(Origin::Operator)
                && report.finished_id == order.id;
            if !finished {
                return Grip::Trying;
            }
            // A move that was cut short or refused (the robot was not standing yet) is given
            // again, as a new order.
            let done = report.finish.get() == Some(Finish::Done);
            if done && matches!(self.moves.last(), Some(Move::Once(_))) {
                self.moves.pop();
            }
            self.current = None;
        }
        while let Some(Move::Bring(joint, to)) = self.moves.last()
            && step_towards(joint, *to, report).is_none()
        {
            self.moves.pop();
            self.steps = 0;
        }
        if self.steps > MOST_STEPS {
            return Grip::Jammed;
        }
        if !self.moves.is_empty() {
            return Grip::Trying;
        }
        match self.stage {
            Stage::Reaching => {
                self.stage = Stage::Lifting;
                self.moves = reversed(&LIFT);
            }
            Stage::Lifting if holds(report) => return Grip::Held,
            Stage::Lifting => {
                self.attempt += 1;
                let Some(aim) = AIMS.get(self.attempt) else {
                    return Grip::Empty;
                };
                self.stage = Stage::Reaching;
                self.moves = reach(*aim);
            }
        }
        Grip::Trying
    }

    /// The order to give now; `true` when it is a new one and took `id`.
    fn order(&mut self, id: u32, report: &SteeringReport) -> Option<(SteeringOrder, bool)> {
        if let Some(order) = self.current {
            return Some((order, false));
        }
        let command = match self.moves.last()? {
            Move::Once(command) => *command,
            Move::Bring(joint, to) => step_towards(joint, *to, report)?,
        };
        let order = SteeringOrder {
            id,
            origin: Origin::Operator.into(),
            kind: OrderKind::Drive.into(),
            code: Command::Arm(command).code(),
            arm_granted: 0,
        };
        self.steps += 1;
        self.current = Some(order);
        Some((order, true))
    }
}

/// The command that brings a joint nearer, `None` when it is there. A servo nobody has heard of
/// yet is not waited for: the first step makes it report.
fn step_towards(joint: &Joint, to: u16, report: &SteeringReport) -> Option<ArmCommand> {
    let position = report.servo_position[joint.servo];
    if position == SERVO_UNKNOWN {
        return Some(joint.raise);
    }
    match i32::from(to) - i32::from(position) {
        missing if missing > NEAR => Some(joint.raise),
        missing if missing < -NEAR => Some(joint.lower),
        _ => None,
    }
}

fn reach(aim: u16) -> Vec<Move> {
    let mut moves = reversed(&REACH);
    moves.push(Move::Bring(BASE, aim));
    moves
}

fn reversed(moves: &[Move]) -> Vec<Move> {
    moves.iter().rev().copied().collect()
}

/// Whether the claw was kept from closing all the way.
fn holds(report: &SteeringReport) -> bool {
    let position = report.servo_position[CLAW];
    position != SERVO_UNKNOWN && position > CLAW_CLOSED + HELD_MARGIN
}
