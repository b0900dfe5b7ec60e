//! Other threads wait here for the answers of robots, for the news that robots tell, and for the
//! disk to save a change.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

use lager_lines::{Name, Text};
use lager_orders::{Code, Reason};

use crate::shown::{Reply, Saying};
use crate::station::{RobotSaid, Uses};

/// A robot may tell an event a second time, with the time when it happened. If the two times differ
/// by less than this, the station takes both for the same event.
const SAME: Duration = Duration::from_secs(5);

/// The answer to an action or to a stop, which comes later.
#[derive(Debug)]
pub struct Awaited {
    reply: Receiver<Reply>,
}

impl Awaited {
    /// Waits for the answer, at most for this time. Returns it once. `None` if it has not come, or
    /// has been returned before.
    pub fn wait(&self, timeout: Duration) -> Option<Reply> {
        self.reply.recv_timeout(timeout).ok()
    }
}

/// Tells later whether a warehouse was saved.
#[derive(Debug)]
pub struct Saving {
    saved: Receiver<Result<(), Reason>>,
    kept_in: Option<PathBuf>,
    robots: Vec<Uses>,
}

/// The other end.
pub(crate) type Saved = SyncSender<Result<(), Reason>>;

impl Saving {
    /// Whether the warehouse is saved, or why not. Returned once; `None` if nobody knows it in this
    /// time. A station without a file has nothing to save and answers at once.
    pub fn wait(&self, timeout: Duration) -> Option<Result<(), Reason>> {
        self.saved.recv_timeout(timeout).ok()
    }

    /// Where the warehouse is kept once it is saved, and what each robot does with it.
    pub fn told(&self) -> impl Iterator<Item = Reason> {
        let kept = match &self.kept_in {
            Some(path) => Reason::new(Code::SavedIn, &[&path.display()]),
            None => Code::SavedNowhere.into(),
        };
        std::iter::once(kept).chain(self.robots.iter().map(Reason::from))
    }
}

/// The events and thoughts that robots tell, in their order.
#[derive(Debug)]
pub struct Subscription {
    news: Receiver<RobotSaid>,
    lost: Arc<AtomicU64>,
}

impl Subscription {
    /// How many may wait here. When so many wait, a new one is lost and counted.
    pub const MOST: usize = 1024;

    /// How many the station keeps for [`Handle::recall`](crate::Handle::recall).
    pub const KEPT: usize = 1024;

    /// Waits for the next one, at most for this time. `None` if none has come, or the station has
    /// ended.
    pub fn next(&self, timeout: Duration) -> Option<RobotSaid> {
        self.news.recv_timeout(timeout).ok()
    }

    /// How many were lost because nobody took them in time.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// The station's ends of all of these.
#[derive(Debug, Default)]
pub(crate) struct Outlets {
    replies: BTreeMap<(Name, u32), SyncSender<Reply>>,
    subscribers: Vec<(SyncSender<RobotSaid>, Arc<AtomicU64>)>,
    savings: Vec<Saved>,
    /// The last events and thoughts.
    kept: VecDeque<RobotSaid>,
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

    /// Takes out those who wait for the warehouse.
    pub(crate) fn savings(&mut self) -> Vec<Saved> {
        core::mem::take(&mut self.savings)
    }

    /// Subscribes to what robots tell from now on. With `recalls`, the kept news come first.
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

    /// Turns an event that a robot tells late into news of the time when it happened. `None` if the
    /// robot told it at that time, too.
    fn recalled(&self, news: RobotSaid) -> Vec<RobotSaid> {
        let RobotSaid { robot, at, told } = news;
        let Saying::Past { ago, told } = told else {
            return vec![RobotSaid { robot, at, told }];
        };
        let at = at.saturating_sub(ago);
        let is_it = |other: &RobotSaid| {
            let is_near = other.at.abs_diff(at) < SAME;
            is_near && other.robot == robot && other.told == *told
        };
        if self.kept.iter().any(is_it) {
            return Vec::new();
        }
        let mut news = vec![RobotSaid {
            robot: robot.clone(),
            at,
            told: *told,
        }];
        // The robot does not repeat the sentence. The values say the same.
        if matches!(news[0].told, Saying::Thinks(_)) {
            let told = Saying::Thought(Text::default());
            news.push(RobotSaid { robot, at, told });
        }
        news
    }

    /// Keeps an event, sorted by the time when it happened.
    pub(crate) fn keep(&mut self, news: RobotSaid) {
        let later = self.kept.iter().rev();
        let later = later.take_while(|other| other.at > news.at).count();
        self.kept.insert(self.kept.len() - later, news);
        if self.kept.len() > Subscription::KEPT {
            self.kept.pop_front();
        }
    }

    /// Forgets subscribers that have gone; their queues would keep their memory.
    pub(crate) fn forget_gone(&mut self) {
        // Both ends share the counter.
        self.subscribers
            .retain(|(_, lost)| Arc::strong_count(lost) > 1);
    }

    /// Hands on what robots have told. It waits for nobody.
    pub(crate) fn hand_on(&mut self, news: Vec<RobotSaid>) {
        for news in news
            .into_iter()
            .flat_map(|news| self.recalled(news))
            .collect::<Vec<_>>()
        {
            if let Saying::Replied { number, reply } = news.told {
                if let Some(to) = self.replies.remove(&(news.robot, number)) {
                    // The thread that asked may have given up.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_takes_no_news_any_more_is_forgotten_though_no_robot_speaks() {
        let mut outlets = Outlets::default();
        let stays = outlets.subscribe(false);
        for _ in 0..100 {
            drop(outlets.subscribe(true));
            outlets.forget_gone();
            assert_eq!(outlets.subscribers.len(), 1);
        }
        assert_eq!(stays.lost(), 0);
    }
}
