//! The model of `lager top`. It is pure: samples, writers, readers, keys and times go in; sorted
//! rows and the list of topics to read come out.

use std::collections::BTreeMap;

use lager_ports::TopicInfo;
use lager_sample::Stamp;
use lager_topics::TOPICS;
use serde_json::{Value, json};

use super::head::Head;
use super::row::{Row, Trouble};
use crate::life::Life;

/// A little less than the first window of figures, in ns.
const WINDOW_NS: u64 = 900_000_000;

/// A key that has a meaning here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    Char(char),
    Up,
    Down,
    Left,
    Right,
    PageUp,
    PageDown,
    Home,
    End,
    Enter,
    Backspace,
    Escape,
}

/// How rows are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Sort {
    /// Topics in trouble first, then the table's order.
    #[default]
    Trouble,
    Name,
    Hz,
    Bytes,
    Lost,
    Age,
    Jitter,
    Delay,
}

impl Sort {
    const ALL: [Self; 8] = [
        Self::Trouble,
        Self::Name,
        Self::Hz,
        Self::Bytes,
        Self::Lost,
        Self::Age,
        Self::Jitter,
        Self::Delay,
    ];

    fn next(self, by: usize) -> Self {
        let at = Self::ALL.iter().position(|sort| *sort == self);
        Self::ALL[(at.unwrap_or(0) + by) % Self::ALL.len()]
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Trouble => "trouble",
            Self::Name => "name",
            Self::Hz => "Hz",
            Self::Bytes => "bytes/s",
            Self::Lost => "lost",
            Self::Age => "age",
            Self::Jitter => "jitter",
            Self::Delay => "delay",
        }
    }
}

/// The view: filter, order, and what is frozen.
#[derive(Clone, Debug, Default)]
pub(crate) struct View {
    pub(crate) sort: Sort,
    pub(crate) is_reversed: bool,
    pub(crate) filter: String,
    /// Whether typed letters go into the filter.
    pub(crate) is_typing: bool,
    /// The picture does not change, but counting goes on.
    pub(crate) is_paused: bool,
    /// Rows keep their places while their figures change.
    pub(crate) is_frozen: bool,
    pub(crate) shows_help: bool,
    /// Which page of columns is shown if not all fit: from 0; after the last page the first one.
    pub(crate) page: isize,
    /// Whether to draw the path's stages; `None` draws them if they fit.
    pub(crate) shows_path: Option<bool>,
    /// The chosen row's topic.
    pub(crate) chosen: Option<String>,
}

/// What a key did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pressed {
    Quit,
    Taken,
}

/// The whole model.
#[derive(Debug, Default)]
pub(crate) struct Model {
    pub(crate) head: Head,
    pub(crate) view: View,
    pub(crate) now_ns: u64,
    /// The source of the samples, if it is not a bus.
    pub(crate) file: Option<String>,
    /// When it began to look.
    begun_ns: Option<u64>,
    rows: BTreeMap<String, Row>,
    /// The order of the rows, by topic.
    order: Vec<String>,
}

impl Model {
    pub(crate) fn new(robot: &str) -> Self {
        let mut model = Self::default();
        model.head.robot = robot.to_owned();
        model
    }

    /// The row of a topic; makes one if there is none.
    pub(crate) fn row(&mut self, name: &str) -> &mut Row {
        let new = || {
            let mut entries = TOPICS.iter().enumerate();
            Row::new(name, entries.find(|(_, entry)| entry.name == name).as_ref())
        };
        self.rows.entry(name.to_owned()).or_insert_with(new)
    }

    /// Takes the present writers and readers of each topic of the robot.
    pub(crate) fn take_ends(&mut self, topics: &[TopicInfo], life: impl Fn(u32) -> Life) {
        for topic in topics {
            self.row(&topic.name).take_ends(topic, &life);
        }
        for row in self.rows.values_mut() {
            if !topics.iter().any(|topic| topic.name == row.name) {
                row.leave();
            }
        }
    }

    /// Takes a sample.
    pub(crate) fn hear(&mut self, name: &str, stamp: &Stamp) {
        self.row(name).hear(stamp);
    }

    /// Ends a window of all rows, and sorts them.
    pub(crate) fn end_window(&mut self, now_ns: u64) {
        self.now_ns = now_ns;
        self.begun_ns.get_or_insert(now_ns);
        let pace = self.head.shown_pace().unwrap_or(1.0);
        for row in self.rows.values_mut() {
            row.take_pace(pace);
            row.end_window(now_ns);
        }
        self.arrange();
    }

    /// All samples of a recording have come.
    pub(crate) fn end_recording(&mut self) {
        for row in self.rows.values_mut() {
            row.end_recording(self.now_ns);
        }
        self.end_window(self.now_ns);
    }

    /// The topics to read: those whose rows are shown and open.
    pub(crate) fn wanted(&self) -> impl Iterator<Item = &str> {
        let rows = self.rows.values().filter(|row| self.is_read(row));
        rows.map(|row| row.name.as_str())
    }

    fn is_read(&self, row: &Row) -> bool {
        row.is_open && self.passes(row) && !row.authors.is_empty()
    }

    fn passes(&self, row: &Row) -> bool {
        row.name.contains(&self.view.filter)
    }

    /// The rows to show, in order.
    pub(crate) fn shown(&self) -> Vec<&Row> {
        let rows = self.order.iter().filter_map(|name| self.rows.get(name));
        rows.filter(|row| self.passes(row)).collect()
    }

