//! A commissioning for a page. comm starts it and carries its lines:
//!
//! ```text
//! < commission asked=3 step=line place=2 steps=8 question=ask_line_floor takes=yes moves=0 shows=…
//! > 81250000000 commission here                     when it was said, in ns of CLOCK_MONOTONIC
//! > 81250900000 commission answer 3 yes
//! < found 1 line found_polarity_low
//! < commission ended=ended_kept%20/var/lib/lager/r1/robot.toml
//! ```
//!
//! Nothing moves late: an answer that has waited here for longer than an order may is refused. A
//! movement goes on only while somebody says `here`. When nobody has said so for a while, the robot
//! is as it was before ([`Commissioning::rest`](lager_commission::Commissioning::rest)). When comm
//! ends, this ends, too.

use std::fs::File;
use std::io::Read as _;
use std::os::fd::AsFd as _;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::Result;
use lager_commission::{Answer, Built, Question, Results, Said, Step};
use lager_home::Clock;
use lager_lines::extension::{Commissioning, FoundOut, KeptLine, Order, Report};
use lager_lines::splitter::LineSplitter;
use lager_lines::{Name, Text, to_line};
use lager_orders::lease::{LATEST_MOVE, TooLate};
use lager_orders::{Action, Commission, Reason};
use lager_supervisor::console;
use lager_topics::ThoughtKind;
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::Robot;
use super::bench::Bench;
use crate::cli::CommissionArgs;
use crate::config::Config;
use crate::time_limit::TimeLimit;

/// How long it waits for a line between two looks at the bus.
const GLANCE: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 4_000_000,
};
/// How often values that change are told.
const RETELL: Duration = Duration::from_millis(200);
/// Without `here` for this long, a movement ends.
const HERE_MOVING: Duration = Duration::from_millis(500);
/// Without `here` for this long, nobody is there.
const HERE: Duration = Duration::from_secs(10);
/// Without `here` for this long, nobody comes back, and others may begin.
const ABANDONED: Duration = Duration::from_secs(600);

/// Does what `args` want. How it ends is told in any case.
pub fn run(configured: &Config, args: &CommissionArgs, shutdown: &Shutdown) -> Result<ExitCode> {
    let ended = match args.restart {
        true => super::restart(configured, shutdown),
        false => commission(configured, args.undo, shutdown),
    };
    let said = ended.unwrap_or_else(|error| Said::failed(&format!("{error:#}")));
    tell(&Report::Commission(Box::new(Commissioning {
        ended: Some(said.reason()),
        ..Commissioning::default()
    })))?;
    Ok(ExitCode::SUCCESS)
}

fn commission(configured: &Config, is_undo: bool, shutdown: &Shutdown) -> Result<Said> {
    // comm has the configuration of the robot that runs, with its description.
    let robot = Robot::new(&configured.undescribed()?)?;
    if is_undo {
        return robot.undo(shutdown);
    }
    let (mut bench, patience) = robot.bench(shutdown)?;
    let Some(built) = converse(&mut bench, &patience, shutdown)? else {
        return Ok(Said::nothing());
    };
    patience.watchdog.leave();
    let new = robot.with(&built);
    // A quarter of an hour's work must not be lost: it is told even if the disk refuses it.
    let text = new.described();
    let all: Vec<&str> = text.trim_end().lines().collect();
    for (number, line) in (1..).zip(&all) {
        tell(&Report::Kept(KeptLine {
            number,
            of: u32::try_from(all.len()).unwrap_or(u32::MAX),
            text: Text::new(*line)?,
        }))?;
    }
    let path = robot.keep(&new, &bench)?;
    patience.watchdog.enter("waiting for the robot");
    bench.settle(&built, ThoughtKind::SetUpAtPage);
    Ok(Said::kept(&path))
}

