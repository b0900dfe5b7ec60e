//! Decides what to do next for a robot that is up: a pure state machine. Events go in, actions come
//! out, and time is an argument.
//!
//! ```text
//!            swept             joined the bus
//!  attendant ------> the body ----------------> station, comm, gateway, bridge, logic
//!     ^                                             │
//!     +-- all ended, in order; what is left swept <-+ the bus is damaged
//!         after a while, each time a longer one (`resets.rs`)
//!     ^
//!     +-- all ended, in order, and at once <-- a person wants what is saved to be used
//! ```
//! A service that ends or falls silent is restarted alone, once the attendant has the state from
//! which it goes on. The bus counts as damaged if that would not help: a process that hangs before
//! its first sample, or whose shared memory is gone, has met damaged files, and its successor would
//! meet them, too.

use std::time::Duration;

use crate::children::Ended;
use crate::protocol::{Silence, Sweep};
use crate::resets::{MOST, Remedy, Resets, SELDOM};
use crate::service::{Service, Sign};

/// How long a successor may have to wait for the state that is kept for it.
const HAND_OVER: Duration = Duration::from_millis(100);
/// How often in a row an attendant may end by itself before it has joined the bus.
const MOST_REFUSALS: u32 = 5;
/// How long an emulated body may take until it has a clock.
const BODY_START: Duration = Duration::from_secs(30);

/// Something has happened.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    /// The attendant has removed what was left on the bus.
    Swept,
    /// The attendant lives, and has joined the bus.
    Joined,
    /// The attendant keeps the state for the successor of this service, or nobody can ask it to.
    HandedOver(Service),
    /// A service that runs has been silent for too long.
    Silent(Silence),
    /// The attendant has been silent for too long.
    AttendantSilent,
    /// Nobody can use the bus any more, for this reason.
    Damaged(String),
    /// A service has ended.
    Ended(Ended),
    /// Services wait for the robot's clock, and the body could have run for so long meanwhile;
    /// `None` if no process is the body.
    NoClock(Option<Duration>),
    /// A service that has ended may start again.
    Due(Service),
    /// The new start is prepared.
    Restored,
    /// The robot starts again with what is saved.
    Renewed,
}

/// Something to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Start an attendant, which first removes this.
    Attend(Sweep),
    /// Start this service; `true`: it continues the work of an earlier process.
    Start(Service, bool),
    /// Kill a service that does not answer.
    Kill(Service),
    /// Ask the attendant to keep the state for the successor of this service.
    HandOver(Service),
    /// Tell people.
    Say(String),
    /// End all services in order and quickly, and give the mission up if there is a reason.
    StopAll(Option<String>),
    /// Make the robot's folder and the files in it anew.
    Restore,
    /// End all services and have the bus cleared; after that, start nothing.
    Clear,
    /// End with this error.
    Fail(String),
}

/// How far the robot has been started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing runs: the bus was damaged, and the robot tries again at this time.
    Resting(Duration),
    /// The attendant removes what is left on the bus.
    Sweeping,
    /// The body runs, and the attendant joins the bus with the body's clock.
    Joining,
    /// Everything has started.
    Whole,
}

/// A service that has ended, and the state of its handover.
#[derive(Debug)]
struct Owed {
    service: Service,
    /// What `Course::attended` was when it ended.
    since: Duration,
    served: bool,
}

/// The services of a robot.
#[derive(Debug)]
pub(crate) struct Services {
    /// The service that stands for the boards, if they are not real.
    pub(crate) body: Option<Service>,
    /// The services that talk to others, in the order of their start.
    pub(crate) talkers: Vec<Service>,
}

/// Decides how a robot starts, and starts again.
#[derive(Debug)]
pub(crate) struct Course {
    services: Services,
    /// Whether the robot ends with its mission.
    exit_when_done: bool,
    stage: Stage,
    stage_began: Duration,
    /// Whether the attendant has joined the bus.
    joined: bool,
    owed: Vec<Owed>,
    /// How long an attendant was able to serve successors, in all.
    attended: Duration,
    resets: Resets,
    /// How many attendants in a row ended by themselves before they had joined.
    refusals: u32,
}

impl Course {
    /// A course of which nothing has started. Times are real time since an earlier moment.
    pub(crate) fn new(services: Services, exit_when_done: bool) -> Self {
        Self {
            services,
            exit_when_done,
            stage: Stage::Sweeping,
            stage_began: Duration::ZERO,
            joined: false,
            owed: Vec::new(),
            attended: Duration::ZERO,
            resets: Resets::default(),
            refusals: 0,
        }
    }

