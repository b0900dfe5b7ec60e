//! The wishes of the external computer: commands, stops and numbered actions.
//!
//! This file judges an action, and carries it out as a person at the robot would: by the same
//! orders, presses and requests as the commands of `lager`. In doubt the robot stands and says why.

use core::time::Duration;

use lager_operator::{Begun, For};
use lager_orders::Action;
use lager_orders::lease::{LATEST_MOVE, TooLate};
use lager_orders::{Code, Mode, Moment, Reason};
use lager_topics::Refusal;
use lager_wire::OperatorCommand;

use super::{Asker, Conversation, MOST_STOPS, STOPPED};
use crate::effect::Effect;

impl Conversation {
    /// Carries out a command. `Err` is the reason of a refusal.
    pub(super) fn command(
        &mut self,
        now: Moment,
        late: Duration,
        command: OperatorCommand,
        whose: For,
    ) -> Result<(), Reason> {
        if command != OperatorCommand::Stop {
            self.known.seen().may_move(command)?;
        } else if whose == For::Question {
            self.stand(now, STOPPED);
            return Ok(());
        } else if self.known.mode() == Some(Mode::Autonomous) && !self.driving.is_running() {
            // Without this, logic would drive on.
            return Err(Refusal::NotInCharge.into());
        }
        if let For::Action {
            number,
            until_ns: Some(until_ns),
        } = whose
            && self.driving.prolong(command, number, until_ns)
        {
            return Ok(());
        }
        let id = self.orders.ids().fresh(now.ns);
        let order = self.driving.begin(now, late, id, command, whose);
        self.effects.push(Effect::Steer(order));
        Ok(())
    }

    /// Stops the robot before anything else.
    pub(super) fn stop(&mut self, now: Moment, number: Option<u32>) {
        self.driving.let_go(STOPPED);
        self.effects.push(Effect::Stop);
        if let Some(number) = number.filter(|_| self.is_up && self.is_extended)
            && self.stops.len() < MOST_STOPS
        {
            self.stops.push((number, now.ns));
        }
    }

    /// Carries out an action that comes so `late`. The answer comes when it is done or refused.
    /// `is_stopped`: a stop has come with it.
    pub(super) fn carry_out(
        &mut self,
        now: Moment,
        late: Duration,
        number: u32,
        wanted: Action,
        is_stopped: bool,
    ) {
        let last = self.last_number.filter(|last| number <= *last);
        let begun = match (last, TooLate::check(late, wanted.latest())) {
            (Some(last), _) => Err(Reason::new(Code::NumberUsed, &[&last, &number])),
            _ if is_stopped && ends_a_stop(wanted) => Err(Code::WithStop.into()),
            (None, Err(why)) => Err(why.into()),
            (None, Ok(())) => self.begin(now, late, number, wanted),
        };
        self.last_number = self.last_number.max(Some(number));
        match begun {
            Ok(Begun::Waits | Begun::Steers(..)) => {}
            Ok(Begun::Done) => self.reply(number, Ok(())),
            Err(why) => self.reply(number, Err(why)),
        }
    }

    fn begin(
        &mut self,
        now: Moment,
        late: Duration,
        number: u32,
        wanted: Action,
    ) -> Result<Begun, Reason> {
        if let Action::Commission(said) = wanted {
            return self.commission(now, late, said).map(|()| Begun::Done);
        }
        let seen = self.known.seen();
        let asker = Asker::Action(number);
        let begun = self.orders.give(now, late, asker, wanted, &seen)?;
        if let Begun::Steers(command, lease) = begun {
            // It ends with its lease, and it is not older than an order may be.
            let until_ns = lease.map(|lease| {
                let lease = Duration::from_millis(lease.get().into());
                let left = lease.min(LATEST_MOVE.saturating_sub(late));
                now.ns + u64::try_from(left.as_nanos()).unwrap_or(0)
            });
            self.command(now, late, command, For::Action { number, until_ns })?;
            return Ok(Begun::Waits);
        }
        Ok(begun)
    }
}

/// Whether an action could undo a stop that has come with it.
const fn ends_a_stop(wanted: Action) -> bool {
    matches!(
        wanted,
        Action::Resume { .. } | Action::Drive { .. } | Action::Arm(_)
    )
}
