//! The screen of `lager top`: draws the model as text in a buffer, for any size from 80 x 24.
//!
//! ```text
//!  robot, mode, how many topics are in trouble, clock, load
//!  stop, both links, mission, battery           (four or five lines)
//!  the way of frames to logic's decision, or with room each stage, and the tail of all of them
//!  the table: the most telling columns first, the others where there is room
//!  the keys, or the filter while it is typed
//! ```

use lager_topics::Durations;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};

use super::head::{Stage, shares};
use super::model::{Model, Sort};
use super::row::{Row, Trouble};
use crate::life::{Life, span};

/// From this height on, each stage of the path has a line.
const ROOMY: u16 = 40;
/// Columns of a histogram, from 10 us to 100 ms, eight for each power of ten.
const PLACES: usize = 32;
const LEAST_NS: f64 = 1e4;
const MOST_NS: f64 = 1e8;
/// No bar, and eight heights of bars.
const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

const HELP: &[&str] = &[
    "Up Down PgUp PgDn Home End   choose a row",
    "Left Right                   other columns, if not all fit",
    "Space Enter   +  -           open or close it, or all; closed ones are not read",
    "/  F4                        filter: top reads only what passes; Esc clears it",
    "<  >  F6                     sort by the previous column, by the next one",
    "I                            reverse the order",
    "p  Z                         pause: the picture stands, counting goes on",
    "f                            freeze: rows keep their places",
    "l                            latencies of the path, stage by stage",
    "                             (in all: since logic and bridge started)",
    "q  Esc  F10  Ctrl-C          leave",
    "!  samples were lost in the last 30 s    x  its writer is dead or frozen",
    "~  less than half of what is expected    ?  cannot be read    -  closed",
    "LOST counts samples that were lost on the way, SKIP those that came too fast",
    "for this screen. QUEUE is how many samples waited at most.",
];

/// Draws everything.
pub(crate) fn draw(model: &Model, area: Rect, to: &mut Buffer) {
    let mut page = Page { area, to, line: 0 };
    head(model, &mut page);
    let bottom = area.height.saturating_sub(1);
    if model.view.shows_help {
        page.line += 1;
        for line in HELP {
            page.put(line, Style::new());
        }
    } else {
        table(model, &mut page, bottom);
    }
    page.line = bottom;
    let (text, style) = footer(model, area.width);
    page.put(&format!("{text:width$}", width = area.width.into()), style);
}

/// The buffer's lines as text, without colours.
pub(crate) fn text(buffer: &Buffer) -> String {
    let mut text = String::new();
    for y in 0..buffer.area.height {
        let cells = (0..buffer.area.width).map(|x| buffer[(x, y)].symbol());
        let line: String = cells.collect();
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

struct Page<'a> {
    area: Rect,
    to: &'a mut Buffer,
    line: u16,
}

impl Page<'_> {
    /// Writes the next line.
    fn put(&mut self, text: &str, style: Style) {
        self.spans(&[(text.to_owned(), style)]);
    }

    fn spans(&mut self, spans: &[(String, Style)]) {
        if self.line < self.area.height {
            let mut x = self.area.x;
            for (text, style) in spans {
                let left = usize::from(self.area.right().saturating_sub(x));
                let y = self.area.y + self.line;
                (x, _) = self.to.set_stringn(x, y, text, left, *style);
            }
        }
        self.line += 1;
    }
}

fn plain() -> Style {
    Style::new()
}

fn bold() -> Style {
    Style::new().add_modifier(Modifier::BOLD)
}

fn dim() -> Style {
    Style::new().fg(Color::DarkGray)
}

fn bad() -> Style {
    Style::new().fg(Color::Red).add_modifier(Modifier::BOLD)
}

