//! The entries of `nav/inputs`: how a navigator began, each of its inputs, and a proof of its
//! answer. The shell's journal writes them, and a [`Replay`](crate::Replay) reads them.

use core::time::Duration;

use lager_orders::Mode;
use lager_sample::{Coded, Tag, bytes_of, hash};
use lager_topics::{
    Beside, BlockedWays, NavigatorInput, NavigatorInputKind, NavigatorStatus, OrderQueue,
    WarehouseMap,
};
use lager_wire::LineState;
use serde::{Deserialize, Serialize};

use crate::config::LogicConfig;
use crate::navigator::{Input, Navigator};
use crate::output::Output;

/// The state that an earlier navigator has left.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Predecessor {
    pub(crate) status: NavigatorStatus,
    pub(crate) blocks: BlockedWays,
    pub(crate) queue: OrderQueue,
}

/// The beginning of a navigator: everything that decides what it does, apart from its inputs.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Beginning {
    /// The processor on which it runs: another one may round fractions differently.
    pub(crate) processor: String,
    pub(crate) config: LogicConfig,
    /// Whether it resumes from an earlier navigator's state.
    pub(crate) resumes: bool,
    pub(crate) kept: Option<Box<Predecessor>>,
}

impl Beginning {
    /// The beginning of a navigator on this machine.
    pub(crate) fn new(config: &LogicConfig, kept: Option<Predecessor>) -> Self {
        Self {
            processor: std::env::consts::ARCH.to_owned(),
            config: *config,
            resumes: config.resume,
            kept: kept.map(Box::new),
        }
    }

    /// A navigator that begins like this.
    pub(crate) fn navigator(&self) -> Navigator {
        match &self.kept {
            Some(kept) => Navigator::resume(self.config, &kept.status, &kept.blocks, &kept.queue),
            None if self.resumes => Navigator::lost(self.config),
            None => Navigator::new(self.config),
        }
    }
}

/// An input as an entry, with the sample to which the entry refers.
pub(crate) fn of_input<'a>(now: Duration, input: &Input<'a>) -> (NavigatorInput, Beside<'a>) {
    let mut entry = again(now, NavigatorInputKind::Tick);
    let mut beside = Beside::Nothing;
    entry.kind = match *input {
        Input::Tick => NavigatorInputKind::Tick,
        Input::Line(state) => {
            entry.value = state.to_code();
            NavigatorInputKind::Line
        }
        Input::Distance(centimetres) => {
            entry.value = centimetres;
            NavigatorInputKind::Distance
        }
        Input::Steering(report) => {
            beside = Beside::Report(report);
            NavigatorInputKind::Steering
        }
        Input::Map(_) => NavigatorInputKind::Map,
        Input::Order(order) => {
            beside = Beside::Order(order);
            NavigatorInputKind::Order
        }
        Input::Operator(input) => {
            beside = Beside::Operator(input);
            NavigatorInputKind::Operator
        }
        Input::DrivenByHand(sum) => {
            entry.number = sum;
            NavigatorInputKind::DrivenByHand
        }
        Input::Mode { mode, stopped } => {
            (entry.value, entry.flag) = (mode.to_code(), stopped.into());
            NavigatorInputKind::Mode
        }
    }
    .into();
    (entry, beside)
}

/// An entry that is no input: the shell has published something again.
pub(crate) fn again(now: Duration, kind: NavigatorInputKind) -> NavigatorInput {
    NavigatorInput {
        time_ns: now.as_nanos() as u64,
        kind: kind.into(),
        ..NavigatorInput::default()
    }
}

/// The input of an entry; `None` if the entry makes no sense, or is no input.
pub(crate) fn input<'a>(
    entry: &NavigatorInput,
    beside: Beside<'a>,
    map: Option<&'a WarehouseMap>,
) -> Option<Input<'a>> {
    Some(match (entry.kind.get()?, beside) {
        (NavigatorInputKind::Tick, _) => Input::Tick,
        (NavigatorInputKind::Line, _) => Input::Line(LineState::of_code(entry.value)?),
        (NavigatorInputKind::Distance, _) => Input::Distance(entry.value),
        (NavigatorInputKind::Steering, Beside::Report(report)) => Input::Steering(report),
        (NavigatorInputKind::Map, _) => Input::Map(map?),
        (NavigatorInputKind::Order, Beside::Order(order)) => Input::Order(order),
        (NavigatorInputKind::Operator, Beside::Operator(input)) => Input::Operator(input),
        (NavigatorInputKind::DrivenByHand, _) => Input::DrivenByHand(entry.number),
        (NavigatorInputKind::Mode, _) => Input::Mode {
            mode: Mode::of_code(entry.value)?,
            stopped: entry.flag != 0,
        },
        _ => return None,
    })
}

