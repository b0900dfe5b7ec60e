//! The warehouse file: what cannot be is refused, and saving replaces the file whole.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use lager_floor::Node;
use lager_lines::Called;
use lager_plant::{NamedProduct, Warehouse};
use lager_station::files::{Hold, replace};
use lager_station::{LoadError, SaveError, find, load, save, told};

use crate::transcript::{WAREHOUSE, product, warehouse};

/// A folder of its own that is removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("lager-station-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }

    fn file(&self) -> PathBuf {
        self.0.join("warehouse.toml")
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).expect("the folder");
        let name = |entry: std::io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
        let mut names: Vec<_> = entries
            .map(|entry| name(entry).to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn what_was_saved_is_read() {
    let folder = Folder::new("saved");
    fs::write(folder.file(), WAREHOUSE).expect("a file");
    let mut warehouse = load(&folder.file()).expect("a warehouse");
    let find = |text: &str| {
        find(
            &warehouse,
            &text.parse::<Called>().expect("a name or a number"),
        )
    };
    assert_eq!(find("screws"), Ok(product(7)));
    assert_eq!(find("12"), Ok(product(12)));
    for unknown in ["nails", "13"] {
        let why = find(unknown).expect_err(unknown).to_string();
        let wanted = format!("the warehouse has no goods {unknown}; it has 7 (screws), 12");
        assert_eq!(why, wanted);
    }

    warehouse.products.pop();
    warehouse.delivery = Node::new(4, 3);
    save(&folder.file(), &warehouse).expect("saved");
    assert_eq!(load(&folder.file()).expect("a warehouse"), warehouse);
    assert_eq!(
        folder.names(),
        ["warehouse.toml"],
        "nothing is left beside it"
    );
}

#[test]
fn what_only_others_read_is_kept() {
    let folder = Folder::new("kept");
    let text = format!(
        "{WAREHOUSE}\n[exit]\nlength_cm = 90\n\n[[obstacle]]\nbetween = [[0, 0], [1, 0]]\n"
    );
    fs::write(folder.file(), text).expect("a file");
    let warehouse = load(&folder.file()).expect("a warehouse");
    save(&folder.file(), &warehouse).expect("saved");
    let again: toml::Table = fs::read_to_string(folder.file())
        .expect("the file")
        .parse()
        .expect("TOML");
    assert_eq!(again["exit"]["length_cm"].as_integer(), Some(90));
    assert_eq!(again["obstacle"][0]["between"][1][0].as_integer(), Some(1));
    assert_eq!(again["product"][0]["name"].as_str(), Some("screws"));
}

#[test]
fn a_disk_that_does_not_take_it_leaves_the_file_as_it_was() {
    let folder = Folder::new("full");
    fs::write(folder.file(), WAREHOUSE).expect("a file");
    // Nothing can be written under the name of a folder, whoever asks.
    fs::create_dir(folder.0.join("warehouse.toml.new")).expect("a folder");
    let mut changed = warehouse();
    changed.products.clear();
    let error = save(&folder.file(), &changed).expect_err("not saved");
    assert!(matches!(error, SaveError::Write { .. }), "{error}");
    assert_eq!(
        fs::read_to_string(folder.file()).expect("the file"),
        WAREHOUSE
    );
}

#[test]
fn what_a_killed_one_left_is_in_nobody_s_way() {
    let folder = Folder::new("killed");
    fs::write(folder.0.join("warehouse.toml.new"), "size = [").expect("a file");
    save(&folder.file(), &warehouse()).expect("saved");
    assert_eq!(load(&folder.file()).expect("a warehouse"), warehouse());
    assert_eq!(folder.names(), ["warehouse.toml"]);
}

/// The variable that tells [`it_saves`] where.
const SAVES: &str = "LAGER_TEST_SAVES";
const LATER: &str = "later = true\n";

/// What a process does that is watched by the next test.
#[test]
#[ignore = "it is the other process of the next test"]
fn it_saves() {
    if let Some(path) = std::env::var_os(SAVES) {
        replace(Path::new(&path), LATER).expect("it is replaced");
    }
}

/// Every file that outlives a process is saved by the same function.
#[test]
fn a_save_that_is_killed_at_any_system_call_leaves_the_old_file_or_the_new_one() {
    let folder = Folder::new("cut");
    let log = folder.0.join("log");
    // Saves under strace, with its options. Returns the file and whether the process was killed.
    let saved = |options: &[&str]| {
        fs::write(folder.file(), WAREHOUSE).expect("a file");
        let mut strace = Command::new("strace");
        strace
            .args(["-f", "-y", "-qq", "-o"])
            .arg(&log)
            .args(options);
        strace.arg(std::env::current_exe().expect("this program"));
        strace.args(["file::it_saves", "--exact", "--ignored"]);
        strace.env(SAVES, folder.file());
        let ended = strace.output().expect("strace, which tests/run installs");
        let text = fs::read_to_string(folder.file()).expect("a file");
        (text, !ended.status.success())
    };
    let calls = "trace=openat,unlink,fchown,fchmod,write,fsync,rename";
    assert_eq!(saved(&["-e", calls]), (LATER.to_owned(), false));
    // The order is what makes it hold through a loss of power.
    let said = fs::read_to_string(&log).expect("a log");
    let (file, beside) = (folder.file(), folder.0.join("warehouse.toml.new"));
    let (file, beside) = (file.display(), beside.display());
    let steps = [
        ("write(", format!("<{beside}>")),
        ("fsync(", format!("<{beside}>")),
        ("rename(", format!("\"{beside}\", \"{file}\"")),
        ("fsync(", format!("<{}>", folder.0.display())),
    ];
    let mut lines = said.lines();
    for (call, of) in &steps {
        let is_it = |line: &str| line.contains(call) && line.contains(of);
        assert!(
            lines.any(is_it),
            "{call} {of} is missing or comes too early: {said}"
        );
    }

    let mut seen = BTreeSet::new();
    for call in [
        "openat", "unlink", "fchown", "fchmod", "write", "fsync", "rename",
    ] {
        for count in 1.. {
            let kill = format!("inject={call}:signal=KILL:when={count}");
            let (text, is_killed) = saved(&["-e", &format!("trace={call}"), "-e", &kill]);
            assert!(text == WAREHOUSE || text == LATER, "{kill}: {text:?}");
            if !is_killed {
                assert_eq!(text, LATER);
                break;
            }
            seen.insert((call, text == LATER));
        }
    }
    // It was cut before the new text was there, and after that.
    for cut in [("write", false), ("fsync", false), ("fsync", true)] {
        assert!(seen.contains(&cut), "{cut:?} is not among {seen:?}");
    }
}

#[test]
fn a_warehouse_that_cannot_be_is_refused_in_a_sentence() {
    let change = |from: &str, to: &str| {
        let text = WAREHOUSE.replacen(from, to, 1);
        assert_ne!(text, WAREHOUSE, "{from} is not in it");
        let warehouse: Warehouse = toml::from_str(&text).expect("TOML");
        told(&warehouse).expect_err(to).to_string()
    };
    for (from, to, sentence) in [
        (
            "[4, 3]",
            "[0, 3]",
            "the size is 0 x 3 squares; each must be from 1 to 99",
        ),
        (
            "= 40",
            "= 39",
            "a square's side is 39 cm; it must be from 40 to 500 cm",
        ),
        (
            "delivery = [0, 0]",
            "delivery = [1, 0]",
            "the delivery is at (1, 0), which is no corner of the floor; \
             its corners are (0, 0), (0, 3), (4, 0) and (4, 3)",
        ),
        (
            "id = 7",
            "id = -7",
            "goods -7 have a negative number; numbers start at 0",
        ),
        (
            "id = 7",
            "id = 12",
            "goods 12 are listed twice; all goods need a number of their own",
        ),
        (
            "[1, 0]",
            "[4, 0]",
            "goods 7 stand in the square (4, 0), but the last one is (3, 2)",
        ),
        (
            "id = 12",
            "id = 12\nname = \"screws\"",
            "two goods are named screws; give all goods a name of their own",
        ),
        (
            "\"screws\"",
            "\"12\"",
            "goods are named 12, which people would take for their number; use a letter",
        ),
        (
            "\"screws\"",
            "\"screws, M4\"",
            "goods are named screws, M4, which cannot stand for goods: a name has a letter and neither \
             comma, semicolon, line break nor a blank at its ends",
        ),
    ] {
        assert_eq!(change(from, to), sentence);
    }
}

#[test]
fn more_products_than_fit_in_a_line_are_refused() {
    let mut many = warehouse();
    let one = many.products[1].clone();
    many.products = (0..100)
        .map(|id| NamedProduct { id, ..one.clone() })
        .collect();
    assert_eq!(
        told(&many).expect_err("too many").to_string(),
        "the warehouse has more goods than fit in one line of the robot's language: 100; list \
         fewer"
    );
}

#[test]
fn a_file_that_is_none_is_named() {
    let folder = Folder::new("none");
    let error = load(&folder.file()).expect_err("no file");
    assert!(matches!(error, LoadError::Read { .. }), "{error}");
    fs::write(folder.file(), "size = [4, 3]\nside_length_cm = \"forty\"").expect("a file");
    let error = load(&folder.file()).expect_err("no number");
    assert!(
        error
            .to_string()
            .contains("warehouse.toml: TOML parse error at line 2"),
        "{error}"
    );
    fs::write(folder.file(), WAREHOUSE.replacen("[4, 3]", "[0, 3]", 1)).expect("a file");
    let error = load(&folder.file()).expect_err("no squares");
    assert!(matches!(error, LoadError::Warehouse { .. }), "{error}");
}

#[test]
fn a_mistyped_key_is_refused_with_the_one_that_was_meant() {
    let folder = Folder::new("mistyped");
    for (from, to, meant) in [
        ("[[product]]", "[[products]]", "product"),
        ("side = \"down\"", "sied = \"down\"", "side"),
        ("delivery", "delivrey", "delivery"),
        (
            "size = [4, 3]",
            "size = [4, 3]\nexit.lenght_cm = 90",
            "length_cm",
        ),
    ] {
        fs::write(folder.file(), WAREHOUSE.replacen(from, to, 1)).expect("a file");
        let error = load(&folder.file()).expect_err(to).to_string();
        let hint = format!("; did you mean `{meant}`?");
        assert!(error.ends_with(&hint), "{error}");
    }
}

#[test]
fn what_is_saved_goes_behind_a_link_and_the_mode_stays() {
    let folder = Folder::new("link");
    fs::create_dir(folder.0.join("real")).expect("a folder");
    let real = folder.0.join("real/hall.toml");
    fs::write(&real, WAREHOUSE).expect("a file");
    fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).expect("its own file");
    symlink("real/hall.toml", folder.file()).expect("a link");
    let mut changed = warehouse();
    changed.products.pop();
    save(&folder.file(), &changed).expect("saved");
    let is_link = fs::symlink_metadata(folder.file()).expect("it is there");
    assert!(is_link.file_type().is_symlink());
    assert_eq!(load(&real).expect("a warehouse"), changed);
    let mode = fs::metadata(&real)
        .expect("it is there")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o640);
    // A link to nothing yet is one to a file that is made.
    let dangling = folder.0.join("dangling.toml");
    symlink("real/new.toml", &dangling).expect("a link");
    save(&dangling, &changed).expect("saved");
    assert!(folder.0.join("real/new.toml").is_file());
    // Links in a circle lead nowhere.
    let circle = folder.0.join("circle.toml");
    symlink("circle.toml", &circle).expect("a link");
    save(&circle, &changed).expect_err("a circle");
}