/// Until everything is said. The bus is used only under the watch.
fn converse(bench: &mut Bench, patience: &TimeLimit, shutdown: &Shutdown) -> Result<Option<Built>> {
    let mut page = Page::new();
    let mut splitter = LineSplitter::default();
    let mut is_leaving = false;
    loop {
        patience.watchdog.leave();
        let heard = read(&mut splitter)?;
        patience.watchdog.enter("waiting for the robot");
        bench.hear()?;
        for (given_ns, said) in heard.said {
            is_leaving |= page.take(bench, given_ns, said, is_leaving);
        }
        let is_over = heard.is_over || shutdown.is_requested() || page.is_abandoned();
        if is_over && !is_leaving {
            is_leaving = true;
            bench.quit();
        }
        page.look_who_is_there(bench);
        bench.act()?;
        page.look(bench);
        if bench.machine.is_over() {
            return Ok(bench.kept);
        }
        // After its reader has gone, nobody is told anything.
        if !is_leaving {
            page.show(bench)?;
        }
    }
}

/// What has come.
#[derive(Default)]
struct Heard {
    /// Each with the time at which it was given, in ns.
    said: Vec<(u64, Commission)>,
    /// Nothing more can come.
    is_over: bool,
}

/// Waits a little for lines.
fn read(splitter: &mut LineSplitter) -> Result<Heard> {
    let stdin = std::io::stdin();
    let mut source = [PollFd::new(&stdin, PollFlags::IN)];
    // If a signal cut it short, the caller looks why.
    let _ = poll(&mut source, Some(&GLANCE));
    let mut heard = Heard::default();
    if source[0].revents().is_empty() {
        return Ok(heard);
    }
    // The file itself: `poll` does not see what is in `Stdin`'s buffer.
    let mut file = File::from(stdin.as_fd().try_clone_to_owned()?);
    let mut buffer = [0; 1_024];
    let count = file.read(&mut buffer)?;
    let mut bytes = &buffer[..count];
    while let Some(line) = splitter.next(&mut bytes) {
        match line.ok().and_then(said) {
            Some(said) => heard.said.push(said),
            None => tracing::warn!("a line that is none of comm's"),
        }
    }
    heard.is_over = count == 0;
    Ok(heard)
}

/// What a line says, and when that was given.
fn said(line: &str) -> Option<(u64, Commission)> {
    let (given_ns, action) = line.split_once(' ')?;
    match Order::read(&format!("do 0 {action}"))?.ok()? {
        Order::Do {
            action: Action::Commission(said),
            ..
        } => Some((given_ns.parse().ok()?, said)),
        _ => None,
    }
}

/// The page, which is told what has changed.
struct Page {
    /// The number of what is asked, and what that is.
    asked: u32,
    question: Option<Question>,
    step: Step,
    results: Results,
    why: Option<Reason>,
    /// When somebody was there last.
    here: Instant,
    is_resting: bool,
    told: Option<Commissioning>,
    told_at: Option<Instant>,
    told_found: FoundOut,
}

impl Page {
    fn new() -> Self {
        Self {
            asked: 0,
            question: None,
            step: Step::Boards,
            results: Results::default(),
            why: None,
            here: Instant::now(),
            is_resting: false,
            told: None,
            told_at: None,
            told_found: FoundOut::default(),
        }
    }

    /// Takes what the person says. Returns whether it ends everything.
    fn take(&mut self, bench: &mut Bench, given_ns: u64, said: Commission, is_over: bool) -> bool {
        let late = Duration::from_nanos(Clock::monotonic_ns().saturating_sub(given_ns));
        match said {
            _ if is_over => {}
            Commission::Quit => {
                bench.quit();
                return true;
            }
            Commission::Stand => bench.stand(),
            Commission::Here if late <= LATEST_MOVE => self.is_here(),
            Commission::Answer { asked, word } if asked == self.asked => {
                if let Err(TooLate(late)) = TooLate::check(late, LATEST_MOVE) {
                    self.why = Some(TooLate(late).into());
                    return false;
                }
                self.is_here();
                if bench.answer_is_held(word.as_str()) {
                    return false;
                }
                // The next answer is one to what is asked then.
                self.asked += 1;
                self.why = None;
                let answer = bench.answer(word.as_str());
                self.look(bench);
                match answer {
                    Err(why) => self.why = Some(why.reason()),
                    Ok(Answer::Back | Answer::Again) => self.results.from(self.step),
                    Ok(_) => {}
                }
            }
            Commission::Here
            | Commission::Answer { .. }
            | Commission::Begin
            | Commission::Undo
            | Commission::Restart => {}
        }
        false
    }

