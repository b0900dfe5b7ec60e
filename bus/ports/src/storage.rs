//! [`Storage`]: iceoryx2's shared memory, with a limit on how long opening it waits.
//!
//! iceoryx2 waits without limit for the creator of a segment that has no size yet. A process that
//! was killed between `shm_open` and `ftruncate` leaves such a segment, and so can any process with
//! the permission to write there; then nobody can open the segment again. iceoryx2 also maps a
//! segment that is too short for its value, and the first access to it ends the process.
//!
//! This storage checks both first. It removes the segment of a dead creator, waits for a living
//! creator longer than any creation takes, and refuses a segment that is too short.
//!
//! **Invariant:** all else is iceoryx2's own storage. Names, hashes, sizes and modes are the same,
//! so programs of plain iceoryx2 can share segments with this project's.

use core::fmt::Debug;
use core::mem::MaybeUninit;
use core::ptr::NonNull;
use core::time::Duration;
use std::os::unix::fs::PermissionsExt;
use std::path::Path as OsPath;
use std::time::Instant;

use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use iceoryx2_bb_memory::bump_allocator::BumpAllocator;
use iceoryx2_bb_posix::file::AccessMode;
use iceoryx2_cal::dynamic_storage::posix_shared_memory as posix;
use iceoryx2_cal::dynamic_storage::{
    DynamicStorage, DynamicStorageBuilder, DynamicStorageCreateError, DynamicStorageOpenError,
    DynamicStorageOpenOrCreateError,
};
use iceoryx2_cal::named_concept::{
    FileName, NamedConcept, NamedConceptBuilder, NamedConceptConfiguration,
    NamedConceptDoesExistError, NamedConceptListError, NamedConceptMgmt,
    NamedConceptPathHintRemoveError, NamedConceptRemoveError, Path,
};

use lager_home::SHARED_MEMORY;

/// Creating a segment takes microseconds. A living creator that has set no size after this time is
/// stopped.
const CREATION: Duration = Duration::from_millis(50);

/// The version number that the transport puts before each value.
const HEAD: u64 = 8;

/// iceoryx2's storage, opened with these checks.
#[derive(Debug)]
pub(crate) struct Storage<T: Debug + Send + Sync + ZeroCopySend>(posix::Storage<T>);

/// Makes or opens a [`Storage`].
#[derive(Debug)]
pub(crate) struct Builder<'builder, T: Debug + Send + Sync + ZeroCopySend> {
    inner: posix::Builder<'builder, T>,
    name: FileName,
    config: posix::Configuration<T>,
    timeout: Duration,
}

