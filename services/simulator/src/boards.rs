//! The two boards' pins: `impl Board` by arithmetic.
//!
//! ```text
//!    sensor board                              steering board
//!    set_exde(data, sync) --rise of sync--> exde_bit()
//!    exde_return()        <---------------- pulse_exde_return()
//! ```
//! These types only pass on: every decision is in `lager_control`, every number of the body in
//! `lager_plant`.

use core::time::Duration;
use std::collections::VecDeque;

use lager_control::{Board, Motor, SensorBoard, SteeringBoard};
use lager_plant::World;
use lager_wire::ResetCause;

use crate::uart::Uart;

/// Rises of sync the steering board's interrupt can keep before its loop looks.
const EXDE_BUFFER: usize = 32;

/// What every board has beside its pins.
#[derive(Clone, Debug)]
pub(crate) struct Chip {
    pub(crate) uart: Uart,
    pub(crate) cause: ResetCause,
    /// When its clock started, in ns of robot time.
    pub(crate) boot_ns: u64,
    /// When its loop last kicked the watchdog.
    pub(crate) kicked_ns: u64,
    pub(crate) now_ns: u64,
}

impl Chip {
    pub(crate) fn clock_us(&self) -> u32 {
        (self.now_ns.saturating_sub(self.boot_ns) / 1_000) as u32
    }
}

/// The three wires between the boards (X2).
#[derive(Clone, Debug, Default)]
pub(crate) struct ExDe {
    data: bool,
    sync: bool,
    /// Bits sampled by the steering board's interrupt.
    pub(crate) bits: VecDeque<(bool, u32)>,
    /// Whether sync rose since the steering board was stepped.
    pub(crate) rose: bool,
    /// Whether the return sync was pulsed since the sensor board looked.
    pub(crate) returned: bool,
}

impl ExDe {
    /// The sensor board is held in reset: its pins are inputs and read low.
    pub(crate) fn release_sender(&mut self) {
        self.data = false;
        self.sync = false;
        self.returned = false;
    }

    /// The steering board is held in reset: it samples nothing.
    pub(crate) fn release_receiver(&mut self) {
        self.bits.clear();
        self.rose = false;
    }
}

/// The sensor board at one instant.
pub(crate) struct SensorPins<'robot> {
    pub(crate) chip: &'robot mut Chip,
    pub(crate) world: &'robot mut World,
    pub(crate) exde: &'robot mut ExDe,
    /// The steering board's clock, if that board is running.
    pub(crate) receiver_us: Option<u32>,
}

/// The steering board at one instant.
pub(crate) struct SteeringPins<'robot> {
    pub(crate) chip: &'robot mut Chip,
    pub(crate) world: &'robot mut World,
    pub(crate) exde: &'robot mut ExDe,
}

macro_rules! board {
    ($pins:ident) => {
        impl Board for $pins<'_> {
            fn now_us(&self) -> u32 {
                self.chip.clock_us()
            }

            fn uart_read(&mut self) -> Option<u8> {
                self.chip.uart.receive(self.chip.now_ns)
            }

            fn uart_write(&mut self, bytes: &[u8]) -> bool {
                self.chip.uart.queue(self.chip.now_ns, bytes)
            }

            fn uart_idle(&self) -> bool {
                self.chip.uart.is_idle(self.chip.now_ns)
            }

            fn reset_cause(&self) -> ResetCause {
                self.chip.cause
            }

            fn kick_watchdog(&mut self) {
                self.chip.kicked_ns = self.chip.now_ns;
            }
        }
    };
}

board!(SensorPins);
board!(SteeringPins);

impl SensorBoard for SensorPins<'_> {
    fn read_line_sensor(&mut self, channel: u8) -> u8 {
        self.world.read_line(channel)
    }

    fn read_ir(&mut self) -> u16 {
        self.world.read_ir()
    }

    fn set_exde(&mut self, data: bool, sync: bool) {
        let rises = sync && !self.exde.sync;
        self.exde.data = data;
        self.exde.sync = sync;
        if let Some(now_us) = self.receiver_us
            && rises
            && self.exde.bits.len() < EXDE_BUFFER
        {
            self.exde.bits.push_back((data, now_us));
            self.exde.rose = true;
        }
    }

    fn exde_return(&mut self) -> bool {
        core::mem::take(&mut self.exde.returned)
    }
}

impl SteeringBoard for SteeringPins<'_> {
    fn set_motors(&mut self, left: Motor, right: Motor) {
        let signed = |motor: Motor| {
            let duty = i16::from(motor.duty);
            if motor.reverse { -duty } else { duty }
        };
        self.world.set_motors(signed(left), signed(right));
    }

    fn exde_bit(&mut self) -> Option<(bool, u32)> {
        self.exde.bits.pop_front()
    }

    fn pulse_exde_return(&mut self) {
        self.exde.returned = true;
    }

    fn servo_write(&mut self, bytes: &[u8]) -> bool {
        let now = Duration::from_nanos(self.chip.now_ns);
        self.world.servos().transmit(now, bytes);
        true
    }

    fn servo_read(&mut self) -> Option<u8> {
        let now = Duration::from_nanos(self.chip.now_ns);
        self.world.servos().receive(now)
    }

    fn battery_decivolts(&mut self) -> u8 {
        // Three lithium cells at rest.
        111
    }
}