    /// Starts the first of everything.
    pub(crate) fn begin(&mut self, now: Duration) -> Vec<Step> {
        self.enter(Stage::Sweeping, now);
        self.owed.clear();
        vec![self.attend()]
    }

    /// An attendant was able to serve successors for so long since the last call.
    pub(crate) fn attended(&mut self, span: Duration) {
        self.attended += span;
    }

    /// Something has happened.
    pub(crate) fn take(&mut self, event: Event, now: Duration) -> Vec<Step> {
        if matches!(self.stage, Stage::Resting(_)) {
            return match event {
                Event::Restored => self.begin(now),
                Event::Damaged(why) => self.begin_again(&why, now),
                Event::Renewed => self.renew(now),
                _ => Vec::new(),
            };
        }
        match event {
            Event::Swept => self.swept(now),
            Event::Joined => self.joined(now),
            Event::HandedOver(service) => {
                for owed in self.owed.iter_mut().filter(|owed| owed.service == service) {
                    owed.served = true;
                }
                Vec::new()
            }
            Event::Silent(silence) => self.silent(silence, now),
            Event::AttendantSilent => {
                let killed = Step::Kill(Service::Attendant);
                if !self.joined {
                    return self.after(vec![killed], "whoever opens it hangs", now);
                }
                let said = "the attendant does not answer any more and is killed";
                vec![killed, Step::Say(said.into())]
            }
            Event::Damaged(why) => self.begin_again(&why, now),
            Event::Ended(ended) => self.ended(&ended, now),
            Event::NoClock(ran) => {
                let waited = ran.unwrap_or(now.saturating_sub(self.stage_began));
                if self.stage == Stage::Joining && waited > BODY_START {
                    return self.begin_again("there is no clock of the body to follow", now);
                }
                Vec::new()
            }
            Event::Due(service) => self.due(service),
            Event::Restored => Vec::new(),
            Event::Renewed => self.renew(now),
        }
    }

    /// What must be done because time has passed.
    pub(crate) fn look(&self, now: Duration) -> Vec<Step> {
        match self.stage {
            Stage::Resting(until) if now >= until => vec![Step::Restore],
            _ => Vec::new(),
        }
    }

    /// How long nothing must be done because of time, at most `at_most`.
    pub(crate) fn idle(&self, now: Duration, at_most: Duration) -> Duration {
        let unserved = self.owed.iter().filter(|owed| !owed.served);
        let left = |owed: &Owed| HAND_OVER.saturating_sub(self.attended.saturating_sub(owed.since));
        let at_most = unserved.map(left).fold(at_most, Duration::min);
        match self.stage {
            Stage::Resting(until) => at_most.min(until.saturating_sub(now)),
            _ => at_most,
        }
    }

    /// Whether nothing runs, and the bus must still be cleared.
    pub(crate) fn rests(&self) -> bool {
        matches!(self.stage, Stage::Resting(_))
    }

    /// Whether the services wait for the body's clock.
    pub(crate) fn waits_for_clock(&self) -> bool {
        self.stage == Stage::Joining
    }

    /// Whether everything has started.
    pub(crate) fn is_whole(&self) -> bool {
        self.stage == Stage::Whole
    }

    /// Whether the bus is swept, so that the robot may end.
    pub(crate) fn is_swept(&self) -> bool {
        matches!(self.stage, Stage::Joining | Stage::Whole)
    }

    fn enter(&mut self, stage: Stage, now: Duration) {
        self.stage = stage;
        self.stage_began = now;
    }

    fn start(&mut self, service: Service, resume: bool) -> Step {
        self.owed.retain(|owed| owed.service != service);
        Step::Start(service, resume)
    }

    fn attend(&mut self) -> Step {
        self.joined = false;
        Step::Attend(
            match self.stage == Stage::Sweeping && self.resets.have_been() {
                true => Sweep::Everything,
                false => Sweep::TheDead,
            },
        )
    }

    fn swept(&mut self, now: Duration) -> Vec<Step> {
        if self.stage != Stage::Sweeping {
            return Vec::new();
        }
        self.enter(Stage::Joining, now);
        // After a new start no process keeps the world, so it cannot be resumed.
        let body = self.services.body;
        body.map(|body| self.start(body, false))
            .into_iter()
            .collect()
    }

    fn joined(&mut self, now: Duration) -> Vec<Step> {
        self.joined = true;
        if self.stage != Stage::Joining {
            return Vec::new();
        }
        self.enter(Stage::Whole, now);
        // A service that has run before resumes, or stands if its state is lost.
        let resume = self.resets.whole(now);
        // Services that talk start first, so that they end after those that move the robot.
        let talkers = self.services.talkers.clone();
        let services = talkers.into_iter().chain([Service::Bridge, Service::Logic]);
        services
            .map(|service| self.start(service, resume))
            .collect()
    }

