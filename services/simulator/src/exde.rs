//! The wires of ExDe and both ends as the boards' interrupts drive them.
//!
//! ```text
//!   sensor board                            steering board
//!   send(word) -> Transmitter --data, sync--> Receiver -> words
//!                  timer  ^                     |  timer
//!                         '----- return sync ---'
//! ```
//! Interrupts go on while a board's main loop hangs; in reset its end is gone.

use std::collections::VecDeque;

use lager_exde::{Action, Receiver, Step, Timing, Transmitter};

/// Words the steering board's interrupt can keep before its loop looks.
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

/// The three wires between the boards (X2) and their ends.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExDe {
    sender: Option<Sender>,
    listener: Option<Listener>,
    data: bool,
    words: VecDeque<(u16, u32)>,
    /// Whether a word has come since the steering board was stepped.
    pub(crate) arrived: bool,
    /// Whether a word has left since the sensor board was stepped.
    pub(crate) sent: bool,
}

impl ExDe {
    /// The sensor board begins.
    pub(crate) fn start_sender(&mut self, now: u64) {
        self.sender = Some(Sender {
            transmitter: Transmitter::new(),
            due_ns: Some(now),
        });
    }

    /// The steering board begins.
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

    /// When a timer runs out next.
    pub(crate) fn next_event(&self) -> u64 {
        let sender = self.sender.as_ref().and_then(|sender| sender.due_ns);
        let listener = self
            .listener
            .as_ref()
            .and_then(|listener| listener.silence_ns);
        sender.unwrap_or(u64::MAX).min(listener.unwrap_or(u64::MAX))
    }

    /// The interrupts that are due; `receiver_us` is the steering board's clock.
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

    /// Begins to send a word, if the sender takes one.
    pub(crate) fn send(&mut self, word: u16, now: u64) -> bool {
        let step = self
            .sender
            .as_mut()
            .and_then(|sender| sender.transmitter.start(word));
        match step {
            Some(step) => {
                // The first step of a word sets data and never makes a pulse.
                self.carry_out(step, now, 0);
                true
            }
            None => false,
        }
    }

    /// Whether bits of a word are still to be sent.
    pub(crate) fn is_sending(&self) -> bool {
        self.sender
            .as_ref()
            .is_some_and(|sender| sender.transmitter.is_sending())
    }

    /// The oldest word the steering board has not read.
    pub(crate) fn word(&mut self) -> Option<(u16, u32)> {
        self.words.pop_front()
    }

    /// What the receiver has counted.
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
            Action::Nothing => {}
            Action::Place(level) => self.data = level,
            Action::Release => {
                self.data = false;
                self.sent = true;
            }
            Action::Pulse => self.sample(now, receiver_us),
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
