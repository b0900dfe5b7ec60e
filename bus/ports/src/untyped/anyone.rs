//! [`Anyone`]: whether a service has any reader or listener. Writers ask this for every sample.
//!
//! To count a service's ports, iceoryx2 visits all their places. The 74 places of a topic's readers
//! and the 16 of its listeners took 600 of the 2 957 instructions of `publish/to-1`. Beside the
//! places lies a number that changes whenever a port comes or goes, which iceoryx2's own ports also
//! use. So this file counts the ports only when that number has changed.
//!
//! **Invariant:** a port that its owner can use is always seen. iceoryx2 changes the number when
//! the port has its place, before it hands the port to its owner.
//!
//! The list of ports is private to iceoryx2. It is the first field of `DynamicConfig`, which is
//! `repr(C)` because processes share it. The workspace fixes the exact version of iceoryx2.

use core::cell::{Cell, RefCell};
use core::ptr::NonNull;

use iceoryx2::prelude::PortFactory;
use iceoryx2::service::Service;
use iceoryx2::service::dynamic_config::event::{self, ListenerDetails, NotifierDetails};
use iceoryx2::service::dynamic_config::publish_subscribe::{
    self, PublisherDetails, SubscriberDetails,
};
use iceoryx2_cal::bag::{BagFamily, BagType};

use crate::service::{EventService, TopicService};
use crate::transport::Ipc;

type Bags = <Ipc as Service>::Bag;
type List<T> = <Bags as BagFamily>::Bag<T>;

/// Whether a service has ports of one kind; lives no longer than the service.
pub(super) struct Anyone<T: BagType> {
    list: NonNull<List<T>>,
    /// The state of the list when it was last read.
    seen: RefCell<<Bags as BagFamily>::BagState<T>>,
    is_there: Cell<bool>,
}

/// Readers of a topic's service.
pub(super) type Readers = Anyone<SubscriberDetails>;

/// Listeners of the event beside a topic.
pub(super) type Listeners = Anyone<ListenerDetails>;

impl Readers {
    pub(super) fn of(service: &TopicService) -> Self {
        type Config = publish_subscribe::DynamicConfig<Bags>;
        const _: () = assert!(
            size_of::<Config>()
                == size_of::<List<SubscriberDetails>>() + size_of::<List<PublisherDetails>>(),
            "iceoryx2 keeps something else beside the lists of ports"
        );
        let config: &Config = service.dynamic_config();
        Self::on(NonNull::from(config).cast())
    }
}

impl Listeners {
    pub(super) fn of(service: &EventService) -> Self {
        type Config = event::DynamicConfig<Bags>;
        const _: () = assert!(
            size_of::<Config>()
                == size_of::<List<ListenerDetails>>()
                    + size_of::<List<NotifierDetails>>()
                    + size_of::<u64>(),
            "iceoryx2 keeps something else beside the lists of ports"
        );
        let config: &Config = service.dynamic_config();
        Self::on(NonNull::from(config).cast())
    }
}

impl<T: BagType> Anyone<T> {
    fn on(list: NonNull<List<T>>) -> Self {
        // SAFETY: see the head of this file. The caller has the service open, so it is initialised.
        let list_now = unsafe { list.as_ref() };
        Self {
            list,
            // SAFETY: as above.
            seen: RefCell::new(unsafe { list_now.get_state() }),
            // Counted after the number was read: a port that comes in between changes it again.
            is_there: Cell::new(!list_now.is_empty()),
        }
    }

    /// Whether there is a port. A killed process's port counts until a sweep removes it.
    #[inline(always)]
    pub(super) fn is_there(&self) -> bool {
        // SAFETY: the service that owns the list is open, and the state belongs to this list.
        let (list, changed) = unsafe {
            let list = self.list.as_ref();
            (list, list.update_state(&mut self.seen.borrow_mut()))
        };
        if changed {
            self.is_there.set(!list.is_empty());
        }
        self.is_there.get()
    }
}
