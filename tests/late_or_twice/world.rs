//! The whole model in virtual time: people, station, link, comm, bus, bridge and board. Each
//! process takes its turns as its shell does, unless it is frozen. All code is the real one, except
//! for the shells.

use std::time::Duration;

use lager_comm::{Conversation, Effect, LinkLost};
use lager_lines::splitter::LineError;
use lager_lines::{Name, to_line};
use lager_orders::{Action, Code, Late, Mode};
use lager_plant::Warehouse;
use lager_station::{Given, Key, Output, Peer, Station};
use lager_stop::Stop;
use lager_topics::{Ask, AskKind, NavigatorStatus, OrderQueue, Phase, Role, StopCause};
use lager_wire::OperatorCommand;

use crate::case::{Act, Case, LENGTH, Line, Way, Who};
use crate::faults::{Faults, READY};
use crate::giver::{Drive, Logic, Page, Said, drive};
use crate::judge::Judge;
use crate::mends::Mends;
use crate::robot::{Bus, Robot, moment};
use crate::wire::Wire;

/// The longest time between two turns of comm or station, in ms.
const LOOK: u64 = 10;
/// How long comm waits before it connects again, in ms.
const AGAIN: u64 = 100;
/// How often logic publishes that it stands at goods, in ms.
const STATUS: u64 = 50;
/// The longest time until the bridge answers, in ms.
const ANSWER: u64 = 500;

/// A line towards comm, or the end of the connection.
type ToComm = Option<String>;

/// A message to the station over the link.
#[derive(Debug)]
enum ToStation {
    Up(u64),
    Line(u64, String),
    Down(u64),
}

/// The result of a run.
#[derive(Debug)]
pub(crate) struct Run {
    /// The breaks of the laws.
    pub(crate) faults: Vec<String>,
    /// The time of all motion, in ms, and the number of one-shots that began.
    pub(crate) motion: u64,
    pub(crate) one_shots: u32,
    /// How long the longest one-shot was in force, in ms.
    pub(crate) longest: u64,
    /// The number of links that comm closed, and comm's messages about what it could not do.
    pub(crate) hung_up: u32,
    pub(crate) thoughts: Vec<String>,
}

/// Runs a case with these mends.
pub(crate) fn run(case: &Case, mends: Mends) -> Run {
    let mut world = World::new(case, mends);
    for now in 1..READY + LENGTH {
        world.tick(now, case);
    }
    Run {
        faults: world.judge.faults,
        motion: world.judge.motion,
        one_shots: world.judge.one_shots,
        longest: world.judge.longest,
        hung_up: world.hung_up,
        thoughts: world.thoughts,
    }
}

struct World {
    mends: Mends,
    way: Way,
    judge: Judge,
    bus: Bus,
    robot: Robot,
    logic: Option<Logic>,
    drive: Option<Drive>,
    page: Page,
    to_panel: Wire<Said>,
    late: Late,
    gag: Wire<String>,
    to_gag: Wire<String>,
    /// Whether the GaG was asked for a command.
    gag_is_asked: bool,
    station: Station,
    served: u64,
    key: Option<Key>,
    to_station: Wire<ToStation>,
    to_comm: Wire<ToComm>,
    comm: Option<Comm>,
    hung_up: u32,
    thoughts: Vec<String>,
}

/// A comm from its start to its end.
struct Comm {
    conversation: Conversation,
    /// The number of the connection, if there is one.
    link: Option<u64>,
    connects: u64,
    looks: u64,
    turned: u64,
    /// The times of the newest samples that it has read.
    health: u64,
    state: u64,
    status: u64,
    asked: Vec<(u32, u64)>,
    /// The time of its last sign of life.
    signed: Option<u64>,
}

impl Comm {
    fn new(now: u64) -> Self {
        let name = r1();
        Self {
            conversation: Conversation::new(name, None, LinkLost::GoOn),
            link: None,
            connects: now + AGAIN,
            looks: 0,
            turned: now,
            health: 0,
            state: 0,
            status: 0,
            asked: Vec::new(),
            signed: None,
        }
    }
}

fn r1() -> Name {
    Name::new("r1").expect("a name")
}

impl World {
    fn new(case: &Case, mends: Mends) -> Self {
        let warehouse: Warehouse =
            toml::from_str("size = [2, 2]\nside_length_cm = 50").expect("a warehouse");
        let name = Name::new("lager").expect("a name");
        let mut station = Station::new(name, Some(warehouse)).expect("a warehouse");
        let has_gag = case.acts.iter().any(|(_, act)| matches!(act, Act::Say(_)));
        if has_gag {
            station.connected(Peer::Gag);
        }
        Self {
            mends,
            way: case.way,
            judge: Judge::default(),
            bus: Bus::default(),
            robot: Robot::new(mends),
            logic: Logic::new(case.way),
            drive: None,
            page: Page::default(),
            to_panel: Wire::default(),
            late: Late::default(),
            gag: Wire::default(),
            to_gag: Wire::default(),
            gag_is_asked: false,
            station,
            served: 0,
            key: None,
            to_station: Wire::default(),
            to_comm: Wire::default(),
            comm: Some(Comm::new(0)),
            hung_up: 0,
            thoughts: Vec::new(),
        }
    }

