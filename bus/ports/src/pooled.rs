//! [`Pooled`]: a reference-counted box like `Rc`, whose memory is reused instead of freed.
//!
//! iceoryx2 makes one small shared value for each loan and drops it when the sample is sent. With
//! an `Rc` that is one allocation per frame; here the memory comes from a list of spare blocks
//! that each thread keeps.
//!
//! ```text
//!     Pooled ──┬──▶ block: [ holders: 2 | value ]
//!     Pooled ──┘         ▲              │ the last holder goes: the value is dropped
//!                    new │              ▼
//!                  spare blocks of the thread, at most SPARES
//! ```
//!
//! The list is filled before it is first used. A value that does not fit into a block, or that
//! finds the list empty, is allocated as usual. So a thread allocates nothing as long as at most
//! `SPARES` small values live in it at a time. iceoryx2's larger values are made once for each
//! port.
//!
//! **Invariants**, on which the unsafe code rests:
//! 1. `place` points to an initialised [`Counted`] for as long as it has holders, and `holders`
//!    is the number of [`Pooled`] that point to it.
//! 2. The memory was made as a box: of a [`Block`] if [`Counted::FITS`], otherwise of a `Counted`.
//!    Allocation and release both ask `FITS`, which depends on the type alone. A block belongs to
//!    no thread: another thread may give it back, and so may a thread whose list is already gone.
//! 3. Nobody has a `&mut` to the value before the last holder goes.
//! 4. A `Pooled` is neither `Send` nor `Sync`, since `holders` is a plain number.

#![allow(
    unsafe_code,
    reason = "sharing memory and using it again is what this is for"
)]

use core::cell::{Cell, RefCell};
use core::fmt;
use core::mem::MaybeUninit;
use core::ops::Deref;
use core::ptr::NonNull;

use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_cal::arc_sync_policy::{ArcSyncPolicy, ArcSyncPolicyCreationError, LockGuard};

/// Spare blocks that a thread keeps: 2 KiB together. A loan needs one until it is sent.
const SPARES: usize = 32;

/// What all spare blocks look like. iceoryx2's value for a loan needs 40 bytes, count included.
#[repr(align(16))]
struct Block {
    _bytes: [u8; 64],
}

type Spare = Box<MaybeUninit<Block>>;

thread_local! {
    /// Never grows: it takes no more blocks than its first capacity.
    static LIST: RefCell<Vec<Spare>> =
        RefCell::new((0..SPARES).map(|_| Box::new_uninit()).collect());
}

/// A spare block, or a new one.
fn take() -> Spare {
    LIST.try_with(|list| list.borrow_mut().pop())
        // The thread is ending and has no list any more.
        .unwrap_or_default()
        .unwrap_or_else(Box::new_uninit)
}

/// Keeps the block if the list has room for it; otherwise frees it.
fn give_back(block: Spare) {
    let _ = LIST.try_with(|list| {
        let mut list = list.borrow_mut();
        if list.len() < SPARES {
            list.push(block);
        }
    });
}

/// The memory that all holders share.
struct Counted<T> {
    holders: Cell<usize>,
    value: T,
}

impl<T> Counted<T> {
    /// Whether the value and its count fit into a block.
    const FITS: bool =
        size_of::<Self>() <= size_of::<Block>() && align_of::<Self>() <= align_of::<Block>();

    /// Moves the value into memory where it stays until [`Counted::release`].
    fn place(self) -> NonNull<Self> {
        if Self::FITS {
            let place = NonNull::from(Box::leak(take())).cast::<Self>();
            // SAFETY: nobody else has the block, and by `FITS` it is large enough and aligned.
            unsafe { place.write(self) };
            place
        } else {
            NonNull::from(Box::leak(Box::new(self)))
        }
    }

    /// Gives the memory back without dropping the value in it.
    ///
    /// # Safety
    /// `place` comes from [`Counted::place`], and nobody uses it any more.
    unsafe fn release(place: NonNull<Self>) {
        if Self::FITS {
            // SAFETY: by invariant 2 this was a box of a block, and a block may have any content.
            give_back(unsafe { Box::from_raw(place.cast().as_ptr()) });
        } else {
            let memory = place.cast::<MaybeUninit<Self>>();
            // SAFETY: by invariant 2 this was a box of the same layout, and a `MaybeUninit` may
            // have any content.
            drop(unsafe { Box::from_raw(memory.as_ptr()) });
        }
    }
}

