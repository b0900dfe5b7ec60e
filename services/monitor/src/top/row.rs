//! One topic of `lager top`: the figures from its stamps, writers and readers. Pure: times are
//! arguments.

use std::time::Duration;

use lager_ports::{Layout, TopicInfo};
use lager_sample::{Description, Stamp, TopicEntry};
use serde_json::{Value, json};

use crate::delay::Stage;
use crate::life::Life;

/// How long a loss stays visible.
const REMEMBERED: Duration = Duration::from_secs(30);
/// A rate below this part of the expected one is too slow.
const SLOW: f64 = 0.5;
/// How long a topic with writers may be silent after `top` begins to read it, plus two periods.
const FIRST_NS: u64 = 1_500_000_000;
/// After this time without a sample there is no rate any more, in ns.
const SILENT_NS: u64 = 10_000_000_000;

/// A process that writes the topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Author {
    pub(crate) role: Option<String>,
    pub(crate) pid: u32,
    pub(crate) life: Life,
}

/// What the samples of one window tell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Figures {
    pub(crate) hz: f64,
    /// How irregular the samples are: 99 % of the gaps differ from the mean gap by at most this.
    pub(crate) jitter_p99_ns: u64,
    pub(crate) bytes_per_s: f64,
    /// Most samples that waited for a look.
    pub(crate) queue: u64,
    /// From the source to the publication.
    pub(crate) delay_p50_ns: u64,
    pub(crate) delay_p99_ns: u64,
    pub(crate) delay_max_ns: u64,
}

/// What is wrong with a topic, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Trouble {
    /// Samples were lost a moment ago.
    Losing,
    /// Its writer is dead or frozen.
    Unwritten,
    /// It comes much less often than it should.
    Slow,
    /// Nothing.
    None,
}

/// One topic.
#[derive(Debug)]
pub(crate) struct Row {
    pub(crate) name: String,
    /// Its place in the table. A topic that is not in the table comes after all others.
    pub(crate) place: usize,
    /// Whether the tool reads its samples.
    pub(crate) is_open: bool,
    pub(crate) authors: Vec<Author>,
    /// Subscribers; unknown for a recording.
    pub(crate) readers: Option<usize>,
    /// Places for readers, if known.
    pub(crate) places: Option<usize>,
    /// Why its samples cannot be read.
    pub(crate) unread: Option<String>,
    /// How many samples a robot sends in a second: of its own time, and of real time.
    usual_hz: Option<f64>,
    pub(crate) expected_hz: Option<f64>,
    /// Bytes of a sample with its stamp; 0 = not known.
    bytes: usize,
    /// Samples that were certainly lost on the way.
    pub(crate) lost: u64,
    /// Samples that were overwritten because `top` itself was too slow.
    pub(crate) overrun: u64,
    lost_at_ns: Option<u64>,
    pub(crate) samples: u64,
    pub(crate) last_ns: Option<u64>,
    /// The process that wrote it.
    last_writer: u32,
    pub(crate) figures: Figures,
    window: Window,
    /// Whether a window with samples has ended; before that there are no figures.
    is_measured: bool,
    /// Since when `top` reads it and somebody could write it.
    watched_ns: Option<u64>,
}

#[derive(Debug, Default)]
struct Window {
    samples: u64,
    /// The last sample before the window.
    before_ns: Option<u64>,
    first_ns: u64,
    gaps: Vec<u64>,
    queue: u64,
    delays: Stage,
}

impl Row {
    pub(crate) fn new(name: &str, entry: Option<&(usize, &TopicEntry)>) -> Self {
        let layout = entry.map(|(_, entry)| entry.layout.size + size_of::<Stamp>());
        let period_ms = entry.and_then(|(_, entry)| entry.period_ms);
        let usual_hz = period_ms.map(|ms| 1_000.0 / f64::from(ms));
        Self {
            name: name.to_owned(),
            place: entry.map_or(usize::MAX, |(place, _)| *place),
            is_open: true,
            authors: Vec::new(),
            readers: None,
            places: entry.map(|(_, entry)| entry.qos.max_subscribers()),
            unread: None,
            usual_hz,
            expected_hz: usual_hz,
            bytes: layout.unwrap_or_default(),
            lost: 0,
            overrun: 0,
            lost_at_ns: None,
            samples: 0,
            last_ns: None,
            last_writer: 0,
            figures: Figures::default(),
            window: Window::default(),
            is_measured: false,
            watched_ns: None,
        }
    }