    fn tick(&mut self, now: u64, case: &Case) {
        let faults = Faults(now, &case.faults);
        if now == READY - 1 {
            self.begin(now);
        }
        for (_, act) in case.acts.iter().filter(|(at, _)| at + READY == now) {
            self.act(now, *act, faults);
        }
        if faults.runs(Who::Page) {
            let slow = faults.slow(Line::Page);
            for said in self.page.turn(now, &mut self.judge) {
                self.to_panel.send(now, slow + 1, said);
            }
        }
        if faults.runs(Who::Gag) {
            for line in self.to_gag.receive(now, false) {
                self.gag_hears(now, &line);
            }
            // The GaG counts as there as long as its process runs.
            if case.acts.iter().any(|(_, act)| matches!(act, Act::Say(_))) {
                self.judge.is_there(now);
            }
        }
        if faults.runs(Who::Station) {
            self.serve(now, faults);
        }
        self.talk(now, faults);
        if faults.runs(Who::Drive)
            && let Some(drive) = &mut self.drive
            && !drive.turn(now, &mut self.bus, &mut self.judge)
        {
            self.drive = None;
        }
        if faults.runs(Who::Logic)
            && let Some(logic) = &mut self.logic
        {
            logic.turn(now, &mut self.bus, &mut self.judge);
        }
        self.robot.cut(faults.is_cut(Line::Serial));
        self.robot.advance(now, &mut self.judge);
        match (faults.is_killed(Who::Bridge), self.robot.is_up()) {
            (true, true) => self.robot.kill(&mut self.bus),
            (false, false) => self.robot.succeed(now, &mut self.bus),
            _ => {}
        }
        if faults.runs(Who::Bridge) {
            self.robot.turn(now, &mut self.bus, &mut self.judge);
        }
    }

    /// The robot is up: sets the mode, and lets a page take the wheel.
    fn begin(&mut self, now: u64) {
        if self.way != Way::ByHand {
            let ask = Ask {
                kind: AskKind::SetMode.into(),
                mode: Mode::Autonomous.into(),
                ..Ask::default()
            };
            self.bus.ask(now, 0, ask);
        }
        if !self.station.has_gag() {
            self.key = self.station.take_wheel(&r1(), "panel-1").ok();
        }
    }

    fn act(&mut self, now: u64, act: Act, faults: Faults<'_>) {
        match act {
            Act::Hold { command, lasts } if faults.runs(Who::Page) => {
                self.page.hold(now, command, lasts);
            }
            Act::Press(command) if faults.runs(Who::Page) => {
                let action = match command {
                    OperatorCommand::Arm(step) => Some(Action::Arm(step)),
                    command => drive(command),
                };
                self.judge.gives(now, command.firmware());
                self.page
                    .press(action.expect("a command to the wheels or the arm"));
            }
            Act::Resume if faults.runs(Who::Page) => {
                if let Some(action) = self.resume() {
                    self.page.press(action);
                }
            }
            // As in the document, the GaG only answers: an unasked command would wait for its turn.
            Act::Say(command) if faults.runs(Who::Gag) && self.gag_is_asked => {
                self.gag_is_asked = false;
                self.judge.gives(now, command.firmware());
                self.gag.send(now, 0, written(command));
            }
            Act::Drive { command, lasts } if faults.runs(Who::Drive) => {
                let lets_go = self.mends.heirs;
                let drive = Drive::new(now, command, lasts, lets_go, &mut self.judge);
                self.drive = Some(drive);
            }
            Act::Stop => {
                let stop = Stop::new(Role::Operator, StopCause::Ordered, moment(now).ns);
                self.bus.stop = Some(stop);
                self.judge.stops(now, stop.word());
            }
            Act::ResumeHere => {
                if let Some(stop) = self.bus.stop {
                    self.judge.resumes(stop.word());
                    self.bus.ask(now, 0, resume_here(stop));
                }
            }
            Act::Hold { .. } | Act::Press(_) | Act::Resume | Act::Say(_) | Act::Drive { .. } => {}
        }
    }

    /// A page's action to end the stop that it shows.
    fn resume(&mut self) -> Option<Action> {
        let shown = self.station.robot(&r1())?.shown();
        let stop = shown.state.as_ref()?.value.stop?;
        self.judge.resumes(stop);
        Some(Action::Resume { stop })
    }

