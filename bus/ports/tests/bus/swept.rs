//! Sweeping removes only what is certainly dead. Others on the bus notice nothing of it.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use iceoryx2::node::NodeView;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{CallbackProgression, EventId, Node, NodeState, ServiceName, ipc};
use lager_ports::remove_stale_nodes;
use lager_topics::Role;

use crate::domain::{Domain, sweep, until};
use crate::interop::stock;
use crate::process;

/// How often the robot beside the stranger is killed.
const KILLS: usize = 100;

fn named(name: &str) -> ServiceName {
    ServiceName::new(name).unwrap()
}

fn count(node: &Node<ipc::Service>) -> Subscriber<ipc::Service, u64, ()> {
    let service = node.service_builder(&named("stranger/count"));
    let service = service.publish_subscribe::<u64>().open_or_create().unwrap();
    service.subscriber_builder().create().unwrap()
}

/// A process of plain iceoryx2 on the robot's bus. It ends when anything has changed without its
/// doing: a sample or an event does not arrive, a service cannot be made or found, or its own node
/// is not listed as alive.
pub(crate) fn stranger(domain: &Domain, ready: impl Fn(), ends: &AtomicBool) {
    let node = stock(domain);
    let mut count = count(&node);
    let service = node.service_builder(&named("stranger/count"));
    let service = service.publish_subscribe::<u64>().open().unwrap();
    let publisher = service.publisher_builder().create().unwrap();
    let event = node.service_builder(&named("stranger/event")).event();
    let event = event.open_or_create().unwrap();
    let listener = event.listener_builder().create().unwrap();
    let notifier = event.notifier_builder().create().unwrap();
    for number in 0_u64.. {
        publisher.send_copy(number).unwrap();
        assert_eq!(*next(&mut count), number);
        notifier
            .notify_with_custom_event_id(EventId::new(1))
            .unwrap();
        let heard = listener.timed_wait(|_| (), Duration::from_secs(60));
        assert_eq!(heard.unwrap(), 1);
        // Makes descriptions and segments that are unfinished for a moment, also while others
        // sweep.
        let passing = node.service_builder(&named(&format!("stranger/passing/{number}")));
        let passing = passing.publish_subscribe::<u64>().create().unwrap();
        let port = passing.publisher_builder().create().unwrap();
        drop((port, passing));
        assert!(is_listed(&node));
        if number == 0 {
            ready();
        }
        if ends.load(Ordering::Relaxed) {
            return;
        }
    }
}

fn next(
    count: &mut Subscriber<ipc::Service, u64, ()>,
) -> iceoryx2::sample::Sample<ipc::Service, u64, ()> {
    count.receive().unwrap().unwrap()
}

fn is_listed(node: &Node<ipc::Service>) -> bool {
    let mut found = false;
    Node::<ipc::Service>::list(node.config(), |state| {
        found |= matches!(state, NodeState::Alive(view) if view.id() == node.id());
        CallbackProgression::Continue
    })
    .unwrap();
    found
}

#[test]
fn a_plain_iceoryx2_process_never_notices_a_robot_that_is_killed_and_swept() {
    let domain = Domain::new();
    let mut stranger = process::start(&domain, "stranger");
    let node = stock(&domain);
    let count = count(&node);
    let bus = domain.open(Role::Supervisor);
    let mut counted = 0;
    for kill in 0..KILLS {
        let part = ["line-writer", "deaf-bridge", "navigator", "line-reader"][kill % 4];
        process::start(&domain, part).kill();
        if kill % 2 == 0 {
            sweep(&bus, 1);
        } else {
            until("it is swept", || {
                remove_stale_nodes(&domain.config).unwrap() == 1
            });
        }
        // The stranger goes on after each sweep.
        let before = counted;
        until("the stranger counts on", || {
            assert!(
                stranger.is_running(),
                "the stranger has noticed kill {kill}"
            );
            while let Some(number) = count.receive().unwrap() {
                counted = *number;
            }
            counted > before
        });
    }
    drop(count);
    drop(node);
    assert!(stranger.end().success());
}

/// The file in which the transport keeps a process's details.
fn details_of(domain: &Domain, pid: u32) -> PathBuf {
    let is_its = |path: &PathBuf| {
        let text = fs::read(path).unwrap_or_default();
        let name = format!("/{pid}");
        path.extension().is_some_and(|end| end == "details")
            && text.windows(name.len()).any(|part| part == name.as_bytes())
    };
    domain.left_in_folder().into_iter().find(is_its).unwrap()
}

#[test]
fn a_dead_node_whose_details_cannot_be_read_keeps_what_it_has() {
    let domain = Domain::new();
    let bus = domain.open(Role::Supervisor);
    let writer = process::start(&domain, "line-writer");
    let details = details_of(&domain, writer.pid());
    writer.kill();
    let intact = fs::read(&details).unwrap();
    let permissions = fs::metadata(&details).unwrap().permissions();
    let put = |contents: &[u8]| {
        fs::set_permissions(&details, PermissionsExt::from_mode(0o600)).unwrap();
        fs::write(&details, contents).unwrap();
        fs::set_permissions(&details, permissions.clone()).unwrap();
    };
    put(b"of another version");
    let transport = || {
        let mut files = domain.left_in_folder();
        files.retain(|file| file.starts_with(domain.home().transport_folder()));
        (files, domain.in_shared_memory())
    };
    let before = transport();
    assert_eq!(bus.sweep(), 0);
    assert_eq!(transport(), before);
    put(&intact);
    sweep(&bus, 1);
}

#[test]
fn a_dead_node_that_was_writing_its_details_is_swept() {
    let domain = Domain::new();
    let bus = domain.open(Role::Supervisor);
    let onlooker = process::start(&domain, "onlooker");
    let details = details_of(&domain, onlooker.pid());
    onlooker.kill();
    fs::set_permissions(&details, PermissionsExt::from_mode(0o600)).unwrap();
    sweep(&bus, 1);
    assert!(!details.exists());
}

/// How many nodes start while another process sweeps.
const NEWCOMERS: usize = 2_000;

#[test]
fn a_node_that_is_made_while_others_sweep_is_there_afterwards() {
    let domain = Domain::new();
    let bus = domain.open(Role::Supervisor);
    std::thread::scope(|threads| {
        let comes = threads.spawn(|| {
            for number in 0..NEWCOMERS {
                let newcomer = domain.open(Role::Observer);
                assert!(newcomer.is_listed(), "a sweep has taken node {number}");
            }
        });
        while !comes.is_finished() {
            bus.sweep();
        }
    });
}
