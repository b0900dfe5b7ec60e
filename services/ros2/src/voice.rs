//! What the program says on the terminal: its own sentences, and errors of DDS, each at most once in a
//! while. DDS warns of much that is as it should be, such as that the loopback has no multicast.

use std::collections::HashMap;
use std::io::Write as _;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use lager_ros2::place::{Place, Reach};
use log::{LevelFilter, Log, Metadata, Record};

/// How soon the same place in the sources may warn again.
const AGAIN: Duration = Duration::from_secs(10);
/// The variable that lets DDS say more: `warn`, `info`, `debug` or `trace`.
const VARIABLE: &str = "LAGER_ROS2_LOG";

/// When each place in the sources warned last.
struct Voice {
    said: Mutex<HashMap<(String, u32), Instant>>,
    /// What DDS may say.
    level: LevelFilter,
}

impl Log for Voice {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &Record<'_>) {
        let place = (
            record.target().to_owned(),
            record.line().unwrap_or_default(),
        );
        // Our own warnings are limited where they are made.
        let is_own = record.target().starts_with("lager");
        if !is_own && record.level() > self.level {
            return;
        }
        let now = Instant::now();
        if let Ok(mut said) = self.said.lock() {
            let last = said.insert(place.clone(), now);
            if let Some(last) = last.filter(|last| !is_own && now - *last < AGAIN) {
                said.insert(place, last);
                return;
            }
        }
        match is_own {
            true => complain(&record.args().to_string()),
            false => complain(&format!("DDS: {}", record.args())),
        }
    }

    fn flush(&self) {}
}

/// Lets DDS speak.
pub(crate) fn begin() {
    let level = std::env::var(VARIABLE).ok();
    let level = level.and_then(|level| level.parse().ok());
    let level = level.unwrap_or(LevelFilter::Error);
    log::set_max_level(level.max(LevelFilter::Warn));
    let said = Mutex::new(HashMap::new());
    let voice = Voice { said, level };
    let _ = log::set_boxed_logger(Box::new(voice));
}

/// Says a sentence on standard output.
pub(crate) fn say(sentence: &str) {
    // Nobody may be there to read it.
    let _ = writeln!(std::io::stdout(), "ros2: {sentence}");
}

/// Says a sentence on standard error.
pub(crate) fn complain(sentence: &str) {
    let _ = writeln!(std::io::stderr(), "ros2: {sentence}");
}

/// Says who may do what, where that is more than people may think.
pub(crate) fn warn_of(place: Place, is_operator: bool) {
    let who = match place.reach {
        Reach::Localhost => "every user of this machine",
        Reach::Subnet => "everybody in the network",
    };
    let may = match is_operator {
        true => "may stop the robot, release a stop and order goods",
        false => "may read all of it, and stop the robot",
    };
    if is_operator || place.reach == Reach::Subnet {
        complain(&format!("{who} {may}, without a password"));
    }
    if !cfg!(feature = "patched") {
        complain(
            "this program was built without the patch of services/ros2/build: ROS 2 sees no type \
             hashes, a node is listed for 50 s after its end, one that was frozen is not heard again, \
             and range LOCALHOST does not keep packets of the network out",
        );
    }
    if std::env::var("ROS_STATIC_PEERS").is_ok_and(|peers| !peers.is_empty()) {
        complain("ROS_STATIC_PEERS is not obeyed: this program finds others by multicast only");
    }
}
