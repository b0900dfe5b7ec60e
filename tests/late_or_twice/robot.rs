//! The real bridge, boards and body, joined as the processes are. The robot's other processes see
//! them by the samples on the bus.

use std::time::Duration;

use lager_bridge::Counts;
use lager_bridge::listener::{Heard, Listener};
use lager_bridge::machine::{BridgeCore, CoreOptions, Effect};
use lager_orders::Moment;
use lager_plant::{Make, Warehouse};
use lager_simulator::{Robot as Body, RobotOptions, Wire};
use lager_stop::Stop;
use lager_topics::{
    Ask, BridgeAnswer, Health, Origin, Role, SteeringOrder, SteeringReport, StopCause,
};
use lager_wire::RobotProfile;

use crate::judge::Judge;
use crate::mends::Mends;

/// The index of the steering board's port.
const PLACE: usize = 1;
/// The most orders that wait to be read; older ones are lost.
const QUEUE: usize = 64;

pub(crate) fn moment(now: u64) -> Moment {
    Moment {
        robot: Duration::from_millis(now),
        ns: now * 1_000_000,
    }
}

/// The samples on the bus, each with the time of its publication, in ms.
#[derive(Debug, Default)]
pub(crate) struct Bus {
    pub(crate) health: Option<(u64, Health)>,
    pub(crate) state: Option<(u64, SteeringReport)>,
    orders: Vec<(u64, SteeringOrder)>,
    asks: Vec<Asked>,
    pub(crate) answers: Vec<(u32, BridgeAnswer)>,
    /// The content of the robot's stop file.
    pub(crate) stop: Option<Stop>,
}

#[derive(Debug)]
struct Asked {
    /// The number by which comm knows the request; 0 = from a person at the robot.
    id: u32,
    ask: Ask,
}

impl Bus {
    pub(crate) fn order(&mut self, now: u64, order: SteeringOrder) {
        if self.orders.len() == QUEUE {
            self.orders.remove(0);
        }
        self.orders.push((now, order));
    }

    pub(crate) fn ask(&mut self, now: u64, id: u32, ask: Ask) {
        let issued_ns = match ask.issued_ns {
            0 => moment(now).ns,
            said => said,
        };
        let ask = Ask {
            issued_ns,
            lifetime_ms: 500,
            ..ask
        };
        self.asks.push(Asked { id, ask });
    }
}

/// The robot.
#[derive(Debug)]
pub(crate) struct Robot {
    body: Body,
    bridge: Option<Bridge>,
    is_cut: bool,
    mends: Mends,
}

/// A bridge from its start to its end.
#[derive(Debug)]
struct Bridge {
    core: BridgeCore,
    ear: Listener,
    counts: Counts,
    heeded: Option<Stop>,
    asked: Option<u32>,
}

impl Bridge {
    fn new(kept: Option<(&Health, Duration)>) -> Self {
        let options = CoreOptions {
            baud: 500_000,
            raw_line: true,
            original_boards: false,
            robot: RobotProfile::default(),
        };
        Self {
            core: BridgeCore::new(options, kept),
            ear: Listener::new(PLACE),
            counts: Counts::new(kept.map(|(kept, _)| kept)),
            heeded: None,
            asked: None,
        }
    }
}

impl Robot {
    pub(crate) fn new(mends: Mends) -> Self {
        let options = RobotOptions {
            make: Make::Nominal,
            ..RobotOptions::default()
        };
        let warehouse = Warehouse::builtin("small").expect("built in");
        Self {
            body: Body::new(&warehouse, options).expect("a robot"),
            bridge: Some(Bridge::new(None)),
            is_cut: false,
            mends,
        }
    }

    /// Cuts or mends the serial cable to the steering board.
    pub(crate) fn cut(&mut self, is_cut: bool) {
        if self.is_cut != is_cut {
            self.is_cut = is_cut;
            self.body.cut(Wire::Steering, is_cut);
        }
    }

    /// Kills the bridge.
    pub(crate) fn kill(&mut self, bus: &mut Bus) {
        self.bridge = None;
        bus.orders.clear();
    }

    /// Starts a successor, which takes over what the bridge published last.
    pub(crate) fn succeed(&mut self, now: u64, bus: &mut Bus) {
        let kept = bus.health;
        let published = self.mends.published(now, kept.map_or(0, |(at, _)| at));
        let published = Duration::from_millis(published);
        self.bridge = Some(Bridge::new(
            kept.as_ref().map(|(_, health)| (health, published)),
        ));
        bus.orders.clear();
        if kept.is_none_or(|(_, kept)| kept.stopped != 0) && bus.stop.is_none() {
            bus.stop = Some(Stop::new(
                Role::Bridge,
                StopCause::StateLost,
                moment(now).ns,
            ));
        }
    }