#[test]
fn pipes_devices_and_folders_are_refused_at_once() {
    let folder = Folder::new("pipe");
    let pipe = folder.0.join("pipe");
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR).expect("a pipe");
    for path in [pipe.as_path(), Path::new("/dev/zero"), folder.0.as_path()] {
        let error = load(path).expect_err("it is no file").to_string();
        assert!(error.contains(": it is "), "{error}");
        save(path, &warehouse()).expect_err("it is no file");
    }
    assert!(folder.0.is_dir(), "nothing is replaced");
}

#[test]
fn what_could_not_be_read_again_is_not_saved() {
    let folder = Folder::new("again");
    fs::write(folder.file(), WAREHOUSE).expect("a file");
    let mut changed = warehouse();
    // Longer than a file may be that is read.
    changed.products[0].name = Some("x".repeat(2 << 20));
    let error = save(&folder.file(), &changed).expect_err("not saved");
    assert!(matches!(error, SaveError::Unreadable { .. }), "{error}");
    let text = fs::read_to_string(folder.file()).expect("the file");
    assert_eq!(text, WAREHOUSE);
}

#[test]
fn who_comes_while_another_process_ends_gets_its_file() {
    let folder = Folder::new("ending");
    let first = Hold::of(&folder.file()).expect("nobody has it");
    let ends = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(300));
        drop(first.expect("a lock"));
    });
    let second = Hold::of(&folder.file()).expect("the first one ends");
    assert!(second.is_some());
    ends.join().expect("it has ended");
}
