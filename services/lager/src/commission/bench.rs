//! [`Bench`]: the robot under a commissioning, whoever talks to the person.
//!
//! However it ends, the robot stands, because nobody renews its order, and the boards are told what
//! they were told before, unless the person has saved something else. If this process is killed or
//! hangs, nobody renews the trial either, and the bridge takes it back after [`Ask::TRIAL`]. What
//! the sensor board has calibrated by then, the next commissioning takes back ([`OpenCalibration`]).

use std::time::{Duration, Instant};

use anyhow::Result;
use lager_commission::{Answer, Built, Commissioning, Effect, Question, Said, Step, Takes};
use lager_home::Clock;
use lager_orders::Moment;
use lager_ports::{Bus, Cause, Publisher, Subscriber};
use lager_supervisor::hands::Hands;
use lager_topics::{
    Ask, AskKind, BridgeAnswer, LinkHealth, LogThought, Outcome, Part, Role, SensorDistance,
    SensorLine, SteeringState, Thought, ThoughtKind,
};
use lager_wire::RobotProfile;

use super::open::OpenCalibration;
use crate::config::Config;
use crate::diagnose;

/// How often a trial is renewed, in robot time.
const RENEW: Duration = Duration::from_secs(1);
/// How often it looks whether the robot is up.
const LOOK: Duration = Duration::from_secs(1);

/// The robot on one side, and [`Commissioning`] on the other.
pub struct Bench {
    bus: Bus,
    hands: Hands,
    health: Subscriber<LinkHealth>,
    line: Subscriber<SensorLine>,
    distance: Subscriber<SensorDistance>,
    thoughts: Publisher<LogThought>,
    state: Subscriber<SteeringState>,
    /// What decides everything.
    pub machine: Commissioning,
    /// What the person has saved.
    pub kept: Option<Built>,
    /// What the boards try of each part, by its number.
    trials: [Option<(Part, RobotProfile)>; Part::ALL.len()],
    renewed: Duration,
    configured: Config,
    calibration: OpenCalibration,
    /// When it looked whether the robot is up.
    looked: Instant,
}

impl Bench {
    /// The robot of `bus`, which `configured` names, and which is described as `built`.
    ///
    /// # Errors
    /// The ports cannot be opened.
    pub fn new(
        configured: &Config,
        bus: Bus,
        built: Built,
        calibration: OpenCalibration,
    ) -> Result<Self> {
        let machine = Commissioning::new(built);
        Ok(Self {
            hands: Hands::new(&bus)?,
            health: bus.subscriber()?,
            line: bus.subscriber()?,
            distance: bus.subscriber()?,
            thoughts: bus.publisher()?,
            state: bus.subscriber()?,
            bus,
            machine: match calibration.is_there() {
                true => machine.after_calibration(),
                false => machine,
            },
            kept: None,
            trials: [None; Part::ALL.len()],
            renewed: Duration::ZERO,
            configured: configured.clone(),
            calibration,
            looked: Instant::now(),
        })
    }

    /// What is taken for an answer now.
    pub fn takes(&self) -> Takes {
        self.machine.question().map_or(Takes::Yes, Question::takes)
    }

    /// Takes an answer as a person types it.
    ///
    /// # Errors
    /// It is no answer to what is asked. While the robot moves, whatever a person types makes it
    /// stand.
    pub fn answer(&mut self, word: &str) -> Result<Answer, Said> {
        let answer = match Answer::read(word, self.takes()) {
            Ok(answer) => answer,
            Err(_) if self.machine.moves() => Answer::No,
            Err(why) => return Err(why),
        };
        self.machine.answer(self.now(), answer);
        Ok(answer)
    }

    /// Whether a person holds the button; then what he holds it for goes on.
    pub fn answer_is_held(&mut self, word: &str) -> bool {
        let is_held = Answer::read(word, self.takes()) == Ok(Answer::Hold);
        if is_held {
            self.machine.answer(self.now(), Answer::Hold);
        }
        is_held
    }

    /// What moves stands, and its step begins anew.
    pub fn stand(&mut self) {
        if self.machine.moves() {
            self.machine.answer(self.now(), Answer::No);
        }
    }

