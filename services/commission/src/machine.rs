//! [`Commissioning`]: the steps one after the other, and everything that can end one.
//!
//! ```text
//!            answer                      the boards obey it
//!    asks ──────────> the description ──────────────────────> asks the next question
//!     │  ^             is tried
//!     │  '───────────────────────────────────────┐
//!     │ answer "lifted", "go"                    │ half a second, or the person's next answer
//!     '────────────────────> the wheels turn ────┘
//! ```
//!
//! Of the arm, `machine/arm.rs` draws what is beside this, and `machine/buttons.rs` of the buttons.
//!
//! In every state a failure ends the step: the robot stands, what held before the step holds again,
//! and the step begins anew with a sentence that says why.

mod answers;
mod arm;
mod buttons;
mod shown;
mod tells;

use core::time::Duration;

use lager_operator::{Driving, For, Ids};
use lager_orders::{Buttons, Moment, Reason};
use lager_topics::{Calibration, Health, Outcome, Part, SteeringOrder, SteeringReport};
use lager_wire::{Centimetres, LineBits, OperatorCommand, RobotProfile};

use crate::answer::{Answer, Way};
use crate::range::{MEASURING, Point};
use crate::recent::Recent;
use crate::step::{Question, Step, Takes};
use crate::words::Said;
use crate::{line, range, wheels};
use tells::{TOLD, Thresholds, is_obeyed};

/// How long the wheels turn when they are lifted.
const PULSE: Duration = Duration::from_millis(500);
/// How long the steering board may take to begin a movement.
const BEGIN: Duration = Duration::from_secs(1);
/// How long the boards may take to obey a description.
const TELL: Duration = Duration::from_secs(5);
/// How long a calibration may take; the board watches its sensors for 5 s.
const CALIBRATE: Duration = Duration::from_secs(8);
/// The longest movement that waits for an answer.
const LONGEST: Duration = Duration::from_secs(60);
/// Without a new `link/health` for this long, nobody knows how the boards are.
const UNHEARD: Duration = Duration::from_secs(2);

/// How a robot is built, as far as commissioning finds it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Built {
    /// What the boards are told.
    pub robot: RobotProfile,
    /// The speed with both motors at their duty, in mm/s.
    pub cruise_mm_per_s: f32,
    /// The positions of shoulder and elbow when the claw is around goods in front of the robot.
    pub reach_shoulder: u16,
    /// Of the elbow.
    pub reach_elbow: u16,
    /// The robot's own buttons.
    pub buttons: Buttons,
}

/// Something that the caller must do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// Ask the bridge to have this part told as the robot's, and hand its answer in
    /// ([`Commissioning::described`]).
    Describe(Part, RobotProfile),
    /// Publish an order to the wheels.
    Steer(SteeringOrder),
    /// Let the sensor board calibrate its line sensors.
    Calibrate,
    /// Let the sensor board have the thresholds from before its calibration, and hand the bridge's
    /// answer in ([`Commissioning::uncalibrated`]).
    Uncalibrate,
    /// Ask the bridge what the buttons' lines show, and hand its answer in
    /// ([`Commissioning::lines`]).
    Listen,
    /// Save this for good.
    Keep(Built),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// Waits for an answer.
    Asks,
    /// The boards are told a description; the next request is due at a time, or under way.
    Tells {
        since: Duration,
        due: Option<Duration>,
    },
    /// The sensor board watches its line sensors.
    Calibrates { since: Duration, ended_before: u8 },
    /// The wheels turn, until a time after their beginning or until the next answer.
    Moves {
        since: Duration,
        begun: Option<Duration>,
        is_pulse: bool,
    },
    /// The servos are listened to, since a time or from the next turn on.
    Listens { since: Option<Duration> },
    /// A joint or the claw moves, because a person holds the button, until a time. Spent: it has
    /// moved, and waits for the next press.
    Holds { until: Duration, is_spent: bool },
    /// Everything is said.
    Over,
}

/// What the present step has found out so far.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    floor: u16,
    far: Point,
    ahead: Option<[Way; 2]>,
    length_mm: f32,
}

