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
/// The claw's servo in the reports, counted from 0.
const CLAW: usize = 7;
/// How far the claw must stay from fully closed to be holding something, in servo units.
const HELD_MARGIN: u16 = 20;
/// How often the operator aims anew before it gives up.
const ATTEMPTS: usize = AIMS.len();

/// One move of the routine: a command and how often it is given.
type Move = (ArmCommand, u16);

/// Lowers the open claw around the goods. The counts belong to the arm's carry pose and to goods
/// that stand in the middle of the square's side.
const REACH: [Move; 3] = [
    (ArmCommand::Release, 1),
    (ArmCommand::Out, 0),
    (ArmCommand::Down, 0),
];
/// Lifts the goods off the shelf, back towards the carry pose.
const LIFT: [Move; 2] = [(ArmCommand::Up, 0), (ArmCommand::In, 0)];
/// Where to aim at each attempt: straight first, then to either side.
const AIMS: [&[Move]; 5] = [
    &[],
    &[(ArmCommand::Left, 6)],
    &[(ArmCommand::Right, 12)],
    &[(ArmCommand::Left, 18)],
    &[(ArmCommand::Right, 24)],
];

/// What the operator sees: the last of each, nothing before the first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// The links and who steers.
    pub health: Option<Health>,
    /// What logic is doing.
    pub status: Option<NavigatorStatus>,
    /// The steering board's last report.
    pub report: Option<SteeringReport>,
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
    moves: Vec<ArmCommand>,
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
        if let Some(next) = self.advance(&health, &status, seen) {
            self.step = next;
            self.acted = None;
        }
        let pause = match self.step {
            Step::Picking { .. } => RENEW,
            _ => REPEAT,
        };
        if self.acted.is_some_and(|acted| now < acted + pause) {
            return None;
        }
        let act = self.act(&health)?;
        self.acted = Some(now);
        Some(act)
    }

    /// The step that what is seen leads to, if it is another one.
    fn advance(
        &mut self,
        health: &Health,
        status: &NavigatorStatus,
        seen: &Seen,
    ) -> Option<Step> {
        let phase = status.phase.get()?;
        match &mut self.step {
            Step::TakeOver => {
                let ready = health.mode.get() == Some(Mode::Autonomous)
                    && health.sensor.up != 0
                    && health.steering.up != 0;
                ready.then(|| self.next_order())
            }
            Step::Ordering { order } => {
                (status.order_id == *order && accepted(phase)).then_some(Step::Underway {
                    order: *order,
                })
            }
            Step::Underway { order } if phase == Phase::Picking => Some(Step::Picking {
                order: *order,
                picking: Picking::new(),
            }),
            Step::Picking { order, picking } => match picking.advance(seen.report.as_ref()?) {
                Grip::Trying => None,
                Grip::Held => Some(Step::Signalling { order: *order }),
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
            _ => None,
        }
    }

    fn next_order(&mut self) -> Step {
        if self.delivered.len() == self.mission.len() {
            return Step::Finished;
        }
        Step::Ordering { order: self.id() }
    }

    /// What the step wants done now.
    fn act(&mut self, health: &Health) -> Option<Act> {
        match &mut self.step {
            Step::TakeOver => Some(Act::Ask(Ask {
                kind: AskKind::SetMode.into(),
                mode: Mode::Autonomous.into(),
                ..Ask::default()
            }))
            .filter(|_| health.mode.get() != Some(Mode::Autonomous)),
            Step::Ordering { order } => Some(Act::Order(Order {
                id: *order,
                product: self.mission[self.delivered.len()],
            })),
            Step::Picking { picking, .. } => {
                let id = self.next_id;
                let (order, fresh) = picking.order(id)?;
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

/// What the claw has come to.
enum Grip {
    Trying,
    Held,
    Empty,
}

impl Picking {
    fn new() -> Self {
        Self {
            attempt: 0,
            stage: Stage::Reaching,
            moves: routine(AIMS[0].iter().chain(&REACH)),
            current: None,
        }
    }

    /// Takes note of the steering board's report and goes on when a move has ended.
    fn advance(&mut self, report: &SteeringReport) -> Grip {
        let Some(order) = &self.current else {
            return Grip::Trying;
        };
        let finished = report.finished_origin.get() == Some(Origin::Operator)
            && report.finished_id == order.id;
        if !finished {
            return Grip::Trying;
        }
        // A move that was cut short or refused (the robot was not standing yet) is given again,
        // as a new order.
        self.current = None;
        if report.finish.get() == Some(Finish::Done) {
            self.moves.pop();
        }
        if !self.moves.is_empty() {
            return Grip::Trying;
        }
        match self.stage {
            Stage::Reaching => {
                self.stage = Stage::Lifting;
                self.moves = routine(&LIFT);
            }
            Stage::Lifting if holds(report) => return Grip::Held,
            Stage::Lifting => {
                self.attempt += 1;
                let Some(aim) = AIMS.get(self.attempt) else {
                    return Grip::Empty;
                };
                self.stage = Stage::Reaching;
                self.moves = routine(aim.iter().chain(&REACH));
            }
        }
        Grip::Trying
    }

    /// The order to give now; `true` when it is a new one and took `id`.
    fn order(&mut self, id: u32) -> Option<(SteeringOrder, bool)> {
        if let Some(order) = self.current {
            return Some((order, false));
        }
        let order = SteeringOrder {
            id,
            origin: Origin::Operator.into(),
            kind: OrderKind::Drive.into(),
            code: Command::Arm(*self.moves.last()?).code(),
            arm_granted: 0,
        };
        self.current = Some(order);
        Some((order, true))
    }
}

/// Single moves, the last to be given first.
fn routine<'a>(moves: impl IntoIterator<Item = &'a Move>) -> Vec<ArmCommand> {
    let mut single: Vec<ArmCommand> = moves
        .into_iter()
        .flat_map(|(command, times)| core::iter::repeat_n(*command, usize::from(*times)))
        .collect();
    single.reverse();
    single
}

/// Whether the claw was kept from closing all the way.
fn holds(report: &SteeringReport) -> bool {
    let position = report.servo_position[CLAW];
    position != SERVO_UNKNOWN && position > CLAW_CLOSED + HELD_MARGIN
}
