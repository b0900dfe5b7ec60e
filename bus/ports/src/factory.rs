//! Every port that a process makes from its bus, in one place.
//!
//! Apart from the [`Bus`] itself, which its ports use and which therefore knows none of them.

use core::time::Duration;

use lager_topics::{Request, Stamp, Topic};

use crate::any::AnyPublisher;
use crate::bus::Bus;
use crate::error::PortError;
use crate::found::Found;
use crate::keeper::Keeper;
use crate::kept::{self, KeptError};
use crate::policy::Policy;
use crate::publisher::Publisher;
use crate::request::{Client, Server};
use crate::subscriber::Subscriber;
use crate::waiter::Waiter;

impl Bus {
    /// A writer of `T`, to be used in this thread. It rings the actors of `T`, now and later.
    ///
    /// # Errors
    /// Too many writers, a process of another build on the topic, or no resources.
    pub fn publisher<T: Topic>(&self) -> Result<Publisher<T>, PortError> {
        Publisher::new(self)
    }

    /// A reader of `T`, to be used in this thread.
    ///
    /// # Errors
    /// Too many readers, a process of another build on the topic, or no resources.
    pub fn subscriber<T: Topic>(&self) -> Result<Subscriber<T>, PortError> {
        Subscriber::new(self)
    }

    /// A reader of the topic called `name`, which this process need not know; `None` if no process
    /// has the topic open. To be used in this thread.
    ///
    /// # Errors
    /// As for a subscriber, or the topic does not describe its samples.
    pub fn found(&self, name: &str) -> Result<Option<Found>, PortError> {
        Found::new(self, name)
    }

    /// A writer of the topic called `name`: of the table, or of one that this process was not built
    /// with; `None` if no process has that one open. To be used in this thread.
    ///
    /// # Errors
    /// As for a publisher, or the topic does not describe its samples.
    pub fn any_publisher(&self, name: &str) -> Result<Option<AnyPublisher>, PortError> {
        AnyPublisher::new(self, name)
    }

    /// A waiter, which wakes this process when a topic that it acts on has samples; to be used in
    /// this thread.
    ///
    /// # Errors
    /// The role acts on nothing, or there are no resources.
    pub fn waiter(&self, policy: Policy) -> Result<Waiter, PortError> {
        Waiter::new(self, policy)
    }

    /// The asking side of `R`, to be used in this thread.
    ///
    /// # Errors
    /// Too many clients, a process of another build, or no resources.
    pub fn client<R: Request>(&self) -> Result<Client<R>, PortError> {
        Client::new(self)
    }

    /// The answering side of `R`, to be used in this thread.
    ///
    /// # Errors
    /// Too many servers, a process of another build, or no resources.
    pub fn server<R: Request>(&self) -> Result<Server<R>, PortError> {
        Server::new(self)
    }

    /// Keeps the last value of `T` for its writer's successor.
    ///
    /// # Errors
    /// As for a subscriber.
    pub fn keeper<T: Topic>(&self) -> Result<Keeper<T>, PortError> {
        Keeper::new(self)
    }

    /// The last value, from before this process's restart, of a topic that it writes itself, and the
    /// stamp that it was published with: how old it is decides what may be taken up. Waits at most
    /// `timeout` of real time. `None`: the topic can be read, and no value was kept.
    ///
    /// Call it before making the topic's publisher.
    ///
    /// # Errors
    /// The topic cannot be read, so it is not known whether a value was kept; faults that pass were
    /// waited for. A process that must resume from that value must not take this for a first start.
    pub fn kept<T: Topic>(
        &self,
        timeout: Duration,
    ) -> Result<Option<(T::Payload, Stamp)>, KeptError> {
        kept::kept::<T>(self, timeout)
    }
}
