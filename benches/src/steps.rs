//! The steps of the path within one process, each as a function as small as it can be called.
//! criterion times them, and callgrind counts their instructions.
//!
//! The ports are real: members of one bus in this process, a typed publisher and subscribers. The
//! actor has its seat and is awake, so a ring makes no system call.

use core::time::Duration;
use std::hint::black_box;

use iceoryx2::prelude::ipc;
use lager_bridge::arbiter::{Arbiter, Verdict};
use lager_floor::Heading;
use lager_logic::{Input, LogicConfig, Navigator};
use lager_orders::Mode;
use lager_ports::{Bus, Publisher, Subscriber};
use lager_rig::Domain;
use lager_sample::{Stamp, Topic};
use lager_topics::{
    MapProduct, Order, Origin, Phase, Role, SensorLine, SteeringOrder, SteeringReport, WarehouseMap,
};
use lager_wake::{Policy, Waiter, Wake};
use lager_wire::{
    Centimetres, Decoder, LineState, PACKET_LENGTH, Packet, PacketId, Payload, SteerCommand,
    SteerData, SteerFlags, Version, checksum,
};

use crate::baseline::iceoryx::{Member, Sender};
use crate::slow;

/// The packets that the two boards send in one second: line and distance in turn, and the steering
/// board's reports, in version 1.
#[must_use]
pub fn a_second_of_packets() -> Vec<Packet> {
    let states = [
        LineState::OnLine,
        LineState::LeftOfLine,
        LineState::RightOfLine,
        LineState::FourWay,
    ];
    (0..200_u8)
        .flat_map(|number| {
            let id = PacketId::new(number % 16);
            let sensor = if number % 2 == 0 {
                Payload::Line(states[usize::from(number / 2) % states.len()])
            } else {
                Payload::Distance(Centimetres(number))
            };
            let report = Payload::SteerData(SteerData {
                code: 3,
                left_duty: number,
                right_duty: 200 - number,
                flags: SteerFlags(SteerFlags::EXDE_OK.0),
                line_error: 2,
                finished_seq: number,
                servo_errors: 0,
                battery_decivolts: 111,
            });
            [sensor, report].map(|payload| Packet { id, payload })
        })
        .collect()
}

/// The same packets as one stream of bytes.
#[must_use]
pub fn a_second_of_bytes() -> Vec<u8> {
    a_second_of_packets()
        .iter()
        .flat_map(|packet| packet.encode(Version::One))
        .collect()
}

/// Decodes bytes of version 1; returns the number of packets.
#[inline(always)]
#[must_use]
pub fn decode(bytes: &[u8]) -> usize {
    let mut decoder = Decoder::new(Version::One);
    black_box(bytes)
        .iter()
        .filter(|byte| decoder.push(**byte).is_some())
        .count()
}

/// Makes the CRC of each of these packets, and nothing else. Any decoder must do at least that.
#[inline(always)]
pub fn check(bytes: &[u8]) {
    for packet in black_box(bytes).chunks_exact(PACKET_LENGTH) {
        black_box(checksum(packet));
    }
}

/// Encodes packets of version 1.
#[inline(always)]
pub fn encode(packets: &[Packet]) {
    for packet in black_box(packets) {
        black_box(packet.encode(Version::One));
    }
}

/// A publisher of line frames, the actor that reads them, and observers, all in this process.
pub struct Ports {
    publisher: Publisher<SensorLine>,
    subscribers: Vec<Subscriber<SensorLine>>,
    waiter: Waiter,
    // The buses are dropped after their ports.
    _buses: [Bus; 3],
    _domain: Domain,
}

impl Ports {
    /// Joins with this number of subscribers, of which the first is the actor. All have received
    /// before.
    ///
    /// # Panics
    /// When no bus can be made.
    #[must_use]
    pub fn meet(subscribers: usize) -> Self {
        let domain = Domain::new(crate::FAMILY).expect("a bus");
        let buses = [Role::Bridge, Role::Logic, Role::Observer].map(|role| domain.open(role));
        let [bridge, logic, observer] = &buses;
        let waiter = logic.waiter(Policy::Block).expect("a waiter");
        let publisher = bridge.publisher().expect("a topic");
        let observers = (1..subscribers).map(|_| observer.subscriber().expect("a topic"));
        let subscribers = [logic.subscriber().expect("a topic")].into_iter();
        let mut ports = Self {
            publisher,
            subscribers: subscribers.chain(observers).collect(),
            waiter,
            _buses: buses,
            _domain: domain,
        };
        // More samples than any queue holds, so every queue and every chunk has been used.
        for _ in 0..100 {
            ports.publish();
            assert_eq!(ports.wait(Duration::ZERO), Wake::Rung);
            assert_eq!(ports.drain(), ports.subscribers.len());
        }
        ports
    }

    /// The same with one subscriber and a sample that it has not received.
    #[must_use]
    pub fn published() -> Self {
        let ports = Self::meet(1);
        ports.publish();
        ports
    }

    /// Publishes a frame, and rings.
    #[inline(always)]
    pub fn publish(&self) {
        let mut loan = self.publisher.loan().unwrap();
        loan.link_epoch = black_box(7);
        slow::publish();
        loan.send().unwrap();
    }

    /// Receives a frame as the actor, and returns its memory.
    #[inline(always)]
    pub fn receive(&mut self) -> Option<u32> {
        slow::receive();
        let sample = self.subscribers[0].receive().unwrap();
        sample.map(|sample| sample.link_epoch)
    }

    /// Waits as the actor.
    #[inline(always)]
    pub fn wait(&self, timeout: Duration) -> Wake {
        self.waiter.wait(black_box(timeout))
    }

