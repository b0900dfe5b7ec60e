//! Wraps values of iceoryx2, so that this crate compiles their drop code and no other crate does.

#![allow(
    unsafe_code,
    reason = "a value is dropped through a function that is not generic"
)]

use core::mem::ManuallyDrop;
use core::ops::{Deref, DerefMut};

use iceoryx2::node::Node;

use crate::transport::Ipc;

/// A value of the transport whose drop code is compiled in this crate, wherever it is dropped.
pub(crate) struct Here<T: Ends>(ManuallyDrop<T>);

/// How a [`Here`] drops its value. [`ends_here!`] implements it for each type, because a generic
/// function would be compiled in the crate that uses it.
pub(crate) trait Ends: Sized {
    /// Drops the value.
    ///
    /// # Safety
    /// The caller does not use the value after this.
    unsafe fn end(this: &mut ManuallyDrop<Self>);
}

macro_rules! ends_here {
    ($($type:ty),+) => {$(
        impl $crate::here::Ends for $type {
            #[inline(never)]
            unsafe fn end(this: &mut core::mem::ManuallyDrop<Self>) {
                // SAFETY: the caller promises not to use the value after this.
                unsafe { core::mem::ManuallyDrop::drop(this) }
            }
        }
    )+};
}
pub(crate) use ends_here;

ends_here!(Node<Ipc>);

impl<T: Ends> Here<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(ManuallyDrop::new(value))
    }

    /// Returns the value. It is then dropped where the caller drops it.
    pub(crate) fn take(self) -> T {
        let mut this = ManuallyDrop::new(self);
        // SAFETY: `this` is neither used nor dropped after this.
        unsafe { ManuallyDrop::take(&mut this.0) }
    }
}

impl<T: Ends> Drop for Here<T> {
    fn drop(&mut self) {
        // SAFETY: this wrapper is being dropped, so nobody uses the value any more.
        unsafe { T::end(&mut self.0) }
    }
}

impl<T: Ends> Deref for Here<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Ends> DerefMut for Here<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}
