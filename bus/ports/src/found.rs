//! Reads topics that are not in this process's table, by the description that each topic carries.

use core::fmt;

use lager_sample::{Described, Description, Stamp, id};

use crate::bus::Bus;
use crate::error::{PortError, ReceiveError};
use crate::kind::Side;
use crate::service;
use crate::untyped::{Reader, Taken};
use crate::watcher::Watcher;

/// The reading end of a topic of which only the name is known; stays in the thread that made it.
pub struct Found {
    name: String,
    description: Description,
    reader: Reader,
}

impl Found {
    /// `None` if no process has the topic open.
    pub(crate) fn new(bus: &Bus, name: &str) -> Result<Option<Self>, PortError> {
        let found = service::found(bus, bus.unit(), name, Side::Public)?;
        let Some((service, description)) = found else {
            return Ok(None);
        };
        Ok(Some(Self {
            name: name.to_owned(),
            description,
            reader: Reader::of_found(bus, name, &service)?,
        }))
    }

    /// The topic's name behind `<family>/<unit>/`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The layout of the topic's samples, as the topic's creator states it.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The next sample, oldest first; `None` when there is nothing more.
    ///
    /// # Errors
    /// The transport failed.
    pub fn receive(&mut self) -> Result<Option<FoundSample<'_>>, ReceiveError> {
        Ok(self.receive_counted()?.map(|(sample, _)| sample))
    }

    /// The next sample, and how many samples were missed before it so far.
    ///
    /// # Errors
    /// The transport failed.
    pub fn receive_counted(&mut self) -> Result<Option<(FoundSample<'_>, u64)>, ReceiveError> {
        let description = &self.description;
        let taken = self.reader.receive()?;
        let lost = self.reader.streams().lost();
        Ok(taken.map(|taken| (FoundSample { taken, description }, lost)))
    }

    /// Lets each of its samples wake the thread of `watcher`.
    pub fn wakes(&self, watcher: &mut Watcher) {
        watcher.add(id(&self.name), self.reader.peek());
    }

    /// Samples missed, as [`crate::Subscriber::lost`] counts them.
    pub fn lost(&self) -> u64 {
        self.reader.streams().lost()
    }

    pub(crate) fn holds(&self) -> bool {
        self.reader.holds()
    }

    pub(crate) fn queue(&self) -> usize {
        self.reader.queue()
    }
}

impl fmt::Debug for Found {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Found")
            .field("name", &self.name)
            .field("lost", &self.lost())
            .finish_non_exhaustive()
    }
}

/// A received sample, read where the writer wrote it.
pub struct FoundSample<'found> {
    taken: Taken,
    description: &'found Description,
}

impl FoundSample<'_> {
    /// The stamp: when, why and by which process the sample was published, and its number.
    pub fn stamp(&self) -> &Stamp {
        self.taken.stamp()
    }

    /// The payload, which serde can serialize.
    #[allow(
        unsafe_code,
        reason = "the sample knows where its payload is, not what"
    )]
    pub fn payload(&self) -> Described<'_> {
        let size = self.description.size();
        // SAFETY: `service::found` has checked that a payload has `size` bytes. The reader holds
        // the sample, and the writer does not change it meanwhile.
        let bytes = unsafe { core::slice::from_raw_parts(self.taken.payload().as_ptr(), size) };
        let read = self.description.read(bytes);
        read.expect("as many bytes as the description says")
    }
}

impl fmt::Debug for FoundSample<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("FoundSample")
            .field("stamp", self.stamp())
            .finish_non_exhaustive()
    }
}
