//! The navigator: events in, one steering order and a few announcements out, time an argument.
//!
//! ```text
//!                       map                order
//!   WaitingForMap ----------> WaitingForOrder ----> Turning <----> Driving
//!                                   ^                  |   at each node (L6)
//!                                   |                  v
//!      Returning <- TurningRound    |             Approaching -> Positioning -> Picking
//!          |            ^           |                                              | picked (L7)
//!          |        BackingOff      |                Turning/Driving <-- Leaving <-+
//!          |            ^           |                       |
//!          +--> corner -|-----------+                       v  at the delivery corner (L8)
//!                    Dropping <--------------------------- Exiting
//!
//!   any -> Stuck: lost line, missing node, moved by hand (AMB-49); only a reset leads out
//! ```
//!
//! The state is a handful of plain values, nearly all of them in the published status, because
//! the process may be killed at any moment and the next one must end the mission. The order in
//! force follows from the state and is never state itself: [`Navigator::handle`] changes the
//! state and then settles what the order must be.
//!
//! **Invariant:** nothing here reads a clock, allocates, or knows of the bus. The parts are
//! `mission` (what to do next at a node), `driving` (line, marks and way), `turning` (turns and
//! the drop: orders that run once) and `status` (out to the bus and back after a restart).

mod driving;
mod mission;
mod status;
mod turning;

use core::time::Duration;

use lager_topics::{
    Event, EventKind, Goal, Heading, Mode, NavigatorStatus, Order, Phase, Role, Route,
    SteeringOrder, SteeringReport, Step, Text, Thought, WarehouseMap,
};
use lager_wire::{Command, LineState};

use crate::command::{News, Standing};
use crate::config::LogicConfig;
use crate::map::{Map, Node};
use crate::marks::MarkReader;
use crate::odometer::Odometer;

/// Way of the wheels in manual mode, in mm, after which the known position is worth nothing.
/// Rolling out after the change of mode is less.
const DISPLACED_MM: f32 = 15.0;

/// What the navigator is told.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// A line frame has come.
    Line(LineState),
    /// A distance frame has come: cm to what is in front, 255 = nothing seen.
    Distance(u8),
    /// The steering board has reported.
    Steering(&'a SteeringReport),
    /// The warehouse is known, or known anew.
    Map(&'a WarehouseMap),
    /// A product is to be fetched.
    Order(&'a Order),
    /// The operator has the goods in the gripper; 0 = whatever order it is.
    PickupDone {
        /// The order the operator worked for.
        order_id: u32,
    },
    /// The robot has been put on the delivery node, looking into the warehouse (AMB-50).
    Reset,
    /// Who may drive, and whether a stop is latched, as the bridge has it.
    Mode {
        /// Who may drive.
        mode: Mode,
        /// A stop is latched.
        stopped: bool,
    },
    /// Nothing but time has passed.
    Tick,
}

/// What the navigator has to say after an input.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// What has happened on the mission, in order.
    pub events: heapless::Vec<Event, 4>,
    /// A sentence for a person; the last one if there were several.
    pub thought: Option<Thought>,
    /// [`Navigator::route`] is another one now.
    pub route_changed: bool,
}

impl Output {
    fn say(&mut self, sentence: core::fmt::Arguments<'_>) {
        let mut text = Text::default();
        // Appending to a `Text` cuts what does not fit and cannot fail.
        let _ = core::fmt::Write::write_fmt(&mut text, sentence);
        self.thought = Some(Thought {
            text,
            from: Role::Logic.into(),
        });
    }
}

/// Says a sentence, formatted.
macro_rules! say {
    ($out:expr, $($sentence:tt)+) => {
        $out.say(format_args!($($sentence)+))
    };
}
use say;

/// A standstill before a turn or a drop is judged or begun.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pause {
    /// None: the robot does what its phase says.
    None,
    /// It is to begin.
    Wanted,
    /// It ends then.
    Until(Duration),
}

/// The navigator's whole state.
#[derive(Clone, Debug)]
pub struct Navigator {
    config: LogicConfig,
    map: Option<Map>,
    mode: Option<Mode>,
    stopped: bool,

    node: Node,
    heading: Heading,
    odometer: Odometer,
    exit_mm: f32,

    phase: Phase,
    step: Step,
    goal: Goal,
    /// The order it is on; after the delivery still the last one.
    order: Order,
    pending: Option<Order>,
    delivered: u32,
    misses: u8,

    marks: MarkReader,
    /// The mark under the sensors was begun by a predecessor: perhaps one frame of noise.
    mark_cut_short: bool,
    /// The line state last seen, and when.
    sight: Option<(Duration, LineState)>,
    /// The line state that two frames in a row have shown, which one frame of noise cannot be.
    sure_sight: Option<LineState>,
    /// No line frame for too long: stand until one comes.
    blind: bool,
    /// Where the line went out of sight, in the odometer's mm.
    line_lost_at: Option<f32>,

    target: Heading,
    tries: u8,
    pause: Pause,
    command: Standing,

    route: Route,
    frames: u64,
    distance_cm: u8,
}

impl Navigator {
    /// A navigator that waits for its map.
    pub fn new(config: LogicConfig) -> Self {
        Self {
            config,
            map: None,
            mode: None,
            stopped: false,
            node: Node::default(),
            heading: Heading::Right,
            odometer: Odometer::default(),
            exit_mm: 0.0,
            phase: Phase::WaitingForMap,
            step: Step::Seeking,
            goal: Goal::None,
            order: Order::default(),
            pending: None,
            delivered: 0,
            misses: 0,
            marks: MarkReader::default(),
            mark_cut_short: false,
            sight: None,
            sure_sight: None,
            blind: false,
            line_lost_at: None,
            target: Heading::Right,
            tries: 0,
            pause: Pause::None,
            command: Standing::after(0),
            route: Route::default(),
            frames: 0,
            distance_cm: NavigatorStatus::default().distance_cm,
        }
    }

