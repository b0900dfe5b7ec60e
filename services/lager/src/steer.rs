//! The one-shot commands: `drive`, `arm`, `resume`, `mode`, `picked`, `reset`, `gains` and
//! `calibrate`. The commands about orders and those that act like hands have their own files.
//! `stop` is apart, because it must work without the bus.
//!
//! Each opens the bus as an operator, does one thing through the same [`Hands`] as `up`, waits
//! until the robot shows the effect, and says what came of it.

use std::time::{Duration, Instant};

use anyhow::{Result, anyhow, bail};
use lager_bridge::arbiter::{LEASE, REPORT_DEADLINE};
use lager_lines::LATEST_MOVE;
use lager_ports::{Bus, BusConfig, Clock, Stop, Subscriber};
use lager_topics::{
    Answer, Ask, AskKind, EventKind, Finish, Health, Input, InputKind, LinkHealth, MissionEvent,
    Mode, NavStatus, NavigatorStatus, Origin, Outcome, Phase, Pick, Refusal, Role, SteeringOrder,
    SteeringState, StopCause, Topic,
};
use lager_wire::{OperatorCommand, Version};

use crate::config::Config;
use crate::hands::Hands;
use crate::patience::Patience;
use crate::runtime::RuntimeFolder;
use crate::stop;

mod map;
mod queue;
mod world;

pub use world::{Obstacle, Place};

/// How often an order is renewed, in robot time; its lease is three times as long.
const RENEW: Duration = Duration::from_millis(40);
/// How long a calibration may take in robot time; the board watches its sensors for five seconds.
const CALIBRATION: Duration = Duration::from_secs(8);
/// An operator at work on a robot that is up.
pub struct Operator {
    patience: Patience,
    bus: Bus,
    hands: Hands,
    /// What the robot was started with.
    running: Config,
    health: Subscriber<LinkHealth>,
}

impl Operator {
    /// Opens the bus and waits for the bridge.
    ///
    /// # Errors
    /// When no bridge of this robot answers.
    pub fn new(config: &Config, patience: Patience) -> Result<Self> {
        // The robot's clock may be another than this command's configuration says.
        let running = RuntimeFolder::running(config)?.unwrap_or_else(|| config.clone());
        let BusConfig { speed, clock, .. } = running.bus()?;
        let bus = BusConfig {
            speed,
            clock,
            ..config.bus()?
        };
        // Until the robot has taken a command that lasts, all of it is one call.
        patience.watchdog.enter("the command");
        let bus = Bus::open(&bus, Role::Operator)?;
        let operator = Self {
            hands: Hands::new(&bus)?,
            running,
            health: bus.subscriber()?,
            bus,
            patience,
        };
        Ok(operator)
    }

    /// Ctrl-C; then the robot stands, because its order is no longer renewed.
    pub fn drive(&mut self, command: OperatorCommand, seconds: Option<f64>) -> Result<String> {
        let health = self.health()?;
        if health.mode.get() != Some(Mode::Manual) {
            bail!("the robot is autonomous; `lager mode manual` lets you drive");
        }
        self.carry_out(command, seconds)
    }

    /// `lager arm`: one step of the arm.
    pub fn arm(&mut self, command: OperatorCommand) -> Result<String> {
        self.carry_out(command, None)
    }

    /// `lager resume`: releases the stop that was set when its command was given, tells which that
    /// is, and what truly happened.
    pub fn resume(&self, config: &Config, before: Option<Stop>) -> Result<String> {
        if let Some(stop) = before {
            let said = stop::describe(stop.origin(), stop.cause(), stop.at_ns());
            crate::say(&format!("it was stopped {said}"))?;
        }
        let answer = self.hands.ask(Ask {
            kind: AskKind::Resume.into(),
            stop_word: before.map_or(0, Stop::word),
            lifetime_ms: u32::try_from(LATEST_MOVE.as_millis())?,
            ..Ask::default()
        })?;
        match (answer.outcome.get(), before) {
            (Some(Outcome::Done), Some(_)) if answer.stopped == 0 => {
                Ok("the stop is released".into())
            }
            (Some(Outcome::Done), None) if answer.stopped == 0 => {
                Ok("the robot was not stopped".into())
            }
            _ => match stop::current(config)? {
                Some(stop) => bail!(
                    "it stays stopped: a newer stop is set, {}; give `lager resume` anew to release it",
                    stop::describe(stop.origin(), stop.cause(), stop.at_ns())
                ),
                None => bail!("the bridge does not release the stop now; try again"),
            },
        }
    }

    /// `lager mode`.
    pub fn mode(&self, mode: Mode) -> Result<String> {
        self.ask(Ask {
            kind: AskKind::SetMode.into(),
            mode: mode.into(),
            ..Ask::default()
        })?;
        Ok(match mode {
            Mode::Manual => "the operator steers".into(),
            Mode::Autonomous => "logic steers".into(),
        })
    }

