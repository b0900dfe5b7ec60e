//! Runs the board's end and the Pi's end of a line against each other.

use std::time::Duration;

use lager_wire::link::{BoardEvent, BoardLink, HostEvent, HostLink, HostTransmitter, Up};
use lager_wire::{
    BUILD, Callsign, Centimetres, PACKET_LENGTH, Packet, PacketId, Payload, ResetCause,
    SteerCommand, Version,
};

use crate::line::{GAP_US, Harm, Line, board};

#[test]
fn a_board_comes_up_at_its_first_syn() {
    let mut line = Line::new(1);
    line.run(1);
    let up = Up {
        callsign: Callsign::Steering,
        version: Version::One,
        epoch: 1,
        reset: ResetCause::PowerOn,
        rebooted: false,
        fresh: true,
        build: BUILD,
    };
    assert_eq!(
        line.host_events,
        [HostEvent::SendSyn, HostEvent::SendAck { up: Some(up) }]
    );
    assert_eq!(line.board_events, [BoardEvent::Up]);
    assert_eq!(line.host.callsign(), Some(Callsign::Steering));

    line.run(1_000);
    assert_eq!(line.ups(), [up]);
    let ids: Vec<u8> = line
        .received()
        .iter()
        .map(|packet| packet.id.get())
        .collect();
    let expected: Vec<u8> = (0..16).cycle().take(200).collect();
    assert_eq!(ids, expected);
    assert_eq!(line.host.health().lost, 0);
    assert_eq!(line.host.health().skipped_bytes, 0);
    assert_eq!(line.board.lost_packets(), 0);
    assert_eq!(line.board.bad_packets(), 0);
}

#[test]
fn a_board_refuses_what_only_boards_send() {
    let mut line = Line::new(1);
    line.run(1);
    let heard = |link: &mut BoardLink, id, payload| {
        let id = PacketId::new(id);
        let bytes = Packet { id, payload }.encode(Version::One);
        let heard = bytes.map(|byte| link.push(byte, 0));
        heard.into_iter().flatten().last()
    };
    assert_eq!(heard(&mut line.board, 0, line.data), None);
    assert_eq!(line.board.bad_packets(), 1);
    // The next packet is heard, and one before it is missing.
    let command = Payload::SteerCommand(SteerCommand { code: 3, seq: 1 });
    let event = heard(&mut line.board, 1, command);
    assert!(matches!(event, Some(BoardEvent::Packet(packet)) if packet.payload == command));
    assert_eq!(line.board.lost_packets(), 1);
}

#[test]
fn a_board_asks_at_once_and_then_every_100_ms_also_when_its_clock_wraps() {
    let start = u32::MAX - 250_000;
    let mut link = board(Callsign::Sensor, ResetCause::Unknown);
    let mut sent = Vec::new();
    for millisecond in 0..500 {
        let now = start.wrapping_add(millisecond * 1_000);
        if link.poll(now).is_some() {
            sent.push(millisecond);
        }
        assert!(link.us_to_syn(now).unwrap() <= 100_000);
    }
    assert_eq!(sent, [0, 100, 200, 300, 400]);
}

#[test]
fn the_pi_asks_every_100_ms_until_someone_answers() {
    let mut host = HostLink::new();
    let mut asked = Vec::new();
    for millisecond in 0..350 {
        while let Some(event) = host.poll(Duration::from_millis(millisecond)) {
            assert_eq!(event, HostEvent::SendSyn);
            asked.push(millisecond);
        }
    }
    assert_eq!(asked, [0, 100, 200, 300]);
}

#[test]
fn nothing_but_handshakes_is_sent_before_the_link_is_up() {
    let mut link = board(Callsign::Sensor, ResetCause::Unknown);
    let data = Payload::Distance(Centimetres(44));
    assert_eq!(link.encode(data), None);
    let mut transmitter = HostTransmitter::new();
    assert_eq!(transmitter.encode(data), None);
    transmitter.ack(Version::One);
    assert!(transmitter.encode(data).is_some());
}

#[test]
fn both_ends_come_up_over_a_line_that_loses_flips_and_adds_bytes() {
    let mut slowest = 0;
    for seed in 0..300 {
        let mut line = Line::new(seed);
        // The worst line damages every fourth byte.
        let odds = [200, 50, 20, 12][(seed % 4) as usize];
        line.harm = Harm {
            loses: Some(odds),
            flips: Some(odds),
            adds: Some(odds),
        };
        let start = line.now_us;
        assert!(line.run_up(300), "seed {seed} never came up");
        slowest = slowest.max((line.now_us - start) / 1_000);
        line.run(3_000);
        // A check value of eight bits accepts one in 256 of the SYNs with more than three wrong
        // bits. So on the worst line the Pi may take a board for another one for a moment.
        let sound = |version, callsign| (version, callsign) == (Version::One, Callsign::Steering);
        let mistaken = line
            .ups()
            .iter()
            .filter(|up| !sound(up.version, up.callsign))
            .count();
        assert!(mistaken <= usize::from(odds == 12), "seed {seed}");
        let whole = line
            .received()
            .iter()
            .filter(|packet| packet.payload == line.data)
            .count();
        assert!(whole > 0, "seed {seed}: no data");
        assert_eq!(
            line.host.callsign(),
            Some(Callsign::Steering),
            "seed {seed}"
        );
    }
    println!("slowest start over a harmful line: {slowest} ms");
}