/// A commissioning.
#[derive(Clone, Debug)]
pub struct Commissioning {
    state: State,
    question: Question,
    step: Step,
    built: Built,
    /// What held before each step.
    before: [Built; Step::ALL.len()],
    /// What held before all of them.
    original: Built,
    /// What the boards shall obey.
    wanted: RobotProfile,
    /// Something was told, so that somebody has to take it back.
    is_tried: bool,
    /// What they obey of it; `None` if nobody knows.
    told: [Option<RobotProfile>; TOLD.len()],
    /// What the bridge was asked to tell, and has not answered yet.
    under_way: Option<RobotProfile>,
    /// How far a calibration has changed the line sensors' thresholds.
    thresholds: tells::Thresholds,
    /// The hash of it in `link/health`, once that has come.
    description: Option<u32>,
    /// The person ends it, and the boards are told what they were told before.
    is_leaving: bool,
    found: Found,
    arm: arm::Work,
    buttons: buttons::Work,
    /// What is told now is told to listen to the servos afterwards.
    listens: bool,
    health: Option<(Duration, Health)>,
    /// The lives of both links since the step began.
    epochs: Option<[u32; 2]>,
    report: Option<SteeringReport>,
    bits: Recent<u16>,
    readings: Recent<u16>,
    volts: Recent<u8>,
    driving: Driving,
    ids: Ids,
    effects: Vec<Effect>,
    said: Vec<Said>,
}

impl Commissioning {
    /// Begins with the boards, of a robot that is described so.
    pub fn new(built: Built) -> Self {
        Self {
            state: State::Asks,
            question: Question::Boards,
            step: Step::Boards,
            built,
            before: [built; Step::ALL.len()],
            original: built,
            wanted: built.robot,
            is_tried: false,
            told: [None; TOLD.len()],
            under_way: None,
            thresholds: tells::Thresholds::default(),
            description: None,
            is_leaving: false,
            found: Found::default(),
            arm: arm::Work::default(),
            buttons: buttons::Work::default(),
            listens: false,
            health: None,
            epochs: None,
            report: None,
            bits: Recent::default(),
            readings: Recent::default(),
            volts: Recent::default(),
            driving: Driving::default(),
            ids: Ids::default(),
            effects: Vec::new(),
            said: Vec::new(),
        }
    }

    /// The line sensors still have thresholds of a calibration that nobody has saved, because an
    /// earlier commissioning was killed.
    #[must_use]
    pub fn after_calibration(mut self) -> Self {
        self.thresholds = Thresholds::New;
        self
    }

    /// The present step.
    pub const fn step(&self) -> Step {
        self.step
    }

    /// What is asked now; `None` while something must happen first, or when all is over.
    pub fn question(&self) -> Option<Question> {
        match self.state {
            State::Asks
            | State::Holds { .. }
            | State::Moves {
                is_pulse: false, ..
            } => Some(self.question),
            _ => None,
        }
    }

    /// Whether it has ended.
    pub fn is_over(&self) -> bool {
        self.state == State::Over
    }

    /// Whether it lets the robot move at present.
    pub const fn moves(&self) -> bool {
        self.driving.is_running()
    }

    /// Whether the line sensors have other thresholds than before.
    pub fn has_calibrated(&self) -> bool {
        self.thresholds != Thresholds::Former
    }

    /// How the robot is built, by what is known so far.
    pub const fn built(&self) -> Built {
        self.built
    }

    /// Takes the list of things to do.
    pub fn effects(&mut self) -> Vec<Effect> {
        core::mem::take(&mut self.effects)
    }

    /// Takes what there is to say: results, and why something does not go on.
    pub fn said(&mut self) -> Vec<Said> {
        core::mem::take(&mut self.said)
    }
}

/// What the robot tells.
impl Commissioning {
    /// To be called with each `link/health`.
    pub fn health(&mut self, now: Moment, health: &Health) {
        self.health = Some((now.robot, *health));
        self.driving.refused(now.robot, health);
        let epochs = [health.sensor.epoch, health.steering.epoch];
        let up = [health.sensor.up, health.steering.up];
        if self.step == Step::Boards || self.state == State::Over {
            return;
        }
        let is_told_otherwise = self
            .description
            .is_some_and(|told| told != health.description);
        if is_told_otherwise {
            self.told = [None; TOLD.len()];
        }
        let has_changed = self.epochs.is_some_and(|before| before != epochs);
        if up.contains(&0) || has_changed || is_told_otherwise {
            return self.fall_back(now, "board_changed");
        }
        self.epochs = Some(epochs);
        if !matches!(self.state, State::Tells { .. }) {
            self.description = Some(health.description);
        }
        if let State::Calibrates { ended_before, .. } = self.state
            && health.calibrations_ended != ended_before
        {
            match (health.calibration_failure(), line::dull(health)) {
                (None, _) => self.ask(Question::LineFloor),
                (Some(_), Some(dull)) if health.calibration == Calibration::Partly => {
                    self.fail(now, dull);
                }
                (Some(why), _) => self.fail(now, why),
            }
        }
    }

