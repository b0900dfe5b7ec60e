//! [`Driving`]: the one command to wheels or arm that a person gives, and how long it holds.
//!
//! ```text
//!              begin                       ended by the board, refused, or 20 s
//!   standing ────────> one-shot running ────────────────────────────────────────> standing
//!      │                                    begin: another command replaces it
//!      └──────────────> setpoint in force ───────┐
//!         begin            ▲   │ renewed         │
//!                          │   └ every 40 ms     │
//!                          └─────────────────────┘
//! ```
//!
//! A setpoint that answers a question of the document ends with the next command or with the link.
//! A setpoint of an action holds for the time that came with it, in real time from its receipt,
//! unless another action renews it. When the time is over, the robot stands.
//!
//! If comm was delayed for as long as the bridge's lease of 120 ms, it has lost the command and
//! does not take it up again. It also does not renew the command when the steering board has not
//! reported for 200 ms: bridge or board may have gone, and the old command must not move the robot
//! when they are back.

use core::time::Duration;

use lager_orders::lease::{RENEWAL, SETPOINT, UNHEARD};
use lager_orders::{Code, Moment, Reason};
use lager_topics::{Finish, Health, Origin, Refusal, SteeringOrder, SteeringReport};
use lager_wire::{OperatorCommand, Version};

/// The longest time for a one-shot, in robot time. No turn and no step of the arm takes half of it.
const LONGEST: Duration = Duration::from_secs(20);

/// The command that is carried out.
#[derive(Clone, Debug, Default)]
pub struct Driving {
    running: Option<Running>,
    ended: Vec<Finished>,
}

/// Who wants a command carried out, and for how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum For {
    /// The answer to a question of the document.
    Question,
    /// An action.
    Action {
        /// The action's number.
        number: u32,
        /// When its time is over, in ns of real time, if it has a limit.
        until_ns: Option<u64>,
    },
}

/// The end of a command, or its start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finished {
    /// The actions that must be answered. None for a question's command, or if they were answered
    /// when the command began.
    pub numbers: Vec<u32>,
    /// Done, or why not.
    pub result: Result<(), Reason>,
}

#[derive(Clone, Debug)]
struct Running {
    command: OperatorCommand,
    order: SteeringOrder,
    begun: Duration,
    renewed: Duration,
    /// When the steering board reported last; at first, when the command began.
    heard: Duration,
    /// The actions that have not been answered yet.
    unanswered: Vec<u32>,
    /// When the command is over unless it is renewed, in ns of real time.
    until_ns: Option<u64>,
    /// The steering board has the command.
    has_begun: bool,
    /// The command was refused, and the reason is not known yet.
    is_refused: bool,
}

impl Driving {
    /// How many actions for one command may wait for their answer. Further ones are not answered.
    const MOST_UNANSWERED: usize = 16;

