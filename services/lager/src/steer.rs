//! The one-shot commands: `drive`, `arm`, `stop`, `resume`, `mode`, `fetch`, `picked`, `reset`,
//! `gains`, `calibrate`.
//!
//! Each opens the bus as an operator, does one thing through the same [`Hands`] as `up`, waits
//! until the robot shows the effect, and says what came of it.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use lager_ports::{Bus, BusConfig, Clock, Shutdown, Subscriber};
use lager_topics::{
    Answer, Ask, AskKind, EventKind, Finish, Health, Input, InputKind, LinkHealth, LogThought,
    MissionEvent, Mode, NavStatus, Order, OrderKind, Origin, Outcome, Phase, Role, SteeringOrder,
    SteeringState, Topic,
};
use lager_wire::{Command, OperatorCommand, WheelCommand, parse_code};

use crate::config::Config;
use crate::hands::Hands;
use crate::runtime::RuntimeFolder;

/// How often an order is renewed, in robot time; its lease is 120 ms.
const RENEW: Duration = Duration::from_millis(40);
/// How long the robot may take to show an effect, in real time.
const PATIENCE: Duration = Duration::from_secs(3);

/// An operator at work on a robot that is up.
pub struct Operator {
    bus: Bus,
    hands: Hands,
    health: Subscriber<LinkHealth>,
}

impl Operator {
    /// Opens the bus and waits for the bridge.
    ///
    /// # Errors
    /// When no bridge of this robot answers.
    pub fn new(config: &Config) -> Result<Self> {
        // The robot's clock may be another than this command's configuration says.
        let running = RuntimeFolder::running(config)?.map(|running| running.bus());
        let bus = match running.transpose()? {
            Some(BusConfig { speed, clock, .. }) => BusConfig {
                speed,
                clock,
                ..config.bus()?
            },
            None => config.bus()?,
        };
        let bus = Bus::open(&bus, Role::Operator)?;
        let operator = Self {
            hands: Hands::new(&bus)?,
            health: bus.subscriber()?,
            bus,
        };
        Ok(operator)
    }

    /// `lager drive`: gives the order and renews it until it is done, `seconds` have passed or
    /// Ctrl-C; then the robot stands, because nobody renews it any more.
    pub fn drive(
        &mut self,
        command: &str,
        seconds: Option<f64>,
        shutdown: &Shutdown,
    ) -> Result<String> {
        let command = parse(command, OperatorCommand::wheel)?;
        if matches!(command, OperatorCommand::Arm(_)) {
            bail!("0x{:02X} moves the arm; use `lager arm`", command.code());
        }
        if command == OperatorCommand::Stop {
            return self.stop();
        }
        let health = self.health()?;
        if health.mode.get() != Some(Mode::Manual) {
            bail!("the robot is autonomous; `lager mode manual` lets you drive");
        }
        self.carry_out(command, seconds, shutdown)
    }

    /// `lager arm`: one step of the arm.
    pub fn arm(&mut self, command: &str, shutdown: &Shutdown) -> Result<String> {
        let command = parse(command, OperatorCommand::arm)?;
        if !matches!(command, OperatorCommand::Arm(_)) {
            bail!(
                "0x{:02X} drives the wheels; use `lager drive`",
                command.code()
            );
        }
        self.carry_out(command, None, shutdown)
    }

    /// `lager stop`: latched by the bridge before this returns.
    pub fn stop(&mut self) -> Result<String> {
        let order = SteeringOrder {
            id: Hands::fresh_id(),
            origin: Origin::Operator.into(),
            kind: OrderKind::Stop.into(),
            code: Command::Wheel(WheelCommand::Standby).code(),
            arm_granted: 0,
        };
        let give_up = Instant::now() + PATIENCE;
        loop {
            self.hands.steer(order)?;
            std::thread::sleep(Duration::from_millis(10));
            if self
                .health
                .latest()?
                .is_some_and(|health| health.stopped != 0)
            {
                return Ok("stopped; `lager resume` lets it go on".into());
            }
            if Instant::now() >= give_up {
                bail!("no bridge confirms the stop; is the robot up? (`lager up`)");
            }
        }
    }

