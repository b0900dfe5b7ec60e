//! [`StopPage`]: the bridge's side of the stop word. It reads the word with one load and writes the
//! bridge's answers beside it.
//!
//! [`Page`] is the page in memory; another thread watches the page's file.

use core::sync::atomic::Ordering;
use std::path::Path;
use std::sync::Arc;

use lager_topics::StopCause;

use super::mapping::Page;
use super::watching::WatchingThread;
use super::{Stop, at, boards};
use crate::StopError;

/// The result of a request to release a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Release {
    /// The stop is released.
    Done(Stop),
    /// No stop was set.
    NotStopped,
    /// Another stop was set meanwhile and stays in force.
    Newer(Stop),
}

/// The stop word, as the one bridge of a robot uses it.
#[derive(Debug)]
pub struct StopPage {
    page: Arc<Page>,
    /// The word that was obeyed last and is in force; 0 = none.
    heeded: u64,
    _watch: WatchingThread,
}

impl StopPage {
    /// The file's name in the robot's folder.
    pub const FILE: &str = "stop";

    /// Opens the robot's file at `path`, makes it if it is missing, and starts a thread that
    /// watches it. It calls `ring` when any process writes to the file, removes or replaces it.
    ///
    /// A file that is cut short or foreign is mended and stops the robot. A missing file stops the
    /// robot only if the bridge is `resumed`, because the earlier bridge had one.
    ///
    /// # Errors
    /// There is no such file and none can be made.
    pub fn open(
        path: &Path,
        resumed: bool,
        ring: impl Fn() + Send + 'static,
    ) -> Result<Self, StopError> {
        let cause = resumed.then_some(StopCause::WordRemoved);
        let page = Arc::new(Page::open(path, cause).map_err(|error| StopError::new(path, &error))?);
        let process = u64::from(std::process::id());
        for place in at::TURN..at::END {
            page.put(place, 0);
        }
        page.put(at::PROCESS, process);
        let watch = WatchingThread::start(Arc::clone(&page), ring);
        Ok(Self {
            page,
            heeded: 0,
            _watch: watch,
        })
    }

    /// A stop that is set and not obeyed yet. Takes one load while there is none.
    ///
    /// If the word was cleared by other means than [`StopPage::release`], sets it again.
    #[inline]
    pub fn news(&self) -> Option<Stop> {
        let word = self.page.word().load(Ordering::Acquire);
        if word == self.heeded {
            return None;
        }
        self.changed(word)
    }

    #[cold]
    fn changed(&self, word: u64) -> Option<Stop> {
        if word == 0 {
            let word = self.page.word();
            let _ = word.compare_exchange(0, self.heeded, Ordering::AcqRel, Ordering::Acquire);
        }
        Stop::of_word(word)
    }

    /// The stop in force.
    pub fn heeded(&self) -> Option<Stop> {
        Stop::of_word(self.heeded)
    }

    /// Sets a stop of the bridge's own, unless one is set that only a resume ends.
    pub fn stop(&self, cause: StopCause) {
        self.page.stop(cause);
    }

    /// Notes that the bridge obeys `stop` from `now_ns` on.
    pub fn heed(&mut self, stop: Stop, now_ns: u64) {
        self.heeded = stop.word();
        self.page.put(at::OBEYED_AT, now_ns / 1_000);
        self.page.put(at::OBEYED, stop.word());
    }

    /// Notes that the steering board has reported wheels at rest at `at_ns`, after the bridge had
    /// written the stop in force to it.
    pub fn rest(&self, at_ns: u64) {
        self.page.put(at::RESTED_AT, at_ns / 1_000);
        self.page.put(at::RESTED, self.heeded);
    }

    /// Notes that the main loop runs.
    #[inline]
    pub fn turn(&self, now_ns: u64) {
        self.page.put(at::TURN, now_ns / 1_000);
    }

    /// Notes the protocol version of each connected board.
    #[inline]
    pub fn boards(&self, sensor: Option<u8>, steering: Option<u8>) {
        self.page.put(at::BOARDS, boards(sensor, steering));
    }

