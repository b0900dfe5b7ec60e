//! `lager commission`: a person at a terminal finds out how the robot is built.
//!
//! ```text
//!   Distance sensor: hold something wide ... in cm, from 20 to 30      the question
//!     the distance sensor reads 189 of 1023                            rewritten while it waits
//!   > 30                                                               the answer
//! ```
//! [`Commissioning`] decides everything; this is its terminal and its bus. Where the output is no
//! terminal, the second line is printed once, so that a script can read and answer.
//!
//! However it ends, the robot stands, because nobody renews its order, and the boards are told what
//! they were told before, unless the person has saved something else. If this process is killed, the
//! boards obey the trial until the bridge ends.

use std::fs::File;
use std::io::{self, IsTerminal as _, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use lager_commission::{Answer, Built, Commissioning, Effect, Question, Said, Takes};
use lager_home::Clock;
use lager_lines::splitter::LineSplitter;
use lager_orders::{Language, Moment};
use lager_ports::{Bus, BusConfig, Subscriber};
use lager_station::files::Hold;
use lager_supervisor::console;
use lager_supervisor::hands::Hands;
use lager_topics::{
    Ask, AskKind, BridgeAnswer, LinkHealth, Outcome, Role, SensorDistance, SensorLine,
    SteeringState,
};
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::cli::CommissionArgs;
use crate::config::Config;
use crate::diagnose;
use crate::exit;
use crate::time_limit::TimeLimit;

/// How long it waits for the terminal between two looks at the bus.
const GLANCE: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 4_000_000,
};
/// How often the values on a terminal are rewritten.
const REWRITE: Duration = Duration::from_millis(200);
/// A longer work without a question has its values shown.
const WORK: Duration = Duration::from_secs(1);
/// The values must fit in a line of a narrow terminal.
const WIDTH: usize = 76;

/// Runs it. `configured` is the configuration without the description of the robot.
///
/// # Errors
/// The robot is not up, or the description cannot be written.
pub fn run(configured: &Config, args: &CommissionArgs, shutdown: &Shutdown) -> Result<ExitCode> {
    let running = configured.of_running_robot()?;
    let running = running.unwrap_or_else(|| configured.clone());
    // It must have a place before a person works for a quarter of an hour, and two people would try
    // two descriptions on one robot.
    let _only_one = Hold::of(&running.place_of_description()?)?;
    if args.undo {
        let path = running.forget_description()?;
        let said = format!(
            "{} is as it was before; start the robot again",
            path.display()
        );
        console::print(&said)?;
        return Ok(ExitCode::SUCCESS);
    }
    diagnose::must_be_up(configured)?;
    let patience = TimeLimit::in_order(configured, shutdown)?;
    let BusConfig { speed, clock, .. } = running.bus()?;
    let bus = BusConfig {
        speed,
        clock,
        ..configured.bus()?
    };
    patience.watchdog.enter("joining the bus");
    let bus = Bus::open(&bus, Role::Operator)?;
    let mut bench = Bench {
        hands: Hands::new(&bus)?,
        health: bus.subscriber()?,
        line: bus.subscriber()?,
        distance: bus.subscriber()?,
        state: bus.subscriber()?,
        bus,
        machine: Commissioning::new(running.commissioned()),
        page: Page::new(),
        kept: None,
    };
    bench.converse(&patience, shutdown)?;
    let Some(built) = bench.kept else {
        console::print("nothing is written")?;
        return match shutdown.is_requested() {
            true => Err(exit::Interrupted.into()),
            false => Ok(ExitCode::SUCCESS),
        };
    };
    patience.watchdog.leave();
    keep(configured, running, &built)
}

