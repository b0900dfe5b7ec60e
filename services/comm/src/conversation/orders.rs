//! What the external computer wants done: commands, stops and numbered actions.
//!
//! An action is judged here and carried out as a person at the robot would: by the same orders,
//! presses and requests as the commands of `lager`. In doubt the robot stands and says why.

use core::time::Duration;

use lager_lines::extension::{Action as Wanted, Edge, Mode as WantedMode, Pick as WantedPick, Put};
use lager_lines::{LATEST_MOVE, TooLate};
use lager_topics::{
    Ask, AskKind, Goal, Mode, Order, Outcome, Phase, Pick, Refusal, WorldAsk, WorldAskKind,
};
use lager_wire::{Command, OperatorCommand, WheelCommand};

use super::{Conversation, MOST_STOPS, STOPPED};
use crate::action::Action;
use crate::driving::For;
use crate::map::heading;
use crate::moment::Moment;
use crate::tasks::{Asker, Tasks};

impl Conversation {
    /// Carries a command out. `Err` is why not.
    pub(super) fn command(
        &mut self,
        now: Moment,
        late: Duration,
        command: OperatorCommand,
        whose: For,
    ) -> Result<(), String> {
        if command != OperatorCommand::Stop {
            self.may_move(command)?;
        } else if whose == For::Question {
            self.stand(now, STOPPED);
            return Ok(());
        } else if self.known.mode() == Some(Mode::Autonomous) && !self.driving.is_running() {
            // Logic would drive on.
            return Err(Refusal::NotInCharge.to_string());
        }
        if let For::Action {
            number,
            until_ns: Some(until_ns),
        } = whose
            && self.driving.prolong(command, number, until_ns)
        {
            return Ok(());
        }
        let id = self.ids.fresh(now);
        let order = self.driving.begin(now, late, id, command, whose);
        self.actions.push(Action::Steer(order));
        Ok(())
    }

    fn may_move(&self, command: OperatorCommand) -> Result<(), String> {
        let is_arm = matches!(command, OperatorCommand::Arm(_));
        let is_by_hand = self.known.mode() == Some(Mode::Manual);
        let picks = self.known.status.map(|status| status.phase) == Some(Phase::Picking.into());
        match (is_by_hand, picks, is_arm) {
            (true, _, _) | (false, true, true) => {}
            (false, true, false) => {
                return Err(
                    "the robot is autonomous and stands at goods: only its arm is moved".into(),
                );
            }
            (false, false, _) => return Err(Refusal::NotInCharge.to_string()),
        }
        match self.known.blocked() {
            None => Ok(()),
            Some(why) => Err(format!("{} is not possible now: {why}", command.name())),
        }
    }

    /// Stops the robot before anything else is done.
    pub(super) fn stop(&mut self, now: Moment, number: Option<u32>) {
        self.driving.let_go(STOPPED);
        self.actions.push(Action::Stop);
        if let Some(number) = number.filter(|_| self.is_up && self.is_extended)
            && self.stops.len() < MOST_STOPS
        {
            self.stops.push((number, now.ns));
        }
    }

    /// Carries an action out that comes so `late`; it is answered when it is done or refused.
    /// `is_stopped`: a stop has come with it.
    pub(super) fn carry_out(
        &mut self,
        now: Moment,
        late: Duration,
        number: u32,
        wanted: Wanted,
        is_stopped: bool,
    ) {
        let last = self.last_number.filter(|last| number <= *last);
        let begun = match (last, TooLate::check(late, wanted.latest())) {
            (Some(last), _) => Err(format!(
                "the last action on this connection had the number {last}, so number {number} may \
                 have been carried out before; give it anew with a greater number"
            )),
            _ if is_stopped && ends_a_stop(wanted) => {
                Err("a stop has come with it; give it anew".into())
            }
            (None, Err(why)) => Err(why.to_string()),
            (None, Ok(())) => self.begin(now, late, number, wanted),
        };
        self.last_number = self.last_number.max(Some(number));
        match begun {
            Ok(Begun::Waits) => {}
            Ok(Begun::Done) => self.reply(number, Ok(())),
            Err(why) => self.reply(number, Err(why)),
        }
    }

