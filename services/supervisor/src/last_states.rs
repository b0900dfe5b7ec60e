//! The attendant's memory: the last state that each service has published. The attendant hands it
//! to the successor of a service that had to be restarted.
//!
//! A service that is restarted with `--resume` reads the last sample of its own topic. Once the
//! process that published it is gone, that sample comes from here. Each topic is handled
//! separately, so a fault on one does not leave another service without its state.

use anyhow::{Context, Result};
use lager_ports::{Bus, Keeper};
use lager_sample::Topic;
use lager_topics::{LinkHealth, MissionQueue, NavBlocks, NavMap, NavStatus, TruthPose};

use crate::service::Service;

/// Keeps each state from which a service goes on.
pub(crate) struct LastStates {
    bridge: Keeper<LinkHealth>,
    logic: Keeper<NavStatus>,
    blocks: Keeper<NavBlocks>,
    queue: Keeper<MissionQueue>,
    body: Keeper<TruthPose>,
    map: Keeper<NavMap>,
    /// The services whose successors have not got their state yet.
    owed: Vec<Service>,
}

impl LastStates {
    /// Starts to listen; nothing is remembered yet.
    pub(crate) fn new(bus: &Bus) -> Result<Self> {
        Ok(Self {
            bridge: bus.keeper()?,
            logic: bus.keeper()?,
            blocks: bus.keeper()?,
            queue: bus.keeper()?,
            body: bus.keeper()?,
            map: bus.keeper()?,
            owed: Vec::new(),
        })
    }

    /// Remembers the newest sample of every service, and serves successors that have just started.
    /// A killed service's last sample exists until its node is swept, so this runs before each
    /// sweep. Returns what went wrong.
    pub(crate) fn remember(&mut self) -> Vec<Result<()>> {
        vec![
            remember(&mut self.bridge),
            remember(&mut self.logic),
            remember(&mut self.blocks),
            remember(&mut self.queue),
            remember(&mut self.body),
            remember(&mut self.map),
        ]
    }

    /// A service has ended: its successor needs its state.
    pub(crate) fn owe(&mut self, service: Service) {
        self.owed.retain(|owed| *owed != service);
        self.owed.push(service);
    }

    /// Publishes the states that successors need. If that fails for one, it stays on the list.
    /// Returns the services that were served.
    pub(crate) fn hand_over(&mut self) -> Vec<Result<Service>> {
        let mut results = Vec::new();
        for service in core::mem::take(&mut self.owed) {
            // The dead process may have published its last sample after the last look.
            let served = match service {
                Service::Bridge => hand_over(&mut self.bridge),
                Service::Logic => {
                    let blocks = hand_over(&mut self.blocks);
                    let queue = hand_over(&mut self.queue);
                    hand_over(&mut self.logic).and(blocks).and(queue)
                }
                Service::Simulator | Service::Emulator => hand_over(&mut self.body),
                Service::Comm => hand_over(&mut self.map),
                Service::Attendant | Service::Station | Service::Gateway => Ok(()),
            };
            if served.is_err() {
                self.owed.push(service);
            }
            results.push(served.map(|()| service));
        }
        results
    }
}

fn remember<T: Topic>(keeper: &mut Keeper<T>) -> Result<()> {
    let name = T::NAME;
    keeper
        .remember()
        .with_context(|| format!("cannot keep the last of {name}"))
}

fn hand_over<T: Topic>(keeper: &mut Keeper<T>) -> Result<()> {
    // An earlier state is better than none.
    let remembered = remember(keeper);
    let name = T::NAME;
    let served = keeper
        .hand_over()
        .with_context(|| format!("cannot hand {name} over"));
    served.and(remembered.or_else(|error| match keeper.value() {
        Some(_) => Ok(()),
        None => Err(error),
    }))
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use lager_ports::{BusConfig, Cause, Publisher};
    use lager_topics::{BlockedWays, LAGER, NavigatorStatus, OrderQueue, Role};

    use super::*;

    /// Publishes one value and is gone, as a service that was killed.
    fn published<T: Topic>(bus: &Bus, states: &mut LastStates, value: T::Payload) {
        let publisher = bus.publisher::<T>().expect("a place");
        publisher.send(Cause::OWN, value).expect("room");
        states
            .remember()
            .into_iter()
            .for_each(|kept| kept.expect("kept"));
    }

    /// What a successor of logic finds while the states serve it.
    fn found(bus: &Bus, states: &mut LastStates) -> (Option<i16>, Option<u8>, Option<u32>) {
        let wait = Duration::from_millis(500);
        let bus = bus.clone();
        let successor = std::thread::spawn(move || {
            let status = bus.kept::<NavStatus>(wait).expect("readable");
            let blocks = bus.kept::<NavBlocks>(wait).expect("readable");
            let queue = bus.kept::<MissionQueue>(wait).expect("readable");
            (
                status.map(|(status, _)| status.x),
                blocks.map(|(blocks, _)| blocks.width),
                queue.map(|(queue, _)| queue.order_id),
            )
        });
        while !successor.is_finished() {
            states.remember();
            std::thread::sleep(Duration::from_millis(5));
        }
        successor.join().expect("it does not panic")
    }

    #[test]
    fn a_topic_that_cannot_be_handed_over_keeps_no_other_back_and_is_tried_again() {
        let folder = format!("/dev/shm/lagkeep{}", std::process::id());
        let config = BusConfig {
            folder: Some(Path::new(&folder).to_owned()),
            ..BusConfig::of(&LAGER)
        };
        {
            let bus = Bus::open(&config, Role::Supervisor).expect("a bus");
            let mut states = LastStates::new(&bus).expect("a keeper for each topic");
            let (x, width, order_id) = (5, 7, 9);
            let status = NavigatorStatus {
                x,
                ..NavigatorStatus::default()
            };
            let blocks = BlockedWays {
                width,
                ..BlockedWays::default()
            };
            let queue = OrderQueue {
                order_id,
                ..OrderQueue::default()
            };
            published::<NavStatus>(&bus, &mut states, status);
            published::<NavBlocks>(&bus, &mut states, blocks);
            published::<MissionQueue>(&bus, &mut states, queue);

            // Every writer's place of one topic is taken.
            let mut writers: Vec<Publisher<NavBlocks>> = Vec::new();
            while let Ok(writer) = bus.publisher() {
                writers.push(writer);
            }
            states.owe(Service::Logic);
            let served = states.hand_over();
            assert!(matches!(served[..], [Err(_)]), "{served:?}");
            assert_eq!(found(&bus, &mut states), (Some(x), None, Some(order_id)));

            writers.clear();
            let served = states.hand_over();
            assert!(matches!(served[..], [Ok(Service::Logic)]), "{served:?}");
            assert_eq!(
                found(&bus, &mut states),
                (Some(x), Some(width), Some(order_id))
            );
            assert!(states.hand_over().is_empty(), "nothing is owed");
        }
        config.home().expect("a folder").remove();
    }
}
