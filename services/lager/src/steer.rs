//! The commands that order something of a robot that is up. `steer/ordered.rs` knows each of them,
//! and this file gives its order. `stop` is apart, because it must work without the bus.
//!
//! Each opens the bus as an operator and gives one order, with the same state machine as comm
//! (`lager-operator`). It waits until the robot shows the effect, and prints the result.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_home::Clock;
use lager_lines::extension::Spelled;
use lager_operator::{Act, Begun, Driving, For, Ids, Orders, Seen};
use lager_orders::lease::LATEST_MOVE;
use lager_orders::{Action, LeaseMs, Mode, Moment, Reason, Wheels};
use lager_ports::{Bus, BusConfig, Subscriber};
use lager_sample::Topic;
use lager_stop::Stop;
use lager_supervisor::console;
use lager_supervisor::hands::Hands;
use lager_supervisor::stopped::describe;
use lager_topics::{
    Health, LinkHealth, MissionEvent, MissionQueue, NavStatus, Role, SteeringState, StopCause,
    WorldRequest,
};
use lager_wire::OperatorCommand;

use crate::config::Config;
use crate::hint::hinted;
use crate::stop;
use crate::time_limit::TimeLimit;

mod map;
mod ordered;
mod queue;
mod world;

/// How often the robot's answer is checked, in real time.
const GLANCE: Duration = Duration::from_millis(20);

/// An operator at work on a robot that is up.
pub struct Operator {
    patience: TimeLimit,
    bus: Bus,
    hands: Hands,
    /// The configuration with which the robot was started.
    running: Config,
    health: Subscriber<LinkHealth>,
}

