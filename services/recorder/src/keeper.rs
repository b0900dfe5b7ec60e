//! The thread that writes: it takes what the listener has queued, and lets it survive.
//!
//! It sleeps for a flush period and then writes all that has come. So it costs few wake-ups, and a
//! disk that is slow for a while fills the queue and nothing else. What it takes at once it sorts
//! by time, so that a file is in order except across two flushes.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use lager_journal::{Scene, Start};

use crate::config::RecordConfig;
use crate::error::RecordError;
use crate::part::{Part, Refused};
use crate::tally::{Item, QueueOut, Topics};

/// So many samples are taken at a time.
const BATCH: usize = 20_000;

/// What a topic lacked when a file began, and by the last sample that is in it.
#[derive(Clone, Copy, Default)]
struct Missing {
    before: (u64, u64),
    now: (u64, u64),
}

/// What is left of a keeper.
pub(crate) struct Kept {
    /// Its files.
    pub(crate) files: Vec<PathBuf>,
    /// What ended the recording early.
    pub(crate) result: Result<(), RecordError>,
    /// Its end of the queue, into which the listener may still have put samples.
    pub(crate) from: QueueOut,
}

/// Writes the files of one recording.
pub(crate) struct Keeper {
    config: RecordConfig,
    start: Start,
    topics: Topics,
    from: QueueOut,
    bytes: Arc<AtomicU64>,
    part: Part,
    ended: Vec<PathBuf>,
    /// Bytes of the files that are ended.
    ended_bytes: u64,
    missing: HashMap<usize, Missing>,
    /// What viewers are shown.
    scene: Scene,
}

impl Keeper {
    /// Begins the first file.
    pub(crate) fn new(
        config: &RecordConfig,
        start: Start,
        topics: &Topics,
        from: QueueOut,
        bytes: &Arc<AtomicU64>,
    ) -> Result<Self, RecordError> {
        Ok(Self {
            part: Part::begin(&config.path(0), &start, topics)?,
            config: config.clone(),
            start,
            topics: topics.clone(),
            from,
            bytes: Arc::clone(bytes),
            ended: Vec::new(),
            ended_bytes: 0,
            missing: HashMap::new(),
            scene: Scene::default(),
        })
    }

    /// Writes until the listener has ended, or it cannot go on.
    pub(crate) fn run(mut self) -> Kept {
        let result = loop {
            let flush = Instant::now() + self.config.flush;
            let (items, is_over) = self.from.take(BATCH);
            let is_behind = items.len() == BATCH;
            match self.write(items) {
                Ok(()) if is_over => break Ok(()),
                Ok(()) => {}
                Err(error) => break Err(error),
            }
            if !is_behind {
                // The listener wakes it at the end.
                std::thread::park_timeout(flush.saturating_duration_since(Instant::now()));
            }
        };
        let mut files = std::mem::take(&mut self.ended);
        files.push(self.part.path().to_owned());
        self.topics.drop_waiting(&self.from);
        // What could not be written cannot be ended either.
        let (from, ended) = match &result {
            Err(RecordError::Write { .. }) => (self.from, Ok(())),
            _ => self.end(),
        };
        Kept {
            files,
            result: result.and(ended),
            from,
        }
    }

    fn write(&mut self, mut items: Vec<Item>) -> Result<(), RecordError> {
        items.sort_by_key(|item| item.times.log);
        for (place, item) in items.iter().enumerate() {
            match self.part.write(item, &mut self.scene) {
                Ok(()) => {}
                Err(Refused::Failed(error)) => return Err(error),
                Err(Refused::Full) => {
                    for item in &items[place..] {
                        self.topics.at(item.topic).drop_one();
                    }
                    return Err(RecordError::Full {
                        path: self.part.path().to_owned(),
                    });
                }
            }
            let missing = self.missing.entry(item.topic).or_default();
            missing.now = (item.lost, item.dropped);
        }
        self.part.flush()?;
        let length = self.part.length();
        self.bytes
            .store(self.ended_bytes + length, Ordering::Relaxed);
        if self.config.split.is_due(length, self.part.age()) {
            self.next_part()?;
        }
        Ok(())
    }