/// A shared value of one thread; clones share it, and the last one drops it.
pub(crate) struct Pooled<T> {
    place: NonNull<Counted<T>>,
}

impl<T> Pooled<T> {
    fn new(value: T) -> Self {
        let holders = Cell::new(1);
        Self {
            place: Counted { holders, value }.place(),
        }
    }

    fn counted(&self) -> &Counted<T> {
        // SAFETY: by invariant 1 the value exists while `self` does, and by 3 it is only read.
        unsafe { self.place.as_ref() }
    }
}

impl<T> Clone for Pooled<T> {
    fn clone(&self) -> Self {
        let holders = &self.counted().holders;
        match holders.get().checked_add(1) {
            Some(more) => holders.set(more),
            // Only forgotten clones lead here; a count that wraps to 0 would free too early.
            None => std::process::abort(),
        }
        Self { place: self.place }
    }
}

impl<T> Drop for Pooled<T> {
    fn drop(&mut self) {
        let holders = &self.counted().holders;
        holders.set(holders.get() - 1);
        if holders.get() > 0 {
            return;
        }
        // SAFETY: this was the last holder, so nobody else has the value or the memory. If the
        // value's own drop panics, the memory is not given back: a leak, but no other harm.
        unsafe {
            self.place.drop_in_place();
            Counted::release(self.place);
        }
    }
}

impl<T: fmt::Debug> fmt::Debug for Pooled<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_tuple("Pooled")
            .field(&self.counted().value)
            .finish()
    }
}

/// iceoryx2's tests simulate dead processes with this: the last holder makes the value leave behind
/// what a killed process would. Any other holder only decreases the count.
impl<T: Abandonable> Abandonable for Pooled<T> {
    unsafe fn abandon_in_place(this: NonNull<Self>) {
        // SAFETY: the caller promises a valid `Pooled` that is its own.
        let pooled = unsafe { this.as_ref() };
        if pooled.counted().holders.get() > 1 {
            // SAFETY: the caller promises that it is not used or dropped after this.
            unsafe { this.drop_in_place() };
            return;
        }
        let mut place = pooled.place;
        // SAFETY: this is the last holder, so nobody else has the value or the memory, and by the
        // caller's promise nobody comes back to it.
        unsafe {
            T::abandon_in_place(NonNull::from(&mut place.as_mut().value));
            Counted::release(place);
        }
    }
}

impl<T: Send + fmt::Debug + Abandonable> ArcSyncPolicy<T> for Pooled<T> {
    type LockGuard<'parent>
        = Guard<'parent, T>
    where
        Self: 'parent,
        T: 'parent;

    fn new(value: T) -> Result<Self, ArcSyncPolicyCreationError> {
        Ok(Self::new(value))
    }

    fn lock(&self) -> Guard<'_, T> {
        Guard {
            value: &self.counted().value,
        }
    }
}

/// Access to the value. Within one thread there is nothing to lock.
pub(crate) struct Guard<'parent, T> {
    value: &'parent T,
}

impl<T> Deref for Guard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.value
    }
}

