//! The arbiter in virtual time, against a model of the steering board.

mod authority;
mod guards;
mod leases;
mod restarts;
mod silence;
mod writing;

use lager_orders::Mode;
use lager_orders::lease::{LATEST_MOVE, RENEWAL, SETPOINT, UNHEARD};
use lager_rig::boards::Register;
use lager_topics::{Finish, Health, Origin, Refusal, SteeringOrder};
use lager_wire::{ArmCommand, Command, SteerCommand, SteerFlags, Version, WheelCommand};

use super::*;

/// A board whose turns take three seconds, and steps of its arm 300 ms.
fn board() -> Register {
    Register::new(ms(3_000), ms(300))
}

fn code_moves(code: u8) -> bool {
    Command::from_code(code).is_some_and(moves)
}

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

fn drive(origin: Origin, id: u32, command: Command) -> SteeringOrder {
    SteeringOrder {
        id,
        origin: origin.into(),
        code: command.code(),
        ..SteeringOrder::default()
    }
}

fn granted_standby(id: u32) -> SteeringOrder {
    SteeringOrder {
        arm_granted: 1,
        ..drive(Origin::Logic, id, STANDBY)
    }
}

/// One turn of a shell: time passes once, and all that is due is written.
fn turn(arbiter: &mut Arbiter, now: Duration) -> Vec<SteerCommand> {
    arbiter.advance(now);
    std::iter::from_fn(|| arbiter.poll(now)).collect()
}

const FORWARD: Command = Command::Wheel(WheelCommand::ManualForward);
const FOLLOW: Command = Command::Wheel(WheelCommand::ActiveForward);
const LEFT_PERP: Command = Command::Wheel(WheelCommand::LeftPerp);
const LEFT_DIAG: Command = Command::Wheel(WheelCommand::LeftDiag);
const ARM_UP: Command = Command::Arm(ArmCommand::Up);
const SQUEEZE: Command = Command::Arm(ArmCommand::Squeeze);
const DROP: Command = Command::Arm(ArmCommand::Drop);

/// An arbiter wired to a board, both stepped every millisecond.
struct Bench {
    arbiter: Arbiter,
    board: Register,
    now: Duration,
    /// Everything written, with its time.
    written: Vec<(Duration, SteerCommand)>,
    connected: bool,
}

impl Bench {
    fn new(mode: Mode) -> Self {
        let mut arbiter = Arbiter::new();
        arbiter.set_mode(mode);
        let mut bench = Self {
            arbiter,
            board: board(),
            now: ms(1_000),
            written: Vec::new(),
            connected: true,
        };
        bench.arbiter.board_up(bench.now, Version::One, false);
        bench.run(1);
        bench
    }

    fn manual() -> Self {
        Self::new(Mode::Manual)
    }

    fn autonomous() -> Self {
        Self::new(Mode::Autonomous)
    }

    fn give(&mut self, order: SteeringOrder) -> Verdict {
        self.arbiter.order(self.now, Duration::ZERO, &order)
    }

    fn run(&mut self, millis: u64) {
        for _ in 0..millis {
            for command in turn(&mut self.arbiter, self.now) {
                self.written.push((self.now, command));
                if self.connected {
                    self.board.take(self.now, command);
                }
            }
            let data = self.board.step(self.now);
            if self.connected {
                self.arbiter.observe(self.now, &data);
            }
            self.now += ms(1);
        }
    }

    /// Runs with an origin that renews every 40 ms.
    fn run_renewed(&mut self, millis: u64, order: SteeringOrder) {
        for step in 0..millis {
            if step % 40 == 0 {
                self.give(order);
            }
            self.run(1);
        }
    }

    fn health(&self) -> Health {
        let mut health = Health::default();
        self.arbiter.fill(self.now, &mut health);
        health
    }

    /// A bridge that was killed and has come back with what it had last published.
    fn restart_bridge(&mut self) {
        self.arbiter = Arbiter::resume(&self.health(), self.now);
    }

    fn ended(&self) -> Option<(Origin, u32, Finish)> {
        let ended = self.arbiter.last_ended()?;
        Some((ended.key.origin, ended.key.id, ended.finish))
    }
}
