//! Writes a sample as text for people: a row of a table if the payload is small, else a block.
//!
//! ```text
//! at s            age ms  by             number  link_epoch  distance (cm)  packet_id
//! 5123.456789      0.214  bridge (4711)     211           1             37          3
//!
//! link/health  number 42  at 5123.456789 s  0.214 ms old  by bridge (4711)
//!   mode              autonomous
//!   next_lease        80 ms
//!   .                 sensor    steering
//!   epoch                  1           1
//! ```
//!
//! This module knows no topic; [`crate::sentence`] says what a sample means. The payload's
//! description gives the order, names and kinds of the fields. The end of a field's name is its
//! unit. A value that equals the payload's blank value is unknown, and is printed as `-`. Enums are
//! words, and fields of the same structure stand beside each other. A histogram appears as its
//! quantiles. Whole numbers are exact, other numbers have three decimals. Programs read the JSON.

use std::fmt::Write;

use lager_sample::{Description, Schema, Stamp, Topic};
use serde_json::Value;

use crate::{ToolError, durations, sentence};

/// A payload with at most so many fields is a row.
const WIDEST_ROW: usize = 6;
/// The column at which a block's values begin.
const VALUES_AT: usize = 24;
/// Stands for an unknown value.
const UNKNOWN: &str = "-";
/// Fields that say yes or no as 1 or 0.
const YES_OR_NO: [&str; 4] = ["up", "stopped", "under_way", "arm_granted"];

/// How to write the samples of one topic.
#[derive(Debug)]
pub(crate) struct Blocks {
    topic: String,
    fields: Vec<String>,
    /// The payload's blank value; null if it is not known.
    blank: Value,
    /// The columns' widths so far, if samples are rows; empty before the first sample.
    row: Option<Vec<usize>>,
    /// What a sample means in words.
    sentence: fn(&Value) -> Option<String>,
}

impl Blocks {
    pub(crate) fn new<T: Topic>() -> Result<Self, ToolError> {
        let blank = serde_json::to_value(T::Payload::default())?;
        let fields = <T::Payload as Schema>::FIELDS.iter();
        let fields = fields.map(|field| field.name.to_owned()).collect();
        Ok(Self {
            row: is_row(&blank).then(Vec::new),
            topic: T::NAME.to_owned(),
            fields,
            blank,
            sentence: sentence::of::<T>(),
        })
    }

    /// For a topic of which only the description is known.
    pub(crate) fn of_found(topic: &str, description: &Description) -> Result<Self, ToolError> {
        let zeros = vec![0; description.size()];
        Ok(Self {
            row: is_row(&serde_json::to_value(description.read(&zeros))?).then(Vec::new),
            topic: topic.to_owned(),
            fields: description.fields().map(str::to_owned).collect(),
            blank: Value::Null,
            sentence: |_| None,
        })
    }

    /// The text of one sample that was received at `received_ns`, with its line ends. Without that
    /// time its age is unknown.
    pub(crate) fn sample(
        &mut self,
        stamp: &Stamp,
        received_ns: Option<u64>,
        writer: &str,
        payload: &Value,
    ) -> String {
        let at = scaled(stamp.publish_time_ns / 1_000, 6);
        let age = received_ns.map_or(UNKNOWN.to_owned(), |received_ns| {
            scaled(received_ns.saturating_sub(stamp.source_time_ns) / 1_000, 3)
        });
        let payload = &durations::readable(payload);
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = match self.row.take() {
            Some(mut widths) => {
                let lead = [
                    ("at s", at),
                    ("age ms", age),
                    ("by", writer.to_owned()),
                    ("number", stamp.sequence.to_string()),
                ];
                let row = self.row(&mut text, &mut widths, &lead, payload);
                self.row = Some(widths);
                row
            }
            None => self.block(&mut text, stamp, [&at, &age, writer], payload),
        };
        text
    }

