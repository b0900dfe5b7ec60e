//! `lager simulate`: the whole robot in one process in virtual time.
//!
//! It joins the same state machines as the real processes by function calls: no bus, no clock, no
//! thread. The bridge is the real one except for its ports: its core, and the receiving end of each
//! port. A run is a function of warehouse, mission and seed. It proves that the shells decide
//! nothing, and it is the fast way to try a warehouse or a change.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_bridge::listener::{Heard, Listener};
use lager_bridge::machine::{Action, BridgeCore, CoreOptions};
use lager_bridge::{Counts, Moment, PortEvent};
use lager_logic::{Input, LogicConfig, Navigator};
use lager_plant::{GoodState, Warehouse};
use lager_ports::Stop;
use lager_simulator::{CalibrateError, Robot, RobotOptions, Wire};
use lager_topics::{
    Ask, EventKind, FailureKind, Health, Hold, Pick, Role, SteeringOrder, SteeringReport, Tag,
};
use serde::Serialize;

use crate::cli::SimulateArgs;
use crate::config::{self, Config, PickBy};
use crate::exit;
use crate::map::bus_map;
use crate::mission::{Act, Helper, Mission, Seen, Watch};
use crate::up::mission;

/// How far time moves at each turn of the loop.
const TICK: Duration = Duration::from_millis(1);
/// How often logic's order is renewed, as its shell does.
const RENEW: Duration = Duration::from_millis(40);
/// How often the mission is looked at.
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
    /// How often the robot has found a way blocked.
    blocked: u32,
    /// How often the body has run into something.
    collisions: u32,
    /// How often goods have slipped out of the claw.
    slips: u32,
    /// Largest lateral error from the line after the first metre, in mm (E15).
    lateral_mm: f64,
    /// The battery at the end, in volts.
    battery_volts: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
    /// What logic calls it that it stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    failure_kind: Option<Tag<FailureKind>>,
    /// What keeps a robot that would go on by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    hold: Option<Tag<Hold>>,
}

/// Runs every seed in every warehouse; fails when a mission is not delivered.
pub fn run(config: &Config, args: &SimulateArgs) -> Result<ExitCode> {
    if config.logic.pick == Some(PickBy::Manual) {
        bail!(exit::Usage(
            "[logic] pick is \"manual\", and in virtual time nobody is there who would move the arm; \
             leave the key out"
                .into()
        ));
    }
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
        for seed in args.seeds.clone() {
            let start = Instant::now();
            let mut whole = Whole::new(config, &warehouse, &mission, seed, args.obstacles)
                .with_context(|| format!("nothing can be simulated in {name}"))?;
            if let Some(percent) = args.battery {
                let charge = f64::from(percent) / 100.0;
                whole.robot.world_mut().set_battery_charge(charge);
            }
            if args.calibrate {
                whole.calibrate()?;
            }
            let failure = whole.run(limit);
            failed += u32::from(failure.is_some());
            let sim_seconds = whole.now.as_secs_f64();
            let wall_seconds = start.elapsed().as_secs_f64();
            let world = whole.robot.world();
            let line = Line {
                warehouse: name,
                seed,
                delivered: whole.watch.mission().delivered().to_vec(),
                sim_seconds,
                wall_seconds,
                times_real: sim_seconds / wall_seconds,
                frames: whole.frames,
                lost: whole.lost(),
                blocked: whole.blocked,
                failure_kind: whole.failure_kind().filter(|_| failure.is_some()),
                hold: whole.hold().filter(|_| failure.is_some()),
                collisions: world.collisions(),
                slips: world.goods().slips(),
                lateral_mm: world.worst_lateral_mm(),
                battery_volts: world.battery_volts(),
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
        "{:8} seed {:3}: {end} in {:.1} s, {:.0} times as fast as real, {} frames, {} lost, \
         {} collisions, at most {:.0} mm off the line",
        line.warehouse,
        line.seed,
        line.sim_seconds,
        line.times_real,
        line.frames,
        line.lost,
        line.collisions,
        line.lateral_mm,
    ))
}

