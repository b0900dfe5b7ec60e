//! Sender and receiver on three wires; timers drive them in virtual time.

use lager_exde::{Receiver, Step, Timing, Transmitter, WORD_BITS, WireAction};

/// Both ends, their timers, the wires between them, and a record of the wires.
struct Bus {
    now_us: u32,
    sender: Transmitter,
    sender_due_us: Option<u32>,
    receiver: Receiver,
    silence_due_us: Option<u32>,
    last_pulse_us: u32,
    data: bool,
    /// Times of the pulses, and the level of data at each.
    samples: Vec<(u32, bool)>,
    /// Every change of data.
    edges: Vec<(u32, bool)>,
    words: Vec<u16>,
    returns: usize,
    /// Numbers of future pulses that the receiver does not get.
    lost: Vec<usize>,
    /// How late each of the sender's steps is.
    late_us: u32,
}

impl Bus {
    fn new(bits: u8) -> Self {
        Self {
            now_us: 0,
            sender: Transmitter::with_bits(bits),
            sender_due_us: Some(0),
            receiver: Receiver::with_bits(bits),
            silence_due_us: None,
            last_pulse_us: 0,
            data: false,
            samples: Vec::new(),
            edges: Vec::new(),
            words: Vec::new(),
            returns: 0,
            lost: Vec::new(),
            late_us: 0,
        }
    }

    fn up(bits: u8) -> Self {
        let mut bus = Self::new(bits);
        bus.run(30_000);
        assert!(bus.sender.is_up() && bus.sender.is_ready());
        bus.samples.clear();
        bus.edges.clear();
        bus
    }

    /// Lets time pass, from one timer to the next.
    fn run(&mut self, span_us: u32) {
        let end_us = self.now_us + span_us;
        loop {
            let due = [self.sender_due_us, self.silence_due_us];
            let Some(next_us) = due.into_iter().flatten().min().filter(|at| *at < end_us) else {
                self.now_us = end_us;
                return;
            };
            self.now_us = next_us;
            if self.silence_due_us == Some(next_us) {
                self.silence_due_us = None;
                if self.receiver.on_silence() {
                    self.returns += 1;
                    self.sender.on_return();
                }
            }
            if self.sender_due_us == Some(next_us) {
                let step = self.sender.advance();
                self.carry_out(step);
            }
        }
    }

    fn carry_out(&mut self, step: Step) {
        let wait = |us| self.now_us + u32::from(us) + self.late_us;
        self.sender_due_us = step.wait_us.map(wait);
        match step.action {
            WireAction::Nothing => {}
            WireAction::Place(_) | WireAction::Release => {
                let level = step.action == WireAction::Place(true);
                if level != self.data {
                    self.edges.push((self.now_us, level));
                }
                self.data = level;
            }
            WireAction::Pulse => {
                let place = self.samples.len();
                self.samples.push((self.now_us, self.data));
                if !self.lost.contains(&place) {
                    let since_us = (self.now_us - self.last_pulse_us).min(0xFFFF) as u16;
                    self.words
                        .extend(self.receiver.on_sync(self.data, since_us));
                    self.last_pulse_us = self.now_us;
                    self.silence_due_us = Some(self.now_us + u32::from(Timing::STANDARD.idle_us));
                }
            }
        }
    }

    fn start(&mut self, word: u16) {
        let step = self.sender.start(word).expect("a sender that is ready");
        self.carry_out(step);
    }

    fn send(&mut self, word: u16) {
        self.start(word);
        self.run(1_000);
    }
}

