//! Tests `lager top` on a real terminal: in tmux at 80 x 24 and at 200 x 60, beside a robot that
//! drives.
//!
//! The pictures in `pictures/` are tmux's screens at an earlier time, with a dot for each part that
//! changes every second: numbers, ages, the mission. `LAGER_PICTURES=take` takes them again.

use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use lager_home::Clock;
use lager_ports::Publisher;
use lager_sample::Stamp;
use lager_tests::{Domain, lager, wait_for};
use rustix::process::Signal;

use crate::{Weather, WeatherNow, guest, up};

/// A terminal in which `lager top` runs. Dropping it ends both.
struct Terminal {
    socket: PathBuf,
}

impl Terminal {
    fn start(domain: &Domain, width: u16, height: u16) -> Self {
        let config = domain.folder().join("tmux.conf");
        std::fs::write(&config, "set -g status off\n").expect("a file");
        let socket = domain.folder().join("tmux");
        let terminal = Self { socket };
        let (width, height) = (width.to_string(), height.to_string());
        let mut command = terminal.tmux();
        command
            .arg("-f")
            .arg(config)
            .args(["-u", "new-session", "-d"]);
        command.args(["-x", &width, "-y", &height]);
        command.arg(lager()).arg("--bus").arg(domain.bus_folder());
        let started = command.arg("top").status().expect("`tmux` is there");
        assert!(started.success(), "tmux: {started}");
        terminal
    }

    fn tmux(&self) -> Command {
        let mut command = Command::new("tmux");
        // So that it also works inside another tmux.
        command.env_remove("TMUX").env("LC_ALL", "C.UTF-8");
        command.arg("-S").arg(&self.socket);
        command
    }

    fn done(&self, words: &[&str]) -> String {
        let output = self.tmux().args(words).output().expect("`tmux` is there");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "tmux {words:?}: {said}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    fn keys(&self, keys: &[&str]) {
        self.done(&[&["send-keys"], keys].concat());
    }

    /// The text on the screen.
    fn picture(&self) -> String {
        self.done(&["capture-pane", "-p"])
    }

    fn is_there(&self) -> bool {
        let mut command = self.tmux();
        let asked = command.arg("has-session").output();
        asked.expect("`tmux` is there").status.success()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.tmux().arg("kill-server").output();
    }
}

/// A program that publishes weather, and later leaves out one number in ten.
struct Sender {
    publisher: Publisher<WeatherNow>,
    next: u64,
    loses: bool,
}

impl Sender {
    fn send(&mut self) {
        let now = Clock::monotonic_ns();
        let stamp = Stamp {
            sequence: self.next,
            publish_time_ns: now,
            source_time_ns: now,
            epoch: self.publisher.epoch(),
            writer: std::process::id(),
            ..Stamp::default()
        };
        let sent = self.publisher.replay(Weather::default(), stamp);
        sent.expect("a sample");
        self.next += 1;
        self.next += u64::from(self.loses && self.next.is_multiple_of(10));
    }

    /// Publishes until the screen is as it should be, and returns its text.
    fn until(&mut self, terminal: &Terminal, what: &str, is_it: impl Fn(&str) -> bool) -> String {
        wait_for(what, || {
            for _ in 0..10 {
                self.send();
                std::thread::sleep(Duration::from_millis(5));
            }
            let picture = terminal.picture();
            is_it(&picture).then_some(picture)
        })
    }
}

/// The first line below the table's head.
fn first_row(picture: &str) -> &str {
    let mut rows = picture.lines();
    rows.find(|line| line.starts_with(" TOPIC") || line.starts_with(" vTOPIC"));
    rows.next().unwrap_or_default()
}

/// The table's head unchanged, and every other line as words with a dot for each changing part.
fn structure(picture: &str) -> String {
    let mut lines = Vec::new();
    let mut ends: Vec<usize> = Vec::new();
    for line in picture.lines() {
        if line.contains("TOPIC") && line.contains("WRITER") {
            lines.push(line.trim_end().to_owned());
            // Figures end in the column in which their heads end.
            let numbers = line.find("READERS").expect("a column");
            let letters: Vec<char> = line.chars().chain([' ']).collect();
            let places = numbers..letters.len() - 1;
            ends = places
                .filter(|at| letters[*at] != ' ' && letters[*at + 1] == ' ')
                .collect();
            continue;
        }
        let is_row = !ends.is_empty() && line.contains('/') && !line.contains("?:help");
        if is_row {
            let letters: Vec<char> = line.chars().collect();
            let is_under = |at: &usize| letters.get(*at).is_some_and(|letter| *letter != ' ');
            assert!(
                ends.iter().all(is_under),
                "`{line}` is not aligned:\n{picture}"
            );
        }
        let marks: &[char] = if is_row { &['!', '~', '?'] } else { &[] };
        let words = line.trim_start_matches(marks).split_whitespace();
        let mut shown: Vec<String> = words.filter(|word| !is_bar(word)).map(shown).collect();
        let known = match shown.first().map(String::as_str) {
            Some("mission") => 1,
            // Before an order is written, there is none.
            Some("in") => 2,
            // In the last second there may be no value.
            Some("path") => shown
                .iter()
                .position(|word| word == "p50" || word == "none")
                .unwrap_or(1),
            _ => shown.len(),
        };
        shown.truncate(known);
        if is_row {
            // Beside a long process number only the beginning of the role has room.
            shown[1] = shown[1].chars().take(4).collect();
        }
        if shown.iter().any(|word| word.starts_with('+')) {
            // Of several writers, the table shows the one that wrote last.
            shown[1] = "·".to_owned();
        }
        lines.push(shown.join(" "));
    }
    lines.join("\n").trim_end().to_owned() + "\n"
}

