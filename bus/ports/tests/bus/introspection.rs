//! What tools can find out about the bus.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;

use lager_home::BusWatch;
use lager_ports::{Bus, Layout, NodeState, Peer, nodes, remove_stale_nodes};
use lager_topics::{NavStatus, Role, SensorLine, TOPICS};
use lager_wake::Policy;

use crate::domain::{Domain, send};
use crate::process;

#[test]
fn topics_in_use_are_listed_with_their_ends() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let logic = domain.open(Role::Logic);
    let observer = domain.open(Role::Observer);
    let _writer = bridge.publisher::<SensorLine>().unwrap();
    let _actor = logic.subscriber::<SensorLine>().unwrap();
    let _observers = [
        observer.subscriber::<SensorLine>().unwrap(),
        observer.subscriber::<SensorLine>().unwrap(),
    ];
    let _status = logic.publisher::<NavStatus>().unwrap();

    let topics = observer.topics().unwrap();
    let names: Vec<_> = topics.iter().map(|topic| topic.name.as_str()).collect();
    assert_eq!(names, ["sensor/line", "nav/status"]);

    let line = &topics[0];
    assert_eq!(line.unit.as_str(), "r1");
    assert_eq!(line.layout, Layout::Ours);
    assert_eq!(line.entry.unwrap().name, "sensor/line");
    assert_eq!((line.publishers, line.subscribers), (1, 3));
    assert_eq!(line.observers, 2);
    let pid = std::process::id();
    assert_eq!(
        line.writers,
        [Peer {
            part: Some("bridge".into()),
            observes: false,
            pid
        }]
    );
    assert!(line.readers.contains(&Peer {
        part: Some("logic".into()),
        observes: false,
        pid
    }));
    assert_eq!((topics[1].publishers, topics[1].subscribers), (1, 0));
}

#[test]
fn who_is_woken_by_a_topic_is_told() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let observer = domain.open(Role::Observer);
    let woken = || observer.topics_of(observer.unit())[0].woken.clone();
    assert_eq!(woken(), []);

    let logic = domain.open(Role::Logic);
    let waiter = logic.waiter(Policy::Block).unwrap();
    let _deaf_to_lines = bridge.waiter(Policy::Block).unwrap();
    let here = Peer {
        part: Some("logic".into()),
        observes: false,
        pid: std::process::id(),
    };
    assert_eq!(woken(), std::slice::from_ref(&here));
    let player = process::start(&domain, "navigator-waits");
    let there = Peer {
        pid: player.pid(),
        ..here.clone()
    };
    assert_eq!(woken(), [here.clone(), there]);

    // A killed process is not shown, although nobody has swept yet and its seat is still rung.
    player.kill();
    send(&publisher, 0);
    assert_eq!(woken(), std::slice::from_ref(&here));
    drop(waiter);
    assert_eq!(woken(), []);
}

#[test]
fn looking_does_not_create_topics() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let all = observer.topics_of(observer.unit());
    assert_eq!(all.len(), TOPICS.len());
    assert!(all.iter().all(|topic| topic.layout == Layout::Unused));
    assert!(observer.topics().unwrap().is_empty());
}

/// Whether a watch reports a change, in two calls as it must, and then no change.
fn tells(watch: &mut BusWatch, observer: &Bus) -> bool {
    let told = [(); 3].map(|()| watch.has_changed(observer.home()));
    assert!(
        [[true, true, false], [false; 3]].contains(&told),
        "{told:?}"
    );
    told[0]
}

#[test]
fn a_watch_tells_when_services_come_and_go() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let mut watch = BusWatch::of_services();
    assert!(tells(&mut watch, &observer), "it was not known");
    let bridge = domain.open(Role::Bridge);
    let writer = bridge.publisher::<SensorLine>().unwrap();
    assert!(tells(&mut watch, &observer), "it has come");
    // A new reader of an existing topic changes no service.
    let reader = observer.subscriber::<SensorLine>().unwrap();
    assert!(!tells(&mut watch, &observer));
    drop((writer, reader));
    assert!(tells(&mut watch, &observer), "it has gone");
}

#[test]
fn a_watch_tells_when_ports_come_and_go() {
    let domain = Domain::new();
    let observer = domain.open(Role::Observer);
    let mut watch = BusWatch::of_ports();
    assert!(tells(&mut watch, &observer), "it was not known");
    let bridge = domain.open(Role::Bridge);
    let writer = bridge.publisher::<SensorLine>().unwrap();
    assert!(tells(&mut watch, &observer), "a writer");
    let reader = observer.subscriber::<SensorLine>().unwrap();
    assert!(tells(&mut watch, &observer), "a reader");
    drop(reader);
    assert!(tells(&mut watch, &observer), "the reader has gone");
    // Looking at the topics opens them all, which is not a change.
    observer.topics().unwrap();
    assert!(!tells(&mut watch, &observer));
    drop((writer, bridge));
    assert!(tells(&mut watch, &observer), "the writer has gone");
}

