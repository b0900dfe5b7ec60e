//! [`Lives`]: which services have ended and which are back, from what their supervisor writes.

use std::collections::HashMap;

use lager_home::Watched;
use lager_lines::extension::Happened;

/// A service that has run for this long, in ns, is back. So one that dies at every start has ended
/// once, and has not come back.
const BACK: u64 = 1_000_000_000;

/// What is known of each service.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lives(HashMap<String, Life>);

#[derive(Clone, Copy, Debug)]
struct Life {
    restarts: u32,
    /// It has ended, and is not back yet.
    has_ended: bool,
}

impl Lives {
    /// What has happened since the last call, with the service. A service that is seen for the first
    /// time has not been started again, whatever its supervisor counts.
    pub(crate) fn look(&mut self, now_ns: u64, services: &[Watched]) -> Vec<(Happened, String)> {
        let mut news = Vec::new();
        for service in services {
            let life = self.0.entry(service.name.clone()).or_insert(Life {
                restarts: service.restarts,
                has_ended: false,
            });
            let runs_ns = (service.pid).map(|_| now_ns.saturating_sub(service.since_ns));
            let is_another = life.restarts != service.restarts;
            if !life.has_ended && (is_another || runs_ns.is_none()) {
                life.has_ended = true;
                news.push((Happened::Ended, service.name.clone()));
            }
            life.restarts = service.restarts;
            if life.has_ended && runs_ns.is_some_and(|runs_ns| runs_ns >= BACK) {
                life.has_ended = false;
                news.push((Happened::Restarted, service.name.clone()));
            }
        }
        news
    }
}
