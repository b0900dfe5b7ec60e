//! `lager gag`: a person at a terminal is the GaG of a station. It speaks only the document's
//! language.
//!
//! ```text
//!   the station asks        fetchprod        what is to be fetched? its number
//!   the person types        3                or `fetchprod 3`
//!   the station is told     fetchprod 3
//! ```
//! A line that the person types waits until the station asks for it, so a whole session may come
//! from a pipe. If a line is not an answer, this program refuses it, names the column, and does not
//! send it.
//!
//! A stop drops all commands that wait, and a `pickup_done` behind them (C5). This program sends a
//! stop at once, because a robot that turns or moves its arm asks for no commands. A station may
//! ignore what it has not asked for, so the stop is also the next answer.
//!
//! [`Desk`] is pure: lines in, lines out. The shell around it waits for the terminal and the
//! socket.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use lager_lines::conversation::Held;
use lager_lines::gag::{Answer, Query, Request, Telemetry};
use lager_lines::splitter::{LineError, LineSplitter};
use lager_lines::to_line;
use lager_supervisor::console;
use lager_supervisor::runtime_folder::RuntimeFolder;
use lager_wake::Shutdown;
use lager_wire::OperatorCommand;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::config::Config;

/// How often it checks for its end when nothing comes.
const GLANCE: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 100_000_000,
};
/// How many lines may wait until the station asks for them.
const MOST: usize = 32;

/// The state of a GaG: the open question, and the answers that wait.
#[derive(Debug, Default)]
struct Desk {
    held: Held,
    answers: VecDeque<Answer>,
    /// Lines for the station.
    said: Vec<String>,
    /// Lines for the person.
    told: Vec<String>,
}

impl Desk {
    /// The station has sent a line.
    fn heard(&mut self, line: &str) {
        match Request::read(line) {
            Ok(Request::Query(query)) => {
                // The station repeats its question to see that this program still reads.
                let is_again = self.held.get() == Some(query);
                self.held.ask(query);
                if !self.answer() && !is_again {
                    self.told.push(format!("{query}: {}", hint(query)));
                }
            }
            Ok(Request::Telemetry(telemetry)) => self.told.push(match telemetry {
                Telemetry::Thought(thought) => format!("\"{}\"", shown(thought.as_str())),
                Telemetry::Robot(node) => format!("the robot is at {node}"),
                Telemetry::Heading(heading) => format!("the robot looks {heading}"),
            }),
            Err(error) => self.told.push(format!("not understood: {line:?}: {error}")),
        }
    }

    /// The person has typed a line.
    fn typed(&mut self, line: &str) {
        let line = line.trim();
        if line.is_empty() {
            return;
        }
        let answer = match self.read(line) {
            Ok(answer) => answer,
            Err(why) => return self.told.push(why),
        };
        if answer == Answer::Command(OperatorCommand::Stop) {
            self.answers
                .retain(|waits| !matches!(waits, Answer::Command(_) | Answer::PickupDone));
            self.answers.push_front(answer.clone());
            if !self.answer() {
                self.say(&answer);
            }
            return;
        }
        if self.answers.len() < MOST {
            self.answers.push_back(answer);
        } else {
            let why = format!("{MOST} answers wait already; wait until some are asked for");
            return self.told.push(why);
        }
        if !self.answer() {
            self.told
                .push("it waits until the station asks for it".into());
        }
    }

    /// A whole answer, or the missing part of the answer to the open question.
    fn read(&self, line: &str) -> Result<Answer, String> {
        let whole = Answer::read(line);
        let starts = |query: &Query| line.split(' ').next() == Some(query.as_str());
        match self.held.get() {
            Some(query) if whole.is_err() && !starts(&query) => {
                let full = format!("{query} {line}");
                Answer::read(&full).map_err(|error| format!("{full:?}: {error}"))
            }
            _ => whole.map_err(|error| error.to_string()),
        }
    }

