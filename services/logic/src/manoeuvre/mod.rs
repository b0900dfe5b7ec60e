//! What the robot does: one manoeuvre at a time, each with its own state, that ends in an
//! [`Ending`]. This file lists the manoeuvres, and chooses one for a phase of the mission.
//!
//! ```text
//!           a phase           begin             a frame, a report, time
//!   mission -------> choice ---------> manoeuvre ----------------------> Ending ---> mission
//!                      ^                   |  |
//!                      +------ Ready ------+  +---> the command it needs now
//! ```
//!
//! A manoeuvre knows the line, its marks and the odometer, but not its purpose. The mission knows
//! the purpose, but no manoeuvre. Only this file knows both. So a new manoeuvre is a new file, and
//! two places here: in the list, and where it is chosen.

mod arm;
mod back_up;
mod behaviour;
mod fold;
mod follow;
mod helm;
mod look;
mod search;
mod stand;
mod steps;
mod turn;

use core::time::Duration;

use lager_floor::Heading;
use lager_orders::Pick;
use lager_topics::{Finish, Goal, NavigatorStatus, Phase, Step};
use lager_wire::{Command, LineState};

pub(crate) use arm::{ArmSequence, Task};
pub(crate) use back_up::BackUp;
pub(crate) use behaviour::Behaviour;
pub(crate) use fold::Fold;
pub(crate) use follow::{Ahead, Follow, Until};
pub(crate) use helm::{Helm, STANDBY, Senses, is_no_line};
pub(crate) use look::Look;
pub(crate) use search::Search;
pub(crate) use stand::Stand;
pub(crate) use turn::{Spot, Turn};

use crate::belief::Belief;
use crate::config::LogicConfig;
use crate::ending::Ending;
use crate::holding::Holding;
use crate::judge::EdgeMarks;
use crate::map::Map;
use crate::marks::{Mark, Sides};
use crate::mission::Mission;
use helm::turning_place;

