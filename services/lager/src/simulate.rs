//! `lager simulate`: the whole robot in one process in virtual time.
//!
//! The same state machines as in the real processes are joined by function calls: no bus, no
//! clock, no thread. A run is a function of warehouse, mission and seed. It is the proof that the
//! shells decide nothing, and the fast way to try a warehouse or a change.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_bridge::arbiter::Arbiter;
use lager_bridge::frames::{LineAssembler, ServoTable, steering_report};
use lager_logic::{Input, Navigator};
use lager_plant::{GoodState, Warehouse};
use lager_simulator::{Robot, RobotOptions, Wire};
use lager_topics::{AskKind, EventKind, Health, InputKind, WarehouseMap};
use lager_wire::link::{HostEvent, HostLink, HostTransmitter, Up};
use lager_wire::{Packet, Payload};
use serde::Serialize;

use crate::cli::SimulateArgs;
use crate::config::{self, Config};
use crate::exit;
use crate::map::bus_map;
use crate::operator::{Act, ScriptedOperator, Seen};
use crate::up::mission;

/// How far time moves at each turn of the loop.
const TICK: Duration = Duration::from_millis(1);
/// How often logic's order is renewed, as its shell does.
const RENEW: Duration = Duration::from_millis(40);
/// How often the operator looks.
const LOOK: Duration = Duration::from_millis(10);

/// One run's line.
#[derive(Debug, Serialize)]
struct Line<'a> {
    warehouse: &'a str,
    seed: u64,
    delivered: Vec<i32>,
    sim_seconds: f64,
    wall_seconds: f64,
    /// How many times as fast as real time it ran.
    times_real: f64,
    /// Packets from both boards.
    frames: u64,
    /// Packets lost on the wires.
    lost: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
}

/// Runs every seed in every warehouse; fails when a mission is not delivered.
pub fn run(config: &Config, args: &SimulateArgs) -> Result<ExitCode> {
    let seeds = parse_seeds(&args.seeds)?;
    let names = if args.warehouse.is_empty() {
        vec![config.warehouse.clone()]
    } else {
        args.warehouse.clone()
    };
    let limit = Duration::from_secs(args.limit);
    let mut failed = 0;
    for name in &names {
        let warehouse = config::warehouse(name)?;
        let mission = mission(&warehouse, &args.mission)?;
        for seed in seeds.clone() {
            let start = Instant::now();
            let mut whole = Whole::new(config, &warehouse, &mission, seed)?;
            let failure = whole.run(limit);
            failed += u32::from(failure.is_some());
            let sim_seconds = whole.now.as_secs_f64();
            let wall_seconds = start.elapsed().as_secs_f64();
            let line = Line {
                warehouse: name,
                seed,
                delivered: whole.operator.delivered().to_vec(),
                sim_seconds,
                wall_seconds,
                times_real: sim_seconds / wall_seconds,
                frames: whole.frames,
                lost: whole.lost(),
                failure,
            };
            tell(&line, args.json)?;
        }
    }
    Ok(if failed == 0 {
        ExitCode::SUCCESS
    } else {
        exit::not_delivered()
    })
}

fn tell(line: &Line<'_>, as_json: bool) -> Result<()> {
    if as_json {
        return crate::say(&serde_json::to_string(line)?);
    }
    let end = match &line.failure {
        Some(why) => format!("FAILED: {why}"),
        None => format!("delivered {:?}", line.delivered),
    };
    crate::say(&format!(
        "{:8} seed {:3}: {end} in {:.1} s, {:.0} times as fast as real, {} frames, {} lost",
        line.warehouse, line.seed, line.sim_seconds, line.times_real, line.frames, line.lost
    ))
}

/// `7`, or `1..20` with both ends.
fn parse_seeds(text: &str) -> Result<std::ops::RangeInclusive<u64>> {
    let seed = |text: &str| {
        text.parse::<u64>().with_context(|| {
            format!("`{text}` is no seed; write --seeds 7 or --seeds 1..20 (both ends run)")
        })
    };
    let (first, last) = match text.split_once("..") {
        Some((first, last)) => (seed(first)?, seed(last.trim_start_matches('='))?),
        None => (seed(text)?, seed(text)?),
    };
    if last < first {
        bail!("--seeds {text} is empty; the first seed comes first");
    }
    Ok(first..=last)
}

