//! Test benches for both boards with a servo model and a Pi, stepped in virtual time.
//!
//! A board is stepped at the time that it returned and on any input, as the simulator and a
//! sleeping chip do.

// Each test file uses only a part of this.
#![allow(dead_code, unreachable_pub, unused_imports)]

pub mod arm;
mod pi;
mod sensor;
pub mod servos;

use std::collections::VecDeque;

use lager_control::{Board, EEPROM_LENGTH, Motor, SteeringBoard, SteeringConfig, SteeringUnit};
use lager_wire::{
    BoardStatus, Payload, ResetCause, ResetOrder, Setting, SettingKey, SteerCommand, SteerData,
};
pub use pi::{Pi, Uart};
pub use sensor::SensorBench;
use servos::Servos;

/// A bridge's first command.
const STANDBY: SteerCommand = SteerCommand { code: 1, seq: 255 };

/// Pins and wires of a steering board.
pub struct SteeringPins {
    pub now_us: u32,
    pub uart: Uart,
    pub motors: (Motor, Motor),
    /// Every change of the motors.
    pub motor_log: Vec<(u32, (Motor, Motor))>,
    pub words: VecDeque<(u16, u32)>,
    /// Whether a word is half received.
    pub receiving: bool,
    pub exde_errors: u8,
    pub servos: Servos,
    /// Every order to reset, and the motors at that time.
    pub resets: Vec<(ResetOrder, Option<(Motor, Motor)>)>,
    pub kicks: usize,
    pub eeprom: [u8; EEPROM_LENGTH as usize],
    pub eeprom_writes: usize,
    /// Every step takes the processor this long.
    pub step_us: u32,
}

impl Board for SteeringPins {
    fn now_us(&self) -> u32 {
        self.now_us
    }
    fn uart_read(&mut self) -> Option<u8> {
        self.uart.received.pop_front()
    }
    fn uart_write(&mut self, bytes: &[u8]) -> bool {
        self.uart.write(bytes, self.now_us)
    }
    fn uart_idle(&self) -> bool {
        self.uart.left_us(self.now_us) == 0
    }
    fn reset_cause(&self) -> ResetCause {
        ResetCause::BrownOut
    }
    fn reset(&mut self, order: ResetOrder) {
        self.resets
            .push((order, self.motor_log.last().map(|(_, motors)| *motors)));
    }
    fn kick_watchdog(&mut self) {
        self.kicks += 1;
        self.now_us = self.now_us.wrapping_add(self.step_us);
    }
    fn eeprom_read(&self, address: u8) -> u8 {
        self.eeprom[usize::from(address)]
    }
    fn eeprom_write(&mut self, address: u8, value: u8) -> bool {
        self.eeprom[usize::from(address)] = value;
        self.eeprom_writes += 1;
        true
    }
}

impl SteeringBoard for SteeringPins {
    fn set_motors(&mut self, left: Motor, right: Motor) {
        self.motors = (left, right);
        self.motor_log.push((self.now_us, self.motors));
    }
    fn exde_word(&mut self) -> Option<(u16, u32)> {
        self.words.pop_front()
    }
    fn exde_is_receiving(&self) -> bool {
        self.receiving
    }
    fn exde_errors(&self) -> u8 {
        self.exde_errors
    }
    fn servo_write(&mut self, bytes: &[u8]) -> bool {
        self.servos.write(bytes, self.now_us)
    }
    fn servo_read(&mut self) -> Option<u8> {
        self.servos.read(self.now_us)
    }
    fn battery_decivolts(&mut self) -> u8 {
        111
    }
}

/// A steering board on the bench. The test sends it words and commands and lets time pass.
pub struct Bench {
    pub pins: SteeringPins,
    pub unit: SteeringUnit,
    pub pi: Pi,
    due_us: u32,
    /// The command re-sent every 40 ms, as the bridge does.
    pub renewed: Option<SteerCommand>,
    renew_us: u32,
    seq: u8,
    /// The reading sent every 5 ms, as the sensor board does.
    pub line: Option<u16>,
    word_us: u32,
}

impl Bench {
    /// A board that was just switched on; its clock shows `now_us`.
    pub fn boot(now_us: u32, config: SteeringConfig, servos: Servos) -> Self {
        let pins = SteeringPins {
            now_us,
            uart: Uart::new(now_us),
            motors: (Motor::forward(77), Motor::backward(77)),
            motor_log: Vec::new(),
            words: VecDeque::new(),
            receiving: false,
            exde_errors: 0,
            servos,
            resets: Vec::new(),
            kicks: 0,
            eeprom: [255; EEPROM_LENGTH as usize],
            eeprom_writes: 0,
            step_us: 0,
        };
        let unit = SteeringUnit::new(&pins, config);
        Self {
            pins,
            unit,
            pi: Pi::new(),
            due_us: now_us,
            renewed: None,
            renew_us: now_us,
            seq: 0,
            line: None,
            word_us: now_us,
        }
    }

