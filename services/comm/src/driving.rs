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
//! Nothing here ends a setpoint in time. A setpoint that is not renewed ends in the bridge, 120 ms
//! later. If comm was held up for that long, the setpoint is over, and comm does not take it up
//! again.

use core::time::Duration;

use lager_topics::{Finish, Health, Origin, Refusal, SteeringOrder, SteeringReport};
use lager_wire::OperatorCommand;

use crate::moment::Moment;

/// How often the command is renewed, in robot time; its lease is three times as long.
const RENEWAL: Duration = Duration::from_millis(40);

/// Its lease in the bridge, in robot time.
const LEASE: Duration = Duration::from_millis(120);

/// The longest that a one-shot may take, in robot time: no turn and no step of the arm takes half.
const LONGEST: Duration = Duration::from_secs(20);

/// What is carried out.
#[derive(Clone, Debug, Default)]
pub(crate) struct Driving {
    running: Option<Running>,
}

#[derive(Clone, Copy, Debug)]
struct Running {
    command: OperatorCommand,
    order: SteeringOrder,
    begun: Duration,
    renewed: Duration,
}

impl Driving {
    /// Begins `command` under a new `id`, in place of whatever was carried out.
    pub(crate) fn begin(
        &mut self,
        now: Moment,
        id: u32,
        command: OperatorCommand,
    ) -> SteeringOrder {
        let order = SteeringOrder {
            given_ns: now.ns,
            id,
            origin: Origin::Operator.into(),
            code: command.firmware().code(),
            ..SteeringOrder::default()
        };
        // Standing needs no renewal.
        self.running = (command != OperatorCommand::Stop).then_some(Running {
            command,
            order,
            begun: now.robot,
            renewed: now.robot,
        });
        order
    }

    /// Lets go of it; whether there was anything.
    pub(crate) fn let_go(&mut self) -> bool {
        self.running.take().is_some()
    }

    /// Whether something is carried out.
    pub(crate) const fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Whether something is carried out that ends by itself and is waited for.
    pub(crate) fn is_awaited(&self) -> bool {
        self.running.is_some_and(|running| running.is_one_shot())
    }

    /// When it is to be renewed, in robot time.
    pub(crate) fn due(&self) -> Option<Duration> {
        self.running.map(|running| running.renewed + RENEWAL)
    }

    /// What to renew at this moment; `Err` is why it is over.
    pub(crate) fn renew(&mut self, now: Duration) -> Result<Option<SteeringOrder>, String> {
        let Some(running) = &mut self.running else {
            return Ok(None);
        };
        let pause = now.saturating_sub(running.renewed);
        if pause >= LEASE {
            let ended = format!(
                "{} is over: the robot was held up for {} ms; give it anew",
                running.command.name(),
                pause.as_millis()
            );
            self.running = None;
            return Err(ended);
        }
        if running.is_one_shot() && now.saturating_sub(running.begun) >= LONGEST {
            let ended = format!("{} does not come to its end", running.command.name());
            self.running = None;
            return Err(ended);
        }
        if pause < RENEWAL {
            return Ok(None);
        }
        running.renewed = now;
        Ok(Some(running.order))
    }

    /// The board has reported; a sentence where a command has ended otherwise than as wished.
    pub(crate) fn reported(&mut self, report: &SteeringReport) -> Option<String> {
        let running = self.running?;
        let is_own = report.finished_origin.get() == Some(Origin::Operator)
            && report.finished_id == running.order.id;
        let finish = report.finish.get().filter(|_| is_own)?;
        let how = match finish {
            Finish::None => return None,
            Finish::Done => {
                self.running = None;
                return None;
            }
            Finish::Aborted => "was cut short",
            // The bridge says why; see `refused`.
            Finish::Refused => "was refused",
            Finish::NoWord => "has ended: the sensor board does not report",
            Finish::NoTape => "has ended: there is no tape",
        };
        // Why it was refused comes with the health, which may be a little later.
        if finish == Finish::Refused {
            return None;
        }
        self.running = None;
        Some(format!("{} {how}", running.command.name()))
    }

    /// The bridge has told who may steer; a sentence where it has refused the command.
    pub(crate) fn refused(&mut self, health: &Health) -> Option<String> {
        let running = self.running?;
        let is_own = health.refused_origin.get() == Some(Origin::Operator)
            && health.refused_id == running.order.id;
        let why = health.refusal.get().filter(|_| is_own)?;
        if why == Refusal::None {
            return None;
        }
        self.running = None;
        Some(format!("{} is refused: {why}", running.command.name()))
    }
}

impl Running {
    fn is_one_shot(&self) -> bool {
        self.command.firmware().is_one_shot()
    }
}
