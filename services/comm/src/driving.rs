//! The one command that is carried out for the external computer.
//!
//! ```text
//!              begin                       ended by the board, refused, or 20 s
//!   standing ────────> one-shot running ────────────────────────────────────────> standing
//!      │                                    begin: another one takes its place
//!      └──────────────> setpoint in force ───────┐
//!         begin            ▲   │ renewed         │
//!                          │   └ every 40 ms     │
//!                          └─────────────────────┘
//! ```
//!
//! A setpoint that answers a question of the document ends with the next command or the link. One
//! of an action holds for the time that came with it, in real time from its receipt, unless a
//! further action renews it; then the robot is made to stand.
//!
//! Whoever was held up for as long as the bridge's lease of 120 ms has lost the command, and does
//! not take it up again. Nor is it renewed when the steering board has not reported for 200 ms:
//! bridge or board may have gone, and what comes in its place must not move the robot by it.

use core::time::Duration;

use lager_topics::{Finish, Health, Origin, Refusal, SteeringOrder, SteeringReport};
use lager_wire::{OperatorCommand, Version};

use crate::moment::Moment;

/// How often the command is renewed, in robot time; its lease is three times as long.
const RENEWAL: Duration = Duration::from_millis(40);

/// Its lease in the bridge, in robot time.
const LEASE: Duration = Duration::from_millis(120);

/// How long the steering board may be silent, in robot time: the bridge then lets nothing move.
const UNHEARD: Duration = Duration::from_millis(200);

/// The longest that a one-shot may take, in robot time: no turn and no step of the arm takes half.
const LONGEST: Duration = Duration::from_secs(20);

/// What is carried out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Driving {
    running: Option<Running>,
    ended: Vec<Ended>,
}

/// Who wants a command carried out, and for how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum For {
    /// The answer to a question of the document.
    Question,
    /// The action with this number; `until_ns` is when its time is over, if it has one.
    Action { number: u32, until_ns: Option<u64> },
}

/// How a command has ended, or that it has begun.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Ended {
    /// The actions that are to be answered; none where it was a question's, or where they have been
    /// answered when it began.
    pub(crate) numbers: Vec<u32>,
    /// Done, or why not.
    pub(crate) result: Result<(), String>,
}

#[derive(Clone, Debug)]
struct Running {
    command: OperatorCommand,
    order: SteeringOrder,
    begun: Duration,
    renewed: Duration,
    /// When the steering board reported last, or when this began.
    heard: Duration,
    /// The actions that have not been answered yet.
    unanswered: Vec<u32>,
    /// When it is over unless it is renewed, in real time.
    until_ns: Option<u64>,
    /// It was refused, and nobody has said why yet.
    is_refused: bool,
}

impl Driving {
    /// Actions for one command that may wait for their answer; who sends more is not answered.
    const MOST_UNANSWERED: usize = 16;

    /// Begins `command`, which comes so `late`, under a new `id`, in place of whatever was carried
    /// out.
    pub(crate) fn begin(
        &mut self,
        now: Moment,
        late: Duration,
        id: u32,
        command: OperatorCommand,
        whose: For,
    ) -> SteeringOrder {
        self.let_go("another command has taken its place");
        let order = SteeringOrder {
            given_ns: now.given_ns(late),
            id,
            origin: Origin::Operator.into(),
            code: command.firmware().code(),
            ..SteeringOrder::default()
        };
        let (number, until_ns) = match whose {
            For::Question => (None, None),
            For::Action { number, until_ns } => (Some(number), until_ns),
        };
        // Standing needs nobody who renews it.
        if command == OperatorCommand::Stop {
            self.answer(number.into_iter().collect(), Ok(()));
            return order;
        }
        let running = Running {
            command,
            order,
            begun: now.robot,
            renewed: now.robot,
            heard: now.robot,
            unanswered: number.into_iter().collect(),
            until_ns: None,
            is_refused: false,
        };
        self.running = Some(Running {
            // A turn and a step of the arm end by themselves.
            until_ns: until_ns.filter(|_| !running.is_one_shot()),
            ..running
        });
        order
    }

    /// Lets the setpoint in force hold until another time, for one more action; whether it is this
    /// one.
    pub(crate) fn prolong(&mut self, command: OperatorCommand, number: u32, until_ns: u64) -> bool {
        let Some(running) = &mut self.running else {
            return false;
        };
        if running.command != command || running.until_ns.is_none() {
            return false;
        }
        running.until_ns = Some(until_ns);
        if running.unanswered.len() < Self::MOST_UNANSWERED {
            running.unanswered.push(number);
        }
        true
    }

