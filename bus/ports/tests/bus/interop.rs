//! Plain iceoryx2 meets this crate: tools, bindings and other programs use `ipc::Service`, not this
//! crate's service type, and must notice no difference.

use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::NodeView;
use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::{
    AttributeVerifier, CallbackProgression, FilePath, Node, NodeBuilder, NodeState, PortFactory,
    SemanticString, Service, ServiceName, SignalHandlingMode, ipc,
};
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder::publish_subscribe::{Builder, PublishSubscribeOpenError};
use iceoryx2::service::port_factory::event;
use lager_home::Clock;
use lager_ports::{Cause, Difference, Peer, PortError};
use lager_sample::{Qos, Request, Schema, Stamp, Topic};
use lager_topics::{
    Ask, BridgeAnswer, BridgeRequest, LineFrame, NavStatus, NavigatorStatus, Role, SensorLine,
};
use lager_wake::{Policy, Wake};

use crate::domain::{Domain, frame, send};
use crate::process;

/// The configuration, as a plain program reads it from the output of `lager config --iceoryx2`.
fn config(domain: &Domain) -> Config {
    // Each process has its own file, because two may read theirs at once.
    let file = format!("iceoryx2.{}.toml", std::process::id());
    let file = domain.home().folder().join(file);
    std::fs::write(&file, domain.config.iceoryx2_toml().unwrap()).unwrap();
    let path = FilePath::new(file.as_os_str().as_encoded_bytes()).unwrap();
    let config = Config::from_file(&path).unwrap();
    std::fs::remove_file(file).unwrap();
    config
}

pub(crate) fn stock(domain: &Domain) -> Node<ipc::Service> {
    NodeBuilder::new()
        .config(&config(domain))
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .unwrap()
}

fn name(relative: &str) -> ServiceName {
    ServiceName::new(&format!("lager/r1/{relative}")).unwrap()
}

/// The service that everybody but the actors reads.
fn line(node: &Node<ipc::Service>) -> Builder<LineFrame, Stamp, ipc::Service> {
    line_service(node, SensorLine::NAME)
}

fn line_service(
    node: &Node<ipc::Service>,
    service: &str,
) -> Builder<LineFrame, Stamp, ipc::Service> {
    node.service_builder(&name(service))
        .publish_subscribe::<LineFrame>()
        .user_header::<Stamp>()
}

fn schema<A: Schema, B: Schema>() -> AttributeVerifier {
    let key = AttributeKey::new(b"lager.schema").unwrap();
    let value = format!("{:016x}.{:016x}", A::HASH, B::HASH);
    let value = AttributeValue::new(value.as_bytes()).unwrap();
    AttributeVerifier::new().require(&key, &value).unwrap()
}

#[test]
fn a_stock_subscriber_gets_our_samples_with_their_stamps() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();

    let node = stock(&domain);
    let service = line(&node)
        .open_with_attributes(&schema::<LineFrame, Stamp>())
        .unwrap();
    let limits = service.static_config();
    let qos: Qos = SensorLine::QOS;
    assert_eq!(limits.max_publishers(), qos.max_publishers());
    assert_eq!(limits.max_subscribers(), qos.max_subscribers());
    assert_eq!(limits.subscriber_max_buffer_size(), qos.buffer);
    let subscriber = service.subscriber_builder().create().unwrap();

    let before = Clock::monotonic_ns();
    for number in 0..500 {
        let mut loan = publisher.loan().unwrap();
        *loan = frame(number);
        loan.cause(Cause::event(u64::from(number) + 1));
        loan.send().unwrap();
        let sample = subscriber.receive().unwrap().unwrap();
        assert_eq!(*sample.payload(), frame(number));
        let stamp = sample.user_header();
        assert_eq!(stamp.sequence, u64::from(number));
        assert_eq!(stamp.source_time_ns, u64::from(number) + 1);
        assert!((before..=Clock::monotonic_ns()).contains(&stamp.publish_time_ns));
        assert_eq!(stamp.epoch, publisher.epoch());
        assert_eq!(stamp.writer, std::process::id());
    }
    assert!(subscriber.receive().unwrap().is_none());
}

