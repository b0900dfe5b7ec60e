//! The navigator: takes events and the time, and returns one steering order and some announcements.
//!
//! ```text
//!   Input --> Navigator::handle --> manoeuvre --Ending--> mission
//!                  |                    ^                     |
//!                  |                    +---- the next one ---+
//!                  +--> holding (standing all the same) --> the order in force
//! ```
//!
//! It joins three things that do not know each other: the mission (what to do next), the manoeuvre
//! (line, marks and way), and the reasons to stand all the same.
//!
//! The state is a handful of plain values. Nearly all of them are in the published status, because
//! the process may be killed at any moment and its successor must finish the mission. The order in
//! force follows from the state and is not state itself: [`Navigator::handle`] changes the state
//! and then computes the order, once.
//!
//! **Invariant:** nothing here reads a clock, allocates, or knows of the bus.

mod board;
mod input;
mod status;
mod wishes;

use core::time::Duration;

use lager_orders::Mode;
use lager_topics::{BlockedWays, Hold, OrderQueue, Phase, Route, SteeringOrder, Step, ThoughtKind};
use lager_wire::{Command, LineState};

pub use input::Input;

use crate::by_hand::ByHand;
use crate::command::Standing;
use crate::config::LogicConfig;
use crate::ending::Ending;
use crate::holding::Holding;
use crate::manoeuvre::{Behaviour, Helm, Manoeuvre, STANDBY, Senses, Stand};
use crate::marks::Sides;
use crate::mission::Mission;
use crate::output::Output;

/// How long a robot that must look ahead waits for a distance before it reports that.
const DISTANCE_LATE: Duration = Duration::from_secs(1);

/// The navigator's whole state.
#[derive(Clone, Debug)]
pub struct Navigator {
    config: LogicConfig,
    mode: Option<Mode>,
    stopped: bool,
    /// Whether it may drive (L1, L2); mode, stop and map decide that.
    active: bool,

    mission: Mission,
    manoeuvre: Manoeuvre,
    senses: Senses,
    holding: Holding,
    by_hand: ByHand,
    command: Standing,
    /// How often the present setpoint was given without being seen at work.
    in_vain: u8,

    frames: u64,
    /// When the last input came.
    now: Duration,
    /// The facts after the last input.
    steady: Steady,
}

/// The parts of the status that change with a frame, a report or a tick without a new manoeuvre.
/// They are compared with those after the previous input.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Steady {
    order_id: u32,
    marks: u8,
    step: Step,
    hold: Hold,
}

impl Navigator {
    /// A navigator that waits for its map.
    pub fn new(config: LogicConfig) -> Self {
        Self {
            config,
            mode: None,
            stopped: false,
            active: false,
            mission: Mission::new(config),
            manoeuvre: Stand.into(),
            senses: Senses::default(),
            holding: Holding::default(),
            by_hand: ByHand::default(),
            command: Standing::after(0),
            in_vain: 0,
            frames: 0,
            now: Duration::ZERO,
            steady: Steady {
                order_id: 0,
                marks: 0,
                step: Step::Seeking,
                hold: Hold::None,
            },
        }
    }

    /// A navigator whose predecessor left no state: the robot may be anywhere.
    pub fn lost(config: LogicConfig) -> Self {
        let mut navigator = Self::new(config);
        navigator.mission.lose_place();
        navigator
    }

    /// Takes one input at `now` (robot time) and goes on as far as possible.
    pub fn handle(&mut self, now: Duration, input: Input<'_>) -> Output {
        let mut out = Output::default();
        self.now = now;
        self.mission.now = now;
        self.senses.odometer.advance(now);
        match input {
            Input::Line(state) => {
                self.watch_board(now, &mut out);
                if let Some(outcome) = self.line(now, state, &mut out) {
                    self.conclude(now, outcome, &mut out);
                    self.go_on(now, &mut out);
                }
            }
            other => {
                self.take(now, other, &mut out);
                self.watch_board(now, &mut out);
                if self.manoeuvre.line().is_some() {
                    self.watch_frames(now, &mut out);
                }
                self.go_on(now, &mut out);
            }
        }
        self.begin_what_waits(now, &mut out);
        let hold = self.hold();
        let (command, arm_granted) = self.wanted(hold);
        self.command.settle(now, command, arm_granted);
        let steady = self.steady_now(hold);
        out.status_changed |= steady != self.steady;
        self.steady = steady;
        out
    }

