//! `lager simulate`: the whole robot in one process in virtual time.
//!
//! It joins the same state machines as the real processes by function calls: no bus, no clock, no
//! thread. The bridge is the real one except for its ports: its core, and the receiving end of each
//! port. Logic's shell is not there; [`Outgoing`] says here as there in which order logic's answers
//! go out, and when its order goes out again. A run depends only on warehouse, mission and seed.
//! It is the fast way to try a warehouse or a change.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_bridge::listener::{Heard, Listener};
use lager_bridge::machine::{BridgeCore, CoreOptions, Effect};
use lager_bridge::{Counts, PortEvent};
use lager_logic::{Input, KnownHealth, LogicConfig, Navigator, Outgoing, Part};
use lager_operator::{Act, Seen};
use lager_orders::{Moment, Pick};
use lager_plant::{GoodState, Warehouse};
use lager_sample::Tag;
use lager_simulator::{CalibrateError, Robot, RobotOptions, Wire};
use lager_stop::Stop;
use lager_supervisor::console;
use lager_supervisor::mission::{Helper, Mission, Watch};
use lager_topics::{
    Ask, Event, EventKind, FailureKind, Health, Hold, Role, SteeringOrder, SteeringReport,
    WarehouseMap,
};
use serde::Serialize;

use crate::cli::SimulateArgs;
use crate::config::{self, Config, SIMULATED_WAREHOUSE};
use crate::exit;
use crate::up::mission;

/// How far time moves at each turn of the loop.
const TICK: Duration = Duration::from_millis(1);
/// How often the mission is checked.
const LOOK: Duration = Duration::from_millis(10);

/// The result of one run.
#[derive(Debug, Serialize)]
struct Line<'a> {
    warehouse: &'a str,
    seed: u64,
    delivered: Vec<i32>,
    sim_seconds: f64,
    wall_seconds: f64,
    /// Its speed; 1 is real time.
    times_real: f64,
    /// Packets from both boards.
    frames: u64,
    /// Packets lost on the wires.
    lost: u64,
    /// How often the robot has found a way blocked.
    blocked: u32,
    /// How often the body has hit something.
    collisions: u32,
    /// How often goods have slipped out of the claw.
    slips: u32,
    /// Largest lateral error from the line after the first metre, in mm (E15).
    lateral_mm: f64,
    /// The battery at the end, in volts.
    battery_volts: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
    /// The reason why logic stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    failure_kind: Option<Tag<FailureKind>>,
    /// The reason why a robot waits that will go on by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    hold: Option<Tag<Hold>>,
}