    /// Takes one input at `now` (robot time) and goes on as far as it allows.
    pub fn handle(&mut self, now: Duration, input: Input<'_>) -> Output {
        let mut out = Output::default();
        let was_active = self.is_active();
        self.odometer.advance(now);
        match input {
            Input::Line(state) => self.line(now, state, &mut out),
            Input::Distance(centimetres) => self.distance_cm = centimetres,
            Input::Steering(report) => self.steering(now, report, &mut out),
            Input::Map(map) => self.take_map(map, &mut out),
            Input::Order(order) => self.take_order(order, &mut out),
            Input::PickupDone { order_id } => self.picked(order_id, &mut out),
            Input::Reset => self.reset(&mut out),
            Input::Mode { mode, stopped } => self.set_mode(mode, stopped),
            Input::Tick => {}
        }
        if self.is_active() && !was_active {
            self.begin_to_speak(now);
        }
        self.proceed(now, &mut out);
        let (command, arm_granted) = self.wanted();
        self.command.settle(now, command, arm_granted);
        out
    }

    /// The order to renew, `None` while the navigator may not or cannot drive (L1, L2).
    pub fn current_order(&self) -> Option<SteeringOrder> {
        self.is_active().then(|| self.command.order())
    }

    /// The nodes it means to pass, the next one first.
    pub fn route(&self) -> &Route {
        &self.route
    }

    fn is_active(&self) -> bool {
        self.mode == Some(Mode::Autonomous) && !self.stopped && self.map.is_some()
    }

    /// Goes on where the state allows it without a further input.
    fn proceed(&mut self, now: Duration, out: &mut Output) {
        match self.pause {
            Pause::Wanted => self.pause = Pause::Until(now + self.config.settle),
            Pause::Until(end) if now >= end && self.is_active() => {
                self.pause = Pause::None;
                self.end_pause(out);
            }
            _ => {}
        }
        self.drive_on(now, out);
        if self.phase == Phase::WaitingForOrder && self.mode == Some(Mode::Autonomous) {
            self.begin_pending(out);
        }
    }

    /// The command that the state asks for, and whether the operator may move the arm.
    fn wanted(&self) -> (Command, bool) {
        let command = if self.pause == Pause::None {
            self.driving_command()
                .or_else(|| self.one_shot_command())
                .unwrap_or(STANDBY)
        } else {
            STANDBY
        };
        (command, self.phase == Phase::Picking)
    }

    fn set_mode(&mut self, mode: Mode, stopped: bool) {
        if self.mode != Some(mode) {
            self.odometer.stirred_mm = 0.0;
        }
        self.mode = Some(mode);
        self.stopped = stopped;
    }

    /// The orders may go out (again): a setpoint from before has ended by now, while a turn or a
    /// drop from before is only given again once the bridge has told how it ended.
    fn begin_to_speak(&mut self, now: Duration) {
        self.command.listen_from(now);
        if !self.command.command().is_one_shot() {
            self.command.give_anew();
        }
    }

    fn steering(&mut self, now: Duration, report: &SteeringReport, out: &mut Output) {
        self.odometer.report(now, report, &self.config);
        if self.mode == Some(Mode::Manual) {
            self.watch_manual_driving(out);
            return;
        }
        let one_shot = self.command.command().is_one_shot();
        let patience = if one_shot {
            self.config.unheard_one_shot
        } else {
            self.config.unheard_setpoint
        };
        match self.command.news(now, report, patience) {
            News::None => {}
            News::Ended(finish) if one_shot => self.one_shot_ended(finish, out),
            News::Unheard if one_shot && self.is_active() => self.pause = Pause::Wanted,
            // A setpoint ends by a stop, a lease that ran out or a board that restarted. It is
            // given anew, but not faster than the bridge can answer.
            News::Ended(_) | News::Unheard => {
                if self.is_active()
                    && self
                        .command
                        .is_older_than(now, self.config.unheard_setpoint)
                {
                    self.command.give_anew();
                }
            }
        }
    }

    fn watch_manual_driving(&mut self, out: &mut Output) {
        let has_a_place = !matches!(self.phase, Phase::WaitingForMap | Phase::Stuck);
        if has_a_place && self.odometer.stirred_mm > DISPLACED_MM {
            self.get_stuck("I have been driven by hand", out);
        }
    }

    /// Gives up until somebody helps (AMB-49).
    fn get_stuck(&mut self, why: &str, out: &mut Output) {
        self.phase = Phase::Stuck;
        self.pause = Pause::None;
        self.blind = false;
        say!(
            out,
            "{why}. Put me on the delivery node, looking into the warehouse, and press reset."
        );
    }

    fn announce(&self, kind: EventKind, order: Order, out: &mut Output) {
        let event = Event {
            kind: kind.into(),
            x: self.node.x,
            y: self.node.y,
            order_id: order.id,
            product: order.product,
            ..Event::default()
        };
        // One input leads to at most three: a node, a refusal and a new order.
        let _ = out.events.push(event);
    }
}

/// Standing still.
const STANDBY: Command = Command::Wheel(lager_wire::WheelCommand::Standby);
