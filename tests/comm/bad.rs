//! A station under peers that send without end and read nothing: its memory is bounded, and the robots
//! that behave are answered meanwhile.

use std::fs;
use std::io::{BufReader, ErrorKind, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use lager_tests::Domain;

use crate::scene::{Peer, WATCHDOG};
use crate::station_at;

/// How long the attack lasts.
const ATTACK: Duration = Duration::from_secs(10);
/// What a station may need in addition: for each of 64 connections a line, what is read at a time and
/// the answers that wait, some 70 KiB, and as much again for the allocator.
const MOST_KIB: u64 = 64 * 70 * 2;

/// The most memory that a process has had so far, in KiB.
fn peak_kib(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("it runs");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.expect("Linux has it").trim().trim_end_matches(" kB");
    peak.parse().expect("a number")
}

/// Sends as much as the station takes now; whether the connection is still there.
fn presses(stream: &mut TcpStream, bytes: &[u8]) -> bool {
    match stream.write(bytes) {
        Ok(sent) => sent > 0,
        Err(error) => error.kind() == ErrorKind::WouldBlock,
    }
}

#[test]
fn the_memory_of_a_station_is_bounded_whatever_its_peers_do() {
    let domain = Domain::new();
    let (mut station, address) = station_at(&domain, "127.0.0.1:0", &[]);
    let stream = TcpStream::connect(&address).expect("it listens");
    stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    let mut good = Peer(BufReader::new(stream));
    let mut asks = |question: &str, answer: &str| {
        good.says(question);
        assert_eq!(good.hears().as_deref(), Some(answer));
    };
    asks("sidelength", "sidelength 40");
    let before = peak_kib(station.pid());

    let attacks: [Vec<u8>; 4] = [
        // A line that never ends, questions whose answers nobody reads, no text, and words of a robot
        // that somebody might keep.
        vec![b'a'; 1 << 20],
        b"prodlis\n".repeat(4096),
        vec![0xFF; 1 << 20],
        b"thought a long story that goes on and on\n".repeat(1024),
    ];
    let start = Instant::now();
    let mut peers: Vec<Option<TcpStream>> = (0..200).map(|_| None).collect();
    let (mut connected, mut closed) = (0, 0);
    while start.elapsed() < ATTACK {
        for (number, peer) in peers.iter_mut().enumerate() {
            let Some(stream) = peer else {
                if let Ok(stream) = TcpStream::connect(&address) {
                    stream.set_nonblocking(true).expect("a socket");
                    *peer = Some(stream);
                    connected += 1;
                }
                continue;
            };
            if !presses(stream, &attacks[number % attacks.len()]) {
                *peer = None;
                closed += 1;
            }
        }
        asks("karta", "karta 2 2 0 0");
    }
    assert!(
        connected > 400 && closed > 200,
        "{connected} connected, {closed} closed"
    );
    let more = peak_kib(station.pid()) - before;
    println!("{connected} connections, {closed} closed; {more} KiB more at the most");
    assert!(more <= MOST_KIB, "{more} KiB more than {before} KiB");
    drop(peers);
    asks("sidelength", "sidelength 40");
    assert!(station.is_running());
}
