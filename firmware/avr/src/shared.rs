//! Types for data that an interrupt and the main loop share.
//!
//! The chip has one core and its interrupts do not nest, so code with interrupts off runs alone.
//! Locks are held for only a few cycles, because the servos' UART must be served within 20 us.
//! Queues need no lock.

use avr_device::interrupt::{self, Mutex};
use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// A value that is only used with interrupts off.
pub struct Shared<T>(Mutex<UnsafeCell<T>>);

impl<T: Send> Shared<T> {
    /// A shared value.
    pub const fn new(value: T) -> Self {
        Self(Mutex::new(UnsafeCell::new(value)))
    }

    /// Calls `action` with the value and interrupts off. `action` must not call this on the same
    /// value; the actions here only call a method or two of the value itself.
    #[inline(always)]
    pub fn with<R>(&self, action: impl FnOnce(&mut T) -> R) -> R {
        interrupt::free(|alone| {
            // SAFETY: interrupts are off and there is one core, so no other use is under way, and
            // by the rule above `action` begins none.
            action(unsafe { &mut *self.0.borrow(alone).get() })
        })
    }

    /// The same in an interrupt, which needs no lock: 9 cycles less.
    ///
    /// # Safety
    /// Only interrupts may call it, and they must not nest.
    #[inline(always)]
    pub unsafe fn in_interrupt<R>(&self, action: impl FnOnce(&mut T) -> R) -> R {
        // SAFETY: by the caller's promise interrupts are off, as in `with`.
        let alone = unsafe { interrupt::CriticalSection::new() };
        // SAFETY: as in `with`.
        action(unsafe { &mut *self.0.borrow(alone).get() })
    }
}

/// A byte that an interrupt and the main loop share. The chip reads and writes it in one
/// instruction, so it needs no lock.
pub struct SharedByte(UnsafeCell<u8>);

// SAFETY: every access is one instruction, and there is one core.
unsafe impl Sync for SharedByte {}

impl SharedByte {
    /// A shared byte.
    pub const fn new(value: u8) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// The value.
    #[inline(always)]
    pub fn get(&self) -> u8 {
        // SAFETY: the cell lives as long as `self`.
        unsafe { self.0.get().read_volatile() }
    }

    /// Sets the value.
    #[inline(always)]
    pub fn set(&self, value: u8) {
        // SAFETY: as above.
        unsafe { self.0.get().write_volatile(value) };
    }
}

/// A queue between an interrupt and the main loop. `N` is a power of two; the queue holds one
/// element less.
///
/// ```text
///   taken: the next to read --.        .-- added: the next place to write
///   slots  . . . . . . . . . . x x x x . . . .
/// ```
///
/// Each end writes only its own index, after it has used the slot, so neither needs a lock. The
/// queue is made for interrupts: indices are bytes, there is no division, and few registers must be
/// saved. It takes a third of the cycles of `heapless::spsc` and `heapless::Deque`, and a byte from
/// a servo must be fetched within 160 cycles.
pub struct Ring<T, const N: usize> {
    slots: UnsafeCell<[T; N]>,
    added: SharedByte,
    taken: SharedByte,
}

// SAFETY: a slot belongs to the end whose index has not passed it, by the rule of `push` and `pop`.
unsafe impl<T: Send, const N: usize> Sync for Ring<T, N> {}

impl<T: Copy, const N: usize> Ring<T, N> {
    const MASK: u8 = {
        assert!(N.is_power_of_two() && N <= 256);
        (N - 1) as u8
    };

    /// An empty queue whose slots hold `filler`.
    pub const fn new(filler: T) -> Self {
        Self {
            slots: UnsafeCell::new([filler; N]),
            added: SharedByte::new(0),
            taken: SharedByte::new(0),
        }
    }

    /// Adds an element, or drops it if the queue is full. Only one of the two ends may call it.
    #[inline(always)]
    pub fn push(&self, element: T) {
        let added = self.added.get();
        let next = added.wrapping_add(1) & Self::MASK;
        if next == self.taken.get() {
            return;
        }
        // SAFETY: the index is below N, and the other end does not read this slot before `added`
        // passes it.
        unsafe {
            self.slots
                .get()
                .cast::<T>()
                .add(usize::from(added))
                .write_volatile(element)
        };
        self.added.set(next);
    }

    /// Takes the oldest element. Only the end that does not add may call it.
    #[inline(always)]
    pub fn pop(&self) -> Option<T> {
        let taken = self.taken.get();
        if taken == self.added.get() {
            return None;
        }
        // SAFETY: the index is below N, and the other end does not write this slot before `taken`
        // passes it.
        let element = unsafe {
            self.slots
                .get()
                .cast::<T>()
                .add(usize::from(taken))
                .read_volatile()
        };
        self.taken.set(taken.wrapping_add(1) & Self::MASK);
        Some(element)
    }

    /// Whether the queue is empty.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.added.get() == self.taken.get()
    }

    /// How many more elements fit.
    pub fn room(&self) -> u8 {
        self.taken
            .get()
            .wrapping_sub(self.added.get())
            .wrapping_sub(1)
            & Self::MASK
    }
}

/// Space for a value that is made at start and lives as long as the program. It is in RAM that the
/// linker counts, not on the stack.
pub struct StaticCell<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: only `fill` uses it, and hands the content to one caller.
unsafe impl<T: Send> Sync for StaticCell<T> {}

impl<T> StaticCell<T> {
    /// Empty space.
    pub const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Stores the value and returns a reference to it.
    ///
    /// # Safety
    /// Call it only once.
    pub unsafe fn fill(&'static self, value: T) -> &'static mut T {
        // SAFETY: by the caller's promise nobody else has a reference to the content.
        unsafe { (*self.0.get()).write(value) }
    }
}

impl<T> Default for StaticCell<T> {
    fn default() -> Self {
        Self::new()
    }
}
