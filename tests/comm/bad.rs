//! Peers that send without end and read nothing. A station's memory is bounded, and the robots that
//! behave are answered meanwhile. A robot whose station does that drives on by itself.

use std::fs;
use std::io::{BufReader, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_tests::{Domain, compare, wait_for};

use crate::scene::{Peer, WATCHDOG};
use crate::station_at;

/// How long the attack lasts.
const ATTACK: Duration = Duration::from_secs(10);
/// What a station may need in addition: for each of 64 connections a line, what is read at a time
/// and the answers that wait, some 70 KiB, and as much again for the allocator.
const MOST_KIB: u64 = 64 * 70 * 2;

/// What a robot's comm may need in addition: sixteen pieces of lines, what it answers to them,
/// pages of its program, and what the allocator keeps. It took 7 to 13 MiB for some 40 MiB that it
/// was sent.
const MOST_COMM_KIB: u64 = 32 << 10;

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

/// A line that never ends, questions whose answers nobody reads, no text, and words of a robot that
/// somebody might keep.
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

/// A station that attacks whoever connects to it, in a thread, until it is dropped.
struct BadStation {
    over: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl BadStation {
    /// At `listener`: lines without end, no text, what a robot does not understand, and half a line
    /// after which nothing comes for a second.
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
        up.output().contains("fetches product 2").then_some(())
    });
    let comm = up.service("comm").expect("it runs");
    let before = peak_kib(comm);
    drop(station);
    let listener = wait_for("the port to be free", || TcpListener::bind(&address).ok());
    let bad = BadStation::new(&listener);
    wait_for("the delivery", || {
        up.output().contains("DELIVERED product 2").then_some(())
    });
    assert_eq!(up.service("comm"), Some(comm), "comm has ended");
    let more = peak_kib(comm) - before;
    let sent = bad.bytes.load(Ordering::Relaxed);
    println!("{sent} pieces were sent; comm needed {more} KiB more");
    assert!(more <= MOST_COMM_KIB, "comm needed {more} KiB more");
    drop((bad, up));
    domain.assert_clean();
}

/// Fails where the path's p99 is more than one and a half times as long. What attacks, the station
/// that stands for another machine, and its victim share two cores with the path.
#[test]
#[ignore = "it wants the machine to itself: tests/soak attacked"]
fn the_path_while_the_network_attacks() {
    let domain = Domain::new();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let up = domain.start(&["up", "--headless", "--station", &address]);
    wait_for("the robot to be up", || up.service("comm"));
    let [_, p99] = compare(&domain, "an attack on the robot", || {
        BadStation::new(&listener)
    });
    drop(up);
    assert!(p99 <= 1.5, "the path's p99 is {p99:.2} times as long");
}