    fn begin(
        &mut self,
        now: Moment,
        late: Duration,
        number: u32,
        wanted: Wanted,
    ) -> Result<Begun, String> {
        let asker = Asker::Action(number);
        if !self.tasks.has_room() {
            let most = Tasks::MOST;
            return Err(format!("{most} actions are under way; wait for their end"));
        }
        match wanted {
            Wanted::Drive { wheels, lease } => {
                // It ends with its lease, and it was given no longer ago than it may come late.
                let lease = Duration::from_millis(lease.get().into());
                let left = lease.min(LATEST_MOVE.saturating_sub(late));
                let until_ns = Some(now.ns + u64::try_from(left.as_nanos()).unwrap_or(0));
                let whose = For::Action { number, until_ns };
                self.command(now, late, wheels.into(), whose)?;
            }
            Wanted::Arm(step) => {
                let whose = For::Action {
                    number,
                    until_ns: None,
                };
                self.command(now, late, OperatorCommand::Arm(step), whose)?;
            }
            Wanted::Add { order: 0, .. } => {
                return Err("orders are numbered from 1 on: 0 means none".into());
            }
            Wanted::Add { order: id, product } => {
                let queue = self.known.queue.unwrap_or_default();
                if queue.has(id) {
                    return Err(format!("there is an order {id} already"));
                }
                let product = product.get();
                self.tasks.order(now, asker, Order { id, product });
            }
            Wanted::Cancel { order } => {
                self.may_cancel(order)?;
                let id = self.ids.fresh(now);
                self.tasks.cancel(now, asker, id, order);
            }
            Wanted::First { order } => match self.before(order)? {
                0 => return Ok(Begun::Done),
                before => {
                    let id = self.ids.fresh(now);
                    self.tasks.first(now, asker, id, order, before);
                }
            },
            Wanted::Up { order } => match self.before(order)? {
                0 => return Ok(Begun::Done),
                before => {
                    let id = self.ids.fresh(now);
                    self.tasks.up(now, asker, id, order, before);
                }
            },
            Wanted::Clear => {
                let queue = self.known.queue.unwrap_or_default();
                if queue.orders().is_empty() {
                    return Ok(Begun::Done);
                }
                let id = self.ids.fresh(now);
                self.tasks.clear(now, asker, id);
            }
            Wanted::Picked { force } => {
                let status = self.known.status.unwrap_or_default();
                if status.phase != Phase::Picking {
                    return Err("the robot does not wait at goods".into());
                }
                let id = self.ids.fresh(now);
                self.tasks.picked(now, asker, id, status.order_id, force);
            }
            Wanted::Pick(pick) => {
                let id = self.ids.fresh(now);
                let pick = match pick {
                    WantedPick::Manual => Pick::Manual,
                    WantedPick::Auto => Pick::Auto,
                };
                self.tasks.pick(now, asker, id, pick);
            }
            Wanted::Reset => {
                let id = self.ids.fresh(now);
                self.tasks.reset(now, asker, id);
            }
            Wanted::Place(on) => {
                self.may_be_put_down()?;
                let id = self.ids.fresh(now);
                // Nobody carries a robot that is simulated, so its world does.
                let world = self
                    .known
                    .is_simulated
                    .then(|| edge_ask(WorldAskKind::Place, on));
                self.tasks.place(now, asker, id, on, world);
            }
            Wanted::Mode(mode) => self.ask_bridge(
                now,
                asker,
                Ask {
                    mode: match mode {
                        WantedMode::Manual => Mode::Manual,
                        WantedMode::Autonomous => Mode::Autonomous,
                    }
                    .into(),
                    ..moving(now, late, AskKind::SetMode)
                },
            ),
            Wanted::Resume { stop } => {
                if self.known.is_stopped() && self.known.stop_word() != stop {
                    return Err(self.known.newer_stop(stop));
                }
                self.ask_bridge(
                    now,
                    asker,
                    Ask {
                        stop_word: stop,
                        ..moving(now, late, AskKind::Resume)
                    },
                );
            }
            Wanted::Calibrate => {
                self.may_be_calibrated()?;
                self.ask_bridge(now, asker, kind(AskKind::Calibrate));
            }
            Wanted::Gains { p, d } => self.ask_bridge(
                now,
                asker,
                Ask {
                    gain_p: p,
                    gain_d: d,
                    ..kind(AskKind::SetGains)
                },
            ),
            Wanted::Obstacle { put, edge } => {
                let id = self.ids.fresh(now);
                self.tasks.ask_world(now, asker, id, obstacle(put, edge));
            }
        }
        Ok(Begun::Waits)
    }

