//! The arbiter in virtual time, against a model of the steering board.

mod authority;
mod guards;
mod leases;
mod restarts;
mod silence;
mod writing;

use lager_topics::{Finish, Health, Mode, Origin, Refusal, SteeringOrder};
use lager_wire::{ArmCommand, Command, SteerCommand, SteerData, SteerFlags, Version, WheelCommand};

use super::*;

/// What the steering board does with commands, as far as the arbiter can tell (T2, T4): a new
/// sequence byte executes, the same renews, a command older than 150 ms is given up.
#[derive(Clone, Debug)]
struct Board {
    last_seq: Option<u8>,
    code: u8,
    heard: Duration,
    one_shot_ends: Option<Duration>,
    failsafe: bool,
    finished_seq: u8,
    finish: SteerFlags,
    /// Every command executed, in order.
    executed: Vec<u8>,
    /// How many one-shots ran to their end.
    completed: usize,
}

impl Board {
    fn new() -> Self {
        Self {
            last_seq: None,
            code: 0,
            heard: Duration::ZERO,
            one_shot_ends: None,
            failsafe: false,
            finished_seq: 0,
            finish: SteerFlags::NONE,
            executed: Vec::new(),
            completed: 0,
        }
    }

    fn take(&mut self, now: Duration, command: SteerCommand) {
        self.heard = now;
        if self.last_seq == Some(command.seq) {
            return;
        }
        self.end_one_shot(SteerFlags::ABORTED);
        self.last_seq = Some(command.seq);
        self.failsafe = false;
        let meaning = command.command().expect("the arbiter sends defined codes");
        if matches!(meaning, Command::Arm(_)) && code_moves(self.code) {
            self.finished_seq = command.seq;
            self.finish = SteerFlags::REFUSED;
            return;
        }
        self.code = command.code;
        self.executed.push(command.code);
        if meaning.is_one_shot() {
            let lasts = if moves(meaning) { 3_000 } else { 300 };
            self.one_shot_ends = Some(now + ms(lasts));
        }
    }

    fn end_one_shot(&mut self, how: SteerFlags) {
        if self.one_shot_ends.take().is_some() {
            self.finished_seq = self.last_seq.unwrap();
            self.finish = how;
            self.code = STANDBY.code();
        }
    }

    fn step(&mut self, now: Duration) -> SteerData {
        if now - self.heard > ms(150) && self.last_seq.is_some() {
            self.failsafe = true;
            self.end_one_shot(SteerFlags::ABORTED);
            self.code = STANDBY.code();
        }
        if self.one_shot_ends.is_some_and(|end| end <= now) {
            self.end_one_shot(SteerFlags::NONE);
            self.completed += 1;
        }
        let mut flags = self.finish;
        if self.failsafe {
            flags.insert(SteerFlags::FAILSAFE);
        }
        if self.one_shot_ends.is_some() {
            flags.insert(SteerFlags::BUSY);
        }
        SteerData {
            code: self.code,
            left_duty: if code_moves(self.code) { 100 } else { 0 },
            right_duty: if code_moves(self.code) { 100 } else { 0 },
            flags,
            line_error: 0,
            finished_seq: self.finished_seq,
            servo_errors: 0,
            battery_decivolts: 0,
        }
    }
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
    board: Board,
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
            board: Board::new(),
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
