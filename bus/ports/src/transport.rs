//! [`Ipc`]: the service type with which this crate opens iceoryx2.
//!
//! It is iceoryx2's `ipc::Service` except for two things. What a port or a loan shares with its
//! handles lives in a [`Pooled`] instead of an `Rc`, so that loaning does not allocate: iceoryx2's
//! own `loan` allocates one small cell each time, and `tests/allocation.rs` counts 0 allocations a
//! frame over bridge and logic together. And segments are opened as a [`Storage`], which does not
//! wait for ever for a segment that was never finished. Everything that another process can see
//! (files, names, hashes, layouts and locks) is that of `ipc::Service`. So programs, tools and
//! bindings of plain iceoryx2, in the same version, can publish to this project's subscribers and
//! subscribe to its publishers (tests/bus/interop.rs).
//!
//! **Invariant:** only this file names `ipc::Service`. Like its ports, ours stay in one thread.

use core::fmt::Debug;

use iceoryx2::prelude::{ZeroCopySend, ipc};
use iceoryx2::service::Service;
use iceoryx2::service::internal::ServiceInternal;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_lock_free::mpmc::counting_bit_set::RelocatableCountingBitSet;
use iceoryx2_cal::event::trigger::State;
use iceoryx2_cal::event::trigger::unix_datagram_socket::GenericUnixDatagramSocketTrigger;
use iceoryx2_cal::resizable_shared_memory::dynamic::DynamicMemory;
use iceoryx2_cal::shared_memory::common::details::{AllocatorDetails, Memory};
use iceoryx2_cal::shm_allocator::pool_allocator::PoolAllocator;
use iceoryx2_cal::zero_copy_connection::common::details::{Connection, SharedManagementData};

use crate::pooled::Pooled;
use crate::storage::Storage;

/// iceoryx2 between processes, with fewer allocations. Only a name for types: it has no values.
#[derive(Clone, Debug)]
pub(crate) enum Ipc {}

impl Service for Ipc {
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = Pooled<T>;

    type StaticStorage = <ipc::Service as Service>::StaticStorage;
    type ConfigSerializer = <ipc::Service as Service>::ConfigSerializer;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type Bag = <ipc::Service as Service>::Bag;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type ServiceNameHasher = <ipc::Service as Service>::ServiceNameHasher;
    type SharedMemory = Memory<PoolAllocator, Storage<AllocatorDetails<PoolAllocator>>>;
    type ResizableSharedMemory = DynamicMemory<PoolAllocator, Self::SharedMemory>;
    type Connection = Connection<Storage<SharedManagementData>>;
    type Event = GenericUnixDatagramSocketTrigger<
        RelocatableCountingBitSet,
        Storage<State<RelocatableCountingBitSet, ()>>,
    >;
    type Monitoring = <ipc::Service as Service>::Monitoring;
    type Reactor = <ipc::Service as Service>::Reactor;
    type BlackboardMgmt<T: Send + Sync + Debug + ZeroCopySend + 'static> =
        <ipc::Service as Service>::BlackboardMgmt<T>;
    type BlackboardPayload = <ipc::Service as Service>::BlackboardPayload;
    type UniqueId = <ipc::Service as Service>::UniqueId;
}

impl ServiceInternal<Self> for Ipc {}
