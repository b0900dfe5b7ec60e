//! One AX-12: its control table, its movement and its answers.
//!
//! It knows nothing of the wire, which the parent module models.

use lager_ax12::table::{
    BAUD_1_MBIT, BAUD_RATE, CCW_ANGLE_LIMIT_L, CW_ANGLE_LIMIT_L, DEFAULT_RETURN_DELAY, FULL_SPEED,
    GOAL_POSITION_L, GOAL_SPEED_L, ID, LENGTH, MAX_POSITION, MAX_TORQUE_L, MODEL_AX12,
    MODEL_NUMBER_L, MOVING, PRESENT_LOAD_L, PRESENT_POSITION_L, PRESENT_SPEED_L,
    PRESENT_TEMPERATURE, PRESENT_VOLTAGE, REGISTERED_INSTRUCTION, RETURN_DELAY_TIME, RETURN_LEVEL,
    TORQUE_ENABLE, TORQUE_LIMIT_L, unsigned,
};
use lager_ax12::{ErrorBits, Instruction};

use crate::arm::SERVOS;
use crate::build::{ArmBuild, SLOPE};

/// Units of position a second at full speed: 59 rpm, 1023 units in 300 degrees.
const FULL_SPEED_UNITS: f64 = 59.0 * 6.0 * 1023.0 / 300.0;
/// Units of position a second for each unit of goal speed (0.111 rpm).
const SPEED_UNIT: f64 = 0.111 * 6.0 * 1023.0 / 300.0;

/// One servo.
#[derive(Clone, Debug)]
pub(super) struct Servo {
    pub(super) table: [u8; LENGTH],
    registered: Option<(u8, Vec<u8>)>,
    /// It counts the other way: its table has 1023 minus the position.
    is_reversed: bool,
    /// How much greater its position is than the joint's as drawn.
    offset: f64,
    /// Where the joint ends.
    ends: [f64; 2],
    /// A blocked servo this far from its goal pushes with all its torque, in units.
    slope: f64,
    /// A person holds the joint.
    pub(super) is_held: bool,
    pub(super) position: f64,
    /// The lowest position that the joint can reach now, because something is in the way.
    pub(super) stop: f64,
    /// How the joint sinks without torque, if it does.
    pub(super) sags: Option<Sag>,
}

/// Where a joint sinks to without torque, and how fast.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sag {
    pub(super) to: f64,
    pub(super) units_per_s: f64,
}

impl Servo {
    /// A servo with the factory's values at `position`, without torque.
    pub(super) fn new(id: u8, position: u16) -> Self {
        let mut servo = Self {
            table: [0; LENGTH],
            registered: None,
            is_reversed: false,
            offset: 0.0,
            ends: [0.0, f64::from(MAX_POSITION)],
            slope: f64::from(SLOPE),
            is_held: false,
            position: f64::from(position),
            stop: 0.0,
            sags: None,
        };
        for (address, value) in [
            (MODEL_NUMBER_L, MODEL_AX12),
            (CCW_ANGLE_LIMIT_L, MAX_POSITION),
            (MAX_TORQUE_L, 1023),
            (TORQUE_LIMIT_L, 1023),
            (GOAL_POSITION_L, position),
        ] {
            servo.set_word(address, value);
        }
        for (address, value) in [
            (ID, id),
            (BAUD_RATE, BAUD_1_MBIT),
            (RETURN_DELAY_TIME, DEFAULT_RETURN_DELAY),
            (RETURN_LEVEL, 2),
            (PRESENT_VOLTAGE, 111),
            (PRESENT_TEMPERATURE, 38),
        ] {
            servo.table[usize::from(address)] = value;
        }
        servo.publish(0.0, 0.0);
        servo
    }

    fn word(&self, address: u8) -> u16 {
        let at = usize::from(address);
        u16::from_le_bytes([self.table[at], self.table[at + 1]])
    }

    pub(super) fn set_word(&mut self, address: u8, value: u16) {
        let at = usize::from(address);
        self.table[at..at + 2].copy_from_slice(&value.to_le_bytes());
    }

    /// Mounts it as the servo with this index of an arm.
    pub(super) fn mount(&mut self, arm: &ArmBuild, index: usize) {
        self.is_reversed = arm.reversed[index];
        self.offset = f64::from(arm.offsets[index]);
        self.ends = arm.ends[index].map(f64::from);
        if index == SERVOS - 1 {
            self.slope = f64::from(arm.slope);
        }
        self.set_word(GOAL_POSITION_L, self.counted(self.position));
        self.publish(0.0, 0.0);
    }

    /// What stands in the table for a position.
    fn counted(&self, position: f64) -> u16 {
        let shifted = (position + self.offset).round();
        let counted = shifted.clamp(0.0, f64::from(MAX_POSITION)) as u16;
        if self.is_reversed {
            MAX_POSITION - counted
        } else {
            counted
        }
    }

    /// The position for what stands in the table.
    fn meant(&self, counted: u16) -> f64 {
        let counted = match self.is_reversed {
            true => MAX_POSITION.saturating_sub(counted),
            false => counted,
        };
        f64::from(counted) - self.offset
    }

    /// A person brings it there, as far as the joint goes, and holds it. With torque it stays.
    pub(super) fn bring(&mut self, position: f64) {
        if !self.has_torque() {
            self.is_held = true;
            let [lower, upper] = self.ends;
            self.position = position.clamp(lower.max(self.stop), upper);
            self.publish(0.0, 0.0);
        }
    }

    /// Switches the torque on; the goal is `position`.
    pub(super) fn hold(&mut self, position: u16) {
        self.set_word(GOAL_POSITION_L, self.counted(position.into()));
        self.table[usize::from(TORQUE_ENABLE)] = 1;
        self.publish(0.0, 0.0);
    }