    /// Takes the present writers and readers.
    pub(crate) fn take_ends(&mut self, info: &TopicInfo, life: impl Fn(u32) -> Life) {
        self.readers = Some(info.subscribers);
        if info.entry.is_none() {
            self.places = info.places;
        }
        let why = match info.layout {
            Layout::Ours | Layout::Described | Layout::Unused => None,
            Layout::Other => Some("the processes that use it are of another build"),
            Layout::Unknown => Some("nobody says what its samples are"),
        };
        self.unread = why.map(str::to_owned);
        if let Some(description) = &info.description {
            self.lies_like(description);
        }
        let authors = info.writers.iter().map(|peer| Author {
            role: peer.part.clone(),
            pid: peer.pid,
            life: life(peer.pid),
        });
        self.authors = authors.collect();
    }

    /// Takes the layout of the samples.
    pub(crate) fn lies_like(&mut self, layout: &Description) {
        self.bytes = layout.size() + size_of::<Stamp>();
    }

    /// Nobody writes or reads it any more.
    pub(crate) fn leave(&mut self) {
        (self.authors, self.readers) = (Vec::new(), Some(0));
    }

    /// Its samples were those of a recording, up to that moment. Only stamps tell of its writers,
    /// and losses of any time stay visible.
    pub(crate) fn end_recording(&mut self, now_ns: u64) {
        self.authors = vec![Author {
            role: None,
            pid: self.last_writer,
            life: Life::Recorded,
        }];
        self.lost_at_ns = self.lost_at_ns.map(|_| now_ns);
    }

    /// Takes how many seconds of robot time a second has.
    pub(crate) fn take_pace(&mut self, pace: f64) {
        self.expected_hz = self.usual_hz.map(|hz| hz * pace);
    }

    /// Takes a sample.
    pub(crate) fn hear(&mut self, stamp: &Stamp) {
        let published = stamp.publish_time_ns;
        let window = &mut self.window;
        match self.last_ns {
            Some(last) => window.gaps.push(published.saturating_sub(last)),
            None => window.first_ns = published,
        }
        if window.samples == 0 {
            window.before_ns = self.last_ns;
        }
        window
            .delays
            .add(published.saturating_sub(stamp.source_time_ns));
        window.samples += 1;
        self.samples += 1;
        self.last_ns = Some(published);
        self.last_writer = stamp.writer;
    }

    /// `top` does not read the topic for a while: forget its rates and ages.
    pub(crate) fn rest(&mut self) {
        self.last_ns = None;
        self.figures = Figures::default();
        self.window = Window::default();
        (self.is_measured, self.watched_ns) = (false, None);
    }

    /// Takes how many samples a look found in a queue of this length, and how many were lost
    /// before. Losses from a full queue are `top`'s own: it was too slow.
    pub(crate) fn look(&mut self, (found, queue): (u64, usize), lost: u64, now_ns: u64) {
        self.window.queue = self.window.queue.max(found);
        if lost == 0 {
            return;
        }
        if found >= queue as u64 {
            self.overrun += lost;
        } else {
            self.lose(lost, now_ns);
        }
    }

    /// Takes the losses of a recording before a sample: those on the way to its recorder, and those
    /// that the recorder dropped.
    pub(crate) fn lack(&mut self, lost: u64, dropped: u64, now_ns: u64) {
        if lost + dropped > 0 {
            self.lose(lost + dropped, now_ns);
        }
    }

    /// Counts losses on the way.
    pub(crate) fn lose(&mut self, lost: u64, now_ns: u64) {
        self.lost += lost;
        self.lost_at_ns = Some(now_ns);
    }

    /// Ends a window and begins the next one.
    pub(crate) fn end_window(&mut self, now_ns: u64) {
        let window = std::mem::take(&mut self.window);
        self.is_measured |= window.samples > 1;
        self.watched_ns = match self.is_open && !self.authors.is_empty() {
            true => self.watched_ns.or(Some(now_ns)),
            false => None,
        };
        let last = self.last_ns.unwrap_or_default();
        let mut gaps = window.gaps;
        let hz = match (window.samples, window.before_ns) {
            (0, _) => {
                // The topic may only be slow.
                let silent = now_ns.saturating_sub(last);
                let at_most = 1e9 / silent.max(1) as f64;
                match silent < SILENT_NS {
                    true => self.figures.hz.min(at_most),
                    false => 0.0,
                }
            }
            (samples, Some(before)) => rate(samples, before, last),
            (samples, None) => rate(samples - 1, window.first_ns, last),
        };
        let mean = gaps.iter().sum::<u64>() / (gaps.len() as u64).max(1);
        for gap in &mut gaps {
            *gap = gap.abs_diff(mean);
        }
        gaps.sort_unstable();
        let p99 = gaps.len().saturating_sub(1) * 99 / 100;
        self.figures = Figures {
            hz,
            jitter_p99_ns: gaps.get(p99).copied().unwrap_or_default(),
            bytes_per_s: hz * self.bytes as f64,
            queue: window.queue,
            delay_p50_ns: window.delays.at(50.0),
            delay_p99_ns: window.delays.at(99.0),
            delay_max_ns: window.delays.max(),
        };
    }

