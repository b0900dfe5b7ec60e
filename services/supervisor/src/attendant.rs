//! The service `lager attend`: it does the work on the bus that `up` itself must not do.
//!
//! To open or sweep a bus can hang if shared memory is damaged, and a mapping of a file that was
//! cut short ends the process. So the supervisor stays away from the bus. Its child, this process,
//! keeps each service's last state for a successor, sweeps what dead processes leave, and listens
//! whether every service lives. It prints what the robot does, and watches its mission. If there is
//! no external computer, it tells the robot its warehouse. If this process fails, the supervisor
//! starts another one, which goes on watching the mission.
//!
//! It decides nothing about processes. It reports what it hears (`protocol.rs`), and the supervisor
//! acts.

mod busy;
mod ears;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_home::{Chance, Clock, Inventory, Sign};
use lager_orders::Moment;
use lager_ports::{Bus, BusConfig, Cause, OpenError, Publisher};
use lager_topics::{NavMap, Role, WarehouseMap};
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::children::{Parent, adopt};
use crate::hands::Hands;
use crate::kept_orders::{KeptOrders, Returned};
use crate::last_states::LastStates;
use crate::mission::{Helper, Mission, Watch};
use crate::narrator::Narrator;
use crate::protocol::{Begin, Line, Pulse, Request, Sweep, Word};
use busy::Busy;
use ears::Ears;

/// How often this process looks around, in robot time, and at the latest in real time. It answers
/// the supervisor at once.
const TICK: Duration = Duration::from_millis(40);
/// How often it looks while a successor may be waiting for its state, in real time.
const HAND_OVER_TICK: Duration = Duration::from_millis(5);
/// How long after its start a service may still need the state that is kept for it.
const INTRODUCTION: Duration = Duration::from_millis(500);
/// How often the supervisor hears that this process lives.
pub(crate) const PULSE: Duration = Duration::from_millis(200);
/// How often it checks whether all of the bus's files exist.
const LOOK: Duration = Duration::from_secs(1);
/// How often it sweeps the nodes of dead processes from the bus. It sweeps a service's node at
/// once, and a process that joins sweeps, too. With 64 observers there are 70 nodes; to ask for
/// each whether it lives took a core for 11 ms (2026-11-25).
const SWEEP: Duration = Duration::from_secs(5);
/// How long the first message may take.
const FIRST_WORD: Duration = Duration::from_secs(2);
/// How long the bus may return nothing but errors, and at how many looks at least: on a busy
/// machine there are few.
const ERRORS: Duration = Duration::from_secs(2);
const BAD_LOOKS: u32 = 25;
/// How often it reads the services' signs of life.
const SIGNS: Duration = Duration::from_millis(200);

/// What an attendant must know of its robot.
#[derive(Debug)]
pub struct AttendantConfig {
    /// The bus that it joins.
    pub bus: BusConfig,
    /// Whether the robot is a real one, with people around it.
    pub is_real: bool,
    /// The warehouse to tell the robot, if there is no external computer.
    pub warehouse: Option<WarehouseMap>,
}

/// Attends the supervisor `parent` until `shutdown`.
///
/// # Errors
/// No supervisor has started this process, or the bus cannot be joined.
pub fn run(config: &AttendantConfig, parent: Option<Parent>, shutdown: &Shutdown) -> Result<()> {
    let stranger = "`lager attend` is a part of `lager up`, which starts it";
    let line = Line::to_supervisor().context(stranger)?;
    adopt(parent.context(stranger)?, shutdown)?;
    let begin = first_word(&line)?;
    make_room(&config.bus, begin.sweep)?;
    line.send(&Word::Swept)?;
    if begin.sweep == Sweep::EverythingAndEnd {
        return Ok(());
    }
    let Some(bus) = join(&config.bus, &line, shutdown)? else {
        lager_ports::remove_stale_nodes(&config.bus)?;
        return Ok(());
    };
    let mut attendant = Attendant::new(config, begin, line, bus)?;
    while !shutdown.is_requested() {
        attendant.answer()?;
        attendant.look()?;
        attendant.wait();
    }
    attendant.last_words()
}

