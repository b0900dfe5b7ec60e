//! Measurements in files: `NAME.json` with all figures and the histogram of each run, and `NAME.hlog`
//! with the histograms in HdrHistogram's log format, for its own tools. `lager bench compare` reads
//! the first.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{IntervalLogWriterBuilder, Tag};
use serde::{Deserialize, Serialize};

use crate::report::{Report, Row};
use crate::rounds::Run;
use crate::stats::Distribution;
use lager_machine::{Conditions, Machine};

/// The number of this layout; a later one that reads differently has another.
const LAYOUT: u32 = 1;

/// Why a file was not written or read.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The file system refused it, with its own message.
    #[error("{0}: {1}; name a file in a folder that exists and may be written to")]
    Write(PathBuf, std::io::Error),
    /// It cannot be read, with the system's own message.
    #[error("{0}: {1}; name a file that `lager bench … --out NAME` wrote")]
    Read(PathBuf, std::io::Error),
    /// It is no saved measurement.
    #[error(
        "{0}: this is no saved measurement ({1}); name a file that `lager bench … --out NAME` wrote"
    )]
    Wrong(PathBuf, String),
}

/// A measurement with the histograms of its runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    layout: u32,
    /// The version of the program that measured.
    pub version: String,
    /// When it was saved, in seconds since 1970.
    pub unix_s: u64,
    /// Where it was measured.
    pub machine: Machine,
    /// What that machine was set to, and what else it did.
    pub conditions: Option<Conditions>,
    /// The rows.
    pub rows: Vec<SavedRow>,
}

/// A row with its runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedRow {
    /// The figures.
    #[serde(flatten)]
    pub row: Row,
    /// What they were read off.
    pub runs: Vec<Run>,
}

impl Saved {
    /// A measurement of now.
    #[must_use]
    pub fn new(machine: Machine, rows: Vec<SavedRow>) -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        Self {
            layout: LAYOUT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            unix_s: now.unwrap_or_default().as_secs(),
            machine,
            conditions: None,
            rows,
        }
    }

    /// The rows of a report that was just measured here.
    #[must_use]
    pub fn of(report: &Report) -> Self {
        let row = |row: &Row| SavedRow {
            runs: row.runs.clone(),
            row: row.clone(),
        };
        Self {
            conditions: report.conditions.clone(),
            ..Self::new(Machine::here(), report.rows.iter().map(row).collect())
        }
    }

    /// Writes both files; returns their paths.
    ///
    /// # Errors
    /// See [`SaveError::Write`].
    pub fn write(&self, name: &Path) -> Result<[PathBuf; 2], SaveError> {
        let paths = ["json", "hlog"].map(|ending| ending_in(name, ending));
        let json = serde_json::to_string(self).expect("names, numbers and text") + "\n";
        for (path, bytes) in paths.iter().zip([json.into_bytes(), self.log()]) {
            let written = fs::File::create(path).and_then(|mut file| {
                file.write_all(&bytes)?;
                file.sync_all()
            });
            written.map_err(|error| SaveError::Write(path.clone(), error))?;
        }
        Ok(paths)
    }

    /// Reads a file that [`Saved::write`] has written.
    ///
    /// # Errors
    /// See [`SaveError`].
    pub fn read(path: &Path) -> Result<Self, SaveError> {
        let wrong = |why: String| SaveError::Wrong(path.to_owned(), why);
        let text =
            fs::read_to_string(path).map_err(|error| SaveError::Read(path.to_owned(), error))?;
        let saved: Self = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        match saved.layout {
            LAYOUT => Ok(saved),
            other => Err(wrong(format!(
                "its layout is {other}, and this program reads {LAYOUT}"
            ))),
        }
    }

    /// The histograms, each with its row as a tag and its run's time.
    fn log(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut serializer = V2DeflateSerializer::new();
        let began = UNIX_EPOCH + Duration::from_secs(self.unix_s);
        let mut log = IntervalLogWriterBuilder::new()
            .add_comment(&format!("{}; values in ns", self.machine))
            .with_start_time(began)
            .begin_log_with(&mut bytes, &mut serializer)
            .expect("a vector takes every byte");
        for SavedRow { row, runs } in &self.rows {
            for run in runs {
                for (kind, times) in [("response", &run.response), ("service", &run.service)] {
                    if *times == Distribution::default() {
                        continue;
                    }
                    // A tag has no space and no comma.
                    let label = row.label().replace([' ', ','], "-");
                    let tag = format!("{}/{}/{}/{label}/{kind}", row.what, row.mode, row.regime);
                    let [from, took] = [run.from_s, run.took_s].map(Duration::from_secs_f64);
                    log.write_histogram(times.histogram(), from, took, Tag::new(&tag))
                        .expect("a vector takes every byte");
                }
            }
        }
        bytes
    }
}

