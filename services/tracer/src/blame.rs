//! Whose fault a late frame is: the verdict on each, from the pieces of its way.
//!
//! A frame in time has the same pieces as a late one, only shorter. So the verdict is the cause that
//! took the most time **beyond what it takes in the median frame** of the same measurement. A frame
//! of whose time events are missing has no verdict. This file is pure.

use std::collections::{BTreeMap, HashMap};

use crate::chrome::{self, Picture};
use crate::event::{Event, Thread};
use crate::frame::{Cause, Frame, Machine, Staged, Who};
use crate::report::{Report, Verdict};
use crate::timeline::Timeline;
use crate::walk::{Doing, Piece, Window};

/// Before a frame: who ran must be known.
const BEFORE_NS: u64 = 20_000_000;
/// Behind a frame.
const AFTER_NS: u64 = 1_000_000;
/// Frames in time of which the median is taken.
const USUAL: usize = 2_000;
/// With fewer frames in time nothing is called usual.
const ENOUGH: usize = 20;
/// Late frames that are drawn: the latest.
const DRAWN: usize = 50;

/// Explains frames.
#[derive(Debug)]
pub struct Explainer {
    /// The events.
    pub line: Timeline,
    machine: Machine,
    /// A frame that takes longer is late, in ns.
    limit_ns: u64,
    processes: HashMap<u32, (String, Vec<Thread>)>,
    /// Which thread of a process was at the end of a stage, and how often.
    seen: HashMap<&'static str, HashMap<Thread, u64>>,
    usual: Vec<BTreeMap<Cause, u64>>,
    late: Vec<Late>,
    drawn: Vec<Picture>,
    frames: u64,
}

/// A late frame.
#[derive(Debug)]
struct Late {
    number: u64,
    start_ns: u64,
    took_ns: u64,
    pieces: Vec<Staged>,
    missing: Option<String>,
}

impl Explainer {
    /// Frames that take longer than this are late, in ns.
    pub fn new(limit_ns: u64, machine: Machine) -> Self {
        Self {
            line: Timeline::default(),
            machine,
            limit_ns,
            processes: HashMap::new(),
            seen: HashMap::new(),
            usual: Vec::new(),
            late: Vec::new(),
            drawn: Vec::new(),
            frames: 0,
        }
    }

    /// These are the threads of a process of the robot.
    pub fn knows(&mut self, process: u32, name: &str, threads: Vec<Thread>) {
        self.processes.insert(process, (name.to_owned(), threads));
    }

    /// How long a frame takes that is in time, at most, in ns.
    pub fn limit_ns(&self) -> u64 {
        self.limit_ns
    }

    /// Takes a frame of whose time all events are there.
    pub fn frame(&mut self, frame: &Frame) {
        self.frames += 1;
        let (start_ns, end_ns) = (frame.start_ns, frame.end_ns());
        let took_ns = end_ns.saturating_sub(start_ns);
        let is_late = took_ns > self.limit_ns;
        if !is_late && self.usual.len() >= USUAL {
            return;
        }
        let hole = self.line.hole_in(start_ns, end_ns);
        if !is_late && hole.is_some() {
            return;
        }
        let mut window = Window::new(
            &self.line,
            start_ns.saturating_sub(BEFORE_NS),
            end_ns + AFTER_NS,
        );
        let mut pieces = Vec::new();
        let mut from_ns = start_ns;
        for mark in &frame.marks {
            let thread = match mark.by {
                Who::Thread(thread) => Some(thread),
                Who::Process(process) => {
                    let threads = self.processes.get(&process);
                    let threads = threads.map_or(&[][..], |(_, threads)| threads);
                    let running = window.running(threads, mark.at_ns);
                    let seen = self.seen.entry(mark.stage).or_default();
                    if let [only] = running[..] {
                        *seen.entry(only).or_default() += 1;
                    }
                    let often = |thread: &Thread| seen.get(thread).copied().unwrap_or(0);
                    running.into_iter().max_by_key(often)
                }
            };
            let way = match thread {
                Some(thread) => window.way(thread, from_ns, mark.at_ns),
                None => vec![Piece {
                    from_ns,
                    to_ns: mark.at_ns,
                    thread: 0,
                    core: None,
                    doing: Doing::Unknown,
                }],
            };
            let stage = mark.stage;
            pieces.extend(way.into_iter().map(|piece| Staged { stage, piece }));
            from_ns = mark.at_ns.max(from_ns);
        }
        let missing = hole.map(|hole| {
            let took = hole.to_ns.saturating_sub(hole.from_ns) / 1_000;
            format!("events of {took} us were lost on core {}", hole.core)
        });
        if !is_late {
            let sums = self.sums(&pieces);
            self.usual.push(sums);
            return;
        }
        let around: Vec<Event> = window
            .events()
            .iter()
            .copied()
            .filter(|event| event.at_ns + AFTER_NS >= start_ns)
            .collect();
        self.draw(frame, took_ns, around, &pieces);
        self.late.push(Late {
            number: frame.number,
            start_ns,
            took_ns,
            pieces,
            missing,
        });
    }

