//! Listens whether each service still lives, as a pure state machine.
//!
//! A silent service that lives is frozen, hangs, or cannot be reached through the bus. The
//! supervisor sees none of that. Silence is counted in small pieces, by two clocks.
//!
//! The real clock counts, because a service hangs in real time. A piece counts at most as
//! [`LONGEST_PIECE`], so time in which this process itself slept is not a service's silence. Nor is
//! time in which the service was ready to run and got no core ([`lager_home::Chance`]).
//!
//! The robot's clock counts as well, because services publish by that clock. While an emulated
//! body's clock stands still, or crawls, they have nothing to publish. Only the real clock counts
//! for an emulator that has published nothing yet, because the robot's clock comes from it. The
//! same holds for services that write signs of life, from their first sign on.

use std::time::Duration;

use crate::protocol::Silence;
use crate::service::{Service, Sign};

/// How long a service may be silent in real time.
const REAL: Duration = Duration::from_secs(2);
/// The same in robot time: five times the longest period of the topics that it listens to.
const ROBOT: Duration = Duration::from_millis(500);
/// How long an emulator may take until its first sample, in real time.
const EMULATOR: Duration = Duration::from_secs(5);
/// After this silence it asks how long the service could have run. That costs two reads of the
/// kernel's files, and most services are never silent for so long.
const NOTICED: Duration = Duration::from_millis(200);
/// At most this counts between two looks.
const LONGEST_PIECE: Duration = Duration::from_millis(100);

/// One service that it listens to.
#[derive(Debug)]
struct Voice {
    service: Service,
    pid: u32,
    was_heard: bool,
    real: Duration,
    robot: Duration,
    told: bool,
}

impl Voice {
    fn is_too_long(&self) -> bool {
        match self.service.sign() {
            Sign::Topic => {
                let hangs = self.real >= REAL && self.robot >= ROBOT;
                let does_not_start = self.service == Service::Emulator && !self.was_heard;
                hangs || does_not_start && self.real >= EMULATOR
            }
            // A service that could not write its first sign may work all the same.
            Sign::File => self.was_heard && self.real >= REAL,
            Sign::Line => false,
        }
    }
}

/// The services that have been started.
#[derive(Debug, Default)]
pub(crate) struct Ears {
    voices: Vec<Voice>,
    looked: Option<(Duration, Duration)>,
}

impl Ears {
    /// Listens to a service that was started as process `pid`, and no longer to the process before
    /// it.
    pub(crate) fn started(&mut self, service: Service, pid: u32) {
        self.voices.retain(|voice| voice.service != service);
        self.voices.push(Voice {
            service,
            pid,
            was_heard: false,
            real: Duration::ZERO,
            robot: Duration::ZERO,
            told: false,
        });
    }

    /// The services that it listens to, with their processes.
    pub(crate) fn listened(&self) -> Vec<(Service, u32)> {
        let voices = self.voices.iter();
        voices.map(|voice| (voice.service, voice.pid)).collect()
    }

    /// Their processes.
    pub(crate) fn processes(&self) -> Vec<u32> {
        self.voices.iter().map(|voice| voice.pid).collect()
    }

    /// How many of them are at work: they have said something, or may work without that.
    pub(crate) fn at_work(&self) -> usize {
        let works = |voice: &&Voice| {
            voice.was_heard || voice.service.sign() == Sign::File && voice.real >= REAL
        };
        self.voices.iter().filter(works).count()
    }

    /// Process `pid` has said something.
    pub(crate) fn heard(&mut self, pid: u32) {
        for voice in self.voices.iter_mut().filter(|voice| voice.pid == pid) {
            voice.was_heard = true;
            voice.real = Duration::ZERO;
            voice.robot = Duration::ZERO;
            voice.told = false;
        }
    }

    /// Those that write a sign of life.
    pub(crate) fn writers(&self) -> Vec<(Service, u32)> {
        let mut writers = self.listened();
        writers.retain(|(service, _)| service.sign() == Sign::File);
        writers
    }