    /// Sorts the rows, unless they are frozen. Then new ones come last.
    pub(crate) fn arrange(&mut self) {
        let mut rows: Vec<&Row> = self.rows.values().collect();
        let now = self.now_ns;
        rows.sort_by(|a, b| a.place.cmp(&b.place).then_with(|| a.name.cmp(&b.name)));
        if self.view.is_frozen {
            let known = |row: &&Row| self.order.iter().position(|name| *name == row.name);
            rows.sort_by_key(|row| known(row).unwrap_or(usize::MAX));
        } else {
            let down = |a: f64, b: f64| b.total_cmp(&a);
            rows.sort_by(|a, b| match self.view.sort {
                Sort::Trouble => a.trouble(now).cmp(&b.trouble(now)),
                Sort::Name => a.name.cmp(&b.name),
                Sort::Hz => down(a.figures.hz, b.figures.hz),
                Sort::Bytes => down(a.figures.bytes_per_s, b.figures.bytes_per_s),
                Sort::Lost => b.lost.cmp(&a.lost),
                Sort::Age => b.age(now).cmp(&a.age(now)),
                Sort::Jitter => b.figures.jitter_p99_ns.cmp(&a.figures.jitter_p99_ns),
                Sort::Delay => b.figures.delay_p99_ns.cmp(&a.figures.delay_p99_ns),
            });
            if self.view.is_reversed {
                rows.reverse();
            }
        }
        self.order = rows.into_iter().map(|row| row.name.clone()).collect();
    }

    /// Whether it has looked for too short a time to know that all is well.
    pub(crate) fn is_looking(&self) -> bool {
        let since = |begun: u64| self.now_ns.saturating_sub(begun);
        self.file.is_none() && self.begun_ns.is_none_or(|begun| since(begun) < WINDOW_NS)
    }

    /// How many shown rows are in trouble.
    pub(crate) fn troubled(&self) -> usize {
        let is_troubled = |row: &&&Row| row.trouble(self.now_ns) != Trouble::None;
        self.shown().iter().filter(is_troubled).count()
    }

    /// Takes a key.
    pub(crate) fn press(&mut self, key: Key) -> Pressed {
        if self.view.shows_help {
            self.view.shows_help = false;
            return Pressed::Taken;
        }
        if self.view.is_typing {
            self.type_key(key);
            return Pressed::Taken;
        }
        let view = &mut self.view;
        match key {
            Key::Char('q') | Key::Escape => return Pressed::Quit,
            Key::Char('?' | 'h') => view.shows_help = true,
            Key::Char('/' | '\\') => view.is_typing = true,
            Key::Char('>' | 's') => view.sort = view.sort.next(1),
            Key::Char('<') => view.sort = view.sort.next(Sort::ALL.len() - 1),
            Key::Char('I' | 'r') => view.is_reversed = !view.is_reversed,
            Key::Char('p' | 'Z') => view.is_paused = !view.is_paused,
            Key::Char('f') => view.is_frozen = !view.is_frozen,
            Key::Char('l') => view.shows_path = Some(!view.shows_path.unwrap_or(false)),
            Key::Char('+') => self.rows.values_mut().for_each(|row| row.is_open = true),
            Key::Char('-') => self.rows.values_mut().for_each(|row| row.is_open = false),
            Key::Char(' ') | Key::Enter => self.turn_over(),
            Key::Up | Key::Char('k') => self.choose(-1),
            Key::Down | Key::Char('j') => self.choose(1),
            Key::Left => view.page -= 1,
            Key::Right => view.page += 1,
            Key::PageUp => self.choose(-10),
            Key::PageDown => self.choose(10),
            Key::Home => self.choose(isize::MIN),
            Key::End => self.choose(isize::MAX),
            Key::Char(_) | Key::Backspace => {}
        }
        self.arrange();
        Pressed::Taken
    }

    fn type_key(&mut self, key: Key) {
        let view = &mut self.view;
        match key {
            Key::Char(letter) => view.filter.push(letter),
            Key::Backspace => drop(view.filter.pop()),
            Key::Enter => view.is_typing = false,
            Key::Escape => {
                view.is_typing = false;
                view.filter.clear();
            }
            _ => {}
        }
    }

    /// Opens or closes the chosen row. `top` does not read a closed topic, and counts nothing of
    /// it.
    fn turn_over(&mut self) {
        let chosen = self.view.chosen.clone();
        let chosen = chosen.or_else(|| self.shown().first().map(|row| row.name.clone()));
        if let Some(row) = chosen.and_then(|name| self.rows.get_mut(&name)) {
            row.is_open = !row.is_open;
        }
    }

    fn choose(&mut self, by: isize) {
        let shown = self.shown();
        let chosen = self.view.chosen.as_ref();
        let at = chosen.and_then(|name| shown.iter().position(|row| row.name == *name));
        let last = shown.len().saturating_sub(1);
        let at = match at {
            Some(at) => at.saturating_add_signed(by).min(last),
            None if by > 1 => last,
            None => 0,
        };
        self.view.chosen = shown.get(at).map(|row| row.name.clone());
    }

    /// The same for programs.
    pub(crate) fn as_json(&self) -> Value {
        let rows = self.shown().into_iter().map(|row| row.as_json(self.now_ns));
        let mut value = self.head.as_json(self.now_ns);
        value["topics"] = json!(rows.collect::<Vec<_>>());
        value
    }
}
