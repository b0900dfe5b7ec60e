//! Joins the USARTs' registers and interrupts to the machines of [`super::usart`].
//!
//! ```text
//!  program --UDRn, UCSRnA, UCSRnB--> machine --frames--> whoever listens to TXD
//!  program <--interrupts, levels---- machine <--frames-- send_to(), the echo of a shared wire
//! ```
//! On the chip RXC and UDRE are levels: their interrupts come again while the level holds. simavr
//! forgets an interrupt when it enters it, so this code checks the levels again at each RETI.

use core::cell::{Cell, RefCell};
use core::ffi::CStr;

use simavr_ffi as ffi;

use super::Chip;
use super::queue::Event;
use super::usart::{Format, Usart, control, sampled, status};
use super::usarts::{UBRRH, UBRRL, UCSRA, UCSRB, UCSRC, UsartId};

/// A frame that a chip has sent completely.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// The byte.
    pub byte: u8,
    /// The cycle in which its start bit began.
    pub from: u64,
    /// The cycle in which its last stop bit ended.
    pub to: u64,
    /// Cycles of one of its bits.
    pub bit: u64,
}

type OnSent = Box<dyn Fn(Sent)>;

/// One USART: simavr's structure and our machine.
pub(super) struct Port {
    simavr: *mut ffi::avr_uart_t,
    machine: RefCell<Usart>,
    on_sent: RefCell<Option<OnSent>>,
    /// Whether TXD and RXD are joined outside the chip.
    echoes: Cell<bool>,
    sending_since: Cell<u64>,
    sending_life: Cell<u32>,
    receiving_life: Cell<u32>,
}

/// Both USARTs.
pub(super) struct Ports([Port; 2]);

impl Ports {
    pub(super) fn of(avr: *mut ffi::avr_t) -> Self {
        let mut found = find(avr, c"uart").into_iter();
        Self(core::array::from_fn(|_| Port {
            // simavr's description of this chip names two USARTs.
            simavr: found
                .next()
                .expect("simavr's atmega1284p has two USARTs")
                .cast(),
            machine: RefCell::default(),
            on_sent: RefCell::default(),
            echoes: Cell::new(false),
            sending_since: Cell::new(0),
            sending_life: Cell::new(0),
            receiving_life: Cell::new(0),
        }))
    }

    pub(super) fn port(&self, usart: UsartId) -> &Port {
        &self.0[usart.index()]
    }
}

/// All peripherals of one kind in simavr, in the order of its description.
pub(super) fn find(avr: *mut ffi::avr_t, kind: &CStr) -> Vec<*mut ffi::avr_io_t> {
    let mut found = Vec::new();
    // SAFETY: simavr's list of peripherals ends with null, and every entry has a name.
    unsafe {
        let mut io = (*avr).io_port;
        while !io.is_null() {
            if CStr::from_ptr((*io).kind) == kind {
                found.push(io);
            }
            io = (*io).next;
        }
    }
    found
}

impl Chip {
    /// Sends a frame to RXD: its start bit's edge is at `from`, 8N1 with `bit` cycles a bit.
    pub fn send_to(&self, usart: UsartId, from: u64, byte: u8, bit: f64) {
        self.schedule(from, Event::StartBit { usart, byte, bit });
    }

    /// Sets the receiver of the frames that have left.
    pub fn on_sent(&self, usart: UsartId, action: impl Fn(Sent) + 'static) {
        *self.ports.port(usart).on_sent.borrow_mut() = Some(Box::new(action));
    }

    /// Joins RXD and TXD, as on a half-duplex wire.
    pub fn tie(&self, usart: UsartId) {
        self.ports.port(usart).echoes.set(true);
    }

    /// Whether a frame is under way on TXD.
    pub fn is_sending(&self, usart: UsartId) -> bool {
        self.ports.port(usart).machine.borrow().is_sending()
    }

    /// Received bytes that were lost because the program did not read them in time.
    pub fn overruns(&self, usart: UsartId) -> u64 {
        self.ports.port(usart).machine.borrow().overruns()
    }

    /// Brings the USARTs into their state after a reset.
    pub(super) fn release_ports(&self) {
        for usart in UsartId::BOTH {
            let port = self.ports.port(usart);
            port.machine.borrow_mut().reset();
            port.sending_life.set(port.sending_life.get() + 1);
            port.receiving_life.set(port.receiving_life.get() + 1);
            let base = usart.base();
            for (offset, value) in [
                (UCSRA, status::UDRE),
                // simavr would leave the transmitter on.
                (UCSRB, 0),
                (UCSRC, 0x06),
                (UBRRL, 0),
                (UBRRH, 0),
            ] {
                self.set_register(base + offset, value);
            }
        }
    }

    pub(super) fn frame_sent(&self, usart: UsartId, life: u32) {
        let port = self.ports.port(usart);
        if port.sending_life.get() != life {
            return;
        }
        let now = self.cycle();
        let format = self.format(usart);
        let (byte, next) = port.machine.borrow_mut().sent();
        let from = port.sending_since.get();
        if let Some(byte) = next {
            self.frame_leaves(usart, byte);
        } else {
            // SAFETY: a living chip's own vector.
            unsafe { ffi::avr_raise_interrupt(self.avr, port.vectors()[1]) };
        }
        self.sync(usart);
        if let (Some(byte), Some(action)) = (byte, port.on_sent.borrow().as_ref()) {
            let bit = format.bit;
            action(Sent {
                byte,
                from,
                to: now,
                bit,
            });
        }
    }