    /// One turn of the station and of its panel.
    fn serve(&mut self, now: u64, faults: Faults<'_>) {
        let mut waited = 0;
        match self.mends.aged {
            // A waiting message may have come at any moment of the pause.
            true if now - self.served > 200 => waited = now - self.served,
            true => {}
            // Without the mend, the station did not notice its own pause.
            false => (self.served + 1..now).for_each(|at| self.station.turn(moment(at).robot)),
        }
        self.served = now;
        let waited = Duration::from_millis(waited);
        self.station.turn(moment(now).robot);
        for Said { said_ms, action } in self.to_panel.receive(now, faults.is_cut(Line::Page)) {
            let late = self.late.hear(said_ms, moment(now).robot);
            if let Some(action) = action {
                self.panel(late, action);
            }
        }
        if let Some(key) = self.key {
            let _ = self.station.stay(&r1(), key);
        }
        for line in self.gag.receive(now, false) {
            self.station.heard_late(Peer::Gag, waited, Ok(&line));
        }
        if self.station.watches_gag() {
            let has_read = self.to_gag.is_empty() && self.gag.is_empty();
            self.station.gag_has_read(has_read || !self.mends.seen);
        }
        for what in self.to_station.receive(now, faults.is_cut(Line::Link)) {
            match what {
                ToStation::Up(link) => self.station.connected(Peer::Robot(link)),
                ToStation::Line(link, line) => {
                    let line = self.mends.to_station(line.trim_end());
                    self.station
                        .heard_late(Peer::Robot(link), waited, Ok(&line));
                }
                ToStation::Down(link) => self.station.disconnected(Peer::Robot(link)),
            }
        }
        self.station.news();
        for output in self.station.outputs() {
            let slow = faults.slow(Line::Link);
            match output {
                Output::Say {
                    to: Peer::Gag,
                    line,
                } => self.to_gag.send(now, 0, line),
                Output::Say { line, .. } | Output::SayFirst { line, .. } => {
                    self.to_comm.send(now, slow + 1, Some(line));
                }
                Output::Close { peer, .. } => {
                    if peer != Peer::Gag {
                        self.to_comm.send(now, slow + 1, None);
                    }
                }
            }
        }
    }

    /// A page's action, as the panel gives it to the station.
    fn panel(&mut self, late: Duration, action: Action) {
        let late = self.mends.age(late);
        let Some(key) = self.key else { return };
        let _ = match action {
            Action::Drive { wheels, .. } => {
                self.station.drive(&r1(), key, Given { what: wheels, late })
            }
            Action::Arm(step) => self.station.arm(&r1(), key, Given { what: step, late }),
            what => self.station.act(&r1(), Given { what, late }),
        };
    }

    /// The GaG describes the floor when it is asked; its commands are actions of the case.
    fn gag_hears(&mut self, now: u64, line: &str) {
        let answer = match line.trim_end() {
            "sidelength" => "sidelength 50",
            "karta" => "karta 2 2 0 0",
            "prodlis" => "prodlis 1 1 0 0 left",
            "styrcomm" | "armcomm" => return self.gag_is_asked = true,
            _ => return,
        };
        self.gag.send(now, 1, answer.to_owned());
    }

    /// One turn of comm, if it lives and is not frozen.
    fn talk(&mut self, now: u64, faults: Faults<'_>) {
        if faults.is_killed(Who::Comm) {
            if let Some(link) = self.comm.take().and_then(|comm| comm.link) {
                self.to_station.send(now, 1, ToStation::Down(link));
                self.to_comm.drop_all();
            }
            return;
        }
        let comm = self.comm.get_or_insert_with(|| Comm::new(now));
        if !faults.runs(Who::Comm) {
            return;
        }
        let is_cut = faults.is_cut(Line::Link);
        let arrived = match comm.link {
            Some(_) => self.to_comm.receive(now, is_cut),
            None => Vec::new(),
        };
        let due = comm.conversation.due();
        let is_due = due.is_some_and(|due| due <= moment(now).robot);
        if arrived.is_empty() && !is_due && now < comm.looks {
            return;
        }
        comm.looks = now + LOOK;
        let at = moment(now);
        if comm.link.is_none() && now >= comm.connects && !is_cut {
            comm.link = Some(now);
            self.to_station.send(now, 1, ToStation::Up(now));
            comm.conversation.connected(at);
        }
        if !self.mends.aged || (self.way != Way::ByHand && !self.mends.signs) {
            // Without the mend, comm did not notice its pause, at least where logic drives.
            for between in (comm.turned + 1..now).step_by(20) {
                comm.conversation.turn(moment(between));
            }
        }
        comm.turned = now;
        comm.conversation.turn(at);
        self.do_all(now, faults);
        self.see(now);
        let stop_word = self.bus.health.map_or(0, |(_, health)| health.stop_word);
        let comm = self.comm.as_mut().expect("it lives");
        if !self.mends.aged && !arrived.is_empty() {
            // Nor did it notice a silence of the link.
            comm.conversation.heard(at, &[]);
        }
        let mut lines: Vec<Result<String, LineError>> = Vec::new();
        for line in arrived {
            match line {
                Some(line) => lines.push(Ok(self.mends.to_comm(line.trim_end(), stop_word))),
                None => {
                    comm.conversation.heard(at, &core::mem::take(&mut lines));
                    comm.conversation.disconnected(at);
                    (comm.link, comm.connects) = (None, now + AGAIN);
                }
            }
        }
        if !lines.is_empty() {
            comm.conversation.heard(at, &lines);
        }
        self.do_all(now, faults);
    }

