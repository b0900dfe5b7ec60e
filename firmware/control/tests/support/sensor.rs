//! A sensor board on the bench.

use lager_control::{Board, EEPROM_LENGTH, SensorBoard, SensorConfig, SensorUnit};
use lager_wire::{Payload, ResetCause, ResetOrder, Setting, SettingKey};

use super::{Pi, Uart, ahead};

/// Pins and wires of a sensor board.
pub struct SensorPins {
    pub now_us: u32,
    pub uart: Uart,
    /// ADC reading of every line sensor.
    pub line: [u8; 11],
    pub ir: u16,
    pub ir_reads: usize,
    pub line_reads: usize,
    /// Whether the steering board has answered the handshake.
    pub answered: bool,
    /// Every word whose sending began, and when.
    pub words: Vec<(u32, u16)>,
    /// How long a word takes to send, in microseconds.
    pub word_us: u32,
    /// Every order to reset.
    pub resets: Vec<ResetOrder>,
    pub kicks: usize,
    pub eeprom: [u8; EEPROM_LENGTH as usize],
}

impl Board for SensorPins {
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
        ResetCause::Watchdog
    }
    fn reset(&mut self, order: ResetOrder) {
        self.resets.push(order);
    }
    fn kick_watchdog(&mut self) {
        self.kicks += 1;
    }
    fn eeprom_read(&self, address: u8) -> u8 {
        self.eeprom[usize::from(address)]
    }
    fn eeprom_write(&mut self, address: u8, value: u8) -> bool {
        self.eeprom[usize::from(address)] = value;
        true
    }
}

impl SensorBoard for SensorPins {
    fn read_line_sensor(&mut self, channel: u8) -> u8 {
        self.line_reads += 1;
        self.line[usize::from(channel)]
    }
    fn read_ir(&mut self) -> u16 {
        self.ir_reads += 1;
        self.ir
    }
    fn exde_send(&mut self, word: u16) -> bool {
        let takes = self.answered && !self.exde_is_sending();
        if takes {
            self.words.push((self.now_us, word));
        }
        takes
    }
    fn exde_is_sending(&self) -> bool {
        self.words
            .last()
            .is_some_and(|(begun_us, _)| self.now_us.wrapping_sub(*begun_us) < self.word_us)
    }
}

/// A sensor board on the bench.
pub struct SensorBench {
    pub pins: SensorPins,
    pub unit: SensorUnit,
    pub pi: Pi,
    pub due_us: u32,
}

impl SensorBench {
    pub fn boot(now_us: u32, config: SensorConfig) -> Self {
        let pins = SensorPins {
            now_us,
            uart: Uart::new(now_us),
            line: [20; 11],
            ir: 0,
            ir_reads: 0,
            line_reads: 0,
            answered: false,
            words: Vec::new(),
            word_us: 300,
            resets: Vec::new(),
            kicks: 0,
            eeprom: [255; EEPROM_LENGTH as usize],
        };
        let unit = SensorUnit::new(&pins, config);
        Self {
            pins,
            unit,
            pi: Pi::new(),
            due_us: now_us,
        }
    }

    /// A board that is connected to the Pi and to the steering board.
    pub fn ready(config: SensorConfig) -> Self {
        let mut bench = Self::boot(u32::MAX - 40_000, config);
        bench.run_ms(10);
        bench.pins.answered = true;
        // Off the times of the passes; otherwise a test in whole milliseconds would see each pass
        // one step late.
        bench.run_us(60_333);
        bench.pi.packets.clear();
        bench.pins.words.clear();
        bench
    }

    pub fn tape(&mut self, bits: u16) {
        for index in 0..11 {
            self.pins.line[index] = if bits >> (10 - index) & 1 == 1 {
                200
            } else {
                20
            };
        }
    }

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

    pub fn run_ms(&mut self, span_ms: u32) {
        self.run_us(span_ms * 1_000);
    }

    pub fn run_us(&mut self, span_us: u32) {
        let end_us = self.pins.now_us.wrapping_add(span_us);
        loop {
            let left_us = end_us.wrapping_sub(self.pins.now_us);
            let ahead_us = left_us.min(ahead(self.pins.now_us, self.due_us).max(1));
            self.pins.now_us = self.pins.now_us.wrapping_add(ahead_us);
            if self.pins.now_us == end_us {
                return;
            }
            self.step();
        }
    }
}