    /// `lager resume`.
    pub fn resume(&self) -> Result<String> {
        self.ask(Ask {
            kind: AskKind::Resume.into(),
            ..Ask::default()
        })?;
        Ok("the stop is released".into())
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

    /// `lager fetch`: ordered until logic shows that it took the order.
    pub fn fetch(&self, product: i32) -> Result<String> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let mut events = self.bus.subscriber::<MissionEvent>()?;
        let mut thoughts = self.bus.subscriber::<LogThought>()?;
        let mut why = String::from("it is not up, or does not say why");
        let order = Order {
            id: Hands::fresh_id(),
            product,
        };
        let give_up = Instant::now() + PATIENCE;
        loop {
            self.hands.fetch(order)?;
            std::thread::sleep(Duration::from_millis(50));
            if let Some(thought) = thoughts.latest()? {
                thought.text.as_str().clone_into(&mut why);
            }
            while let Some(event) = events.receive()? {
                if event.kind.get() == Some(EventKind::Refused) && event.order_id == order.id {
                    bail!("logic refuses to fetch product {product}: {why}");
                }
            }
            if let Some(status) = status.latest()? {
                if status.order_id == order.id {
                    return Ok(format!("logic fetches product {product}"));
                }
                if status.pending != 0 && status.pending_id == order.id {
                    return Ok(format!("logic fetches product {product} next"));
                }
            }
            if Instant::now() >= give_up {
                bail!("logic does not take the order: {why}");
            }
        }
    }