    fn is_here(&mut self) {
        self.here = Instant::now();
        self.is_resting = false;
    }

    fn is_abandoned(&self) -> bool {
        self.here.elapsed() > ABANDONED
    }

    /// Ends what nobody looks at any more.
    fn look_who_is_there(&mut self, bench: &mut Bench) {
        let away = self.here.elapsed();
        if away > HERE_MOVING && bench.machine.moves() {
            bench.stand();
        }
        if away > HERE && !std::mem::replace(&mut self.is_resting, away > HERE) {
            bench.rest();
        }
    }

    /// Takes what the commissioning has said, and what it asks.
    fn look(&mut self, bench: &mut Bench) {
        let about = bench.machine.about();
        for said in bench.said() {
            // Another step may begin by it.
            if said.is_result() {
                self.results.found(self.step, said);
            } else if about.as_ref() != Some(&said) {
                if said.is_end() {
                    self.results.from(self.step);
                }
                self.why = Some(said.reason());
            }
        }
        self.step = bench.machine.step();
        let question = bench.machine.question();
        if question != self.question {
            self.asked += 1;
            self.question = question;
        }
    }

    /// Tells what has changed.
    fn show(&mut self, bench: &Bench) -> Result<()> {
        let machine = &bench.machine;
        let [place, steps] = machine.place();
        let now = Commissioning {
            asked: self.question.map(|_| self.asked),
            step: Name::new(machine.step().name()).ok(),
            place: Some(place),
            steps: Some(steps),
            question: self
                .question
                .and_then(|question| Name::new(question.name()).ok()),
            about: machine.about().map(|said| said.reason()),
            takes: self
                .question
                .and_then(|question| Name::new(question.takes().name()).ok()),
            moves: Some(machine.moves()),
            shows: Some(machine.shown(bench.now().robot).reason()),
            why: self.why.clone(),
            ended: None,
        };
        let found: Vec<_> = (self.results.all().iter())
            .filter_map(|(step, said)| Some((Name::new(step.name()).ok()?, said.reason())))
            .collect();
        let found = FoundOut::new(&found);
        if found != self.told_found {
            tell(&Report::Found(found.clone()))?;
            self.told_found = found;
        }
        // Values change all the time, and all else is told at once.
        let but_values = |of: &Commissioning| Commissioning {
            shows: None,
            ..of.clone()
        };
        let is_news = self.told.as_ref().map(but_values) != Some(but_values(&now));
        let is_due = self.told_at.is_none_or(|at| at.elapsed() >= RETELL);
        if is_news || is_due && self.told.as_ref() != Some(&now) {
            tell(&Report::Commission(Box::new(now.clone())))?;
            self.told = Some(now);
            self.told_at = Some(Instant::now());
        }
        Ok(())
    }
}

/// Says a line to comm.
fn tell(report: &Report) -> Result<()> {
    match to_line(report) {
        Ok(line) => console::print(line.trim_end()),
        Err(error) => {
            tracing::error!("{error}");
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_comm_says_when_it_was_given() {
        let (given_ns, said) = said("81250 commission answer 3 yes").expect("a line");
        assert_eq!(given_ns, 81_250);
        assert!(matches!(said, Commission::Answer { asked: 3, word } if word.as_str() == "yes"));
        for wrong in ["commission here", "7 reset", "x commission here", ""] {
            assert_eq!(super::said(wrong), None, "{wrong}");
        }
    }
}
