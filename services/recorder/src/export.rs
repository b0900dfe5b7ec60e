//! `bag export --csv`: a table for each topic, for spreadsheets and scripts.
//!
//! A row is a message. A dot joins the names of nested fields, as in `failure.kind`. A list is one
//! cell, as JSON. The first columns are those of the stamp. A file begins with the last earlier
//! sample of each topic that carries a state; these rows come first, with their own numbers and
//! times.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use lager_journal::{Envelope, Selection, Times};
use serde_json::{Value, json};

use crate::bag::{Bag, BagError};

/// The columns in front of the payload's.
const STAMP: &str = "unix_ns,sequence,writer,epoch,source_time_ns,publish_time_ns,lost,dropped";

/// Writes a table for each of `topics` (for all if it is empty) into the folder `to`, and prints
/// their names.
///
/// # Errors
/// The file cannot be read, does not have the topic, or is of another program; or a table cannot be
/// written.
pub fn export_csv(
    file: &Path,
    topics: &[String],
    to: &Path,
    as_json: bool,
    out: &mut impl Write,
) -> Result<(), BagError> {
    let bag = Bag::open(file)?;
    let overview = bag.overview()?;
    bag.must_have(&overview, topics)?;
    // Derived messages are not samples.
    let samples = overview.topics.iter().filter(|topic| !topic.is_derived);
    let wanted = |name: &String| topics.is_empty() || topics.contains(name);
    let wanted = samples.map(|topic| topic.name.clone()).filter(wanted);
    let selection = Selection {
        topics: Some(wanted.collect()),
        ..Selection::default()
    };
    let mut tables: BTreeMap<String, Table<BufWriter<File>>> = BTreeMap::new();
    fs::create_dir_all(to).map_err(|error| failed(to, error))?;
    bag.ordered(&overview, &selection, |placed| {
        let topic = placed.topic;
        if !tables.contains_key(topic) {
            let path = to.join(format!("{}.csv", topic.replace('/', "-")));
            let file = File::create(&path).map_err(|error| failed(&path, error))?;
            let table = Table {
                file: BufWriter::new(file),
                columns: Vec::new(),
                rows: 0,
            };
            tables.insert(topic.to_owned(), table);
        }
        let table = tables.get_mut(topic).expect("just made");
        let written = table.row(placed.times, placed.message);
        written.map_err(|error| failed(to, error))?;
        Ok::<bool, BagError>(true)
    })?;
    for (topic, mut table) in tables {
        table.file.flush().map_err(|error| failed(to, error))?;
        let path = to.join(format!("{}.csv", topic.replace('/', "-")));
        let (path, rows) = (path.display(), table.rows);
        if as_json {
            let value = json!({"topic": topic, "file": path.to_string(), "rows": rows});
            writeln!(out, "{value}")?;
        } else {
            writeln!(out, "{path}: {rows} rows")?;
        }
    }
    Ok(())
}

fn failed(path: &Path, error: io::Error) -> BagError {
    let path = path.to_owned();
    BagError::Write { path, error }
}

struct Table<W> {
    file: W,
    /// The payload's columns, each as a path of names.
    columns: Vec<Vec<String>>,
    rows: u64,
}

impl<W: Write> Table<W> {
    fn row(&mut self, times: Times, message: &[u8]) -> io::Result<()> {
        let Envelope {
            stamp,
            lost,
            dropped,
            payload,
        } = serde_json::from_slice::<Envelope<Value>>(message)?;
        if self.rows == 0 {
            columns(&payload, &mut Vec::new(), &mut self.columns);
            write!(self.file, "{STAMP}")?;
            for column in &self.columns {
                write!(self.file, ",{}", cell(&column.join(".")))?;
            }
            writeln!(self.file)?;
        }
        write!(
            self.file,
            "{},{},{},{},{},{},{lost},{dropped}",
            times.log,
            stamp.sequence,
            stamp.writer,
            stamp.epoch,
            stamp.source_time_ns,
            stamp.publish_time_ns
        )?;
        for column in &self.columns {
            let value = column
                .iter()
                .try_fold(&payload, |value, name| value.get(name));
            let text = match value {
                None | Some(Value::Null) => String::new(),
                Some(Value::String(text)) => cell(text),
                Some(value) => cell(&value.to_string()),
            };
            write!(self.file, ",{text}")?;
        }
        writeln!(self.file)?;
        self.rows += 1;
        Ok(())
    }
}

/// The paths to all values that have no fields.
fn columns(value: &Value, way: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                way.push(name.clone());
                columns(value, way, found);
                way.pop();
            }
        }
        _ => found.push(way.clone()),
    }
}

/// A cell, in quotes if it needs them.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_become_columns_and_lists_cells() {
        let mut table = Table {
            file: Vec::new(),
            columns: Vec::new(),
            rows: 0,
        };
        let stamp = r#"{"sequence":7,"source_time_ns":1,"cause_publish_time_ns":0,
            "cause_receive_time_ns":0,"publish_time_ns":2,"epoch":3,"writer":4,"cause_topic":0}"#;
        for payload in [
            r#"{"a":{"b":1,"c":"x, y"},"list":[1,2],"d":-0.5}"#,
            r#"{"a":{"b":2,"c":"\""},"list":[],"d":null}"#,
        ] {
            let message =
                format!(r#"{{"stamp":{stamp},"lost":5,"dropped":6,"payload":{payload}}}"#);
            let times = Times { log: 9, publish: 9 };
            table.row(times, message.as_bytes()).unwrap();
        }
        assert_eq!(
            String::from_utf8(table.file).unwrap(),
            "unix_ns,sequence,writer,epoch,source_time_ns,publish_time_ns,lost,dropped,a.b,a.c,list,d\n\
             9,7,4,3,1,2,5,6,1,\"x, y\",\"[1,2]\",-0.5\n\
             9,7,4,3,1,2,5,6,2,\"\"\"\",[],\n"
        );
    }
}
