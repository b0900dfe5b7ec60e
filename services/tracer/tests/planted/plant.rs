//! What keeps a frame: a hog, an evicted page, a stopped service, a burst of timers.

use std::os::fd::OwnedFd;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_rig::schedule::{RealTime, pin};
use lager_rig::timespec;
use lager_tracer::{Cause, Verdict};
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, kill_process, setrlimit};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, timerfd_create, timerfd_settime,
};

use crate::service::{PAGES, Service};

/// How long a plant holds a frame up.
const HELD: Duration = Duration::from_millis(3);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A thread of a higher class takes the service's core.
    Hog,
    /// The service's pages are not in memory.
    EvictedPage,
    /// A signal has stopped the service.
    Frozen,
    /// Many timers of the service's core expire at once.
    Timers,
}

/// A cause that can be planted.
pub(crate) struct Plant {
    kind: Kind,
    /// To begin, and it has begun or ended.
    helper: Option<(SyncSender<()>, Receiver<()>)>,
}

impl std::fmt::Debug for Plant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.kind)
    }
}

impl PartialEq for Plant {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

impl Plant {
    pub(crate) fn all([own, core]: [usize; 2], service: u32) -> [Self; 4] {
        let service = Pid::from_raw(service.cast_signed()).expect("a process");
        let of = |kind, helper| Self { kind, helper };
        [
            of(
                Kind::Hog,
                Some(helper("hog", move |began| hog(core, began))),
            ),
            of(Kind::EvictedPage, None),
            of(
                Kind::Frozen,
                Some(helper("freezer", move |began| freeze(service, began))),
            ),
            of(Kind::Timers, Some(timers(own, core))),
        ]
    }

    /// Does what has to be done before the frame; so many pages the frame shall touch.
    pub(crate) fn prepare(&self, service: &mut Service) -> usize {
        if self.kind != Kind::EvictedPage {
            return 0;
        }
        service.evict();
        PAGES
    }

    /// Begins to hold up.
    pub(crate) fn begin(&self) {
        if let Some((begin, done)) = &self.helper {
            begin.send(()).expect("it lives");
            done.recv().expect("it lives");
        }
    }

    /// Waits until it no longer holds up.
    pub(crate) fn end(&self) {
        if let Some((_, done)) = &self.helper {
            done.recv().expect("it lives");
        }
    }

    pub(crate) fn is_named_by(&self, verdict: &Verdict) -> bool {
        match self.kind {
            Kind::Hog => verdict.cause == Cause::RunQueue && verdict.detail == "behind hog",
            Kind::EvictedPage => verdict.cause == Cause::PageFault,
            Kind::Frozen => verdict.cause == Cause::Stopped,
            Kind::Timers => {
                let timers = ["timer", "local timer"];
                let named = timers.iter().any(|name| verdict.detail.starts_with(name));
                verdict.cause == Cause::Interrupt && named
            }
        }
    }
}

/// A thread that holds up once whenever it is asked to. `work` calls its argument when it has begun.
fn helper(name: &str, work: impl Fn(&dyn Fn()) + Send + 'static) -> (SyncSender<()>, Receiver<()>) {
    let (begin, begun) = sync_channel(0);
    let (tell, told) = sync_channel(2);
    let run = move || {
        while begun.recv().is_ok() {
            work(&|| tell.send(()).expect("somebody waits"));
            tell.send(()).expect("somebody waits");
        }
    };
    Builder::new()
        .name(name.to_owned())
        .spawn(run)
        .expect("a thread");
    (begin, told)
}

fn hog(core: usize, began: &dyn Fn()) {
    pin(core).expect("a core");
    let _urgent = RealTime::begin(50).expect("the right to real time");
    began();
    let start = Instant::now();
    while start.elapsed() < HELD {
        std::hint::spin_loop();
    }
}

fn freeze(service: Pid, began: &dyn Fn()) {
    kill_process(service, Signal::STOP).expect("it runs");
    let stat = format!("/proc/{}/stat", service.as_raw_nonzero());
    let stopped = || {
        std::fs::read_to_string(&stat)
            .expect("it runs")
            .contains(") T ")
    };
    while !stopped() {
        std::thread::yield_now();
    }
    began();
    std::thread::sleep(HELD);
    kill_process(service, Signal::CONT).expect("it is there");
}

/// Timers that the service's core sets, so they expire there, all in one interrupt. The frame comes
/// when the first have expired.
fn timers(own: usize, core: usize) -> (SyncSender<()>, Receiver<()>) {
    const MANY: u64 = 4_000;
    let limit = getrlimit(Resource::Nofile);
    let most = limit.maximum.unwrap_or(MANY * 2).min(MANY * 2);
    let raised = Rlimit {
        current: Some(most),
        maximum: limit.maximum,
    };
    setrlimit(Resource::Nofile, raised).expect("files up to the limit");
    let timers: Vec<OwnedFd> = (0..MANY.min(most - 200))
        .map(|_| timerfd_create(TimerfdClockId::Monotonic, TimerfdFlags::CLOEXEC).expect("a timer"))
        .collect();
    helper("timers", move |began| {
        pin(core).expect("a core");
        let urgent = RealTime::begin(45).expect("the right to real time");
        // Far enough to set all of them before.
        let due = Clock::monotonic_ns() + 20_000_000;
        let setting = Itimerspec {
            it_interval: timespec(0),
            it_value: timespec(due),
        };
        for timer in &timers {
            timerfd_settime(timer, TimerfdTimerFlags::ABSTIME, &setting).expect("a timer");
        }
        // On another core, so that the frame's sender hears of it while this one is interrupted.
        drop(urgent);
        pin(own).expect("a core");
        let _urgent = RealTime::begin(45).expect("the right to real time");
        while Clock::monotonic_ns() < due + 100_000 {
            std::hint::spin_loop();
        }
        began();
    })
}
