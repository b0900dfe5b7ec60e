//! A slot in shared memory: watched without pause (`cacheline`), or with a `futex` or an `eventfd`
//! to sleep on.

use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::os::fd::OwnedFd;

use rustix::thread::futex;
use rustix::time::Timespec;

use super::{End, Fault, Slept, TIME_OUT, sleep_until, spin};
use crate::sample::{Block, Sample};

/// A cache line that holds a block; the number is written last.
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
    /// Counts up and wakes one sleeper, sleeping or not.
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

/// What one direction of a line needs of shared memory.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Lane<const WORDS: usize> {
    pub(crate) slot: Slot<WORDS>,
    pub(crate) word: Word,
}

/// A cache line each way, watched without pause.
pub(crate) struct CacheLine<'memory> {
    out: &'memory Slot<8>,
    back: &'memory Slot<8>,
    seen: u64,
}

impl<'memory> CacheLine<'memory> {
    pub(crate) fn new(out: &'memory Lane<8>, back: &'memory Lane<8>) -> Self {
        Self {
            out: &out.slot,
            back: &back.slot,
            seen: back.slot.number(),
        }
    }
}

impl End for CacheLine<'_> {
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        self.out.write(sample);
        Ok(())
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        let (back, seen) = (self.back, self.seen);
        spin(|| Ok((back.number() != seen).then_some(())))?;
        let sample = back.read();
        self.seen = sample.number();
        Ok(sample)
    }
}

/// A cache line each way, and a futex to sleep on.
pub(crate) struct Futex<'memory> {
    out: &'memory Lane<8>,
    back: &'memory Lane<8>,
    seen: u32,
}

impl<'memory> Futex<'memory> {
    pub(crate) fn new(out: &'memory Lane<8>, back: &'memory Lane<8>) -> Self {
        Self {
            out,
            back,
            seen: back.word.count(),
        }
    }
}

impl End for Futex<'_> {
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        self.out.slot.write(sample);
        Ok(self.out.word.wake()?)
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        let (word, seen) = (&self.back.word, self.seen);
        self.seen = sleep_until(
            || {
                let count = word.count();
                Ok((count != seen).then_some(count))
            },
            || Ok(word.sleep(seen)?),
        )?;
        Ok(self.back.slot.read())
    }
}

/// A cache line each way, and an eventfd to sleep on, without a time-out.
pub(crate) struct EventFd<'memory> {
    out: &'memory Slot<8>,
    back: &'memory Slot<8>,
    ring: &'memory OwnedFd,
    bell: &'memory OwnedFd,
}

impl<'memory> EventFd<'memory> {
    pub(crate) fn new(
        (out, ring): (&'memory Lane<8>, &'memory OwnedFd),
        (back, bell): (&'memory Lane<8>, &'memory OwnedFd),
    ) -> Self {
        Self {
            out: &out.slot,
            back: &back.slot,
            ring,
            bell,
        }
    }
}

impl End for EventFd<'_> {
    fn send(&mut self, sample: &Sample) -> Result<(), Fault> {
        self.out.write(sample);
        rustix::io::write(self.ring, &1_u64.to_ne_bytes())?;
        Ok(())
    }

    fn receive(&mut self) -> Result<Sample, Fault> {
        let mut count = [0; 8];
        rustix::io::read(self.bell, &mut count)?;
        Ok(self.back.read())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_rig::{Shareable, Shared};

    #[repr(C)]
    struct Lanes([Lane<8>; 2]);

    // SAFETY: atomics only.
    #[allow(unsafe_code)]
    unsafe impl Shareable for Lanes {}

    fn there_and_back(mut first: impl End + Send, mut second: impl End + Send) {
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for _ in 0..100 {
                    let sample = second.receive().unwrap();
                    second.send(&sample).unwrap();
                }
            });
            for number in 1..=100 {
                first.send(&Sample::new(number)).unwrap();
                assert_eq!(first.receive().unwrap(), Sample::new(number));
            }
        });
    }

    #[test]
    fn samples_come_back_over_each_of_them() {
        use rustix::event::{EventfdFlags, eventfd};
        let memory = Shared::<Lanes>::new().unwrap();
        let [there, back] = &memory.0;
        there_and_back(CacheLine::new(there, back), CacheLine::new(back, there));
        there_and_back(Futex::new(there, back), Futex::new(back, there));
        let bells = [0, 1].map(|_| eventfd(0, EventfdFlags::CLOEXEC).unwrap());
        let [there, back] = [(there, &bells[0]), (back, &bells[1])];
        there_and_back(EventFd::new(there, back), EventFd::new(back, there));
    }
}
