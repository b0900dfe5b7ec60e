//! What other threads wait for: answers of robots, what robots say unasked, and what the disk
//! takes.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

use lager_lines::{Name, Text};

use crate::shown::{Reply, Told};
use crate::station::{News, Uses};

/// What a robot tells of earlier is what it told then, if that was so near to it: it is counted from
/// when each was read.
const SAME: Duration = Duration::from_secs(5);

/// The answer to an action or to a stop, which comes later.
#[derive(Debug)]
pub struct Awaited {
    reply: Receiver<Reply>,
}

impl Awaited {
    /// The answer, once; `None` if it does not come in this time, or has been taken.
    pub fn wait(&self, timeout: Duration) -> Option<Reply> {
        self.reply.recv_timeout(timeout).ok()
    }
}

/// Whether a warehouse has been saved, which comes later.
#[derive(Debug)]
pub struct Saving {
    saved: Receiver<Result<(), String>>,
    kept_in: Option<PathBuf>,
    robots: Vec<Uses>,
}

/// The other end.
pub(crate) type Saved = SyncSender<Result<(), String>>;

impl Saving {
    /// That it is saved, or why not, once; `None` if that is not known in this time, or has been
    /// taken. A station without a file has nothing to save, and is done.
    pub fn wait(&self, timeout: Duration) -> Option<Result<(), String>> {
        self.saved.recv_timeout(timeout).ok()
    }

    /// Where it is kept once it is saved, and what robots do with it, in a sentence.
    pub fn sentence(&self) -> String {
        let mut sentence = match &self.kept_in {
            Some(path) => format!("saved in {}", path.display()),
            None => "taken, and lost when the station ends".to_owned(),
        };
        for uses in &self.robots {
            sentence.push_str(&format!("; {uses}"));
        }
        sentence
    }
}

/// What robots say: events and thoughts, in their order.
#[derive(Debug)]
pub struct Subscription {
    news: Receiver<News>,
    lost: Arc<AtomicU64>,
}

impl Subscription {
    /// What may wait to be taken; what comes then is lost, and counted.
    pub const MOST: usize = 1024;

    /// What is kept of what was said, for [`Handle::recall`](crate::Handle::recall).
    pub const KEPT: usize = 1024;

    /// The next one; `None` if there is none in this time, or the station has ended.
    pub fn next(&self, timeout: Duration) -> Option<News> {
        self.news.recv_timeout(timeout).ok()
    }

    /// How many were lost since nobody took them.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// The other ends of all of these.
#[derive(Debug, Default)]
pub(crate) struct Outlets {
    replies: BTreeMap<(Name, u32), SyncSender<Reply>>,
    subscribers: Vec<(SyncSender<News>, Arc<AtomicU64>)>,
    savings: Vec<Saved>,
    /// What was said last.
    kept: VecDeque<News>,
}

impl Outlets {
    /// Waits for a robot's answer to this number.
    pub(crate) fn wait(&mut self, robot: &Name, number: u32) -> Awaited {
        let (to, reply) = sync_channel(1);
        self.replies.insert((robot.clone(), number), to);
        Awaited { reply }
    }

    /// Waits until the warehouse of this moment is saved.
    pub(crate) fn save(&mut self, kept_in: Option<PathBuf>, robots: Vec<Uses>) -> Saving {
        let (to, saved) = sync_channel(1);
        self.savings.push(to);
        Saving {
            saved,
            kept_in,
            robots,
        }
    }

    /// Who waits for that; it is then no longer here.
    pub(crate) fn savings(&mut self) -> Vec<Saved> {
        core::mem::take(&mut self.savings)
    }

    /// What is said from now on, and before it what is kept, if `recalls`.
    pub(crate) fn subscribe(&mut self, recalls: bool) -> Subscription {
        let before = if recalls { self.kept.len() } else { 0 };
        let (to, news) = sync_channel(Subscription::MOST + before);
        for news in self.kept.iter().take(before) {
            // There is room for all of it.
            let _ = to.try_send(news.clone());
        }
        let lost = Arc::new(AtomicU64::new(0));
        self.subscribers.push((to, Arc::clone(&lost)));
        Subscription { news, lost }
    }

    /// What a robot has told of earlier, as news of when it was; nothing if it was told then, too.
    fn recalled(&self, news: News) -> Vec<News> {
        let News { robot, at, told } = news;
        let Told::Past { ago, told } = told else {
            return vec![News { robot, at, told }];
        };
        let at = at.saturating_sub(ago);
        let is_it = |other: &News| {
            let is_near = other.at.abs_diff(at) < SAME;
            is_near && other.robot == robot && other.told == *told
        };
        if self.kept.iter().any(is_it) {
            return Vec::new();
        }
        let mut news = vec![News {
            robot: robot.clone(),
            at,
            told: *told,
        }];
        // Its words are not told again, and its values say it all.
        if matches!(news[0].told, Told::Thinks(_)) {
            let told = Told::Thought(Text::default());
            news.push(News { robot, at, told });
        }
        news
    }

    /// Keeps what was said, by when it was.
    fn keep(&mut self, news: News) {
        let later = self.kept.iter().rev();
        let later = later.take_while(|other| other.at > news.at).count();
        self.kept.insert(self.kept.len() - later, news);
        if self.kept.len() > Subscription::KEPT {
            self.kept.pop_front();
        }
    }

    /// Hands on what robots have said. It waits for nobody.
    pub(crate) fn hand_on(&mut self, news: Vec<News>) {
        for news in news
            .into_iter()
            .flat_map(|news| self.recalled(news))
            .collect::<Vec<_>>()
        {
            if let Told::Replied { number, reply } = news.told {
                if let Some(to) = self.replies.remove(&(news.robot, number)) {
                    // Whoever has asked may have given up.
                    let _ = to.try_send(reply);
                }
                continue;
            }
            self.keep(news.clone());
            self.subscribers
                .retain(|(to, lost)| match to.try_send(news.clone()) {
                    Ok(()) => true,
                    Err(TrySendError::Full(_)) => {
                        lost.fetch_add(1, Ordering::Relaxed);
                        true
                    }
                    Err(TrySendError::Disconnected(_)) => false,
                });
        }
    }
}
