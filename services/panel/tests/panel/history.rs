//! The station's history by HTTP: what is asked is given, to nobody else, and it delays nobody.

use std::fmt::Write as _;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lager_station::History;

use crate::scene::{Running, WATCHDOG, server, status};

/// A history that is removed when this is dropped.
struct Kept {
    folder: PathBuf,
    /// The first moment, in ms since 1970.
    begin_ms: u64,
}

/// A line of a file of the history.
fn line(at_ms: u64, line: &str) -> String {
    line_of("r1", at_ms, line)
}

fn line_of(robot: &str, at_ms: u64, line: &str) -> String {
    let text = format!("{at_ms} {robot} {line}");
    format!("{:08x} {text}\n", crc32fast::hash(text.as_bytes()))
}

impl Kept {
    /// Two states and an event of robot r1 and one of another, of five minutes ago.
    fn new(test: &str) -> Self {
        let name = format!("lager-panel-history-{test}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        let begin_ms = History::now_ms() - 300_000;
        let kept = Self { folder, begin_ms };
        let states = [
            line(begin_ms, "state x_mm=400 node=1,0 battery_dv=114"),
            line(begin_ms, "latency 700 40 99"),
            line(begin_ms + 1_000, "state x_mm=410 node=1,0 battery_dv=113"),
            line_of("r2", begin_ms + 1_500, "state x_mm=1"),
        ];
        kept.put("coarse", 0, &states.concat());
        kept.put("events", 0, &line(begin_ms + 500, "asked Anna stop"));
        kept
    }

    /// Adds a file whose first moment is so many ms after the beginning.
    fn put(&self, kind: &str, after_ms: u64, text: &str) {
        let name = format!("{kind}-{}.log", self.begin_ms + after_ms);
        fs::write(self.folder.join(name), text).unwrap();
    }

    fn panel(&self) -> Running {
        Running::of(server(None, Some(self.folder.clone())))
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// The content of an answer that comes in pieces.
fn content(answer: &str) -> String {
    let (head, mut rest) = answer.split_once("\r\n\r\n").unwrap();
    assert!(
        head.to_ascii_lowercase()
            .contains("transfer-encoding: chunked"),
        "{head}"
    );
    let mut content = String::new();
    loop {
        let (length, more) = rest.split_once("\r\n").unwrap();
        let length = usize::from_str_radix(length, 16).unwrap();
        if length == 0 {
            return content;
        }
        content += &more[..length];
        rest = &more[length + 2..];
    }
}

#[test]
fn any_time_of_a_robot_is_a_table_whose_heads_have_units() {
    let kept = Kept::new("table");
    let panel = kept.panel();
    let answer = panel.ask_as_driver("/history/states.csv?robot=r1");
    assert_eq!(status(&answer), 200);
    assert!(answer.contains("content-type: text/csv"), "{answer}");
    assert!(answer.contains("content-security-policy: "), "{answer}");
    let table = content(&answer);
    let rows: Vec<_> = table.lines().collect();
    assert!(
        rows[0].starts_with("unix_time_s,x_mm,y_mm,line_error_half_sensors,"),
        "{table}"
    );
    assert!(
        rows[0].contains(",battery_V,battery_percent,battery_left_s,path_p50_us,"),
        "{table}"
    );
    let time = |ms: u64| format!("{}.{:03},", ms / 1_000, ms % 1_000);
    assert!(
        rows[1].starts_with(&format!("{}400,", time(kept.begin_ms))),
        "{table}"
    );
    assert!(
        rows[2].starts_with(&format!("{}410,", time(kept.begin_ms + 1_000))),
        "{table}"
    );
    assert!(rows[2].contains(",11.3,"), "{table}");
    assert_eq!(rows.len(), 3, "the other robot is not in it: {table}");

    // The table is for programs: it is the same for who reads Swedish, whose decimal mark is a comma,
    // and a text with a comma is one cell.
    let (host, cookie) = (panel.host(), panel.cookie());
    let headers = [
        ("Host", &*host),
        ("Cookie", &*cookie),
        ("Accept-Language", "sv-SE,sv;q=0.9"),
    ];
    let swedish = content(&panel.ask("/history/states.csv?robot=r1", &headers));
    assert_eq!(swedish, table);
    let cells = |row: &str| {
        let outside: String = row.split('"').step_by(2).collect();
        outside.split(',').count()
    };
    assert!(rows[1].contains(",\"1,0\","), "{table}");
    for row in &rows {
        assert_eq!(cells(row), cells(rows[0]), "{row}");
    }

    // The same for one moment, and as lines for the page.
    let (since, until) = (kept.begin_ms + 1, kept.begin_ms + 2_000);
    let asked = format!("/history/states?robot=r1&since={since}&until={until}");
    let lines = content(&panel.ask_as_driver(&asked));
    assert_eq!(lines.lines().count(), 1, "{lines}");
    assert!(
        lines.contains("\"x_mm\":410") && lines.contains("\"battery_V\":11.3"),
        "{lines}"
    );
    let events = content(&panel.ask_as_driver("/history/events?robot=r1"));
    let at_ms = kept.begin_ms + 500;
    assert_eq!(
        events,
        format!("{{\"at_ms\":{at_ms},\"line\":\"asked Anna stop\"}}\n")
    );
    let asked = format!("/history/moment?robot=r1&at={}", kept.begin_ms + 10);
    let moment = content(&panel.ask_as_driver(&asked));
    assert!(
        moment.contains("state x_mm=400") && moment.contains("latency 700"),
        "{moment}"
    );
    assert_eq!(moment.lines().count(), 2, "{moment}");
    assert_eq!(
        content(&panel.ask_as_driver("/history/events?robot=r9")),
        ""
    );
}

#[test]
fn a_page_gets_no_more_lines_and_events_than_it_shows() {
    let kept = Kept::new("lines");
    let states =
        (0..20).map(|at| line(kept.begin_ms + 2_000 + 50 * at, &format!("state x_mm={at}")));
    let states: Vec<_> = states.collect();
    kept.put("fine", 2_000, &states.concat());
    let events = [
        line(kept.begin_ms + 600, "event stopped 1 0 - - ordered comm"),
        line(kept.begin_ms + 700, "event next_node 1 0 - -"),
    ];
    kept.put("events", 600, &events.concat());
    let panel = kept.panel();
    let (since, until) = (kept.begin_ms, kept.begin_ms + 3_000);
    let asked = |what: &str| {
        let span = format!("robot=r1&since={since}&until={until}");
        content(&panel.ask_as_driver(&format!("/history/{what}{span}")))
    };
    // The states are told as they were, with the latencies, and 400 ms apart.
    let lines = asked("lines?");
    let told: Vec<_> = lines
        .lines()
        .map(|line| line.split("\"line\":").nth(1).unwrap())
        .collect();
    assert_eq!(
        told,
        [
            "\"state x_mm=400 node=1,0 battery_dv=114\"}",
            "\"latency 700 40 99\"}",
            "\"state x_mm=410 node=1,0 battery_dv=113\"}",
            "\"state x_mm=0\"}",
            "\"state x_mm=8\"}",
            "\"state x_mm=16\"}",
        ]
    );
    let newest = asked("events?most=1&");
    assert!(
        newest.contains("next_node") && newest.lines().count() == 1,
        "{newest}"
    );
    let stops = asked("events?only=stopped,item_delivered&");
    assert!(
        stops.contains("event stopped") && stops.lines().count() == 1,
        "{stops}"
    );
}

#[test]
fn the_history_has_the_doors_of_all_else() {
    let kept = Kept::new("doors");
    let panel = kept.panel();
    let asked = "/history/states.csv?robot=r1";
    let (host, cookie) = (panel.host(), panel.cookie());
    assert_eq!(status(&panel.ask(asked, &[("Host", &host)])), 403);
    let strange = [("Host", "evil.example"), ("Cookie", &cookie)];
    assert_eq!(status(&panel.ask(asked, &strange)), 421);
    for (site, code) in [
        ("cross-site", 403),
        ("same-site", 403),
        ("same-origin", 200),
    ] {
        let headers = [
            ("Host", &*host),
            ("Cookie", &*cookie),
            ("Sec-Fetch-Site", site),
        ];
        assert_eq!(status(&panel.ask(asked, &headers)), code, "{site}");
    }
    for (asked, words) in [
        ("states.csv", "1 to 32 characters"),
        (
            "states.csv?robot=r1&since=yesterday",
            "a time in ms since 1970",
        ),
        (
            "everything?robot=r1",
            "states.csv, states, events, lines and moment",
        ),
    ] {
        let answer = panel.ask_as_driver(&format!("/history/{asked}"));
        assert_eq!(status(&answer), 400, "{asked}");
        assert!(answer.contains(words), "{answer}");
    }
    let none = Running::new();
    let answer = none.ask_as_driver(asked);
    assert_eq!(status(&answer), 404);
    assert!(answer.contains("keeps no history"), "{answer}");
}

#[test]
fn who_takes_a_long_answer_slowly_delays_nobody() {
    let kept = Kept::new("slow");
    // More than the system keeps for a socket: a file of 4 MiB for each second.
    let begin_ms = kept.begin_ms;
    for second in 10..20 {
        let mut text = String::new();
        let long = format!("state phase=driving servos={}", ["1023"; 8].join(","));
        for number in 0.. {
            text += &line(begin_ms + second * 100_000 + number, &long);
            if text.len() > 4_000_000 {
                break;
            }
        }
        kept.put("coarse", second * 100_000, &text);
    }
    let panel = kept.panel();
    let until = begin_ms + 3_000_000;
    let mut request = String::new();
    let _ = write!(
        request,
        "GET /history/states?robot=r1&since={begin_ms}&until={until} HTTP/1.1\r\nHost: {}\r\nCookie: {}\r\n\r\n",
        panel.host(),
        panel.cookie()
    );
    // As many as may begin, and none of them reads.
    let slow: Vec<_> = (0..4)
        .map(|_| {
            let mut slow = TcpStream::connect(panel.address).unwrap();
            slow.set_read_timeout(Some(WATCHDOG)).unwrap();
            slow.write_all(request.as_bytes()).unwrap();
            // Its answer has begun.
            let mut head = [0; 12];
            slow.read_exact(&mut head).unwrap();
            assert_eq!(&head, b"HTTP/1.1 200");
            slow
        })
        .collect();
    let another = panel.ask_as_driver("/history/events?robot=r1");
    assert_eq!(status(&another), 503);
    assert!(another.contains("try again"), "{another}");
    // Pages and robots go on, although eight more pages read nothing of what they are told.
    let robot = panel.robot("r1");
    let _unread: Vec<_> = (0..8).map(|_| panel.own_page()).collect();
    let mut page = panel.own_page();
    page.line("about r1 ").unwrap();
    page.say("take r1 1");
    assert_eq!(page.line("answer 1").unwrap(), "answer 1 done");
    for number in 2..40 {
        page.say(&format!("do r1 {number} {number}000 drive 2"));
        let answer = page.line(&format!("answer {number}")).unwrap();
        assert_eq!(answer, format!("answer {number} done"));
    }
    page.say("stop r1 40");
    assert_eq!(page.line("answer 40").unwrap(), "answer 40 stopped 7");
    assert!(
        robot
            .0
            .lock()
            .unwrap()
            .iter()
            .any(|line| line.starts_with("stop "))
    );
    // When they have gone, others may read.
    drop(slow);
    let give_up = Instant::now() + WATCHDOG;
    while status(&panel.ask_as_driver("/history/events?robot=r1")) != 200 {
        assert!(Instant::now() < give_up);
        std::thread::sleep(Duration::from_millis(10));
    }
}