#[test]
fn the_golden_waveform_is_sampled_in_the_middle_of_every_bit() {
    // The sequence of figure 3.1 of the technical documentation (X4).
    let golden = [0, 1, 1, 1, 0, 0, 1, 0, 0, 1];
    let word = golden.iter().fold(0_u16, |word, bit| word << 1 | bit);
    let mut bus = Bus::up(10);
    let start = bus.now_us;
    bus.send(word);
    let levels: Vec<u16> = bus
        .samples
        .iter()
        .map(|(_, level)| u16::from(*level))
        .collect();
    assert_eq!(levels, golden);
    for (index, (time, _)) in bus.samples.iter().enumerate() {
        assert_eq!(*time, start + 20 * index as u32 + 10);
    }
    assert_eq!(bus.words, [word]);
    // Data changes only between the bits, and is low afterwards.
    for (time, _) in &bus.edges {
        assert_eq!((time - start) % 20, 0);
    }
    assert!(!bus.data);
    assert_eq!(u32::from(Timing::STANDARD.word_us(10)), 200);
}

#[test]
fn the_first_bit_sent_is_bit_ten_of_the_word() {
    let mut bus = Bus::up(WORD_BITS);
    bus.send(0b100_0000_0000);
    let levels: Vec<bool> = bus.samples.iter().map(|sample| sample.1).collect();
    let mut expected = vec![false; 11];
    expected[0] = true;
    assert_eq!(levels, expected);
    assert_eq!(bus.words, [0b100_0000_0000]);
}

#[test]
fn every_word_comes_through() {
    let mut bus = Bus::up(WORD_BITS);
    for word in 0..=0x07FF {
        bus.send(word);
    }
    assert_eq!(bus.words, (0..=0x07FF).collect::<Vec<u16>>());
    assert_eq!(bus.receiver.errors(), 0);
}

#[test]
fn words_may_follow_each_other_as_fast_as_the_sender_takes_them() {
    let mut bus = Bus::up(WORD_BITS);
    for word in 0..200_u16 {
        bus.start(word * 7);
        while !bus.sender.is_ready() {
            bus.run(1);
        }
    }
    let sent: Vec<u16> = (0..200).map(|word| word * 7).collect();
    assert_eq!(bus.words, sent);
    assert_eq!(bus.receiver.errors(), 0);
}

#[test]
fn the_sender_asks_now_and_then_until_it_is_answered() {
    let mut sender = Transmitter::new();
    for _ in 0..5 {
        let step = sender.advance();
        assert_eq!(
            (step.action, step.wait_us),
            (WireAction::Pulse, Some(20_000))
        );
        assert_eq!(sender.start(0x555), None, "no data before the handshake");
        assert!(!sender.is_up() && !sender.is_sending());
    }
    sender.on_return();
    assert_eq!(
        sender.start(0x555),
        None,
        "not sticking to the pulse that was answered"
    );
    let step = sender.advance();
    assert_eq!((step.action, step.wait_us), (WireAction::Nothing, None));
    assert!(sender.start(0x555).is_some());
}

#[test]
fn the_receiver_answers_once_and_then_only_listens() {
    let mut bus = Bus::up(WORD_BITS);
    assert_eq!(bus.returns, 1);
    for word in 0..50 {
        bus.send(word * 37);
    }
    assert_eq!(bus.returns, 1);
    assert_eq!(bus.words.len(), 50);
}

#[test]
fn a_lost_pulse_costs_one_word() {
    for lost in 0..11 {
        let mut bus = Bus::up(WORD_BITS);
        bus.lost = vec![11 + lost];
        for word in [0x155, 0x2AA, 0x7FF, 0x001] {
            bus.send(word);
        }
        assert_eq!(bus.words, [0x155, 0x7FF, 0x001], "pulse {lost}");
        assert_eq!(bus.receiver.errors(), 1);
        assert_eq!(bus.returns, 1);
    }
}

/// A receiver that has answered a sender and then heard silence.
fn met() -> Receiver {
    let mut receiver = Receiver::new();
    assert_eq!(receiver.on_sync(false, 0), None);
    assert!(receiver.on_silence());
    receiver
}

#[test]
fn a_word_is_midway_from_its_first_bit_to_its_last() {
    let mut receiver = met();
    assert!(!receiver.is_midway());
    for _ in 0..10 {
        assert_eq!(receiver.on_sync(true, 20), None);
        assert!(receiver.is_midway());
    }
    assert_eq!(receiver.on_sync(true, 20), Some(0x7FF));
    assert!(!receiver.is_midway());
    // It is not midway either when the rest of a word did not come.
    assert!(!receiver.on_silence());
    assert_eq!(receiver.on_sync(true, 100), None);
    assert_eq!(receiver.on_sync(true, 20), None);
    assert!(!receiver.on_silence());
    assert!(!receiver.is_midway());
}