    pub(super) fn frame_begins(&self, usart: UsartId, byte: u8, bit: f64) {
        if self.is_held() || self.control(usart) & control::RXEN == 0 {
            return;
        }
        let port = self.ports.port(usart);
        let format = self.format(usart);
        let (byte, framing_error) = sampled(byte, bit, format.bit as f64);
        port.machine.borrow_mut().start_bit(byte, framing_error);
        let life = port.receiving_life.get() + 1;
        port.receiving_life.set(life);
        let at = self.cycle() + format.reception();
        self.schedule(at, Event::Received { usart, life });
        self.sync(usart);
    }

    pub(super) fn frame_received(&self, usart: UsartId, life: u32) {
        let port = self.ports.port(usart);
        if port.receiving_life.get() != life {
            return;
        }
        port.machine.borrow_mut().received();
        self.sync(usart);
    }

    fn frame_leaves(&self, usart: UsartId, byte: u8) {
        let port = self.ports.port(usart);
        let now = self.cycle();
        let format = self.format(usart);
        let life = port.sending_life.get() + 1;
        port.sending_life.set(life);
        port.sending_since.set(now);
        self.schedule(now + format.frame(), Event::Sent { usart, life });
        if port.echoes.get() {
            self.frame_begins(usart, byte, format.bit as f64);
        }
    }

    pub(super) fn write_data(&self, usart: UsartId, byte: u8) {
        if self.control(usart) & control::TXEN == 0 {
            return;
        }
        let starts = self.ports.port(usart).machine.borrow_mut().write(byte);
        if starts {
            self.frame_leaves(usart, byte);
        }
        self.sync(usart);
    }

    pub(super) fn read_data(&self, usart: UsartId) -> u8 {
        let byte = self.ports.port(usart).machine.borrow_mut().read();
        self.sync(usart);
        byte
    }

    pub(super) fn write_status(&self, usart: UsartId, value: u8) {
        let address = usart.base() + UCSRA;
        let own = status::U2X | status::MPCM;
        let mut kept = self.register(address) & !own | value & own;
        if value & status::TXC != 0 {
            kept &= !status::TXC;
            self.drop_pending(self.ports.port(usart).vectors()[1]);
        }
        self.set_register(address, kept);
        self.sync(usart);
    }

    pub(super) fn write_control(&self, usart: UsartId, value: u8) {
        let address = usart.base() + UCSRB;
        let before = self.register(address);
        self.set_register(address, value);
        let port = self.ports.port(usart);
        if before & control::RXEN != 0 && value & control::RXEN == 0 {
            port.machine.borrow_mut().stop_receiver();
            port.receiving_life.set(port.receiving_life.get() + 1);
        }
        // If a frame left while its interrupt was off, switching it on raises the interrupt.
        let sent = self.register(usart.base() + UCSRA) & status::TXC != 0;
        if sent && before & control::TXCIE == 0 && value & control::TXCIE != 0 {
            // SAFETY: a living chip's own vector.
            unsafe { ffi::avr_raise_interrupt(self.avr, port.vectors()[1]) };
        }
        self.sync(usart);
    }

    /// Sets UCSRnA and the interrupts to the machine's state.
    pub(super) fn sync(&self, usart: UsartId) {
        let port = self.ports.port(usart);
        let address = usart.base() + UCSRA;
        let kept = self.register(address) & (status::TXC | status::U2X | status::MPCM);
        let bits = port.machine.borrow().status() | kept;
        self.set_register(address, bits);
        let enabled = self.control(usart);
        let [received, _, empty] = port.vectors();
        for (vector, holds, enable) in [
            (received, bits & status::RXC != 0, control::RXCIE),
            (empty, bits & status::UDRE != 0, control::UDRIE),
        ] {
            if !holds || enabled & enable == 0 {
                self.drop_pending(vector);
            } else {
                // SAFETY: a living chip's own vector; raising one that is pending does nothing.
                unsafe { ffi::avr_raise_interrupt(self.avr, vector) };
            }
        }
    }

    /// Takes back an interrupt that the core has not entered.
    fn drop_pending(&self, vector: *mut ffi::avr_int_vector_t) {
        // SAFETY: a vector of a living chip; simavr ignores one that is not pending.
        unsafe {
            (*vector).set_pending(0);
            self.interrupts.dropped((*vector).vector);
        }
    }

    fn control(&self, usart: UsartId) -> u8 {
        self.register(usart.base() + UCSRB)
    }

    fn format(&self, usart: UsartId) -> Format {
        let base = usart.base();
        let ubrr = [self.register(base + UBRRL), self.register(base + UBRRH)];
        Format::of_registers(
            self.register(base + UCSRA),
            self.register(base + UCSRB),
            self.register(base + UCSRC),
            u16::from_le_bytes(ubrr),
        )
    }
}

impl Port {
    /// The vectors for "received", "sent" and "buffer empty".
    pub(super) fn vectors(&self) -> [*mut ffi::avr_int_vector_t; 3] {
        // SAFETY: the structure lives inside the chip; only addresses are calculated.
        unsafe {
            [
                &raw mut (*self.simavr).rxc,
                &raw mut (*self.simavr).txc,
                &raw mut (*self.simavr).udrc,
            ]
        }
    }
}
