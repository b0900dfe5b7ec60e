//! Makes every kind of port from a process's [`Bus`]: publishers, subscribers, waiters, watchers,
//! requests.
//!
//! It is apart from [`Bus`] because the ports use the bus, so the bus must not depend on the ports.

use core::time::Duration;

use lager_sample::{Request, Stamp, Topic};
use lager_wake::{Policy, Waiter};

use crate::any::AnyPublisher;
use crate::bus::Bus;
use crate::error::PortError;
use crate::found::Found;
use crate::keeper::Keeper;
use crate::kept::{self, KeptError};
use crate::publisher::Publisher;
use crate::request::{Client, Server};
use crate::subscriber::Subscriber;
use crate::untyped::republish_states;
use crate::watcher::Watcher;

impl Bus {
    /// A writer of `T`, for this thread. It also rings those actors of `T` that start later.
    ///
    /// # Errors
    /// Too many writers, a process of another build uses the topic, or a resource is used up.
    pub fn publisher<T: Topic>(&self) -> Result<Publisher<T>, PortError> {
        Publisher::new(self)
    }

    /// A reader of `T`, for this thread.
    ///
    /// # Errors
    /// Too many readers, a process of another build uses the topic, or a resource is used up.
    pub fn subscriber<T: Topic>(&self) -> Result<Subscriber<T>, PortError> {
        Subscriber::new(self)
    }

    /// A reader of the topic called `name`, for this thread. The topic need not be in this
    /// process's table. `None` if no process has the topic open.
    ///
    /// # Errors
    /// As for a subscriber, or the topic states no description of its samples.
    pub fn found(&self, name: &str) -> Result<Option<Found>, PortError> {
        Found::new(self, name)
    }

    /// A writer of the topic called `name`, for this thread. The topic is in this process's table
    /// or open in another process; otherwise `None`.
    ///
    /// # Errors
    /// As for a publisher, or the topic states no description of its samples.
    pub fn any_publisher(&self, name: &str) -> Result<Option<AnyPublisher>, PortError> {
        AnyPublisher::new(self, name)
    }

    /// A waiter, for this thread. It wakes the thread when a topic has samples on which this
    /// process acts.
    ///
    /// # Errors
    /// This process is an observer, which cannot wait, or a resource is used up.
    pub fn waiter(&self, policy: Policy) -> Result<Waiter, PortError> {
        let part = self.part();
        if part.is_observer() {
            return Err(PortError::NotAnActor { part });
        }
        Waiter::new(self.board(), part, policy, republish_states)
            .map_err(|fault| PortError::of_bell(part, fault))
    }

    /// A watcher, for this thread. It wakes the thread when a topic has a sample that this process
    /// only observes. There may be any number of watchers.
    ///
    /// # Errors
    /// A process of another build is on the bus, or a resource is used up.
    pub fn watcher(&self) -> Result<Watcher, PortError> {
        Watcher::new(self).map_err(|fault| PortError::of_bell(self.part(), fault))
    }

    /// The asking side of `R`, for this thread.
    ///
    /// # Errors
    /// Too many clients, a process of another build uses the request, or a resource is used up.
    pub fn client<R: Request>(&self) -> Result<Client<R>, PortError> {
        Client::new(self)
    }

    /// The answering side of `R`, for this thread.
    ///
    /// # Errors
    /// Too many servers, a process of another build uses the request, or a resource is used up.
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

    /// The last value that this process published on a topic before it was restarted, with the
    /// stamp of that sample. The stamp's age decides whether the process may go on with the value.
    /// Waits at most `timeout` of real time. `None`: no keeper has a value.
    ///
    /// Call it before making the topic's publisher.
    ///
    /// # Errors
    /// The topic cannot be read even after several attempts, so it is not known whether a keeper
    /// has a value. A process that must resume from that value must not take this for its first
    /// start.
    pub fn kept<T: Topic>(
        &self,
        timeout: Duration,
    ) -> Result<Option<(T::Payload, Stamp)>, KeptError> {
        kept::kept::<T>(self, timeout)
    }
}