#[test]
fn an_extra_pulse_costs_one_word_and_is_counted() {
    for place in 0..11 {
        let mut receiver = met();
        let mut words = Vec::new();
        for (index, word) in [0x155_u16, 0x2AA, 0x7FF].into_iter().enumerate() {
            for bit in 0..11 {
                words.extend(receiver.on_sync(word >> (10 - bit) & 1 == 1, 20));
                if index == 1 && bit == place {
                    words.extend(receiver.on_sync(true, 10));
                }
            }
            assert!(!receiver.on_silence());
        }
        assert_eq!(words.len(), 3);
        assert_eq!((words[0], words[2]), (0x155, 0x7FF));
        assert_eq!(receiver.errors(), 1, "place {place}");
    }
}

#[test]
fn a_disturbance_close_to_a_pulse_is_not_a_bit() {
    let mut receiver = met();
    let mut word = None;
    for bit in 0..11 {
        word = receiver.on_sync(bit % 2 == 0, 20);
        if bit == 4 {
            assert_eq!(receiver.on_sync(false, 5), None);
        }
    }
    assert_eq!(word, Some(0b101_0101_0101));
    assert_eq!(receiver.errors(), 1);
}

#[test]
fn the_first_bit_of_a_word_may_come_after_any_time() {
    // The receiving board's clock wraps, so the time after a long silence can be any value.
    for since_us in [0, 3, 20, 0xFFFF] {
        let mut receiver = met();
        let mut word = receiver.on_sync(true, since_us);
        for _ in 0..10 {
            word = receiver.on_sync(false, 20);
        }
        assert_eq!(word, Some(0x400), "{since_us}");
    }
}

#[test]
fn errors_are_counted_up_to_255() {
    let mut receiver = met();
    for _ in 0..300 {
        let _ = receiver.on_sync(true, 20);
        let _ = receiver.on_sync(true, 20);
        assert!(!receiver.on_silence());
    }
    assert_eq!(receiver.errors(), 255);
}

#[test]
fn a_restarted_sender_is_answered_again() {
    let mut bus = Bus::up(WORD_BITS);
    bus.send(0x123);
    bus.sender = Transmitter::new();
    bus.sender_due_us = Some(bus.now_us);
    bus.run(30_000);
    assert!(bus.sender.is_up());
    assert_eq!(bus.returns, 2);
    bus.send(0x456);
    assert_eq!(bus.words, [0x123, 0x456]);
    assert_eq!(bus.receiver.errors(), 0);
}

#[test]
fn a_receiver_restarted_inside_a_word_waits_for_the_next() {
    let mut bus = Bus::up(WORD_BITS);
    bus.start(0x7FF);
    bus.run(100);
    bus.receiver = Receiver::new();
    bus.run(1_000);
    bus.send(0x2A5);
    assert_eq!(bus.words, [0x2A5]);
    assert_eq!(bus.receiver.errors(), 0);
}

#[test]
fn a_sender_served_late_sends_slowly_and_right() {
    let mut bus = Bus::up(WORD_BITS);
    // Two steps make a bit; with 15 us each the bits still come before the receiver's time-out.
    bus.late_us = 15;
    bus.start(0x5A3);
    bus.run(2_000);
    assert_eq!(bus.words, [0x5A3]);
    for pair in bus.samples.windows(2) {
        assert_eq!(pair[1].0 - pair[0].0, 50);
    }
}

#[test]
fn a_word_is_refused_while_another_is_under_way() {
    let mut bus = Bus::up(WORD_BITS);
    bus.start(1);
    assert!(bus.sender.is_sending());
    assert_eq!(bus.sender.start(2), None);
    bus.run(1_000);
    assert!(!bus.sender.is_sending());
    assert_eq!(bus.words, [1]);
}
