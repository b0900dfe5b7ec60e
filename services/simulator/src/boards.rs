//! The pins of the simulated boards: two implementations of `Board` by arithmetic.
//!
//! These types only pass values on: `lager_control` makes every decision, and `lager_plant` has
//! every number of the body.

use core::time::Duration;

use lager_control::{Board, EEPROM_LENGTH, Motor, SensorBoard, SteeringBoard};
use lager_plant::World;
use lager_wire::{ResetCause, ResetOrder};

use crate::exde::ExDe;
use crate::uart::Uart;

/// The time that the chip needs to write a byte of its EEPROM.
const EEPROM_WRITE_NS: u64 = 3_400_000;

/// The parts of a board beside its pins.
#[derive(Clone, Debug)]
pub(crate) struct Chip {
    pub(crate) uart: Uart,
    pub(crate) cause: ResetCause,
    /// Whether the Pi has told it to reset.
    pub(crate) resets: bool,
    /// The time when its clock started, in ns of robot time.
    pub(crate) boot_ns: u64,
    /// The time when its loop last reset the watchdog's timer, in ns of robot time.
    pub(crate) kicked_ns: u64,
    pub(crate) now_ns: u64,
    /// The EEPROM; a reset does not change it.
    pub(crate) eeprom: [u8; EEPROM_LENGTH as usize],
    /// The time when the byte that is being written is finished, in ns of robot time.
    pub(crate) eeprom_free_ns: u64,
}

impl Chip {
    pub(crate) fn clock_us(&self) -> u32 {
        (self.now_ns.saturating_sub(self.boot_ns) / 1_000) as u32
    }
}

/// The sensor board at one instant.
pub(crate) struct SensorPins<'robot> {
    pub(crate) chip: &'robot mut Chip,
    pub(crate) world: &'robot mut World,
    pub(crate) exde: &'robot mut ExDe,
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

            // A simulated board has no bootloader, so it only restarts.
            fn reset(&mut self, _: ResetOrder) {
                self.chip.resets = true;
            }

            fn kick_watchdog(&mut self) {
                self.chip.kicked_ns = self.chip.now_ns;
            }

            fn eeprom_read(&self, address: u8) -> u8 {
                self.chip.eeprom[usize::from(address)]
            }

            fn eeprom_write(&mut self, address: u8, value: u8) -> bool {
                let chip = &mut *self.chip;
                if chip.now_ns < chip.eeprom_free_ns {
                    return false;
                }
                chip.eeprom_free_ns = chip.now_ns + EEPROM_WRITE_NS;
                chip.eeprom[usize::from(address)] = value;
                true
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

    fn exde_send(&mut self, word: u16) -> bool {
        self.exde.send(word, self.chip.now_ns)
    }

    fn exde_is_sending(&self) -> bool {
        self.exde.is_sending()
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

    fn exde_word(&mut self) -> Option<(u16, u32)> {
        self.exde.word()
    }

    fn exde_errors(&self) -> u8 {
        self.exde.errors()
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
        (self.world.battery_input_volts() * 40.0) as u8
    }
}