    /// Bytes a second, if the size of a sample is known.
    pub(crate) fn bytes_per_s(&self) -> Option<f64> {
        (self.bytes > 0).then_some(self.figures.bytes_per_s)
    }

    /// The process that wrote last, or else any that could.
    pub(crate) fn author(&self) -> Option<&Author> {
        let wrote = |author: &&Author| author.pid == self.last_writer;
        let last = self.authors.iter().find(wrote);
        last.or(self.authors.first())
    }

    /// How old the last sample is.
    pub(crate) fn age(&self, now_ns: u64) -> Option<Duration> {
        let last = self.last_ns?;
        Some(Duration::from_nanos(now_ns.saturating_sub(last)))
    }

    /// Whether samples were lost a moment ago.
    pub(crate) fn is_losing(&self, now_ns: u64) -> bool {
        let since = |at: u64| Duration::from_nanos(now_ns.saturating_sub(at));
        self.lost_at_ns.is_some_and(|at| since(at) < REMEMBERED)
    }

    /// What is wrong with it.
    pub(crate) fn trouble(&self, now_ns: u64) -> Trouble {
        if self.is_losing(now_ns) {
            return Trouble::Losing;
        }
        let is_gone = |author: &Author| matches!(author.life, Life::Frozen | Life::Dead);
        if !self.authors.is_empty() && self.authors.iter().all(is_gone) {
            return Trouble::Unwritten;
        }
        let Some(expected) = self.expected_hz.filter(|hz| *hz > 0.0) else {
            return Trouble::None;
        };
        let is_known = self.is_measured || self.is_silent(expected, now_ns);
        match self.is_open && is_known && self.figures.hz < expected * SLOW {
            true => Trouble::Slow,
            false => Trouble::None,
        }
    }

    /// Whether a sample should have come long ago, since `top` reads the topic.
    fn is_silent(&self, expected: f64, now_ns: u64) -> bool {
        let watched = |since: u64| now_ns.saturating_sub(since) as f64;
        let patience = FIRST_NS as f64 + 2e9 / expected;
        self.watched_ns
            .is_some_and(|since| watched(since) >= patience)
    }

    /// The same for programs.
    pub(crate) fn as_json(&self, now_ns: u64) -> Value {
        let authors = self.authors.iter().map(|author| {
            json!({
                "role": &author.role, "pid": author.pid,
                "state": (author.life != Life::Recorded).then(|| author.life.name()),
            })
        });
        let figures = &self.figures;
        json!({
            "topic": self.name, "open": self.is_open, "unread": self.unread, "writers": authors.collect::<Vec<_>>(),
            "subscribers": self.readers, "subscriber_places": self.places,
            "samples": self.samples, "hz": figures.hz, "expected_hz": self.expected_hz,
            "age_ns": self.age(now_ns).map(|age| age.as_nanos() as u64),
            "jitter_p99_ns": figures.jitter_p99_ns, "bytes_per_s": self.bytes_per_s(),
            "lost": self.lost, "overrun": self.overrun, "queue": figures.queue,
            "delay_p50_ns": figures.delay_p50_ns, "delay_p99_ns": figures.delay_p99_ns,
            "delay_max_ns": figures.delay_max_ns,
            "trouble": match self.trouble(now_ns) {
                Trouble::None => Value::Null,
                trouble => json!(format!("{trouble:?}").to_lowercase()),
            },
        })
    }
}

/// This many samples between two moments, as samples a second.
fn rate(samples: u64, from_ns: u64, to_ns: u64) -> f64 {
    match to_ns.saturating_sub(from_ns) {
        0 => 0.0,
        span => samples as f64 * 1e9 / span as f64,
    }
}

#[cfg(test)]
mod tests {
    use lager_topics::TOPICS;

    use super::*;

    const MS: u64 = 1_000_000;

    fn row(name: &str) -> Row {
        let mut entries = TOPICS.iter().enumerate();
        let entry = entries.find(|(_, entry)| entry.name == name);
        Row::new(name, entry.as_ref())
    }

    fn stamp(publish_time_ns: u64) -> Stamp {
        Stamp {
            publish_time_ns,
            source_time_ns: publish_time_ns - MS,
            ..Stamp::default()
        }
    }