/// Removes what is left on the bus. A damaged bus is cleared. If another robot is up, only files
/// that no process has open are removed: the other robot goes on, and this one's services make
/// their files anew.
fn make_room(address: &BusConfig, sweep: Sweep) -> Result<()> {
    if sweep != Sweep::TheDead {
        let home = address.home()?;
        if home.clear(&address.unit) {
            return Ok(());
        }
        lager_home::mend(&home, address.application.kept);
    }
    lager_ports::remove_stale_nodes(address)?;
    Ok(())
}

fn first_word(line: &Line) -> Result<Begin> {
    wait(line, FIRST_WORD);
    match line.receive()? {
        Some(Request::Begin(begin)) => Ok(begin),
        _ => bail!("the supervisor does not say what to begin with"),
    }
}

/// Joins the bus, as soon as the body has a clock to follow.
fn join(bus: &BusConfig, line: &Line, shutdown: &Shutdown) -> Result<Option<Bus>> {
    while !shutdown.is_requested() {
        match Bus::open(bus, Role::Supervisor) {
            Err(OpenError::Clock(_)) => {}
            joined => return Ok(Some(joined?)),
        }
        line.send(&Word::Pulse(Pulse::default()))?;
        std::thread::sleep(TICK);
    }
    Ok(None)
}

/// Tells the robot its warehouse.
fn tell_warehouse(warehouse: WarehouseMap, bus: &Bus) -> Result<Publisher<NavMap>> {
    let map = bus.publisher::<NavMap>()?;
    map.send(Cause::OWN, warehouse)?;
    Ok(map)
}

/// Everything it does, once it has joined the bus.
struct Attendant {
    line: Line,
    bus: Bus,
    clock: Clock,
    /// Real time counts from here.
    started: Instant,
    robot_start: Duration,
    states: LastStates,
    narrator: Narrator,
    hands: Hands,
    /// The warehouse, if comm does not tell it.
    map: Option<Publisher<NavMap>>,
    watch: Watch,
    told: Option<Mission>,
    returned: Returned,
    /// The orders that the supervisor was last told to keep.
    kept: Option<KeptOrders>,
    is_real: bool,
    ears: Ears,
    /// How long each process could have run: for the ears, and to see whether the machine is busy.
    chances: BTreeMap<u32, Chance>,
    busy: Busy,
    /// The last sign of life of each service that writes them.
    signs: BTreeMap<u32, Sign>,
    signs_due: Instant,
    inventory: Inventory,
    complaints: Complaints,
    pulse_due: Instant,
    look_due: Instant,
    sweep_due: Instant,
    introduced: Instant,
}

impl Attendant {
    fn new(config: &AttendantConfig, begin: Begin, line: Line, bus: Bus) -> Result<Self> {
        let states = LastStates::new(&bus)?;
        let narrator = Narrator::new(&bus, begin.joins_late)?;
        let hands = Hands::new(&bus)?;
        let warehouse = config.warehouse;
        let map = warehouse.map(|map| tell_warehouse(map, &bus)).transpose()?;
        let helper = match config.is_real {
            true => Helper::Person,
            false => Helper::Nobody,
        };
        let now = Instant::now();
        let clock = bus.clock();
        Ok(Self {
            line,
            robot_start: begin.robot_start.unwrap_or_else(|| clock.now()),
            clock,
            bus,
            started: now,
            states,
            narrator,
            hands,
            map,
            watch: Watch::new(begin.mission, helper),
            told: None,
            returned: Returned::new(begin.kept),
            kept: None,
            is_real: config.is_real,
            ears: Ears::default(),
            chances: BTreeMap::new(),
            busy: Busy::default(),
            signs: BTreeMap::new(),
            signs_due: now,
            inventory: Inventory::default(),
            complaints: Complaints::default(),
            pulse_due: now,
            look_due: now,
            sweep_due: now,
            introduced: now,
        })
    }