impl Operator {
    /// Opens the bus and waits for the bridge.
    ///
    /// # Errors
    /// When no bridge of this robot answers.
    pub fn new(config: &Config, patience: TimeLimit) -> Result<Self> {
        // The robot's clock may differ from the one in this command's configuration.
        let running = config.of_running_robot()?.unwrap_or_else(|| config.clone());
        let BusConfig { speed, clock, .. } = running.bus()?;
        let bus = BusConfig {
            speed,
            clock,
            ..config.bus()?
        };
        // Until the robot has taken a command that lasts, one time limit holds for everything.
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

    /// `lager resume`: releases the stop that was set when the user gave this command. Says which
    /// stop that is, and whether it was released.
    pub fn resume(&mut self, config: &Config, before: Option<Stop>) -> Result<String> {
        if let Some(stop) = before {
            let said = describe(stop.origin(), stop.cause(), stop.at_ns());
            console::print(&format!("it was stopped {said}"))?;
        }
        let stop = before.map_or(0, Stop::word);
        let action = Action::Resume { stop };
        let seen = self.seen(action)?;
        let refused = self.give(action, &seen)?;
        match (stop::current(config)?, refused) {
            (None, None) => self.done(action, &seen),
            (Some(stop), _) => bail!(
                "it stays stopped: a newer stop is set, {}; give `lager resume` anew to release it",
                describe(stop.origin(), stop.cause(), stop.at_ns())
            ),
            (None, Some(_)) => bail!("the bridge does not release the stop now; try again"),
        }
    }

    /// What the robot shows now, as far as this order needs it.
    fn seen(&mut self, action: Action) -> Result<Seen> {
        let patience = match action.latest() == LATEST_MOVE {
            true => self.soon(),
            false => self.patience.clone(),
        };
        let mut seen = Seen {
            health: Some(first(&mut self.health, &self.bus, &patience)?),
            is_simulated: self.running.body.service().is_some(),
            ..Seen::default()
        };
        if is_for_logic(action) {
            let mut status = self.bus.subscriber::<NavStatus>()?;
            seen.status = Some(first(&mut status, &self.bus, &patience)?);
            seen.queue = Some(self.queue()?);
        }
        Ok(seen)
    }

    /// Gives an order and waits until the robot shows its effect, or until the reason of a refusal
    /// is known.
    fn give(&mut self, action: Action, seen: &Seen) -> Result<Option<Reason>> {
        let mut status = self.bus.subscriber::<NavStatus>()?;
        let mut queue = self.bus.subscriber::<MissionQueue>()?;
        let mut events = self.bus.subscriber::<MissionEvent>()?;
        let mut orders = Orders::default();
        let begun = match orders.give(self.now(), Duration::ZERO, (), action, seen) {
            Ok(begun) => begun,
            Err(why) => return Ok(Some(why)),
        };
        self.note(action);
        let mut heard = None;
        loop {
            for act in orders.acts() {
                match act {
                    Act::Order(order) => self.hands.fetch(order)?,
                    Act::Press(input) => self.hands.press(input)?,
                    Act::Ask { id, ask } => {
                        let answer = self.hands.ask(ask)?;
                        orders.answered(id, Ok(answer), seen);
                    }
                    Act::AskWorld { id, ask } => {
                        let world = self.bus.client::<WorldRequest>()?;
                        let answer = world.call(ask, self.patience.left())?;
                        orders.world_answered(self.now(), id, &Ok(answer));
                    }
                }
            }
            if let Some(ended) = orders.ended().pop() {
                return Ok(ended.result.err());
            }
            if begun != Begun::Waits {
                return Ok(None);
            }
            match is_for_logic(action) {
                true => self.patience.pause(GLANCE)?,
                // A calibration lasts longer than any call into the bus.
                false => self.patience.rest(GLANCE)?,
            }
            if let Some(health) = self.health.latest()? {
                heard = Some(Instant::now());
                orders.health(&health);
            }
            if let Some(status) = status.latest()? {
                orders.status(&status, status.stamp().publish_time_ns);
            }
            if let Some(queue) = queue.latest()? {
                orders.queue(self.now(), &queue);
            }
            while let Some(event) = events.receive()? {
                orders.event(&event);
            }
            orders.turn(self.now(), |()| true);
            if self.patience.is_silent(heard) {
                bail!("the bridge has fallen silent; nobody knows what came of it");
            }
        }
    }

    /// Tells people at the station that somebody has ordered this in a terminal. That they may not
    /// read it changes nothing for the robot.
    fn note(&self, action: Action) {
        let words = format!("{} {}", Role::Operator.as_str(), Spelled(&action));
        let _ = self.bus.home().note_asked(self.bus.unit(), &words);
    }

    fn now(&self) -> Moment {
        Moment {
            robot: self.bus.clock().now(),
            ns: Clock::monotonic_ns(),
        }
    }

    fn health(&mut self) -> Result<Health> {
        first(&mut self.health, &self.bus, &self.patience)
    }

    /// How long an order that lets the robot move waits for it. If the bridge is frozen, no such order
    /// waits for the next bridge: the robot would move when nobody expects it any more.
    fn soon(&self) -> TimeLimit {
        self.patience.at_most(Hands::ANSWER)
    }

    /// `lager drive` and `lager arm`: gives an order and renews it until it has finished, its seconds
    /// are over, or the user presses Ctrl-C. The robot then stands, because nobody renews its order.
    pub fn steer(&mut self, command: OperatorCommand, seconds: Option<f64>) -> Result<String> {
        let name = command.name();
        let mut seen = Seen {
            health: Some(self.health()?),
            ..Seen::default()
        };
        // At goods a person may move the arm of an autonomous robot.
        if seen.mode() != Some(Mode::Manual) && matches!(command, OperatorCommand::Arm(_)) {
            let mut status = self.bus.subscriber::<NavStatus>()?;
            seen.status = Some(first(&mut status, &self.bus, &self.patience)?);
        }
        must_be_allowed(&seen, command)?;
        let mut state = self.bus.subscriber::<SteeringState>()?;
        let clock = self.bus.clock();
        let end = match seconds {
            Some(seconds) => Some(clock.now() + Duration::try_from_secs_f64(seconds)?),
            None => None,
        };
        let mut driving = Driving::default();
        let whose = For::Action {
            number: 0,
            until_ns: None,
        };
        let order = driving.begin(
            self.now(),
            Duration::ZERO,
            Ids::default().fresh(Clock::monotonic_ns()),
            command,
            whose,
        );
        self.hands.steer(order)?;
        if let Some(action) = steering(command) {
            self.note(action);
        }
        let mut accepted = false;
        while end.is_none_or(|end| clock.now() < end) {
            let due = driving.due().unwrap_or_default().max(clock.now());
            // A user who ends the command with Ctrl-C has succeeded.
            if self.patience.rest(clock.real(due - clock.now())).is_err() {
                break;
            }
            if let Some(report) = state.latest()? {
                driving.reported(clock.now(), &report);
            }
            if let Some(health) = self.health.latest()?.map(|health| *health) {
                driving.refused(clock.now(), &health);
                seen.health = Some(health);
                must_be_allowed(&seen, command)
                    .with_context(|| format!("`{name}` was cut short"))?;
            }
            if let Some(order) = driving.renew(clock.now()) {
                self.hands.steer(order)?;
            }
            accepted |= driving.has_begun();
            if let Some(Err(why)) = driving.ended().pop().map(|ended| ended.result) {
                bail!(hinted(why));
            }
            if !driving.is_running() {
                return Ok(format!("`{name}` is done"));
            }
            if !accepted && self.patience.is_over() {
                bail!("the robot does not carry out `{name}`; `lager doctor` looks for the cause");
            }
        }
        Ok(format!("let go of `{name}`"))
    }
}

/// A command as an action. A person renews it for as long as it shall last.
fn steering(command: OperatorCommand) -> Option<Action> {
    if let OperatorCommand::Arm(step) = command {
        return Some(Action::Arm(step));
    }
    let lease = LeaseMs::new(LeaseMs::MAX)?;
    Wheels::new(command).map(|wheels| Action::Drive { wheels, lease })
}

/// Whether logic shows the effect; a request is answered by whoever it is put to.
const fn is_for_logic(action: Action) -> bool {
    use Action::{Calibrate, Gains, Mode, Obstacle, Resume};
    !matches!(
        action,
        Mode(_) | Resume { .. } | Gains { .. } | Calibrate | Obstacle { .. }
    )
}

/// Refuses a command that nobody may give now.
fn must_be_allowed(seen: &Seen, command: OperatorCommand) -> Result<()> {
    match (seen.may_move(command), &seen.health) {
        (Ok(()), _) => Ok(()),
        (Err(_), Some(health)) if seen.is_stopped() => bail!(
            "the robot is stopped {}; `lager resume` releases the stop",
            by(health)
        ),
        (Err(why), _) => bail!(hinted(why)),
    }
}

/// Who has stopped the robot, and why.
fn by(health: &Health) -> String {
    let cause = health.stop_cause.get().unwrap_or(StopCause::WordDamaged);
    describe(health.stop_origin.get(), cause, health.stopped_at_ns)
}

/// The last sample of a topic that carries a state. The services publish theirs several times a
/// second.
fn first<T: Topic>(
    subscriber: &mut Subscriber<T>,
    bus: &Bus,
    patience: &TimeLimit,
) -> Result<T::Payload> {
    loop {
        if let Some(sample) = subscriber.latest()? {
            return Ok(*sample);
        }
        if patience.is_over() {
            bail!(
                "nobody publishes {} of the robot `{}`; is it up? (`lager up`)",
                T::NAME,
                bus.unit()
            );
        }
        patience.pause(Duration::from_millis(5))?;
    }
}