impl<'parent, T: Send + Abandonable> LockGuard<'parent, T> for Guard<'parent, T> {}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::rc::Rc;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    fn spares() -> usize {
        LIST.with(|list| list.borrow().len())
    }

    /// How often its values were dropped and abandoned.
    #[derive(Clone, Debug, Default)]
    struct Fate(Arc<[AtomicU32; 2]>);

    impl Fate {
        fn dropped(&self) -> u32 {
            self.0[0].load(Ordering::Relaxed)
        }

        fn abandoned(&self) -> u32 {
            self.0[1].load(Ordering::Relaxed)
        }
    }

    #[derive(Debug)]
    struct Witness<const SIZE: usize> {
        fate: Fate,
        _bulk: [u8; SIZE],
    }

    type Small = Witness<8>;
    type Large = Witness<200>;

    impl<const SIZE: usize> Witness<SIZE> {
        fn new(fate: &Fate) -> Self {
            Self {
                fate: fate.clone(),
                _bulk: [0; SIZE],
            }
        }
    }

    impl<const SIZE: usize> Drop for Witness<SIZE> {
        fn drop(&mut self) {
            self.fate.0[0].fetch_add(1, Ordering::Relaxed);
        }
    }

    impl<const SIZE: usize> Abandonable for Witness<SIZE> {
        unsafe fn abandon_in_place(mut this: NonNull<Self>) {
            // SAFETY: the caller promises a valid value that is its own and not used after this;
            // so only this drops the field.
            unsafe {
                let this = this.as_mut();
                this.fate.0[1].fetch_add(1, Ordering::Relaxed);
                core::ptr::drop_in_place(&mut this.fate);
            }
        }
    }

    #[test]
    fn a_value_is_dropped_once_with_its_last_holder() {
        fn check<const SIZE: usize>() {
            let fate = Fate::default();
            let first = Pooled::new(Witness::<SIZE>::new(&fate));
            let second = first.clone();
            let third = second.clone();
            drop(first);
            drop(third);
            assert_eq!(fate.dropped(), 0);
            assert_eq!(second.lock().fate.dropped(), 0);
            drop(second);
            assert_eq!(fate.dropped(), 1);
            assert_eq!(Arc::strong_count(&fate.0), 1);
        }
        check::<8>();
        check::<200>();
    }

    #[test]
    fn memory_is_used_again_by_whatever_fits() {
        let first = Pooled::new([1_u8; 56]);
        let place = first.place.cast::<u8>();
        assert_eq!(spares(), SPARES - 1);
        drop(first);
        assert_eq!(spares(), SPARES);
        let second = Pooled::new(2_u64);
        assert_eq!(second.place.cast::<u8>(), place);
    }

    #[test]
    fn what_does_not_fit_leaves_the_spare_blocks_alone() {
        const { assert!(Counted::<[u8; 56]>::FITS && !Counted::<[u8; 57]>::FITS) };
        let large = Pooled::new([0_u8; 57]);
        assert_eq!(spares(), SPARES);
        drop(large);
        assert_eq!(spares(), SPARES);
    }

    #[test]
    fn beyond_the_spare_blocks_there_is_the_heap_and_the_list_does_not_grow() {
        let capacity = LIST.with(|list| list.borrow().capacity());
        let many: Vec<_> = (0..4 * SPARES).map(Pooled::new).collect();
        assert_eq!(spares(), 0);
        for (number, value) in many.iter().enumerate() {
            assert_eq!(value.counted().value, number);
        }
        drop(many);
        assert_eq!(spares(), SPARES);
        assert_eq!(LIST.with(|list| list.borrow().capacity()), capacity);
    }

    #[test]
    fn every_type_is_where_it_may_be_and_keeps_its_value() {
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[repr(align(128))]
        struct Aligned(u8);

        fn check<T: Clone + fmt::Debug + PartialEq>(value: T) {
            let holders: Vec<_> = (0..SPARES + 3)
                .map(|_| Pooled::new(value.clone()))
                .collect();
            for holder in &holders {
                assert!(holder.place.is_aligned());
                assert_eq!(holder.counted().value, value);
            }
        }
        check(());
        check(1_u8);
        check(2_u128);
        check(Aligned(3));
        check([4_u64; 7]);
        check([5_u64; 8]);
        check(String::from("sex"));
        check(vec![7; 1000]);
        const { assert!(Counted::<u128>::FITS && !Counted::<Aligned>::FITS) };
    }

    #[test]
    fn a_value_may_hold_another() {
        let fate = Fate::default();
        let inner = Pooled::new(Small::new(&fate));
        let outer = Pooled::new(inner.clone());
        drop(inner);
        assert_eq!(fate.dropped(), 0);
        drop(outer);
        assert_eq!(fate.dropped(), 1);
        assert_eq!(spares(), SPARES);
    }

    #[test]
    fn the_last_holder_abandons_the_value_and_another_one_only_goes() {
        fn check<const SIZE: usize>() {
            let fate = Fate::default();
            let first = Pooled::new(Witness::<SIZE>::new(&fate));
            let second = first.clone();
            first.abandon();
            assert_eq!((fate.dropped(), fate.abandoned()), (0, 0));
            assert_eq!(second.counted().holders.get(), 1);
            second.abandon();
            assert_eq!((fate.dropped(), fate.abandoned()), (0, 1));
            assert_eq!(spares(), SPARES);
        }
        check::<8>();
        check::<200>();
    }

    /// Returns when the thread's locals have been dropped too, which only a join waits for.
    fn in_a_thread(work: impl FnOnce() + Send) {
        std::thread::scope(|scope| scope.spawn(work).join().unwrap());
    }

    #[test]
    fn values_that_outlive_their_threads_list_are_dropped_once() {
        thread_local! {
            static EARLY: RefCell<Vec<Pooled<Small>>> = const { RefCell::new(Vec::new()) };
            static LATE: RefCell<Vec<Pooled<Small>>> = const { RefCell::new(Vec::new()) };
        }
        let fate = Fate::default();
        in_a_thread(|| {
            // Thread-locals end in no promised order; one on each side of the list's first
            // use has both.
            EARLY.with(|early| early.borrow_mut().reserve(50));
            let fill = |values: &RefCell<Vec<_>>| {
                let new = || Pooled::new(Small::new(&fate));
                values
                    .borrow_mut()
                    .extend(core::iter::repeat_with(new).take(50));
            };
            EARLY.with(fill);
            LATE.with(fill);
        });
        assert_eq!(fate.dropped(), 100);
        assert_eq!(Arc::strong_count(&fate.0), 1);
    }

    #[test]
    fn a_value_made_while_the_thread_ends_is_dropped_too() {
        struct Last(Fate);
        impl Drop for Last {
            fn drop(&mut self) {
                drop(Pooled::new(Small::new(&self.0)));
                drop(Pooled::new(Large::new(&self.0)));
            }
        }
        thread_local! {
            static LAST: RefCell<Option<Last>> = const { RefCell::new(None) };
            static FIRST: RefCell<Option<Last>> = const { RefCell::new(None) };
        }
        let fate = Fate::default();
        in_a_thread(|| {
            LAST.set(Some(Last(fate.clone())));
            drop(Pooled::new(0));
            FIRST.set(Some(Last(fate.clone())));
        });
        assert_eq!(fate.dropped(), 4);
    }

    #[test]
    fn it_stays_in_its_thread() {
        // Compiles only if neither trait is there: with it, the method would be ambiguous.
        trait NotSend<A> {
            fn stays() {}
        }
        impl<T> NotSend<()> for T {}
        impl<T: Send> NotSend<u8> for T {}
        trait NotSync<A> {
            fn stays() {}
        }
        impl<T> NotSync<()> for T {}
        impl<T: Sync> NotSync<u8> for T {}
        <Pooled<u64> as NotSend<_>>::stays();
        <Pooled<u64> as NotSync<_>>::stays();
    }

    proptest! {
        #[test]
        fn it_is_an_rc_with_other_memory(
            steps in proptest::collection::vec((0..3_u8, any::<prop::sample::Index>()), 0..400),
        ) {
            let fate = Fate::default();
            let mut values: Vec<(Pooled<Small>, Rc<()>)> = Vec::new();
            let mut made = 0;
            for (step, index) in steps {
                match step {
                    0 => {
                        values.push((Pooled::new(Small::new(&fate)), Rc::new(())));
                        made += 1;
                    }
                    _ if values.is_empty() => (),
                    1 => values.push(values[index.index(values.len())].clone()),
                    _ => drop(values.swap_remove(index.index(values.len()))),
                }
                for (pooled, rc) in &values {
                    prop_assert_eq!(pooled.counted().holders.get(), Rc::strong_count(rc));
                }
                let living: std::collections::HashSet<_> =
                    values.iter().map(|(pooled, _)| pooled.place).collect();
                prop_assert_eq!(fate.dropped(), made - living.len() as u32);
            }
            drop(values);
            prop_assert_eq!(fate.dropped(), made);
            prop_assert_eq!(spares(), SPARES);
        }
    }
}