    pub(crate) fn is_up(&self) -> bool {
        self.bridge.is_some()
    }

    /// Advances the time of the boards.
    pub(crate) fn advance(&mut self, now: u64, judge: &mut Judge) {
        self.body.advance_to(Duration::from_millis(now));
        judge.sees(now, self.body.truth().duties);
    }

    /// One turn of the bridge's loop, as in its service.
    pub(crate) fn turn(&mut self, now: u64, bus: &mut Bus, judge: &mut Judge) {
        if self.bridge.is_none() {
            return;
        }
        self.act(now, bus, judge);
        let mut bytes = Vec::new();
        self.body.read(Wire::Steering, &mut bytes);
        for byte in bytes {
            let bridge = self.bridge.as_mut().expect("it is up");
            let heard = bridge.ear.push(byte, moment(now), &bridge.counts);
            self.hear(now, heard, bus, judge);
        }
        loop {
            let bridge = self.bridge.as_mut().expect("it is up");
            let heard = bridge.ear.poll(moment(now).robot, &bridge.counts);
            if heard.is_none() {
                break;
            }
            self.hear(now, heard, bus, judge);
        }
        let bridge = self.bridge.as_mut().expect("it is up");
        if bridge.asked.is_none() && !bus.asks.is_empty() {
            let Asked { id, ask } = bus.asks.remove(0);
            bridge.asked = Some(id);
            bridge.core.ask(moment(now), &ask);
            self.act(now, bus, judge);
        }
        let bridge = self.bridge.as_mut().expect("it is up");
        for (sent, order) in std::mem::take(&mut bus.orders) {
            let since = match order.origin.get() {
                Some(Origin::Logic) => sent,
                _ => order.given_ns / 1_000_000,
            };
            let age = self.mends.age(Duration::from_millis(now - since));
            let [read, sent] = [now, sent].map(Duration::from_millis);
            bridge.core.order(read, sent, age, &order);
        }
        bridge.core.decide(moment(now).robot);
        self.act(now, bus, judge);
        let bridge = self.bridge.as_mut().expect("it is up");
        if let Some(answer) = bridge.core.answer() {
            let id = bridge.asked.take().unwrap_or_default();
            bus.answers.push((id, answer));
        }
    }

    fn hear(&mut self, now: u64, heard: Option<Heard>, bus: &mut Bus, judge: &mut Judge) {
        if let Some(Heard::Event(event)) = heard {
            let bridge = self.bridge.as_mut().expect("it is up");
            bridge.core.port(moment(now), PLACE, event);
            self.act(now, bus, judge);
        }
    }

    fn act(&mut self, now: u64, bus: &mut Bus, judge: &mut Judge) {
        loop {
            let Bridge {
                core,
                counts,
                heeded,
                ..
            } = self.bridge.as_mut().expect("it is up");
            if bus.stop != *heeded
                && let Some(stop) = bus.stop
            {
                *heeded = Some(stop);
                core.stop(stop);
            }
            let Some(action) = core.next(moment(now)) else {
                return;
            };
            match action {
                Effect::Write(write) => {
                    if let Some(command) = write.command {
                        judge.told(now, command.code, command.seq);
                    }
                    self.body.write(Wire::Steering, &write.packet);
                    core.wrote(&write, true, moment(now));
                }
                Effect::PublishHealth { .. } => {
                    let mut health = Health::default();
                    core.fill_health(moment(now).robot, counts, &mut health);
                    core.health_told();
                    bus.health = Some((now, health));
                }
                Effect::PublishState { .. } => {
                    let mut state = SteeringReport::default();
                    core.fill_state(moment(now).robot, &mut state);
                    core.state_told(&state);
                    bus.state = Some((now, state));
                }
                Effect::Stop(cause) => {
                    let stop = Stop::new(Role::Bridge, cause, moment(now).ns);
                    bus.stop.get_or_insert(stop);
                }
                Effect::Release(stop) => {
                    let is_clear = bus.stop == Some(stop);
                    if is_clear {
                        (bus.stop, *heeded) = (None, None);
                    }
                    core.released(is_clear);
                }
                Effect::Discard { .. } | Effect::ShowReport(_) | Effect::Say(_) => {}
            }
        }
    }
}