    /// Whoever says where the robot stands must not say it of one that drives.
    fn may_be_put_down(&self) -> Result<(), String> {
        let drives = |code| {
            let standby = Command::Wheel(WheelCommand::Standby);
            Command::from_code(code).is_some_and(|command| command != standby)
        };
        let health = self.known.health.unwrap_or_default();
        let logic_drives = health.mode.get() == Some(Mode::Autonomous) && health.stopped == 0;
        let logic_code = self.known.status.map_or(0, |status| status.code);
        if drives(health.current_code) || (logic_drives && drives(logic_code)) {
            return Err("the robot is moving; drive it by hand or stop it first".into());
        }
        Ok(())
    }

    /// The thresholds of one that is on its way would be those of what it happens to drive over, and
    /// it may drive off at any moment. The bridge refuses it of one that drives, whoever asks.
    fn may_be_calibrated(&self) -> Result<(), String> {
        let is_by_itself = self.known.mode() == Some(Mode::Autonomous) && !self.known.is_stopped();
        let has_order = self.known.queue.is_some_and(|queue| queue.under_way != 0);
        match is_by_itself && has_order {
            true => Err(Outcome::UnderWay.to_string()),
            false => Ok(()),
        }
    }

    /// An order is taken back as long as its goods are not held.
    fn may_cancel(&self, order: u32) -> Result<(), String> {
        let queue = self.known.queue.unwrap_or_default();
        if !queue.is_under_way(order) {
            return self.before(order).map(drop);
        }
        match self.known.status.map(|status| status.goal) {
            Some(goal) if goal == Goal::Delivery => Err(format!(
                "order {order} is under way and its goods are in the claw: they are delivered first"
            )),
            _ => Ok(()),
        }
    }

    /// How many orders wait before this one.
    fn before(&self, order: u32) -> Result<usize, String> {
        let queue = self.known.queue.unwrap_or_default();
        queue.before(order).map_err(|error| error.to_string())
    }

    fn ask_bridge(&mut self, now: Moment, asker: Asker, ask: Ask) {
        let id = self.ids.fresh(now);
        self.tasks.ask(now, asker, id, ask);
    }
}

/// What has become of an action so far.
enum Begun {
    /// It is done already.
    Done,
    /// It is answered later.
    Waits,
}

/// Whether an action could undo a stop that has come with it.
const fn ends_a_stop(wanted: Wanted) -> bool {
    matches!(
        wanted,
        Wanted::Resume { .. } | Wanted::Drive { .. } | Wanted::Arm(_)
    )
}

fn kind(kind: AskKind) -> Ask {
    Ask {
        kind: kind.into(),
        ..Ask::default()
    }
}

/// A request that lets the robot move: its time is over as early as that of any other such order.
fn moving(now: Moment, late: Duration, of: AskKind) -> Ask {
    Ask {
        issued_ns: now.given_ns(late),
        lifetime_ms: u32::try_from(LATEST_MOVE.as_millis()).unwrap_or(0),
        ..kind(of)
    }
}

fn obstacle(put: Put, edge: Edge) -> WorldAsk {
    let kind = match put {
        Put::Put => WorldAskKind::Put,
        Put::Take => WorldAskKind::Take,
    };
    edge_ask(kind, edge)
}

fn edge_ask(kind: WorldAskKind, edge: Edge) -> WorldAsk {
    WorldAsk {
        kind: kind.into(),
        x: edge.node.x,
        y: edge.node.y,
        heading: heading(edge.way).into(),
        ..WorldAsk::default()
    }
}
