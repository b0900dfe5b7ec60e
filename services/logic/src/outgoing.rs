//! Decides what is published after an input and in which order, and when the order in force and the
//! status are published again. The shell on the bus, `simulate` and a replay follow it.
//!
//! Events go out first, then the blocked ways, the queue, the route and the status, then the order.
//! Last comes the thought, on which no service acts. If the process is killed between any two of
//! these, its successor knows at least as much as the bridge: an event may come twice, but is never
//! lost. A status follows every event at once, so whoever has read a later status knows everything
//! that follows from the event. Only a setpoint that replaces a setpoint goes out before the status,
//! because it may be given twice. The successor may not know its number, so it leaves one number out
//! when it resumes from a status. An unchanged order is renewed every 40 ms of robot time.

use core::time::Duration;

use lager_orders::Mode;
use lager_orders::lease::RENEWAL;
use lager_topics::{Health, SteeringOrder};
use lager_wire::Command;

use crate::navigator::Input;
use crate::output::Output;

/// How often `nav/status` is published when nothing changes, in robot time.
const STATUS_PERIOD: Duration = Duration::from_millis(50);

/// A part of what is published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The events of the answer.
    Events,
    /// The blocked ways.
    Blocks,
    /// The orders that wait.
    Queue,
    /// The route.
    Route,
    /// The status.
    Status,
    /// The order in force.
    Order,
    /// The thought of the answer.
    Thought,
}

/// The parts in their order.
const PARTS: [Part; 7] = [
    Part::Events,
    Part::Blocks,
    Part::Queue,
    Part::Route,
    Part::Status,
    Part::Order,
    Part::Thought,
];

/// The same, where a setpoint replaces a setpoint.
const SETPOINT_FIRST: [Part; 7] = [
    Part::Events,
    Part::Order,
    Part::Blocks,
    Part::Queue,
    Part::Route,
    Part::Status,
    Part::Thought,
];

/// What a navigator has published, and when it publishes each part again.
#[derive(Clone, Debug, Default)]
pub struct Outgoing {
    order: Option<SteeringOrder>,
    renewal_due: Duration,
    status_due: Duration,
}

impl Outgoing {
    /// The order that went out last; `None` if there is none in force.
    pub fn order(&self) -> Option<SteeringOrder> {
        self.order
    }

    /// The parts to publish after an answer at `now` (robot time); then `order` is in force.
    #[inline]
    pub fn after(
        &mut self,
        now: Duration,
        order: Option<SteeringOrder>,
        output: &Output,
    ) -> impl Iterator<Item = Part> + use<> {
        let is_new = order != self.order;
        let parts = match is_new && is_setpoint(order) && is_setpoint(self.order) {
            true => &SETPOINT_FIRST,
            false => &PARTS,
        };
        self.order = order;
        if is_new {
            self.renewal_due = now + RENEWAL;
        }
        let status_goes = output.status_changed || !output.events.is_empty();
        if status_goes {
            self.status_due = now + STATUS_PERIOD;
        }
        let goes = [
            !output.events.is_empty(),
            output.blocks_changed,
            output.queue_changed,
            output.route_changed,
            status_goes,
            is_new && order.is_some(),
            output.thought.is_some(),
        ];
        parts
            .iter()
            .copied()
            .filter(move |part| goes[*part as usize])
    }

    /// The parts to publish again at `now` (robot time), or before `ahead` more has passed.
    pub fn again(&mut self, now: Duration, ahead: Duration) -> impl Iterator<Item = Part> + use<> {
        let is_due = |due: &mut Duration, period| {
            let is_due = now + ahead >= *due;
            if is_due {
                *due = now + period;
            }
            is_due
        };
        let status = is_due(&mut self.status_due, STATUS_PERIOD).then_some(Part::Status);
        let order = is_due(&mut self.renewal_due, RENEWAL) && self.order.is_some();
        status.into_iter().chain(order.then_some(Part::Order))
    }

    /// When the next part is published again, in robot time.
    pub fn next_due(&self) -> Duration {
        self.status_due.min(self.renewal_due)
    }
}

/// Whether an order holds until another one comes, rather than running once.
fn is_setpoint(order: Option<SteeringOrder>) -> bool {
    order
        .and_then(|order| Command::from_code(order.code))
        .is_some_and(|command| !command.is_one_shot())
}

/// The navigator's last inputs from `link/health`, which the bridge repeats ten times a second and
/// after every order that it has taken.
#[derive(Clone, Copy, Debug, Default)]
pub struct KnownHealth {
    driven_by_hand: Option<u64>,
    mode: Option<(Mode, bool)>,
}

