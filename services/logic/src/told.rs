//! What `nav/inputs` says of a navigator: how it began, each input as an entry, and the proof of
//! its answer. The shell's journal writes it, and a [`Replay`](crate::Replay) reads it.

use core::time::Duration;

use lager_topics::{
    BlockSource, BlockedWays, Coded, Mode, NavigatorStatus, Order, OrderQueue, Pick,
    SteeringReport, Tag, Told, ToldKind, WarehouseMap, bytes_of, hash,
};
use lager_wire::LineState;
use serde::{Deserialize, Serialize};

use crate::config::LogicConfig;
use crate::navigator::{Input, Navigator};
use crate::node::Node;
use crate::output::Output;

/// What an earlier navigator has left.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Kept {
    pub(crate) status: NavigatorStatus,
    pub(crate) blocks: BlockedWays,
    pub(crate) queue: OrderQueue,
}

/// How a navigator begins: everything that decides what it does, apart from its inputs.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Beginning {
    /// The processor it runs on: on another one, fractions may be rounded otherwise.
    pub(crate) processor: String,
    pub(crate) config: LogicConfig,
    /// Whether it was to take up an earlier one's state.
    pub(crate) resumes: bool,
    pub(crate) kept: Option<Box<Kept>>,
}

impl Beginning {
    /// Of a navigator on this machine.
    pub(crate) fn new(config: &LogicConfig, kept: Option<Kept>) -> Self {
        Self {
            processor: std::env::consts::ARCH.to_owned(),
            config: *config,
            resumes: config.resume,
            kept: kept.map(Box::new),
        }
    }

    /// The navigator.
    pub(crate) fn navigator(&self) -> Navigator {
        match &self.kept {
            Some(kept) => Navigator::resume(self.config, &kept.status, &kept.blocks, &kept.queue),
            None if self.resumes => Navigator::lost(self.config),
            None => Navigator::new(self.config),
        }
    }
}

/// An input as an entry; a report and a map stand beside it.
pub(crate) fn entry(now: Duration, input: &Input<'_>) -> Told {
    let mut told = Told {
        time_ns: now.as_nanos() as u64,
        ..Told::default()
    };
    told.kind = match *input {
        Input::Tick => ToldKind::Tick,
        Input::Line(state) => {
            told.value = state.to_code();
            ToldKind::Line
        }
        Input::Distance(centimetres) => {
            told.value = centimetres;
            ToldKind::Distance
        }
        Input::Steering(_) => ToldKind::Steering,
        Input::Map(_) => ToldKind::Map,
        Input::Order(order) => {
            (told.number, told.product) = (order.id.into(), order.product);
            ToldKind::Order
        }
        Input::Cancel(id) => {
            told.number = id.into();
            ToldKind::Cancel
        }
        Input::MoveUp(id) => {
            told.number = id.into();
            ToldKind::MoveUp
        }
        Input::ClearQueue => ToldKind::ClearQueue,
        Input::GoodsGone(product) => {
            told.number = coded_goods(Some(product)).into();
            ToldKind::Goods
        }
        Input::GoodsBack(product) => {
            (told.number, told.flag) = (coded_goods(product).into(), 1);
            ToldKind::Goods
        }
        Input::PickupDone { order_id, forced } => {
            (told.number, told.flag) = (order_id.into(), forced.into());
            ToldKind::PickupDone
        }
        Input::Pick(pick) => {
            told.value = pick.to_code();
            ToldKind::Pick
        }
        Input::DrivenByHand(sum) => {
            told.number = sum;
            ToldKind::DrivenByHand
        }
        Input::Reset => ToldKind::Reset,
        Input::Placed { node, heading } => {
            (told.x, told.y, told.heading) = (node.x, node.y, heading.into());
            ToldKind::Placed
        }
        Input::Way {
            node,
            heading,
            open,
            source,
        } => {
            (told.x, told.y, told.heading) = (node.x, node.y, heading.into());
            (told.value, told.flag) = (source.to_code(), open.into());
            ToldKind::Way
        }
        Input::Link { lost } => {
            told.flag = lost.into();
            ToldKind::Link
        }
        Input::Mode { mode, stopped } => {
            (told.value, told.flag) = (mode.to_code(), stopped.into());
            ToldKind::Mode
        }
    }
    .into();
    told
}

/// An entry that is no input: the shell has published something again.
pub(crate) fn again(time_ns: u64, kind: ToldKind) -> Told {
    Told {
        time_ns,
        kind: kind.into(),
        ..Told::default()
    }
}

/// What an entry does not have itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beside<'a> {
    pub(crate) report: Option<&'a SteeringReport>,
    pub(crate) map: Option<&'a WarehouseMap>,
    /// The order that the entry has, if it has one.
    pub(crate) order: &'a Order,
}