/// Runs every seed in every warehouse; fails if a mission was not delivered.
pub fn run(config: &Config, args: &SimulateArgs) -> Result<ExitCode> {
    if config.logic.pick == Some(Pick::Manual) {
        bail!(exit::Usage(
            "[logic] pick is \"manual\", and in virtual time nobody is there who would move the arm; \
             leave the key out"
                .into()
        ));
    }
    let names = if args.warehouse.is_empty() {
        let named = config.warehouse.as_deref();
        vec![named.unwrap_or(SIMULATED_WAREHOUSE).to_owned()]
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
        return console::print(&serde_json::to_string(line)?);
    }
    let end = match &line.failure {
        Some(why) => format!("FAILED: {why}"),
        None => format!("delivered {:?}", line.delivered),
    };
    console::print(&format!(
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

/// The Pi's ends of the cables, in the order of the ports.
const WIRES: [Wire; 2] = [Wire::Sensor, Wire::Steering];

fn bridge_options(config: &Config) -> CoreOptions {
    CoreOptions {
        baud: config.serial.baud,
        raw_line: config.serial.tells_raw_line(),
        original_boards: config.serial.original_boards,
        robot: config.robot(),
    }
}

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
    /// Whether the bridge has received something since it last decided.
    stirred: bool,
    navigator: Navigator,
    watch: Watch,
    known_health: KnownHealth,
    outgoing: Outgoing,
    seen: Seen,
    looked: Duration,
    frames: u64,
    /// How often logic has found a way blocked.
    blocked: u32,
    bytes: Vec<u8>,
    /// The bytes on the wires, for the tests that repeat a run.
    #[cfg(test)]
    tape: taped::Tape,
    /// What a person finds out about the robot, for the tests that commission it.
    #[cfg(test)]
    wizard: Option<commissioned::Wizard>,
    /// Nobody takes logic's inputs, for the tests that kill it.
    #[cfg(test)]
    logic_is_gone: bool,
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
        Self::of(config, warehouse, mission, options)
    }

    fn of(
        config: &Config,
        warehouse: &Warehouse,
        mission: &[i32],
        options: RobotOptions,
    ) -> Result<Self> {
        let (side, grid, products) = warehouse.told()?;
        let map = WarehouseMap::new(side, grid, &products);
        let mut whole = Self {
            now: Duration::ZERO,
            robot: Robot::new(warehouse, options)?,
            ears: [Listener::new(0), Listener::new(1)],
            counts: Counts::default(),
            bridge: BridgeCore::new(bridge_options(config), None),
            stop: None,
            orders: Vec::new(),
            stirred: true,
            navigator: Navigator::new(LogicConfig {
                pick: Pick::Auto,
                ..config.navigator()
            }),
            watch: Watch::new(Mission::of_robot(mission, 1), Helper::Nobody),
            known_health: KnownHealth::default(),
            outgoing: Outgoing::default(),
            seen: Seen::default(),
            looked: Duration::ZERO,
            frames: 0,
            blocked: 0,
            bytes: Vec::new(),
            #[cfg(test)]
            tape: taped::Tape::default(),
            #[cfg(test)]
            wizard: None,
            #[cfg(test)]
            logic_is_gone: false,
        };
        whole.tell_logic(Input::Map(&map));
        Ok(whole)
    }

    /// Calibrates the line sensors first, as a person does.
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
        for part in self.outgoing.again(self.now, Duration::ZERO) {
            if part == Part::Order {
                self.give_order();
            }
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

    /// The reason why it waits although it will go on by itself.
    fn hold(&self) -> Option<Tag<Hold>> {
        let hold = self.navigator.status().hold;
        (hold != Hold::None).then_some(hold)
    }

    /// The reason why logic stands.
    fn failure_kind(&self) -> Option<Tag<FailureKind>> {
        let failure = self.navigator.status().failure;
        (!failure.is_none()).then_some(failure.kind)
    }

    /// Checks that delivered products really lie at the delivery station.
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
            .map(|product| format!("goods {product} do not lie at the delivery station"))
    }

    /// Takes the bytes that have arrived at one port.
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
                #[cfg(test)]
                self.with_wizard(|wizard, now| wizard.line(now.robot, frame.bits));
                if let Some(state) = frame.state.get() {
                    self.tell_logic(Input::Line(state));
                }
            }
            Heard::Distance(frame) => {
                self.frames += 1;
                #[cfg(test)]
                self.tape.measured(frame.distance_cm);
                #[cfg(test)]
                self.with_wizard(|wizard, now| wizard.distance(now.robot, frame.distance_cm));
                self.tell_logic(Input::Distance(frame.distance_cm));
            }
            Heard::Event(event) => {
                self.frames += u64::from(event.is_repeated());
                self.tell_bridge(place, event);
            }
        }
    }

    fn tell_bridge(&mut self, place: usize, event: PortEvent) {
        self.bridge.port(self.moment(), place, event);
        self.stirred = true;
        self.act();
    }

    /// Lets the bridge decide at the moments when it would wake up.
    fn run_bridge(&mut self) {
        self.stirred |= self.bridge.next_due() <= self.now;
        while std::mem::take(&mut self.stirred) {
            for order in std::mem::take(&mut self.orders) {
                self.bridge
                    .order(self.now, self.now, Duration::ZERO, &order);
            }
            self.bridge.decide(self.now);
            self.act();
            // The sender of the request sees the answer in `link/health`.
            let _answer = self.bridge.answer();
            #[cfg(test)]
            if let Some(answer) = _answer {
                self.wizard_hears(&answer);
            }
        }
    }

    /// Does what the bridge wants done.
    fn act(&mut self) {
        while let Some(action) = self.bridge.next(self.moment()) {
            match action {
                Effect::Write(write) => {
                    #[cfg(test)]
                    self.tape.wrote(self.now, write.place, &write.packet);
                    self.robot.write(WIRES[write.place], &write.packet);
                    self.bridge.wrote(&write, true, self.moment());
                }
                Effect::PublishHealth { .. } => self.publish_health(),
                Effect::PublishState { .. } => self.publish_state(),
                Effect::Stop(cause) => {
                    let stop = Stop::new(Role::Bridge, cause, self.moment().ns);
                    self.stop.get_or_insert(stop);
                    self.bridge.stop(stop);
                }
                Effect::Release(_) => {
                    self.stop = None;
                    self.bridge.released(true);
                }
                // The bytes are on the wire at once, and no process waits for a stop.
                Effect::Discard { .. } | Effect::ShowReport(_) => {}
                Effect::Say(news) => tracing::debug!(at = ?self.now, ?news),
            }
        }
    }

    fn publish_health(&mut self) {
        let mut health = Health::default();
        self.bridge.fill_health(self.now, &self.counts, &mut health);
        self.bridge.health_told();
        self.seen.health = Some(health);
        #[cfg(test)]
        self.with_wizard(|wizard, now| wizard.health(now, &health));
        for input in self.known_health.news(&health) {
            self.tell_logic(input);
        }
    }

    fn publish_state(&mut self) {
        let mut report = SteeringReport::default();
        self.bridge.fill_state(self.now, &mut report);
        self.bridge.state_told(&report);
        #[cfg(test)]
        self.with_wizard(|wizard, now| wizard.reported(now.robot, &report));
        self.tell_logic(Input::Steering(&report));
    }

    /// A request to the bridge. Its effect is the answer.
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

    /// One input for logic. Its events, order and thought go out; nobody here waits for the rest.
    fn tell_logic(&mut self, input: Input<'_>) {
        #[cfg(test)]
        if self.logic_is_gone {
            return;
        }
        let said = self.navigator.handle(self.now, input);
        let order = self.navigator.current_order();
        for part in self.outgoing.after(self.now, order, &said) {
            match part {
                Part::Events => said.events.iter().for_each(|event| self.hear(event)),
                Part::Order => self.give_order(),
                Part::Thought => {
                    if let Some(thought) = &said.thought {
                        tracing::info!(at = ?self.now, "{thought}");
                    }
                }
                Part::Blocks | Part::Queue | Part::Status | Part::Route => {}
            }
        }
    }

    fn hear(&mut self, event: &Event) {
        match event.kind.get() {
            Some(EventKind::Refused) => {
                self.seen.refused = Some((event.order_id, event.product, event.failure));
            }
            Some(EventKind::WayBlocked) => self.blocked += 1,
            _ => {}
        }
    }

    fn give_order(&mut self) {
        self.orders.extend(self.outgoing.order());
        self.stirred = true;
    }

    /// Takes what a person would see, and acts for the mission.
    fn see_to_mission(&mut self) {
        self.seen.status = Some(self.navigator.status());
        self.seen.queue = Some(self.navigator.queue());
        let Moment { robot, ns } = self.moment();
        match self
            .watch
            .step(lager_orders::Moment { robot, ns }, &self.seen)
        {
            Some(Act::Ask { ask, .. }) => self.ask(&ask),
            Some(Act::Order(order)) => self.tell_logic(Input::Order(&order)),
            // A mission presses nothing and asks no world.
            Some(Act::Press(_) | Act::AskWorld { .. }) | None => {}
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
mod built;
#[cfg(test)]
mod commissioned;
#[cfg(test)]
mod disturbed;
#[cfg(test)]
mod killed;
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