    fn row(
        &self,
        text: &mut String,
        widths: &mut Vec<usize>,
        lead: &[(&str, String)],
        payload: &Value,
    ) -> std::fmt::Result {
        let mut cells: Vec<(String, String)> = lead
            .iter()
            .map(|(name, value)| ((*name).to_owned(), value.clone()))
            .collect();
        for (name, value, blank) in self.entries(payload) {
            let (short, unit) = unit(name);
            let head = match unit {
                Unit::None => short.to_owned(),
                unit => format!("{short} ({})", unit.name()),
            };
            cells.push((head, plain(name, value, blank)));
        }
        let is_first = widths.is_empty();
        // Most words are not longer, so most columns keep their width.
        widths.resize(cells.len(), 8);
        for (width, (head, value)) in widths.iter_mut().zip(&cells) {
            *width = length(head).max(length(value)).max(*width);
        }
        if is_first {
            let heads = cells.iter().map(|(head, _)| head.as_str());
            line(text, widths, heads)?;
        }
        line(text, widths, cells.iter().map(|(_, value)| value.as_str()))
    }

    fn block(
        &self,
        text: &mut String,
        stamp: &Stamp,
        [at, age, writer]: [&str; 3],
        payload: &Value,
    ) -> std::fmt::Result {
        writeln!(
            text,
            "{}  number {}  at {at} s  {age} ms old  by {writer}",
            self.topic, stamp.sequence
        )?;
        let mut beside: Vec<(&str, &Value, &Value)> = Vec::new();
        for (name, value, blank) in self.entries(payload) {
            if value.is_object() {
                beside.push((name, value, blank));
                continue;
            }
            table(text, &beside)?;
            beside.clear();
            let (short, unit) = unit(name);
            if let Some(list) = value.as_array() {
                listed(text, name, list, blank, payload)?;
                continue;
            }
            let shown = plain(name, value, blank);
            let unit = match shown.as_str() {
                UNKNOWN => "",
                _ => unit.name(),
            };
            let shown = format!("{shown} {unit}");
            writeln!(text, "  {short:VALUES_AT$}{}", shown.trim_end())?;
        }
        table(text, &beside)?;
        if let Some(sentence) = (self.sentence)(payload) {
            writeln!(text, "  \"{sentence}\"")?;
        }
        writeln!(text)
    }

    /// The payload's fields in the table's order, each with its blank value.
    fn entries<'a>(
        &'a self,
        payload: &'a Value,
    ) -> impl Iterator<Item = (&'a str, &'a Value, &'a Value)> {
        self.fields.iter().filter_map(|name| {
            let value = payload.get(name)?;
            Some((name.as_str(), value, &self.blank[name]))
        })
    }
}

/// Whether a payload of this kind is shown as a row.
fn is_row(blank: &Value) -> bool {
    let is_flat = members(blank).all(|(_, value)| !value.is_object() && !value.is_array());
    is_flat && members(blank).count() <= WIDEST_ROW
}

/// Fields that have fields themselves. Those of the same type stand beside each other.
fn table(text: &mut String, beside: &[(&str, &Value, &Value)]) -> std::fmt::Result {
    let mut left = beside;
    while let Some((_, first, _)) = left.first() {
        let alike = left
            .iter()
            .take_while(|(_, value, _)| names(value).eq(names(first)))
            .count();
        let (columns, others) = left.split_at(alike);
        left = others;
        let widths: Vec<usize> = columns
            .iter()
            .map(|(name, ..)| length(name).max(12))
            .collect();
        write!(text, "  {:VALUES_AT$}", "")?;
        line(text, &widths, columns.iter().map(|(name, ..)| *name))?;
        for name in names(first) {
            let (short, unit) = unit(name);
            let head = match unit {
                Unit::None => short.to_owned(),
                unit => format!("{short} ({})", unit.name()),
            };
            let cells: Vec<String> = columns
                .iter()
                .map(|(_, value, blank)| plain(name, &value[name], &blank[name]))
                .collect();
            write!(text, "  {head:VALUES_AT$}")?;
            line(text, &widths, cells.iter().map(String::as_str))?;
        }
    }
    Ok(())
}

