//! Sender and receiver on three wires, stepped in virtual time.

use lager_exde::{Pins, Receiver, Timing, Transmitter, WORD_BITS};

/// Both ends and the wires between them, with everything that rose on sync.
struct Bus {
    now_us: u32,
    sender: Transmitter,
    receiver: Receiver,
    pins: Pins,
    /// Times of the data level at every rise of sync, and the level.
    samples: Vec<(u32, bool)>,
    /// Every change of the wires.
    edges: Vec<(u32, Pins)>,
    words: Vec<u16>,
    returns: usize,
    /// Rises of sync, counted from now, that the receiver does not get.
    lost: Vec<usize>,
    rises: usize,
}

impl Bus {
    fn new(bits: u8, start_us: u32) -> Self {
        Self {
            now_us: start_us,
            sender: Transmitter::with_bits(Timing::STANDARD, bits, start_us),
            receiver: Receiver::with_bits(Timing::STANDARD, bits),
            pins: Pins::default(),
            samples: Vec::new(),
            edges: Vec::new(),
            words: Vec::new(),
            returns: 0,
            lost: Vec::new(),
            rises: 0,
        }
    }

    fn up(bits: u8, start_us: u32) -> Self {
        let mut bus = Self::new(bits, start_us);
        bus.run(30_000, 10);
        assert!(bus.sender.is_up() && bus.sender.is_ready());
        bus.samples.clear();
        bus.edges.clear();
        bus.rises = 0;
        bus
    }

    /// Steps both ends every `step_us` for `span_us`.
    fn run(&mut self, span_us: u32, step_us: u32) {
        for _ in 0..span_us / step_us {
            self.step();
            self.now_us = self.now_us.wrapping_add(step_us);
        }
    }

    fn step(&mut self) {
        let pins = self.sender.poll(self.now_us);
        if pins != self.pins {
            self.edges.push((self.now_us, pins));
        }
        if pins.sync && !self.pins.sync {
            let rise = self.rises;
            self.rises += 1;
            self.samples.push((self.now_us, pins.data));
            if !self.lost.contains(&rise) {
                self.words
                    .extend(self.receiver.on_sync(pins.data, self.now_us));
            }
        }
        self.pins = pins;
        if self.receiver.return_sync(self.now_us) {
            self.returns += 1;
            self.sender.on_return();
        }
    }

    fn send(&mut self, word: u16) {
        while !self.sender.is_ready() {
            self.step();
            self.now_us = self.now_us.wrapping_add(10);
        }
        assert!(self.sender.start(word, self.now_us));
        self.run(5_000, 10);
    }
}

#[test]
fn the_golden_waveform_is_sampled_in_the_middle_of_every_bit() {
    // The sequence of figure 3.1 of the technical documentation (X4).
    let golden = [0, 1, 1, 1, 0, 0, 1, 0, 0, 1];
    let word = golden.iter().fold(0_u16, |word, bit| word << 1 | bit);
    let mut bus = Bus::up(10, 0);
    let start = bus.now_us;
    bus.send(word);
    let levels: Vec<u16> = bus
        .samples
        .iter()
        .map(|(_, level)| u16::from(*level))
        .collect();
    assert_eq!(levels, golden);
    for (index, (time, _)) in bus.samples.iter().enumerate() {
        assert_eq!(*time, start + 100 * index as u32 + 40);
    }
    assert_eq!(bus.words, [word]);
    // Data changes only between the pulses: a level lasts whole bits.
    let mut data = false;
    for (time, pins) in &bus.edges {
        if pins.data != data {
            assert!(!pins.sync);
            assert_eq!((time - start) % 100, 0);
            data = pins.data;
        }
    }
}

#[test]
fn the_first_bit_sent_is_bit_ten_of_the_word() {
    let mut bus = Bus::up(WORD_BITS, 0);
    bus.send(0b100_0000_0000);
    assert_eq!(
        bus.samples
            .iter()
            .map(|sample| sample.1)
            .collect::<Vec<_>>(),
        {
            let mut levels = vec![false; 11];
            levels[0] = true;
            levels
        }
    );
    assert_eq!(bus.words, [0b100_0000_0000]);
}

#[test]
fn every_word_comes_through_also_over_the_clocks_end() {
    let mut bus = Bus::up(WORD_BITS, u32::MAX - 5_000_000);
    for word in 0..=0x07FF {
        bus.send(word);
    }
    assert_eq!(bus.words, (0..=0x07FF).collect::<Vec<u16>>());
    assert_eq!(bus.receiver.errors(), 0);
    assert!(bus.now_us < 1 << 31, "the clock went round");
}