    /// Receives all samples for all subscribers, and returns their number.
    pub fn drain(&mut self) -> usize {
        let mut received = 0;
        for subscriber in &mut self.subscribers {
            while subscriber.receive().unwrap().is_some() {
                received += 1;
            }
        }
        received
    }
}

/// The payload of `sensor/line`.
type Frame = <SensorLine as Topic>::Payload;

/// Bare iceoryx2 in the same place, with the ports' header and limits; nobody is rung.
pub struct Bare {
    sender: Sender<Frame, Stamp>,
    subscribers: Vec<iceoryx2::port::subscriber::Subscriber<ipc::Service, Frame, Stamp>>,
    _members: [Member; 2],
    _domain: Domain,
}

impl Bare {
    /// As [`Ports::meet`].
    ///
    /// # Panics
    /// When there is no bus.
    #[must_use]
    pub fn meet(subscribers: usize) -> Self {
        const NAME: &str = "bench/bare-step";
        let domain = Domain::new(crate::FAMILY).expect("a bus");
        let config = domain.config();
        let member = || Member::join(&config, Some(SensorLine::QOS)).expect("a node");
        let [writer, reader] = [member(), member()];
        let sender = writer.sender(NAME).expect("a topic");
        let all = (0..subscribers).map(|_| reader.subscriber(NAME).expect("a topic"));
        let mut bare = Self {
            sender,
            subscribers: all.collect(),
            _members: [writer, reader],
            _domain: domain,
        };
        for _ in 0..100 {
            bare.publish();
            assert_eq!(bare.drain(), bare.subscribers.len());
        }
        bare
    }

    /// Publishes a frame.
    #[inline(always)]
    pub fn publish(&mut self) {
        let frame = Frame {
            link_epoch: black_box(7),
            ..Frame::default()
        };
        self.sender.send(&frame).unwrap();
    }

    /// Receives a frame as the first subscriber, and returns its memory.
    #[inline(always)]
    pub fn receive(&mut self) -> Option<u32> {
        let sample = self.subscribers[0].receive().unwrap();
        sample.map(|sample| sample.link_epoch)
    }

    /// Receives all samples for all subscribers, and returns their number.
    pub fn drain(&mut self) -> usize {
        let mut received = 0;
        for subscriber in &self.subscribers {
            while subscriber.receive().unwrap().is_some() {
                received += 1;
            }
        }
        received
    }
}

/// A navigator on its way along the first edge.
#[must_use]
pub fn driving() -> Navigator {
    let mut map = WarehouseMap {
        width: 3,
        height: 3,
        side_length_cm: 200,
        product_count: 1,
        ..WarehouseMap::default()
    };
    map.products[0] = MapProduct {
        id: 1,
        x: 2,
        y: 0,
        side: Heading::Right.into(),
        ..MapProduct::default()
    };
    let mut navigator = Navigator::new(LogicConfig::default());
    let mode = Mode::Autonomous;
    let start = [
        Input::Map(&map),
        Input::Mode {
            mode,
            stopped: false,
        },
        Input::Order(&Order { id: 1, product: 1 }),
        Input::Line(LineState::OnLine),
        Input::Steering(&report()),
    ];
    for input in start {
        navigator.handle(Duration::ZERO, input);
    }
    still_driving(&navigator);
    navigator
}

/// A fresh report of a steering board.
fn report() -> SteeringReport {
    SteeringReport {
        age_ms: 0,
        ..SteeringReport::default()
    }
}

/// The number of line frames in a second.
pub const FRAMES: u32 = 200;

/// Line frames from one report to the next. A longer silence would stop the robot.
const SILENCE: u32 = 38;

/// Asserts that the robot drives, so that the second was not one of standing.
///
/// # Panics
/// When it does not drive.
pub fn still_driving(navigator: &Navigator) {
    let status = navigator.status();
    assert_eq!(status.phase.get(), Some(Phase::Driving), "{status:?}");
}

/// Decides on the line frames of one second that begins at `from`, with the reports that keep the
/// robot driving.
#[inline(always)]
pub fn navigate(navigator: &mut Navigator, from: Duration) {
    let report = report();
    for frame in 1..=FRAMES {
        let now = from + Duration::from_millis(5) * frame;
        let state = [LineState::OnLine, LineState::LeftOfLine][usize::from(frame % 8 == 0)];
        black_box(navigator.handle(now, Input::Line(black_box(state))));
        if frame % SILENCE == 0 {
            black_box(navigator.handle(now, Input::Steering(black_box(&report))));
        }
    }
}

fn order(id: u32) -> SteeringOrder {
    SteeringOrder {
        id,
        origin: Origin::Logic.into(),
        code: 3,
        ..SteeringOrder::default()
    }
}

/// An arbiter that carries out one of logic's orders on a board of this project.
///
/// # Panics
/// When it does not carry it out.
#[must_use]
pub fn steering() -> Arbiter {
    let mut arbiter = Arbiter::new();
    arbiter.board_up(Duration::ZERO, Version::One, false);
    arbiter.set_mode(Mode::Autonomous);
    let verdict = arbiter.order(Duration::ZERO, Duration::ZERO, &order(1));
    assert_eq!(verdict, Verdict::Executes);
    arbiter.advance(Duration::ZERO);
    while arbiter.poll(Duration::ZERO).is_some() {}
    arbiter
}

/// Judges a new order, and makes the command for it.
#[inline(always)]
pub fn arbitrate(arbiter: &mut Arbiter, id: u32) -> Option<SteerCommand> {
    let now = Duration::from_millis(5);
    let verdict = arbiter.order(now, Duration::ZERO, black_box(&order(id)));
    assert_eq!(verdict, Verdict::Executes);
    arbiter.advance(now);
    arbiter.poll(now)
}