    pub(super) fn has_torque(&self) -> bool {
        self.table[usize::from(TORQUE_ENABLE)] != 0
    }

    /// Sinks for `seconds` under its load.
    pub(super) fn sag(&mut self, seconds: f64) {
        let Some(Sag { to, units_per_s }) = self.sags.filter(|_| !self.is_held) else {
            return;
        };
        let most = units_per_s * seconds;
        let before = self.position;
        self.position += (to - before).clamp(-most, most);
        self.publish((self.position - before) / seconds, 0.0);
    }

    pub(super) fn step(&mut self, seconds: f64) {
        if !self.has_torque() {
            self.rest();
            return;
        }
        self.is_held = false;
        let goal = self.meant(self.word(GOAL_POSITION_L));
        let [lower, upper] = self.ends;
        let lowest = lower.max(self.stop);
        if goal == self.position && self.position >= lowest {
            self.rest();
            return;
        }
        let speed = match self.word(GOAL_SPEED_L) & 0x03FF {
            FULL_SPEED => FULL_SPEED_UNITS,
            units => (f64::from(units) * SPEED_UNIT).min(FULL_SPEED_UNITS),
        };
        let step = (goal - self.position).clamp(-speed * seconds, speed * seconds);
        let before = self.position;
        self.position = (before + step).min(upper).max(lowest);
        let missing = goal - self.position;
        let blocked = (goal < lowest && self.position <= lowest) || goal > upper;
        let torque = f64::from(self.word(TORQUE_LIMIT_L).min(1023));
        // A moving joint needs a little torque; a blocked one pushes harder far from its goal.
        let load = if blocked {
            (missing / self.slope * 1023.0).clamp(-torque, torque)
        } else {
            (missing.signum() * 60.0).clamp(-torque, torque)
        };
        self.publish((self.position - before) / seconds, load);
    }

    /// The servo stands without load; writes the table only if that is new.
    fn rest(&mut self) {
        let moves = self.table[usize::from(MOVING)] != 0;
        if moves || self.word(PRESENT_LOAD_L) != 0 {
            self.publish(0.0, 0.0);
        }
    }

    /// Writes the measured values into the table.
    pub(super) fn publish(&mut self, units_per_s: f64, load: f64) {
        let (units_per_s, load) = if self.is_reversed {
            (-units_per_s, -load)
        } else {
            (units_per_s, load)
        };
        self.set_word(PRESENT_POSITION_L, self.counted(self.position));
        self.set_word(PRESENT_SPEED_L, unsigned((units_per_s / SPEED_UNIT) as i16));
        self.set_word(PRESENT_LOAD_L, unsigned(load as i16));
        self.table[usize::from(MOVING)] = u8::from(units_per_s != 0.0);
    }

    /// Carries out an instruction. Returns the errors and registers of the answer, if there is one.
    pub(super) fn obey(
        &mut self,
        instruction: Option<Instruction>,
        parameters: &[u8],
    ) -> (ErrorBits, Vec<u8>) {
        let done = |errors| (errors, Vec::new());
        match (instruction, parameters) {
            (Some(Instruction::Ping), []) => done(ErrorBits::NONE),
            (Some(Instruction::Read), &[address, count]) => self.read(address, count),
            (Some(Instruction::Write), [address, values @ ..]) => {
                done(self.write(*address, values))
            }
            (Some(Instruction::RegWrite), [address, values @ ..]) => {
                self.registered = Some((*address, values.to_vec()));
                self.table[usize::from(REGISTERED_INSTRUCTION)] = 1;
                done(ErrorBits::NONE)
            }
            (Some(Instruction::Action), []) => {
                self.table[usize::from(REGISTERED_INSTRUCTION)] = 0;
                match self.registered.take() {
                    Some((address, values)) => done(self.write(address, &values)),
                    None => done(ErrorBits::INSTRUCTION),
                }
            }
            _ => done(ErrorBits::INSTRUCTION),
        }
    }

    fn read(&self, address: u8, count: u8) -> (ErrorBits, Vec<u8>) {
        let from = usize::from(address);
        match self.table.get(from..from + usize::from(count)) {
            Some(registers) if count > 0 => (ErrorBits::NONE, registers.to_vec()),
            _ => (ErrorBits::RANGE, Vec::new()),
        }
    }

    pub(super) fn write(&mut self, address: u8, values: &[u8]) -> ErrorBits {
        let from = usize::from(address);
        let last = from + values.len();
        let measured = usize::from(PRESENT_POSITION_L)..=usize::from(REGISTERED_INSTRUCTION);
        let read_only =
            |at: usize| at < usize::from(ID) || measured.contains(&at) || at == usize::from(MOVING);
        if values.is_empty() || last > LENGTH || (from..last).any(read_only) {
            return ErrorBits::RANGE;
        }
        let before = self.table;
        self.table[from..last].copy_from_slice(values);
        let goal = self.word(GOAL_POSITION_L);
        let limits = self.word(CW_ANGLE_LIMIT_L)..=self.word(CCW_ANGLE_LIMIT_L);
        let goal_at = usize::from(GOAL_POSITION_L);
        if (from..last).contains(&goal_at) {
            if !limits.contains(&goal) {
                self.table = before;
                return ErrorBits::ANGLE_LIMIT;
            }
            // Writing a goal switches the torque on, as the real servo does.
            self.table[usize::from(TORQUE_ENABLE)] = 1;
        }
        ErrorBits::NONE
    }

    pub(super) fn answers(&self, instruction: Option<Instruction>) -> bool {
        match self.table[usize::from(RETURN_LEVEL)] {
            0 => instruction == Some(Instruction::Ping),
            1 => matches!(instruction, Some(Instruction::Ping | Instruction::Read)),
            _ => true,
        }
    }
}