/// The ends of the cables on the Pi, in the order of the ports.
const WIRES: [Wire; 2] = [Wire::Sensor, Wire::Steering];

/// Robot, bridge, logic and the mission.
struct Whole {
    now: Duration,
    robot: Robot,
    ears: [Listener; 2],
    counts: Counts,
    bridge: BridgeCore,
    /// The stop word.
    stop: Option<Stop>,
    /// Orders on their way to the bridge.
    orders: Vec<SteeringOrder>,
    /// Something has come to the bridge since it last decided.
    stirred: bool,
    navigator: Navigator,
    watch: Watch,
    seen: Seen,
    renewed: Duration,
    looked: Duration,
    frames: u64,
    /// How often logic has found a way blocked.
    blocked: u32,
    bytes: Vec<u8>,
    /// What the wires carry, for the tests of repetition.
    #[cfg(test)]
    tape: taped::Tape,
}

impl Whole {
    fn new(
        config: &Config,
        warehouse: &Warehouse,
        mission: &[i32],
        seed: u64,
        obstacles: u32,
    ) -> Result<Self> {
        let options = RobotOptions {
            seed,
            obstacles,
            baud: config.serial.baud,
            ..RobotOptions::default()
        };
        let bridge = CoreOptions {
            baud: config.serial.baud,
            raw_line: config.serial.raw_line,
            original_boards: config.serial.original_boards,
            arm: config.arm,
        };
        let map = bus_map(warehouse);
        let mut whole = Self {
            now: Duration::ZERO,
            robot: Robot::new(warehouse, options)?,
            ears: [Listener::new(0), Listener::new(1)],
            counts: Counts::default(),
            bridge: BridgeCore::new(bridge, None),
            stop: None,
            orders: Vec::new(),
            stirred: true,
            navigator: Navigator::new(LogicConfig {
                pick: Pick::Auto,
                ..config.navigator()
            }),
            watch: Watch::new(Mission::of_robot(mission, 1), Helper::Nobody),
            seen: Seen::default(),
            renewed: Duration::ZERO,
            looked: Duration::ZERO,
            frames: 0,
            blocked: 0,
            bytes: Vec::new(),
            #[cfg(test)]
            tape: taped::Tape::default(),
        };
        whole.tell_logic(Input::Map(&map));
        Ok(whole)
    }

    /// Has a person calibrate the line sensors before anything else happens.
    fn calibrate(&mut self) -> Result<(), CalibrateError> {
        lager_simulator::calibrate(&mut self.robot)?;
        self.now = self.robot.now();
        Ok(())
    }

    /// Runs until the mission has ended; the reason if it failed.
    fn run(&mut self, limit: Duration) -> Option<String> {
        while self.now < limit {
            if let Some(outcome) = self.turn() {
                return outcome.err();
            }
        }
        Some(format!("not delivered within {} s", limit.as_secs()))
    }

    /// One tick; `Some` once the mission has ended, with the reason if it failed.
    fn turn(&mut self) -> Option<Result<(), String>> {
        self.now += TICK;
        self.robot.advance_to(self.now);
        for place in 0..WIRES.len() {
            self.receive(place);
        }
        self.tell_logic(Input::Tick);
        if self.now - self.renewed >= RENEW {
            self.renew();
        }
        if self.now - self.looked >= LOOK {
            self.looked = self.now;
            self.see_to_mission();
        }
        self.run_bridge();
        match self.watch.mission().outcome()? {
            Ok(()) => Some(self.not_at_the_bar().map_or(Ok(()), Err)),
            Err(why) => Some(Err(why.to_owned())),
        }
    }

    /// What keeps it although it would go on by itself.
    fn hold(&self) -> Option<Tag<Hold>> {
        let hold = self.navigator.status().hold;
        (hold != Hold::None).then_some(hold)
    }