    /// `lager picked`: repeated until logic goes on.
    pub fn picked(&self) -> Result<String> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let waits = |phase| phase == Some(Phase::Picking);
        if !waits(first(&mut status, &self.bus)?.phase.get()) {
            bail!("the robot does not wait at a pick station; nothing is to be picked up now");
        }
        self.press_until(InputKind::PickupDone, &mut status, |phase| !waits(phase))?;
        Ok("the robot takes the product to delivery".into())
    }

    /// `lager reset`: repeated until logic has taken it.
    pub fn reset(&self) -> Result<String> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        self.press_until(InputKind::ResetPressed, &mut status, |phase| {
            matches!(phase, Some(Phase::WaitingForOrder | Phase::WaitingForMap))
        })?;
        Ok("the robot takes it that it stands on the delivery node".into())
    }

    /// Presses a button until logic shows the effect.
    fn press_until(
        &self,
        kind: InputKind,
        status: &mut Subscriber<NavStatus>,
        done: impl Fn(Option<Phase>) -> bool,
    ) -> Result<()> {
        let pressed = Clock::monotonic_ns();
        let give_up = Instant::now() + PATIENCE;
        loop {
            self.hands.press(Input {
                kind: kind.into(),
                ..Input::default()
            })?;
            std::thread::sleep(Duration::from_millis(50));
            if status.latest()?.is_some_and(|status| {
                status.stamp().publish_time_ns > pressed && done(status.phase.get())
            }) {
                return Ok(());
            }
            if Instant::now() >= give_up {
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

    /// `lager calibrate`.
    pub fn calibrate(&self) -> Result<String> {
        self.ask(Ask {
            kind: AskKind::Calibrate.into(),
            ..Ask::default()
        })?;
        Ok("calibrating for five seconds: move the robot over tape and floor".into())
    }

    fn ask(&self, ask: Ask) -> Result<Answer> {
        let answer = self.hands.ask(ask)?;
        match answer.outcome.get() {
            Some(Outcome::Done) => Ok(answer),
            Some(Outcome::NoBoard) => Err(anyhow!(
                "the board that would have to do it is not connected; `lager topic echo link/health` shows the links"
            )),
            _ => Err(anyhow!(
                "it is refused: the value is out of range, or the board is an original one without settings"
            )),
        }
    }

    fn health(&mut self) -> Result<Health> {
        first(&mut self.health, &self.bus)
    }

    /// Gives an order and renews it until it has finished or its time is over.
    fn carry_out(
        &mut self,
        command: OperatorCommand,
        seconds: Option<f64>,
        shutdown: &Shutdown,
    ) -> Result<String> {
        let name = command.name();
        let health = self.health()?;
        if health.stopped != 0 {
            bail!("the robot is stopped; `lager resume` releases the stop");
        }
        let (refused_before, mode) = (health.orders_refused, health.mode.get());
        let mut state = self.bus.subscriber::<SteeringState>()?;
        let order = SteeringOrder {
            id: Hands::fresh_id(),
            origin: Origin::Operator.into(),
            kind: OrderKind::Drive.into(),
            code: command.firmware().code(),
            arm_granted: 0,
        };
        let clock = self.bus.clock();
        let end = match seconds {
            Some(seconds) => Some(clock.now() + Duration::try_from_secs_f64(seconds)?),
            None => None,
        };
        let mut accepted = false;
        let mut heard = Instant::now();
        let give_up = Instant::now() + PATIENCE;
        while !shutdown.is_requested() && end.is_none_or(|end| clock.now() < end) {
            self.hands.steer(order)?;
            std::thread::sleep(clock.real(RENEW));
            if let Some(report) = state.latest()? {
                let own =
                    |origin: Option<Origin>, id| origin == Some(Origin::Operator) && id == order.id;
                accepted |= own(report.current_origin.get(), report.current_id);
                // A setpoint that lapsed is taken up again with the next renewal.
                let is_over = own(report.finished_origin.get(), report.finished_id);
                if is_over && command.firmware().is_one_shot() {
                    return match report.finish.get() {
                        Some(Finish::Done) => Ok(format!("`{name}` is done")),
                        Some(Finish::Aborted) => Err(anyhow!("`{name}` was cut short")),
                        _ => Err(anyhow!(
                            "the steering board refuses `{name}`: the arm moves only while the robot stands"
                        )),
                    };
                }
            }
            if let Some(health) = self.health.latest()?.map(|health| *health) {
                heard = Instant::now();
                if health.stopped != 0 {
                    bail!("the robot has been stopped");
                }
                if health.mode.get() != mode {
                    bail!("the mode has been changed; somebody else steers now");
                }
                if !accepted && health.orders_refused > refused_before {
                    bail!(
                        "the bridge refuses `{name}` now: somebody else steers, or the mode does not allow it"
                    );
                }
            }
            if heard.elapsed() >= PATIENCE {
                bail!("the bridge has fallen silent; the robot stands by itself");
            }
            if !accepted && Instant::now() >= give_up {
                bail!("the robot does not carry out `{name}`; `lager doctor` looks for the cause");
            }
        }
        Ok(format!("let go of `{name}`"))
    }
}

/// The state a topic holds; the services publish theirs several times a second.
fn first<T: Topic>(subscriber: &mut Subscriber<T>, bus: &Bus) -> Result<T::Payload> {
    let give_up = Instant::now() + PATIENCE;
    loop {
        if let Some(sample) = subscriber.latest()? {
            return Ok(*sample);
        }
        if Instant::now() >= give_up {
            bail!(
                "nobody publishes {} of the robot `{}`; is it up? (`lager up`)",
                T::NAME,
                bus.robot()
            );
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A command by its name, as `by_name` knows them, or in one of the three forms of its code.
fn parse(text: &str, by_name: fn(&str) -> Option<OperatorCommand>) -> Result<OperatorCommand> {
    if let Some(command) = by_name(text) {
        return Ok(command);
    }
    let names: Vec<_> = OperatorCommand::ALL
        .into_iter()
        .filter(|command| by_name(command.name()) == Some(*command))
        .map(OperatorCommand::name)
        .collect();
    let code = parse_code(text)
        .with_context(|| format!("`{text}` is no command; the names are {}", names.join(", ")))?;
    OperatorCommand::from_code(code).with_context(|| {
        format!("0x{code:02X} is no command; the wheels have 0x01 to 0x09, the arm 0xF1 to 0xFA")
    })
}
