//! Spans of the log: a mission from its first order until none is left, and each order of it.
//! Logic's log lines carry the spans that last at that time. They change with the queue, never with
//! a frame.

use lager_topics::OrderQueue;
use tracing::span::EnteredSpan;

/// The spans that last.
#[derive(Default)]
pub(crate) struct Traced {
    order: Option<(u32, EnteredSpan)>,
    mission: Option<EnteredSpan>,
}

impl Traced {
    /// Follows the queue as it is now.
    pub(crate) fn follow(&mut self, queue: &OrderQueue) {
        let under_way = (queue.under_way != 0).then_some(queue.order_id);
        let known = self.order.as_ref().map(|(id, _)| *id);
        if known != under_way {
            // The inner span ends first.
            self.order = None;
        }
        let is_mission = under_way.is_some() || queue.count > 0;
        if !is_mission {
            self.mission = None;
        } else if self.mission.is_none() {
            self.mission = Some(tracing::info_span!("mission").entered());
        }
        if let Some(id) = under_way.filter(|id| known != Some(*id)) {
            let span = tracing::info_span!("order", id, product = queue.product);
            self.order = Some((id, span.entered()));
        }
    }
}