impl KnownHealth {
    /// The inputs that are new in a sample.
    pub fn news(&mut self, health: &Health) -> impl Iterator<Item = Input<'static>> + use<> {
        let before = *self;
        if let Some(mode) = health.mode.get() {
            self.driven_by_hand = Some(health.driven_by_hand);
            self.mode = Some((mode, health.stopped != 0));
        }
        let driven = self
            .driven_by_hand
            .filter(|_| self.driven_by_hand != before.driven_by_hand);
        let mode = self.mode.filter(|_| self.mode != before.mode);
        let driven = driven.map(Input::DrivenByHand).into_iter();
        driven.chain(mode.map(|(mode, stopped)| Input::Mode { mode, stopped }))
    }
}

#[cfg(test)]
mod tests {
    use lager_wire::WheelCommand;

    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn order(id: u32, command: WheelCommand) -> Option<SteeringOrder> {
        Some(SteeringOrder {
            id,
            code: command.code(),
            ..SteeringOrder::default()
        })
    }

    /// The parts at 1 ms, after an answer with all parts in which one order replaces another.
    fn parts(before: Option<SteeringOrder>, after: Option<SteeringOrder>) -> Vec<Part> {
        let mut outgoing = Outgoing {
            order: before,
            ..Outgoing::default()
        };
        let mut output = Output {
            thought: Some(Default::default()),
            route_changed: true,
            blocks_changed: true,
            queue_changed: true,
            status_changed: true,
            ..Output::default()
        };
        output.events.push(Default::default()).expect("a place");
        let parts = outgoing.after(MS, after, &output).collect();
        assert_eq!(outgoing.order(), after);
        parts
    }

    #[test]
    fn the_status_goes_out_before_the_order_except_where_a_setpoint_replaces_a_setpoint() {
        let ahead = order(1, WheelCommand::ActiveForward);
        let stand = order(2, WheelCommand::Standby);
        let turn = order(3, WheelCommand::LeftPerp);
        for (before, after) in [(None, ahead), (ahead, turn), (turn, stand)] {
            assert_eq!(parts(before, after), PARTS);
        }
        assert_eq!(parts(ahead, stand), SETPOINT_FIRST);
        let without_order = PARTS.into_iter().filter(|part| *part != Part::Order);
        let without_order: Vec<Part> = without_order.collect();
        for (before, after) in [(ahead, ahead), (ahead, None), (None, None)] {
            assert_eq!(parts(before, after), without_order);
        }
    }

    #[test]
    fn what_has_not_changed_goes_out_again_when_it_is_due() {
        let mut outgoing = Outgoing::default();
        let ahead = order(1, WheelCommand::ActiveForward);
        let again = |outgoing: &mut Outgoing, ms, ahead| -> Vec<Part> {
            outgoing.again(MS * ms, MS * ahead).collect()
        };
        assert_eq!(again(&mut outgoing, 0, 0), [Part::Status]);
        let said: Vec<Part> = outgoing.after(MS * 5, ahead, &Output::default()).collect();
        assert_eq!(said, [Part::Order]);
        assert_eq!(outgoing.next_due(), MS * 45);
        assert_eq!(again(&mut outgoing, 44, 0), []);
        assert_eq!(again(&mut outgoing, 45, 0), [Part::Order]);
        assert_eq!(outgoing.next_due(), MS * 50);
        // Sent early, with this frame, because the next frame would be too late.
        assert_eq!(again(&mut outgoing, 80, 5), [Part::Status, Part::Order]);
        let changed = Output {
            status_changed: true,
            ..Output::default()
        };
        assert_eq!(outgoing.after(MS * 90, None, &changed).count(), 1);
        assert_eq!(again(&mut outgoing, 139, 0), []);
        assert_eq!(again(&mut outgoing, 140, 0), [Part::Status]);
        let mut happened = Output::default();
        happened.events.push(Default::default()).expect("a place");
        let said: Vec<Part> = outgoing.after(MS * 150, ahead, &happened).collect();
        assert_eq!(said, [Part::Events, Part::Status, Part::Order]);
        assert_eq!(again(&mut outgoing, 189, 0), []);
    }

    #[test]
    fn only_what_is_new_in_the_health_is_news() {
        let mut known = KnownHealth::default();
        let mut health = Health {
            mode: Mode::Manual.into(),
            ..Health::default()
        };
        assert_eq!(known.news(&health).count(), 2);
        assert_eq!(known.news(&health).count(), 0);
        health.driven_by_hand = 7;
        let news: Vec<_> = known.news(&health).collect();
        assert!(matches!(news[..], [Input::DrivenByHand(7)]), "{news:?}");
        health.stopped = 1;
        let news: Vec<_> = known.news(&health).collect();
        assert!(
            matches!(
                news[..],
                [Input::Mode {
                    mode: Mode::Manual,
                    stopped: true
                }]
            ),
            "{news:?}"
        );
    }
}
