//! Tests of what the Debian package gives to systemd and to udev, and of its configuration.
//! `tests/packages/run` installs the package and lets them work.

use std::fs;
use std::process::Command;

use lager_tests::{Domain, in_tree, lager};

const UNITS: [&str; 2] = ["lager.service", "lager-station.service"];
/// The screen and the node of ROS 2, which only look.
const OBSERVERS: [&str; 2] = ["lager-kiosk.service", "lager-ros2.service"];

/// The most that `systemd-analyze security` may say of a unit, in tenths.
const EXPOSED: &str = "--threshold=29";

fn packaged(file: &str) -> String {
    let path = in_tree("services/lager/debian").join(file);
    fs::read_to_string(path).expect("a file of the package")
}

#[test]
#[ignore = "needs systemd-analyze; `tests/run` runs it where it is there"]
fn systemd_takes_the_units_and_calls_them_safe() {
    let domain = Domain::among_others();
    for unit in UNITS.into_iter().chain(OBSERVERS) {
        let program = lager();
        let text = packaged(unit);
        let installed = "/usr/bin/lager ";
        assert!(text.contains(installed), "{text}");
        // systemd refuses a unit whose program is not there.
        let here = format!("{} ", program.display());
        let path = domain.folder().join(unit);
        fs::write(&path, text.replace(installed, &here)).expect("a file");
        for check in [
            &["verify", "--man=no"][..],
            &["security", "--offline=true", "--no-pager", EXPOSED],
        ] {
            let told = Command::new("systemd-analyze")
                .args(check)
                .arg(&path)
                .output()
                .expect("systemd-analyze");
            let said = String::from_utf8_lossy(&told.stdout).into_owned()
                + &String::from_utf8_lossy(&told.stderr);
            assert!(told.status.success(), "{unit}: {said}");
            assert!(check[0] != "verify" || said.is_empty(), "{unit}: {said}");
        }
    }
    domain.assert_clean();
}

/// One unit's end must not take the folder of the other with it, and a missing board must not
/// exhaust the attempts to start.
#[test]
fn each_unit_has_folders_of_its_own_and_never_gives_up() {
    let mut folders = Vec::new();
    for unit in UNITS {
        let text = packaged(unit);
        let value = |key: &str| {
            let mut values = text.lines().filter_map(|line| line.strip_prefix(key));
            let value = values.next().unwrap_or_else(|| panic!("{unit}: no {key}"));
            assert_eq!(values.next(), None, "{unit}: {key} twice");
            value.to_owned()
        };
        folders.extend([value("RuntimeDirectory="), value("StateDirectory=")]);
        for (key, wanted) in [
            ("Type=", "notify"),
            ("User=", "lager"),
            ("Restart=", "always"),
            ("StartLimitIntervalSec=", "0"),
            ("RuntimeDirectoryMode=", "0700"),
            ("RuntimeDirectoryPreserve=", "yes"),
            ("DevicePolicy=", "closed"),
        ] {
            assert_eq!(value(key), wanted, "{unit}: {key}");
        }
        value("WatchdogSec=");
    }
    folders.dedup();
    assert_eq!(folders, ["lager", "lager-station"]);
}

#[test]
fn the_rules_come_before_modem_managers_and_name_no_port() {
    let name = "60-lager.rules";
    assert!(name < "77-mm-usb-device-blacklist.rules");
    let rules = packaged(name);
    for word in [
        "ENV{ID_MM_DEVICE_IGNORE}=\"1\"",
        "ATTR{latency_timer}=\"1\"",
        "MODE=\"0660\"",
    ] {
        assert_eq!(rules.matches(word).count().min(1), 1, "{word}: {rules}");
    }
    assert!(!rules.contains("SYMLINK"), "{rules}");
}

/// The configuration as it is installed, and with each key that it offers.
#[test]
fn the_packaged_configuration_is_one() {
    let domain = Domain::among_others();
    let text = packaged("lager.toml");
    // A line that is a key behind the sign of a comment, not a sentence.
    let offered = |line: &str| match line.strip_prefix('#') {
        Some(key) if !key.starts_with(' ') => key.to_owned(),
        _ => line.to_owned(),
    };
    let whole: Vec<String> = text.lines().map(offered).collect();
    assert!(whole.iter().filter(|line| line.contains(" = ")).count() > 7);
    for (name, text) in [("installed", text.clone()), ("whole", whole.join("\n"))] {
        let path = domain.folder().join(format!("{name}.toml"));
        fs::write(&path, text).expect("a file");
        let told = domain.run(&["--config", path.to_str().expect("UTF-8"), "config"]);
        let said = String::from_utf8_lossy(&told.stderr);
        assert!(told.status.success(), "{name}: {said}");
    }
    domain.assert_clean();
}