    /// Gives the first waiting answer that fits the open question. Returns whether there was one.
    fn answer(&mut self) -> bool {
        let Some(query) = self.held.get() else {
            return false;
        };
        let held = self.held;
        let fits = |answer: &Answer| held.clone().answer(answer).is_ok();
        let fits = self.answers.iter().position(fits);
        let Some(answer) = fits.and_then(|place| self.answers.remove(place)) else {
            return false;
        };
        self.held.clear();
        self.say(&answer.spelled_as(query));
        true
    }

    fn say(&mut self, answer: &Answer) {
        match to_line(answer) {
            Ok(line) => self.said.push(line),
            Err(error) => self.told.push(error.to_string()),
        }
    }
}

/// A text of the other side, without characters that control the terminal.
fn shown(text: &str) -> String {
    let mut shown = String::new();
    for character in text.chars() {
        match character.is_control() {
            true => shown.extend(character.escape_default()),
            false => shown.push(character),
        }
    }
    shown
}

/// What a person may answer.
const fn hint(query: Query) -> &'static str {
    match query {
        Query::SideLength => "how long is the side of a square? in cm",
        Query::Map => "how large is the warehouse, and where is it left? columns rows x y",
        Query::Products(_) => "which goods are there? how many, then number x y side of each",
        Query::Fetch => "what is to be fetched? its number",
        Query::Arm => "which step of the arm? F1 to FA, or `pickup_done`",
        Query::Wheels => "which command? 1 to 9, and 1 is stop",
    }
}

/// Runs it at `socket`, or at that of the robot's own station, or at that of `lager station`.
///
/// # Errors
/// There is no station, or it ends.
pub fn run(config: &Config, socket: Option<PathBuf>, shutdown: &Shutdown) -> Result<()> {
    let path = match socket {
        Some(path) => path,
        None => usual(config)?,
    };
    let stream = UnixStream::connect(&path).with_context(|| {
        let path = path.display();
        format!("no station listens at {path}; `lager up` or `lager station` starts one, and --socket names another")
    })?;
    console::print(&format!(
        "you are the GaG at {}; Ctrl-D ends it",
        path.display()
    ))?;
    converse(&path, stream, shutdown)
}

fn usual(config: &Config) -> Result<PathBuf> {
    if let Some(running) = config.of_running_robot()? {
        let own = running.station.gag.clone();
        let own = own.map_or_else(
            || running.bus().and_then(|bus| RuntimeFolder::gag(&bus)),
            Ok,
        )?;
        if own.exists() {
            return Ok(own);
        }
    }
    crate::station::default_gag(config)
}

fn converse(path: &Path, mut stream: UnixStream, shutdown: &Shutdown) -> Result<()> {
    let mut desk = Desk::default();
    let (mut from_station, mut from_person) = (LineSplitter::new(), LineSplitter::new());
    let mut is_listening = true;
    while !shutdown.is_requested() && (is_listening || !desk.answers.is_empty()) {
        let stdin = io::stdin();
        let mut sources = vec![PollFd::new(&stream, PollFlags::IN)];
        if is_listening {
            sources.push(PollFd::from_borrowed_fd(stdin.as_fd(), PollFlags::IN));
        }
        let _ = poll(&mut sources, Some(&GLANCE));
        let ready: Vec<bool> = (sources.iter())
            .map(|source| !source.revents().is_empty())
            .collect();
        if ready[0] {
            let heard = |line: Result<&str, LineError>| {
                desk.heard(line?);
                Ok(())
            };
            if !take(&mut stream, &mut from_station, heard)? {
                bail!(
                    "the station at {} has closed the connection; it has a GaG already, or has ended",
                    path.display()
                );
            }
        }
        if ready.get(1) == Some(&true) {
            // A person who has typed too much, or bytes that are not text, goes on driving.
            let typed = |line: Result<&str, LineError>| {
                match line {
                    Ok(line) => desk.typed(line),
                    Err(error) => desk.told.push(error.to_string()),
                }
                Ok(())
            };
            // Read the file itself: `poll` does not see what is in `Stdin`'s buffer.
            let mut stdin = std::fs::File::from(stdin.as_fd().try_clone_to_owned()?);
            is_listening = take(&mut stdin, &mut from_person, typed)?;
        }
        for line in desk.told.drain(..) {
            console::print(&line)?;
        }
        for line in desk.said.drain(..) {
            console::print(&format!("  > {}", line.trim_end()))?;
            stream
                .write_all(line.as_bytes())
                .with_context(|| format!("the station at {} has gone", path.display()))?;
        }
    }
    Ok(())
}

