//! Boards that reset, services that restart, cables that are unplugged.

use std::time::Duration;

use lager_wire::link::{HostEvent, HostLink, HostTransmitter};
use lager_wire::{Callsign, ResetCause, Version};

use crate::line::{Harm, Line, board};
use crate::sample::distance;

#[test]
fn a_reset_board_is_not_counted_as_loss() {
    let mut line = Line::new(1);
    line.run(1_037);
    assert!(line.host.health().packets > 100);
    line.board = board(Callsign::Steering, ResetCause::Watchdog);
    line.run(1_000);

    let ups = line.ups();
    assert_eq!(ups.len(), 2);
    assert!(ups[1].rebooted);
    assert_eq!(ups[1].reset, ResetCause::Watchdog);
    assert_eq!(ups[1].epoch, 2);
    let health = line.host.health();
    assert_eq!((health.lost, health.epoch, health.reboots), (0, 2, 1));
    assert!(health.packets < 200, "counters start again: {health:?}");
    assert_eq!(line.board.lost_packets(), 0);
}

#[test]
fn a_reset_in_the_middle_of_a_packet_is_not_counted_as_loss() {
    for cut in 1..11 {
        let mut line = Line::new(1);
        line.run(500);
        let half = line.board.encode(distance(0, 1).payload).unwrap();
        for byte in &half[..cut] {
            assert_eq!(line.host.push(*byte, line.now()), None);
        }
        line.board = board(Callsign::Steering, ResetCause::BrownOut);
        line.run(1_000);
        assert_eq!(line.ups().len(), 2, "cut at {cut}");
        assert_eq!(line.host.health().lost, 0, "cut at {cut}");
        assert!(line.board.is_up());
    }
}

#[test]
fn one_syn_after_data_is_not_yet_a_reboot() {
    let mut line = Line::new(1);
    line.run(500);
    let mut stray = board(Callsign::Steering, ResetCause::Unknown);
    let syn = stray.poll(0).unwrap();
    let events = |line: &mut Line| {
        let now = line.now();
        syn.iter()
            .filter_map(|byte| line.host.push(*byte, now))
            .collect::<Vec<_>>()
    };
    for _ in 0..5 {
        // Data between two SYNs shows that the board has not rebooted.
        assert_eq!(events(&mut line), []);
        line.run(50);
    }
    assert_eq!(line.ups().len(), 1);
    assert_eq!(line.host.health().lost, 0);
    assert_eq!(events(&mut line), []);
    assert!(matches!(
        events(&mut line)[..],
        [HostEvent::SendAck { up: Some(up) }] if up.rebooted
    ));
}

#[test]
fn a_restarted_pi_finds_a_running_board_without_resetting_it() {
    let mut line = Line::new(1);
    line.run(733);
    line.host = HostLink::new();
    line.transmitter = HostTransmitter::new();
    line.host_events.clear();
    line.run(500);
    let ups = line.ups();
    assert_eq!(ups.len(), 1);
    assert!(!ups[0].rebooted);
    assert_eq!(ups[0].reset, ResetCause::PowerOn);
    assert_eq!(line.received()[0].id.get(), 0);
    assert_eq!(line.host.health().lost, 0);
    assert_eq!(line.board.lost_packets(), 0);
    // The same board, without a restart: it came up twice.
    let ups = line
        .board_events
        .iter()
        .filter(|event| **event == lager_wire::link::BoardEvent::Up)
        .count();
    assert_eq!(ups, 2);
}

#[test]
fn a_service_that_takes_over_begins_a_new_epoch() {
    let mut line = Line::new(1);
    line.host = HostLink::after_epoch(6);
    line.run(100);
    assert_eq!(line.ups()[0].epoch, 7);
    assert_eq!(line.host.health().epoch, 7);
}

#[test]
fn a_restarted_pi_finds_a_running_board_on_a_bad_line_too() {
    for seed in 0..50 {
        let mut line = Line::new(seed);
        line.run(100);
        let odds = Some(40);
        line.harm = Harm {
            loses: odds,
            flips: odds,
            adds: odds,
        };
        line.host = HostLink::new();
        line.transmitter = HostTransmitter::new();
        line.host_events.clear();
        assert!(
            (0..100).any(|_| {
                line.run(100);
                !line.received().is_empty()
            }),
            "seed {seed}"
        );
        assert!(line.ups().iter().all(|up| up.version == Version::One));
    }
}

#[test]
fn a_cut_line_is_noticed_after_a_second_and_taken_up_again() {
    let mut line = Line::new(1);
    line.run(500);
    line.cut_to_board = true;
    line.cut_to_host = true;
    line.run(990);
    assert!(line.host.is_up());
    line.run(20);
    assert!(!line.host.is_up());
    assert!(line.host_events.contains(&HostEvent::Silent));
    line.run(3_000);
    line.cut_to_board = false;
    line.cut_to_host = false;
    line.run(1_000);
    assert!(line.host.is_up() && line.board.is_up());
    let health = line.host.health();
    assert_eq!((health.epoch, health.lost, health.reboots), (2, 0, 0));
}

#[test]
fn a_board_that_resets_after_a_second_of_silence_has_rebooted() {
    // Cut in both directions, and cut only towards the Pi: then the board hears the Pi ask.
    for cut_to_board in [true, false] {
        for down_ms in [1_100, 5_000] {
            let mut line = Line::new(1);
            line.run(500);
            line.cut_to_board = cut_to_board;
            line.cut_to_host = true;
            line.run(down_ms);
            assert!(!line.host.is_up());
            line.board = board(Callsign::Steering, ResetCause::BrownOut);
            line.cut_to_board = false;
            line.cut_to_host = false;
            line.run(1_000);
            let ups = line.ups();
            assert_eq!(ups.len(), 2);
            assert!(ups[1].rebooted && ups[1].fresh);
            assert_eq!((ups[1].reset, ups[1].epoch), (ResetCause::BrownOut, 2));
            let health = line.host.health();
            assert_eq!((health.epoch, health.lost, health.reboots), (2, 0, 1));
            assert_eq!(line.board.lost_packets(), 0);
        }
    }
}