/// A list: numbers and nodes in one line, everything else on a line for each.
fn listed(
    text: &mut String,
    name: &str,
    list: &[Value],
    blank: &Value,
    payload: &Value,
) -> std::fmt::Result {
    let (short, unit) = unit(name);
    write!(text, "  {short:VALUES_AT$}")?;
    let is_node = |value: &Value| names(value).eq(["x", "y"]);
    if name == "nodes" || list.iter().all(is_node) && !list.is_empty() {
        // JSON leaves out the nodes (0,0) at the end.
        let length = payload.get("length").and_then(Value::as_u64).unwrap_or(0);
        let length = usize::try_from(length).unwrap_or(0).max(list.len());
        let at = |place: usize, axis| {
            let node: Option<&Value> = list.get(place);
            node.map_or(0, |node| node[axis].as_i64().unwrap_or(0))
        };
        let nodes: Vec<String> = (0..length)
            .map(|place| format!("({},{})", at(place, "x"), at(place, "y")))
            .collect();
        return writeln!(text, "{}", nodes.join(" "));
    }
    if !list.iter().any(Value::is_object) {
        for (place, value) in list.iter().enumerate() {
            write!(text, "{:>6}", plain(name, value, &blank[place]))?;
        }
        let unit = unit.name();
        return writeln!(text, "{}{unit}", if unit.is_empty() { "" } else { " " });
    }
    writeln!(text, "{}", list.len())?;
    for value in list {
        write!(text, "   ")?;
        for (name, value) in members(value) {
            let (short, unit) = crate::block::unit(name);
            let shown = format!(
                " {short} {} {}",
                plain(name, value, &Value::Null),
                unit.name()
            );
            write!(text, " {}", shown.trim_end())?;
        }
        writeln!(text)?;
    }
    Ok(())
}

/// Cells at the right of their columns, with two blanks between the columns.
fn line<'a>(
    text: &mut String,
    widths: &[usize],
    cells: impl Iterator<Item = &'a str>,
) -> std::fmt::Result {
    let mut whole = String::new();
    for (width, cell) in widths.iter().zip(cells) {
        write!(whole, "{cell:>width$}  ")?;
    }
    writeln!(text, "{}", whole.trim_end())
}

/// One value without its unit.
fn plain(name: &str, value: &Value, blank: &Value) -> String {
    // 0 is a value; any other value that a payload states as blank means that the field was never
    // written.
    let is_zero = blank.as_f64().is_none_or(|number| number == 0.0);
    if value == blank && !is_zero {
        return UNKNOWN.to_owned();
    }
    if let Some(variant) = value.as_str() {
        return words(variant);
    }
    if let Some(number) = value.as_u64() {
        return match unit(name).1 {
            Unit::Tenths(_) => scaled(number, 1),
            Unit::Nanoseconds => scaled(number, 3),
            // Eleven sensors, the leftmost first.
            Unit::None if name == "bits" => format!("{number:011b}"),
            Unit::None if number < 2 && YES_OR_NO.contains(&name) => {
                ["no", "yes"][usize::from(number == 1)].to_owned()
            }
            Unit::None | Unit::Whole(_) => number.to_string(),
        };
    }
    if let Some(number) = value.as_i64() {
        return number.to_string();
    }
    match value.as_f64() {
        Some(number) => format!("{number:.3}"),
        None => value.to_string(),
    }
}

/// A variant's name as words: `LeftOfLine` is `left of line`.
pub(crate) fn words(variant: &str) -> String {
    let mut words = String::new();
    for character in variant.chars() {
        if character.is_ascii_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(character.to_lowercase());
    }
    words
}

/// Writes a whole number of small units with so many decimals of a larger unit.
fn scaled(number: u64, decimals: u32) -> String {
    let one = 10_u64.pow(decimals);
    let width = decimals as usize;
    format!("{}.{:0width$}", number / one, number % one)
}

/// What a number counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    /// The name says no unit.
    None,
    /// This unit.
    Whole(&'static str),
    /// Tenths of this unit.
    Tenths(&'static str),
    /// Nanoseconds, shown in microseconds.
    Nanoseconds,
}

impl Unit {
    fn name(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Whole(name) | Self::Tenths(name) => name,
            Self::Nanoseconds => "us",
        }
    }
}

/// The units at the ends of fields' names, the longer endings first.
const UNITS: [(&str, Unit); 11] = [
    ("_mm_per_s", Unit::Whole("mm/s")),
    ("_mm", Unit::Whole("mm")),
    ("_cm", Unit::Whole("cm")),
    ("_ms", Unit::Whole("ms")),
    ("_100us", Unit::Tenths("ms")),
    ("_us", Unit::Whole("us")),
    ("_ns", Unit::Nanoseconds),
    ("_deg", Unit::Whole("degrees")),
    ("_rad", Unit::Whole("rad")),
    ("_percent", Unit::Whole("%")),
    ("_decivolts", Unit::Tenths("V")),
];

