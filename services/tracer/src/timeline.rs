//! The events of all cores, in the order of time, with the holes in them.
//!
//! It keeps what frames that are still to be explained may need, and forgets the rest. It reads no
//! clock: whoever fills it says up to when it is whole.

use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};

use crate::event::{Event, Left, Name, Source, Thread, What, text};

/// Events that the kernel left out on one core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hole {
    /// The core.
    pub core: usize,
    /// The last event before it, in ns.
    pub from_ns: u64,
    /// The first event after it, in ns.
    pub to_ns: u64,
}

/// The events of all cores.
#[derive(Debug, Default)]
pub struct Timeline {
    cores: Vec<Core>,
    holes: Vec<Hole>,
    all_holes: u64,
    names: HashMap<Thread, Name>,
    /// How each thread stood when the oldest kept event came.
    stood: HashMap<Thread, Left>,
    /// The names of devices, by the number of their line.
    pub lines: HashMap<u32, String>,
    /// The names of the kernel's functions that expired timers call.
    pub functions: HashMap<u64, String>,
    called: HashSet<u64>,
}

#[derive(Debug, Default)]
struct Core {
    events: VecDeque<Event>,
    /// The last change of thread that was forgotten.
    before: Option<Event>,
    last_ns: u64,
    /// A timer's due time on its own clock, from when it is set until it expires.
    timers: BTreeMap<u64, u64>,
}

impl Timeline {
    fn core(&mut self, core: usize) -> &mut Core {
        if self.cores.len() <= core {
            self.cores.resize_with(core + 1, Core::default);
        }
        &mut self.cores[core]
    }

    /// Adds an event. Those of one core come in the order of time.
    pub fn push(&mut self, mut event: Event) {
        if let What::Switch { next, names, .. } = &event.what {
            self.names.insert(event.thread, names[0]);
            self.names.insert(*next, names[1]);
        }
        self.core(event.core);
        let (core, called) = (&mut self.cores[event.core], &mut self.called);
        match &mut event.what {
            What::Set { timer, due_ns } => {
                core.timers.insert(*timer, *due_ns);
                return;
            }
            // From here on it says by how much it came too late.
            What::Expired {
                timer,
                now_ns,
                function,
            } => {
                called.insert(*function);
                let due = core.timers.remove(timer);
                *now_ns = due.map_or(0, |due| now_ns.saturating_sub(due));
            }
            _ => {}
        }
        // Two events of one core may come within a nanosecond.
        event.at_ns = event.at_ns.max(core.last_ns);
        core.last_ns = event.at_ns;
        core.events.push_back(event);
    }

    /// The kernel left out events of `core` before `to_ns`.
    pub fn hole(&mut self, core: usize, to_ns: u64) {
        let own = self.core(core);
        let from_ns = own.last_ns;
        own.timers.clear();
        let to_ns = to_ns.max(from_ns);
        self.all_holes += 1;
        self.holes.push(Hole {
            core,
            from_ns,
            to_ns,
        });
    }

    /// The kernel's functions that expired timers called.
    pub fn called(&self) -> impl Iterator<Item = u64> {
        self.called.iter().copied()
    }

    /// How often the kernel left out events so far.
    pub fn holes(&self) -> u64 {
        self.all_holes
    }

    /// A hole that overlaps this time.
    pub fn hole_in(&self, from_ns: u64, to_ns: u64) -> Option<Hole> {
        let overlaps = |hole: &&Hole| hole.from_ns <= to_ns && hole.to_ns >= from_ns;
        self.holes.iter().find(overlaps).copied()
    }

    /// Forgets what came before this time.
    pub fn forget_before(&mut self, ns: u64) {
        let Self { cores, stood, .. } = self;
        let mut gone = Vec::new();
        for core in cores {
            while core.events.front().is_some_and(|event| event.at_ns < ns) {
                let event = core.events.pop_front();
                if event.is_some_and(|event| matches!(event.what, What::Switch { .. })) {
                    core.before = event;
                }
                gone.extend(event);
            }
        }
        gone.sort_by_key(|event| event.at_ns);
        for event in gone {
            match event.what {
                What::Switch { left, next, .. } => {
                    stood.insert(event.thread, left);
                    stood.insert(next, Left::Ready);
                }
                What::Waking(thread) => {
                    stood.insert(thread, Left::Ready);
                }
                _ => {}
            }
        }
        self.holes.retain(|hole| hole.to_ns >= ns);
    }