#[test]
fn the_sender_asks_now_and_then_until_it_is_answered() {
    let mut sender = Transmitter::new(Timing::STANDARD, 0);
    let mut rises = Vec::new();
    let mut high = false;
    for now in (0..100_000).step_by(10) {
        let pins = sender.poll(now);
        assert!(!pins.data);
        if pins.sync && !high {
            rises.push(now);
        }
        high = pins.sync;
        assert!(!sender.start(0x555, now), "no data before the handshake");
    }
    assert_eq!(rises, [0, 20_020, 40_040, 60_060, 80_080]);
    sender.on_return();
    for now in (100_000..130_000).step_by(10) {
        assert!(!sender.poll(now).sync, "no more asking once answered");
    }
    assert!(sender.start(0x555, 130_000));
}

#[test]
fn the_receiver_answers_once_and_then_only_listens() {
    let mut bus = Bus::up(WORD_BITS, 0);
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
        let mut bus = Bus::up(WORD_BITS, 0);
        bus.lost = vec![11 + lost];
        for word in [0x155, 0x2AA, 0x7FF, 0x001] {
            bus.send(word);
        }
        assert_eq!(bus.words, [0x155, 0x7FF, 0x001], "pulse {lost}");
        assert_eq!(bus.receiver.errors(), 1);
        assert_eq!(bus.returns, 1);
    }
}

#[test]
fn an_extra_pulse_costs_one_word_and_is_counted() {
    for place in 0..11 {
        let mut receiver = Receiver::new(Timing::STANDARD);
        receiver.on_sync(false, 0);
        let mut words = Vec::new();
        let mut now = 10_000;
        for (index, word) in [0x155_u16, 0x2AA, 0x7FF].into_iter().enumerate() {
            for bit in 0..11 {
                words.extend(receiver.on_sync(word >> (10 - bit) & 1 == 1, now));
                if index == 1 && bit == place {
                    words.extend(receiver.on_sync(true, now + 50));
                }
                now += 100;
            }
            now += 4_000;
        }
        assert_eq!(words.len(), 3);
        assert_eq!((words[0], words[2]), (0x155, 0x7FF));
        assert_eq!(receiver.errors(), 1, "place {place}");
    }
}

#[test]
fn a_disturbance_close_to_a_pulse_is_not_a_bit() {
    let mut receiver = Receiver::new(Timing::STANDARD);
    receiver.on_sync(false, 0);
    let mut now = 10_000;
    let mut word = None;
    for bit in 0..11 {
        word = receiver.on_sync(bit % 2 == 0, now);
        if bit == 4 {
            assert_eq!(receiver.on_sync(false, now + 10), None);
        }
        now += 100;
    }
    assert_eq!(word, Some(0b101_0101_0101));
    assert_eq!(receiver.errors(), 1);
}

#[test]
fn a_restarted_sender_is_answered_again() {
    let mut bus = Bus::up(WORD_BITS, 0);
    bus.send(0x123);
    bus.sender = Transmitter::new(Timing::STANDARD, bus.now_us);
    bus.run(30_000, 10);
    assert!(bus.sender.is_up());
    assert_eq!(bus.returns, 2);
    bus.send(0x456);
    assert_eq!(bus.words, [0x123, 0x456]);
    assert_eq!(bus.receiver.errors(), 0);
}

#[test]
fn a_receiver_restarted_inside_a_word_waits_for_the_next() {
    let mut bus = Bus::up(WORD_BITS, 0);
    assert!(bus.sender.start(0x7FF, bus.now_us));
    bus.run(500, 10);
    bus.receiver = Receiver::new(Timing::STANDARD);
    bus.run(5_000, 10);
    bus.send(0x2A5);
    assert_eq!(bus.words, [0x2A5]);
    assert_eq!(bus.receiver.errors(), 0);
}

#[test]
fn a_sender_stepped_late_sends_slowly_and_right() {
    let mut bus = Bus::up(WORD_BITS, 0);
    assert!(bus.sender.start(0x5A3, bus.now_us));
    // Three steps make a bit; 170 us late each they stay inside the receiver's patience.
    bus.run(20_000, 170);
    assert_eq!(bus.words, [0x5A3]);
    for pair in bus.edges.windows(2) {
        assert!(pair[1].0 - pair[0].0 >= 170);
    }
}

#[test]
fn stepping_only_when_due_gives_the_same_waveform() {
    let mut often = Bus::up(WORD_BITS, 0);
    let mut rarely = often.sender.clone();
    let start = often.now_us;
    often.send(0x4D2);
    assert!(rarely.start(0x4D2, start));
    let mut pins = Pins::default();
    let mut edges = Vec::new();
    let mut now = start;
    loop {
        let next = rarely.poll(now);
        if next != pins {
            edges.push((now, next));
            pins = next;
        }
        let Some(due) = rarely.next_due_us() else {
            break;
        };
        now = due;
    }
    assert_eq!(edges, often.edges);
}

#[test]
fn a_word_is_refused_while_another_is_under_way() {
    let mut bus = Bus::up(WORD_BITS, 0);
    assert!(bus.sender.start(1, bus.now_us));
    assert!(!bus.sender.start(2, bus.now_us));
    bus.run(5_000, 10);
    assert_eq!(bus.words, [1]);
}
