//! `lager top`: the robot and all of its topics on one screen, live or over a recording.
//!
//! ```text
//!   bus, gateway ──feed──> model ──render──> terminal, text or JSON
//!   file ────────────────>   ^
//!   keys ────────────────────┘
//! ```
//!
//! [`model`] and [`render`] are pure. `feed` reads the bus, and this file reads the terminal.
//! `lager top` is an observer like the other tools, and looks at the queues every 5 ms. It does not
//! read topics whose rows are not shown. Its figures come from stamps; it reads only the payloads
//! that the head needs.

mod feed;
mod head;
mod model;
mod render;
mod row;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::time::{Duration, Instant};

use lager_battery::{Battery, Pack};
use lager_sample::{Description, Stamp, Topic};
use lager_topics::{LatencyCommand, LatencyPath, LinkHealth, MissionQueue, NavStatus};
use lager_wake::{Shutdown, urgency};
use ratatui::DefaultTerminal;
use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, poll, read};
use ratatui::layout::Rect;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde_json::{Value, json};

use self::feed::Feed;
pub use self::head::Load;
use self::model::{Key, Model, Pressed};
use crate::origin::Origin;
use crate::{POLL, ToolError, Tools};

/// The length of a window of figures, and how often it asks for writers and readers, and draws.
const WINDOW: Duration = Duration::from_secs(1);
/// The size of the picture of `--once`.
const ONCE: Rect = Rect::new(0, 0, 200, 200);

/// What `lager top` shows first.
#[derive(Clone, Debug)]
pub struct TopConfig {
    /// Only topics whose names contain this.
    pub filter: String,
    /// Measure for this time, print one picture, and end.
    pub once: Option<Duration>,
    /// The robot's battery.
    pub pack: Pack,
    /// How busy the machine is.
    pub load: fn() -> Load,
}

impl<W: Write, P: Origin> Tools<'_, W, P> {
    /// `lager top` on the bus, or over a robot's gateway. A key, the shutdown, or its one picture ends it.
    ///
    /// # Errors
    /// The bus cannot be read, or the terminal cannot be used.
    pub fn top(&mut self, config: &TopConfig) -> Result<(), ToolError> {
        let mut model = Model::new(self.place.unit().as_str());
        model.view.filter.clone_from(&config.filter);
        model.head.battery = Battery::new(config.pack);
        urgency::wake_with_others(POLL);
        let mut feed = Feed::new(self.place, self.watchdog, config.load)?;
        feed.look(&mut model)?;
        model.end_window(self.place.time().now_ns);
        let Some(long) = config.once else {
            let mut screen = Screen::enter()?;
            return self.watch(&mut model, &mut feed, &mut screen);
        };
        let end = Instant::now() + long;
        let mut looked = Instant::now();
        while Instant::now() < end && !self.shutdown.is_requested() {
            feed.drain(&mut model)?;
            if looked.elapsed() >= WINDOW {
                looked = Instant::now();
                // Writers that have come since then.
                feed.look(&mut model)?;
            }
            std::thread::sleep(POLL);
        }
        feed.look(&mut model)?;
        model.end_window(self.place.time().now_ns);
        Ok(print(&model, self.as_json, self.out)?)
    }

    fn watch(
        &mut self,
        model: &mut Model,
        feed: &mut Feed<'_, P>,
        screen: &mut Screen,
    ) -> Result<(), ToolError> {
        let mut looked = Instant::now();
        let mut is_changed = true;
        while !self.shutdown.is_requested() {
            feed.drain(model)?;
            if looked.elapsed() >= WINDOW {
                looked = Instant::now();
                self.must_still_tell()?;
                feed.look(model)?;
                model.end_window(self.place.time().now_ns);
                is_changed |= !model.view.is_paused;
            }
            match screen.key(POLL)? {
                Some(Stroke::Leave) => return Ok(()),
                Some(Stroke::Key(key)) => {
                    if model.press(key) == Pressed::Quit {
                        return Ok(());
                    }
                    feed.follow(model)?;
                    is_changed = true;
                }
                Some(Stroke::Resized) => is_changed = true,
                None => {}
            }
            if is_changed {
                screen.draw(model)?;
                is_changed = false;
            }
        }
        Ok(())
    }
}

/// How many samples of a topic are missing in a recording, up to one that it has.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lacking {
    /// They were overwritten before the recorder read them.
    pub lost: u64,
    /// The recorder dropped them, because its disk was too slow.
    pub dropped: u64,
}

/// A recording: takes its samples one by one, and then shows the table of all of them.
#[derive(Debug)]
pub struct Recorded {
    model: Model,
    begun_ns: Option<u64>,
    /// How many samples of each topic were missing up to its last one.
    lacking: BTreeMap<String, Lacking>,
}

impl Recorded {
    /// For a file of this name and robot.
    #[must_use]
    pub fn new(file: &str, robot: &str, filter: &str) -> Self {
        let mut model = Model::new(robot);
        model.file = Some(file.to_owned());
        filter.clone_into(&mut model.view.filter);
        Self {
            model,
            begun_ns: None,
            lacking: BTreeMap::new(),
        }
    }

    /// Takes a sample: its stamp, how many of its topic are missing up to it, and its payload.
    pub fn take(&mut self, topic: &str, stamp: &Stamp, lacking: Lacking, payload: Value) {
        let published = stamp.publish_time_ns;
        let begun_ns = *self.begun_ns.get_or_insert(published);
        let model = &mut self.model;
        model.now_ns = model.now_ns.max(published);
        model.hear(topic, stamp);
        let known = self.lacking.entry(topic.to_owned()).or_default();
        let lost = lacking.lost.saturating_sub(known.lost);
        let dropped = lacking.dropped.saturating_sub(known.dropped);
        model.row(topic).lack(lost, dropped, published);
        *known = lacking;
        self.show_state(topic, stamp, begun_ns, payload);
    }

