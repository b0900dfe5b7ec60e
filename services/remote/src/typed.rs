//! [`Typed`]: a topic whose type this program has, heard from afar.

use std::marker::PhantomData;

use lager_ports::{Look, Raw, ReceiveError, Source};
use lager_sample::{Description, Topic, from_bytes};

use crate::listener::Listening;

/// A topic that has the same layout on the robot as in this program.
pub struct Typed<T> {
    heard: Listening,
    topic: PhantomData<fn() -> T>,
}

impl<T: Topic> Typed<T> {
    /// `None` if the robot is of another build, with another layout.
    pub(crate) fn of(heard: Listening) -> Option<Self> {
        let is_same = heard.layout().text() == Description::of::<T::Payload>().text();
        is_same.then_some(Self {
            heard,
            topic: PhantomData,
        })
    }
}

impl<T: Topic> Source for Typed<T> {
    fn next<L: Look>(&mut self, look: L) -> Result<Option<L::Output>, ReceiveError> {
        let Some((note, payload)) = self.heard.receive() else {
            return Ok(None);
        };
        let payload: Option<T::Payload> = from_bytes(&payload);
        let payload = payload.expect("the layouts are the same");
        let (lost, raw) = (self.lost(), Raw::of::<T>(&payload));
        Ok(Some(look.look_at(&note.stamp, lost, &payload, raw)))
    }

    fn description(&self) -> Description {
        self.heard.description()
    }

    fn lost(&self) -> u64 {
        self.heard.lost()
    }

    fn holds(&self) -> bool {
        self.heard.holds()
    }

    fn queue(&self) -> usize {
        self.heard.queue()
    }
}
