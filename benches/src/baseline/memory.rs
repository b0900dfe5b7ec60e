//! A slot in shared memory: watched without pause (`cacheline`), or with a `futex` or an `eventfd`
//! to sleep on.

use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::os::fd::OwnedFd;

use rustix::thread::futex;
use rustix::time::Timespec;

use super::{End, Fault, Slept, TIME_OUT, sleep_until, spin};
use crate::sample::Sample;

/// One cache line that holds a sample; the number is written last.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Slot {
    words: [AtomicU64; 8],
}

impl Slot {
    pub(crate) fn write(&self, sample: &Sample) {
        let words = sample.words();
        for (to, word) in self.words.iter().zip(words).skip(1) {
            to.store(word, Ordering::Relaxed);
        }
        self.words[0].store(words[0], Ordering::Release);
    }

    pub(crate) fn read(&self) -> Sample {
        let number = self.words[0].load(Ordering::Acquire);
        let mut words = [number; 8];
        for (word, from) in words.iter_mut().zip(&self.words).skip(1) {
            *word = from.load(Ordering::Relaxed);
        }
        Sample::from_words(words)
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

/// What both directions of a line need of shared memory.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Lane {
    pub(crate) slot: Slot,
    pub(crate) word: Word,
}

/// A cache line each way, watched without pause.
pub(crate) struct CacheLine<'memory> {
    out: &'memory Slot,
    back: &'memory Slot,
    seen: u64,
}

impl<'memory> CacheLine<'memory> {
    pub(crate) fn new(out: &'memory Lane, back: &'memory Lane) -> Self {
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
        self.seen = sample.number;
        Ok(sample)
    }
}

/// A cache line each way, and a futex to sleep on.
pub(crate) struct Futex<'memory> {
    out: &'memory Lane,
    back: &'memory Lane,
    seen: u32,
}

impl<'memory> Futex<'memory> {
    pub(crate) fn new(out: &'memory Lane, back: &'memory Lane) -> Self {
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
    out: &'memory Slot,
    back: &'memory Slot,
    ring: &'memory OwnedFd,
    bell: &'memory OwnedFd,
}

impl<'memory> EventFd<'memory> {
    pub(crate) fn new(
        (out, ring): (&'memory Lane, &'memory OwnedFd),
        (back, bell): (&'memory Lane, &'memory OwnedFd),
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
    struct Lanes([Lane; 2]);

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
    fn samples_come_back_over_a_cache_line() {
        let memory = Shared::<Lanes>::new().unwrap();
        let [there, back] = &memory.0;
        there_and_back(CacheLine::new(there, back), CacheLine::new(back, there));
    }

    #[test]
    fn samples_come_back_over_a_futex() {
        let memory = Shared::<Lanes>::new().unwrap();
        let [there, back] = &memory.0;
        there_and_back(Futex::new(there, back), Futex::new(back, there));
    }

    #[test]
    fn samples_come_back_over_an_eventfd() {
        use rustix::event::{EventfdFlags, eventfd};
        let memory = Shared::<Lanes>::new().unwrap();
        let bells = [0, 1].map(|_| eventfd(0, EventfdFlags::CLOEXEC).unwrap());
        let there = (&memory.0[0], &bells[0]);
        let back = (&memory.0[1], &bells[1]);
        there_and_back(EventFd::new(there, back), EventFd::new(back, there));
    }
}
