//! Files that were never finished, were emptied, or belong to another user: no process waits for
//! ever, and files that no process uses are removed.

use std::fs::{self, File, OpenOptions, Permissions};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt, chown};
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::Duration;

use lager_home::{Inventory, mend};
use lager_ports::{Bus, BusConfig, OpenError};
use lager_rig::Process;
use lager_topics::{LAGER, Role, SensorDistance, SensorLine};

use crate::domain::{Domain, drain, send};
use crate::process;

/// The result of `work`, which must come within a minute; everything here takes less.
fn in_time<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, result) = mpsc::channel();
    std::thread::spawn(move || done.send(work()));
    result
        .recv_timeout(Duration::from_secs(60))
        .expect("it waits for ever")
}

fn open(config: &BusConfig) -> Result<Bus, OpenError> {
    let config = config.clone();
    in_time(move || Bus::open(&config, Role::Observer))
}

/// Makes a segment as it is between `shm_open` and `ftruncate`.
fn leave_empty(path: &PathBuf) {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true).mode(0o200);
    drop(options.open(path).unwrap());
}

fn counter(domain: &Domain) -> PathBuf {
    let segments = domain.home().segments();
    let counter = |path: &PathBuf| path.extension().is_some_and(|end| end == "global_mgmt");
    segments
        .into_iter()
        .find(counter)
        .expect("every bus has it")
}

fn dynamic(domain: &Domain) -> Vec<PathBuf> {
    let mut segments = domain.home().segments();
    segments.retain(|path| path.extension().is_some_and(|end| end == "dynamic"));
    segments
}

#[test]
fn the_counter_of_a_killed_creator_is_made_anew() {
    let domain = Domain::new();
    drop(domain.open(Role::Observer));
    let counter = counter(&domain);
    fs::remove_file(&counter).unwrap();
    leave_empty(&counter);
    drop(open(&domain.config).unwrap());
    assert_eq!(fs::metadata(&counter).unwrap().len(), 16);
    // The same holds for a file that somebody has emptied, shortened or overwritten.
    for contents in [&[][..], &[7; 3], &[7; 16], &[7; 900]] {
        fs::write(&counter, contents).unwrap();
        drop(open(&domain.config).unwrap());
        assert_eq!(fs::metadata(&counter).unwrap().len(), 16);
    }
}

#[test]
fn the_counter_is_its_users_alone() {
    let domain = Domain::new();
    let bus = domain.open(Role::Observer);
    let counter = counter(&domain);
    assert_eq!(counter.metadata().unwrap().mode() & 0o777, 0o600);
    // A tool of plain iceoryx2 makes it like this.
    fs::set_permissions(&counter, Permissions::from_mode(0o666)).unwrap();
    drop(domain.open(Role::Observer));
    assert_eq!(counter.metadata().unwrap().mode() & 0o777, 0o600);
    drop(bus);
}

#[test]
fn an_emptied_topic_is_an_error_and_no_wait_for_ever() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let before = dynamic(&domain);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let mut intact = Vec::new();
    for segment in dynamic(&domain) {
        if !before.contains(&segment) {
            intact.push((segment.clone(), fs::read(&segment).unwrap()));
        }
    }
    assert!(!intact.is_empty());
    for (segment, _) in &intact {
        OpenOptions::new()
            .write(true)
            .truncate(true)
            .open(segment)
            .unwrap();
    }
    let config = domain.config.clone();
    let refused = in_time(move || {
        let bus = Bus::open(&config, Role::Logic).unwrap();
        bus.subscriber::<SensorLine>().map(drop).unwrap_err()
    });
    assert!(refused.to_string().contains("sensor/line"), "{refused}");
    // It is in use, so `mend` does not remove it but names it.
    let mended = mend(&domain.home(), LAGER.kept);
    for (segment, bytes) in intact {
        assert!(mended.damaged.contains(&segment), "{mended:?}");
        fs::write(segment, bytes).unwrap();
    }
    drop(publisher);
}