#[test]
fn our_subscribers_get_the_samples_of_a_stock_publisher_on_their_service() {
    let domain = Domain::new();
    let node = stock(&domain);
    let mut readers = [Role::Logic, Role::Observer]
        .map(|role| domain.open(role).subscriber::<SensorLine>().unwrap());
    // A plain program whose samples are to be acted upon must write to the actors' service too. So
    // no program moves the robot by writing to the service that others only watch.
    let publishers = ["sensor/line:actors", SensorLine::NAME].map(|service| {
        let service = line_service(&node, service)
            .open_with_attributes(&schema::<LineFrame, Stamp>())
            .unwrap();
        service.publisher_builder().create().unwrap()
    });
    for number in 0..500 {
        for side in 0..2 {
            let mut sample = publishers[side].loan().unwrap();
            *sample.payload_mut() = frame(number);
            *sample.user_header_mut() = Stamp {
                // Every third number is missing.
                sequence: u64::from(number) * 3 / 2,
                epoch: 1,
                writer: 7,
                ..Stamp::default()
            };
            assert_eq!(sample.send().unwrap(), 1);
            let received = readers[side].receive().unwrap().unwrap();
            assert_eq!(*received, frame(number));
            assert_eq!(received.stamp().writer, 7);
            drop(received);
            assert!(readers[1 - side].receive().unwrap().is_none());
        }
    }
    for reader in &readers {
        assert_eq!((reader.received(), reader.lost()), (500, 249));
    }
    // It counts as one writer, because it is one program.
    let line = domain.open(Role::Observer).topics().unwrap().remove(0);
    assert_eq!((line.publishers, line.subscribers), (1, 2));
    assert_eq!(
        line.writers,
        [Peer {
            part: None,
            pid: 0,
            observes: false,
        }]
    );
}

#[test]
fn a_hostile_stamp_silences_nobody_and_makes_no_loss() {
    let domain = Domain::new();
    let node = stock(&domain);
    let supervisor = domain.open(Role::Supervisor);
    let mut keeper = supervisor.keeper::<NavStatus>().unwrap();
    let bus = domain.open(Role::Logic);
    let publisher = bus.publisher::<NavStatus>().unwrap();
    let mut subscriber = supervisor.subscriber::<NavStatus>().unwrap();
    let hostile = node
        .service_builder(&name(NavStatus::NAME))
        .publish_subscribe::<NavigatorStatus>()
        .user_header::<Stamp>()
        .open_with_attributes(&schema::<NavigatorStatus, Stamp>())
        .unwrap()
        .publisher_builder()
        .create()
        .unwrap();
    let status = |order_id| NavigatorStatus {
        order_id,
        ..NavigatorStatus::default()
    };
    publisher.send(Cause::OWN, status(1)).unwrap();
    for epoch in [publisher.epoch(), 1, u64::MAX] {
        let sample = hostile.loan_uninit().unwrap();
        let mut sample = sample.write_payload(status(666));
        *sample.user_header_mut() = Stamp {
            sequence: u64::MAX,
            source_time_ns: u64::MAX,
            publish_time_ns: u64::MAX,
            epoch,
            writer: std::process::id(),
            ..Stamp::default()
        };
        sample.send().unwrap();
        if let Some(latest) = subscriber.latest().unwrap() {
            assert_eq!(latest.order_id, 1);
        }
        keeper.remember().unwrap();
        assert_eq!(keeper.value().unwrap().0.order_id, 1);
    }
    publisher.send(Cause::OWN, status(2)).unwrap();
    assert_eq!(subscriber.latest().unwrap().unwrap().order_id, 2);
    keeper.remember().unwrap();
    assert_eq!(keeper.value().unwrap().0.order_id, 2);
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn a_topic_that_stock_made_is_ours_too() {
    let domain = Domain::new();
    let node = stock(&domain);
    let qos = SensorLine::QOS;
    let key = AttributeKey::new(b"lager.schema").unwrap();
    let made = line(&node)
        .max_publishers(qos.max_publishers())
        .max_subscribers(qos.max_subscribers())
        .max_nodes(qos.max_nodes())
        .subscriber_max_buffer_size(qos.buffer)
        .subscriber_max_borrowed_samples(4)
        .history_size(qos.history)
        .open_or_create_with_attributes(&schema::<LineFrame, Stamp>())
        .unwrap();
    let subscriber = made.subscriber_builder().create().unwrap();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 5);
    let sample = subscriber.receive().unwrap().unwrap();
    assert_eq!(sample.payload().link_epoch, 5);
    assert_eq!(made.attributes().number_of_key_values(&key), 1);
    // The topic does not describe its samples.
    let found = bus.found(SensorLine::NAME).unwrap_err();
    let topic = SensorLine::NAME.to_owned();
    let difference = Difference::Undescribed;
    assert_eq!(found, PortError::OtherLayout { topic, difference });
}

#[test]
fn stock_is_refused_with_another_layout() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let _publisher = bus.publisher::<SensorLine>().unwrap();
    let node = stock(&domain);
    let other = line(&node).open_with_attributes(&schema::<Stamp, Stamp>());
    assert_eq!(
        other.unwrap_err(),
        PublishSubscribeOpenError::IncompatibleAttributes
    );
    let without_header = node
        .service_builder(&name(SensorLine::NAME))
        .publish_subscribe::<LineFrame>()
        .open();
    assert_eq!(
        without_header.unwrap_err(),
        PublishSubscribeOpenError::IncompatibleTypes
    );
}

