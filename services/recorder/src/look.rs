//! `bag info` and `bag check`: what a file contains, and whether it is undamaged.

use std::io::Write;
use std::path::Path;

use lager_journal::{
    CalendarStep, Check, Count, Learnt, Overview, Report, TopicOverview, is_doubtful, utc,
};
use serde_json::json;

use crate::bag::{Bag, BagError};

/// `bag info`: size, times, and each topic with its messages and losses, from the file's end alone.
///
/// # Errors
/// The file cannot be read or was cut off, or the output cannot be written.
pub fn info(file: &Path, as_json: bool, out: &mut impl Write) -> Result<(), BagError> {
    let bag = Bag::open(file)?;
    let bytes = bag.length()?;
    let overview = bag.overview()?;
    let seconds = (overview.end_ns - overview.begin_ns.min(overview.end_ns)) as f64 / 1e9;
    let robot = overview.start.as_ref().map(|start| start.robot.as_str());
    if as_json {
        let topics: Vec<_> = overview
            .topics
            .iter()
            .map(|topic| {
                json!({
                    "topic": topic.name, "type": topic.schema, "messages": topic.messages,
                    "repeated": topic.repeated,
                    "hz": rate(topic, seconds), "received": topic.count.map(|c| c.received),
                    "lost": topic.count.map(|c| c.lost), "dropped": topic.count.map(|c| c.dropped),
                })
            })
            .collect();
        let value = json!({
            "file": file.display().to_string(), "bytes": bytes, "chunks": overview.chunks,
            "robot": robot, "part": overview.start.as_ref().map(|start| start.part),
            "begin_unix_ns": overview.begin_ns, "end_unix_ns": overview.end_ns,
            "dates_are_doubtful": is_doubtful(overview.begin_ns) && overview.messages > 0,
            "calendar_steps": steps(&overview.steps),
            "seconds": seconds, "messages": overview.messages, "topics": topics,
        });
        writeln!(out, "{value}")?;
        return Ok(());
    }
    writeln!(out, "file      {}", file.display())?;
    let mib = bytes as f64 / f64::from(1 << 20);
    writeln!(
        out,
        "size      {mib:.2} MiB ({bytes} bytes) in {} chunks",
        overview.chunks
    )?;
    match (robot, &overview.start) {
        (Some(robot), Some(start)) if start.part > 0 => {
            writeln!(
                out,
                "robot     {robot}, file {} of its recording",
                start.part + 1
            )?;
        }
        (Some(robot), _) => writeln!(out, "robot     {robot}")?,
        _ => writeln!(out, "robot     - (another program recorded it)")?,
    }
    writeln!(out, "begin     {} UTC", utc(overview.begin_ns))?;
    writeln!(out, "end       {} UTC", utc(overview.end_ns))?;
    writeln!(out, "duration  {seconds:.3} s")?;
    writeln!(out, "messages  {}", overview.messages)?;
    let repeated: u64 = overview.topics.iter().map(|topic| topic.repeated).sum();
    if repeated > 0 {
        writeln!(
            out,
            "repeated  {repeated} of them, from before this file, so that it says what held"
        )?;
    }
    if overview.messages > 0 {
        for line in dates(overview.begin_ns, &overview.steps) {
            writeln!(out, "calendar  {line}")?;
        }
    }
    table(&overview, seconds, out)
}

fn table(overview: &Overview, seconds: f64, out: &mut impl Write) -> Result<(), BagError> {
    let width = |text: fn(&TopicOverview) -> &str| {
        let lengths = overview
            .topics
            .iter()
            .map(|topic| text(topic).chars().count());
        lengths.max().unwrap_or(0).max(5)
    };
    let (name, kind) = (width(|topic| &topic.name), width(|topic| &topic.schema));
    writeln!(
        out,
        "\n{:name$}  {:kind$}  {:>9}  {:>9}  {:>7}  {:>7}",
        "topic", "type", "messages", "Hz", "lost", "dropped"
    )?;
    for topic in &overview.topics {
        let shown = |number: Option<u64>| number.map_or("-".to_owned(), |n| n.to_string());
        writeln!(
            out,
            "{:name$}  {:kind$}  {:>9}  {:>9.2}  {:>7}  {:>7}",
            topic.name,
            topic.schema,
            topic.messages,
            rate(topic, seconds),
            shown(topic.count.map(|count| count.lost)),
            shown(topic.count.map(|count| count.dropped)),
        )?;
    }
    Ok(())
}