/// A field's name without its unit, and the unit.
fn unit(name: &str) -> (&str, Unit) {
    let known = UNITS
        .iter()
        .find_map(|(ending, unit)| Some((name.strip_suffix(ending)?, *unit)));
    known.unwrap_or((name, Unit::None))
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// The members of an object; none of anything else.
fn members(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let members = value.as_object().into_iter().flatten();
    members.map(|(name, value)| (name.as_str(), value))
}

/// The names of an object's members.
fn names(value: &Value) -> impl Iterator<Item = &str> {
    members(value).map(|(name, _)| name)
}

#[cfg(test)]
mod tests {
    use lager_topics::{
        Durations, LatencyCommand, LinkHealth, LogThought, MissionEvent, NavRoute, SensorLine,
        SteeringState, TruthPose,
    };
    use serde_json::json;

    use super::*;

    /// What is shown of samples of `T` with these fields; the others are blank.
    fn shown<T: Topic>(payloads: &[Value]) -> String {
        let mut blocks = Blocks::new::<T>().expect("a payload in JSON");
        let stamp = Stamp {
            sequence: 42,
            source_time_ns: 5_123_456_000_000,
            publish_time_ns: 5_123_456_789_999,
            ..Stamp::default()
        };
        let sample = |fields: &Value| {
            let payload: T::Payload = serde_json::from_value(fields.clone()).expect("its fields");
            let payload = serde_json::to_value(payload).expect("a payload in JSON");
            blocks.sample(&stamp, Some(5_123_458_500_000), "bridge (4711)", &payload)
        };
        payloads.iter().map(sample).collect()
    }

    /// The lines that begin with `name`, without the blanks between their parts.
    fn lines<'a>(told: &'a str, name: &str) -> Vec<Vec<&'a str>> {
        told.lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>())
            .filter(|parts| parts.first() == Some(&name))
            .collect()
    }

    #[test]
    fn a_small_payload_is_a_row_under_one_head() {
        let told = shown::<SensorLine>(&[
            json!({"link_epoch": 1, "bits": 0b000_0111_0000, "state": "OnLine", "packet_id": 15}),
            json!({"link_epoch": 1, "bits": 0xFFFF, "state": "LeftOfLine"}),
        ]);
        let rows = [
            "       at s    age ms             by    number  link_epoch         bits     state  packet_id",
            "5123.456789     2.500  bridge (4711)        42           1  00001110000   on line         15",
            "5123.456789     2.500  bridge (4711)        42           1            -  left of line          0",
        ];
        assert_eq!(told.lines().collect::<Vec<_>>(), rows);
    }

    #[test]
    fn a_block_has_its_stamp_in_its_head_and_units_behind_its_values() {
        let told = shown::<SteeringState>(&[json!({
            "finish": "Aborted", "left_duty": 100, "battery_decivolts": 74, "line_error": -3,
            "servo_position": [512, 65535, 300, 65535, 65535, 65535, 65535, 0],
        })]);
        let head = told.lines().next().expect("a head");
        assert_eq!(
            head,
            "steering/state  number 42  at 5123.456789 s  2.500 ms old  by bridge (4711)"
        );
        for line in [
            "  finish                  aborted",
            "  left_duty               100",
            "  line_error              -3",
            "  battery                 7.4 V",
            "  servo_position             512     -   300     -     -     -     -     0",
        ] {
            assert!(told.lines().any(|told| told == line), "{line}\n{told}");
        }
    }

    #[test]
    fn fields_of_the_same_make_stand_beside_each_other() {
        let told = shown::<LinkHealth>(&[json!({
            "sensor": {"epoch": 3, "up": 1, "reset_cause": "PowerOn", "board_longest_loop_100us": 12},
            "steering": {"epoch": 4, "up": 0, "version": 1},
            "mode": "Autonomous", "next_lease_ms": 80,
        })]);
        assert_eq!(lines(&told, "sensor"), [["sensor", "steering"]]);
        assert_eq!(lines(&told, "epoch"), [["epoch", "3", "4"]]);
        assert_eq!(lines(&told, "up"), [["up", "yes", "no"]]);
        assert_eq!(lines(&told, "version"), [["version", "-", "1"]]);
        assert_eq!(
            lines(&told, "reset_cause"),
            [["reset_cause", "power", "on", "unknown"]]
        );
        assert_eq!(
            lines(&told, "board_longest_loop"),
            [["board_longest_loop", "(ms)", "1.2", "0.0"]]
        );
        assert_eq!(lines(&told, "mode"), [["mode", "autonomous"]]);
        assert_eq!(lines(&told, "next_lease"), [["next_lease", "80", "ms"]]);
        assert_eq!(lines(&told, "gain_p"), [["gain_p", "-"]]);
    }

    #[test]
    fn lists_show_what_is_used_of_them() {
        let nodes = json!([{"x": 2, "y": 1}, {"x": 1, "y": 0}]);
        let told = shown::<NavRoute>(&[json!({"length": 3, "nodes": nodes})]);
        assert_eq!(
            lines(&told, "nodes"),
            [["nodes", "(2,1)", "(1,0)", "(0,0)"]]
        );
        let goods = json!([{"id": 7, "x_mm": 12.5, "state": "Held"}]);
        let told = shown::<TruthPose>(&[json!({"good_count": 1, "goods": goods})]);
        assert_eq!(lines(&told, "goods"), [["goods", "1"]]);
        let good: Vec<_> = "id 7 x 12.500 mm y 0.000 mm z 0.000 mm state held"
            .split(' ')
            .collect();
        assert_eq!(lines(&told, "id"), [good]);
    }

    #[test]
    fn what_a_sample_means_is_said_behind_its_values() {
        let told = shown::<LogThought>(&[json!({"kind": "AtBar", "from": "Logic"})]);
        assert_eq!(lines(&told, "from"), [["from", "logic"]]);
        assert!(
            told.ends_with("\n  \"I am at the place of delivery and let go.\"\n\n"),
            "{told}"
        );
        let failure = json!({"kind": "NoWay", "remedy": "Way", "x": 1, "y": 2});
        let told = shown::<MissionEvent>(&[json!({"kind": "Failed", "failure": failure})]);
        let sentence = "\"there is no way from (1, 2) to where the robot must go. The robot goes on when a way is open.\"";
        assert!(told.contains(sentence), "{told}");
        assert!(!shown::<MissionEvent>(&[json!({})]).contains('"'));
    }

    #[test]
    fn histograms_are_shown_by_their_quantiles() {
        let (mut short, mut long) = (Durations::default(), Durations::default());
        for micros in 1..=100 {
            short.record(micros * 1_000);
            long.record(micros * 10_000);
        }
        let told = shown::<LatencyCommand>(&[json!({"order_receive": short, "total": long})]);
        let columns = ["order_receive", "receive_write", "total"];
        assert_eq!(lines(&told, "order_receive"), [columns]);
        assert_eq!(lines(&told, "count"), [["count", "100", "0", "100"]]);
        assert_eq!(
            lines(&told, "mean"),
            [["mean", "(us)", "50.500", "0.000", "505.000"]]
        );
        assert_eq!(
            lines(&told, "max"),
            [["max", "(us)", "100.000", "0.000", "1000.000"]]
        );
        for quantile in ["p50", "p90", "p99", "p999"] {
            assert_eq!(lines(&told, quantile).len(), 1, "{told}");
        }
        assert!(!told.contains("buckets"), "{told}");
    }

    #[test]
    fn every_topic_of_the_table_can_be_shown() {
        struct Blank;
        impl lager_topics::TopicVisitor for Blank {
            type Output = String;
            fn visit<T: Topic>(self) -> String {
                shown::<T>(&[json!({})])
            }
        }
        for entry in lager_topics::TOPICS {
            let told = lager_topics::visit(entry.name, Blank).expect("a topic of the table");
            for field in entry
                .layout
                .fields
                .iter()
                .filter(|field| field.name != "reserved")
            {
                let (short, _) = unit(field.name);
                assert!(told.contains(short), "{short} is missing:\n{told}");
            }
        }
    }
}
