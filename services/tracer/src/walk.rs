//! The way of a frame, backwards from its end: who could have brought it forward at each moment,
//! and what kept him.
//!
//! ```text
//!   sent                                                          answered
//!    | sender runs | kworker: woken .. runs | service: woken .. runs |
//!    |<-- followed back from wake to wake, from the last thread --<--|
//! ```
//!
//! A thread runs, or is ready and has no core, or sleeps until another thread or an interrupt wakes
//! it. From a sleep the way goes on with the thread that woke it. So the pieces of the way cover the
//! frame's whole time, once. This file is pure: events in, pieces out.

use std::collections::HashMap;

use crate::event::{Event, Left, Source, Thread, What};
use crate::timeline::Timeline;

/// An interrupt that comes late by less than this was kept up by the kernel's own short pauses.
const LATE_NS: u64 = 20_000;

/// One piece of a frame's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// When it begins, in ns.
    pub from_ns: u64,
    /// When it ends, in ns.
    pub to_ns: u64,
    /// The thread that had to bring the frame forward.
    pub thread: Thread,
    /// The core, if it had one.
    pub core: Option<usize>,
    /// What it did, or what kept it.
    pub doing: Doing,
}

/// What a thread did, or what kept it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Doing {
    /// It ran.
    Ran,
    /// It waited for memory that was not there.
    Fault,
    /// Its core worked for an interrupt.
    Interrupt(Source),
    /// Its core worked for a timer's interrupt, and called this function of the kernel.
    Timer(u64),
    /// It was ready, and its core ran this other thread.
    Behind(Thread),
    /// It was ready, and its core was still leaving this idle state.
    Wakes(Option<u32>),
    /// Its core did nothing at all, not even the interrupt that was due.
    Still,
    /// A signal had stopped it.
    Stopped,
    /// It slept until an interrupt or a timer of its own.
    Slept,
    /// It waited in the kernel, for a disk mostly.
    Blocked,
    /// The events do not say.
    Unknown,
}

impl Piece {
    /// How long it is, in ns.
    pub fn ns(&self) -> u64 {
        self.to_ns.saturating_sub(self.from_ns)
    }
}

/// The events around a frame.
#[derive(Debug)]
pub struct Window<'a> {
    line: &'a Timeline,
    events: Vec<Event>,
    to_ns: u64,
    lives: HashMap<Thread, Vec<Stay>>,
}