    /// Begins `command`, which comes so `late`, under a new `id`, in place of the present command.
    pub fn begin(
        &mut self,
        now: Moment,
        late: Duration,
        id: u32,
        command: OperatorCommand,
        whose: For,
    ) -> SteeringOrder {
        self.let_go(Code::Replaced);
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
        // A command to stand needs no renewal.
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
            has_begun: false,
            is_refused: false,
        };
        self.running = Some(Running {
            // A turn and a step of the arm end by themselves.
            until_ns: until_ns.filter(|_| !running.is_one_shot()),
            ..running
        });
        order
    }

    /// Lets the present setpoint hold until another time, for one more action. Returns whether
    /// `command` is that setpoint.
    pub fn prolong(&mut self, command: OperatorCommand, number: u32, until_ns: u64) -> bool {
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

    /// Drops the present command, and answers all actions that wait for it with the reason. Returns
    /// whether there was a command.
    pub fn let_go(&mut self, why: impl Into<Reason>) -> bool {
        let Some(running) = self.running.take() else {
            return false;
        };
        self.answer(running.unanswered, Err(why.into()));
        true
    }

    /// Takes the list of commands that have ended or begun.
    pub fn ended(&mut self) -> Vec<Finished> {
        core::mem::take(&mut self.ended)
    }

    /// To be called when nobody wants to hear of actions any more.
    pub fn forget_actions(&mut self) {
        if let Some(running) = &mut self.running {
            running.unanswered.clear();
        }
    }

    /// Whether a command is carried out.
    pub const fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Whether the steering board has the command.
    pub fn has_begun(&self) -> bool {
        self.running
            .as_ref()
            .is_some_and(|running| running.has_begun)
    }

    /// Whether a command is carried out that ends by itself and for whose end somebody waits.
    pub fn is_awaited(&self) -> bool {
        self.running.as_ref().is_some_and(Running::is_one_shot)
    }

    /// Whether an action's time is over, so that the robot must stand.
    pub fn is_over(&self, now: Moment) -> bool {
        let until_ns = self.running.as_ref().and_then(|running| running.until_ns);
        until_ns.is_some_and(|until_ns| now.ns >= until_ns)
    }

    /// When the command must be renewed, in robot time.
    pub fn due(&self) -> Option<Duration> {
        self.running
            .as_ref()
            .map(|running| running.renewed + RENEWAL)
    }

    /// The order to renew now, if one is due.
    pub fn renew(&mut self, now: Duration) -> Option<SteeringOrder> {
        let running = self.running.as_mut()?;
        let pause = now.saturating_sub(running.renewed);
        if pause >= SETPOINT {
            let ms = pause.as_millis();
            self.end(|name| Reason::new(Code::OverHeldUp, &[&name, &ms]));
            return None;
        }
        let unheard = now.saturating_sub(running.heard);
        if unheard >= UNHEARD {
            let ms = unheard.as_millis();
            self.end(|name| Reason::new(Code::OverUnheard, &[&name, &ms]));
            return None;
        }
        if running.is_one_shot() && now.saturating_sub(running.begun) >= LONGEST {
            self.end(|name| Reason::new(Code::Endless, &[&name]));
            return None;
        }
        if pause < RENEWAL {
            return None;
        }
        if running.is_refused {
            // The bridge would have said why by now.
            self.end(|name| Finish::Refused.of(name));
            return None;
        }
        running.renewed = now;
        Some(running.order)
    }

    /// To be called with the bridge's report of what the board does.
    pub fn reported(&mut self, now: Duration, report: &SteeringReport) {
        let Some(running) = &mut self.running else {
            return;
        };
        if report.age_ms == 0 {
            running.heard = now;
        }
        let id = running.order.id;
        let is_own = |origin: Option<Origin>, told| origin == Some(Origin::Operator) && told == id;
        let has_begun = is_own(report.current_origin.get(), report.current_id);
        running.has_begun |= has_begun;
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
            // The reason comes with the health sample, which may be a little later.
            Some(Finish::Refused) => {
                if let Some(running) = &mut self.running {
                    running.is_refused = true;
                }
            }
            Some(finish) => self.end(|name| finish.of(name)),
        }
    }

    /// To be called with the bridge's report of who may steer.
    pub fn refused(&mut self, now: Duration, health: &Health) {
        let Some(running) = &mut self.running else {
            return;
        };
        // An original board reports nothing, so the bridge's own report must do.
        if health.steering.up != 0 && health.steering.version == Version::Original as u8 {
            running.heard = now;
        }
        let is_own = health.refused_origin.get() == Some(Origin::Operator)
            && health.refused_id == running.order.id;
        match health.refusal.get().filter(|_| is_own) {
            None | Some(Refusal::None) => {}
            Some(why) => {
                self.end(|name| Reason::new(Code::Refused, &[&name, &Reason::from(why).as_str()]));
            }
        }
    }

    /// The command has ended, but was not carried out.
    fn end(&mut self, how: impl FnOnce(&str) -> Reason) {
        let Some(running) = self.running.take() else {
            return;
        };
        let result = Err(how(running.command.name()));
        self.ended.push(Finished {
            numbers: running.unanswered,
            result,
        });
    }

    fn answer(&mut self, numbers: Vec<u32>, result: Result<(), Reason>) {
        if !numbers.is_empty() {
            self.ended.push(Finished { numbers, result });
        }
    }
}

impl Running {
    fn is_one_shot(&self) -> bool {
        self.command.firmware().is_one_shot()
    }
}