    /// Nobody is there any more.
    pub fn rest(&mut self) {
        self.machine.rest(self.now());
    }

    /// Ends it.
    pub fn quit(&mut self) {
        self.machine.quit(self.now());
    }

    /// Hands in what the robot has told.
    ///
    /// # Errors
    /// The bus fails, or the robot is not up any more. Its clock may stand still then, so that
    /// nothing would ever be late.
    pub fn hear(&mut self) -> Result<()> {
        if self.looked.elapsed() >= LOOK {
            self.looked = Instant::now();
            diagnose::must_be_up(&self.configured)?;
        }
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

    /// Lets time pass, and does what the machine wants.
    pub fn act(&mut self) -> Result<()> {
        self.machine.turn(self.now());
        for effect in self.machine.effects() {
            match effect {
                Effect::Steer(order) => self.hands.steer(order)?,
                Effect::Keep(built) => self.kept = Some(built),
                Effect::Describe(part, robot) => {
                    let outcome = outcome(self.hands.ask(Ask::try_out(part, &robot)));
                    if outcome == Some(Outcome::Done) {
                        self.trials[part as usize] = Some((part, robot));
                    }
                    self.machine.described(self.now(), part, outcome);
                }
                Effect::Uncalibrate => {
                    let outcome = outcome(self.hands.ask(uncalibrate()));
                    self.machine.uncalibrated(self.now(), outcome);
                    if !self.machine.has_calibrated() {
                        warn(self.calibration.end());
                    }
                }
                Effect::Listen => {
                    let answer = self.hands.ask(Ask::listen()).ok();
                    self.machine.lines(self.now(), answer.as_ref());
                }
                Effect::Calibrate => {
                    // Before it begins: this process may be killed at any moment.
                    warn(self.calibration.begin());
                    let outcome = outcome(self.hands.ask(Ask {
                        kind: AskKind::Calibrate.into(),
                        ..Ask::default()
                    }));
                    self.machine.calibrates(self.now(), outcome);
                }
            }
        }
        if self.machine.step() == Step::Boards {
            // Nothing is tried there, and what was tried shall lapse.
            self.trials = [None; Part::ALL.len()];
        }
        self.renew();
        Ok(())
    }

    /// Says that the trials go on. If the bridge does not hear it, `link/health` shows that they do
    /// not.
    fn renew(&mut self) {
        let now = self.now().robot;
        if now < self.renewed + RENEW {
            return;
        }
        self.renewed = now;
        for (part, robot) in self.trials.into_iter().flatten() {
            let _ = self.hands.ask(Ask::try_out(part, &robot));
        }
    }

    /// The boards go on to obey what was saved until the robot is started again, and the log says who
    /// has saved it.
    pub fn settle(&mut self, built: &Built, kind: ThoughtKind) {
        let thought = Thought {
            from: Role::Operator.into(),
            seen: i32::try_from(rustix::process::getuid().as_raw()).unwrap_or(-1),
            ..kind.into()
        };
        if let Err(error) = self.thoughts.send(Cause::OWN, thought) {
            tracing::warn!("the log does not say who has set the robot up: {error}");
        }
        for (part, _) in self.trials.into_iter().flatten() {
            let _ = self.hands.ask(Ask::describe(part, &built.robot));
        }
    }

    /// Takes what there is to say.
    pub fn said(&mut self) -> Vec<Said> {
        self.machine.said()
    }

    /// The time on both clocks.
    pub fn now(&self) -> Moment {
        Moment {
            robot: self.bus.clock().now(),
            ns: Clock::monotonic_ns(),
        }
    }
}

/// The request to have the former thresholds of the line sensors back.
pub fn uncalibrate() -> Ask {
    Ask {
        kind: AskKind::Uncalibrate.into(),
        ..Ask::default()
    }
}

/// It goes on without the note.
fn warn(noted: Result<()>) {
    if let Err(error) = noted {
        tracing::warn!("if this process is killed, the calibration stays: {error:#}");
    }
}

/// What the bridge says; nothing if it has not answered.
fn outcome(answer: Result<BridgeAnswer>) -> Option<Outcome> {
    answer.ok()?.outcome.get()
}