/// `name` with that ending, once.
fn ending_in(name: &Path, ending: &str) -> PathBuf {
    let known = name
        .extension()
        .is_some_and(|end| end == "json" || end == "hlog");
    match known {
        true => name.with_extension(ending),
        false => {
            let mut whole = name.as_os_str().to_owned();
            whole.push(format!(".{ending}"));
            whole.into()
        }
    }
}

#[cfg(test)]
mod tests {
    use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};

    use super::*;
    use crate::report::{Mode, Regime};

    fn saved() -> Saved {
        let times: Distribution = (0..2_000).map(|time| time * 3).collect();
        let run = Run {
            service: times.clone(),
            response: (0..2_000).collect(),
            from_s: 1.5,
            took_s: 0.25,
            ..Run::default()
        };
        let label = "lager/8 observers";
        let mut row = Row::new("path", label, Mode::Block, Regime::Plain, times.quantiles());
        row.runs = vec![run.clone(), run];
        Saved::of(&Report {
            machine: String::new(),
            conditions: None,
            rows: vec![row],
        })
    }

    #[test]
    fn what_is_written_is_read_again() {
        let folder = std::env::temp_dir().join(format!("lager-saved-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let mut saved = saved();
        for name in ["one", "one.json", "with.dot"] {
            let [json, hlog] = saved.write(&folder.join(name)).unwrap();
            assert_eq!(json.with_extension("hlog"), hlog);
            let again = Saved::read(&json).unwrap();
            // A row of a file keeps its runs beside it.
            saved.rows[0].row.runs.clear();
            assert_eq!(again, saved);
        }
        let cut = folder.join("cut.json");
        let whole = fs::read_to_string(folder.join("one.json")).unwrap();
        for (text, words) in [
            (&whole[..whole.len() / 2], "no saved measurement"),
            ("", "no saved measurement"),
            (
                &whole.replace("\"layout\":1", "\"layout\":9"),
                "layout is 9",
            ),
        ] {
            fs::write(&cut, text).unwrap();
            let said = Saved::read(&cut).unwrap_err().to_string();
            assert!(said.contains(words) && said.contains("cut.json"), "{said}");
        }
        let said = Saved::read(&folder.join("none")).unwrap_err().to_string();
        assert!(said.contains("--out"), "{said}");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn the_log_is_hdrhistograms() {
        let log = saved().log();
        let entries: Vec<LogEntry> = IntervalLogIterator::new(&log).map(Result::unwrap).collect();
        let tags: Vec<&str> = entries
            .iter()
            .filter_map(|entry| match entry {
                LogEntry::Interval(interval) => {
                    assert_eq!(interval.start_timestamp(), Duration::from_millis(1_500));
                    assert_eq!(interval.duration(), Duration::from_millis(250));
                    Some(interval.tag().unwrap().as_str())
                }
                _ => None,
            })
            .collect();
        let [response, service] = ["response", "service"]
            .map(|kind| format!("path/block/plain/lager/8-observers/{kind}"));
        assert_eq!(tags, [&response, &service, &response, &service]);
    }
}
