//! [`Wakeful`]: how a tool waits that shows each sample. Where it can be woken it is; elsewhere it
//! looks.

use std::time::{Duration, Instant};

use lager_ports::{Source, Watcher};

use crate::origin::Origin;
use crate::{ToolError, Tools};

/// The longest wait of a tool that is woken. A request to end comes without a ring.
const LONGEST: Duration = Duration::from_millis(50);

/// Waits for the samples of one source.
pub(crate) struct Wakeful {
    /// `None` where nobody rings, as on another computer.
    watcher: Option<Watcher>,
    /// The time between two looks where nobody rings.
    look: Duration,
    /// The shortest time between two wakes. What comes meanwhile is taken together.
    rest: Duration,
    woken: Option<Instant>,
}

impl Wakeful {
    /// For the samples of `from`, which `tools` has opened.
    pub(crate) fn new<W, P: Origin>(
        tools: &Tools<'_, W, P>,
        from: &impl Source,
        look: Duration,
        rest: Duration,
    ) -> Result<Self, ToolError> {
        let make = || tools.place.watcher();
        let mut watcher = tools
            .watchdog
            .over("asking to be woken", make)
            .map_err(Into::into)?;
        if let Some(watcher) = &mut watcher {
            from.wakes(watcher);
        }
        Ok(Self {
            watcher,
            look,
            rest,
            woken: None,
        })
    }

    /// Waits for the next sample, at most `most` and never much longer than a person would wait.
    pub(crate) fn wait(&mut self, most: Duration) {
        let Some(watcher) = &mut self.watcher else {
            std::thread::sleep(self.look.min(most));
            return;
        };
        let rest = match self.woken {
            Some(woken) => self.rest.saturating_sub(woken.elapsed()),
            None => Duration::ZERO,
        };
        if !rest.is_zero() {
            std::thread::sleep(rest);
        }
        watcher.wait(LONGEST.min(most));
        self.woken = Some(Instant::now());
    }
}