    /// To be called with the bridge's answer to [`Effect::Calibrate`]; `None` if there was none.
    pub fn calibrates(&mut self, now: Moment, outcome: Option<Outcome>) {
        match outcome {
            Some(Outcome::Done) => self.thresholds = Thresholds::New,
            Some(why) => self.fail(now, Reason::from(why)),
            None => self.fail(now, "bridge_silent"),
        }
    }

    /// To be called with the line sensors' bits of each frame.
    pub fn line(&mut self, now: Duration, bits: u16) {
        if bits & !LineBits::MASK == 0 {
            self.bits.push(now, bits);
        }
    }

    /// To be called with each distance, in cm.
    pub fn distance(&mut self, now: Duration, cm: u8) {
        let told = Centimetres(cm).get();
        self.readings.push(now, told.map_or(0, range::reading));
    }

    /// To be called with each `steering/state`.
    pub fn reported(&mut self, now: Duration, report: &SteeringReport) {
        if report.age_ms == 0 {
            self.volts.push(now, report.battery_decivolts);
        }
        self.report = Some(*report);
        self.driving.reported(now, report);
        if let State::Moves { begun, .. } = &mut self.state
            && begun.is_none()
            && self.driving.has_begun()
        {
            *begun = Some(now);
        }
    }

    /// To be called at least every 10 ms.
    pub fn turn(&mut self, now: Moment) {
        if let Some(order) = self.driving.renew(now.robot) {
            self.effects.push(Effect::Steer(order));
        }
        if let Some(Err(why)) = self.driving.ended().pop().map(|ended| ended.result) {
            return self.fail(now, why);
        }
        let is_busy = !matches!(self.state, State::Asks | State::Over);
        if is_busy && !self.is_leaving && self.known(now.robot).is_none() {
            return self.fall_back(now, "bridge_silent");
        }
        self.listen(now);
        let past = |since: Duration, span| now.robot >= since + span;
        match self.state {
            State::Tells { since, .. } if past(since, TELL) => self.undescribed(now),
            State::Tells {
                since,
                due: Some(due),
            } if due <= now.robot => self.tell_next(since),
            State::Listens { since: None } => {
                self.state = State::Listens {
                    since: Some(now.robot),
                };
            }
            State::Listens { since: Some(since) } if past(since, self.listening()) => {
                if let Err(why) = self.listened(now) {
                    self.fail(now, why);
                }
            }
            State::Holds { .. } => self.go_on(now),
            State::Calibrates { since, .. } if past(since, CALIBRATE) => {
                self.fail(now, Reason::from(lager_orders::Code::CalibrationSilent));
            }
            State::Moves {
                since, begun: None, ..
            } if past(since, BEGIN) => self.fail(now, "unmoved"),
            State::Moves {
                begun: Some(begun),
                is_pulse: true,
                ..
            } if past(begun, PULSE) => {
                self.stand(now);
                self.ask(match self.question {
                    Question::WheelsAhead => Question::SawAhead,
                    _ => Question::SawLeft,
                });
            }
            State::Moves { since, .. } if past(since, LONGEST) => {
                let seconds = LONGEST.as_secs();
                self.fail(now, Said::new("too_long", &[("seconds", &seconds)]));
            }
            _ => {}
        }
    }
}

/// What the person says.
impl Commissioning {
    /// Takes an answer.
    pub fn answer(&mut self, now: Moment, answer: Answer) {
        match (answer, self.state) {
            (_, State::Over) => {}
            (Answer::Again, _) => self.enter(now, self.step),
            (Answer::Skip, _) => self.enter_unchanged(now, self.step.next()),
            (Answer::Back, _) => self.enter(now, self.step.before()),
            (Answer::Hold, State::Asks | State::Holds { .. }) => {
                if self.question.takes() == Takes::Hold {
                    self.hold(now);
                }
            }
            (Answer::Hold, _) => {}
            (Answer::No, State::Holds { .. }) if self.moves() => self.fail(now, "broken_off"),
            (_, State::Asks | State::Holds { .. }) => {
                if self.state != State::Asks {
                    self.let_go(now);
                }
                if let Err(why) = self.answered(now, answer) {
                    self.fail(now, why);
                }
            }
            (
                Answer::Yes,
                State::Moves {
                    begun: Some(begun),
                    is_pulse: false,
                    ..
                },
            ) => {
                self.stand(now);
                if let Err(why) = self.measured(now, now.robot.saturating_sub(begun)) {
                    self.fail(now, why);
                }
            }
            // Whatever a person types while the robot moves, he wants it to stand.
            (_, State::Moves { .. }) => self.fail(now, "broken_off"),
            (_, State::Tells { .. } | State::Calibrates { .. } | State::Listens { .. }) => {
                self.said.push("wait".into());
            }
        }
    }