    /// A service lives and is silent. If it was heard before, it hangs, and its successor may do
    /// better. If it was never heard, it cannot get onto the bus.
    fn silent(&mut self, silence: Silence, now: Duration) -> Vec<Step> {
        let service = silence.service;
        let killed = Step::Kill(service);
        if !silence.was_heard && service.sign() == Sign::Topic {
            let why = format!("nothing is heard of the {service}, which runs");
            return self.after(vec![killed], &why, now);
        }
        let said = format!("the {service} does not answer any more and is killed");
        vec![killed, Step::Say(said)]
    }

    fn ended(&mut self, ended: &Ended, now: Duration) -> Vec<Step> {
        let (service, how) = (ended.service, &ended.how);
        let said = Step::Say(format!("the {service} ended ({how})"));
        let first_start = self.stage != Stage::Whole && !self.resets.have_been();
        if first_start && ended.by_itself && !ended.may_try_again {
            let why = format!("the {service} cannot start ({how})");
            return vec![said, Step::Fail(why)];
        }
        let mut damage = ended
            .lost_memory
            .then(|| format!("memory of the {service} was gone ({how})"));
        let mut steps = vec![said];
        if service == Service::Attendant {
            // A killed one may do better next time.
            self.refusals = match !self.joined && ended.by_itself {
                true => self.refusals + 1,
                false => 0,
            };
            let most = match ended.may_try_again {
                true => MOST_REFUSALS,
                false => 1,
            };
            self.joined = false;
            if self.refusals >= most {
                let refused = format!("the attendant cannot join it ({how})");
                damage = damage.or(Some(refused));
            }
        } else {
            self.owed.retain(|owed| owed.service != service);
            self.owed.push(Owed {
                service,
                since: self.attended,
                served: !self.joined,
            });
            steps.push(Step::HandOver(service));
        }
        match damage {
            Some(why) => self.after(steps, &why, now),
            None => steps,
        }
    }

    /// Starts the ended services again for which the state is kept, or for which it took too long.
    fn due(&mut self, service: Service) -> Vec<Step> {
        if service == Service::Attendant {
            return vec![self.attend()];
        }
        let owed = self.owed.iter().find(|owed| owed.service == service);
        let may_start =
            owed.is_none_or(|owed| owed.served || self.attended - owed.since >= HAND_OVER);
        match may_start {
            true => vec![self.start(service, true)],
            false => Vec::new(),
        }
    }

    /// Ends everything, and starts it again as if nothing had happened yet.
    fn renew(&mut self, now: Duration) -> Vec<Step> {
        self.joined = false;
        self.resets.renew();
        self.enter(Stage::Resting(now), now);
        vec![Step::StopAll(None)]
    }

    /// Begins again after these steps.
    fn after(&mut self, mut steps: Vec<Step>, why: &str, now: Duration) -> Vec<Step> {
        steps.extend(self.begin_again(why, now));
        steps
    }

    /// Ends everything, and starts it again after a while on a bus from which everything was
    /// removed. After too many attempts that is an error, if the robot ends with its mission.
    fn begin_again(&mut self, why: &str, now: Duration) -> Vec<Step> {
        self.joined = false;
        let remedy = self.resets.damaged(now);
        let how = match remedy {
            Remedy::StartAgain(count, Duration::ZERO) => {
                format!("starting everything again ({count} of {MOST})")
            }
            Remedy::StartAgain(count, pause) => format!(
                "starting everything again in {} s ({count} of {MOST})",
                pause.as_secs()
            ),
            _ if self.exit_when_done => {
                let why = format!(
                    "the bus does not hold: {why}; {MOST} new starts were in vain. See whether its memory is full (`df /dev/shm`), and what `lager doctor` finds"
                );
                return vec![Step::Clear, Step::Fail(why)];
            }
            Remedy::Seldom => format!(
                "{MOST} new starts were in vain, so it is tried every {} s from now on. See whether its memory is full (`df /dev/shm`), and what `lager doctor` finds",
                SELDOM.as_secs()
            ),
            Remedy::StillSeldom => String::new(),
        };
        let mut steps = Vec::new();
        if !how.is_empty() {
            steps.push(Step::Say(format!("the bus is damaged: {why}; {how}")));
        }
        // If services have run already, their successors do not know where the robot stands.
        // Otherwise the mission goes on as if nothing had happened.
        let lost = self.resets.was_whole().then(|| why.to_owned());
        steps.push(Step::StopAll(lost));
        self.enter(Stage::Resting(now + remedy.pause()), now);
        steps
    }
}

#[cfg(test)]
mod tests;