impl<T: Debug + Send + Sync + ZeroCopySend> Builder<'_, T> {
    /// Waits until the segment can be opened or is absent; opening it then shows which. Removes a
    /// segment that a dead process has not finished.
    fn wait_for_size(&self) -> Result<(), DynamicStorageOpenError> {
        let file = self.config.path_for(&self.name).file_name().to_string();
        let segment = OsPath::new(SHARED_MEMORY).join(file);
        let start = Instant::now();
        while let Ok(found) = std::fs::metadata(&segment) {
            let readable = found.permissions().mode() & 0o400 != 0;
            if readable && found.len() >= HEAD + size_of::<T>() as u64 {
                return Ok(());
            }
            if readable && found.len() > 0 {
                return Err(DynamicStorageOpenError::InternalError);
            }
            if lager_home::remove_unused(&segment) {
                continue;
            }
            if start.elapsed() >= self.timeout.max(CREATION) {
                return Err(DynamicStorageOpenError::InitializationNotYetFinalized);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> NamedConceptBuilder<Storage<T>> for Builder<'_, T> {
    fn new(name: &FileName) -> Self {
        Self {
            inner: posix::Builder::new(name),
            name: *name,
            config: posix::Configuration::default(),
            timeout: Duration::ZERO,
        }
    }

    fn config(mut self, config: &posix::Configuration<T>) -> Self {
        self.inner = self.inner.config(config);
        self.config = config.clone();
        self
    }
}

impl<'builder, T: Debug + Send + Sync + ZeroCopySend> DynamicStorageBuilder<'builder, T, Storage<T>>
    for Builder<'builder, T>
{
    fn has_ownership(mut self, value: bool) -> Self {
        self.inner = self.inner.has_ownership(value);
        self
    }

    fn enable_global_access(mut self, value: bool) -> Self {
        self.inner = self.inner.enable_global_access(value);
        self
    }

    fn supplementary_size(mut self, value: usize) -> Self {
        self.inner = self.inner.supplementary_size(value);
        self
    }

    fn timeout(mut self, value: Duration) -> Self {
        self.inner = self.inner.timeout(value);
        self.timeout = value;
        self
    }

    fn initializer<F: FnMut(&mut MaybeUninit<T>, &mut BumpAllocator) -> bool + 'builder>(
        mut self,
        value: F,
    ) -> Self {
        self.inner = self.inner.initializer(value);
        self
    }

    fn create(self) -> Result<Storage<T>, DynamicStorageCreateError> {
        self.inner.create().map(Storage)
    }

    fn open(self, access_mode: AccessMode) -> Result<Storage<T>, DynamicStorageOpenError> {
        self.wait_for_size()?;
        self.inner.open(access_mode).map(Storage)
    }

    fn open_or_create(self) -> Result<Storage<T>, DynamicStorageOpenOrCreateError> {
        self.wait_for_size()?;
        self.inner.open_or_create().map(Storage)
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> NamedConcept for Storage<T> {
    fn name(&self) -> &FileName {
        self.0.name()
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> NamedConceptMgmt for Storage<T> {
    type Configuration = posix::Configuration<T>;

    #[allow(unsafe_code, reason = "the trait's")]
    unsafe fn remove_cfg(
        name: &FileName,
        config: &Self::Configuration,
    ) -> Result<bool, NamedConceptRemoveError> {
        // SAFETY: the caller's promises are passed on unchanged.
        unsafe { posix::Storage::<T>::remove_cfg(name, config) }
    }

    fn does_exist_cfg(
        name: &FileName,
        config: &Self::Configuration,
    ) -> Result<bool, NamedConceptDoesExistError> {
        posix::Storage::<T>::does_exist_cfg(name, config)
    }

    fn list_cfg(config: &Self::Configuration) -> Result<Vec<FileName>, NamedConceptListError> {
        posix::Storage::<T>::list_cfg(config)
    }

    fn remove_path_hint(value: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        posix::Storage::<T>::remove_path_hint(value)
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> Abandonable for Storage<T> {
    #[allow(unsafe_code, reason = "the trait's")]
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller's promises are passed on; they hold for the field too.
        unsafe { posix::Storage::abandon_in_place(NonNull::from_mut(&mut this.as_mut().0)) };
    }
}

impl<T: Debug + Send + Sync + ZeroCopySend> DynamicStorage<T> for Storage<T> {
    type Builder<'builder> = Builder<'builder, T>;

    fn does_support_persistency() -> bool {
        posix::Storage::<T>::does_support_persistency()
    }

    fn has_ownership(&self) -> bool {
        self.0.has_ownership()
    }

    fn release_ownership(&self) {
        self.0.release_ownership();
    }

    fn acquire_ownership(&self) {
        self.0.acquire_ownership();
    }

    #[inline(always)]
    fn get(&self) -> &T {
        self.0.get()
    }

    #[allow(unsafe_code, reason = "the trait's")]
    unsafe fn __internal_set_type_name_in_config(
        config: &mut Self::Configuration,
        type_name: &str,
    ) {
        // SAFETY: the caller's promises are passed on unchanged.
        unsafe { posix::Storage::<T>::__internal_set_type_name_in_config(config, type_name) };
    }
}
