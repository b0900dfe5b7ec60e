//! [`Seen`]: the state of the robot as an operator sees it, and the orders that it allows.

use lager_orders::{Code, Mode, Reason};
use lager_topics::{
    Failure, Goal, Health, NavigatorStatus, OrderQueue, Outcome, Phase, Refusal, StopCause,
};
use lager_wire::{Command, OperatorCommand, WheelCommand};

/// The last sample of each topic; `None` if none has come.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// The links, and who steers.
    pub health: Option<Health>,
    /// What logic is doing.
    pub status: Option<NavigatorStatus>,
    /// The orders that logic has.
    pub queue: Option<OrderQueue>,
    /// The order that logic refused last: its number, its product, and why. Comm does not keep it,
    /// because it waits for the answer to each of its own orders.
    pub refused: Option<(u32, i32, Failure)>,
    /// Whether there is a simulated world.
    pub is_simulated: bool,
    /// The cause of the stop in force, if it is known.
    pub stop: Option<StopCause>,
}

impl Seen {
    /// Who may drive.
    pub fn mode(&self) -> Option<Mode> {
        self.health.and_then(|health| health.mode.get())
    }

    /// Whether a stop is in force.
    pub fn is_stopped(&self) -> bool {
        self.health.is_some_and(|health| health.stopped != 0)
    }

    /// The word of that stop; 0 = none.
    pub fn stop_word(&self) -> u64 {
        self.health.map_or(0, |health| health.stop_word)
    }

    /// Why nobody may move the robot now, if there is a reason.
    pub fn blocked(&self) -> Option<Refusal> {
        let why = self.health.and_then(|health| health.blocked.get());
        why.filter(|why| *why != Refusal::None)
    }

    /// Why the stop `named` is not released while another one is in force.
    pub fn newer_stop(&self, named: u64) -> Reason {
        match self.stop.filter(|_| self.stop_word() != named) {
            Some(cause) => Reason::new(Code::NewerStopBy, &[&Reason::from(cause).as_str()]),
            // The bridge has seen the other stop but has not reported it yet.
            None => Code::NewerStop.into(),
        }
    }

    /// Whether a person may move wheels or arm now.
    ///
    /// # Errors
    ///
    /// Why not.
    pub fn may_move(&self, command: OperatorCommand) -> Result<(), Reason> {
        let is_arm = matches!(command, OperatorCommand::Arm(_));
        let is_by_hand = self.mode() == Some(Mode::Manual);
        let picks = self.status.map(|status| status.phase) == Some(Phase::Picking.into());
        match (is_by_hand, picks, is_arm) {
            (true, _, _) | (false, true, true) => {}
            (false, true, false) => return Err(Code::OnlyArm.into()),
            (false, false, _) => return Err(Refusal::NotInCharge.into()),
        }
        match self.blocked() {
            None => Ok(()),
            Some(why) => {
                let why = Reason::from(why);
                Err(Reason::new(
                    Code::NotPossible,
                    &[&command.name(), &why.as_str()],
                ))
            }
        }
    }

    /// Nobody may say where a robot stands that is driving.
    pub(crate) fn may_be_put_down(&self) -> Result<(), Reason> {
        let drives = |code| {
            let standby = Command::Wheel(WheelCommand::Standby);
            Command::from_code(code).is_some_and(|command| command != standby)
        };
        let health = self.health.unwrap_or_default();
        let logic_drives = health.mode.get() == Some(Mode::Autonomous) && health.stopped == 0;
        let logic_code = self.status.map_or(0, |status| status.code);
        match drives(health.current_code) || (logic_drives && drives(logic_code)) {
            true => Err(Code::Moving.into()),
            false => Ok(()),
        }
    }

    /// A robot on its way would measure whatever it drives over, and may drive off at any moment.
    /// The bridge also refuses to calibrate a robot that drives, whoever asks.
    pub(crate) fn may_be_calibrated(&self) -> Result<(), Reason> {
        let is_by_itself = self.mode() == Some(Mode::Autonomous) && !self.is_stopped();
        let has_order = self.queue.is_some_and(|queue| queue.under_way != 0);
        match is_by_itself && has_order {
            true => Err(Outcome::UnderWay.into()),
            false => Ok(()),
        }
    }

    /// An order can be cancelled as long as its goods are not held.
    pub(crate) fn may_cancel(&self, order: u32) -> Result<(), Reason> {
        let queue = self.queue.unwrap_or_default();
        if !queue.is_under_way(order) {
            return Ok(queue.before(order).map(drop)?);
        }
        match self.status.map(|status| status.goal) {
            Some(goal) if goal == Goal::Delivery => Err(Reason::new(Code::OrderHeld, &[&order])),
            _ => Ok(()),
        }
    }
}