    /// The order to renew; `None` while the navigator may not or cannot drive (L1, L2).
    pub fn current_order(&self) -> Option<SteeringOrder> {
        self.active.then(|| self.command.order())
    }

    /// The nodes that it will pass, the next one first.
    pub fn route(&self) -> &Route {
        &self.mission.route
    }

    /// The present order and the waiting ones, in their published form. A successor needs them
    /// besides the status.
    pub fn queue(&self) -> OrderQueue {
        self.mission.order_queue()
    }

    /// The blocked ways, in their published form. A successor needs them besides the status.
    pub fn blocks(&self) -> BlockedWays {
        self.mission.blocked_ways()
    }

    fn steady_now(&self, hold: Hold) -> Steady {
        Steady {
            order_id: self.command.id(),
            marks: self.senses.marks.to_bits(),
            step: self.manoeuvre.step(),
            hold,
        }
    }

    /// Takes any input but a line frame.
    fn take(&mut self, now: Duration, input: Input<'_>, out: &mut Output) {
        match input {
            Input::Line(_) | Input::Tick => {}
            Input::Distance(centimetres) => self.range(now, centimetres, out),
            Input::Steering(report) => self.steering(now, report, out),
            word => {
                let was_active = self.active;
                self.take_word(now, word, out);
                if self.active && !was_active {
                    self.begin_to_speak(now);
                }
            }
        }
    }

    /// Takes a line frame. The mark under the sensors and the axle's way are judged together.
    fn line(&mut self, now: Duration, state: LineState, out: &mut Output) -> Option<Ending> {
        self.frames = self.frames.wrapping_add(1);
        let seen_before = self.senses.sight.is_some();
        self.senses.see(now, state);
        if core::mem::take(&mut self.holding.blind) && seen_before && self.active {
            out.think(ThoughtKind::SeesAgain);
        }
        if self.mode == Some(Mode::Manual) || self.manoeuvre.line().is_none() {
            self.senses.marks.clear();
            return self.steer(now, out, Manoeuvre::go_on);
        }
        if self.mission.map.is_none() {
            // This successor has no map yet; the mark is judged when it has one.
            self.senses.marks.hold(state);
            return self.steer(now, out, Manoeuvre::go_on);
        }
        let mark = self.senses.marks.push(state);
        if let Some(mark) = mark {
            self.ask_mark(mark.sides, out);
        }
        self.steer(now, out, |manoeuvre, helm| {
            let seen = manoeuvre.see(state, mark, helm);
            seen.or_else(|| manoeuvre.go_on(helm))
        })
    }

    /// Takes a distance.
    fn range(&mut self, now: Duration, centimetres: u8, out: &mut Output) {
        self.senses.distance = Some((now, centimetres));
        let outcome = self.steer(now, out, |manoeuvre, helm| {
            manoeuvre.range(centimetres, helm)
        });
        if let Some(outcome) = outcome {
            self.conclude(now, outcome, out);
        }
    }

    /// If a disturbed turn has left a doubt, a mark may show that the robot is elsewhere.
    fn ask_mark(&mut self, sides: Sides, out: &mut Output) {
        let Mission { map, place, .. } = &mut self.mission;
        let sought = self.manoeuvre.line().and_then(|follow| follow.sought());
        let (Some(map), Some(edge), false) = (map, sought, place.doubt.is_none()) else {
            return;
        };
        let at_mm = self.senses.mark_at(&self.config);
        out.status_changed = true;
        if place.ask_mark(map, edge, sides, at_mm, self.config.tolerance) {
            self.mission.believe_other_place(out);
            self.manoeuvre = self.chosen();
        }
    }