    /// What logic calls it that it stands.
    fn failure_kind(&self) -> Option<Tag<FailureKind>> {
        let failure = self.navigator.status().failure;
        (!failure.is_none()).then_some(failure.kind)
    }

    /// What the mission says is delivered must lie at the delivery station.
    fn not_at_the_bar(&self) -> Option<String> {
        let goods = self.robot.truth().world.goods;
        let lies_there = |product: i32| {
            goods
                .iter()
                .any(|good| good.id == product && good.state == GoodState::Delivered)
        };
        self.watch
            .mission()
            .delivered()
            .iter()
            .find(|product| !lies_there(**product))
            .map(|product| format!("product {product} does not lie at the delivery station"))
    }

    /// Takes what has arrived at one port.
    fn receive(&mut self, place: usize) {
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.clear();
        self.robot.read(WIRES[place], &mut bytes);
        #[cfg(test)]
        self.tape.read(self.now, place, &mut bytes);
        let at = self.moment();
        for byte in &bytes {
            if let Some(heard) = self.ears[place].push(*byte, at, &self.counts) {
                self.take(place, heard);
            }
        }
        if !bytes.is_empty() {
            self.ears[place].measure(&self.counts);
        }
        self.bytes = bytes;
        while let Some(heard) = self.ears[place].poll(self.now, &self.counts) {
            self.take(place, heard);
        }
    }

    fn take(&mut self, place: usize, heard: Heard) {
        match heard {
            Heard::Line(frame) => {
                self.frames += 1;
                if let Some(state) = frame.state.get() {
                    self.tell_logic(Input::Line(state));
                }
            }
            Heard::Distance(frame) => {
                self.frames += 1;
                #[cfg(test)]
                self.tape.measured(frame.distance_cm);
                self.tell_logic(Input::Distance(frame.distance_cm));
            }
            Heard::Data(event) => {
                self.frames += 1;
                self.tell_bridge(place, event);
            }
            Heard::Link(event) => self.tell_bridge(place, event),
        }
    }

    fn tell_bridge(&mut self, place: usize, event: PortEvent) {
        self.bridge.port(self.moment(), place, event);
        self.stirred = true;
        self.act();
    }

    /// Lets the bridge decide when it has to, as it does when it is woken.
    fn run_bridge(&mut self) {
        self.stirred |= self.bridge.next_due() <= self.now;
        while std::mem::take(&mut self.stirred) {
            for order in std::mem::take(&mut self.orders) {
                self.bridge
                    .order(self.now, self.now, Duration::ZERO, &order);
            }
            self.bridge.decide(self.now);
            self.act();
            // The asker sees by `link/health` what became of it.
            let _ = self.bridge.answer();
        }
    }

    /// Does what the bridge wants done.
    fn act(&mut self) {
        while let Some(action) = self.bridge.next(self.moment()) {
            match action {
                Action::Write(write) => {
                    #[cfg(test)]
                    self.tape.wrote(self.now, write.place, &write.packet);
                    self.robot.write(WIRES[write.place], &write.packet);
                    self.bridge.wrote(&write, true, self.moment());
                }
                Action::PublishHealth { .. } => self.publish_health(),
                Action::PublishState { .. } => self.publish_state(),
                Action::Stop(cause) => {
                    let stop = Stop::new(Role::Bridge, cause, self.moment().ns);
                    self.stop.get_or_insert(stop);
                    self.bridge.stop(stop);
                }
                Action::Release(_) => {
                    self.stop = None;
                    self.bridge.released(true);
                }
                // What was written is on the wire, and no process waits for a stop.
                Action::Discard { .. } | Action::ShowReport(_) => {}
                Action::Say(news) => tracing::debug!(at = ?self.now, ?news),
            }
        }
    }