    /// Notes that the steering board has reported these duties at `at_ns`.
    #[inline]
    pub fn report(&self, at_ns: u64, [left, right]: [u8; 2]) {
        self.page
            .put(at::DUTIES, u64::from(left) | u64::from(right) << 8);
        self.page.put(at::REPORTED_AT, at_ns / 1_000);
    }

    /// Clears the word, if it is the word of this stop.
    pub fn release(&mut self, stop: Stop) -> Release {
        let word = self.page.word();
        let cleared = word.compare_exchange(stop.word(), 0, Ordering::AcqRel, Ordering::Acquire);
        let is_heeded = self.heeded == stop.word();
        match cleared {
            Ok(_) => {}
            // Another process has cleared it, and otherwise it would be set again.
            Err(0) if is_heeded => {}
            Err(word) => return Stop::of_word(word).map_or(Release::NotStopped, Release::Newer),
        }
        if is_heeded {
            self.heeded = 0;
        }
        Release::Done(stop)
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};
    use std::time::{Duration, Instant};

    use lager_topics::Role;

    use super::*;
    use crate::tests::Folder;
    use crate::{StopWord, is_whole};

    /// A page without a bus: rings nobody.
    fn page(path: &Path, resumed: bool) -> StopPage {
        let cause = resumed.then_some(StopCause::WordRemoved);
        let page = Arc::new(Page::open(path, cause).unwrap());
        StopPage {
            _watch: WatchingThread::start(Arc::clone(&page), || ()),
            page,
            heeded: 0,
        }
    }

    fn set(path: &Path) -> Stop {
        StopWord::set(path, Role::Operator, StopCause::Ordered).unwrap()
    }

    fn told(path: &Path) -> super::super::StopTold {
        StopWord::read(path).unwrap().expect("a file")
    }

    fn wait_for<T>(mut look: impl FnMut() -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(seen) = look() {
                return seen;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "waited in vain");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_stop_is_news_until_it_is_obeyed_and_holds_until_it_is_released() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let mut page = page(&path, false);
        assert_eq!((page.news(), page.heeded()), (None, None));
        let stop = set(&path);
        assert_eq!(page.news(), Some(stop));
        page.heed(stop, 5_000);
        assert_eq!((page.news(), page.heeded()), (None, Some(stop)));
        assert_eq!(told(&path).obeyed(), Some((stop, 5_000)));
        page.rest(7_000);
        assert_eq!(told(&path).rested(), Some((stop, 7_000)));
        assert_eq!(page.release(stop), Release::Done(stop));
        assert_eq!(page.release(stop), Release::NotStopped);
        assert_eq!((page.news(), page.heeded()), (None, None));
        assert_eq!(told(&path).stop(), None);
    }