fn head(model: &Model, page: &mut Page<'_>) {
    let head = &model.head;
    let now = model.now_ns;
    let of = match &model.file {
        Some(file) => format!("of {file}"),
        None if head.load.cores == 0 => "from afar".to_owned(),
        None => format!(
            "load {:.2} on {}",
            head.load.minute,
            count(head.load.cores, "core")
        ),
    };
    // Before it has looked for a while, a topic may exist although it has not seen it.
    let known = |is_seen: bool, text: String| match is_seen || !model.is_looking() {
        true => text,
        false => "...".to_owned(),
    };
    let pace = head.shown_pace();
    let pace = pace.map_or(String::new(), |pace| format!("  clock x{pace:.2}"));
    let failing = head.failing.len();
    let (words, style) = match (failing, model.troubled()) {
        (0, 0) if model.is_looking() => ("looking".to_owned(), dim()),
        (0, 0) => ("all topics well".to_owned(), dim()),
        (0, n) => (format!("{} IN TROUBLE", count(n, "topic")), bad()),
        (n, 0) => (format!("{} IN TROUBLE", count(n, "service")), bad()),
        (n, topics) => {
            let (services, topics) = (count(n, "service"), count(topics, "topic"));
            (format!("{services} and {topics} IN TROUBLE"), bad())
        }
    };
    page.spans(&[
        (format!("lager top  {}  ", head.robot), bold()),
        (
            format!("{}  ", known(head.health.is_some(), head.mode())),
            plain(),
        ),
        (words, style),
        (format!("{pace}  {of}"), plain()),
    ]);
    for failing in &head.failing {
        page.put(&format!("FAILING   {}", failing.said()), bad());
    }
    match head.stopped(now) {
        None => page.put("stop      none", plain()),
        Some(why) => page.put(&format!("STOPPED   {why}"), bad()),
    }
    for (place, name) in ["sensor", "steering"].into_iter().enumerate() {
        let link = head.link(place, now);
        let style = match link.starts_with("DOWN") {
            true => bad(),
            false => plain(),
        };
        page.put(&format!("{name:9} {link}"), style);
        if let Some(misfit) = head.misfit(place) {
            page.put(&format!("{:9} {misfit}", ""), bad());
        }
    }
    let mission = known(head.status.is_some(), head.mission());
    page.put(&format!("mission   {mission}"), plain());
    if let Some(charge) = head.charge() {
        page.put(&format!("battery   {charge}"), plain());
    }
    path(model, page);
}

/// The latencies of the last second, or of a whole recording: from frames to their decision, or
/// each stage if there is room.
fn path(model: &Model, page: &mut Page<'_>) {
    if !model.head.has_path() {
        return page.put("path      not measured", dim());
    }
    let since = match model.file {
        Some(_) => "",
        None => " in the last second",
    };
    let is_roomy = page.area.height >= ROOMY;
    let shows_all = model.view.shows_path.unwrap_or(is_roomy);
    let stages = model.head.stages();
    for (name, Stage { recent: stage, .. }) in stages {
        let label = match shows_all {
            true => format!("{:14}", format!("path {name}")),
            false if name == "decided" => "path     ".to_owned(),
            false => continue,
        };
        let ms = |ns: u64| ns as f64 / 1e6;
        let bars = bars(&shares::<PLACES>(&stage, LEAST_NS, MOST_NS));
        if stage.count == 0 {
            page.put(&format!("{label} {bars} none{since}"), dim());
            continue;
        }
        page.put(
            &format!(
                "{label} {bars} p50 {:.3} p99 {:.3} max {:.3} ms",
                ms(stage.quantile_ns(0.5)),
                ms(stage.quantile_ns(0.99)),
                ms(stage.max_ns)
            ),
            plain(),
        );
    }
    if shows_all {
        page.put("               10 us   100 us  1 ms    10 ms", dim());
    }
    // The tail needs more than a second: it is that of all that the services have counted.
    let tails = stages
        .into_iter()
        .filter(|(name, stage)| ["decided", "total"].contains(name) && stage.whole.count > 0);
    let tails: Vec<_> = tails
        .map(|(name, stage)| tail(name, &stage.whole))
        .collect();
    if !tails.is_empty() {
        page.put(&format!("in all    {} ms", tails.join(", ")), plain());
    }
}

/// The far end of a stage's durations, in ms.
fn tail(name: &str, whole: &Durations) -> String {
    let ms = |ns: u64| format!("{:.3}", ns as f64 / 1e6);
    let p999 = whole.tail_ns(0.999).map_or_else(|| "-".to_owned(), ms);
    format!("{name} p99.9 {p999} max {}", ms(whole.max_ns))
}

/// Shares as bars. A higher bar is more frequent, and even a rare one is visible.
fn bars(shares: &[f64]) -> String {
    let most = shares.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let bar = |share: &f64| match *share {
        share if share <= 0.0 => BARS[0],
        share => BARS[((share / most * 8.0).round() as usize).clamp(1, 8)],
    };
    shares.iter().map(bar).collect()
}

/// Width of the column that names the writer.
const WRITER: usize = 15;

/// A column: its head, its width, its content, and its order.
struct Column {
    head: &'static str,
    width: usize,
    sort: Option<Sort>,
    cell: fn(&Row, u64) -> String,
}