#[test]
fn a_lost_ack_is_repeated_without_a_new_epoch() {
    let mut line = Line::new(1);
    line.cut_to_board = true;
    line.run(350);
    assert!(line.host.is_up() && !line.board.is_up());
    line.cut_to_board = false;
    line.run(200);
    assert!(line.board.is_up());
    let repeats = line
        .host_events
        .iter()
        .filter(|event| **event == HostEvent::SendAck { up: None })
        .count();
    assert_eq!(repeats, 4);
    assert_eq!(line.ups().len(), 1);
    assert_eq!(line.host.health().lost, 0);
    // The Pi had numbered commands that never arrived. Each ACK starts its count again.
    assert_eq!(line.board.lost_packets(), 0);
}

#[test]
fn a_repeated_ack_changes_nothing_but_the_count_of_the_pis_ids() {
    let mut link = board(Callsign::Steering, ResetCause::PowerOn);
    let mut transmitter = HostTransmitter::new();
    let push = |link: &mut BoardLink, bytes: [u8; PACKET_LENGTH]| {
        bytes
            .iter()
            .filter_map(|byte| link.push(*byte, 0))
            .collect::<Vec<_>>()
    };
    let command = Payload::SteerCommand(SteerCommand { code: 1, seq: 0 });
    assert_eq!(
        push(&mut link, transmitter.ack(Version::One)),
        [BoardEvent::Up]
    );
    for _ in 0..3 {
        assert_eq!(
            push(&mut link, transmitter.encode(command).unwrap()).len(),
            1
        );
    }
    let first = link.encode(command).unwrap();
    assert_eq!(push(&mut link, transmitter.ack(Version::One)), []);
    assert_eq!(
        push(&mut link, transmitter.encode(command).unwrap()).len(),
        1
    );
    let second = link.encode(command).unwrap();
    assert_eq!(link.lost_packets(), 0);
    assert_eq!((first[0] & 15, second[0] & 15), (0, 1));
}

#[test]
fn loss_is_counted_apart_for_each_direction() {
    let mut line = Line::new(1);
    line.run(100);
    // Three packets of the board are lost, and then a few of the Pi's.
    line.cut_to_host = true;
    line.run(15);
    line.cut_to_host = false;
    line.run(100);
    assert_eq!(line.host.health().lost, 3);
    assert_eq!(line.board.lost_packets(), 0);
    line.cut_to_board = true;
    line.run(80);
    line.cut_to_board = false;
    line.run(100);
    assert_eq!(line.host.health().lost, 3);
    assert_eq!(line.board.lost_packets(), 2);
    let health = line.host.health();
    assert_eq!((health.epoch, health.skipped_bytes), (1, 0));
}

#[test]
fn packets_lost_right_after_the_handshake_count() {
    let mut line = Line::new(1);
    line.run(1);
    line.cut_to_host = true;
    line.run(20);
    line.cut_to_host = false;
    line.run(20);
    assert_eq!(line.host.health().lost, 4);
    assert_eq!(line.host.health().packets, 4);
}

#[test]
fn damaged_packets_are_counted_where_they_arrive() {
    let mut line = Line::new(3);
    line.run(10);
    line.harm.flips = Some(30);
    line.run(2_000);
    let health = line.host.health();
    assert!(health.bad_crc > 0 && health.skipped_bytes > 0 && health.lost > 0);
    assert!(line.board.bad_packets() > 0 && line.board.lost_packets() > 0);
    // Packets that did not arrive whole count as missing, and no others.
    let complete = 402 - health.lost;
    assert!(health.packets.abs_diff(complete) <= 16, "{health:?}");
}

#[test]
fn a_gap_in_a_packet_gives_it_up_on_the_board_but_not_on_the_pi() {
    let mut transmitter = HostTransmitter::new();
    let ack = transmitter.ack(Version::One);
    let (start, end) = ack.split_at(5);

    let mut link = board(Callsign::Steering, ResetCause::PowerOn);
    for byte in start {
        assert_eq!(link.push(*byte, 0), None);
    }
    for byte in end {
        assert_eq!(link.push(*byte, GAP_US + 1), None);
    }
    assert!(!link.is_up());
    assert_eq!(link.bad_packets(), 1);
    let events: Vec<_> = ack
        .iter()
        .filter_map(|byte| link.push(*byte, 5_000))
        .collect();
    assert_eq!(events, [BoardEvent::Up]);

    // A USB adapter may deliver half a packet late.
    let mut host = HostLink::new();
    let syn = board(Callsign::Sensor, ResetCause::PowerOn)
        .poll(0)
        .unwrap();
    for byte in &syn[..7] {
        assert_eq!(host.push(*byte, Duration::ZERO), None);
    }
    let events: Vec<_> = syn[7..]
        .iter()
        .filter_map(|byte| host.push(*byte, Duration::from_millis(40)))
        .collect();
    assert!(matches!(events[..], [HostEvent::SendAck { up: Some(_) }]));
}