#[test]
fn a_board_that_is_asked_again_has_not_rebooted() {
    let mut line = Line::new(1);
    line.run(500);
    // Another process asks: the board answers, and this end sees the board ask.
    for _ in 0..3 {
        for byte in HostTransmitter::new().syn() {
            let now = line.board_now();
            line.board.push(byte, now);
        }
        line.run(500);
    }
    let ups = line.ups();
    assert!(ups.len() > 1);
    assert!(ups[1..].iter().all(|up| !up.rebooted && !up.fresh));
    assert_eq!(line.host.health().reboots, 0);
}

#[test]
fn a_restarted_pi_is_told_whether_the_board_has_restarted_too() {
    for restarts in [false, true] {
        let mut line = Line::new(1);
        line.run(500);
        line.host = HostLink::new();
        line.transmitter = HostTransmitter::new();
        line.host_events.clear();
        if restarts {
            line.board = board(Callsign::Steering, ResetCause::External);
        }
        line.run(500);
        assert_eq!(line.ups()[0].fresh, restarts);
    }
}

#[test]
fn a_link_that_fell_silent_keeps_its_last_counts() {
    let mut line = Line::new(1);
    line.run(500);
    let health = line.host.health();
    line.cut_to_host = true;
    line.run(2_000);
    assert_eq!(line.host.health(), health);
}

#[test]
fn another_board_on_the_same_port_is_believed_at_once() {
    let mut line = Line::new(1);
    line.run(500);
    line.board = board(Callsign::Sensor, ResetCause::PowerOn);
    line.data = distance(0, 44).payload;
    line.run(20);
    assert_eq!(line.host.callsign(), Some(Callsign::Sensor));
    let ups = line.ups();
    assert_eq!((ups.len(), ups[1].rebooted), (2, false));
}

#[test]
fn a_board_that_was_mistaken_for_the_other_is_asked_again() {
    let mut line = Line::new(1);
    // A damaged SYN that claims another sender although its check value fits.
    for byte in board(Callsign::Sensor, ResetCause::PowerOn)
        .poll(0)
        .unwrap()
    {
        line.host.push(byte, line.now());
    }
    assert_eq!(line.host.callsign(), Some(Callsign::Sensor));
    for byte in line.transmitter.ack(Version::One) {
        line.board.push(byte, line.board_now());
    }
    assert!(line.board.is_up());
    line.run(50);
    assert_eq!(line.host.callsign(), Some(Callsign::Steering));
    assert!(
        line.received()
            .iter()
            .all(|packet| packet.payload == line.data)
    );
    assert_eq!(line.host.health().lost, 0);
}

#[test]
fn the_pis_own_bytes_coming_back_bring_nothing_up() {
    let mut host = HostLink::new();
    let mut transmitter = HostTransmitter::new();
    for millisecond in 0..5_000 {
        let now = Duration::from_millis(millisecond);
        while let Some(event) = host.poll(now) {
            assert_eq!(event, HostEvent::SendSyn);
            let (syn, ack) = (transmitter.syn(), transmitter.ack(Version::One));
            for byte in syn.into_iter().chain(ack) {
                assert_eq!(host.push(byte, now), None);
            }
        }
    }
}

/// A steady fault makes damaged SYNs alike. The Pi must not take them for an original board's.
#[test]
fn a_version_one_syn_damaged_the_same_way_each_time_is_never_believed() {
    let mut tried = 0;
    for (sign, reset) in [
        (Callsign::Sensor, ResetCause::PowerOn),
        (Callsign::Sensor, ResetCause::Unknown),
        (Callsign::Steering, ResetCause::Watchdog),
    ] {
        let mut asking = board(sign, reset);
        if reset == ResetCause::Unknown {
            // A board that has been up before.
            let mut pi = HostTransmitter::new();
            for byte in pi.ack(Version::One).into_iter().chain(pi.syn()) {
                asking.push(byte, 0);
            }
        }
        let whole = asking.poll(0).unwrap();
        for a in 0..88 {
            for b in a..88 {
                for c in b..88 {
                    let mut damaged = whole;
                    let mut bits = [a, b, c].to_vec();
                    bits.dedup();
                    for bit in bits {
                        damaged[bit / 8] ^= 1 << (bit % 8);
                    }
                    let mut host = HostLink::new();
                    for count in 0..8 {
                        let now = Duration::from_millis(count * 100);
                        for byte in damaged {
                            assert_eq!(host.push(byte, now), None, "bits {a} {b} {c}");
                        }
                    }
                    assert!(!host.is_up());
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 60_000, "{tried}");
}

#[test]
fn a_whole_syn_between_damaged_ones_is_believed() {
    let whole = board(Callsign::Sensor, ResetCause::PowerOn)
        .poll(0)
        .unwrap();
    let mut host = HostLink::new();
    let mut up = 0;
    for count in 0..20_u64 {
        let mut bytes = whole;
        if count != 9 {
            bytes[9] ^= 1 << (count % 8);
        }
        for byte in bytes {
            let event = host.push(byte, Duration::from_millis(count * 100));
            up += u32::from(matches!(event, Some(HostEvent::SendAck { up: Some(_) })));
        }
        assert_eq!(up, u32::from(count >= 9), "SYN {count}");
    }
    assert_eq!(host.version(), Some(Version::One));
}