/// In their order on the screen. If not all fit, those with the lowest rank are left out first.
const COLUMNS: &[(u8, Column)] = &[
    (
        9,
        column("TOPIC", 17, Some(Sort::Name), |row, _| row.name.clone()),
    ),
    (9, column("WRITER", WRITER, None, |row, _| writer(row))),
    (2, column("STATE", 6, None, |row, _| state(row))),
    (8, column("READERS", 7, None, |row, _| readers(row))),
    (
        9,
        column("HZ", 7, Some(Sort::Hz), |row, _| {
            measured(row, row.figures.hz)
        }),
    ),
    (
        8,
        column("EXPECT", 6, None, |row, _| {
            row.expected_hz.map_or("-".to_owned(), number)
        }),
    ),
    (
        9,
        column("AGE", 6, Some(Sort::Age), |row, now| {
            row.age(now).map_or("-".to_owned(), short)
        }),
    ),
    (
        9,
        column("LOST", 5, Some(Sort::Lost), |row, _| many(row.lost)),
    ),
    (1, column("SKIP", 6, None, |row, _| many(row.overrun))),
    (
        3,
        column("QUEUE", 5, None, |row, _| many(row.figures.queue)),
    ),
    (
        3,
        column("JITTER99", 8, Some(Sort::Jitter), |row, _| {
            ms(row.figures.jitter_p99_ns)
        }),
    ),
    (
        3,
        column("KIB/S", 7, Some(Sort::Bytes), |row, _| {
            let bytes = row.bytes_per_s();
            bytes.map_or("-".to_owned(), |bytes| measured(row, bytes / 1024.0))
        }),
    ),
    (
        3,
        column("DELAY50", 8, None, |row, _| ms(row.figures.delay_p50_ns)),
    ),
    (
        4,
        column("DELAY99", 8, Some(Sort::Delay), |row, _| {
            ms(row.figures.delay_p99_ns)
        }),
    ),
    (
        3,
        column("DELAYMAX", 8, None, |row, _| ms(row.figures.delay_max_ns)),
    ),
    (
        1,
        column("SAMPLES", 9, None, |row, _| row.samples.to_string()),
    ),
];

const fn column(
    head: &'static str,
    width: usize,
    sort: Option<Sort>,
    cell: fn(&Row, u64) -> String,
) -> Column {
    Column {
        head,
        width,
        sort,
        cell,
    }
}

/// Divides the columns into pages that fit, by their places in [`COLUMNS`]. The columns with the
/// highest rank come first, and each page has the topic's name.
fn pages(width: usize) -> Vec<Vec<usize>> {
    let fits = |page: &[usize]| {
        let widths = page.iter().map(|at| COLUMNS[*at].1.width + 1);
        widths.sum::<usize>() <= width
    };
    let mut left: Vec<usize> = (1..COLUMNS.len()).collect();
    let mut pages = Vec::new();
    while pages.is_empty() || !left.is_empty() {
        let mut page = vec![0];
        page.append(&mut left);
        while !fits(&page) && page.len() > 2 {
            // The last of those with the lowest rank.
            let others = page.iter().enumerate().skip(1).rev();
            let least = others.min_by_key(|(_, at)| COLUMNS[**at].0);
            let (place, _) = least.expect("there are two");
            left.push(page.remove(place));
        }
        left.sort_unstable();
        pages.push(page);
    }
    pages
}

/// The columns of the present page, in their order.
fn fitting(model: &Model, width: usize) -> Vec<&'static Column> {
    let pages = pages(width);
    let shown = model.view.page.rem_euclid(pages.len() as isize);
    let shown = pages[shown.unsigned_abs()].iter();
    shown.map(|at| &COLUMNS[*at].1).collect()
}

