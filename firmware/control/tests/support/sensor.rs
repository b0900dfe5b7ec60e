//! A sensor board on the bench.

use lager_control::{Board, SensorBoard, SensorConfig, SensorUnit};
use lager_wire::{Payload, ResetCause, Setting, SettingKey};

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
    pub exde: (bool, bool),
    /// Every change of data and sync.
    pub exde_log: Vec<(u32, bool, bool)>,
    pub returned: bool,
    pub kicks: usize,
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
    fn kick_watchdog(&mut self) {
        self.kicks += 1;
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
    fn set_exde(&mut self, data: bool, sync: bool) {
        assert_ne!(
            self.exde,
            (data, sync),
            "the wires are only touched to change them"
        );
        self.exde = (data, sync);
        self.exde_log.push((self.now_us, data, sync));
    }
    fn exde_return(&mut self) -> bool {
        core::mem::take(&mut self.returned)
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
            exde: (false, false),
            exde_log: Vec::new(),
            returned: false,
            kicks: 0,
        };
        let unit = SensorUnit::new(&pins, config);
        Self {
            pins,
            unit,
            pi: Pi::new(),
            due_us: now_us,
        }
    }

    /// A board that is up towards both sides.
    pub fn ready(config: SensorConfig) -> Self {
        let mut bench = Self::boot(u32::MAX - 40_000, config);
        bench.run_ms(10);
        bench.pins.returned = true;
        bench.run_ms(60);
        bench.pi.packets.clear();
        bench.pins.exde_log.clear();
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
        let end_us = self.pins.now_us.wrapping_add(span_ms * 1_000);
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
