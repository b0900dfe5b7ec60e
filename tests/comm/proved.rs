//! Tests that a robot and its station prove to each other who they are, with a shared secret.

use std::fs;
use std::io::{BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lager_lines::Name;
use lager_lines::secret::Secrets;
use lager_station::{Listen, Server, ServerConfig};
use lager_tests::{Domain, Running, pid, wait_for};
use rustix::process::{Signal, kill_process};

use crate::scene::{Peer, WATCHDOG};

const SECRET: &str = "correct-horse-battery-staple";

/// A file with this text and these permissions.
fn file(domain: &Domain, text: &str, mode: u32) -> PathBuf {
    let path = domain.folder().join("secret");
    fs::write(&path, text).expect("a file");
    fs::set_permissions(&path, fs::Permissions::from_mode(mode)).expect("it is ours");
    path
}

fn connected(stream: TcpStream) -> Peer<TcpStream> {
    stream.set_read_timeout(Some(WATCHDOG)).expect("a socket");
    Peer(BufReader::new(stream))
}

/// A robot that connects to `station` and reads its secret from this file.
fn robot(domain: &Domain, station: &str, secret: &std::path::Path) -> Running {
    let secret = secret.to_str().expect("UTF-8");
    domain.start(&["up", "--headless", "--station", station, "--secret", secret])
}

#[test]
fn an_impostor_of_a_robot_that_is_up_is_refused_and_both_sides_are_told() {
    let domain = Domain::among_others();
    let up = domain.start(&["up", "--headless", "--listen", "127.0.0.1:0"]);
    let address = wait_for("the station's address", || {
        let told = up.output();
        let (_, rest) = told.split_once("listens at ")?;
        rest.split([' ', ',', '\n']).next().map(str::to_owned)
    });
    let secret = domain.bus_folder().join("r1").join("secret");
    let mode = fs::metadata(&secret)
        .expect("a secret")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    wait_for("the robot to be told its warehouse", || {
        up.output().contains("drives from").then_some(())
    });

    let mut impostor = connected(TcpStream::connect(&address).expect("it listens"));
    impostor.says("lager 1 r1");
    let asked = impostor.hears().expect("it is asked");
    assert!(asked.starts_with("prove "), "{asked}");
    impostor.says("stopped 1 3");
    let told = impostor.hears().expect("it is told why");
    assert!(
        told.starts_with("thought somebody says that he is robot r1"),
        "{told}"
    );
    assert_eq!(impostor.hears(), None);
    wait_for("the station to say so", || {
        let log = up.log();
        log.contains("somebody says that he is robot r1")
            .then_some(())
    });

    // Another robot of the same user gets the path of the secret.
    let args = [
        "--name",
        "r2",
        "up",
        "--headless",
        "--station",
        &address,
        "--mission",
        "1",
    ];
    let second = domain.start(&args);
    wait_for("the second robot to be told its warehouse", || {
        second.output().contains("drives from").then_some(())
    });
    assert!(!second.output().contains("believed"), "{}", second.output());
    drop((second, up));
    domain.assert_clean();
}

#[test]
fn a_robot_and_a_station_with_one_secret_find_each_other_and_with_two_they_say_why_not() {
    let domain = Domain::among_others();
    let server = Server::open(ServerConfig {
        name: Name::new("tester").expect("a name"),
        listen: Listen::At("127.0.0.1:0".parse().expect("an address")),
        secrets: Secrets::read(&format!("r1 {SECRET}")).expect("a secret"),
        gag: None,
        otherwise: None,
        queues: None,
        history: None,
        warehouse: None,
        fetch: Vec::new(),
    });
    let server = server.expect("a station");
    let (handle, address) = (server.handle(), server.address().expect("an address"));
    let ends = Arc::new(AtomicBool::new(false));
    let until = Arc::clone(&ends);
    let serves = std::thread::spawn(move || server.run(&until).expect("it serves"));

    let other = file(&domain, "0123456789abcdef", 0o600);
    let wrong = robot(&domain, &address.to_string(), &other);
    wait_for("the robot to say why", || {
        wrong.log().contains("does not prove it").then_some(())
    });
    assert_eq!(handle.robots(), []);
    // The station reads the file for each connection.
    file(&domain, &format!("r1 {SECRET}\n"), 0o600);
    wait_for("the station to know the robot", || {
        let robots = handle.robots();
        robots.iter().any(|robot| robot.is_extended).then_some(())
    });
    drop(wrong);
    ends.store(true, Ordering::SeqCst);
    serves.join().expect("it has ended");
    domain.assert_clean();
}

#[test]
fn an_impostor_of_a_station_is_hung_up_on_and_moves_nothing() {
    let domain = Domain::among_others();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let secret = file(&domain, SECRET, 0o600);
    let up = robot(&domain, &address, &secret);
    for says in [
        "lager 1 station\ndo 1 mode manual\ndo 2 drive 2 1000",
        "prove 00112233445566778899aabbccddeeff\nlager 1 station\ndo 1 drive 2 1000",
        "thought you are not welcome",
    ] {
        let mut robot = connected(listener.accept().expect("it connects").0);
        assert_eq!(robot.hears().as_deref(), Some("lager 1 r1"));
        robot.says(says);
        while let Some(line) = robot.hears() {
            assert!(line.starts_with("proof "), "{line}: nothing else is said");
        }
    }
    wait_for("the robot to say so", || {
        up.log().contains("you are not welcome").then_some(())
    });
    drop(up);
    domain.assert_clean();
}

#[test]
fn a_file_of_secrets_that_others_may_read_is_refused() {
    let domain = Domain::among_others();
    let open = file(&domain, SECRET, 0o644);
    let open = open.to_str().expect("UTF-8");
    let station = "127.0.0.1:1";
    for args in [
        &["up", "--headless", "--station", station, "--secret", open][..],
        &[
            "station",
            "--listen",
            "127.0.0.1:0",
            "--no-panel",
            "--robots-secret",
            open,
        ],
    ] {
        let refused = domain.run(args);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(!refused.status.success(), "{args:?}");
        assert!(
            said.contains("has mode 0644") && said.contains("chmod 600"),
            "{said}"
        );
    }
    domain.assert_clean();
}

#[test]
fn a_station_without_files_to_open_says_so_once_and_takes_robots_when_it_has_some_again() {
    let domain = Domain::among_others();
    let mut command = std::process::Command::new("sh");
    let script = r#"ulimit -n 32; exec "$@""#;
    command.args(["-c", script, "sh"]).arg(lager_tests::lager());
    command.arg("--bus").arg(domain.bus_folder());
    command.args(["station", "--listen", "127.0.0.1:0", "--no-panel"]);
    let station = domain.launch(command);
    let address = wait_for("the station", || {
        let said = station.output();
        let address = said.strip_prefix("robots connect to ")?.split(',').next()?;
        said.contains('\n').then(|| address.to_owned())
    });
    let connect = || connected(TcpStream::connect(&address).expect("it listens"));
    let crowd: Vec<_> = (0..60).map(|_| connect()).collect();
    wait_for("it to say that it has none left", || {
        station
            .log()
            .contains("nobody else is let in for now")
            .then_some(())
    });
    drop(crowd);
    let mut robot = connect();
    robot.says("lager 1 r1");
    assert_eq!(robot.hears().as_deref(), Some("lager 1 station"));
    let log = station.log();
    assert_eq!(log.matches("nobody else").count(), 1, "{log}");
    assert!(log.contains("ulimit -n"), "{log}");
    drop((robot, station));
    domain.assert_clean();
}

/// The status of the answer to `GET path` of the panel at `host`; `None` without an answer.
fn asked(host: &str, path: &str) -> Option<String> {
    let mut stream = TcpStream::connect(host).ok()?;
    stream.set_read_timeout(Some(WATCHDOG)).ok()?;
    let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    answer.split(' ').nth(1).map(str::to_owned)
}

#[test]
fn the_address_of_the_panel_that_up_prints_works_over_a_restart_of_the_station_and_no_other_does() {
    let domain = Domain::among_others();
    let here = "127.0.0.1:0";
    let up = domain.start(&["up", "--listen", here, "--panel", here]);
    let url = wait_for("the panel's address", || {
        let told = up.output();
        let (_, rest) = told.split_once("the panel is at ")?;
        rest.split_whitespace().next().map(str::to_owned)
    });
    let at = url.strip_prefix("http://").expect("an address");
    let (host, path) = at.split_once('/').expect("a path");
    let token = path.strip_prefix("?token=").expect("a token");
    let answers = |path: &str| wait_for("the panel", || asked(host, path));
    for life in 0..2 {
        assert_eq!(answers(&format!("/{path}")), "303", "life {life}");
        assert_eq!(answers(&format!("/screen?token={token}")), "303");
        assert_eq!(answers("/"), "403");
        assert_eq!(
            answers(&format!("/?token={}", "0".repeat(token.len()))),
            "403"
        );
        let station = up.service("station").expect("it runs");
        kill_process(pid(station), Signal::KILL).expect("it runs");
        wait_for("its successor", || {
            up.service("station").filter(|next| *next != station)
        });
    }
    drop(up);
    domain.assert_clean();
}