fn table(model: &Model, page: &mut Page<'_>, bottom: u16) {
    let columns = fitting(model, page.area.width.into());
    let rows = model.shown();
    let room = usize::from(bottom.saturating_sub(page.line + 1)).max(1);
    let hidden = rows.len().saturating_sub(room);
    let mut head = String::from(" ");
    for (place, column) in columns.iter().enumerate() {
        let mark = match column.sort == Some(model.view.sort) {
            true if model.view.is_reversed => "^",
            true => "v",
            false => "",
        };
        let more = match place {
            0 if hidden > 0 => format!(" (+{hidden} more)"),
            _ => String::new(),
        };
        let name = format!("{mark}{}{more}", column.head);
        head += &cell(&name, column);
    }
    let width = usize::from(page.area.width);
    let head_style = Style::new().add_modifier(Modifier::REVERSED);
    page.put(&format!("{head:width$}"), head_style);
    if rows.is_empty() {
        let why = match model.view.filter.is_empty() {
            true => "no topic of this robot is open",
            false => "no topic passes the filter",
        };
        return page.put(&format!("  {why}"), dim());
    }
    // The chosen row is always in sight.
    let chosen = model.view.chosen.as_ref();
    let at = chosen.and_then(|name| rows.iter().position(|row| row.name == *name));
    let first = at.map_or(0, |at| (at + 1).saturating_sub(room));
    for (place, row) in rows.iter().enumerate().skip(first).take(room) {
        let trouble = row.trouble(model.now_ns);
        let mark = match trouble {
            Trouble::Losing => '!',
            Trouble::Unwritten => 'x',
            Trouble::Slow => '~',
            Trouble::None if !row.is_open => '-',
            Trouble::None if row.unread.is_some() => '?',
            Trouble::None => ' ',
        };
        let mut line = mark.to_string();
        for column in &columns {
            line += &cell(&(column.cell)(row, model.now_ns), column);
        }
        let style = match trouble {
            Trouble::Losing | Trouble::Unwritten => bad(),
            Trouble::Slow => Style::new().fg(Color::Yellow),
            Trouble::None if !row.is_open => dim(),
            Trouble::None if row.unread.is_some() => Style::new().fg(Color::Yellow),
            Trouble::None => plain(),
        };
        let style = match at == Some(place) {
            true => style.add_modifier(Modifier::REVERSED),
            false => style,
        };
        page.put(&format!("{line:width$}"), style);
    }
}

/// Words stand at the left of a column, numbers at its right.
fn cell(text: &str, column: &Column) -> String {
    let width = column.width;
    let text: String = text.chars().take(width).collect();
    match column.head {
        "TOPIC" | "WRITER" => format!("{text:width$} "),
        _ => format!("{text:>width$} "),
    }
}

fn writer(row: &Row) -> String {
    let Some(first) = row.author() else {
        return "-".to_owned();
    };
    let role = match (&first.role, first.life) {
        (Some(role), _) => role.to_string(),
        (None, Life::Recorded) => "process".to_owned(),
        (None, _) => "stranger".to_owned(),
    };
    let more = match row.authors.len() {
        1 => String::new(),
        n => format!(" +{}", n - 1),
    };
    // A long role is cut, but never the number: only the whole number names the process.
    let process = format!(" {}{more}", first.pid);
    let room = WRITER.saturating_sub(process.len());
    role.chars().take(room).collect::<String>() + &process
}

fn state(row: &Row) -> String {
    let worst = row.authors.iter().map(|author| author.life).max();
    worst.map_or("-", Life::name).to_owned()
}

fn readers(row: &Row) -> String {
    match (row.readers, row.places) {
        (None, _) => "-".to_owned(),
        (Some(readers), Some(places)) => format!("{readers}/{places}"),
        (Some(readers), None) => readers.to_string(),
    }
}

/// A figure that needs samples; empty without samples.
fn measured(row: &Row, value: f64) -> String {
    match row.last_ns {
        Some(_) => number(value),
        None => "-".to_owned(),
    }
}

/// A number in six letters.
fn number(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        v if v < 10.0 => format!("{v:.2}"),
        v if v < 1_000.0 => format!("{v:.1}"),
        v => format!("{v:.0}"),
    }
}

/// A count in five letters.
fn many(count: u64) -> String {
    match count {
        n if n < 100_000 => n.to_string(),
        n if n < 10_000_000 => format!("{}k", n / 1_000),
        n => format!("{}M", n / 1_000_000),
    }
}

fn ms(ns: u64) -> String {
    match ns {
        0 => "-".to_owned(),
        ns => format!("{:.3}", ns as f64 / 1e6),
    }
}

fn short(age: std::time::Duration) -> String {
    span(age).replace(' ', "")
}

fn count(number: usize, thing: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {thing}{plural}")
}

fn footer(model: &Model, width: u16) -> (String, Style) {
    let view = &model.view;
    if view.is_typing {
        let text = format!("filter: {}_   Enter keeps it, Esc drops it", view.filter);
        return (text, Style::new().add_modifier(Modifier::REVERSED));
    }
    let mut states = Vec::new();
    if view.is_paused {
        states.push("PAUSED".to_owned());
    }
    if view.is_frozen {
        states.push("FROZEN".to_owned());
    }
    if !view.filter.is_empty() {
        states.push(format!("filter {}", view.filter));
    }
    let states = match states.is_empty() {
        true => String::new(),
        false => format!("[{}] ", states.join(", ")),
    };
    let more = match pages(width.into()).len() {
        1 => "",
        _ => " Right:more",
    };
    let text = format!(
        "{states}?:help{more} /:filter <>:sort {} Space:close p:pause f:freeze q:quit",
        view.sort.name()
    );
    (text, dim())
}