    /// Does what the supervisor asks.
    fn answer(&mut self) -> Result<()> {
        while let Some(request) = self.line.receive()? {
            match request {
                Request::Begin(_) => {}
                Request::Started(service, pid) => {
                    self.ears.started(service, pid);
                    // Forget the processes that have ended.
                    let processes = self.ears.processes();
                    self.chances.retain(|pid, _| processes.contains(pid));
                    self.signs.retain(|pid, _| processes.contains(pid));
                    self.introduced = Instant::now() + INTRODUCTION;
                }
                Request::HandOver(service) => {
                    self.states.owe(service);
                    self.hand_over()?;
                    // The dead process is swept as soon as its last state is kept.
                    self.sweep_due = Instant::now();
                }
            }
        }
        Ok(())
    }

    fn hand_over(&mut self) -> Result<()> {
        for served in self.states.hand_over() {
            match served {
                Ok(service) => self.line.send(&Word::HandedOver(service))?,
                Err(error) => self.complain(Err(error)),
            }
        }
        Ok(())
    }

    /// Looks at everything once, and does at most one thing for the mission.
    fn look(&mut self) -> Result<()> {
        self.hand_over()?;
        let remembered = self.states.remember();
        let looked = self.narrator.look(self.clock.now() - self.robot_start);
        for result in remembered.into_iter().chain([looked]) {
            self.complain(result);
        }
        if self.sweep_due <= Instant::now() {
            self.sweep_due = Instant::now() + SWEEP;
            self.bus.sweep();
        }
        if self.look_due <= Instant::now() {
            self.look_due = Instant::now() + LOOK;
            self.look_at_files()?;
            self.look_at_machine();
        }
        // Publish it again for those who join late.
        self.map.iter().for_each(Publisher::tick);
        self.return_orders()?;
        self.watch_mission()?;
        self.listen()?;
        for note in self.narrator.take_notes() {
            self.line.send(&Word::Note(note))?;
        }
        if self.pulse_due <= Instant::now() {
            self.pulse_due = Instant::now() + PULSE;
            self.pulse()?;
        }
        self.complaints.end_of_look();
        if self.complaints.are_lasting() {
            self.line
                .send(&Word::Damaged(self.complaints.last.clone()))?;
        }
        Ok(())
    }

    fn look_at_files(&mut self) -> Result<()> {
        let mut processes = self.ears.processes();
        processes.push(std::process::id());
        let missed = self.inventory.look(self.bus.home(), &processes);
        let why = if !self.bus.is_listed() {
            "the files of the bus were removed".to_owned()
        } else if let Some(path) = missed {
            format!(
                "{} is in use, and it or its description was removed or written to",
                path.display()
            )
        } else {
            return Ok(());
        };
        self.line.send(&Word::Damaged(why))?;
        Ok(())
    }

    /// Gives the robot back its earlier orders, and tells the supervisor which orders to keep.
    fn return_orders(&mut self) -> Result<()> {
        let now_ns = Clock::monotonic_ns();
        if let Some(act) = self.returned.step(now_ns, self.narrator.seen()) {
            let given = self.hands.carry_out(act);
            self.complain(given);
        }
        self.tell_kept()
    }

    fn tell_kept(&mut self) -> Result<()> {
        let seen = self.narrator.seen();
        let (Some(queue), Some(status)) = (&seen.queue, &seen.status) else {
            return Ok(());
        };
        let left = self.returned.left();
        let mut all = KeptOrders::of(queue, status, self.is_real);
        all.add_kept(&left);
        if self.kept.as_ref() != Some(&all) {
            self.kept = Some(all.clone());
            self.line.send(&Word::Kept { left, all })?;
        }
        Ok(())
    }

    /// Reports when services wait for a core most of the time, and when that is over.
    fn look_at_machine(&mut self) {
        let now = self.started.elapsed();
        for (service, pid) in self.ears.listened() {
            self.busy.look(service, pid, now);
        }
        if let Some(text) = self.busy.told(now) {
            self.narrator.note("up", &text);
        }
    }

    /// Works on the mission.
    fn watch_mission(&mut self) -> Result<()> {
        let watch = &mut self.watch;
        let now = Moment {
            robot: self.clock.now(),
            ns: Clock::monotonic_ns(),
        };
        let act = watch.step(now, self.narrator.seen());
        if self.told.as_ref() != Some(watch.mission()) {
            // Report it before doing it: a successor must know of every order that was given.
            self.told = Some(watch.mission().clone());
            self.line.send(&Word::Mission(watch.mission().clone()))?;
        }
        if let Some(act) = act {
            let done = self.hands.carry_out(act);
            self.complain(done);
        }
        Ok(())
    }

