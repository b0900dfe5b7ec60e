//! The service type with which `ports` opens iceoryx2.
//!
//! It is iceoryx2's `ipc::Service` in all but one thing: what a port or a loan shares with its
//! handles lives in a [`Pooled`] instead of an `Rc`, so that loaning does not go to the heap.
//! Everything that another process can see, which is files, names, hashes, layouts and locks, is
//! taken from `ipc::Service` itself. So stock processes, tools and bindings of the same version
//! meet ours as they meet each other (tests/bus/interop.rs).
//!
//! **Invariant:** `ipc::Service` is named here only; like its ports, ours stay in their thread.

use core::fmt::Debug;

use iceoryx2::prelude::{ZeroCopySend, ipc};
use iceoryx2::service::Service;
use iceoryx2::service::internal::ServiceInternal;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;

use crate::pooled::Pooled;

/// iceoryx2 between processes, without the heap. Only a name for types: it has no values.
#[derive(Clone, Debug)]
pub(crate) enum Ipc {}

impl Service for Ipc {
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = Pooled<T>;

    type StaticStorage = <ipc::Service as Service>::StaticStorage;
    type ConfigSerializer = <ipc::Service as Service>::ConfigSerializer;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> =
        <ipc::Service as Service>::PersistentDynamicStorage<T>;
    type Bag = <ipc::Service as Service>::Bag;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> =
        <ipc::Service as Service>::DynamicStorage<T>;
    type ServiceNameHasher = <ipc::Service as Service>::ServiceNameHasher;
    type SharedMemory = <ipc::Service as Service>::SharedMemory;
    type ResizableSharedMemory = <ipc::Service as Service>::ResizableSharedMemory;
    type Connection = <ipc::Service as Service>::Connection;
    type Event = <ipc::Service as Service>::Event;
    type Monitoring = <ipc::Service as Service>::Monitoring;
    type Reactor = <ipc::Service as Service>::Reactor;
    type BlackboardMgmt<T: Send + Sync + Debug + ZeroCopySend + 'static> =
        <ipc::Service as Service>::BlackboardMgmt<T>;
    type BlackboardPayload = <ipc::Service as Service>::BlackboardPayload;
    type UniqueId = <ipc::Service as Service>::UniqueId;
}

impl ServiceInternal<Self> for Ipc {}
