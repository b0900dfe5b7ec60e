//! Tests of `lager gateway`: what it shows of a running robot to programs outside the bus.

#[cfg(feature = "zenoh")]
mod elsewhere;
mod live;
#[cfg(feature = "zenoh")]
mod relay;
#[cfg(feature = "zenoh")]
mod remote;
#[cfg(feature = "zenoh")]
mod traps;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::Duration;

use lager_tests::{Domain, free, pid, wait_for};
use lager_wire::BUILD;
use rustix::process::{Signal, kill_process};

/// The answer to a request; `None` while nobody listens.
fn asked(address: &str, host: &str) -> Option<String> {
    let mut socket = TcpStream::connect(address).ok()?;
    socket.set_read_timeout(Some(Duration::from_secs(5))).ok()?;
    let request = format!("GET /metrics HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    socket.write_all(request.as_bytes()).ok()?;
    let mut answer = String::new();
    socket.read_to_string(&mut answer).ok()?;
    Some(answer)
}

/// The text with all metrics.
fn text(address: &str) -> Option<String> {
    let answer = asked(address, address)?;
    let (head, text) = answer.split_once("\r\n\r\n")?;
    assert!(head.starts_with("HTTP/1.1 200"), "{head}");
    Some(text.to_owned())
}

/// Every figure with its labels, and its value.
fn figures(address: &str) -> Option<BTreeMap<String, f64>> {
    let text = text(address)?;
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let each = lines.map(|line| {
        let (name, value) = line.rsplit_once(' ').expect("a value");
        (name.to_owned(), value.parse().expect("a number"))
    });
    Some(each.collect())
}

/// Waits until `is_it` is true of a figure, and returns the figure.
fn until(address: &str, figure: &str, is_it: impl Fn(f64) -> bool) -> f64 {
    wait_for(figure, || {
        let value = *figures(address)?.get(figure)?;
        is_it(value).then_some(value)
    })
}

const LINES: &str = "lager_topic_samples_total{robot=\"r1\",topic=\"sensor/line\"}";
const ORDERED: &str = "lager_stop_latched{robot=\"r1\",cause=\"ordered\"}";

#[test]
#[cfg(not(feature = "zenoh"))]
#[ignore = "needs --features lager/zenoh"]
fn listeners_with_zenoh() {
    unreachable!("this program was built without them");
}

#[test]
fn figures_tell_what_the_robot_does_and_outlive_a_killed_gateway() {
    let domain = Domain::new();
    let metrics = free();
    let up = domain.start(&["up", "--headless", "--metrics", &metrics, "--mission", "1"]);
    until(&metrics, LINES, |samples| samples > 100.0);
    until(
        &metrics,
        "lager_link_up{robot=\"r1\",board=\"sensor\"}",
        |up| up == 1.0,
    );
    until(
        &metrics,
        "lager_mode{robot=\"r1\",mode=\"autonomous\"}",
        |mode| mode == 1.0,
    );
    until(
        &metrics,
        "lager_path_seconds_count{robot=\"r1\",stage=\"total\"}",
        |count| count > 0.0,
    );
    let figures = figures(&metrics).expect("figures");
    let fits =
        format!("lager_board_image_fits{{robot=\"r1\",board=\"steering\",build=\"{BUILD}\"}}");
    assert_eq!(figures[&fits], 1.0);
    assert!((8.0..16.0).contains(&figures["lager_battery_volts{robot=\"r1\"}"]));
    let bucket = |end: &str| {
        let name =
            format!("lager_path_seconds_bucket{{robot=\"r1\",stage=\"total\",le=\"{end}\"}}");
        figures[&name]
    };
    let longest = figures["lager_path_max_seconds{robot=\"r1\",stage=\"total\"}"];
    let p999 = figures.get("lager_path_p999_seconds{robot=\"r1\",stage=\"total\"}");
    assert!(longest > 0.0 && p999.is_none_or(|p999| *p999 <= longest));
    // A wider bucket counts at least as many. No wake-up is as fast as 1 us.
    assert!(bucket("0.000001024") <= bucket("1.073741824"));
    assert!(bucket("1.073741824") <= bucket("+Inf"));
    assert!(figures.keys().any(|name| {
        name.starts_with("lager_process_cpu_seconds_total{robot=\"r1\",role=\"bridge\"")
    }));

    assert_eq!(figures[ORDERED], 0.0);
    domain.done(&["stop"]);
    until(&metrics, ORDERED, |latched| latched == 1.0);
    until(
        &metrics,
        "lager_motor_duty_ratio{robot=\"r1\",motor=\"left\"}",
        |duty| duty == 0.0,
    );
    domain.done(&["resume"]);
    until(&metrics, ORDERED, |latched| latched == 0.0);

    let killed = up.service("gateway").expect("a gateway");
    kill_process(pid(killed), Signal::KILL).expect("a living process");
    let next = wait_for("the next gateway", || {
        up.service("gateway").filter(|next| *next != killed)
    });
    assert_ne!(next, killed);
    until(&metrics, LINES, |samples| samples > 10.0);
    drop(up);
    domain.assert_clean();
}

#[test]
fn half_requests_keep_nobody_from_the_figures_and_use_up_no_files() {
    let domain = Domain::new();
    let metrics = free();
    let up = domain.start(&["up", "--headless", "--no-station", "--metrics", &metrics]);
    until(&metrics, LINES, |samples| samples > 10.0);
    let gateway = up.service("gateway").expect("a gateway");
    let files = || {
        let open = std::fs::read_dir(format!("/proc/{gateway}/fd")).expect("it lives");
        open.count()
    };
    let before = files();
    let crowd: Vec<_> = (0..200)
        .map(|_| {
            let mut half = TcpStream::connect(&metrics).expect("it listens");
            let _ = half.write_all(b"GET /metrics HTTP/1.1\r\n");
            half
        })
        .collect();
    until(&metrics, LINES, |samples| samples > 20.0);
    // As many connections as the gateway allows, and the one of this request.
    assert!(files() <= before + 40, "{before} and {} files", files());
    // The gateway ends each of them.
    for mut half in crowd {
        half.set_read_timeout(Some(lager_tests::WATCHDOG))
            .expect("a socket");
        let mut said = Vec::new();
        let _ = half.read_to_end(&mut said);
    }
    assert_eq!(up.service("gateway"), Some(gateway), "{}", up.log());
    drop(up);
    domain.assert_clean();
}

#[test]
fn one_that_stands_alone_says_where_it_is_and_refuses_names_and_a_taken_address() {
    let domain = Domain::new();
    let up = domain.start(&["up", "--headless"]);
    let metrics = free();
    let gateway = domain.start(&["gateway", "--metrics", &metrics]);
    until(&metrics, LINES, |samples| samples > 10.0);
    let said = gateway.output();
    assert!(
        said.contains(&format!("http://{metrics}/metrics")),
        "{said}"
    );

    let answer = asked(&metrics, "evil.example").expect("an answer");
    assert!(answer.starts_with("HTTP/1.1 421"), "{answer}");
    assert!(!answer.contains("lager_"), "{answer}");

    // The second robot is refused before any process of it runs.
    let refused = domain.run(&["--name", "r2", "up", "--headless", "--metrics", &metrics]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && said.contains("choose another address"),
        "{said}"
    );
    drop((gateway, up));
    domain.assert_clean();
}

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with prometheus-client; tests/run makes one"]
fn the_official_parser_reads_every_figure() {
    let domain = Domain::new();
    let metrics = free();
    let up = domain.start(&["up", "--headless", "--metrics", &metrics, "--mission", "1"]);
    until(
        &metrics,
        "lager_path_seconds_count{robot=\"r1\",stage=\"total\"}",
        |count| count > 0.0,
    );
    let text = text(&metrics).expect("figures");
    drop(up);
    let python = std::env::var_os("LAGER_PYTHON").expect("LAGER_PYTHON names a Python");
    let mut parser = Command::new(python)
        .arg(lager_tests::in_tree("tests/gateway/parse.py"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    let mut input = parser.stdin.take().expect("a pipe");
    input.write_all(text.as_bytes()).expect("it reads");
    drop(input);
    let read = parser.wait_with_output().expect("Python ends");
    assert!(read.status.success());
    let read: serde_json::Value = serde_json::from_slice(&read.stdout).expect("JSON");
    // Each line is a value of a family, and the parser has skipped none.
    let lines = text.lines().filter(|line| !line.starts_with('#')).count();
    assert_eq!(read["samples"], lines);
    assert_eq!(read["kinds"]["lager_path_seconds"], "histogram");
    assert_eq!(read["kinds"]["lager_topic_samples"], "counter");
    assert_eq!(read["kinds"]["lager_battery_volts"], "gauge");
    domain.assert_clean();
}