/// Remarks about a file's dates: whether they are doubtful, and when the calendar was set.
fn dates(begin_ns: u64, steps: &[CalendarStep]) -> Vec<String> {
    let set = steps.iter().map(|step| set(step, begin_ns));
    doubt(begin_ns).into_iter().chain(set).collect()
}

/// A remark if a date in ns since 1970 is doubtful.
pub fn doubt(unix_ns: u64) -> Option<String> {
    is_doubtful(unix_ns).then(|| {
        let date = utc(unix_ns);
        format!(
            "the dates are doubtful: the machine's calendar says {date} UTC, so its clock was not set"
        )
    })
}

/// A remark that the calendar was set during a recording that began at `begin_ns`.
pub(crate) fn set(step: &CalendarStep, begin_ns: u64) -> String {
    let after = step.at_ns.saturating_sub(begin_ns) as f64 / 1e9;
    let begin = utc(step.corrected(begin_ns));
    format!(
        "the machine's calendar was set {after:.1} s after the recording began; by the new one it \
         began {begin} UTC. The recording's dates go on as they began"
    )
}

fn steps(steps: &[CalendarStep]) -> Vec<serde_json::Value> {
    let steps = steps.iter();
    steps
        .map(|step| json!({"at_unix_ns": step.at_ns, "by_ns": step.by_ns}))
        .collect()
}

/// Samples a second over the whole file.
fn rate(topic: &TopicOverview, seconds: f64) -> f64 {
    if seconds > 0.0 {
        (topic.messages - topic.repeated) as f64 / seconds
    } else {
        0.0
    }
}

/// `bag check`: reads the whole file, compares every CRC, every number and the file's own counts,
/// and prints the faults. Returns whether there is none.
///
/// # Errors
/// The file cannot be read, or the output cannot be written.
pub fn check(file: &Path, as_json: bool, out: &mut impl Write) -> Result<bool, BagError> {
    let report = report(&Bag::open(file)?)?;
    let messages: u64 = report.topics.values().map(|topic| topic.messages).sum();
    let repeated: u64 = report.topics.values().map(|topic| topic.repeated).sum();
    let counts = report.topics.values().filter_map(|topic| topic.count);
    let total = counts.fold(Count::default(), |total, count| Count {
        received: total.received + count.received,
        lost: total.lost + count.lost,
        dropped: total.dropped + count.dropped,
    });
    let faults: Vec<String> = report.faults.iter().map(ToString::to_string).collect();
    let name = file.display();
    if as_json {
        let value = json!({
            "file": name.to_string(), "whole": faults.is_empty(), "messages": messages,
            "chunks": report.chunks, "lost": total.lost, "dropped": total.dropped,
            "faults": faults, "faults_found": report.faults_found,
            "repeated": repeated, "dates_are_doubtful": is_doubtful(report.begin_ns) && messages > 0,
            "calendar_steps": steps(&report.steps),
        });
        writeln!(out, "{value}")?;
    } else if faults.is_empty() {
        let numbers = match report.is_ours {
            true => format!(
                "every CRC and every number is right; {} lost before the recorder, {} dropped by it",
                total.lost, total.dropped
            ),
            false => "every CRC is right; another program recorded it".to_owned(),
        };
        writeln!(
            out,
            "{name}: {messages} messages in {} chunks, {numbers}",
            report.chunks
        )?;
    } else {
        for fault in &faults {
            writeln!(out, "{name}: {fault}")?;
        }
        let more = report.faults_found - faults.len() as u64;
        if more > 0 {
            writeln!(out, "{name}: and {more} faults more")?;
        }
        writeln!(
            out,
            "{name}: {messages} messages in {} chunks are whole",
            report.chunks
        )?;
    }
    if !as_json && messages > 0 {
        for line in dates(report.begin_ns, &report.steps) {
            writeln!(out, "{name}: {line}")?;
        }
    }
    Ok(faults.is_empty())
}

pub(crate) fn report(bag: &Bag) -> Result<Report, BagError> {
    let mut check = Check::default();
    bag.walk(Learnt::default(), &mut check)?;
    Ok(check.finish())
}
