//! The baselines of shared memory: a slot that the receiver watches without pause (`cacheline`), or
//! with a `futex` or an `eventfd` to sleep on. The path's floor uses the slot with a futex, too.

use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::os::fd::OwnedFd;

use lager_rig::Shareable;
use rustix::thread::futex;
use rustix::time::Timespec;

use super::{End, Slept, TIME_OUT, sleep_until, spin};
use crate::error::Fault;
use crate::sample::{Block, Sample};

/// A block in one cache line; the writer writes the block's number last.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Slot<const WORDS: usize> {
    words: [AtomicU64; WORDS],
}

impl<const WORDS: usize> Slot<WORDS> {
    pub(crate) fn write(&self, block: &Block<WORDS>) {
        for (to, word) in self.words.iter().zip(block.words).skip(1) {
            to.store(word, Ordering::Relaxed);
        }
        self.words[0].store(block.number(), Ordering::Release);
    }

    pub(crate) fn read(&self) -> Block<WORDS> {
        let mut words = [self.number(); WORDS];
        for (word, from) in words.iter_mut().zip(&self.words).skip(1) {
            *word = from.load(Ordering::Relaxed);
        }
        Block { words }
    }

    fn number(&self) -> u64 {
        self.words[0].load(Ordering::Acquire)
    }
}

/// A word to sleep on, in a cache line of its own.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Word(AtomicU32);

impl Word {
    /// Counts up and wakes one process, if one sleeps.
    pub(crate) fn wake(&self) -> rustix::io::Result<()> {
        self.0.fetch_add(1, Ordering::Release);
        futex::wake(&self.0, futex::Flags::empty(), 1).map(|_| ())
    }

    pub(crate) fn count(&self) -> u32 {
        self.0.load(Ordering::Acquire)
    }

    /// Sleeps while the count is `seen`, at most [`TIME_OUT`].
    pub(crate) fn sleep(&self, seen: u32) -> rustix::io::Result<Slept> {
        const LONGEST: Timespec = Timespec {
            tv_sec: 0,
            tv_nsec: TIME_OUT.subsec_nanos() as i64,
        };
        use rustix::io::Errno;
        match futex::wait(&self.0, futex::Flags::empty(), seen, Some(&LONGEST)) {
            Ok(()) | Err(Errno::AGAIN | Errno::INTR) => Ok(Slept::Woken),
            Err(Errno::TIMEDOUT) => Ok(Slept::TimedOut),
            Err(other) => Err(other),
        }
    }
}

/// The shared memory of one direction of a line.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Lane<const WORDS: usize> {
    slot: Slot<WORDS>,
    pub(crate) word: Word,
}

impl<const WORDS: usize> Lane<WORDS> {
    /// Writes the block, and wakes the process that sleeps for it.
    pub(crate) fn put(&self, block: &Block<WORDS>) -> Result<(), Fault> {
        self.slot.write(block);
        Ok(self.word.wake()?)
    }

    /// Sleeps until the count is no longer `seen`, and reads the block. Gives up after
    /// [`super::LIMIT`]. While a process is stopped by a signal, only one time-out counts.
    pub(crate) fn take(&self, seen: &mut u32) -> Result<Block<WORDS>, Fault> {
        let before = *seen;
        let look = || {
            let count = self.word.count();
            Ok((count != before).then_some(count))
        };
        *seen = sleep_until(look, || Ok(self.word.sleep(before)?))?;
        Ok(self.slot.read())
    }
}

/// Two lanes, one for each direction between two processes.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Lanes<const WORDS: usize>(pub(crate) [Lane<WORDS>; 2]);

// SAFETY: atomics only, and zeros are valid.
#[allow(unsafe_code)]
unsafe impl<const WORDS: usize> Shareable for Lanes<WORDS> {}

/// A cache line each way, which the receiver watches without pause.
pub(crate) fn cache_line(out: &Lane<8>, back: &Lane<8>) -> impl End {
    let (out, back) = (&out.slot, &back.slot);
    let mut seen = back.number();
    let send = move |sample: &Sample| {
        out.write(sample);
        Ok(())
    };
    let receive = move || {
        spin(|| Ok((back.number() != seen).then_some(())))?;
        let sample = back.read();
        seen = sample.number();
        Ok(sample)
    };
    (send, receive)
}

/// A cache line each way, and a futex to sleep on.
pub(crate) fn a_futex(out: &Lane<8>, back: &Lane<8>) -> impl End {
    let mut seen = back.word.count();
    let send = move |sample: &Sample| out.put(sample);
    (send, move || back.take(&mut seen))
}

/// A cache line each way, and an eventfd to sleep on, without a time-out.
pub(crate) fn an_eventfd(
    (out, ring): (&Lane<8>, &OwnedFd),
    (back, bell): (&Lane<8>, &OwnedFd),
) -> impl End {
    let send = move |sample: &Sample| {
        out.slot.write(sample);
        rustix::io::write(ring, &1_u64.to_ne_bytes())?;
        Ok(())
    };
    let receive = move || {
        let mut count = [0; 8];
        rustix::io::read(bell, &mut count)?;
        Ok(back.slot.read())
    };
    (send, receive)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::tests::pass;
    use lager_rig::Shared;

    #[test]
    fn samples_come_back_over_each_of_them() {
        use rustix::event::{EventfdFlags, eventfd};
        let memory = Shared::<Lanes<8>>::new().unwrap();
        let [there, back] = &memory.0;
        pass(cache_line(there, back), cache_line(back, there));
        pass(a_futex(there, back), a_futex(back, there));
        let bells = [0, 1].map(|_| eventfd(0, EventfdFlags::CLOEXEC).unwrap());
        let [there, back] = [(there, &bells[0]), (back, &bells[1])];
        pass(an_eventfd(there, back), an_eventfd(back, there));
    }
}