/// The event service beside the line topic, opened as by a plain process that knows only its name.
fn line_events(node: &Node<ipc::Service>) -> event::PortFactory<ipc::Service> {
    node.service_builder(&name(SensorLine::NAME))
        .event()
        .open_or_create()
        .unwrap()
}

/// A plain listener on that service, with the node that keeps it alive.
pub(crate) fn stock_listener_of_line(
    domain: &Domain,
) -> (Node<ipc::Service>, Listener<ipc::Service>) {
    let node = stock(domain);
    let listener = line_events(&node).listener_builder().create().unwrap();
    (node, listener)
}

#[test]
fn a_stock_listener_is_notified_of_every_sample() {
    let domain = Domain::new();
    let node = stock(&domain);
    let bus = domain.open(Role::Bridge);
    let early = bus.publisher::<SensorLine>().unwrap();
    let listener = line_events(&node).listener_builder().create().unwrap();
    // A publisher that comes after the listener notifies it like an earlier one.
    let late = bus.publisher::<SensorLine>().unwrap();
    for publisher in [&early, &late, &early] {
        assert_eq!(listener.try_wait(|_| ()).unwrap(), 0);
        send(publisher, 1);
        let mut told = Vec::new();
        let rings = listener
            .timed_wait(
                |event| told.push(event.id.as_value()),
                Duration::from_secs(60),
            )
            .unwrap();
        assert_eq!((rings, &told[..]), (1, &[0][..]));
    }
    // When the listener is gone, sending goes on. The listener may come back.
    drop(listener);
    send(&early, 2);
    let listener = line_events(&node).listener_builder().create().unwrap();
    send(&early, 3);
    let woken = listener.timed_wait(|_| (), Duration::from_secs(60));
    assert_eq!(woken.unwrap(), 1);
}

#[test]
fn a_stock_listener_that_was_first_is_notified_too() {
    let domain = Domain::new();
    let node = stock(&domain);
    let events = node
        .service_builder(&name(SensorLine::NAME))
        .event()
        .max_notifiers(SensorLine::QOS.max_publishers())
        .max_nodes(SensorLine::QOS.max_nodes())
        .open_or_create()
        .unwrap();
    let listener = events.listener_builder().create().unwrap();
    let bus = domain.open(Role::Bridge);
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 1);
    let woken = listener.timed_wait(|_| (), Duration::from_secs(60));
    assert_eq!(woken.unwrap(), 1);
}

#[test]
fn our_waiters_are_rung_beside_a_stock_listener() {
    let domain = Domain::new();
    let node = stock(&domain);
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let listener = line_events(&node).listener_builder().create().unwrap();
    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    send(&publisher, 1);
    assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
    assert_eq!(listener.try_wait(|_| ()).unwrap(), 1);
}

#[test]
fn stock_asks_and_our_server_answers() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let server = bus.server::<BridgeRequest>().unwrap();
    let node = stock(&domain);
    let service = node
        .service_builder(&name(BridgeRequest::NAME))
        .request_response::<Ask, BridgeAnswer>()
        .open_with_attributes(&schema::<Ask, BridgeAnswer>())
        .unwrap();
    let client = service.client_builder().create().unwrap();
    let pending = client
        .send_copy(Ask {
            gain_p: 9,
            ..Ask::default()
        })
        .unwrap();
    let answer = |ask: &Ask| BridgeAnswer {
        gain_p: ask.gain_p,
        ..BridgeAnswer::default()
    };
    assert_eq!(server.serve(answer).unwrap(), 1);
    assert_eq!(pending.receive().unwrap().unwrap().payload().gain_p, 9);
}

#[test]
fn stock_sees_our_nodes_and_topics_and_sweeps_the_killed() {
    let domain = Domain::new();
    let player = process::start(&domain, "line-writer");
    let pid = player.pid();
    let node = stock(&domain);

    let mut topics = Vec::new();
    ipc::Service::list(node.config(), |details| {
        topics.push(details.static_details.name().to_string());
        CallbackProgression::Continue
    })
    .unwrap();
    assert!(
        topics.contains(&name(SensorLine::NAME).to_string()),
        "{topics:?}"
    );

    let alive = |wanted: bool| {
        let mut found = false;
        Node::<ipc::Service>::list(node.config(), |state| {
            let details = match &state {
                NodeState::Alive(view) if wanted => view.details().clone(),
                NodeState::Dead(view) if !wanted => view.details().clone(),
                _ => None,
            };
            found |= details
                .is_some_and(|details| details.name().as_str() == format!("lager/r1/bridge/{pid}"));
            CallbackProgression::Continue
        })
        .unwrap();
        found
    };
    assert!(alive(true));
    player.kill();
    assert!(alive(false));
    let swept = node.blocking_cleanup_dead_nodes(Duration::from_secs(60));
    assert_eq!((swept.cleanups, swept.failed_cleanups), (1, 0));
    assert!(!alive(false));
}