#[test]
fn mending_leaves_the_living_alone() {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let mut subscriber = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let lock = domain.home().lock(bridge.unit(), Role::Bridge).unwrap();
    let (segments, files) = (domain.in_shared_memory(), domain.left_in_folder());
    let litter = format!("/dev/shm/{}4711.connection", domain.home().prefix());
    leave_empty(&litter.into());
    let mended = mend(&domain.home(), LAGER.kept);
    assert_eq!((mended.removed, mended.damaged), (1, vec![]));
    assert!(lock.is_in_place());
    assert_eq!(domain.in_shared_memory().len(), segments.len());
    assert_eq!(domain.left_in_folder().len(), files.len());
    send(&publisher, 3);
    assert_eq!(drain(&mut subscriber), [3]);
}

#[test]
fn of_the_dead_alone_mending_leaves_nothing_whatever_their_files_hold() {
    let domain = Domain::new();
    for damage in 0..4_u8 {
        let players = ["line-writer", "line-reader", "navigator-waits", "bridge"]
            .map(|part| process::start(&domain, part));
        players.into_iter().for_each(Process::kill);
        for segment in domain.home().segments() {
            match damage {
                0 => {}
                1 => fs::write(&segment, []).unwrap(),
                2 => fs::write(&segment, [0xff; 100]).unwrap(),
                _ => fs::remove_file(&segment).unwrap(),
            }
        }
        let folder = domain.home().transport_folder();
        fs::create_dir(folder.join("nodes/4711")).unwrap();
        fs::write(folder.join("nodes/4711/half.details"), b"").unwrap();
        fs::write(
            domain
                .home()
                .unit(&"r1".parse().unwrap())
                .join("logic.lock"),
            "1",
        )
        .unwrap();
        let mended = mend(&domain.home(), LAGER.kept);
        assert!(mended.removed > 0);
        assert_eq!(mended.damaged, Vec::<PathBuf>::new());
        assert_eq!(domain.home().segments(), Vec::<PathBuf>::new(), "{damage}");
        assert_eq!(domain.left_in_folder(), Vec::<PathBuf>::new(), "{damage}");
        assert_eq!(domain.home().units(), [], "{damage}");
    }
}

#[test]
fn a_list_of_ends_that_a_sweep_had_open_goes_when_somebody_comes() {
    let domain = Domain::new();
    process::start(&domain, "line-writer").kill();
    let sweep = File::open(&dynamic(&domain)[0]).unwrap();
    mend(&domain.home(), LAGER.kept);
    assert_eq!(dynamic(&domain).len(), 1, "it was open");
    // If a process comes while the list is open, the list stays.
    let bus = domain.open(Role::Observer);
    assert_eq!(dynamic(&domain).len(), 1);
    drop(sweep);
    bus.sweep();
    assert_eq!(dynamic(&domain), Vec::<PathBuf>::new());
}

#[test]
fn a_half_made_node_goes_when_somebody_comes() {
    let domain = Domain::new();
    let bus = domain.open(Role::Observer);
    let half = domain.home().transport_folder().join("nodes/4711");
    fs::create_dir(&half).unwrap();
    fs::write(half.join("half.details"), b"").unwrap();
    drop(domain.open(Role::Observer));
    assert!(!half.exists());
    drop(bus);
}

/// The file that an inventory of this process finds missing, after `damage` to the process's bus.
fn missed(damage: impl FnOnce(&Domain)) -> Option<PathBuf> {
    let domain = Domain::new();
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let mut subscriber = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    let mut inventory = Inventory::default();
    let mut look = || inventory.look(bridge.home(), &[std::process::id()]);
    // Ports that come and go are no damage.
    for _ in 0..3 {
        let passing = bridge.publisher::<SensorLine>().unwrap();
        send(&passing, 1);
        drain(&mut subscriber);
        assert_eq!(look(), None);
        drop(passing);
        assert_eq!(look(), None);
    }
    damage(&domain);
    assert_eq!(look(), None, "it may have been under way");
    let missed = look();
    drop((publisher, subscriber));
    missed
}

