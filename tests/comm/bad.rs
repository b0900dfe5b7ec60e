//! Tests with peers that send without end and read nothing. A station must keep its memory bounded
//! and still answer the robots that behave. A robot with such a station must drive on by itself.

use std::fs;
use std::io::{BufReader, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_tests::{Domain, wait_for};

use crate::scene::{Peer, WATCHDOG};
use crate::station_at;

/// How long the attack lasts.
const ATTACK: Duration = Duration::from_secs(10);
/// The most memory that the attack may add to a station, in KiB. Each of 64 connections needs some
/// 70 KiB for a line, a buffer and its answers, and the allocator as much again.
const MOST_KIB: u64 = 64 * 70 * 2;

/// The most memory that the attack may add to a robot's comm, in KiB: for sixteen pieces of lines,
/// the answers to them, pages of its program, and the allocator. In trials some 40 MiB of input
/// added 7 to 13 MiB.
const MOST_COMM_KIB: u64 = 32 << 10;

/// The most memory that a process has had so far, in KiB.
fn peak_kib(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).expect("it runs");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.expect("Linux has it").trim().trim_end_matches(" kB");
    peak.parse().expect("a number")
}

/// Sends as many bytes as the station takes now; false if the connection is closed.
fn presses(stream: &mut TcpStream, bytes: &[u8]) -> bool {
    match stream.write(bytes) {
        Ok(sent) => sent > 0,
        Err(error) => error.kind() == ErrorKind::WouldBlock,
    }
}

/// The attacks: a line that never ends, questions whose answers nobody reads, bytes that are no
/// text, and values of a robot that a station might keep.
fn attacks() -> [Vec<u8>; 4] {
    [
        vec![b'a'; 1 << 20],
        b"prodlis\n".repeat(4096),
        vec![0xFF; 1 << 20],
        b"thought a long story that goes on and on\n".repeat(1024),
    ]
}

#[test]
fn the_memory_of_a_station_is_bounded_whatever_its_peers_do() {
    let domain = Domain::among_others();
    let (mut station, address) = station_at(&domain, "127.0.0.1:0", &[]);
    let stream = TcpStream::connect(&address).expect("it listens");
    stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    let mut good = Peer(BufReader::new(stream));
    let mut asks = |question: &str, answer: &str| {
        good.says(question);
        assert_eq!(good.hears().as_deref(), Some(answer));
    };
    asks("sidelength", "sidelength 50");
    let before = peak_kib(station.pid());

    let attacks = attacks();
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
    asks("sidelength", "sidelength 50");
    assert!(station.is_running());
}

/// A station that attacks each robot that connects to it, in a thread, until it is dropped.
struct BadStation {
    over: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl BadStation {
    /// Attacks at `listener`: lines without end, bytes that are no text, unknown words, and half a
    /// line followed by a second of silence.
    fn new(listener: &TcpListener) -> Self {
        let listener = listener.try_clone().expect("a socket");
        listener.set_nonblocking(true).expect("a socket");
        let (over, bytes) = (Arc::new(AtomicBool::new(false)), Arc::default());
        let (until, count) = (Arc::clone(&over), Arc::<AtomicU64>::clone(&bytes));
        let thread = std::thread::spawn(move || {
            let attacks = attacks();
            let mut number = 0;
            while !until.load(Ordering::Relaxed) {
                let Ok((mut robot, _)) = listener.accept() else {
                    std::thread::sleep(Duration::from_millis(1));
                    continue;
                };
                robot.set_nonblocking(true).expect("a socket");
                let began = Instant::now();
                while presses(&mut robot, &attacks[number % attacks.len()]) {
                    count.fetch_add(1, Ordering::Relaxed);
                    if until.load(Ordering::Relaxed) || began.elapsed() > Duration::from_secs(1) {
                        let _ = robot.write_all(b"fetchpr");
                        std::thread::sleep(Duration::from_secs(1));
                        break;
                    }
                }
                number += 1;
            }
        });
        Self {
            over,
            bytes,
            thread: Some(thread),
        }
    }
}

impl Drop for BadStation {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let ended = self.thread.take().expect("a thread").join();
        assert!(ended.is_ok() && self.bytes.load(Ordering::Relaxed) > 0);
    }
}

#[test]
fn a_robot_delivers_while_its_station_sends_what_it_should_not() {
    let domain = Domain::among_others();
    let (station, address) = station_at(&domain, "127.0.0.1:0", &["r1=2"]);
    let file = domain.folder().join("warehouse.toml");
    let up = domain.start(&[
        "up",
        "--headless",
        "--speed",
        "4",
        "--warehouse",
        file.to_str().expect("UTF-8"),
        "--station",
        &address,
    ]);
    wait_for("the robot to be under way", || {
        up.output().contains("fetches goods 2").then_some(())
    });
    let comm = up.service("comm").expect("it runs");
    let before = peak_kib(comm);
    drop(station);
    let listener = wait_for("the port to be free", || TcpListener::bind(&address).ok());
    let bad = BadStation::new(&listener);
    wait_for("the delivery", || {
        up.output().contains("DELIVERED goods 2").then_some(())
    });
    assert_eq!(up.service("comm"), Some(comm), "comm has ended");
    let more = peak_kib(comm) - before;
    let sent = bad.bytes.load(Ordering::Relaxed);
    println!("{sent} pieces were sent; comm needed {more} KiB more");
    assert!(more <= MOST_COMM_KIB, "comm needed {more} KiB more");
    drop((bad, up));
    domain.assert_clean();
}