    fn publish_health(&mut self) {
        let mut health = Health::default();
        self.bridge.fill_health(self.now, &self.counts, &mut health);
        self.bridge.health_told();
        // Logic is told what is new to it, as its shell does.
        let told = self.seen.health.replace(health);
        if told.map(|told| told.driven_by_hand) != Some(health.driven_by_hand) {
            self.tell_logic(Input::DrivenByHand(health.driven_by_hand));
        }
        let steers = |health: Health| (health.mode, health.stopped);
        if let Some(mode) = health.mode.get()
            && told.map(steers) != Some(steers(health))
        {
            let stopped = health.stopped != 0;
            self.tell_logic(Input::Mode { mode, stopped });
        }
    }

    fn publish_state(&mut self) {
        let mut report = SteeringReport::default();
        self.bridge.fill_state(self.now, &mut report);
        self.bridge.state_told(&report);
        self.tell_logic(Input::Steering(&report));
    }

    /// A request to the bridge; its answer is seen by what it does.
    fn ask(&mut self, ask: &Ask) {
        let ask = Ask {
            issued_ns: self.moment().ns,
            lifetime_ms: 1_000,
            ..*ask
        };
        self.bridge.ask(self.moment(), &ask);
        self.stirred = true;
        self.act();
    }

    fn moment(&self) -> Moment {
        Moment {
            robot: self.now,
            ns: self.now.as_nanos() as u64,
        }
    }

    /// One input for logic; a changed order is given at once.
    fn tell_logic(&mut self, input: Input<'_>) {
        let before = self.navigator.current_order();
        let said = self.navigator.handle(self.now, input);
        for event in &said.events {
            match event.kind.get() {
                Some(EventKind::Refused) => {
                    self.seen.refused = Some((event.order_id, event.product, event.failure));
                }
                Some(EventKind::WayBlocked) => self.blocked += 1,
                _ => {}
            }
        }
        if let Some(thought) = &said.thought {
            tracing::info!(at = ?self.now, "{thought}");
        }
        if self.navigator.current_order() != before {
            self.renew();
        }
    }

    fn renew(&mut self) {
        self.renewed = self.now;
        if let Some(order) = self.navigator.current_order() {
            self.give(order);
        }
    }

    fn give(&mut self, order: SteeringOrder) {
        self.orders.push(order);
        self.stirred = true;
    }

    /// What a person would see, and what is done for the mission.
    fn see_to_mission(&mut self) {
        self.seen.status = Some(self.navigator.status());
        self.seen.queue = Some(self.navigator.queue());
        match self.watch.step(self.now, &self.seen) {
            Some(Act::Ask(ask)) => self.ask(&ask),
            Some(Act::Order(order)) => self.tell_logic(Input::Order(&order)),
            None => {}
        }
    }

    fn lost(&self) -> u64 {
        self.ears
            .iter()
            .map(|ear| u64::from(ear.health().lost))
            .sum()
    }
}

#[cfg(test)]
mod boards;
#[cfg(test)]
mod disturbed;
#[cfg(test)]
mod obstacles;
#[cfg(test)]
mod placed;
#[cfg(test)]
mod taped;
#[cfg(test)]
mod worn;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mission_that_is_taken_over_again_and_again_is_delivered_once() {
        let warehouse = Warehouse::builtin("small").expect("built in");
        let mission = [1, 2];
        for every in [700, 1_900, 5_300, 13_700] {
            let mut whole =
                Whole::new(&Config::default(), &warehouse, &mission, 1, 0).expect("a robot");
            let every = Duration::from_millis(every);
            let mut due = every;
            while whole.watch.mission().outcome().is_none() {
                let failure = whole.run(due);
                due += every;
                assert!(due < Duration::from_secs(600), "{failure:?}");
                whole.watch = Watch::new(whole.watch.mission().clone(), Helper::Nobody);
            }
            let taken_over = whole.watch.mission();
            assert_eq!(taken_over.outcome(), Some(Ok(())), "every {every:?}");
            assert_eq!(taken_over.delivered(), mission, "every {every:?}");
            let delivered = whole.seen.status.map(|status| status.delivered);
            assert_eq!(delivered, Some(2), "every {every:?}");
            assert_eq!(whole.not_at_the_bar(), None, "every {every:?}");
        }
    }
}