    /// Lets the manoeuvre decide on something.
    fn steer<T>(
        &mut self,
        now: Duration,
        out: &mut Output,
        decide: impl FnOnce(&mut Manoeuvre, &mut Helm<'_>) -> T,
    ) -> T {
        let active = self.active && !self.holding.unheard;
        let mut helm = Helm {
            now,
            config: &self.config,
            active,
            senses: &mut self.senses,
            heading: &mut self.mission.place.heading,
            order: &mut self.command,
            out,
        };
        decide(&mut self.manoeuvre, &mut helm)
    }

    /// A manoeuvre that has ended leads to the next one.
    fn conclude(&mut self, now: Duration, outcome: Ending, out: &mut Output) {
        if outcome != Ending::Ready {
            self.mission.next(outcome, out);
        }
        self.begin(now, out);
    }

    /// Begins the manoeuvre of the mission's phase.
    fn begin(&mut self, now: Duration, out: &mut Output) {
        out.status_changed = true;
        if self.mission.phase.needs_reset() {
            self.holding.forget();
        }
        self.manoeuvre = self.chosen();
        self.steer(now, out, |manoeuvre, helm| {
            manoeuvre.prepare(helm);
            manoeuvre.begin(helm);
        });
    }

    /// The manoeuvre of the mission's phase, before its beginning.
    fn chosen(&self) -> Manoeuvre {
        Manoeuvre::choose(&self.mission, &self.senses, &self.holding, &self.config)
    }

    /// Goes on, if the state allows it without a further input.
    fn go_on(&mut self, now: Duration, out: &mut Output) {
        // A drive ends, the way ahead is open, and the next drive begins: all at once.
        for _ in 0..3 {
            let Some(outcome) = self.steer(now, out, Manoeuvre::go_on) else {
                break;
            };
            self.conclude(now, outcome, out);
        }
    }

    /// Begins what had to wait: tries the blocked ways again, or begins the next order.
    fn begin_what_waits(&mut self, now: Duration, out: &mut Output) {
        if self.active && (self.mission.try_again(out) || self.mission.overtake(out)) {
            self.begin(now, out);
        }
        if self.mission.phase == Phase::WaitingForOrder
            && self.mode == Some(Mode::Autonomous)
            && self.mission.begin_next(out)
        {
            self.begin(now, out);
        }
    }

    /// Stands still while the steering board does not report.
    fn watch_board(&mut self, now: Duration, out: &mut Output) {
        let falls_silent = self.holding.watch_board(now, &self.config);
        if falls_silent && self.active && self.manoeuvre.turns_wheels() {
            out.think(ThoughtKind::BoardUnheard);
        }
    }

    /// Stands still while no line frames come (AMB-49: a silent board).
    fn watch_frames(&mut self, now: Duration, out: &mut Output) {
        let seen = self.senses.sight.map(|(at, _)| at);
        let blind = seen.is_none_or(|at| now.saturating_sub(at) > self.config.blind_after);
        if blind && !self.holding.blind && seen.is_some() && self.active {
            out.think(ThoughtKind::Blind);
        }
        self.holding.blind |= blind;
    }

    /// The command that the manoeuvre needs now, whatever holds the robot.
    fn needed(&self) -> Command {
        self.manoeuvre
            .wanted(&self.senses, self.mission.place.heading, &self.config)
    }

    /// The command that follows from the state, and whether the operator may move the arm.
    fn wanted(&self, hold: Hold) -> (Command, bool) {
        let command = match self.needed() {
            Command::Wheel(_) if hold != Hold::None => STANDBY,
            command => command,
        };
        // While the robot moves the arm, nobody else does.
        let moves_arm = matches!(command, Command::Arm(_));
        let waits_for_hand = self.waits_for_hand() || hold == Hold::Arm;
        (command, waits_for_hand && !moves_arm)
    }

    /// Whether it stands at the goods and a person has to pick them up.
    fn waits_for_hand(&self) -> bool {
        self.mission.phase == Phase::Picking && matches!(self.manoeuvre, Manoeuvre::Stand(_))
    }

    /// Whether it must look ahead and no distances come.
    fn misses_distances(&self) -> bool {
        let is_late = |(heard, _)| self.now.saturating_sub(heard) > DISTANCE_LATE;
        matches!(self.manoeuvre, Manoeuvre::Look(_)) && self.senses.distance.is_none_or(is_late)
    }

    /// Why it stands although its phase would turn the wheels.
    fn hold(&self) -> Hold {
        if self.holding.unheard {
            Hold::Unheard
        } else if !self.config.is_described {
            Hold::Undescribed
        } else if self.mission.is_kept() && self.mission.battery.forbids() {
            Hold::Battery
        } else if self.mission.is_kept() {
            Hold::Link
        } else if self.holding.joint_off.is_some() {
            Hold::Arm
        } else if self.holding.blind && self.manoeuvre.line().is_some() || self.misses_distances() {
            Hold::Blind
        } else {
            Hold::None
        }
    }

    /// Orders may go out (again). An earlier setpoint has ended by now. An earlier turn or drop is
    /// given again only when the bridge has reported its end.
    fn begin_to_speak(&mut self, now: Duration) {
        self.command.listen_from(now);
        self.in_vain = 0;
        if !self.command.command().is_one_shot() {
            self.command.give_anew();
        }
    }
}