    /// Ends it: the robot stands, and the boards obey what they obeyed before.
    pub fn quit(&mut self, now: Moment) {
        self.stand(now);
        self.built = self.original;
        self.is_leaving = true;
        self.state = State::Over;
        self.take_thresholds_back();
        if self.is_tried {
            self.tell(now, self.built.robot);
        }
    }

    /// Nobody is there any more: the robot stands, the boards obey what they obeyed before, and a
    /// person who comes back begins with the boards. What was found out is kept.
    pub fn rest(&mut self, now: Moment) {
        if self.state == State::Over || self.is_leaving {
            return;
        }
        self.fall_back(now, "nobody_there");
        self.take_thresholds_back();
        if self.is_tried {
            self.tell(now, self.original.robot);
        }
    }

    /// `link/health`, if it is new.
    fn known(&self, now: Duration) -> Option<&Health> {
        let (at, health) = self.health.as_ref()?;
        (*at + UNHEARD > now).then_some(health)
    }
}

/// How it goes from one state to the next.
impl Commissioning {
    fn ask(&mut self, question: Question) {
        self.question = question;
        self.state = State::Asks;
    }

    /// The step has a result.
    fn done(&mut self, now: Moment, result: impl Into<Said>) {
        self.said.push(result.into());
        let next = self.step.next();
        self.before[next as usize] = self.built;
        self.enter(now, next);
    }

    /// Leaves the step without a result.
    fn enter_unchanged(&mut self, now: Moment, next: Step) {
        let built = self.before[self.step as usize];
        self.before[next as usize] = built;
        self.enter(now, next);
    }

    /// Begins a step with what held before it.
    fn enter(&mut self, now: Moment, step: Step) {
        self.stand(now);
        self.step = step;
        self.found = Found::default();
        (self.arm, self.listens) = (arm::Work::default(), false);
        self.buttons = buttons::Work::default();
        self.epochs = None;
        self.built = self.before[step as usize];
        self.ask(step.first());
        if step == Step::Boards {
            return;
        }
        let mut trial = self.built.robot;
        match step {
            // Whoever comes back to it begins with what held before it.
            Step::Line => self.take_thresholds_back(),
            Step::Distance => trial.sensors.ranger = MEASURING,
            Step::Wheels => trial.steering.wheels = wheels::plain(trial.steering.wheels),
            Step::Battery => trial.steering.divider = true,
            _ => trial.arm = self.arm_trial(step),
        }
        self.tell(now, trial);
    }

    /// Ends the step, which begins anew.
    fn fail(&mut self, now: Moment, why: impl Into<Said>) {
        self.said.push(Said::of("ended", [("why", why.into())]));
        self.enter(now, self.step);
    }

    /// A board has gone, or nobody knows how it is: the person looks at the boards first.
    fn fall_back(&mut self, now: Moment, why: &'static str) {
        self.stand(now);
        self.said.push(Said::of("ended", [("why", why.into())]));
        // Whether a trial still holds, nobody knows.
        self.told = [None; TOLD.len()];
        self.built = self.before[self.step as usize];
        self.before[Step::Boards as usize] = self.built;
        self.step = Step::Boards;
        self.ask(Question::Boards);
    }

    fn begin(&mut self, now: Moment, command: OperatorCommand, is_pulse: bool) -> Result<(), Said> {
        self.order(now, command)?;
        self.state = State::Moves {
            since: now.robot,
            begun: None,
            is_pulse,
        };
        Ok(())
    }

    /// Stands, if it does not yet.
    fn stand(&mut self, now: Moment) {
        if self.driving.is_running() {
            self.steer(now, OperatorCommand::Stop);
            self.driving.let_go(lager_orders::Code::Replaced);
            self.driving.ended();
        }
    }

    fn steer(&mut self, now: Moment, command: OperatorCommand) {
        let id = self.ids.fresh(now.ns);
        let whose = For::Question;
        let order = self.driving.begin(now, Duration::ZERO, id, command, whose);
        self.driving.ended();
        self.effects.push(Effect::Steer(order));
    }
}