/// Makes one type of all manoeuvres: each of its methods calls that of the present manoeuvre.
macro_rules! manoeuvres {
    ($($(#[$what:meta])* $name:ident),* $(,)?) => {
        /// What the robot does.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub(crate) enum Manoeuvre {
            $($(#[$what])* $name($name)),*
        }

        $(impl From<$name> for Manoeuvre {
            fn from(it: $name) -> Self {
                Self::$name(it)
            }
        })*

        impl Behaviour for Manoeuvre {
            fn begin(&mut self, helm: &mut Helm<'_>) {
                match self { $(Self::$name(it) => it.begin(helm)),* }
            }

            fn wanted(&self, senses: &Senses, looks: Heading, config: &LogicConfig) -> Command {
                match self { $(Self::$name(it) => it.wanted(senses, looks, config)),* }
            }

            fn see(
                &mut self,
                state: LineState,
                mark: Option<Mark>,
                helm: &mut Helm<'_>,
            ) -> Option<Ending> {
                match self { $(Self::$name(it) => it.see(state, mark, helm)),* }
            }

            fn range(&mut self, centimetres: u8, helm: &mut Helm<'_>) -> Option<Ending> {
                match self { $(Self::$name(it) => it.range(centimetres, helm)),* }
            }

            fn ended(&mut self, finish: Finish, helm: &mut Helm<'_>) -> Option<Ending> {
                match self { $(Self::$name(it) => it.ended(finish, helm)),* }
            }

            fn go_on(&mut self, helm: &mut Helm<'_>) -> Option<Ending> {
                match self { $(Self::$name(it) => it.go_on(helm)),* }
            }

            fn turns_wheels(&self) -> bool {
                match self { $(Self::$name(it) => it.turns_wheels()),* }
            }

            fn interrupt(&mut self) {
                match self { $(Self::$name(it) => it.interrupt()),* }
            }

            fn hear_again(&mut self) {
                match self { $(Self::$name(it) => it.hear_again()),* }
            }

            fn restore(&mut self, status: &NavigatorStatus, ordered: Command) {
                match self { $(Self::$name(it) => it.restore(status, ordered)),* }
            }

            fn fill(&self, status: &mut NavigatorStatus) {
                match self { $(Self::$name(it) => it.fill(status)),* }
            }
        }
    };
}

manoeuvres! {
    /// It stands.
    Stand,
    /// It stands and looks whether the way ahead is open.
    Look,
    /// It follows a line.
    Follow,
    /// It turns on the spot.
    Turn,
    /// It drives straight back.
    BackUp,
    /// It picks goods up, or lets them go.
    ArmSequence,
    /// It brings the arm back to its carry pose.
    Fold,
    /// It looks for the short mark of a station that a disturbed turn may have missed.
    Search,
}

impl Manoeuvre {
    /// The manoeuvre of the mission's phase, before its beginning.
    pub(crate) fn choose(
        mission: &Mission,
        senses: &Senses,
        holding: &Holding,
        config: &LogicConfig,
    ) -> Self {
        let follow = |until| Follow::new(until, ahead(mission, until, senses)).into();
        let turn = |spot| Turn::to(mission.target, spot, mission.half_turn()).into();
        let side_mm = mission.map.as_ref().map_or(0.0, Map::side_mm);
        let middle = Spot::EdgeMarks(side_mm / 2.0);
        // A robot that picks by itself may have to leave goods while its arm still reaches over
        // them.
        let reaches_out = holding.joint_off.is_some()
            && mission.goal == Goal::Home
            && mission.pick == Pick::Auto
            && senses
                .arm
                .joint_off(config.arm.carry, config.carry_tolerance)
                .is_some();
        match mission.phase {
            _ if mission.parked => Stand.into(),
            Phase::Picking if mission.pick == Pick::Auto && mission.failure.is_none() => {
                ArmSequence::new(Task::Pick).into()
            }
            Phase::WaitingForMap
            | Phase::WaitingForOrder
            | Phase::Picking
            | Phase::Stuck
            | Phase::Lost => Stand.into(),
            Phase::Driving => follow(Until::Node),
            Phase::Approaching => follow(Until::Station),
            Phase::Exiting => follow(Until::Bar),
            Phase::Returning => follow(Until::Corner),
            Phase::Turning => turn(Spot::Node),
            // It has turned in, but something disturbed it meanwhile.
            Phase::Positioning if mission.place.heading == mission.target => Search::NEW.into(),
            Phase::Leaving if reaches_out => Fold::NEW.into(),
            Phase::Positioning | Phase::Leaving => turn(middle),
            Phase::TurningRound => turn(Spot::Along(senses.exit_mm)),
            Phase::TurningBack => turn(Spot::Along(side_mm)),
            Phase::Looking => {
                let side_cm = (side_mm / 10.0).min(f32::from(u8::MAX)) as u8;
                let reach = side_cm.min(config.ranger_cm);
                let limit = reach.saturating_sub(config.ranger_margin_cm);
                Look::new(limit, Duration::ZERO).into()
            }
            Phase::Halted => {
                // If a thing trembles, a robot that has halted does not go on because of that.
                let limit = config.halt_cm + config.halt_cm / 5;
                Look::new(limit, config.halt_patience).into()
            }
            Phase::Dropping => ArmSequence::new(Task::Drop).into(),
            Phase::BackingOff => BackUp::to(turning_place(senses.exit_mm, config)).into(),
        }
    }

    /// The manoeuvre that must come before the chosen one, if there is one.
    pub(crate) fn prepare(&mut self, helm: &Helm<'_>) {
        if let Self::Turn(turn) = self
            && let Some(back) = BackUp::before(turn, helm)
        {
            *self = back.into();
        }
    }

    /// The manoeuvre as an earlier navigator published it, with `ordered` in force.
    pub(crate) fn resume(
        &mut self,
        status: &NavigatorStatus,
        ordered: Command,
        config: &LogicConfig,
    ) {
        if let Self::Turn(turn) = self
            && let Some(back) = BackUp::kept(turn, status, ordered, config)
        {
            *self = back.into();
        }
        self.restore(status, ordered);
    }

    /// The line it follows, if it does.
    pub(crate) fn line(&self) -> Option<&Follow> {
        match self {
            Self::Follow(follow) => Some(follow),
            _ => None,
        }
    }

    /// The step within it, in its published form.
    pub(crate) fn step(&self) -> Step {
        self.line().map_or(Step::Seeking, |follow| follow.step)
    }
}

/// What the map has on the line along which the mission's phase drives.
pub(crate) fn ahead(mission: &Mission, until: Until, senses: &Senses) -> Ahead {
    let Belief { node, heading, .. } = mission.place;
    let Some(map) = &mission.map else {
        return Ahead::default();
    };
    let tape_behind = |next| map.has_tape(next, heading);
    match until {
        Until::Bar => Ahead::default(),
        Until::Corner => Ahead {
            edge: Some(EdgeMarks {
                length_mm: senses.exit_mm,
                stations: Sides::NONE,
                crossing: map.crossing_sides(map.grid.delivery(), heading),
            }),
            goes_on: true,
            goods: Sides::NONE,
        },
        Until::Node | Until::Station => Ahead {
            edge: map.edge(node, heading),
            goes_on: map.grid.neighbour(node, heading).is_some_and(tape_behind),
            goods: mission
                .station()
                .map_or(Sides::NONE, |station| station.side_for(heading)),
        },
    }
}