/// Takes the bytes that have come, line by line. Returns whether more may come.
fn take(
    from: &mut impl Read,
    splitter: &mut LineSplitter,
    mut each: impl FnMut(Result<&str, LineError>) -> Result<()>,
) -> Result<bool> {
    let mut buffer = [0; 4096];
    let count = from.read(&mut buffer)?;
    let mut bytes = &buffer[..count];
    while let Some(line) = splitter.next(&mut bytes) {
        each(line)?;
    }
    Ok(count > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(desk: &mut Desk) -> Vec<String> {
        desk.said.drain(..).collect()
    }

    #[test]
    fn what_is_asked_is_answered_in_full_or_in_short() {
        let mut desk = Desk::default();
        for (asked, typed, answer) in [
            ("sidelength", "40", "sidelength 40\n"),
            ("karta", "karta 2 2 0 0", "karta 2 2 0 0\n"),
            ("prodlist", "1 7 1 0 down", "prodlist 1 7 1 0 down\n"),
            ("prodlis", "prodlist 0", "prodlis 0\n"),
            ("fetchprod", "7", "fetchprod 7\n"),
            ("armcomm", "F3", "armcomm 11110011\n"),
            ("armcomm", "pickup_done", "pickup_done\n"),
            ("styrcomm", "2", "styrcomm 00000010\n"),
            ("styrcomm", "armcomm FA", "armcomm 11111010\n"),
        ] {
            desk.heard(asked);
            assert_eq!(said(&mut desk), [""; 0], "{asked}");
            desk.typed(typed);
            assert_eq!(said(&mut desk), [answer], "{asked}");
        }
    }

    #[test]
    fn what_is_typed_before_it_is_asked_for_waits_and_a_stop_goes_first() {
        let mut desk = Desk::default();
        for typed in ["armcomm F9", "fetchprod 7", "pickup_done", "styrcomm 4"] {
            desk.typed(typed);
        }
        assert_eq!(said(&mut desk), [""; 0]);
        desk.typed("styrcomm 1");
        let stop = ["styrcomm 00000001\n"];
        assert_eq!(said(&mut desk), stop, "though nobody asks");
        desk.heard("styrcomm");
        assert_eq!(said(&mut desk), stop, "it may have been passed over");
        desk.heard("armcomm");
        assert_eq!(said(&mut desk), [""; 0], "nothing old moves the robot");
        desk.heard("styrcomm");
        assert_eq!(said(&mut desk), [""; 0], "nothing old moves the robot");
        desk.heard("fetchprod");
        assert_eq!(said(&mut desk), ["fetchprod 7\n"]);
    }

    #[test]
    fn what_a_robot_thinks_does_not_steer_the_terminal() {
        let mut desk = Desk::default();
        desk.heard("thought jag \u{1b}[2Jväntar\u{9b}1m \t\u{7}");
        let told = "\"jag \\u{1b}[2Jväntar\\u{9b}1m \\t\\u{7}\"";
        assert_eq!(desk.told, [told]);
    }

    #[test]
    fn what_is_no_answer_is_not_sent_and_the_reason_is_told() {
        let mut desk = Desk::default();
        desk.heard("karta");
        for wrong in ["karta 0 0 0 0", "9 9 1 1", "hej", "karta 10000 1 0 0"] {
            desk.told.clear();
            desk.typed(wrong);
            assert!(desk.told[0].contains("column"), "{:?}", desk.told);
        }
        desk.typed("");
        assert!(desk.said.is_empty() && desk.answers.is_empty());
        for _ in 0..=MOST {
            desk.typed("fetchprod 1");
        }
        assert_eq!(desk.answers.len(), MOST);
    }
}
