//! What a page says or leaves unsaid harms nobody else, and the warehouse it describes is for all.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use lager_plant::Warehouse;
use tungstenite::Message;

use crate::scene::{Page, Running, WATCHDOG, server, status};

#[test]
fn a_page_that_says_what_nobody_understands_is_told_and_then_closed() {
    let panel = Running::new();
    let mut page = panel.own_page();
    page.say("do r1 7 0 fly");
    let answer = page.line("answer ").unwrap();
    assert!(answer.starts_with("answer 7 refused column"), "{answer}");
    for _ in 0..30 {
        if page.0.send(Message::text("what")).is_err() {
            break;
        }
    }
    assert_eq!(page.line("answer "), None, "it is closed");
    // Whoever opens it anew is served.
    assert!(panel.own_page().line("you ").is_some());
}

#[test]
fn a_page_that_says_more_than_a_person_can_is_closed() {
    let panel = Running::new();
    let mut page = panel.own_page();
    for number in 0..5_000 {
        if page
            .0
            .send(Message::text(format!("take r1 {number}")))
            .is_err()
        {
            return;
        }
    }
    while page.line("answer ").is_some() {}
}

#[test]
fn a_warehouse_is_described_and_shown_to_everybody() {
    let panel = Running::new();
    let (mut page, mut other) = (panel.own_page(), panel.own_page());
    assert_eq!(other.line("warehouse ").unwrap(), "warehouse null");
    page.say(r#"warehouse 1 {"size":[2,3],"side_length_cm":0}"#);
    let answer = page.line("answer ").unwrap();
    assert!(
        answer.contains("refused a square's side is 0 cm"),
        "{answer}"
    );
    page.say(r#"warehouse 2 {"size":[2,3],"side_length_cm":40,"product":[{"id":7,"square":[1,2],"side":"up"}]}"#);
    let answer = page.line("answer ").unwrap();
    assert_eq!(
        answer,
        "answer 2 done taken, and lost when the station ends"
    );
    let shown = other.line("warehouse {").unwrap();
    assert!(
        shown.contains(r#""size":[2,3]"#) && shown.contains(r#""id":7"#),
        "{shown}"
    );
}

#[test]
fn so_many_pages_look_at_once_and_one_that_goes_makes_room() {
    let panel = Running::new();
    let mut pages: Vec<Page> = (0..32).map(|_| panel.own_page()).collect();
    let origin = format!("http://{}", panel.address);
    assert_eq!(panel.page(&origin, &panel.cookie()).err(), Some(503));
    pages.truncate(31);
    let give_up = Instant::now() + WATCHDOG;
    while panel.page(&origin, &panel.cookie()).is_err() {
        assert!(Instant::now() < give_up);
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_page_is_told_that_the_disk_does_not_take_its_warehouse() {
    let folder = std::env::temp_dir().join(format!("lager-panel-{}", std::process::id()));
    let file = folder.join("warehouse.toml");
    // Nothing can be written under the name of a folder, whoever asks.
    let in_the_way = folder.join("warehouse.toml.new");
    std::fs::create_dir_all(&in_the_way).unwrap();
    let panel = Running::of(server(Some(file.clone()), None));
    let mut page = panel.own_page();
    page.say(r#"warehouse 1 {"size":[2,3],"side_length_cm":40}"#);
    let answer = page.line("answer 1").unwrap();
    let why = format!("answer 1 refused {} is not saved: ", file.display());
    assert!(answer.starts_with(&why), "{answer}");
    assert!(
        panel.handle.look(|station| station.warehouse().is_some()),
        "it is in force"
    );
    std::fs::remove_dir(&in_the_way).unwrap();
    page.say(r#"warehouse 2 {"size":[2,3],"side_length_cm":45}"#);
    let saved = format!("answer 2 done saved in {}", file.display());
    assert_eq!(page.line("answer 2").unwrap(), saved);
    assert!(file.is_file());
    drop(panel);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_page_that_takes_nothing_in_is_dropped_though_it_says_that_it_is_there() {
    let panel = Running::new();
    let mut page = panel.own_page();
    page.line("you ").unwrap();
    // One long piece of news after the other, more than the system keeps for a socket.
    let goods: Vec<String> = (0..60)
        .map(|id| {
            let (x, y) = (id % 16, id / 16);
            let name = format!("{id:a>30}");
            format!(r#"{{"id":{id},"name":"{name}","square":[{x},{y}],"side":"up"}}"#)
        })
        .collect();
    let goods = goods.join(",");
    let end = Instant::now() + WATCHDOG;
    let stream = page.0.get_mut().try_clone().unwrap();
    stream.set_nonblocking(true).unwrap();
    for side in (40..).map(|side| 40 + side % 100) {
        let json = format!(r#"{{"size":[16,16],"side_length_cm":{side},"product":[{goods}]}}"#);
        let warehouse: Warehouse = serde_json::from_str(&json).unwrap();
        panel.handle.set_warehouse(warehouse).unwrap();
        // An empty pong, as an answer to no ping; it shows that somebody is there.
        let said = (&stream).write_all(&[0x8A, 0x80, 0, 0, 0, 0]);
        match said.map_err(|error| error.kind()) {
            Ok(()) => {}
            Err(ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => return,
            Err(other) => panic!("{other}"),
        }
        assert!(Instant::now() < end, "it is still served");
        std::thread::sleep(Duration::from_millis(30));
    }
}

#[test]
fn whoever_asks_slowly_keeps_no_page_out() {
    let panel = Running::new();
    // More than there is room for; each goes on with its request for as long as it may.
    let crowd: Vec<_> = (0..200)
        .map(|_| {
            let mut slow = TcpStream::connect(panel.address).unwrap();
            let _ = slow.write_all(b"GET / HTTP/1.1\r\nHost: ");
            slow
        })
        .collect();
    // While all of them are there.
    for _ in 0..50 {
        assert_eq!(status(&panel.ask_as_driver("/")), 200);
    }
    assert!(panel.own_page().line("you ").is_some());
    drop(crowd);
}

/// A frame's head, as a browser masks it: text or its continuation, so long, and whether it is the
/// last of its message.
fn frame(is_first: bool, is_last: bool, length: u64) -> Vec<u8> {
    let mut head = vec![u8::from(is_last) << 7 | u8::from(is_first), 0x80 | 127];
    head.extend(length.to_be_bytes());
    head.extend([0; 4]);
    head
}

#[test]
fn half_a_message_of_a_page_is_not_kept_beyond_what_a_page_says() {
    let closes = |pieces: &[Vec<u8>]| {
        let panel = Running::new();
        let mut page = panel.own_page();
        page.line("you ").unwrap();
        let stream = page.0.get_mut();
        for piece in pieces {
            if stream.write_all(piece).is_err() {
                return;
            }
        }
        let end = Instant::now() + WATCHDOG;
        while page.0.read().is_ok() {
            assert!(Instant::now() < end, "it is kept");
        }
    };
    // Told to come, and half of it there.
    let mut half = frame(true, true, 15 << 20);
    half.extend(vec![b'a'; 1 << 20]);
    closes(&[half]);
    // In parts that never end.
    let part = |is_first| {
        let mut part = frame(is_first, false, 32 * 1024);
        part.extend(vec![b'a'; 32 * 1024]);
        part
    };
    let mut parts = vec![part(true)];
    parts.extend((0..64).map(|_| part(false)));
    closes(&parts);
}

#[test]
fn whoever_connects_and_asks_nothing_is_sent_away() {
    let panel = Running::new();
    let mut silent = TcpStream::connect(panel.address).unwrap();
    let mut slow = TcpStream::connect(panel.address).unwrap();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let mut page = panel.own_page();
    for stream in [&mut silent, &mut slow] {
        let second = Some(Duration::from_secs(1));
        stream.set_read_timeout(second).unwrap();
        let end = Instant::now() + WATCHDOG;
        loop {
            match stream.read(&mut [0; 512]).map_err(|error| error.kind()) {
                Ok(0) | Err(ErrorKind::ConnectionReset) => break,
                Ok(_) => {}
                Err(ErrorKind::WouldBlock | ErrorKind::TimedOut) => page.say("here 0"),
                Err(other) => panic!("{other}"),
            }
            assert!(Instant::now() < end, "it is still there");
        }
    }
    // A page stays, and others are served.
    page.say("take r1 1");
    assert!(page.line("answer 1").is_some());
    assert_eq!(status(&panel.ask_as_driver("/")), 200);
}

#[test]
fn a_robot_that_says_only_that_it_is_there_is_told_of_ten_times_a_second() {
    let panel = Running::new();
    let mut stream = TcpStream::connect(panel.station).unwrap();
    writeln!(stream, "lager 1 r1").unwrap();
    let mut page = panel.own_page();
    page.line("about r1 connected=1 speaks=1").unwrap();
    let begin = Instant::now();
    let says = std::thread::spawn(move || {
        for number in 0..400 {
            writeln!(stream, "lager 1 r1 {number}").unwrap();
            std::thread::sleep(Duration::from_millis(5));
        }
        stream
    });
    let mut lines = 0;
    while !says.is_finished() {
        page.line("about r1 connected=1 speaks=1").unwrap();
        lines += 1;
    }
    let tenths = begin.elapsed().as_millis() / 100;
    assert!(
        lines > 0 && lines <= tenths + 1,
        "{lines} in {tenths} tenths of a second"
    );
    drop(says.join());
}