/// One end of a UART on the Pi, as the bridge has it.
struct Port {
    wire: Wire,
    link: HostLink,
    transmitter: HostTransmitter,
    up: Option<Up>,
}

/// Robot, bridge, logic and operator.
struct Whole {
    now: Duration,
    robot: Robot,
    ports: [Port; 2],
    lines: LineAssembler,
    servos: ServoTable,
    arbiter: Arbiter,
    navigator: Navigator,
    operator: ScriptedOperator,
    map: WarehouseMap,
    seen: Seen,
    renewed: Duration,
    looked: Duration,
    frames: u64,
    bytes: Vec<u8>,
}

impl Whole {
    fn new(config: &Config, warehouse: &Warehouse, mission: &[i32], seed: u64) -> Result<Self> {
        let options = RobotOptions {
            seed,
            baud: config.serial.baud,
            ..RobotOptions::default()
        };
        let port = |wire| Port {
            wire,
            link: HostLink::new(),
            transmitter: HostTransmitter::new(),
            up: None,
        };
        Ok(Self {
            now: Duration::ZERO,
            robot: Robot::new(warehouse, options)?,
            ports: [port(Wire::Sensor), port(Wire::Steering)],
            lines: LineAssembler::default(),
            servos: ServoTable::default(),
            arbiter: Arbiter::new(),
            navigator: Navigator::new(config.navigator()),
            operator: ScriptedOperator::new(mission.to_vec(), 0),
            map: bus_map(warehouse),
            seen: Seen::default(),
            renewed: Duration::ZERO,
            looked: Duration::ZERO,
            frames: 0,
            bytes: Vec::new(),
        })
    }

    /// Runs until the operator's script has ended; the reason if it failed.
    fn run(&mut self, limit: Duration) -> Option<String> {
        let map = self.map;
        self.tell_logic(Input::Map(&map));
        while self.now < limit {
            self.now += TICK;
            self.robot.advance_to(self.now);
            for port in 0..self.ports.len() {
                self.receive(port);
            }
            self.tell_mode();
            self.tell_logic(Input::Tick);
            if self.now - self.renewed >= RENEW {
                self.renew();
            }
            if self.now - self.looked >= LOOK {
                self.looked = self.now;
                self.operate();
            }
            self.transmit();
            match self.operator.outcome() {
                Some(Ok(())) => return self.not_at_the_bar(),
                Some(Err(why)) => return Some(why.to_owned()),
                None => {}
            }
        }
        Some(format!("not delivered within {} s", limit.as_secs()))
    }

    /// What the mission says is delivered must lie at the delivery station.
    fn not_at_the_bar(&self) -> Option<String> {
        let goods = self.robot.truth().world.goods;
        let lies_there = |product: i32| {
            goods
                .iter()
                .any(|good| good.id == product && good.state == GoodState::Delivered)
        };
        self.operator
            .delivered()
            .iter()
            .find(|product| !lies_there(**product))
            .map(|product| format!("product {product} does not lie at the delivery station"))
    }

    /// Takes what has arrived at one port.
    fn receive(&mut self, port: usize) {
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.clear();
        self.robot.read(self.ports[port].wire, &mut bytes);
        for byte in &bytes {
            if let Some(event) = self.ports[port].link.push(*byte, self.now) {
                self.take(port, event);
            }
        }
        self.bytes = bytes;
        while let Some(event) = self.ports[port].link.poll(self.now) {
            self.take(port, event);
        }
    }

    fn take(&mut self, port: usize, event: HostEvent) {
        let Port {
            wire,
            link,
            transmitter,
            up: known,
        } = &mut self.ports[port];
        match event {
            HostEvent::SendSyn => self.robot.write(*wire, &transmitter.syn()),
            HostEvent::SendAck { up } => {
                let Some(version) = link.version() else {
                    return;
                };
                self.robot.write(*wire, &transmitter.ack(version));
                if let Some(up) = up {
                    *known = Some(up);
                    if *wire == Wire::Steering {
                        self.arbiter.board_up(self.now, up.version, up.rebooted);
                    }
                }
            }
            HostEvent::Up(up) => *known = Some(up),
            HostEvent::Silent => *known = None,
            HostEvent::Packet(packet) => self.take_packet(packet),
        }
    }