    /// A board in standby, with its servos in service and the line under its middle.
    pub fn ready() -> Self {
        Self::ready_with(SteeringConfig::default(), Servos::at([512; 8]))
    }

    pub fn ready_with(config: SteeringConfig, servos: Servos) -> Self {
        let mut bench = Self::boot(u32::MAX - 1_000_000, config, servos);
        bench.line = Some(0b000_0011_1000 << 1);
        bench.run_ms(200);
        bench.send(Payload::SteerCommand(STANDBY));
        bench.pi.packets.clear();
        bench.pins.motor_log.clear();
        bench.run_ms(10);
        bench
    }

    /// Gives a command a new number, sends it and keeps renewing it. Returns the number.
    pub fn command(&mut self, code: u8) -> u8 {
        self.seq = self.seq.wrapping_add(1);
        let command = SteerCommand {
            code,
            seq: self.seq,
        };
        self.renewed = Some(command);
        self.renew_us = self.pins.now_us.wrapping_add(40_000);
        self.send(Payload::SteerCommand(command));
        self.seq
    }

    /// The number of the latest command.
    pub fn seq(&self) -> u8 {
        self.seq
    }

    /// Sends a payload and steps the board.
    pub fn send(&mut self, payload: Payload) {
        self.pi.send(payload, &mut self.pins.uart);
        self.step();
    }

    pub fn set(&mut self, key: SettingKey, seq: u8, value: i16) {
        self.send(Payload::Setting(Setting { key, seq, value }));
    }

    pub fn step(&mut self) {
        self.due_us = self.unit.step(&mut self.pins);
        self.pi.hear(&mut self.pins.uart, self.pins.now_us);
        if !self.pins.uart.received.is_empty() {
            self.due_us = self.unit.step(&mut self.pins);
            self.pi.hear(&mut self.pins.uart, self.pins.now_us);
        }
    }

    /// One step of the board; it may leave work for the next.
    pub fn step_once(&mut self) {
        self.due_us = self.unit.step(&mut self.pins);
    }

    /// Lets time pass. The board is stepped at the time that it returned and on input.
    pub fn run_us(&mut self, span_us: u32) {
        let end_us = self.pins.now_us.wrapping_add(span_us);
        loop {
            let left_us = end_us.wrapping_sub(self.pins.now_us);
            let mut ahead_us = left_us.min(ahead(self.pins.now_us, self.due_us).max(1));
            if let Some(at_us) = self.pins.servos.next_byte_us() {
                ahead_us = ahead_us.min(ahead(self.pins.now_us, at_us).max(1));
            }
            if self.renewed.is_some() {
                ahead_us = ahead_us.min(ahead(self.pins.now_us, self.renew_us));
            }
            if self.line.is_some() {
                ahead_us = ahead_us.min(ahead(self.pins.now_us, self.word_us));
            }
            self.pins.now_us = self.pins.now_us.wrapping_add(ahead_us);
            if self.pins.now_us == end_us {
                return;
            }
            self.feed();
            self.step();
        }
    }

    pub fn run_ms(&mut self, span_ms: u32) {
        self.run_us(span_ms * 1_000);
    }

    /// Runs until `done`; fails after `limit_ms`.
    pub fn run_until(&mut self, limit_ms: u32, done: impl Fn(&Self) -> bool) {
        for _ in 0..limit_ms {
            if done(self) {
                return;
            }
            self.run_ms(1);
        }
        assert!(done(self), "not within {limit_ms} ms");
    }

    fn feed(&mut self) {
        let now_us = self.pins.now_us;
        if let Some(command) = self.renewed
            && ahead(now_us, self.renew_us) == 0
        {
            self.renew_us = now_us.wrapping_add(40_000);
            self.pi
                .send(Payload::SteerCommand(command), &mut self.pins.uart);
        }
        if let Some(bits) = self.line
            && ahead(now_us, self.word_us) == 0
        {
            self.word_us = now_us.wrapping_add(5_000);
            self.word(bits);
        }
    }

    /// Delivers a word whose last bit comes now.
    pub fn word(&mut self, bits: u16) {
        self.pins.words.push_back((bits, self.pins.now_us));
    }

    pub fn duties(&self) -> (u8, u8) {
        (self.pins.motors.0.duty, self.pins.motors.1.duty)
    }

    /// The latest regular report.
    pub fn report(&self) -> SteerData {
        self.reports().last().expect("a report").1
    }

    /// The board's next status.
    pub fn status(&mut self) -> BoardStatus {
        self.pi.packets.clear();
        self.run_ms(600);
        let statuses = self.pi.all(|payload| match payload {
            Payload::BoardStatus(status) => Some(status),
            _ => None,
        });
        statuses.last().expect("a status").1
    }

    pub fn reports(&self) -> Vec<(u32, SteerData)> {
        self.pi.all(|payload| match payload {
            Payload::SteerData(data) => Some(data),
            _ => None,
        })
    }
}

fn ahead(now_us: u32, due_us: u32) -> u32 {
    let ahead = due_us.wrapping_sub(now_us);
    if ahead > 1 << 31 { 0 } else { ahead }
}