    /// Keeps the picture of a late frame, if it is among the latest.
    fn draw(&mut self, frame: &Frame, took_ns: u64, events: Vec<Event>, pieces: &[Staged]) {
        if self.drawn.len() == DRAWN {
            let least = (0..DRAWN).min_by_key(|index| self.drawn[*index].took_ns);
            match least {
                Some(least) if self.drawn[least].took_ns < took_ns => {
                    self.drawn.swap_remove(least);
                }
                _ => return,
            }
        }
        self.drawn.push(Picture {
            frame: frame.clone(),
            took_ns,
            events,
            pieces: pieces.to_vec(),
        });
    }

    /// Which cause a piece belongs to.
    fn cause(&self, piece: &Piece) -> Cause {
        let own = self
            .processes
            .values()
            .any(|(_, threads)| threads.contains(&piece.thread));
        let worker = self.line.name(piece.thread).starts_with("kworker");
        match piece.doing {
            Doing::Interrupt(_) | Doing::Timer(_) => Cause::Interrupt,
            Doing::Fault => Cause::PageFault,
            Doing::Still => Cause::Hypervisor,
            Doing::Wakes(state) => {
                let usual = self.machine.idle_usual_ns;
                let own = state.and_then(|state| self.machine.idle_ns.get(&state));
                let longest = own.map_or(usual, |own| (own * 3).max(usual / 4));
                if piece.ns() > longest {
                    Cause::Hypervisor
                } else {
                    Cause::Sleep
                }
            }
            Doing::Stopped => Cause::Stopped,
            Doing::Unknown => Cause::Unknown,
            Doing::Behind(_) | Doing::Ran | Doing::Slept | Doing::Blocked if worker => {
                Cause::SerialWorker
            }
            Doing::Behind(_) => Cause::RunQueue,
            Doing::Ran if own => Cause::OwnCode,
            Doing::Slept | Doing::Blocked if own => Cause::Waited,
            Doing::Ran | Doing::Slept | Doing::Blocked => Cause::OtherProgram,
        }
    }

    /// The time of each cause, in ns.
    fn sums(&self, pieces: &[Staged]) -> BTreeMap<Cause, u64> {
        let mut sums = BTreeMap::new();
        for staged in pieces {
            *sums.entry(self.cause(&staged.piece)).or_default() += staged.piece.ns();
        }
        sums
    }