    /// Looks at both clocks. A service that has been silent for too long is reported once. `chance`
    /// says how long a process could have run in a piece of real time.
    pub(crate) fn look(
        &mut self,
        real: Duration,
        robot: Duration,
        mut chance: impl FnMut(u32, Duration) -> Duration,
    ) -> Vec<Silence> {
        let (real_before, robot_before) =
            self.looked.replace((real, robot)).unwrap_or((real, robot));
        let piece = real.saturating_sub(real_before).min(LONGEST_PIECE);
        let robot_piece = robot.saturating_sub(robot_before);
        let mut silent = Vec::new();
        for voice in &mut self.voices {
            voice.real += match voice.real >= NOTICED {
                true => chance(voice.pid, piece),
                false => piece,
            };
            voice.robot += robot_piece;
            if voice.is_too_long() && !voice.told {
                voice.told = true;
                silent.push(Silence {
                    service: voice.service,
                    pid: voice.pid,
                    was_heard: voice.was_heard,
                });
            }
        }
        silent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(40);

    /// The machine is idle: everybody could run all the time.
    fn whole(_: u32, piece: Duration) -> Duration {
        piece
    }

    /// Looks for `seconds`, with the robot's clock `speed` times as fast.
    fn listen(ears: &mut Ears, from: &mut Duration, seconds: u64, speed: f64) -> Vec<Silence> {
        let end = *from + Duration::from_secs(seconds);
        let mut silent = Vec::new();
        while *from < end {
            *from += TICK;
            silent.extend(ears.look(*from, from.mul_f64(speed), whole));
        }
        silent
    }

    #[test]
    fn silence_is_told_once_and_says_whether_there_was_a_word_before() {
        let mut ears = Ears::default();
        ears.started(Service::Bridge, 7);
        ears.started(Service::Logic, 8);
        let mut now = Duration::ZERO;
        ears.heard(7);
        assert_eq!(listen(&mut ears, &mut now, 1, 1.0), []);
        ears.heard(7);
        assert_eq!(
            listen(&mut ears, &mut now, 9, 1.0),
            [
                Silence {
                    service: Service::Logic,
                    pid: 8,
                    was_heard: false
                },
                Silence {
                    service: Service::Bridge,
                    pid: 7,
                    was_heard: true
                },
            ]
        );
        // It speaks again, and its successor has two seconds of its own.
        ears.heard(7);
        assert_eq!(listen(&mut ears, &mut now, 1, 1.0), []);
        ears.started(Service::Bridge, 9);
        assert_eq!(listen(&mut ears, &mut now, 1, 1.0), []);
        assert_eq!(listen(&mut ears, &mut now, 2, 1.0).len(), 1);
    }

    #[test]
    fn a_standing_clock_and_a_sleeping_listener_are_no_silence() {
        let mut ears = Ears::default();
        ears.started(Service::Bridge, 7);
        let mut now = Duration::ZERO;
        assert_eq!(listen(&mut ears, &mut now, 60, 0.0), []);

        let mut ears = Ears::default();
        ears.started(Service::Bridge, 7);
        let slept = Duration::from_secs(60);
        assert_eq!(ears.look(Duration::ZERO, Duration::ZERO, whole), []);
        assert_eq!(ears.look(slept, slept, whole), []);
    }

    #[test]
    fn an_emulator_that_does_not_start_is_silent_without_a_clock() {
        let mut ears = Ears::default();
        ears.started(Service::Emulator, 7);
        let mut now = Duration::ZERO;
        assert_eq!(listen(&mut ears, &mut now, 4, 0.0), []);
        assert_eq!(listen(&mut ears, &mut now, 4, 0.0).len(), 1);
        // One that has spoken may be stopped.
        ears.heard(7);
        assert_eq!(listen(&mut ears, &mut now, 60, 0.0), []);
    }

    #[test]
    fn a_slow_robot_may_be_silent_for_longer() {
        let mut ears = Ears::default();
        ears.started(Service::Bridge, 7);
        let mut now = Duration::ZERO;
        // At a hundredth of real time health comes every ten seconds.
        assert_eq!(listen(&mut ears, &mut now, 40, 0.01), []);
        assert_eq!(listen(&mut ears, &mut now, 20, 0.01).len(), 1);
    }

    #[test]
    fn who_waits_for_a_core_is_not_silent_and_who_hangs_beside_him_is() {
        let mut ears = Ears::default();
        ears.started(Service::Bridge, 7);
        ears.started(Service::Logic, 8);
        ears.started(Service::Comm, 9);
        ears.started(Service::Simulator, 10);
        (7..=10).for_each(|pid| ears.heard(pid));
        let mut now = Duration::ZERO;
        let mut silent = Vec::new();
        while now < Duration::from_secs(60) {
            now += TICK;
            // Bridge and comm get a hundredth of a core, logic hangs, and the body speaks.
            ears.heard(10);
            silent.extend(ears.look(now, now, |pid, piece| match pid {
                7 | 9 => piece / 100,
                _ => piece,
            }));
        }
        let who: Vec<u32> = silent.iter().map(|silence| silence.pid).collect();
        assert_eq!(who, [8]);
    }

    #[test]
    fn who_writes_a_sign_of_life_is_judged_from_the_first_one_on_and_by_real_time() {
        for service in [Service::Comm, Service::Station, Service::Gateway] {
            let mut ears = Ears::default();
            ears.started(service, 7);
            assert_eq!(ears.writers(), [(service, 7)]);
            let mut now = Duration::ZERO;
            assert_eq!(listen(&mut ears, &mut now, 60, 1.0), []);
            ears.heard(7);
            // An emulated body's clock stands still, and it writes all the same.
            assert_eq!(listen(&mut ears, &mut now, 1, 0.0), []);
            let silent = listen(&mut ears, &mut now, 2, 0.0);
            assert_eq!(silent.len(), 1, "{service}");
            assert!(silent[0].was_heard);
        }
    }
}