    fn take_packet(&mut self, packet: Packet) {
        self.frames += 1;
        match packet.payload {
            Payload::RawLine(bits) => self.lines.raw(packet.id, bits),
            Payload::Line(state) => self.tell_logic(Input::Line(state)),
            Payload::Distance(distance) => self.tell_logic(Input::Distance(distance.0)),
            Payload::ArmData(data) => self.servos.hear(&data),
            Payload::SteerData(data) => {
                self.arbiter.observe(self.now, &data);
                let report = steering_report(0, &data, &self.servos, &self.arbiter);
                self.seen.report = Some(report);
                self.tell_logic(Input::Steering(&report));
            }
            _ => {}
        }
    }

    fn tell_mode(&mut self) {
        let (mode, stopped) = (self.arbiter.mode(), self.arbiter.is_stopped());
        self.tell_logic(Input::Mode { mode, stopped });
    }

    /// One input for logic; a changed order is given at once.
    fn tell_logic(&mut self, input: Input<'_>) {
        let before = self.navigator.current_order();
        let said = self.navigator.handle(self.now, input);
        for event in &said.events {
            if event.kind.get() == Some(EventKind::Refused) {
                self.seen.refused = Some(event.order_id);
            }
        }
        if let Some(thought) = &said.thought {
            tracing::info!(at = ?self.now, "{}", thought.text);
            thought.text.as_str().clone_into(&mut self.seen.thought);
        }
        if self.navigator.current_order() != before {
            self.renew();
        }
    }

    fn renew(&mut self) {
        self.renewed = self.now;
        if let Some(order) = self.navigator.current_order() {
            self.arbiter.order(self.now, &order);
        }
    }

    /// What the operator sees and does.
    fn operate(&mut self) {
        let mut health = Health::default();
        self.arbiter.fill(self.now, &mut health);
        health.sensor.up = self.ports[0].up.is_some().into();
        health.steering.up = self.ports[1].up.is_some().into();
        self.seen.health = Some(health);
        self.seen.status = Some(self.navigator.status());
        match self.operator.step(self.now, &self.seen) {
            Some(Act::Ask(ask)) => {
                if let (Some(AskKind::SetMode), Some(mode)) = (ask.kind.get(), ask.mode.get()) {
                    self.arbiter.set_mode(mode);
                }
            }
            Some(Act::Order(order)) => self.tell_logic(Input::Order(&order)),
            Some(Act::Steer(order)) => {
                self.arbiter.order(self.now, &order);
            }
            Some(Act::Press(input)) if input.kind.get() == Some(InputKind::PickupDone) => {
                self.tell_logic(Input::PickupDone {
                    order_id: input.order_id,
                });
            }
            Some(Act::Press(_)) | None => {}
        }
    }

    /// Writes what the arbiter wants written.
    fn transmit(&mut self) {
        let steering = &mut self.ports[1];
        while let Some(command) = self.arbiter.poll(self.now) {
            match steering.transmitter.encode(Payload::SteerCommand(command)) {
                Some(packet) => self.robot.write(steering.wire, &packet),
                None => self.arbiter.not_written(self.now),
            }
        }
    }

    fn lost(&self) -> u64 {
        self.ports
            .iter()
            .map(|port| u64::from(port.link.health().lost))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::parse_seeds;

    #[test]
    fn seeds_are_one_number_or_a_range_with_both_ends() {
        assert_eq!(parse_seeds("7").expect("a seed"), 7..=7);
        assert_eq!(parse_seeds("1..20").expect("a range"), 1..=20);
        assert_eq!(parse_seeds("1..=20").expect("a range"), 1..=20);
        for wrong in ["", "x", "1..", "5..4", "-1"] {
            assert!(parse_seeds(wrong).is_err(), "{wrong}");
        }
    }
}