    /// Ends this file and begins the next one. The queue holds what comes meanwhile.
    fn next_part(&mut self) -> Result<(), RecordError> {
        self.start.part += 1;
        let next = self.config.path(self.start.part);
        let next = Part::begin(&next, &self.start, &self.topics)?;
        let part = std::mem::replace(&mut self.part, next);
        self.ended.push(part.path().to_owned());
        let told = self.missing.iter();
        let told = told.map(|(place, missing)| (*place, since(missing.before, missing.now)));
        self.ended_bytes += part.end(&told.collect())?;
        for missing in self.missing.values_mut() {
            missing.before = missing.now;
        }
        Ok(())
    }

    /// Ends the last file, with what was missed up to the listener's end.
    fn end(self) -> (QueueOut, Result<(), RecordError>) {
        let topics = self.topics.all().clone();
        let told = topics.iter().enumerate().map(|(place, topic)| {
            let count = topic.count();
            let missing = self.missing.get(&place).copied().unwrap_or_default();
            (place, since(missing.before, (count.lost, count.dropped)))
        });
        let told = told.collect();
        let ended = self.part.end(&told).map(|length| {
            self.bytes
                .store(self.ended_bytes + length, Ordering::Relaxed);
        });
        (self.from, ended)
    }
}

fn since(before: (u64, u64), now: (u64, u64)) -> (u64, u64) {
    (
        now.0.saturating_sub(before.0),
        now.1.saturating_sub(before.1),
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use lager_journal::{Envelope, EnvelopeSchema, Times};
    use lager_topics::{Description, LineFrame, Stamp};

    use super::*;
    use crate::Split;
    use crate::tally::{Topic, queue};

    #[test]
    fn what_waits_when_no_next_file_can_be_made_is_counted_as_dropped() {
        let folder = std::env::temp_dir().join(format!("lager-keeper-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        // The second file is there already.
        std::fs::write(folder.join("tour-001.mcap"), "").expect("a file");
        let config = RecordConfig {
            file: folder.join("tour.mcap"),
            topics: Vec::new(),
            split: Split {
                bytes: Some(1),
                time: None,
            },
            queue: 0,
            flush: Duration::ZERO,
        };
        let topics = Topics::default();
        let schema = EnvelopeSchema::of(&Description::of::<LineFrame>());
        let (_, topic) = topics.add(Topic::new("sensor/line", schema));
        let (to, from) = queue(BATCH + 7);
        for number in 0..BATCH as u64 + 7 {
            let envelope = Envelope {
                stamp: Stamp {
                    sequence: number,
                    ..Stamp::default()
                },
                lost: 0,
                dropped: 0,
                payload: LineFrame::default(),
            };
            let item = Item {
                topic: 0,
                times: Times { log: 0, publish: 0 },
                sequence: number,
                lost: 0,
                dropped: 0,
                message: serde_json::to_vec(&envelope).expect("JSON"),
            };
            topic.receive();
            assert!(to.put(item));
        }
        let bytes = Arc::new(AtomicU64::new(0));
        let keeper = Keeper::new(&config, Start::default(), &topics, from, &bytes);
        let kept = keeper.expect("a file").run();
        assert!(
            matches!(kept.result, Err(RecordError::Exists { .. })),
            "{:?}",
            kept.result
        );
        assert_eq!(
            (topic.count().received, topic.count().dropped),
            (BATCH as u64 + 7, 7)
        );
        let mut said = Vec::new();
        let is_right = crate::check(&kept.files[0], false, &mut said).expect("a file");
        let said = String::from_utf8(said).expect("text");
        assert!(is_right && said.contains("7 dropped by it"), "{said}");
        std::fs::remove_dir_all(folder).expect("our own folder");
    }
}
