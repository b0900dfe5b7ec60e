//! What a station keeps of the last day, over real sockets and files.

use std::fs;
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_station::files::Hold;
use lager_station::{Handle, History, RobotSaid, Saying, Subscription};

use crate::sockets::{Peer, Running, WATCHDOG};

fn r1() -> Name {
    Name::new("r1").expect("a name")
}

/// A folder that is removed when this is dropped; stations come and go in it.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let name = format!("lager-history-{test}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }

    fn history(&self) -> PathBuf {
        self.0.join("history")
    }

    /// A station that keeps its history here.
    fn station(&self) -> Running {
        Running::with(|config| config.history = Some(self.history()))
    }

    /// The history's files of a kind, the oldest first.
    fn parts(&self, kind: &str) -> Vec<PathBuf> {
        let entries = fs::read_dir(self.history()).expect("a folder");
        let mut parts: Vec<_> = entries
            .map(|entry| entry.expect("an entry").path())
            .collect();
        let is_kind = |part: &Path| {
            part.file_name()
                .is_some_and(|name| name.to_str().is_some_and(|name| name.starts_with(kind)))
        };
        parts.retain(|part| is_kind(part));
        parts.sort();
        parts
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn wait_for<R>(what: &str, look: impl Fn() -> Option<R>) -> R {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < WATCHDOG, "waited for {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn robot(station: &Running) -> Peer<TcpStream> {
    let mut robot = station.robot();
    assert_eq!(robot.asks("lager 1 r1"), "lager 1 lager");
    robot
}

fn history(handle: &Handle) -> History {
    handle.history().expect("it keeps one")
}

/// The lines of what happened to r1.
fn events(history: &History) -> Vec<String> {
    let events = history.events(Some(&r1()), &(0..=u64::MAX));
    let events = events.expect("a folder").into_iter();
    events.map(|(_, _, line)| line).collect()
}

/// The states of r1.
fn states(history: &History) -> Vec<String> {
    let mut states = Vec::new();
    let read = history.states(&r1(), &(0..=u64::MAX), |entry| {
        if entry.is_state() {
            states.push(entry.line.to_owned());
        }
        ControlFlow::Continue(())
    });
    read.expect("a folder");
    states
}

/// What whoever comes now is told of before.
fn recalled(handle: &Handle) -> Vec<RobotSaid> {
    let news = handle.recall();
    std::iter::from_fn(|| news.next(Duration::ZERO)).collect()
}

#[test]
fn states_and_events_are_on_the_disk_while_the_station_runs() {
    let folder = Folder::new("kept");
    let station = folder.station();
    let history = history(&station.handle);
    assert_eq!(events(&history), [""; 0], "there is no folder yet");
    let mut robot = robot(&station);
    let mut other = station.robot();
    assert_eq!(other.asks("lager 1 r2"), "lager 1 lager");
    other.says(b"state x_mm=9\nthought other\n");
    robot.says(b"route 2 1 0 2 0\nstate x_mm=1\nevent next_node 1 0 - -\n");
    station.handle.note(&r1(), "Anna", "mode manual");
    wait_for("the first state", || {
        (states(&history) == ["state x_mm=1"]).then_some(())
    });
    let first_ms = History::now_ms();
    // The next state has a later time.
    std::thread::sleep(Duration::from_millis(5));
    robot.says(b"state x_mm=2\nthinks kind=lost\nthought hej\n");
    wait_for("the second state", || {
        (states(&history) == ["state x_mm=1", "state x_mm=2"]).then_some(())
    });
    wait_for("all that happened", || {
        (events(&history).len() == 4).then_some(())
    });
    let happened = events(&history);
    for line in [
        "event next_node 1 0 - -",
        "asked Anna mode manual",
        "thinks kind=lost",
        "thought hej",
    ] {
        assert!(
            happened.iter().any(|kept| kept == line),
            "{line}: {happened:?}"
        );
    }
    let moment = |at_ms| {
        let known = history.moment(&r1(), at_ms).expect("a folder");
        known.into_iter().map(|(_, line)| line).collect::<Vec<_>>()
    };
    assert_eq!(moment(first_ms), ["route 2 1 0 2 0", "state x_mm=1"]);
    assert_eq!(
        moment(History::now_ms()),
        ["route 2 1 0 2 0", "state x_mm=2"]
    );
    assert_eq!(moment(5), [""; 0]);
}

#[test]
fn a_later_station_tells_what_happened_before_and_takes_nothing_for_new() {
    let folder = Folder::new("later");
    let station = folder.station();
    let mut first = robot(&station);
    first.says(b"thinks kind=lost\nthought hej\nevent next_node 1 0 - -\n");
    station.handle.note(&r1(), "Anna", "stop");
    let told = wait_for("the news", || {
        let told = recalled(&station.handle);
        (told.len() == 4).then_some(told)
    });
    wait_for("them to be kept", || {
        (events(&history(&station.handle)).len() == 4).then_some(())
    });
    drop((first, station));

    let station = folder.station();
    let again = recalled(&station.handle);
    let says = |news: &[RobotSaid]| {
        news.iter()
            .map(|news| news.told.clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(says(&again), says(&told));
    assert!(again.iter().all(|news| news.at <= station.handle.now()));
    // The robot repeats what it told the station before.
    let news = station.handle.subscribe();
    let mut robot = robot(&station);
    robot.says(b"past 100 event next_node 1 0 - -\nthought new\n");
    let next = news.next(WATCHDOG).expect("news");
    assert!(matches!(next.told, Saying::Thought(text) if text.as_str() == "new"));
    assert!(again.len() < Subscription::KEPT);
}

#[test]
fn a_torn_end_and_a_damaged_line_cost_only_themselves() {
    let folder = Folder::new("torn");
    let station = folder.station();
    let mut first = robot(&station);
    first.says(b"thought one\nthought two\nthought three\nthought four\n");
    wait_for("them to be kept", || {
        (events(&history(&station.handle)).len() == 4).then_some(())
    });
    drop((first, station));
    let part = folder.parts("events").pop().expect("a part");
    let text = fs::read_to_string(&part).expect("a text");
    // As after `kill -9`: half of the last line. Before that somebody has changed a line.
    let torn = text[..text.len() - 4].replace("thought two", "thought 2");
    fs::write(&part, &torn).expect("a file");

    let station = folder.station();
    assert_eq!(
        events(&history(&station.handle)),
        ["thought one", "thought three"]
    );
    let mut robot = robot(&station);
    robot.says(b"thought five\n");
    wait_for("the next one", || {
        let events = events(&history(&station.handle));
        (events == ["thought one", "thought three", "thought five"]).then_some(())
    });
    assert_eq!(
        fs::read_to_string(&part).expect("a text"),
        torn,
        "it is left as it was"
    );
}

#[test]
fn a_history_that_cannot_be_kept_harms_nothing_else() {
    let folder = Folder::new("refused");
    // A file stands where the folder would be.
    fs::write(folder.history(), "mine").expect("a file");
    let station = folder.station();
    let mut one = robot(&station);
    one.says(b"thought one\n");
    wait_for("the news", || {
        (recalled(&station.handle).len() == 1).then_some(())
    });
    assert!(history(&station.handle).events(None, &(0..=9)).is_err());
    // A robot is served although nothing is kept.
    assert_eq!(one.asks("karta"), "karta 4 3 0 0");
    drop((one, station));
    assert_eq!(
        fs::read_to_string(folder.history()).expect("a text"),
        "mine"
    );
    fs::remove_file(folder.history()).expect("a file");

    // Another process keeps it.
    fs::create_dir(folder.history()).expect("a folder");
    let hold = Hold::of(&folder.history()).expect("nobody has it");
    let station = folder.station();
    let mut two = robot(&station);
    two.says(b"thought two\n");
    wait_for("the news", || {
        (recalled(&station.handle).len() == 1).then_some(())
    });
    assert_eq!(two.asks("karta"), "karta 4 3 0 0");
    drop((two, station));
    assert!(folder.parts("").is_empty());
    drop(hold);

    let station = folder.station();
    let mut three = robot(&station);
    three.says(b"thought three\n");
    wait_for("it to be kept", || {
        (events(&history(&station.handle)).len() == 1).then_some(())
    });
}
