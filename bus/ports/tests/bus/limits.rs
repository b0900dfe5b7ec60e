//! Places and refusals: too many observers, another layout, another version's files.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::prelude::ZeroCopySend;
use lager_home::HomeError;
use lager_ports::{Bus, Cause, OpenError, PortError};
use lager_sample::{Field, FieldInfo, Make, Payload, Qos, Schema, Topic};
use lager_topics::{DistanceFrame, LineFrame, Role, SensorLine, SteeringCommand};
use lager_wake::{Policy, Wake};
use serde::{Deserialize, Serialize};

use crate::domain::{Domain, drain, send};

#[test]
fn sixty_four_observers_attach_and_the_next_is_told_why_not() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let mut observers: Vec<_> = (0..SensorLine::QOS.observers)
        .map(|index| {
            let role = [Role::Observer, Role::Monitor, Role::Recorder][index % 3];
            domain.open(role).subscriber::<SensorLine>().unwrap()
        })
        .collect();

    let refused = domain
        .open(Role::Observer)
        .subscriber::<SensorLine>()
        .unwrap_err();
    assert_eq!(
        refused,
        PortError::TooManyObservers {
            topic: "sensor/line".to_owned(),
            limit: 64
        }
    );
    assert!(refused.to_string().contains("already has 64 observers"));

    // Observers never keep an actor from working, nor its successor.
    let mut logic = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let mut successor = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let mut station = domain
        .open(Role::Station)
        .subscriber::<SensorLine>()
        .unwrap();

    send(&publisher, 7);
    for observer in &mut observers {
        assert_eq!(drain(observer), [7]);
    }
    for actor in [&mut logic, &mut successor, &mut station] {
        assert_eq!(drain(actor), [7]);
    }

    // A place that becomes free can be taken.
    observers.pop();
    observers.push(
        domain
            .open(Role::Observer)
            .subscriber::<SensorLine>()
            .unwrap(),
    );
}

#[test]
fn too_many_writers_are_refused_and_a_free_place_can_be_taken() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let limit = SensorLine::QOS.max_publishers();
    let mut writers: Vec<_> = (0..limit)
        .map(|_| bus.publisher::<SensorLine>().unwrap())
        .collect();
    assert_eq!(
        bus.publisher::<SensorLine>().unwrap_err(),
        PortError::TooManyWriters {
            topic: "sensor/line".to_owned(),
            limit
        }
    );
    writers.pop();
    assert!(bus.publisher::<SensorLine>().is_ok());
}

#[test]
fn too_many_waiters_are_refused_and_a_free_seat_can_be_taken() {
    let domain = Domain::new();
    let buses = [domain.open(Role::Logic), domain.open(Role::Logic)];
    let mut waiters: Vec<_> = (0..32)
        .map(|index| buses[index % 2].waiter(Policy::Block).unwrap())
        .collect();
    let refused = buses[0].waiter(Policy::Block).unwrap_err();
    assert_eq!(
        refused,
        PortError::TooManyWaiters {
            part: Role::Logic.part(),
            limit: 32
        }
    );
    assert!(refused.to_string().contains("stop a logic that runs twice"));
    // Another role has its own seats.
    assert!(domain.open(Role::Bridge).waiter(Policy::Block).is_ok());
    waiters.remove(3);
    assert!(buses[1].waiter(Policy::Block).is_ok());
}

/// The file of the bell board.
fn board_of(domain: &Domain) -> PathBuf {
    let board = domain.home().folder().join("r1/bells");
    assert!(board.exists(), "somebody waits");
    board
}

#[test]
fn a_board_of_another_build_is_refused_while_it_is_in_use_and_replaced_afterwards() {
    let domain = Domain::new();
    let bus = domain.open(Role::Logic);
    let waiter = bus.waiter(Policy::Block).unwrap();
    let board = board_of(&domain);
    let intact = std::fs::read(&board).unwrap();
    let mut other = intact.clone();
    other[0] ^= 0xff;
    std::fs::write(&board, &other).unwrap();

    let newcomer = domain.open(Role::Bridge);
    let refused = newcomer.waiter(Policy::Block).unwrap_err();
    assert!(
        matches!(refused, PortError::OtherLayout { .. }),
        "{refused:?}"
    );
    assert!(refused.to_string().contains("another build"));

    // A board that a build has left behind, and that nobody uses, does no harm.
    drop(waiter);
    for left in [&other[..], &intact[..100], &[]] {
        std::fs::write(&board, left).unwrap();
        let waiter = newcomer.waiter(Policy::Block).unwrap();
        let ringer = waiter.ringer();
        ringer.ring();
        assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
    }
}

/// `sensor/line` with another payload under the same name.
struct OtherType;

impl Topic for OtherType {
    const NAME: &'static str = SensorLine::NAME;
    type Payload = DistanceFrame;
    const QOS: Qos = SensorLine::QOS;
    const SUMMARY: &'static str = "A line topic of another build.";
}

/// A line frame with its fields exchanged: the same name, size and alignment.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct ExchangedFields {
    bits: u16,
    state: u8,
    packet_id: u8,
    link_epoch: u32,
}

// SAFETY: `repr(C)`, integers only.
#[allow(unsafe_code)]
unsafe impl ZeroCopySend for ExchangedFields {
    unsafe fn type_name() -> &'static str {
        LineFrame::TYPE_NAME
    }
}

