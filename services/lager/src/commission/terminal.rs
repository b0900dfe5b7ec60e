//! The terminal of `lager commission`.
//!
//! ```text
//!   Distance sensor: hold something wide ... in cm, from 20 to 30      the question
//!     the distance sensor reads 189 of 1023                            rewritten while it waits
//!   > 30                                                               the answer
//! ```
//! Where the output is no terminal, the second line is printed once, so that a script can read and
//! answer.

use std::fs::File;
use std::io::{self, IsTerminal as _, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::time::{Duration, Instant};

use anyhow::Result;
use lager_commission::{Built, Question, Said, Takes};
use lager_lines::splitter::LineSplitter;
use lager_orders::Language;
use lager_supervisor::console;
use lager_wake::Shutdown;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::bench::Bench;
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

/// Until everything is said. The bus is used only under the watch.
pub fn converse(
    bench: &mut Bench,
    patience: &TimeLimit,
    shutdown: &Shutdown,
) -> Result<Option<Built>> {
    let mut page = Page::new();
    let mut splitter = LineSplitter::default();
    let mut is_leaving = false;
    loop {
        patience.watchdog.leave();
        let typed = read(&mut splitter)?;
        patience.watchdog.enter("waiting for the robot");
        bench.hear()?;
        // What was typed before its question was asked counts for nothing.
        if let [first, rest @ ..] = &typed.lines[..] {
            is_leaving |= page.take(bench, first, is_leaving);
            // A key that is held gives many empty lines.
            if rest.iter().any(|line| !line.trim().is_empty()) {
                page.owe("wait".into());
            }
        }
        if (typed.is_over || shutdown.is_requested()) && !is_leaving {
            is_leaving = true;
            bench.quit();
        }
        bench.act()?;
        for said in bench.said() {
            page.say(&said)?;
        }
        if bench.machine.is_over() {
            return Ok(bench.kept);
        }
        if !is_leaving {
            let shown = bench.machine.shown(bench.now().robot);
            page.show(bench.machine.question(), &shown)?;
        }
    }
}

/// What has been typed.
#[derive(Default)]
struct Typed {
    lines: Vec<String>,
    /// Nothing more can come.
    is_over: bool,
}

/// Waits a little for lines.
fn read(splitter: &mut LineSplitter) -> Result<Typed> {
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

    /// A line of the person. Returns whether it ends everything.
    fn take(&mut self, bench: &mut Bench, line: &str, is_leaving: bool) -> bool {
        let line = line.trim();
        let is_held = bench.takes() == Takes::Hold && line.is_empty();
        if !is_held {
            // The values stand further up now; the question, if it still stands, is asked again.
            self.has_values = false;
            self.asked = None;
        }
        if is_leaving || (line.is_empty() && !is_held) {
            return false;
        }
        if ["quit", "q", "exit", "sluta"].contains(&line.to_lowercase().as_str()) {
            bench.quit();
            return true;
        }
        if let Err(why) = bench.answer(line) {
            self.owe(why);
        }
        false
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
pub fn hint(said: &Said) -> Option<&'static str> {
    Some(match said.cause() {
        "not_by_hand" => "lager mode manual",
        "stop_in_force" => "lager resume",
        "board_misfit" | "original_board" => "lager board update",
        "not_both_boards" | "undescribed" => "lager doctor",
        "ended_kept" => "lager commission --restart`; to take it back, `lager commission --undo",
        "ended_undone" | "ended_undone_but" => "lager commission --restart",
        "ended_restarted" => "lager resume",
        _ => return None,
    })
}

/// The language of the person's terminal.
pub fn language() -> Language {
    let names = ["LC_ALL", "LC_MESSAGES", "LANG"];
    let set = names.iter().filter_map(|name| std::env::var(name).ok());
    let chosen = set.into_iter().find(|value| !value.is_empty());
    match chosen.is_some_and(|name| name.starts_with("sv")) {
        true => Language::Swedish,
        false => Language::English,
    }
}
