//! Notifies listeners of plain iceoryx2, which know nothing of this project's bell boards.
//!
//! Beside each topic stands an event service of the same name. The writer notifies a program that
//! listens there of every sample, at the cost of one system call for each listener. While there is
//! no listener, the writer only reads a number in shared memory (`anyone`).

use iceoryx2::port::notifier::{Notifier, NotifierCreateError};

use super::anyone::Listeners;
use crate::bus::Bus;
use crate::error::PortError;
use crate::kind::Kind;
use crate::patience::{Fault, patiently};
use crate::service::{self, EventService};
use crate::transport::Ipc;

/// The listeners of one topic, as a writer sees them.
pub(crate) struct StandardListeners {
    listeners: Listeners,
    _service: EventService,
    notifier: Notifier<Ipc>,
}

impl StandardListeners {
    pub(crate) fn of(bus: &Bus, kind: &Kind) -> Result<Self, PortError> {
        let service = service::event(bus, kind)?;
        let notifier = patiently(bus, kind.name, || {
            service
                .notifier_builder()
                .name(bus.port_name())
                .create()
                .map_err(|error| match error {
                    NotifierCreateError::ExceedsMaxSupportedNotifiers => {
                        Fault::Full(PortError::TooManyWriters {
                            topic: kind.name.to_owned(),
                            limit: kind.qos.max_publishers(),
                        })
                    }
                    other => service::no_resources(kind.name, other),
                })
        })?;
        Ok(Self {
            listeners: Listeners::of(&service),
            _service: service,
            notifier,
        })
    }

    /// Notifies all listeners, if there are any.
    #[inline]
    pub(crate) fn notify(&self) {
        if self.listeners.is_there() {
            // A listener that has died or whose queue is full needs no notice.
            let _ = self.notifier.notify();
        }
    }
}