    #[test]
    fn a_window_tells_rate_jitter_bytes_and_delays() {
        let mut row = row("sensor/line");
        for at in [0, 10, 20, 34, 40_u64] {
            row.hear(&stamp((100 + at) * MS));
        }
        row.look((5, 16), 0, 140 * MS);
        row.end_window(1_100 * MS);
        assert!((row.figures.hz - 100.0).abs() < 1e-6, "{:?}", row.figures);
        assert_eq!(row.figures.jitter_p99_ns / MS, 4);
        assert_eq!(row.figures.queue, 5);
        assert_eq!(row.figures.delay_max_ns / MS, 1);
        assert!((row.figures.bytes_per_s - 100.0 * row.bytes as f64).abs() < 1e-6);
        // One sample in the next window, a second after the last one.
        row.hear(&stamp(1_140 * MS));
        row.end_window(1_200 * MS);
        assert!((row.figures.hz - 1.0 / 1.0).abs() < 0.01);
        assert_eq!(row.trouble(1_200 * MS), Trouble::Slow);
    }

    #[test]
    fn losses_in_ones_own_full_queue_are_told_apart() {
        let mut state = row("nav/status");
        state.look((16, 16), 30, MS);
        assert_eq!((state.lost, state.overrun), (0, 30));
        assert_eq!(state.trouble(MS), Trouble::None);
        let mut stream = row("steering/command");
        stream.look((3, 16), 2, MS);
        assert_eq!((stream.lost, stream.overrun), (2, 0));
        assert_eq!(stream.trouble(MS), Trouble::Losing);
        let later = MS + REMEMBERED.as_nanos() as u64;
        assert_eq!(stream.trouble(later), Trouble::None);
        stream.look((16, 16), 5, MS);
        assert_eq!((stream.lost, stream.overrun), (2, 5));
        // A topic of somebody's own, of which the table says nothing.
        let mut own = Row::new("weather/now", None);
        own.look((4, 4), 9, MS);
        assert_eq!((own.lost, own.overrun), (0, 9));
        own.look((3, 4), 1, MS);
        assert_eq!((own.lost, own.overrun), (1, 9));
    }

    #[test]
    fn a_topic_whose_writers_are_gone_is_in_trouble() {
        let mut row = row("nav/map");
        let author = |life| Author {
            role: Some("comm".to_owned()),
            pid: 7,
            life,
        };
        row.authors = vec![author(Life::Dead), author(Life::Alive)];
        assert_eq!(row.trouble(0), Trouble::None);
        row.authors = vec![author(Life::Dead), author(Life::Frozen)];
        assert_eq!(row.trouble(0), Trouble::Unwritten);
    }

    #[test]
    fn a_robot_whose_clock_runs_slower_is_expected_to_send_less() {
        let mut row = row("sensor/line");
        for number in 0..20 {
            row.hear(&stamp((100 + 50 * number) * MS));
        }
        row.end_window(1_100 * MS);
        assert_eq!(row.trouble(1_100 * MS), Trouble::Slow);
        row.take_pace(0.2);
        assert_eq!(row.expected_hz, Some(20.0));
        assert_eq!(row.trouble(1_100 * MS), Trouble::None);
    }

    #[test]
    fn nothing_is_slow_before_it_is_known_and_a_silent_writer_is_in_time() {
        let alive = |row: &mut Row| {
            row.authors = vec![Author {
                role: Some("bridge".to_owned()),
                pid: 7,
                life: Life::Alive,
            }];
        };
        // The first picture is drawn in the middle of the first window.
        let mut first = row("sensor/line");
        alive(&mut first);
        first.end_window(1_000 * MS);
        for at in [1_001, 1_011, 1_021] {
            first.hear(&stamp(at * MS));
        }
        assert_eq!(first.trouble(1_025 * MS), Trouble::None);
        // A writer that hangs says nothing at all, or is heard once, by what is kept of it.
        let mut silent = row("sensor/line");
        let mut kept = row("link/health");
        for row in [&mut silent, &mut kept] {
            alive(row);
            row.end_window(1_000 * MS);
        }
        kept.hear(&stamp(900 * MS));
        for row in [&mut silent, &mut kept] {
            row.end_window(2_000 * MS);
            assert_eq!(row.trouble(2_000 * MS), Trouble::None, "{}", row.name);
            row.end_window(3_000 * MS);
            assert_eq!(row.trouble(3_000 * MS), Trouble::Slow, "{}", row.name);
        }
        // Nobody could write it.
        let mut nobodys = row("sensor/line");
        nobodys.end_window(1_000 * MS);
        nobodys.end_window(9_000 * MS);
        assert_eq!(nobodys.trouble(9_000 * MS), Trouble::None);
    }
}
