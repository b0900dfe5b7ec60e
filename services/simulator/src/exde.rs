//! The three wires of ExDe and both their ends, as the boards' interrupts drive them.
//!
//! ```text
//!   sensor board                            steering board
//!   send(word) -> Transmitter --data, sync--> Receiver -> words
//!                  timer  ^                     |  timer
//!                         '----- return sync ---'
//! ```
//! Interrupts still come while a board's main loop hangs; a board in reset has no end.

use std::collections::VecDeque;

use lager_exde::{Receiver, Step, Timing, Transmitter, WireAction};

/// The number of words that the steering board's interrupt keeps for its loop.
const WORDS: usize = 4;
const TIMING: Timing = Timing::STANDARD;
const NS_PER_US: u64 = 1_000;

/// The sending end and its timer.
#[derive(Clone, Debug)]
struct Sender {
    transmitter: Transmitter,
    due_ns: Option<u64>,
}

/// The receiving end and its timer.
#[derive(Clone, Debug)]
struct Listener {
    receiver: Receiver,
    silence_ns: Option<u64>,
    last_pulse_ns: u64,
}

/// The three wires between the boards (X2), and both ends.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExDe {
    sender: Option<Sender>,
    listener: Option<Listener>,
    data: bool,
    words: VecDeque<(u16, u32)>,
    /// Whether a word has arrived since the steering board's last step.
    pub(crate) arrived: bool,
    /// Whether a word has left since the sensor board's last step.
    pub(crate) sent: bool,
}

impl ExDe {
    /// The sensor board starts.
    pub(crate) fn start_sender(&mut self, now: u64) {
        self.sender = Some(Sender {
            transmitter: Transmitter::new(),
            due_ns: Some(now),
        });
    }

    /// The steering board starts.
    pub(crate) fn start_receiver(&mut self) {
        self.listener = Some(Listener {
            receiver: Receiver::new(),
            silence_ns: None,
            last_pulse_ns: 0,
        });
    }

    /// The sensor board is held in reset: its pins are inputs and read low.
    pub(crate) fn release_sender(&mut self) {
        self.sender = None;
        self.data = false;
        self.sent = false;
    }

    /// The steering board is held in reset: it samples nothing.
    pub(crate) fn release_receiver(&mut self) {
        self.listener = None;
        self.words.clear();
        self.arrived = false;
    }

    /// The time of the next timer interrupt, in ns.
    pub(crate) fn next_event(&self) -> u64 {
        let sender = self.sender.as_ref().and_then(|sender| sender.due_ns);
        let listener = self
            .listener
            .as_ref()
            .and_then(|listener| listener.silence_ns);
        sender.unwrap_or(u64::MAX).min(listener.unwrap_or(u64::MAX))
    }

    /// Runs the interrupts that are due; `receiver_us` is the steering board's clock.
    pub(crate) fn interrupt(&mut self, now: u64, receiver_us: u32) {
        if let Some(listener) = &mut self.listener
            && listener.silence_ns.is_some_and(|at| at <= now)
        {
            listener.silence_ns = None;
            if listener.receiver.on_silence()
                && let Some(sender) = &mut self.sender
            {
                sender.transmitter.on_return();
            }
        }
        if let Some(sender) = &mut self.sender
            && sender.due_ns.is_some_and(|at| at <= now)
        {
            let step = sender.transmitter.advance();
            self.carry_out(step, now, receiver_us);
        }
    }

    /// Begins to send a word; false if the sender takes none.
    pub(crate) fn send(&mut self, word: u16, now: u64) -> bool {
        let step = self
            .sender
            .as_mut()
            .and_then(|sender| sender.transmitter.start(word));
        match step {
            Some(step) => {
                // The first step of a word only sets the data wire and makes no pulse.
                self.carry_out(step, now, 0);
                true
            }
            None => false,
        }
    }

    /// Whether the sender still has bits of a word.
    pub(crate) fn is_sending(&self) -> bool {
        self.sender
            .as_ref()
            .is_some_and(|sender| sender.transmitter.is_sending())
    }

    /// The oldest word that the steering board has not read, with its time.
    pub(crate) fn word(&mut self) -> Option<(u16, u32)> {
        self.words.pop_front()
    }

    /// The receiver's count of errors.
    pub(crate) fn errors(&self) -> u8 {
        self.listener
            .as_ref()
            .map_or(0, |listener| listener.receiver.errors())
    }

    fn carry_out(&mut self, step: Step, now: u64, receiver_us: u32) {
        if let Some(sender) = &mut self.sender {
            sender.due_ns = step.wait_us.map(|us| now + u64::from(us) * NS_PER_US);
        }
        match step.action {
            WireAction::Nothing => {}
            WireAction::Place(level) => self.data = level,
            WireAction::Release => {
                self.data = false;
                self.sent = true;
            }
            WireAction::Pulse => self.sample(now, receiver_us),
        }
    }

    fn sample(&mut self, now: u64, receiver_us: u32) {
        let Some(listener) = &mut self.listener else {
            return;
        };
        let since_us = (now - listener.last_pulse_ns) / NS_PER_US;
        let since_us = u16::try_from(since_us).unwrap_or(u16::MAX);
        listener.last_pulse_ns = now;
        listener.silence_ns = Some(now + u64::from(TIMING.idle_us) * NS_PER_US);
        if let Some(word) = listener.receiver.on_sync(self.data, since_us)
            && self.words.len() < WORDS
        {
            self.words.push_back((word, receiver_us));
            self.arrived = true;
        }
    }
}