    /// What happened, beside the cause's name.
    fn detail(&self, cause: Cause, piece: &Piece) -> String {
        let line = &self.line;
        let name = || line.name(piece.thread);
        match (cause, piece.doing) {
            (_, Doing::Interrupt(source)) => line.source(source),
            (_, Doing::Timer(function)) => match line.functions.get(&function) {
                Some(name) => format!("timer {name}"),
                None => "timers".to_owned(),
            },
            (Cause::SerialWorker, Doing::Behind(other)) => {
                format!("waited behind {}", line.name(other))
            }
            (Cause::SerialWorker, Doing::Ran) => "ran".to_owned(),
            (Cause::SerialWorker, _) => "was not woken".to_owned(),
            (_, Doing::Behind(other)) => format!("behind {}", line.name(other)),
            (_, Doing::Wakes(Some(state))) => format!("idle state {state}"),
            (_, Doing::Wakes(None)) => "idle".to_owned(),
            (_, Doing::Blocked) => format!("{} in the kernel", name()),
            (Cause::Unknown, _) => "no thread of the robot was there".to_owned(),
            _ => name(),
        }
    }

    /// The medians of the frames in time, in ns.
    fn usual(&self) -> BTreeMap<Cause, u64> {
        let mut usual = BTreeMap::new();
        if self.usual.len() < ENOUGH {
            return usual;
        }
        for cause in Cause::ALL {
            let of = |sums: &BTreeMap<Cause, u64>| sums.get(&cause).copied().unwrap_or(0);
            let mut all: Vec<u64> = self.usual.iter().map(of).collect();
            let middle = all.len() / 2;
            let median = *all.select_nth_unstable(middle).1;
            if median > 0 {
                usual.insert(cause, median);
            }
        }
        usual
    }

    fn verdict(&self, late: &Late, usual: &BTreeMap<Cause, u64>) -> Verdict {
        let mut verdict = Verdict {
            number: late.number,
            start_ns: late.start_ns,
            took_ns: late.took_ns,
            cause: Cause::Unknown,
            beyond_ns: 0,
            detail: String::new(),
            stage: "",
            thread: String::new(),
            core: None,
        };
        if let Some(missing) = &late.missing {
            verdict.detail.clone_from(missing);
            return verdict;
        }
        let beyond = self.sums(&late.pieces).into_iter().map(|(cause, ns)| {
            let usual = usual.get(&cause).copied().unwrap_or(0);
            (ns.saturating_sub(usual), cause)
        });
        let Some((beyond_ns, cause)) = beyond.max() else {
            "it has no time".clone_into(&mut verdict.detail);
            return verdict;
        };
        // The kind that took most of it, by its name.
        let mut kinds: HashMap<String, (u64, u64, Staged)> = HashMap::new();
        for staged in &late.pieces {
            let piece = &staged.piece;
            if self.cause(piece) == cause {
                let kind = kinds
                    .entry(self.detail(cause, piece))
                    .or_insert((0, 0, *staged));
                kind.0 += piece.ns();
                if piece.ns() > kind.1 {
                    (kind.1, kind.2) = (piece.ns(), *staged);
                }
            }
        }
        let most = kinds.into_iter().max_by_key(|(_, (ns, ..))| *ns);
        if let Some((detail, (.., staged))) = most {
            verdict.detail = detail;
            verdict.stage = staged.stage;
            verdict.thread = self.line.name(staged.piece.thread);
            verdict.core = staged.piece.core;
        }
        Verdict {
            cause,
            beyond_ns,
            ..verdict
        }
    }

    /// The verdicts on all late frames so far.
    pub fn report(&self) -> Report {
        let usual = self.usual();
        let late = self.late.iter().map(|late| self.verdict(late, &usual));
        Report::new(
            self.frames,
            self.limit_ns,
            usual.clone(),
            late.collect(),
            self.line.holes(),
        )
    }