/// The order in an entry, if it has one.
pub(crate) fn order_of(told: &Told) -> Order {
    Order {
        id: told.number as u32,
        product: told.product,
    }
}

/// A product, or all of them, as `operator/input` and entries have it.
fn coded_goods(product: Option<i32>) -> u32 {
    product.map_or(lager_topics::Input::ALL_GOODS, i32::cast_unsigned)
}

/// The product of such a number; `None` = all of them.
pub(crate) fn goods_of(coded: u32) -> Option<i32> {
    (coded != lager_topics::Input::ALL_GOODS).then(|| coded.cast_signed())
}

/// The input of an entry; `None` if it makes no sense, or is none.
pub(crate) fn input<'a>(told: &Told, beside: &Beside<'a>) -> Option<Input<'a>> {
    let flag = told.flag != 0;
    let node = Node::new(told.x, told.y);
    let id = told.number as u32;
    Some(match told.kind.get()? {
        ToldKind::None | ToldKind::Renewed | ToldKind::Repeated => return None,
        ToldKind::Tick => Input::Tick,
        ToldKind::Line => Input::Line(LineState::of_code(told.value)?),
        ToldKind::Distance => Input::Distance(told.value),
        ToldKind::Steering => Input::Steering(beside.report?),
        ToldKind::Map => Input::Map(beside.map?),
        ToldKind::Order => Input::Order(beside.order),
        ToldKind::Cancel => Input::Cancel(id),
        ToldKind::MoveUp => Input::MoveUp(id),
        ToldKind::ClearQueue => Input::ClearQueue,
        ToldKind::Goods if flag => Input::GoodsBack(goods_of(id)),
        ToldKind::Goods => Input::GoodsGone(goods_of(id)?),
        ToldKind::PickupDone => Input::PickupDone {
            order_id: id,
            forced: flag,
        },
        ToldKind::Pick => Input::Pick(Pick::of_code(told.value)?),
        ToldKind::DrivenByHand => Input::DrivenByHand(told.number),
        ToldKind::Reset => Input::Reset,
        ToldKind::Placed => Input::Placed {
            node,
            heading: told.heading.get()?,
        },
        ToldKind::Way => Input::Way {
            node,
            heading: told.heading.get()?,
            open: flag,
            source: BlockSource::of_code(told.value)?,
        },
        ToldKind::Link => Input::Link { lost: flag },
        ToldKind::Mode => Input::Mode {
            mode: Mode::of_code(told.value)?,
            stopped: flag,
        },
    })
}

/// Adds the navigator's answer to the entry of the input that it has just handled.
pub(crate) fn answer(told: &mut Told, navigator: &Navigator, output: &Output) {
    let mut proof = hash::START;
    if let Some(order) = navigator.current_order() {
        (told.command_id, told.code) = (order.id, order.code);
        told.arm_granted = order.arm_granted;
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
    // The upper half of FNV-1a is the better mixed one.
    told.proof = (proof >> 32) as u32;
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
    use lager_topics::Heading;

    use super::*;

    #[test]
    fn every_input_is_the_same_after_its_entry() {
        let order = Order { id: 7, product: -3 };
        let report = SteeringReport {
            current_id: 9,
            ..SteeringReport::default()
        };
        let map = WarehouseMap {
            width: 4,
            ..WarehouseMap::default()
        };
        let node = Node::new(3, 200);
        let inputs = [
            Input::Tick,
            Input::Line(LineState::FourWay),
            Input::Distance(254),
            Input::Steering(&report),
            Input::Map(&map),
            Input::Order(&order),
            Input::Cancel(u32::MAX),
            Input::MoveUp(4),
            Input::ClearQueue,
            Input::GoodsGone(0),
            Input::GoodsGone(i32::MAX),
            Input::GoodsBack(Some(7)),
            Input::GoodsBack(None),
            Input::PickupDone {
                order_id: 5,
                forced: true,
            },
            Input::Pick(Pick::Auto),
            Input::DrivenByHand(u64::MAX),
            Input::Reset,
            Input::Placed {
                node,
                heading: Heading::Down,
            },
            Input::Way {
                node,
                heading: Heading::Right,
                open: true,
                source: BlockSource::Person,
            },
            Input::Link { lost: true },
            Input::Mode {
                mode: Mode::Autonomous,
                stopped: true,
            },
        ];
        let now = Duration::from_nanos(123_456_789_012);
        for before in inputs {
            let told = entry(now, &before);
            let beside = Beside {
                report: Some(&report),
                map: Some(&map),
                order: &order_of(&told),
            };
            let after = input(&told, &beside).expect("an input");
            assert_eq!(format!("{before:?}"), format!("{after:?}"));
            assert_eq!(told.time_ns, 123_456_789_012);
        }
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
        let kept = Kept {
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