    /// Reports services that are silent.
    fn listen(&mut self) -> Result<()> {
        for pid in self.narrator.take_heard() {
            self.ears.heard(pid);
        }
        if self.signs_due <= Instant::now() {
            self.signs_due = Instant::now() + SIGNS;
            self.read_signs();
        }
        let chances = &mut self.chances;
        let chance = |pid, piece| {
            let of_it = chances.entry(pid);
            of_it.or_insert_with(|| Chance::of_process(pid)).of(piece)
        };
        let silent = self
            .ears
            .look(self.started.elapsed(), self.clock.now(), chance);
        for silence in silent {
            self.line.send(&Word::Silent(silence))?;
        }
        Ok(())
    }

    /// Hears the services that write a sign of life.
    fn read_signs(&mut self) {
        let (place, robot) = (self.bus.home(), self.bus.unit());
        for (service, pid) in self.ears.writers() {
            let sign = place.sign_of(robot, service.command());
            if let Some(sign) = sign.filter(|sign| sign.pid == pid)
                && self.signs.insert(pid, sign) != Some(sign)
            {
                self.ears.heard(pid);
            }
        }
    }

    fn pulse(&self) -> Result<()> {
        self.line.send(&Word::Pulse(Pulse {
            robot_time: Some(self.clock.now()),
            frames: self.narrator.frames(),
            lost_here: self.narrator.lost_here(),
            lost_elsewhere: self.narrator.lost_elsewhere(),
            at_work: self.ears.at_work(),
        }))?;
        Ok(())
    }

    fn wait(&self) {
        let tick = match Instant::now() < self.introduced {
            true => HAND_OVER_TICK,
            false => self.clock.real(TICK).min(TICK),
        };
        wait(&self.line, tick);
    }

    /// The services have ended: takes their last samples, and where the goods lie.
    fn last_words(mut self) -> Result<()> {
        let looked = self.narrator.look(self.clock.now() - self.robot_start);
        self.complain(looked);
        self.tell_kept()?;
        let delivered = self.watch.mission().delivered().iter().copied();
        let misplaced = delivered.filter(|id| self.narrator.truly_delivered(*id) == Some(false));
        self.line.send(&Word::Misplaced(misplaced.collect()))?;
        self.pulse()?;
        for note in self.narrator.take_notes() {
            self.line.send(&Word::Note(note))?;
        }
        self.bus.sweep();
        Ok(())
    }

    /// Counts an error, and reports it, but not for ever.
    fn complain(&mut self, result: Result<()>) {
        if let Err(error) = result
            && self.complaints.hear(&error)
        {
            let times = self.complaints.count;
            self.narrator
                .note("up", &format!("{error:#} (seen {times} times)"));
        }
    }
}

fn wait(line: &Line, at_most: Duration) {
    let at_most = Timespec::try_from(at_most).expect("no wait is as long as the clock's range");
    let _ = poll(&mut [PollFd::new(line, PollFlags::IN)], Some(&at_most));
}

/// Errors of the bus. Some pass, since the next attempt may succeed. Errors that stay are damage.
#[derive(Default)]
struct Complaints {
    count: u32,
    last: String,
    heard: bool,
    /// Since when every look has met an error, and how many looks there were.
    since: Option<Instant>,
    looks: u32,
}

impl Complaints {
    /// Counts one error. Returns whether to report it.
    fn hear(&mut self, error: &anyhow::Error) -> bool {
        self.count = self.count.wrapping_add(1);
        self.last = format!("{error:#}");
        self.heard = true;
        self.since.get_or_insert_with(Instant::now);
        self.count.is_power_of_two()
    }

    fn end_of_look(&mut self) {
        match core::mem::take(&mut self.heard) {
            true => self.looks += 1,
            false => (self.since, self.looks) = (None, 0),
        }
    }

    /// Whether there were only errors for so long that they will not pass.
    fn are_lasting(&self) -> bool {
        let is_long = self.since.is_some_and(|since| since.elapsed() >= ERRORS);
        is_long && self.looks >= BAD_LOOKS
    }
}