#[test]
fn topics_of_other_robots_are_seen_by_name() {
    let domain = Domain::new();
    let other = domain.open_robot("r2", Role::Bridge);
    let _writer = other.publisher::<SensorLine>().unwrap();
    let observer = domain.open_robot("r1", Role::Observer);
    let _own = observer.subscriber::<SensorLine>().unwrap();

    let seen: Vec<_> = observer
        .topics()
        .unwrap()
        .into_iter()
        .map(|topic| (topic.unit.to_string(), topic.publishers, topic.subscribers))
        .collect();
    assert_eq!(seen, [("r1".to_owned(), 0, 1), ("r2".to_owned(), 1, 0)]);

    let line = &observer.topics_of(other.unit())[0];
    assert_eq!((line.publishers, line.subscribers), (1, 0));
}

#[test]
fn processes_are_listed_with_robot_and_role() {
    let domain = Domain::new();
    let bridge = domain.open_robot("r1", Role::Bridge);
    let _logic = domain.open_robot("r2", Role::Logic);
    let listed = bridge.nodes().unwrap();
    let seen: Vec<_> = listed
        .iter()
        .map(|node| {
            (
                node.unit.as_ref().unwrap().as_str(),
                node.part.as_deref().unwrap(),
                node.pid,
                node.state,
            )
        })
        .collect();
    let pid = std::process::id();
    assert_eq!(
        seen,
        [
            ("r1", "bridge", pid, NodeState::Alive),
            ("r2", "logic", pid, NodeState::Alive)
        ]
    );
    assert_eq!(listed[0].name, format!("lager/r1/bridge/{pid}"));
}

#[test]
fn a_killed_process_is_listed_as_stale_until_it_is_removed() {
    let domain = Domain::new();
    assert_eq!(nodes(&domain.config).unwrap(), []);
    let player = process::start(&domain, "line-writer");
    let pid = player.pid();
    assert_eq!(nodes(&domain.config).unwrap()[0].state, NodeState::Alive);
    player.kill();

    let left = nodes(&domain.config).unwrap();
    assert_eq!(left.len(), 1);
    assert_eq!(left[0].state, NodeState::Stale);
    assert_eq!(
        (left[0].part.as_deref(), left[0].pid),
        (Some("bridge"), pid)
    );
    assert_ne!(domain.in_shared_memory(), Vec::<String>::new());

    assert_eq!(remove_stale_nodes(&domain.config).unwrap(), 1);
    assert_eq!(nodes(&domain.config).unwrap(), []);
    assert_eq!(domain.in_shared_memory(), Vec::<String>::new());
    assert_eq!(remove_stale_nodes(&domain.config).unwrap(), 0);
}

/// The folder in which the transport keeps the tags and details of the only node.
fn node_folder(domain: &Domain) -> PathBuf {
    let nodes = domain.home().transport_folder().join("nodes");
    let entries = std::fs::read_dir(nodes).unwrap().map(Result::unwrap);
    let mut folders = entries
        .map(|entry| entry.path())
        .filter(|path| path.is_dir());
    let folder = folders.next().unwrap();
    assert_eq!(folders.next(), None);
    folder
}

#[test]
fn a_process_killed_while_it_writes_a_tag_is_removed() {
    let domain = Domain::new();
    process::start(&domain, "line-writer").kill();
    let name = format!("{}7.port_tag", domain.home().prefix());
    let tag = node_folder(&domain).join(name);
    std::fs::write(&tag, "").unwrap();
    // As it is while the transport writes it.
    std::fs::set_permissions(&tag, Permissions::from_mode(0o600)).unwrap();
    assert_eq!(remove_stale_nodes(&domain.config).unwrap(), 1);
    assert_eq!(nodes(&domain.config).unwrap(), []);
}

#[test]
fn a_process_killed_while_it_leaves_is_removed() {
    let domain = Domain::new();
    process::start(&domain, "onlooker").kill();
    let folder = node_folder(&domain);
    let details = std::fs::read_dir(&folder)
        .unwrap()
        .map(|file| file.unwrap().path());
    let details = details.filter(|file| file.extension().unwrap() == "details");
    details.for_each(|file| std::fs::remove_file(file).unwrap());
    assert_eq!(nodes(&domain.config).unwrap()[0].name, "");
    assert_eq!(remove_stale_nodes(&domain.config).unwrap(), 1);
    assert_eq!(nodes(&domain.config).unwrap(), []);
}