    /// Takes a state from before the file. It shows how things were, and does not count as a sample
    /// of the file.
    pub fn repeat(&mut self, topic: &str, stamp: &Stamp, payload: Value) {
        self.show_state(topic, stamp, stamp.publish_time_ns, payload);
    }

    fn show_state(&mut self, topic: &str, stamp: &Stamp, begun_ns: u64, payload: Value) {
        let published = stamp.publish_time_ns;
        let head = &mut self.model.head;
        match topic {
            LinkHealth::NAME => {
                if let Some(health) = of(payload) {
                    head.take_health(health, published);
                }
            }
            NavStatus::NAME => head.status = of(payload).or(head.status),
            MissionQueue::NAME => head.queue = of(payload).or(head.queue),
            LatencyPath::NAME => {
                if let Some(path) = of(payload) {
                    head.path.take_recorded(path, stamp, begun_ns);
                }
            }
            LatencyCommand::NAME => {
                if let Some(command) = of(payload) {
                    head.command.take_recorded(command, stamp, begun_ns);
                }
            }
            _ => {}
        }
    }

    /// Takes a topic's layout, which gives the sizes for rates in bytes.
    pub fn describe(&mut self, topic: &str, layout: &Description) {
        self.model.row(topic).lies_like(layout);
    }

    /// Prints the table, or shows it until a key or the shutdown.
    ///
    /// # Errors
    /// The output cannot be written, or the terminal cannot be used.
    pub fn show(
        mut self,
        once: bool,
        as_json: bool,
        shutdown: &Shutdown,
        out: &mut impl Write,
    ) -> io::Result<()> {
        self.model.end_recording();
        if once {
            return print(&self.model, as_json, out);
        }
        let mut screen = Screen::enter()?;
        screen.draw(&self.model)?;
        while !shutdown.is_requested() {
            match screen.key(WINDOW / 10)? {
                Some(Stroke::Leave) => break,
                Some(Stroke::Key(key)) => {
                    if self.model.press(key) == Pressed::Quit {
                        break;
                    }
                }
                Some(Stroke::Resized) => {}
                None => continue,
            }
            screen.draw(&self.model)?;
        }
        Ok(())
    }
}

/// The payload as its type; `None` if another build wrote it.
fn of<P: for<'de> Deserialize<'de>>(payload: Value) -> Option<P> {
    P::deserialize(payload.into_deserializer()).ok()
}

/// One picture, for people or programs.
fn print(model: &Model, as_json: bool, out: &mut impl Write) -> io::Result<()> {
    if as_json {
        return writeln!(out, "{}", json!(model.as_json()));
    }
    let mut buffer = Buffer::empty(ONCE);
    render::draw(model, ONCE, &mut buffer);
    let text = render::text(&buffer);
    // The keys stand in the last line, and blank lines above them.
    let lines: Vec<&str> = text.lines().collect();
    let keys = lines.len() - 1;
    out.write_all(lines[..keys].join("\n").trim_end().as_bytes())?;
    writeln!(out)
}

/// What the person at the terminal does.
enum Stroke {
    Key(Key),
    Resized,
    Leave,
}

/// The terminal as a screen. Dropping it gives the terminal back.
struct Screen(DefaultTerminal);

impl Screen {
    fn enter() -> io::Result<Self> {
        Ok(Self(ratatui::try_init()?))
    }

    fn draw(&mut self, model: &Model) -> io::Result<()> {
        self.0.draw(|frame| {
            let area = frame.area();
            render::draw(model, area, frame.buffer_mut());
        })?;
        Ok(())
    }

    /// The person's next action within `patience`.
    fn key(&mut self, patience: Duration) -> io::Result<Option<Stroke>> {
        if !poll(patience)? {
            return Ok(None);
        }
        Ok(match read()? {
            Event::Key(key) if key.kind != KeyEventKind::Release => stroke(key),
            Event::Resize(..) => Some(Stroke::Resized),
            _ => None,
        })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Gives the terminal back if it shows a picture; for a process that ends at once.
pub fn leave_screen() {
    if ratatui::crossterm::terminal::is_raw_mode_enabled().unwrap_or(false) {
        ratatui::restore();
    }
}

fn stroke(key: KeyEvent) -> Option<Stroke> {
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        // In this mode the terminal makes no signal of Ctrl-C.
        return matches!(key.code, KeyCode::Char('c')).then_some(Stroke::Leave);
    }
    let key = match key.code {
        KeyCode::Char(letter) => Key::Char(letter),
        KeyCode::Up => Key::Up,
        KeyCode::Down => Key::Down,
        KeyCode::Left => Key::Left,
        KeyCode::Right => Key::Right,
        KeyCode::PageUp => Key::PageUp,
        KeyCode::PageDown => Key::PageDown,
        KeyCode::Home => Key::Home,
        KeyCode::End => Key::End,
        KeyCode::Enter => Key::Enter,
        KeyCode::Backspace => Key::Backspace,
        KeyCode::Esc => Key::Escape,
        KeyCode::F(1) => Key::Char('?'),
        KeyCode::F(3 | 4) => Key::Char('/'),
        KeyCode::F(6) => Key::Char('>'),
        KeyCode::F(10) => Key::Char('q'),
        _ => return None,
    };
    Some(Stroke::Key(key))
}

#[cfg(test)]
mod tests;