    /// `lager picked`: repeated until logic goes on, or refuses to because it does not feel the
    /// goods.
    pub fn picked(&self, force: bool) -> Result<String> {
        let mut events = self.bus.subscriber::<MissionEvent>()?;
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let waits = |phase| phase == Some(Phase::Picking);
        if !waits(first(&mut status, &self.bus, &self.patience)?.phase.get()) {
            bail!("the robot does not wait at a pick station; nothing is to be picked up now");
        }
        let input = Input {
            kind: match force {
                true => InputKind::PickupForced.into(),
                false => InputKind::PickupDone.into(),
            },
            ..Input::default()
        };
        self.press_until(input, &mut status, |status| {
            while let Some(event) = events.receive()? {
                if event.kind.get() == Some(EventKind::PickupRefused) {
                    let why = event.failure;
                    bail!("logic refuses to leave: {why}; `lager picked --force` overrules it");
                }
            }
            Ok(!waits(status.phase.get()))
        })?;
        Ok("the robot takes the product to delivery".into())
    }

    /// `lager pick`: repeated until logic shows it.
    pub fn pick(&self, pick: Pick) -> Result<String> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let input = Input {
            kind: match pick {
                Pick::Manual => InputKind::PickByHand.into(),
                Pick::Auto => InputKind::PickByItself.into(),
            },
            ..Input::default()
        };
        self.press_until(input, &mut status, |status| Ok(status.pick == pick))?;
        Ok(match pick {
            Pick::Manual => "a person picks the goods up".into(),
            Pick::Auto => "the robot picks the goods up by itself".into(),
        })
    }

    /// `lager reset`: repeated until logic has taken it.
    pub fn reset(&self) -> Result<String> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let input = Input {
            kind: InputKind::ResetPressed.into(),
            ..Input::default()
        };
        self.press_until(input, &mut status, |status| {
            let phase = status.phase.get();
            Ok(matches!(
                phase,
                Some(Phase::WaitingForOrder | Phase::WaitingForMap)
            ))
        })?;
        Ok("the robot takes it that it stands on the delivery node".into())
    }

    /// `lager press switch`: the other mode. A press toggles, so it is made once.
    pub fn switch(&mut self) -> Result<String> {
        let before = self.health()?.mode;
        self.hands.press(Input {
            kind: InputKind::SwitchPressed.into(),
            id: Hands::fresh_id(),
            ..Input::default()
        })?;
        while !self.patience.is_over() {
            if let Some(health) = self.health.latest()?
                && health.mode != before
            {
                return Ok(match health.mode.get() {
                    Some(Mode::Autonomous) => "logic steers".into(),
                    _ => "the operator steers".into(),
                });
            }
            self.patience.pause(Duration::from_millis(20))?;
        }
        bail!("the bridge does not react")
    }

    /// Presses a button until logic shows the effect.
    fn press_until(
        &self,
        input: Input,
        status: &mut Subscriber<NavStatus>,
        mut done: impl FnMut(&NavigatorStatus) -> Result<bool>,
    ) -> Result<()> {
        let pressed = Clock::monotonic_ns();
        let id = Hands::fresh_id();
        loop {
            self.hands.press(Input { id, ..input })?;
            self.patience.pause(Duration::from_millis(50))?;
            if let Some(status) = status.latest()?
                && status.stamp().publish_time_ns > pressed
                && done(&status)?
            {
                return Ok(());
            }
            if self.patience.is_over() {
                bail!("logic does not react; is the robot up? (`lager up`)");
            }
        }
    }

    /// `lager gains`.
    pub fn gains(&self, gain_p: u8, gain_d: u8) -> Result<String> {
        let answer = self.ask(Ask {
            kind: AskKind::SetGains.into(),
            gain_p,
            gain_d,
            ..Ask::default()
        })?;
        Ok(format!(
            "the gains in force are {} and {}",
            answer.gain_p, answer.gain_d
        ))
    }

    /// `lager calibrate`: waits for the end, and tells it.
    pub fn calibrate(&mut self) -> Result<String> {
        let ended_before = self.health()?.calibrations_ended;
        self.ask(Ask {
            kind: AskKind::Calibrate.into(),
            ..Ask::default()
        })?;
        crate::say("calibrating for five seconds: move the robot over tape and floor")?;
        let clock = self.bus.clock();
        let give_up = clock.now() + CALIBRATION;
        let mut heard = None;
        while clock.now() < give_up {
            if let Some(health) = self.health.latest()? {
                heard = Some(Instant::now());
                if health.calibrations_ended != ended_before {
                    return calibrated(&health);
                }
            }
            if self.patience.is_silent(heard) {
                bail!("the bridge has fallen silent; nobody knows how the calibration went");
            }
            self.patience.rest(Duration::from_millis(20))?;
        }
        bail!("the sensor board does not say how the calibration went; try again")
    }

    fn ask(&self, ask: Ask) -> Result<Answer> {
        let answer = self.hands.ask(ask)?;
        match answer.outcome.get() {
            Some(Outcome::Done) => Ok(answer),
            Some(outcome) => Err(anyhow!("{outcome}")),
            None => Err(anyhow!("the bridge answers what nobody here understands")),
        }
    }

    fn health(&mut self) -> Result<Health> {
        first(&mut self.health, &self.bus, &self.patience)
    }

    /// Gives an order and renews it until it has finished or its time is over.
    fn carry_out(&mut self, command: OperatorCommand, seconds: Option<f64>) -> Result<String> {
        let name = command.name();
        let health = self.health()?;
        if health.stopped != 0 {
            bail!(
                "the robot is stopped {}; `lager resume` releases the stop",
                by(&health)
            );
        }
        if let Some(why) = health.blocked.get().filter(|why| *why != Refusal::None) {
            bail!("`{name}` is not possible now: {why}");
        }
        let mode = health.mode.get();
        let mut state = self.bus.subscriber::<SteeringState>()?;
        let order = SteeringOrder {
            id: Hands::fresh_id(),
            origin: Origin::Operator.into(),
            code: command.firmware().code(),
            arm_granted: 0,
            ..SteeringOrder::default()
        };
        let clock = self.bus.clock();
        let end = match seconds {
            Some(seconds) => Some(clock.now() + Duration::try_from_secs_f64(seconds)?),
            None => None,
        };
        let mut accepted = false;
        let mut ended = None;
        let mut renewed = clock.now();
        // When the steering board reported last.
        let mut reported = renewed;
        while end.is_none_or(|end| clock.now() < end) {
            // This process was stopped and continued, or kept from its core: the order that it
            // renewed is over.
            let pause = clock.now().saturating_sub(renewed);
            if pause >= LEASE {
                bail!(
                    "this command was held up for {} ms, so the robot stands; give it anew",
                    pause.as_millis()
                );
            }
            renewed = clock.now();
            self.hands.steer(order)?;
            // A user who lets go by Ctrl-C has done what he wanted.
            if self.patience.rest(clock.real(RENEW)).is_err() {
                break;
            }
            if let Some(report) = state.latest()? {
                if report.age_ms == 0 {
                    reported = clock.now();
                }
                let own =
                    |origin: Option<Origin>, id| origin == Some(Origin::Operator) && id == order.id;
                accepted |= own(report.current_origin.get(), report.current_id);
                if own(report.finished_origin.get(), report.finished_id) {
                    ended = report.finish.get();
                }
            }
            if let Some(health) = self.health.latest()?.map(|health| *health) {
                // An original board reports nothing, so its bridge has to do.
                if health.steering.up != 0 && health.steering.version == Version::Original as u8 {
                    reported = clock.now();
                }
                if health.refused_origin.get() == Some(Origin::Operator)
                    && health.refused_id == order.id
                    && let Some(why) = health.refusal.get()
                {
                    bail!("the bridge refuses `{name}`: {why}");
                }
                if health.stopped != 0 {
                    bail!("the robot has been stopped {}", by(&health));
                }
                if health.mode.get() != mode {
                    bail!("the mode has been changed; somebody else steers now");
                }
                if let Some(why) = health.blocked.get().filter(|why| *why != Refusal::None) {
                    bail!("`{name}` was cut short: {why}");
                }
                match ended {
                    Some(Finish::Done) => return Ok(format!("`{name}` is done")),
                    Some(Finish::None) | None => (),
                    Some(finish) => bail!("`{name}` {finish}"),
                }
            }
            // Bridge or board may have gone, and what comes in its place must not move the robot by
            // an order that was given before.
            let unheard = clock.now().saturating_sub(reported);
            if unheard >= REPORT_DEADLINE {
                bail!(
                    "the steering board has not reported for {} ms, so the robot stands; give it \
                     anew",
                    unheard.as_millis()
                );
            }
            if !accepted && self.patience.is_over() {
                bail!("the robot does not carry out `{name}`; `lager doctor` looks for the cause");
            }
        }
        Ok(format!("let go of `{name}`"))
    }
}

/// Who has stopped the robot, and why.
fn by(health: &Health) -> String {
    let cause = health.stop_cause.get().unwrap_or(StopCause::WordDamaged);
    stop::describe(health.stop_origin.get(), cause, health.stopped_at_ns)
}

/// How a calibration has ended.
fn calibrated(health: &Health) -> Result<String> {
    match health.calibration_failure() {
        None => {
            Ok("the line sensors are calibrated: each of them has seen both floor and tape".into())
        }
        Some(why) => bail!(why),
    }
}

/// The state a topic holds; the services publish theirs several times a second.
fn first<T: Topic>(
    subscriber: &mut Subscriber<T>,
    bus: &Bus,
    patience: &Patience,
) -> Result<T::Payload> {
    loop {
        if let Some(sample) = subscriber.latest()? {
            return Ok(*sample);
        }
        if patience.is_over() {
            bail!(
                "nobody publishes {} of the robot `{}`; is it up? (`lager up`)",
                T::NAME,
                bus.robot()
            );
        }
        patience.pause(Duration::from_millis(5))?;
    }
}
