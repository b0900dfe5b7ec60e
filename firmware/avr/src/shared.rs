//! Data that an interrupt and the main loop share.
//!
//! The chip has one core and its interrupts do not nest, so code that runs with interrupts off is
//! alone. Locks are held for a few cycles, because the servos' UART must be served within 20 us.
//! Queues need no lock.

use avr_device::interrupt::{self, Mutex};
use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// A value that is used with interrupts off.
pub struct Shared<T>(Mutex<UnsafeCell<T>>);

impl<T: Send> Shared<T> {
    /// A shared value.
    pub const fn new(value: T) -> Self {
        Self(Mutex::new(UnsafeCell::new(value)))
    }

    /// Uses the value, alone. `action` may not use the same value through this again; those here
    /// call a method or two of the value itself.
    #[inline(always)]
    pub fn with<R>(&self, action: impl FnOnce(&mut T) -> R) -> R {
        interrupt::free(|alone| {
            // SAFETY: interrupts are off and there is one core, so no other use is under way, and
            // by the rule above `action` does not begin one.
            action(unsafe { &mut *self.0.borrow(alone).get() })
        })
    }

    /// The same in an interrupt, which is alone without a lock: 9 cycles less.
    ///
    /// # Safety
    /// Called by interrupts only, and they do not nest.
    #[inline(always)]
    pub unsafe fn in_interrupt<R>(&self, action: impl FnOnce(&mut T) -> R) -> R {
        // SAFETY: by the caller's promise interrupts are off, as in `with`.
        let alone = unsafe { interrupt::CriticalSection::new() };
        // SAFETY: as in `with`.
        action(unsafe { &mut *self.0.borrow(alone).get() })
    }
}

/// A byte that an interrupt and the main loop share: the chip reads and writes it in one
/// instruction, so no lock is needed.
pub struct SharedByte(UnsafeCell<u8>);

// SAFETY: every access is one instruction, and there is one core.
unsafe impl Sync for SharedByte {}

impl SharedByte {
    /// A shared byte.
    pub const fn new(value: u8) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// What it holds.
    #[inline(always)]
    pub fn get(&self) -> u8 {
        // SAFETY: the cell lives as long as `self`.
        unsafe { self.0.get().read_volatile() }
    }

    /// Replaces it.
    #[inline(always)]
    pub fn set(&self, value: u8) {
        // SAFETY: as above.
        unsafe { self.0.get().write_volatile(value) };
    }
}

/// A queue with one end in an interrupt and the other in the main loop. `N` is a power of two; it
/// holds one less.
///
/// ```text
///   taken: the next to read --.        .-- added: the next place to write
///   slots  . . . . . . . . . . x x x x . . . .
/// ```
///
/// Each end writes its own index only and after the slot, so neither locks the other out. The
/// interrupts are what this is made for: bytes for indices, no division and few registers to save
/// are a third of the cycles that `heapless::spsc` and `heapless::Deque` take, and a byte from a
/// servo must be fetched within 160.
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

    /// An empty queue; `filler` lies in its slots.
    pub const fn new(filler: T) -> Self {
        Self {
            slots: UnsafeCell::new([filler; N]),
            added: SharedByte::new(0),
            taken: SharedByte::new(0),
        }
    }

    /// Adds an element; one that finds the queue full is lost. Called from one end only.
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

    /// Takes the oldest element. Called from one end only, which is not the one that adds.
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

    /// Whether there is nothing to take.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.added.get() == self.taken.get()
    }

    /// How many more elements it takes.
    pub fn room(&self) -> u8 {
        self.taken
            .get()
            .wrapping_sub(self.added.get())
            .wrapping_sub(1)
            & Self::MASK
    }
}

/// Room for a value that is made at start and lives as long as the program: in RAM that the linker
/// counts, and not on the stack.
pub struct Place<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: the one use, `fill`, hands the content over to one caller.
unsafe impl<T: Send> Sync for Place<T> {}

impl<T> Place<T> {
    /// Room, empty.
    pub const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Puts the value there and hands it out.
    ///
    /// # Safety
    /// It is called once.
    pub unsafe fn fill(&'static self, value: T) -> &'static mut T {
        // SAFETY: by the caller's promise nobody else has a reference to the content.
        unsafe { (*self.0.get()).write(value) }
    }
}

impl<T> Default for Place<T> {
    fn default() -> Self {
        Self::new()
    }
}
