//! [`World`]: the lines of a simulated robot's buttons, as the bridge asks for those of a chip.
//!
//! `truth/pose` says what they show, so that the bridge of a simulated robot takes the same way as
//! that of a real one. It is here because the bridge does not know of simulated worlds.

use std::cell::RefCell;
use std::io;
use std::time::{Duration, Instant};

use lager_bridge::buttons::{ButtonsConfig, Gpio, Lines, Movement, Survey};
use lager_orders::{Contact, Levels};
use lager_ports::{Bus, Subscriber};
use lager_topics::TruthPose;

/// How often it looks whether the world has told something.
const LOOK: Duration = Duration::from_millis(5);
/// How long the world may be silent when the lines are opened, in real time.
const SILENT: Duration = Duration::from_secs(2);

/// The world of the robot on this bus.
pub struct World<'a>(pub &'a Bus);

impl World<'_> {
    /// # Errors
    /// The bus refuses it, or the world tells nothing.
    fn seen(&self) -> io::Result<Seen> {
        let truth = self.0.subscriber().map_err(io::Error::other)?;
        let levels = Levels::default();
        let mut seen = Seen {
            truth,
            levels,
            at_ns: 0,
        };
        let end = Instant::now() + SILENT;
        while !seen.look()? {
            if Instant::now() > end {
                return Err(io::Error::new(
                    io::ErrorKind::TimedOut,
                    "the simulated world is silent",
                ));
            }
            std::thread::sleep(LOOK);
        }
        while seen.look()? {}
        Ok(seen)
    }
}

impl Gpio for World<'_> {
    fn open(&self, config: &ButtonsConfig) -> io::Result<Box<dyn Lines + '_>> {
        let seen = self.seen()?;
        let contacts = config.reset.into_iter().chain(config.switch).collect();
        Ok(Box::new(Contacts(RefCell::new(Watched {
            told: seen.levels,
            seen,
            contacts,
        }))))
    }

    fn survey(&self) -> io::Result<Box<dyn Survey + '_>> {
        Ok(Box::new(self.seen()?))
    }
}

/// What the world has told last.
struct Seen {
    truth: Subscriber<TruthPose>,
    levels: Levels,
    /// When, in ns of `CLOCK_MONOTONIC`.
    at_ns: u64,
}

impl Seen {
    /// Takes the next thing that the world has told, if there is one.
    fn look(&mut self) -> io::Result<bool> {
        let Some(truth) = self.truth.receive().map_err(io::Error::other)? else {
            return Ok(false);
        };
        self.levels = truth.levels();
        self.at_ns = truth.stamp().publish_time_ns;
        Ok(true)
    }
}

impl Survey for Seen {
    fn levels(&mut self) -> io::Result<Levels> {
        while self.look()? {}
        Ok(self.levels)
    }

    fn chip(&self) -> u8 {
        0
    }
}

/// The contacts of a configuration.
struct Contacts(RefCell<Watched>);

struct Watched {
    seen: Seen,
    contacts: Vec<Contact>,
    /// The levels whose movements are told.
    told: Levels,
}

/// Whether a contact is closed. An open line goes where its resistor pulls it.
fn is_closed(levels: &Levels, contact: Contact) -> bool {
    levels.of(contact.line) == Some(contact.closed)
}

impl Lines for Contacts {
    fn is_closed(&self, line: u8) -> io::Result<bool> {
        let watched = self.0.borrow();
        let mut contacts = watched.contacts.iter();
        let contact = contacts.find(|contact| contact.line == line);
        Ok(contact.is_some_and(|contact| is_closed(&watched.told, *contact)))
    }

    fn movement(&self, patience: Duration) -> io::Result<Option<Movement>> {
        let mut watched = self.0.borrow_mut();
        let end = Instant::now() + patience;
        loop {
            let Watched {
                seen,
                contacts,
                told,
            } = &mut *watched;
            // One contact after the other, and each movement before the next sample.
            for contact in contacts.iter() {
                let now = is_closed(&seen.levels, *contact);
                if now != is_closed(told, *contact) {
                    told.set(contact.line, seen.levels.of(contact.line));
                    return Ok(Some(Movement {
                        line: contact.line,
                        is_closed: now,
                        at_ns: seen.at_ns,
                    }));
                }
            }
            if !seen.look()? {
                if Instant::now() >= end {
                    return Ok(None);
                }
                std::thread::sleep(LOOK);
            }
        }
    }
}