fn segment_of(domain: &Domain, end: &str) -> PathBuf {
    let segments = domain.home().segments().into_iter();
    let mut found = segments.filter(|path| path.to_string_lossy().ends_with(end));
    found.next().expect("the bus has it")
}

fn descriptions_of(domain: &Domain) -> Vec<PathBuf> {
    let services = domain.home().transport_folder().join("services");
    let files = fs::read_dir(services).unwrap();
    files.map(|file| file.unwrap().path()).collect()
}

#[test]
fn what_is_in_use_and_cannot_be_found_any_more_is_missed() {
    assert_eq!(missed(|_| {}), None);
    for end in [".dynamic", ".data"] {
        let mut gone = PathBuf::new();
        let found = missed(|domain| {
            gone = segment_of(domain, end);
            fs::remove_file(&gone).unwrap();
        });
        assert_eq!(found, Some(gone));
    }
    let spoil = |path: &PathBuf, contents: &[u8]| {
        fs::remove_file(path).unwrap();
        fs::write(path, contents).unwrap();
    };
    let harms: [&dyn Fn(&PathBuf); 3] = [
        &|path| fs::remove_file(path).unwrap(),
        &|path| spoil(path, b""),
        // As a newcomer makes it: complete, and with another number.
        &|path| {
            let whole = fs::read_to_string(path).unwrap();
            spoil(
                path,
                whole
                    .replace("payload_value = ", "payload_value = 1")
                    .as_bytes(),
            );
        },
    ];
    for harm in harms {
        let found = missed(|domain| descriptions_of(domain).iter().for_each(harm));
        let found = found.expect("the robot cannot be seen any more");
        assert_eq!(found.extension(), Some("dynamic".as_ref()));
    }
}

#[test]
fn who_was_on_a_bus_that_was_cleared_leaves_the_next_one_alone() {
    let domain = Domain::new();
    let old = domain.open(Role::Observer);
    let reader = old.subscriber::<SensorLine>().unwrap();
    assert!(old.is_listed());
    assert!(domain.home().clear(&"r1".parse().unwrap()));
    assert!(!old.is_listed());
    let bridge = domain.open(Role::Bridge);
    let publisher = bridge.publisher::<SensorLine>().unwrap();
    let late = old.subscriber::<SensorDistance>();
    assert!(!old.is_listed(), "also when it makes files again");
    drop((reader, late, old));
    // As the topic's last user it would otherwise have removed the topic's description.
    let mut subscriber = domain.open(Role::Logic).subscriber::<SensorLine>().unwrap();
    send(&publisher, 4);
    assert_eq!(drain(&mut subscriber), [4]);
}

#[test]
fn a_strangers_files_are_named() {
    let domain = Domain::new();
    drop(domain.open(Role::Observer));
    let (counter, folder) = (counter(&domain), domain.home().folder().to_owned());
    let give = |path: &PathBuf, uid| chown(path, Some(uid), None);
    if give(&counter, 12345).is_err() {
        // Only root can give files away. Another user tests with a folder of root's.
        let root = BusConfig {
            folder: Some("/proc/1/task".into()),
            ..BusConfig::of(&LAGER)
        };
        let said = open(&root).unwrap_err().to_string();
        assert!(said.contains("`sudo -u root`"), "{said}");
        return;
    }
    let said = open(&domain.config).unwrap_err().to_string();
    give(&counter, 0).unwrap();
    assert!(said.contains(counter.to_str().unwrap()), "{said}");
    assert!(said.contains("UID 12345"), "{said}");
    give(&folder, 12345).unwrap();
    let said = open(&domain.config).unwrap_err().to_string();
    give(&folder, 0).unwrap();
    assert!(said.contains("`sudo -u '#12345'`"), "{said}");
}