/// A time in which a thread stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stay {
    from_ns: u64,
    to_ns: u64,
    how: How,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum How {
    Runs {
        core: usize,
    },
    Ready {
        core: Option<usize>,
        /// Who woke it: `None` if it lost its core.
        woken: Option<Waker>,
    },
    Off {
        left: Left,
        /// Whether it had just touched memory that was not there.
        faulted: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waker {
    Thread(Thread),
    Interrupt,
}

impl<'a> Window<'a> {
    /// The events of `line` from one time to another.
    pub fn new(line: &'a Timeline, from_ns: u64, to_ns: u64) -> Self {
        Self {
            line,
            events: line.between(from_ns, to_ns),
            to_ns,
            lives: HashMap::new(),
        }
    }

    /// The events.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Which of these threads ran at that time.
    pub fn running(&mut self, threads: &[Thread], at_ns: u64) -> Vec<Thread> {
        let mut runs = |thread: &Thread| {
            let stay = self.stay(*thread, at_ns);
            stay.is_some_and(|stay| matches!(stay.how, How::Runs { .. }))
        };
        threads
            .iter()
            .filter(|thread| runs(thread))
            .copied()
            .collect()
    }

    /// The way of a frame that `thread` brought to its end at `to_ns`, back to `from_ns`; the pieces
    /// are in the order of time.
    pub fn way(&mut self, mut thread: Thread, from_ns: u64, to_ns: u64) -> Vec<Piece> {
        /// More turns than any frame's way has.
        const TURNS: usize = 10_000;
        let mut pieces = Vec::new();
        let mut at = to_ns;
        for _ in 0..TURNS {
            if at <= from_ns {
                break;
            }
            let Some(stay) = self.stay(thread, at) else {
                break;
            };
            let from = stay.from_ns.max(from_ns);
            let whole = |doing| Piece {
                from_ns: from,
                to_ns: at,
                thread,
                core: None,
                doing,
            };
            let before = match stay.how {
                How::Runs { core } => {
                    self.on_core(core, thread, true, from, at, &mut pieces);
                    stay.from_ns
                }
                How::Ready { core, woken } => {
                    match core {
                        Some(core) => self.on_core(core, thread, false, from, at, &mut pieces),
                        None => pieces.push(whole(Doing::Unknown)),
                    }
                    if let Some(waker) = woken.filter(|_| stay.from_ns > from_ns) {
                        self.slept(&mut thread, stay.from_ns, from_ns, waker, &mut pieces)
                    } else {
                        stay.from_ns
                    }
                }
                How::Off { left, faulted } => {
                    pieces.push(whole(kept(left, faulted)));
                    stay.from_ns
                }
            };
            at = before;
        }
        if at > from_ns {
            pieces.push(Piece {
                from_ns,
                to_ns: at,
                thread,
                core: None,
                doing: Doing::Unknown,
            });
        }
        pieces.sort_by_key(|piece| piece.from_ns);
        pieces.retain(|piece| piece.ns() > 0);
        pieces
    }

    /// `thread` was woken at `at`. Says when the way goes on; it goes on with the waker, if the sleep
    /// was a wait for him.
    fn slept(
        &mut self,
        thread: &mut Thread,
        at: u64,
        from_ns: u64,
        waker: Waker,
        pieces: &mut Vec<Piece>,
    ) -> u64 {
        let sleep = self.stay(*thread, at);
        let Some(sleep) = sleep else { return at };
        let How::Off { left, faulted } = sleep.how else {
            return at;
        };
        let doing = kept(left, faulted);
        match waker {
            Waker::Thread(other) if other != *thread && doing == Doing::Slept => {
                *thread = other;
                at
            }
            _ => {
                pieces.push(Piece {
                    from_ns: sleep.from_ns.max(from_ns),
                    to_ns: at,
                    thread: *thread,
                    core: None,
                    doing,
                });
                sleep.from_ns
            }
        }
    }

    /// How a thread stood just before that time.
    fn stay(&mut self, thread: Thread, at_ns: u64) -> Option<Stay> {
        let life = self.life(thread);
        let after = life.partition_point(|stay| stay.to_ns < at_ns);
        let stay = life.get(after).copied();
        stay.filter(|stay| stay.from_ns < at_ns)
    }

    /// All that a thread did in the window, without gaps.
    fn life(&mut self, thread: Thread) -> &[Stay] {
        let Self {
            lives,
            events,
            line,
            to_ns,
        } = self;
        lives
            .entry(thread)
            .or_insert_with(|| life(events, thread, line.stood(thread), *to_ns))
    }

    /// Pieces of a time in which `thread` ran on `core`, or was ready for it.
    fn on_core(
        &self,
        core: usize,
        thread: Thread,
        runs: bool,
        from_ns: u64,
        to_ns: u64,
        pieces: &mut Vec<Piece>,
    ) {
        let mut at = from_ns;
        let mut add = |from, to, doing| {
            if to > from {
                pieces.push(Piece {
                    from_ns: from,
                    to_ns: to,
                    thread,
                    core: Some(core),
                    doing,
                });
            }
        };
        let own = self.events.iter().filter(|event| event.core == core);
        let own: Vec<&Event> = own.take_while(|event| event.at_ns <= to_ns).collect();
        let (before, within) = own.split_at(own.partition_point(|event| event.at_ns <= from_ns));
        let mut state = OnCore {
            current: own.first().map_or(0, |event| event.thread),
            ..OnCore::default()
        };
        for event in before {
            state.see(event);
        }
        for (index, event) in within.iter().enumerate() {
            let doing = state.doing(thread, runs);
            // Before the interrupt of a timer that was due long ago, the core did not run.
            let late = late(&within[index..]).unwrap_or(0);
            let still = event.at_ns.saturating_sub(late).max(at);
            add(at, still, doing);
            add(
                still,
                event.at_ns,
                match doing {
                    Doing::Ran | Doing::Behind(_) => Doing::Still,
                    other => other,
                },
            );
            state.see(event);
            at = event.at_ns;
        }
        add(at, to_ns, state.doing(thread, runs));
    }
}

/// What kept a thread that was off its core.
fn kept(left: Left, faulted: bool) -> Doing {
    match left {
        Left::Stopped => Doing::Stopped,
        Left::Disk if faulted => Doing::Fault,
        Left::Disk => Doing::Blocked,
        Left::Asleep | Left::Ready => Doing::Slept,
    }
}

/// How late the interrupt is with which these events of one core begin, if it is that of a timer and
/// late.
fn late(events: &[&Event]) -> Option<u64> {
    let begins = |what| {
        matches!(
            what,
            What::Enter(Source::Vector("local_timer" | "irq_work"))
        )
    };
    events.first().filter(|event| begins(event.what))?;
    let first = events[1..].first()?;
    let What::Expired { now_ns, .. } = first.what else {
        return None;
    };
    Some(now_ns).filter(|late| *late > LATE_NS)
}

/// What a core does.
#[derive(Debug, Default)]
struct OnCore {
    current: Thread,
    interrupts: Vec<Source>,
    timer: Option<u64>,
    idle: Option<u32>,
    faulted: bool,
}

impl OnCore {
    fn see(&mut self, event: &Event) {
        self.current = event.thread;
        let faulted = std::mem::take(&mut self.faulted);
        match event.what {
            What::Switch { next, .. } => {
                self.current = next;
                // An interrupt does not switch: its end was missed.
                self.interrupts.clear();
            }
            What::Enter(source) => {
                self.interrupts.push(source);
                self.timer = None;
            }
            What::Exit(source) => {
                while self.interrupts.pop().is_some_and(|last| last != source) {}
                self.timer = None;
            }
            What::Expired { function, .. } => self.timer = Some(function),
            What::Idle(Some(state)) => self.idle = Some(state),
            What::Fault => self.faulted = true,
            What::Idle(None) | What::Waking(_) | What::Set { .. } | What::Marker(_) => {
                self.faulted = faulted;
            }
        }
    }

    /// What a thread does that runs on this core or is ready for it.
    fn doing(&self, thread: Thread, runs: bool) -> Doing {
        match (self.interrupts.last(), self.timer) {
            (Some(_), Some(function)) => Doing::Timer(function),
            (Some(source), None) => Doing::Interrupt(*source),
            (None, _) if runs && self.faulted => Doing::Fault,
            (None, _) if runs || self.current == thread => Doing::Ran,
            (None, _) if self.current == 0 => Doing::Wakes(self.idle),
            (None, _) => Doing::Behind(self.current),
        }
    }
}

/// All that a thread did, from its events.
fn life(events: &[Event], thread: Thread, stood: Option<Left>, to_ns: u64) -> Vec<Stay> {
    let mut stays: Vec<Stay> = Vec::new();
    let mut now: Option<How> = None;
    let mut since = 0;
    let mut faulted = false;
    // Who woke it while it still left its core.
    let mut early = None;
    for event in events {
        let (then, assumed) = match event.what {
            What::Fault if event.thread == thread => {
                faulted = true;
                continue;
            }
            What::Switch { next, .. } if next == thread => {
                let runs = How::Runs { core: event.core };
                (
                    runs,
                    How::Off {
                        left: stood.unwrap_or(Left::Asleep),
                        faulted: false,
                    },
                )
            }
            What::Switch { left, .. } if event.thread == thread => {
                let then = match left {
                    Left::Ready => How::Ready {
                        core: None,
                        woken: None,
                    },
                    left => How::Off { left, faulted },
                };
                (then, How::Runs { core: event.core })
            }
            What::Waking(woken) if woken == thread => {
                let woken = match event.in_interrupt || event.thread == 0 {
                    true => Waker::Interrupt,
                    false => Waker::Thread(event.thread),
                };
                // It does not fall asleep, or it is on its way off the core and comes back at once.
                if matches!(now, Some(How::Runs { .. } | How::Ready { .. })) {
                    early = Some(woken);
                    continue;
                }
                early = None;
                let then = How::Ready {
                    core: None,
                    woken: Some(woken),
                };
                (
                    then,
                    How::Off {
                        left: stood.unwrap_or(Left::Asleep),
                        faulted: false,
                    },
                )
            }
            _ => {
                // What it does after a fault, it does after the fault.
                let own = event.thread == thread && !event.in_interrupt;
                if own && matches!(event.what, What::Waking(_)) {
                    faulted = false;
                }
                continue;
            }
        };
        if !matches!(then, How::Off { .. }) {
            faulted = false;
        }
        let mut how = now.unwrap_or(assumed);
        if let (How::Off { .. }, How::Runs { .. }, Some(_)) = (how, then, early) {
            how = How::Ready {
                core: None,
                woken: early.take(),
            };
        }
        // Only now is it known for which core it was ready.
        if let (How::Ready { core, .. }, How::Runs { core: own }) = (&mut how, then) {
            *core = Some(own);
        }
        stays.push(Stay {
            from_ns: since,
            to_ns: event.at_ns,
            how,
        });
        (now, since) = (Some(then), event.at_ns);
    }
    let never = How::Off {
        left: stood.unwrap_or(Left::Asleep),
        faulted: false,
    };
    stays.push(Stay {
        from_ns: since,
        to_ns,
        how: now.unwrap_or(never),
    });
    stays
}

#[cfg(test)]
#[path = "walk_tests.rs"]
mod tests;