/// Writes what was found out.
fn keep(configured: &Config, mut new: Config, built: &Built) -> Result<ExitCode> {
    new.take_commissioned(built);
    let path = new.keep_description(configured).with_context(|| {
        // A quarter of an hour's work must not be lost.
        let _ = console::print(new.described().trim_end());
        "the description above is not saved"
    })?;
    console::print(&format!(
        "{} has it; start the robot again, so that logic uses it, too. Then put it on the delivery crossing and drive a mission with it: `lager mode autonomous`, `lager resume`, `lager fetch PRODUCT`. `lager commission --undo` puts the former one back",
        path.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// The robot on one side, and the terminal on the other.
struct Bench {
    bus: Bus,
    hands: Hands,
    health: Subscriber<LinkHealth>,
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    state: Subscriber<SteeringState>,
    machine: Commissioning,
    page: Page,
    kept: Option<Built>,
}

impl Bench {
    /// Until everything is said. The bus is used only under the watch.
    fn converse(&mut self, patience: &TimeLimit, shutdown: &Shutdown) -> Result<()> {
        let mut splitter = LineSplitter::default();
        let mut is_leaving = false;
        loop {
            patience.watchdog.leave();
            let typed = self.page.read(&mut splitter)?;
            patience.watchdog.enter("waiting for the robot");
            self.hear()?;
            let now = self.now();
            // What was typed before its question was asked counts for nothing.
            if let [first, rest @ ..] = &typed.lines[..] {
                is_leaving |= self.typed(first, is_leaving);
                // A key that is held gives many empty lines.
                if rest.iter().any(|line| !line.trim().is_empty()) {
                    self.page.owe("wait".into());
                }
            }
            if (typed.is_over || shutdown.is_requested()) && !is_leaving {
                is_leaving = true;
                self.machine.quit(now);
            }
            self.machine.turn(now);
            self.act()?;
            for said in self.machine.said() {
                self.page.say(&said)?;
            }
            if self.machine.is_over() {
                return Ok(());
            }
            if !is_leaving {
                let shown = self.machine.shown(now.robot);
                self.page.show(self.machine.question(), &shown)?;
            }
        }
    }

    /// A line of the person. Returns whether it ends everything.
    fn typed(&mut self, line: &str, is_leaving: bool) -> bool {
        let now = self.now();
        let line = line.trim();
        let takes = self.machine.question().map_or(Takes::Yes, Question::takes);
        let is_held = takes == Takes::Hold && line.is_empty();
        if !is_held {
            self.page.typed();
        }
        if is_leaving || (line.is_empty() && !is_held) {
            return false;
        }
        if ["quit", "q", "exit", "sluta"].contains(&line.to_lowercase().as_str()) {
            self.machine.quit(now);
            return true;
        }
        match Answer::read(line, takes) {
            Ok(answer) => self.machine.answer(now, answer),
            // Whatever a person types while the robot moves, he wants it to stand.
            Err(_) if self.machine.moves() => self.machine.answer(now, Answer::No),
            Err(why) => self.page.owe(why),
        }
        false
    }

    /// Hands in what the robot has told.
    fn hear(&mut self) -> Result<()> {
        while let Some(frame) = self.line.receive()? {
            self.machine.line(self.bus.clock().now(), frame.bits);
        }
        while let Some(frame) = self.distance.receive()? {
            let now = self.bus.clock().now();
            self.machine.distance(now, frame.distance_cm);
        }
        while let Some(report) = self.state.receive()? {
            self.machine.reported(self.bus.clock().now(), &report);
        }
        if let Some(health) = self.health.latest()? {
            let now = self.now();
            self.machine.health(now, &health);
        }
        Ok(())
    }

    /// Does what the machine wants.
    fn act(&mut self) -> Result<()> {
        for effect in self.machine.effects() {
            match effect {
                Effect::Steer(order) => self.hands.steer(order)?,
                Effect::Keep(built) => self.kept = Some(built),
                Effect::Describe(part, robot) => {
                    let outcome = outcome(self.hands.ask(Ask::describe(part, &robot)));
                    self.machine.described(self.now(), part, outcome);
                }
                Effect::Calibrate => {
                    let outcome = outcome(self.hands.ask(Ask {
                        kind: AskKind::Calibrate.into(),
                        ..Ask::default()
                    }));
                    self.machine.calibrates(self.now(), outcome);
                }
            }
        }
        Ok(())
    }

    fn now(&self) -> Moment {
        Moment {
            robot: self.bus.clock().now(),
            ns: Clock::monotonic_ns(),
        }
    }
}

/// What the bridge says; nothing if it has not answered.
fn outcome(answer: Result<BridgeAnswer>) -> Option<Outcome> {
    answer.ok()?.outcome.get()
}

/// What has been typed.
#[derive(Default)]
struct Typed {
    lines: Vec<String>,
    /// Nothing more can come.
    is_over: bool,
}

/// The terminal.
struct Page {
    language: Language,
    is_terminal: bool,
    /// Since when this is asked, or since when nothing is.
    asked: Option<(Option<Question>, Instant)>,
    /// The values and the prompt stand at the end.
    has_values: bool,
    rewritten: Instant,
    owed: Vec<Said>,
}

impl Page {
    fn new() -> Self {
        Self {
            language: language(),
            is_terminal: io::stdout().is_terminal(),
            asked: None,
            has_values: false,
            rewritten: Instant::now(),
            owed: Vec::new(),
        }
    }

    /// Waits a little for lines.
    fn read(&self, splitter: &mut LineSplitter) -> Result<Typed> {
        let stdin = io::stdin();
        let mut source = [PollFd::new(&stdin, PollFlags::IN)];
        // If a signal cut it short, the caller looks why.
        let _ = poll(&mut source, Some(&GLANCE));
        let mut typed = Typed::default();
        if source[0].revents().is_empty() {
            return Ok(typed);
        }
        // The file itself: `poll` does not see what is in `Stdin`'s buffer.
        let mut file = File::from(stdin.as_fd().try_clone_to_owned()?);
        let mut buffer = [0; 1_024];
        let count = file.read(&mut buffer)?;
        let mut bytes = &buffer[..count];
        while let Some(line) = splitter.next(&mut bytes) {
            typed.lines.push(line.unwrap_or("?").to_owned());
        }
        typed.is_over = count == 0;
        Ok(typed)
    }

    /// The person has ended a line, so the values stand further up now.
    fn typed(&mut self) {
        self.has_values = false;
        // The question, if it still stands, is asked again.
        self.asked = None;
    }

    /// Has this said at the next occasion.
    fn owe(&mut self, said: Said) {
        self.owed.push(said);
    }

    fn say(&mut self, said: &Said) -> Result<()> {
        if std::mem::take(&mut self.has_values) && self.is_terminal {
            console::print("")?;
        }
        self.asked = None;
        let text = said.text(self.language);
        match hint(said) {
            Some(command) => console::print(&format!("{text} (`{command}`)")),
            None => console::print(&text),
        }
    }

    /// Shows what is asked, and the values that belong to it.
    fn show(&mut self, question: Option<Question>, shown: &Said) -> Result<()> {
        for said in std::mem::take(&mut self.owed) {
            self.say(&said)?;
        }
        let since = match self.asked {
            Some((asked, since)) if asked == question => since,
            _ => {
                self.has_values = false;
                let since = Instant::now();
                self.asked = Some((question, since));
                if let Some(question) = question {
                    console::print(&question.text(self.language))?;
                }
                since
            }
        };
        let is_late = question.is_some() || since.elapsed() >= WORK;
        let values = shown.text(self.language);
        let values: String = values.chars().take(WIDTH).collect();
        if !self.has_values {
            if is_late {
                self.has_values = true;
                console::print(&format!("  {values}"))?;
                if self.is_terminal {
                    write!(io::stdout(), "> ")?;
                    io::stdout().flush()?;
                }
            }
        } else if self.is_terminal && self.rewritten.elapsed() >= REWRITE {
            self.rewritten = Instant::now();
            // Up one line, and back to where the person types.
            write!(io::stdout(), "\x1b7\x1b[A\r\x1b[K  {values}\x1b8")?;
            io::stdout().flush()?;
        }
        Ok(())
    }
}

/// The command that helps. The sentences name none, because a page has buttons.
fn hint(said: &Said) -> Option<&'static str> {
    Some(match said.cause() {
        "not_by_hand" => "lager mode manual",
        "stop_in_force" => "lager resume",
        "board_misfit" | "original_board" => "lager board update",
        "not_both_boards" | "undescribed" => "lager doctor",
        _ => return None,
    })
}

/// The language of the person's terminal.
fn language() -> Language {
    let names = ["LC_ALL", "LC_MESSAGES", "LANG"];
    let set = names.iter().filter_map(|name| std::env::var(name).ok());
    let chosen = set.into_iter().find(|value| !value.is_empty());
    match chosen.is_some_and(|name| name.starts_with("sv")) {
        true => Language::Swedish,
        false => Language::English,
    }
}
