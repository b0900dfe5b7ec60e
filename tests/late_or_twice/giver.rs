//! The four that give commands: a page of the panel, a GaG, `lager drive`, and logic.

use lager_orders::{Action, LeaseMs, Mode, Wheels};
use lager_topics::{Finish, Origin, SteeringOrder};
use lager_wire::{Command, OperatorCommand, Speed};

use crate::case::Way;
use crate::judge::Judge;
use crate::robot::Bus;

/// How often a page repeats the command of a held key, in ms.
const REPEAT: u64 = 50;
/// How often a page gives a sign of life, in ms.
const HERE: u64 = 1_000;
/// How often an order is renewed, in ms; the next constant is its lease.
const RENEWAL: u64 = 40;
const LEASE: u64 = 120;
/// `lager drive` ends its order when the board has not reported for this time, in ms.
const UNHEARD: u64 = 200;

/// A message of a page to the panel, with the time of the page's own clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Said {
    pub(crate) said_ms: u32,
    /// `None` = a sign of life.
    pub(crate) action: Option<Action>,
}

/// A page with a person at it.
#[derive(Debug, Default)]
pub(crate) struct Page {
    held: Option<(OperatorCommand, u64)>,
    repeats: u64,
    here: u64,
    presses: Vec<Action>,
}

impl Page {
    pub(crate) fn hold(&mut self, now: u64, command: OperatorCommand, lasts: u64) {
        (self.held, self.repeats) = (Some((command, now + lasts)), now);
    }

    pub(crate) fn press(&mut self, action: Action) {
        self.presses.push(action);
    }

    /// The page's messages at this moment.
    pub(crate) fn turn(&mut self, now: u64, judge: &mut Judge) -> Vec<Said> {
        let mut actions: Vec<_> = self.presses.drain(..).map(Some).collect();
        if let Some((command, until)) = self.held
            && self.repeats <= now
        {
            self.repeats = now + REPEAT;
            let is_over = now >= until;
            if is_over {
                self.held = None;
            } else {
                judge.gives(now, command.firmware());
            }
            actions.push(drive(if is_over {
                OperatorCommand::Stop
            } else {
                command
            }));
        }
        if self.here <= now {
            self.here = now + HERE;
            actions.push(None);
        }
        // The page's clock differs from the robot's.
        let said_ms = now as u32 + 70_000;
        let said = actions.into_iter();
        said.map(|action| Said { said_ms, action }).collect()
    }
}

/// The extension's action for a command to the wheels.
pub(crate) fn drive(command: OperatorCommand) -> Option<Action> {
    Some(Action::Drive {
        wheels: Wheels::new(command)?,
        lease: LeaseMs::new(150)?,
    })
}

/// `lager drive`, with the rules of its loop (`services/lager/src/steer.rs`).
#[derive(Debug)]
pub(crate) struct Drive {
    order: SteeringOrder,
    until: u64,
    renewed: u64,
    reported: u64,
    lets_go: bool,
}

impl Drive {
    pub(crate) fn new(
        now: u64,
        command: OperatorCommand,
        lasts: u64,
        lets_go: bool,
        judge: &mut Judge,
    ) -> Self {
        judge.gives(now, command.firmware());
        Self {
            order: SteeringOrder {
                given_ns: now * 1_000_000,
                id: now as u32,
                origin: Origin::Operator.into(),
                code: command.firmware().code(),
                ..SteeringOrder::default()
            },
            until: now + lasts,
            renewed: now - RENEWAL,
            reported: now,
            lets_go,
        }
    }

    /// Renews the order if it is time; false when the process ends its order.
    pub(crate) fn turn(&mut self, now: u64, bus: &mut Bus, judge: &mut Judge) -> bool {
        if now < self.renewed + RENEWAL {
            return true;
        }
        if now >= self.renewed + LEASE || now >= self.until {
            return false;
        }
        if let Some((_, report)) = bus.state {
            if report.age_ms == 0 {
                self.reported = bus.state.map_or(0, |(at, _)| at);
            }
            let is_own =
                report.finished_origin == Origin::Operator && report.finished_id == self.order.id;
            if is_own && report.finish != Finish::None {
                return false;
            }
        }
        if let Some((_, health)) = bus.health {
            let is_refused =
                health.refused_origin == Origin::Operator && health.refused_id == self.order.id;
            if is_refused || health.stopped != 0 || health.mode != Mode::Manual {
                return false;
            }
        }
        if self.lets_go && now >= self.reported + UNHEARD {
            return false;
        }
        self.renewed = now;
        judge.is_there(now);
        bus.order(now, self.order);
        true
    }
}

/// Logic, as far as it gives orders: it drives while it may, gives another order when it hears that
/// one has ended, and stands while the board does not report.
#[derive(Debug)]
pub(crate) struct Logic {
    command: Command,
    id: u32,
    given: u64,
    is_active: bool,
    renewed: u64,
}

impl Logic {
    pub(crate) fn new(way: Way) -> Option<Self> {
        let command = match way {
            Way::ByHand => return None,
            Way::ByItself => OperatorCommand::Left(Speed::Full),
            Way::Picking => OperatorCommand::Stop,
        };
        Some(Self {
            command: command.firmware(),
            id: 0,
            given: 0,
            is_active: false,
            renewed: 0,
        })
    }

    pub(crate) fn turn(&mut self, now: u64, bus: &mut Bus, judge: &mut Judge) {
        let (Some((_, health)), Some((at, report))) = (bus.health, bus.state) else {
            return;
        };
        let is_heard = now < at + UNHEARD;
        let may = health.mode == Mode::Autonomous && health.stopped == 0 && is_heard;
        let has_ended = report.finished_origin == Origin::Logic
            && report.finished_id == self.id
            && report.finish != Finish::None;
        let gives_anew = may && (!self.is_active || (has_ended && now > self.given + 100));
        self.is_active = may;
        if gives_anew {
            self.id += 1;
            self.given = now;
            if self.command.code() != 1 {
                judge.gives(now, self.command);
            }
        }
        if self.is_active && (gives_anew || now >= self.renewed + RENEWAL) {
            self.renewed = now;
            judge.is_there(now);
            let order = SteeringOrder {
                id: self.id,
                origin: Origin::Logic.into(),
                code: self.command.code(),
                arm_granted: u8::from(self.command.code() == 1),
                ..SteeringOrder::default()
            };
            bus.order(now, order);
        }
    }
}