    /// The latest late frames, for one file that Perfetto opens.
    pub fn chrome(&self, report: &Report) -> String {
        chrome::draw(&self.line, &self.drawn, report, |piece| {
            let cause = self.cause(piece);
            format!("{}: {}", cause.name(), self.detail(cause, piece))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{Left, What};
    use crate::frame::Mark;

    const ROBOT: Thread = 10;
    const HOG: Thread = 30;

    fn switch(at_ns: u64, from: Thread, left: Left, next: Thread) -> Event {
        let name = |thread: Thread| match thread {
            HOG => *b"hog\0\0\0\0\0\0\0\0\0\0\0\0\0",
            ROBOT => *b"robot\0\0\0\0\0\0\0\0\0\0\0",
            _ => [0; 16],
        };
        let names = [name(from), name(next)];
        Event {
            at_ns,
            core: 0,
            thread: from,
            in_interrupt: false,
            what: What::Switch { left, next, names },
        }
    }

    /// Thirty frames that take 30 us each, and one in which a hog has the core for 500 us.
    fn explained(lost: bool) -> Report {
        let mut explainer = Explainer::new(200_000, Machine::default());
        explainer.knows(1, "robot", vec![ROBOT]);
        let start = |number: u64| 100_000_000 + number * 1_000_000;
        let line = &mut explainer.line;
        line.push(switch(1, 0, Left::Ready, ROBOT));
        for number in 0..31 {
            if number == 20 {
                line.push(switch(start(20) + 10_000, ROBOT, Left::Ready, HOG));
                if lost {
                    line.hole(0, start(20) + 400_000);
                }
                line.push(switch(start(20) + 510_000, HOG, Left::Asleep, ROBOT));
            }
        }
        for number in 0..31 {
            let took = if number == 20 { 530_000 } else { 30_000 };
            explainer.frame(&Frame {
                number,
                start_ns: start(number),
                marks: vec![Mark {
                    stage: "decides",
                    at_ns: start(number) + took,
                    by: Who::Process(1),
                }],
            });
        }
        explainer.report()
    }

    #[test]
    fn the_verdict_is_what_took_longer_than_usual() {
        let report = explained(false);
        assert_eq!((report.frames, report.late.len()), (31, 1));
        assert_eq!(report.usual_ns[&Cause::OwnCode], 30_000);
        let verdict = &report.late[0];
        assert_eq!((verdict.number, verdict.cause), (20, Cause::RunQueue));
        assert_eq!(verdict.beyond_ns, 500_000);
        assert_eq!(verdict.detail, "behind hog");
        assert_eq!(
            (verdict.stage, verdict.thread.as_str()),
            ("decides", "robot")
        );
        let said = report.to_string();
        assert!(
            said.contains("1 of 31 frames took longer than 200.0 us"),
            "{said}"
        );
        assert!(
            said.contains("run queue: behind hog (decides: robot)"),
            "{said}"
        );
    }

    #[test]
    fn a_frame_of_whose_time_events_are_missing_has_no_verdict() {
        let report = explained(true);
        let verdict = &report.late[0];
        assert_eq!(verdict.cause, Cause::Unknown);
        assert!(verdict.detail.contains("lost on core 0"), "{verdict:?}");
        assert_eq!((report.holes, report.count(Cause::Unknown)), (1, 1));
        assert!(report.to_string().contains("left out events 1 times"));
    }

    #[test]
    fn the_picture_has_the_frame_the_cores_and_the_way() {
        let mut explainer = Explainer::new(1_000, Machine::default());
        explainer.knows(1, "robot", vec![ROBOT]);
        explainer.line.push(switch(1_000, 0, Left::Ready, ROBOT));
        explainer.line.push(switch(3_000, ROBOT, Left::Ready, HOG));
        explainer.line.push(switch(9_000, HOG, Left::Ready, ROBOT));
        explainer.frame(&Frame {
            number: 7,
            start_ns: 2_000,
            marks: vec![Mark {
                stage: "decides",
                at_ns: 9_500,
                by: Who::Thread(ROBOT),
            }],
        });
        let text = explainer.chrome(&explainer.report());
        let drawn: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let names: Vec<&str> = drawn["traceEvents"]
            .as_array()
            .expect("a list")
            .iter()
            .filter(|event| event["ph"] == "X")
            .filter_map(|event| event["name"].as_str())
            .collect();
        for name in [
            "frame 7",
            "decides",
            "run queue: behind hog",
            "hog",
            "robot",
        ] {
            assert!(names.contains(&name), "{name}: {names:?}");
        }
    }
}