    /// Lets go of it, and answers whoever still waits for it with the reason; whether there was
    /// anything.
    pub(crate) fn let_go(&mut self, why: &str) -> bool {
        let Some(running) = self.running.take() else {
            return false;
        };
        self.answer(running.unanswered, Err(why.to_owned()));
        true
    }

    /// How commands have ended or begun; it is then no longer here.
    pub(crate) fn ended(&mut self) -> Vec<Ended> {
        core::mem::take(&mut self.ended)
    }

    /// Nobody is left who wants to hear of actions.
    pub(crate) fn forget_actions(&mut self) {
        if let Some(running) = &mut self.running {
            running.unanswered.clear();
        }
    }

    /// Whether something is carried out.
    pub(crate) const fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Whether something is carried out that ends by itself and is waited for.
    pub(crate) fn is_awaited(&self) -> bool {
        self.running.as_ref().is_some_and(Running::is_one_shot)
    }

    /// Whether an action's time is over, so that the robot is to stand.
    pub(crate) fn is_over(&self, now: Moment) -> bool {
        let until_ns = self.running.as_ref().and_then(|running| running.until_ns);
        until_ns.is_some_and(|until_ns| now.ns >= until_ns)
    }

    /// When it is to be renewed, in robot time.
    pub(crate) fn due(&self) -> Option<Duration> {
        self.running
            .as_ref()
            .map(|running| running.renewed + RENEWAL)
    }

    /// What to renew at this moment.
    pub(crate) fn renew(&mut self, now: Duration) -> Option<SteeringOrder> {
        let running = self.running.as_mut()?;
        let pause = now.saturating_sub(running.renewed);
        if pause >= LEASE {
            let why = format!(
                "is over: the robot was held up for {} ms; give it anew",
                pause.as_millis()
            );
            self.end(&why);
            return None;
        }
        let unheard = now.saturating_sub(running.heard);
        if unheard >= UNHEARD {
            let why = format!(
                "is over: the steering board has not reported for {} ms; give it anew",
                unheard.as_millis()
            );
            self.end(&why);
            return None;
        }
        if running.is_one_shot() && now.saturating_sub(running.begun) >= LONGEST {
            self.end("does not come to its end");
            return None;
        }
        if pause < RENEWAL {
            return None;
        }
        if running.is_refused {
            // The bridge would have said why by now.
            self.end(&Finish::Refused.to_string());
            return None;
        }
        running.renewed = now;
        Some(running.order)
    }

    /// The bridge has told what the board does.
    pub(crate) fn reported(&mut self, now: Duration, report: &SteeringReport) {
        let Some(running) = &mut self.running else {
            return;
        };
        if report.age_ms == 0 {
            running.heard = now;
        }
        let id = running.order.id;
        let is_own = |origin: Option<Origin>, told| origin == Some(Origin::Operator) && told == id;
        let has_begun = is_own(report.current_origin.get(), report.current_id);
        if has_begun && !running.is_one_shot() {
            let numbers = core::mem::take(&mut running.unanswered);
            self.answer(numbers, Ok(()));
        }
        if !is_own(report.finished_origin.get(), report.finished_id) {
            return;
        }
        match report.finish.get() {
            None | Some(Finish::None) => {}
            Some(Finish::Done) => {
                let numbers = self.running.take().map(|running| running.unanswered);
                self.answer(numbers.unwrap_or_default(), Ok(()));
            }
            // Why it was refused comes with the health, which may be a little later.
            Some(Finish::Refused) => {
                if let Some(running) = &mut self.running {
                    running.is_refused = true;
                }
            }
            Some(finish) => self.end(&finish.to_string()),
        }
    }

    /// The bridge has told who may steer.
    pub(crate) fn refused(&mut self, now: Duration, health: &Health) {
        let Some(running) = &mut self.running else {
            return;
        };
        // An original board reports nothing, so its bridge has to do.
        if health.steering.up != 0 && health.steering.version == Version::Original as u8 {
            running.heard = now;
        }
        let is_own = health.refused_origin.get() == Some(Origin::Operator)
            && health.refused_id == running.order.id;
        match health.refusal.get().filter(|_| is_own) {
            None | Some(Refusal::None) => {}
            Some(why) => self.end(&format!("is refused: {why}")),
        }
    }

    /// It has ended otherwise than wished.
    fn end(&mut self, how: &str) {
        let Some(running) = self.running.take() else {
            return;
        };
        let result = Err(format!("{} {how}", running.command.name()));
        self.ended.push(Ended {
            numbers: running.unanswered,
            result,
        });
    }

    fn answer(&mut self, numbers: Vec<u32>, result: Result<(), String>) {
        if !numbers.is_empty() {
            self.ended.push(Ended { numbers, result });
        }
    }
}

impl Running {
    fn is_one_shot(&self) -> bool {
        self.command.firmware().is_one_shot()
    }
}