fn is_bar(word: &str) -> bool {
    word.chars().all(|letter| "▁▂▃▄▅▆▇█".contains(letter))
}

/// A word, or a dot in place of a number, of a unit that depends on it, or of nothing.
fn shown(word: &str) -> String {
    let bare = word.strip_prefix('x').unwrap_or(word);
    let is_number = bare.starts_with(|letter: char| letter.is_ascii_digit());
    match word {
        _ if is_number => match word.split_once('/') {
            Some((_, of)) => format!("·/{of}"),
            None => "·".to_owned(),
        },
        "-" | "ms" | "s" | "min" => "·".to_owned(),
        "topics" | "cores" => word.trim_end_matches('s').to_owned(),
        word => word.to_owned(),
    }
}

/// Compares with the saved picture.
fn check(name: &str, picture: &str) {
    let folder = lager_tests::in_tree("tests/topic/pictures");
    let path = folder.join(name);
    let seen = structure(picture);
    if std::env::var_os("LAGER_PICTURES").is_some() {
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(&path, &seen).expect("a file");
    }
    let kept = std::fs::read_to_string(&path).expect("a kept picture");
    assert_eq!(seen, kept, "{name} shows something else now:\n{picture}");
}

#[test]
fn on_a_terminal_it_is_as_the_pictures_and_a_topic_that_begins_to_lose_comes_first() {
    let domain = Domain::new();
    let mut up = up(&domain);
    let bus = guest(&domain);
    let mut sender = Sender {
        publisher: bus.publisher().expect("a topic"),
        next: 0,
        loses: false,
    };
    let terminal = Terminal::start(&domain, 80, 24);
    let is_well = |picture: &str| picture.contains("autonomous") && picture.contains("TOPIC");
    sender.until(&terminal, "the screen", is_well);

    // From now on the program leaves numbers out.
    sender.loses = true;
    let planted = Instant::now();
    let is_first = |picture: &str| first_row(picture).starts_with("!weather/now");
    let picture = sender.until(&terminal, "the fault in the first row", is_first);
    println!(
        "a topic that loses stands first after {:.1} s",
        planted.elapsed().as_secs_f64()
    );
    assert!(picture.contains("IN TROUBLE"), "{picture}");
    let coloured = terminal.done(&["capture-pane", "-p", "-e"]);
    let row = coloured.lines().find(|line| line.contains("!weather/now"));
    assert!(row.is_some_and(|row| row.contains("[38;5;1m")), "{row:?}");

    // Sorted by name, so that a busy machine changes no row's place.
    terminal.keys(&[">"]);
    let is_by_name = |picture: &str| first_row(picture).contains("latency/command");
    check(
        "80x24.txt",
        &sender.until(&terminal, "rows by name", is_by_name),
    );
    terminal.keys(&["Right"]);
    sender.until(&terminal, "other columns", |picture| {
        picture.contains("DELAYMAX") && !picture.contains("WRITER")
    });
    terminal.keys(&["Left", "?"]);
    sender.until(&terminal, "the help", |picture| {
        picture.contains("Ctrl-C          leave")
    });
    terminal.keys(&["x", "p"]);
    let paused = sender.until(&terminal, "the pause", |picture| {
        picture.contains("[PAUSED]")
    });
    let goes_on = Instant::now() + Duration::from_millis(1_500);
    sender.until(&terminal, "a second", |_| Instant::now() > goes_on);
    assert_eq!(terminal.picture(), paused);
    terminal.keys(&["p"]);
    sender.until(&terminal, "the end of the pause", |picture| {
        !picture.contains("[PAUSED]")
    });
    terminal.keys(&["/", "weather", "Enter"]);
    sender.until(&terminal, "the filter", |picture| {
        picture.contains("weather/now") && !picture.contains("sensor/line")
    });
    // `top` does not subscribe to topics that are filtered out or closed.
    let observers = |topic: &str| {
        let topics = bus.topics().expect("the bus");
        topics
            .iter()
            .find(|found| found.name == topic)
            .map(|found| found.observers)
    };
    assert_eq!(observers("sensor/line"), Some(0));
    assert_eq!(observers("weather/now"), Some(1));
    terminal.keys(&["Space"]);
    sender.until(&terminal, "the row to be closed", |picture| {
        picture.contains("-weather/now")
    });
    assert_eq!(observers("weather/now"), Some(0));
    terminal.keys(&["+", "/", "Escape"]);

    terminal.done(&["resize-window", "-x", "200", "-y", "60"]);
    let is_wide = |picture: &str| {
        picture.contains("SAMPLES") && picture.contains("path total") && is_by_name(picture)
    };
    check(
        "200x60.txt",
        &sender.until(&terminal, "the wide screen", is_wide),
    );

    terminal.keys(&["q"]);
    wait_for("the end", || (!terminal.is_there()).then_some(()));
    drop((terminal, sender, bus));
    up.signal(Signal::INT);
    up.wait();
}
