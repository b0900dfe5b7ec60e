//! What the external computer wants done: commands, stops and numbered actions.
//!
//! An action is judged here and carried out as a person at the robot would: by the same orders,
//! presses and requests as the commands of `lager`. In doubt the robot stands and says why.

use lager_lines::extension::{Action as Wanted, Edge, Mode as WantedMode, Pick as WantedPick, Put};
use lager_topics::{Ask, AskKind, Goal, Mode, Order, Phase, Pick, Refusal, WorldAsk, WorldAskKind};
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
        let order = self.driving.begin(now, id, command, whose);
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
        self.stops_again = self.tasks.resumes();
        if let Some(number) = number.filter(|_| self.is_up && self.is_extended)
            && self.stops.len() < MOST_STOPS
        {
            self.stops.push((number, now.ns));
        }
    }

    /// Carries an action out; it is answered when it is done or refused. `is_stopped`: a stop has
    /// come with it.
    pub(super) fn carry_out(&mut self, now: Moment, number: u32, wanted: Wanted, is_stopped: bool) {
        let last = self.last_number.filter(|last| number <= *last);
        let begun = match last {
            Some(last) => Err(format!(
                "the last action on this connection had the number {last}, so number {number} may \
                 have been carried out before; give it anew with a greater number"
            )),
            None if is_stopped && ends_a_stop(wanted) => {
                Err("a stop has come with it; give it anew".into())
            }
            None => self.begin(now, number, wanted),
        };
        self.last_number = self.last_number.max(Some(number));
        match begun {
            Ok(Begun::Waits) => {}
            Ok(Begun::Done) => self.reply(number, Ok(())),
            Err(why) => self.reply(number, Err(why)),
        }
    }

    fn begin(&mut self, now: Moment, number: u32, wanted: Wanted) -> Result<Begun, String> {
        let asker = Asker::Action(number);
        if !self.tasks.has_room() {
            let most = Tasks::MOST;
            return Err(format!("{most} actions are under way; wait for their end"));
        }
        match wanted {
            Wanted::Drive { wheels, lease } => {
                let until_ns = Some(now.ns + u64::from(lease.get()) * 1_000_000);
                let whose = For::Action { number, until_ns };
                self.command(now, wheels.into(), whose)?;
            }
            Wanted::Arm(step) => {
                let whose = For::Action {
                    number,
                    until_ns: None,
                };
                self.command(now, OperatorCommand::Arm(step), whose)?;
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
                    kind: AskKind::SetMode.into(),
                    mode: match mode {
                        WantedMode::Manual => Mode::Manual,
                        WantedMode::Autonomous => Mode::Autonomous,
                    }
                    .into(),
                    ..Ask::default()
                },
            ),
            Wanted::Resume => self.ask_bridge(now, asker, kind(AskKind::Resume)),
            Wanted::Calibrate => self.ask_bridge(now, asker, kind(AskKind::Calibrate)),
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
        Wanted::Resume | Wanted::Drive { .. } | Wanted::Arm(_)
    )
}

fn kind(kind: AskKind) -> Ask {
    Ask {
        kind: kind.into(),
        ..Ask::default()
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