/// Adds the navigator's answer to the entry of the input that it has just handled.
pub(crate) fn answer(entry: &mut NavigatorInput, navigator: &Navigator, output: &Output) {
    let mut proof = hash::START;
    if let Some(order) = navigator.current_order() {
        (entry.command_id, entry.code) = (order.id, order.code);
        entry.arm_granted = order.arm_granted;
        proof = hash::bytes(proof, bytes_of(&order));
    }
    proof = hash::bytes(proof, bytes_of(&navigator.status()));
    for event in &output.events {
        proof = hash::bytes(proof, bytes_of(event));
    }
    if let Some(thought) = &output.thought {
        proof = hash::bytes(proof, bytes_of(thought));
    }
    if output.route_changed {
        proof = hash::bytes(proof, bytes_of(navigator.route()));
    }
    if output.blocks_changed {
        proof = hash::bytes(proof, bytes_of(&navigator.blocks()));
    }
    if output.queue_changed {
        proof = hash::bytes(proof, bytes_of(&navigator.queue()));
    }
    proof = hash::bytes(
        proof,
        &[
            output.status_changed.into(),
            output.route_changed.into(),
            output.blocks_changed.into(),
            output.queue_changed.into(),
        ],
    );
    // In FNV-1a the upper half is mixed better.
    entry.proof = (proof >> 32) as u32;
}

/// An enum of the topics in JSON, by its name.
pub(crate) mod named {
    use super::{Coded, Tag};
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<E: Coded, S: Serializer>(value: &E, to: S) -> Result<S::Ok, S::Error> {
        Tag::from(*value).serialize(to)
    }

    pub(crate) fn deserialize<'de, E: Coded, D: Deserializer<'de>>(from: D) -> Result<E, D::Error> {
        let tag = Tag::<E>::deserialize(from)?;
        tag.get()
            .ok_or_else(|| D::Error::custom(format_args!("{} has no code {tag}", E::NAME)))
    }
}

#[cfg(test)]
mod tests {
    use lager_orders::Pick;
    use lager_topics::{InputKind, NavigatorInputs, Order, SteeringReport};

    use super::*;

    #[test]
    fn every_input_is_the_same_after_its_entry() {
        let order = Order { id: 7, product: -3 };
        let other = Order { id: 8, product: 4 };
        let report = SteeringReport {
            current_id: 9,
            ..SteeringReport::default()
        };
        let map = WarehouseMap {
            width: 4,
            ..WarehouseMap::default()
        };
        let press = lager_topics::Input {
            kind: InputKind::Placed.into(),
            x: 3,
            y: 200,
            heading: lager_floor::Heading::Down.into(),
            order_id: u32::MAX,
            id: 5,
        };
        let inputs = [
            Input::Tick,
            Input::Line(LineState::FourWay),
            Input::Order(&order),
            Input::Distance(254),
            Input::Steering(&report),
            Input::Map(&map),
            Input::Operator(&press),
            Input::Order(&other),
            Input::DrivenByHand(u64::MAX),
            Input::Mode {
                mode: Mode::Autonomous,
                stopped: true,
            },
        ];
        let now = Duration::from_nanos(123_456_789_012);
        let mut piece = NavigatorInputs::default();
        for before in &inputs {
            let (entry, beside) = of_input(now, before);
            assert!(!piece.is_full());
            piece.add(entry, beside);
        }
        assert_eq!(piece.entries().count(), inputs.len());
        for (before, (entry, beside)) in inputs.iter().zip(piece.entries()) {
            let after = input(entry, beside, Some(&map)).expect("an input");
            assert_eq!(format!("{before:?}"), format!("{after:?}"));
            assert_eq!(entry.time_ns, 123_456_789_012);
        }
        // There are four places for orders.
        for _ in 0..2 {
            piece.add(again(now, NavigatorInputKind::Order), Beside::Order(&order));
        }
        assert!(piece.is_full());
    }

    #[test]
    fn a_beginning_is_the_same_after_its_text() {
        let config = LogicConfig {
            tolerance: 0.1 + 0.2,
            cruise_mm_per_s: 73.3 / 7.0,
            pick: Pick::Auto,
            ..LogicConfig::default()
        };
        let status = NavigatorStatus {
            hold: lager_topics::Hold::Link.into(),
            driven_by_hand: u64::MAX,
            ..NavigatorStatus::default()
        };
        let kept = Predecessor {
            status,
            blocks: BlockedWays::default(),
            queue: OrderQueue::default(),
        };
        let before = Beginning::new(&config, Some(kept));
        let text = serde_json::to_string(&before).unwrap();
        let after: Beginning = serde_json::from_str(&text).unwrap();
        assert_eq!(after.config, config);
        assert_eq!(after.kept.unwrap().status, status);
    }
}