    /// Lets comm read the new samples of the bus.
    fn see(&mut self, now: u64) {
        let comm = self.comm.as_mut().expect("it lives");
        let at = moment(now);
        if let Some((published, health)) = self.bus.health.filter(|(at, _)| *at > comm.health) {
            comm.health = published;
            comm.conversation.health(at, &health);
        }
        if self.way == Way::Picking && now >= comm.status + STATUS {
            comm.status = now;
            let status = NavigatorStatus {
                phase: Phase::Picking.into(),
                ..NavigatorStatus::default()
            };
            comm.conversation.queue(at, &OrderQueue::default());
            comm.conversation.status(at, &status, at.ns);
        }
        // Without the mend, comm takes the last report for a new one.
        let is_new = |at: u64| at > comm.state || !self.mends.heirs;
        if let Some((published, state)) = self.bus.state.filter(|(at, _)| is_new(*at)) {
            comm.state = published;
            comm.conversation.report(at, &state);
        }
        for (id, answer) in core::mem::take(&mut self.bus.answers) {
            if comm.asked.iter().any(|(asked, _)| *asked == id) {
                comm.asked.retain(|(asked, _)| *asked != id);
                comm.conversation.answered_by_bridge(id, Ok(answer));
            }
        }
        while let Some((id, _)) = comm.asked.pop_if(|(_, at)| now >= *at + ANSWER) {
            comm.conversation
                .answered_by_bridge(id, Err(Code::RobotSilent.into()));
        }
        if comm.conversation.is_to_tell(at) {
            comm.conversation.tell(at);
        }
    }

    fn do_all(&mut self, now: u64, faults: Faults<'_>) {
        let comm = self.comm.as_mut().expect("it lives");
        for effect in comm.conversation.effects() {
            let line = match effect {
                Effect::Say(line) => to_line(&line).ok(),
                Effect::Show(report) => to_line(&report).ok(),
                Effect::HangUp(why) => {
                    self.thoughts.push(format!("at {now} ms: hung up, {why}"));
                    self.hung_up += 1;
                    if let Some(link) = comm.link.take() {
                        self.to_station.send(now, 1, ToStation::Down(link));
                    }
                    self.to_comm.drop_all();
                    comm.connects = now + AGAIN;
                    None
                }
                Effect::Steer(order) => {
                    self.bus.order(now, order);
                    None
                }
                Effect::Do(lager_operator::Act::Ask { id, ask }) => {
                    comm.asked.push((id, now));
                    self.bus.ask(now, id, ask);
                    None
                }
                Effect::Stop => {
                    let stop = Stop::new(Role::Comm, StopCause::Ordered, moment(now).ns);
                    self.bus.stop = Some(stop);
                    None
                }
                Effect::Map(_) | Effect::Do(_) | Effect::Commission { .. } => None,
            };
            if let (Some(line), Some(link)) = (line, comm.link) {
                let by_itself = self.way != Way::ByHand;
                if line.starts_with("lager") && by_itself && !self.mends.signs {
                    // Without the mend, comm gave the sign once a second while logic drove.
                    if comm.signed.is_some_and(|signed| now < signed + 1_000) {
                        continue;
                    }
                    comm.signed = Some(now);
                }
                if line.starts_with("thought") || line.starts_with("refused") {
                    self.thoughts
                        .push(format!("at {now} ms: {}", line.trim_end()));
                }
                let slow = faults.slow(Line::Link);
                self.to_station
                    .send(now, slow + 1, ToStation::Line(link, line));
            }
        }
    }
}

/// The request of `lager resume`.
fn resume_here(stop: Stop) -> Ask {
    Ask {
        kind: AskKind::Resume.into(),
        stop_word: stop.word(),
        ..Ask::default()
    }
}

/// A command as a line of the GaG.
fn written(command: OperatorCommand) -> String {
    lager_lines::gag::Answer::Command(command).to_string()
}