    #[test]
    fn a_stop_set_during_a_resume_wins() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let mut page = page(&path, false);
        let first = set(&path);
        page.heed(page.news().unwrap(), 0);
        let newer = set(&path);
        assert_ne!(first, newer);
        assert_eq!(page.release(first), Release::Newer(newer));
        assert_eq!(page.news(), Some(newer));
        assert_eq!(told(&path).stop(), Some(newer));
    }

    #[test]
    fn only_a_release_clears_the_word() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let mut page = page(&path, false);
        let stop = set(&path);
        page.heed(page.news().unwrap(), 0);
        let file = fs::OpenOptions::new().write(true).open(&path).unwrap();
        super::super::put(&file, at::WORD, 0).unwrap();
        assert_eq!(page.news(), None);
        assert_eq!(told(&path).stop(), Some(stop));
    }

    #[test]
    fn a_stop_of_the_bridge_takes_the_place_of_a_fresh_start_and_of_no_other() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let page = page(&path, false);
        let fresh = StopWord::set(&path, Role::Supervisor, StopCause::FreshStart).unwrap();
        assert!(fresh.is_of_fresh_start());
        page.stop(StopCause::BoardResets);
        let fault = told(&path).stop().expect("a stop");
        assert_eq!(fault.cause(), StopCause::BoardResets);
        page.stop(StopCause::StateLost);
        assert_eq!(told(&path).stop(), Some(fault));
        let ordered = set(&path);
        page.stop(StopCause::BoardResets);
        assert_eq!(told(&path).stop(), Some(ordered));
    }

    #[test]
    fn a_stop_outlives_its_bridge() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        drop(page(&path, false));
        let stop = set(&path);
        for resumed in [false, true] {
            assert_eq!(page(&path, resumed).news(), Some(stop));
        }
    }

    #[test]
    fn a_missing_file_stops_a_successor_alone() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        assert_eq!(page(&path, false).news(), None);
        fs::remove_file(&path).unwrap();
        let news = page(&path, true).news().expect("a stop");
        assert_eq!(news.cause(), StopCause::WordRemoved);
        assert_eq!(news.origin(), Some(Role::Bridge));
    }

    #[test]
    fn a_damaged_file_stops_any_bridge() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        for contents in [&b""[..], b"\0\0\0", &[0; 4096], &[0x5A; 4096]] {
            fs::write(&path, contents).unwrap();
            let news = page(&path, false).news().expect("a stop");
            assert_eq!(news.cause(), StopCause::WordDamaged);
            assert!(is_whole(&File::open(&path).unwrap()).unwrap());
        }
    }

    #[test]
    fn a_file_removed_replaced_or_cut_short_stops_the_robot_and_is_there_again() {
        type Harm = fn(&Path);
        let harms: [(Harm, StopCause); 4] = [
            (
                |path| fs::remove_file(path).unwrap(),
                StopCause::WordRemoved,
            ),
            (
                |path| {
                    // The page may make its file anew while the folder is being emptied.
                    let again = std::io::ErrorKind::DirectoryNotEmpty;
                    let remove = || fs::remove_dir_all(path.parent().unwrap());
                    while remove().is_err_and(|error| error.kind() == again) {}
                },
                StopCause::WordRemoved,
            ),
            (
                |path| {
                    let other = path.with_extension("other");
                    fs::write(&other, [0; 10]).unwrap();
                    fs::rename(other, path).unwrap();
                },
                StopCause::WordDamaged,
            ),
            (
                |path| {
                    let folder = path.parent().unwrap();
                    fs::rename(folder, folder.with_extension("moved")).unwrap();
                },
                StopCause::WordRemoved,
            ),
        ];
        for (harm, cause) in harms {
            let folder = Folder::new();
            let path = folder.path().join("bus").join("robot").join("stop");
            let mut page = page(&path, false);
            // Twice: what was put in its place is watched as well.
            for _ in 0..2 {
                harm(&path);
                // In memory and in the file at the path.
                let news = wait_for(|| {
                    let news = page.news()?;
                    let file = StopWord::read(&path).unwrap()?.stop();
                    (file == Some(news)).then_some(news)
                });
                assert_eq!(news.cause(), cause);
                page.heed(news, 1);
                assert_eq!(page.release(news), Release::Done(news));
                // Only now it is certain that a thread watches the new file.
                let stop = wait_for(|| {
                    set(&path);
                    page.news()
                });
                page.heed(stop, 2);
                page.release(stop);
                let _ = fs::remove_dir_all(folder.path().join("bus").join("robot.moved"));
            }
        }
    }

    #[test]
    fn a_stop_set_in_the_file_that_took_the_place_is_the_one_that_counts() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let page = page(&path, false);
        let other = folder.path().join("other");
        let stop = set(&other);
        fs::rename(&other, &path).unwrap();
        assert_eq!(wait_for(|| page.news()), stop);
    }

    #[test]
    fn whoever_reads_while_the_file_is_replaced_reads_a_page() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let page = page(&path, false);
        let end = core::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            let reader = scope.spawn(|| {
                let mut stops = 0_u64;
                while !end.load(Ordering::Relaxed) {
                    stops += u64::from(page.news().is_some());
                    page.turn(1);
                }
                stops
            });
            for _ in 0..200 {
                let _ = fs::remove_file(&path);
                wait_for(|| StopWord::read(&path).unwrap()?.stop());
            }
            end.store(true, Ordering::Relaxed);
            assert!(reader.join().unwrap() > 0);
        });
    }
}