// SAFETY: `repr(C)`, integers only, without padding.
#[allow(unsafe_code)]
unsafe impl Field for ExchangedFields {
    const MAKE: Make = LineFrame::MAKE;
    const SHAPE: u64 = 1;
    const BLANK: Self = Self {
        bits: 0,
        state: 0,
        packet_id: 0,
        link_epoch: 0,
    };
}

impl Schema for ExchangedFields {
    const TYPE_NAME: &'static str = LineFrame::TYPE_NAME;
    const HASH: u64 = 1;
    const FIELDS: &'static [FieldInfo] = &[];
}

impl Payload for ExchangedFields {}

struct OtherFields;

impl Topic for OtherFields {
    const NAME: &'static str = SensorLine::NAME;
    type Payload = ExchangedFields;
    const QOS: Qos = SensorLine::QOS;
    const SUMMARY: &'static str = "A line topic of another build.";
}

/// The same payload with a longer buffer than the running processes have.
struct OtherBuffer;

impl Topic for OtherBuffer {
    const NAME: &'static str = SensorLine::NAME;
    type Payload = LineFrame;
    const QOS: Qos = Qos {
        buffer: SensorLine::QOS.buffer * 2,
        ..SensorLine::QOS
    };
    const SUMMARY: &'static str = "A line topic of another build.";
}

fn is_refused<T: Topic>(domain: &Domain) -> String {
    let bus = domain.open(Role::Logic);
    let error = bus.subscriber::<T>().unwrap_err();
    assert!(matches!(error, PortError::OtherLayout { .. }), "{error:?}");
    assert_eq!(bus.publisher::<T>().unwrap_err(), error);
    error.to_string()
}

#[test]
fn a_changed_layout_is_refused_with_a_sentence() {
    let domain = Domain::new();
    assert_eq!(size_of::<ExchangedFields>(), size_of::<LineFrame>());
    assert_eq!(align_of::<ExchangedFields>(), align_of::<LineFrame>());
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();

    assert!(is_refused::<OtherType>(&domain).contains("another build is running"));
    assert!(is_refused::<OtherFields>(&domain).contains("another build is running"));
    assert!(is_refused::<OtherBuffer>(&domain).contains("another build is running"));

    // Processes with the right layout are not disturbed.
    let mut logic = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    send(&publisher, 1);
    assert_eq!(drain(&mut logic), [1]);
}

/// The file that describes the line topic to newcomers.
fn description_of_line(domain: &Domain) -> PathBuf {
    domain
        .left_in_folder()
        .into_iter()
        .find(|path| {
            path.extension().is_some_and(|end| end == "service")
                && std::fs::read_to_string(path).is_ok_and(|text| {
                    text.contains("sensor/line\"") && text.contains("PublishSubscribe")
                })
        })
        .expect("the topic's description lies in the folder")
}

#[test]
fn damaged_files_are_reported_with_what_to_do() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let description = description_of_line(&domain);
    let intact = std::fs::read(&description).unwrap();
    overwrite(&description, b"not a service");

    let bus = domain.open(Role::Logic);
    let error = bus.subscriber::<SensorLine>().unwrap_err();
    assert!(
        matches!(error, PortError::Damaged { .. }),
        "{error:?}: {error}"
    );
    assert!(error.to_string().contains("stop every process"));

    overwrite(&description, &intact);
    drop(publisher);
}

#[test]
fn a_topic_whose_creator_was_killed_half_way_is_made_anew() {
    let domain = Domain::new();
    let bus = domain.open(Role::Bridge);
    let description = {
        let _publisher = bus.publisher::<SensorLine>().unwrap();
        description_of_line(&domain)
    };
    assert!(!description.exists(), "the last user removes the topic");
    // The file looks like this between the first and the last step of its creation.
    std::fs::write(&description, []).unwrap();
    std::fs::set_permissions(&description, Permissions::from_mode(0o600)).unwrap();

    let mut subscriber = bus.subscriber::<SensorLine>().unwrap();
    let publisher = bus.publisher::<SensorLine>().unwrap();
    send(&publisher, 4);
    assert_eq!(drain(&mut subscriber), [4]);
}

/// Replaces the contents of a read-only file and leaves it read-only.
fn overwrite(path: &Path, contents: &[u8]) {
    let permissions = std::fs::metadata(path).unwrap().permissions();
    std::fs::set_permissions(path, Permissions::from_mode(0o600)).unwrap();
    std::fs::write(path, contents).unwrap();
    std::fs::set_permissions(path, permissions).unwrap();
}

#[test]
fn a_folder_of_the_greatest_length_carries_a_whole_robot() {
    let folder_of = |length: usize| {
        let mut folder = format!("/dev/shm/lplong{}", std::process::id());
        folder.push_str(&"x".repeat(length - folder.len()));
        PathBuf::from(folder)
    };
    let too_long = Domain::at(folder_of(60));
    let refused = Bus::open(&too_long.config, Role::Bridge).unwrap_err();
    std::fs::remove_dir(folder_of(60)).unwrap();
    std::mem::forget(too_long);
    let OpenError::Home(HomeError::FolderTooLong { limit, .. }) = refused else {
        panic!("60 bytes are too many: {refused}");
    };

    let domain = Domain::at(folder_of(limit));
    let bus = domain.open(Role::Bridge);
    let waiter = bus.waiter(Policy::Block).unwrap();
    let mut orders = bus.subscriber::<SteeringCommand>().unwrap();
    let publisher = bus.publisher::<SteeringCommand>().unwrap();
    publisher.send(Cause::OWN, Default::default()).unwrap();
    assert_eq!(waiter.wait(Duration::from_secs(60)), Wake::Rung);
    assert!(orders.receive().unwrap().is_some());
}