    /// The events from one time to another, in their order, and before them the last change of
    /// thread on each core, however long ago it was.
    pub fn between(&self, from_ns: u64, to_ns: u64) -> Vec<Event> {
        let mut all = Vec::new();
        for core in &self.cores {
            let first = core.events.partition_point(|event| event.at_ns < from_ns);
            let is_switch = |event: &&Event| matches!(event.what, What::Switch { .. });
            let earlier = core.events.range(..first).rev();
            let last = earlier.copied().find(|event| is_switch(&event));
            all.extend(last.or(core.before));
            let events = core.events.range(first..);
            all.extend(events.take_while(|event| event.at_ns <= to_ns));
        }
        all.sort_by_key(|event: &Event| event.at_ns);
        all
    }

    /// How a thread stood before the oldest kept event.
    pub(crate) fn stood(&self, thread: Thread) -> Option<Left> {
        self.stood.get(&thread).copied()
    }

    /// A thread's name.
    pub fn name(&self, thread: Thread) -> String {
        match self.names.get(&thread) {
            _ if thread == 0 => "idle".to_owned(),
            Some(name) => text(name),
            None => format!("thread {thread}"),
        }
    }

    /// What an interrupt is called.
    pub fn source(&self, source: Source) -> String {
        match source {
            Source::Vector(name) => name.replace('_', " "),
            Source::Soft(number) => match crate::event::SOFT.get(number as usize) {
                Some(name) => format!("softirq {name}"),
                None => format!("softirq {number}"),
            },
            Source::Line(line) => match self.lines.get(&line) {
                Some(name) => format!("irq {line} {name}"),
                None => format!("irq {line}"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(at_ns: u64, core: usize, what: What) -> Event {
        Event {
            at_ns,
            core,
            thread: 7,
            in_interrupt: false,
            what,
        }
    }

    #[test]
    fn events_of_all_cores_come_in_the_order_of_time() {
        let mut line = Timeline::default();
        for (at, core) in [(1, 0), (5, 0), (9, 0), (2, 1), (6, 1), (6, 2)] {
            line.push(event(at, core, What::Fault));
        }
        let times = |from, to| -> Vec<u64> {
            let events = line.between(from, to);
            events.iter().map(|event| event.at_ns).collect()
        };
        assert_eq!(times(0, 100), [1, 2, 5, 6, 6, 9]);
        assert_eq!(times(2, 6), [2, 5, 6, 6]);
    }

    #[test]
    fn a_hole_reaches_from_the_last_event_to_the_first_after_it() {
        let mut line = Timeline::default();
        line.push(event(5, 1, What::Fault));
        line.hole(1, 50);
        line.push(event(50, 1, What::Fault));
        let hole = Hole {
            core: 1,
            from_ns: 5,
            to_ns: 50,
        };
        assert_eq!(line.hole_in(20, 30), Some(hole));
        assert_eq!(line.hole_in(0, 5), Some(hole));
        assert_eq!([line.hole_in(0, 4), line.hole_in(51, 60)], [None, None]);
        line.forget_before(60);
        assert_eq!((line.hole_in(20, 30), line.holes()), (None, 1));
        assert_eq!(line.between(0, 100), []);
    }

    #[test]
    fn an_expired_timer_says_how_late_it_is() {
        let mut line = Timeline::default();
        let set = |due_ns| What::Set { timer: 3, due_ns };
        let expired = |now_ns| What::Expired {
            timer: 3,
            function: 0,
            now_ns,
        };
        for what in [set(100), set(200), expired(250), expired(900)] {
            line.push(event(1, 0, what));
        }
        let late = line
            .between(0, 9)
            .iter()
            .map(|event| event.what)
            .collect::<Vec<_>>();
        assert_eq!(late, [expired(50), expired(0)], "by its last setting, once");
    }

    #[test]
    fn what_is_forgotten_still_says_how_threads_stand() {
        let mut line = Timeline::default();
        let to = |left, next| What::Switch {
            left,
            next,
            names: [*b"seven\0\0\0\0\0\0\0\0\0\0\0", [0; 16]],
        };
        line.push(event(1, 0, to(Left::Stopped, 8)));
        line.push(event(9, 0, What::Fault));
        line.forget_before(5);
        assert_eq!(line.stood(7), Some(Left::Stopped));
        assert_eq!(line.stood(8), Some(Left::Ready));
        assert_eq!(line.stood(9), None);
        assert_eq!([line.name(7), line.name(9)], ["seven", "thread 9"]);
    }
}
