//! Shared by listener and keeper: the topics with their counts, the queue between them, and their
//! messages to each other.

use std::mem;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lager_journal::{CalendarStep, Count, EnvelopeSchema, Times};

/// How many bytes of messages may wait together.
const QUEUE_BYTES: u64 = 64 << 20;

/// A topic that is recorded.
#[derive(Debug)]
pub(crate) struct Topic {
    pub(crate) name: String,
    pub(crate) schema: EnvelopeSchema,
    /// Whether it carries a state, so that later files repeat its last sample.
    pub(crate) holds: bool,
    received: AtomicU64,
    lost: AtomicU64,
    dropped: AtomicU64,
}

impl Topic {
    pub(crate) fn new(name: &str, schema: EnvelopeSchema, holds: bool) -> Self {
        Self {
            name: name.to_owned(),
            schema,
            holds,
            received: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        }
    }

    pub(crate) fn count(&self) -> Count {
        Count {
            received: self.received.load(Ordering::Relaxed),
            lost: self.lost.load(Ordering::Relaxed),
            dropped: self.dropped.load(Ordering::Relaxed),
        }
    }

    /// Counts a received sample.
    pub(crate) fn receive(&self) {
        self.received.fetch_add(1, Ordering::Relaxed);
    }

    /// Sets how many samples were lost so far.
    pub(crate) fn lose(&self, lost: u64) {
        self.lost.store(lost, Ordering::Relaxed);
    }

    pub(crate) fn drop_one(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

/// The topics, in the order in which they were found. A message names its topic by this place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Topics(Arc<Mutex<Vec<Arc<Topic>>>>);

impl Topics {
    pub(crate) fn add(&self, topic: Topic) -> (usize, Arc<Topic>) {
        let topic = Arc::new(topic);
        let mut all = self.all();
        all.push(Arc::clone(&topic));
        (all.len() - 1, topic)
    }

    pub(crate) fn at(&self, place: usize) -> Arc<Topic> {
        Arc::clone(&self.all()[place])
    }

    /// Counts the samples that still wait as dropped.
    pub(crate) fn drop_waiting(&self, queue: &QueueOut) {
        for item in queue.take(usize::MAX).0 {
            self.at(item.topic).drop_one();
        }
    }

    pub(crate) fn all(&self) -> MutexGuard<'_, Vec<Arc<Topic>>> {
        locked(&self.0)
    }
}

/// The messages between the two, besides samples; all clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notes(Arc<NoteBoard>);

#[derive(Debug, Default)]
struct NoteBoard {
    /// Bytes on the disk, in all files.
    bytes: AtomicU64,
    /// Warnings for a person.
    news: Mutex<Vec<String>>,
    /// When the calendar was set.
    steps: Mutex<Vec<CalendarStep>>,
}

impl Notes {
    pub(crate) fn set_bytes(&self, bytes: u64) {
        self.0.bytes.store(bytes, Ordering::Relaxed);
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.0.bytes.load(Ordering::Relaxed)
    }

    pub(crate) fn tell(&self, news: String) {
        locked(&self.0.news).push(news);
    }

    /// Takes the warnings.
    pub(crate) fn news(&self) -> Vec<String> {
        mem::take(&mut locked(&self.0.news))
    }

    pub(crate) fn step(&self, step: CalendarStep) {
        locked(&self.0.steps).push(step);
    }

    /// Takes the new steps of the calendar.
    pub(crate) fn steps(&self) -> Vec<CalendarStep> {
        mem::take(&mut locked(&self.0.steps))
    }
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A sample on its way to the file.
#[derive(Debug)]
pub(crate) struct Item {
    pub(crate) topic: usize,
    pub(crate) times: Times,
    pub(crate) sequence: u64,
    pub(crate) lost: u64,
    pub(crate) dropped: u64,
    pub(crate) message: Vec<u8>,
}

/// The last sample of a topic that carries a state.
#[derive(Clone, Debug)]
pub(crate) struct Held {
    pub(crate) topic: usize,
    /// When its writer published it, in ns since 1970.
    pub(crate) publish: u64,
    pub(crate) sequence: u64,
    pub(crate) message: Vec<u8>,
}

impl Held {
    pub(crate) fn of(item: &Item) -> Self {
        Self {
            topic: item.topic,
            publish: item.times.publish,
            sequence: item.sequence,
            message: item.message.clone(),
        }
    }
}

/// The listener's end of the queue.
#[derive(Debug)]
pub(crate) struct QueueIn {
    to: SyncSender<Item>,
    waiting: Arc<AtomicU64>,
}

/// The keeper's end.
#[derive(Debug)]
pub(crate) struct QueueOut {
    from: Receiver<Item>,
    waiting: Arc<AtomicU64>,
}

/// A queue for so many samples.
pub(crate) fn queue(samples: usize) -> (QueueIn, QueueOut) {
    let (to, from) = sync_channel(samples);
    let waiting = Arc::new(AtomicU64::new(0));
    let shared = Arc::clone(&waiting);
    (
        QueueIn {
            to,
            waiting: shared,
        },
        QueueOut { from, waiting },
    )
}

impl QueueIn {
    /// Adds a sample, unless the queue is full or the keeper has gone.
    pub(crate) fn put(&self, item: Item) -> bool {
        let bytes = item.message.len() as u64;
        let before = self.waiting.fetch_add(bytes, Ordering::Relaxed);
        let is_in = before + bytes <= QUEUE_BYTES
            && match self.to.try_send(item) {
                Ok(()) => true,
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
            };
        if !is_in {
            self.waiting.fetch_sub(bytes, Ordering::Relaxed);
        }
        is_in
    }
}

impl QueueOut {
    /// Takes the samples that wait, at most so many. The flag says that no more will come.
    pub(crate) fn take(&self, most: usize) -> (Vec<Item>, bool) {
        use std::sync::mpsc::TryRecvError;
        let mut items = Vec::new();
        while items.len() < most {
            match self.from.try_recv() {
                Ok(item) => {
                    let bytes = item.message.len() as u64;
                    self.waiting.fetch_sub(bytes, Ordering::Relaxed);
                    items.push(item);
                }
                Err(TryRecvError::Empty) => return (items, false),
                Err(TryRecvError::Disconnected) => return (items, true),
            }
        }
        (items, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(bytes: usize) -> Item {
        Item {
            topic: 0,
            times: Times { log: 0, publish: 0 },
            sequence: 0,
            lost: 0,
            dropped: 0,
            message: vec![0; bytes],
        }
    }

    #[test]
    fn a_full_queue_takes_no_more_until_something_is_taken() {
        let (to, from) = queue(3);
        let put = [(); 5].map(|()| to.put(item(10)));
        assert_eq!(put, [true, true, true, false, false]);
        assert_eq!(from.take(2).0.len(), 2);
        assert!(to.put(item(1)));
        assert_eq!(from.take(10).0.len(), 2);
        drop(to);
        let (items, is_over) = from.take(10);
        assert!(items.is_empty() && is_over);
    }

    #[test]
    fn a_queue_is_full_of_bytes_too() {
        let (to, from) = queue(1_000);
        let large = QUEUE_BYTES as usize / 2;
        let put = [(); 3].map(|()| to.put(item(large)));
        assert_eq!(put, [true, true, false]);
        from.take(1);
        assert!(to.put(item(large)));
    }
}
