//! The plot script: a report of this crate goes in, a well-formed SVG comes out, and what is no
//! report is refused with a sentence.

use std::io::Write;
use std::process::{Command, Output, Stdio};

use lager_benches::{Mode, Quantiles, Ratio, Regime, Report, Row};

fn plot(input: &str) -> Output {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/plot");
    python(&[script, "-", "--title", "Bus & <path>"], input)
}

fn python(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new("python3")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python3 is installed");
    let mut stdin = child.stdin.take().expect("it is piped");
    stdin.write_all(input.as_bytes()).expect("it reads");
    drop(stdin);
    child.wait_with_output().expect("it ends")
}

fn is_well_formed(svg: &str) -> bool {
    let parse = "import sys, xml.etree.ElementTree as tree; tree.fromstring(sys.stdin.read())";
    python(&["-c", parse], svg).status.success()
}

fn row(name: &str, mode: Mode, p50_ns: u64) -> Row {
    Row {
        name: name.to_owned(),
        variant: "kind <1>".to_owned(),
        what: "hop".to_owned(),
        mode,
        regime: Regime::Plain,
        times: Quantiles {
            n: 100,
            p50_ns,
            p99_ns: 2 * p50_ns,
            p999_ns: 3 * p50_ns,
        },
        ratios: ["iceoryx2/header", "futex"]
            .map(|to| Ratio {
                to: to.to_owned(),
                p50: 1.25,
                p99: 1.5,
                runs: Vec::new(),
            })
            .into(),
        cpu_percent: (mode == Mode::Block).then_some(7.0),
    }
}

/// The well-formed drawing of these rows.
fn drawn(rows: Vec<Row>) -> String {
    let machine = "a machine with <brackets> & more".to_owned();
    let report = Report { machine, rows };
    let drawn = plot(&serde_json::to_string(&report).expect("JSON"));
    let svg = String::from_utf8(drawn.stdout).expect("UTF-8");
    assert!(drawn.status.success(), "{:?}", drawn.stderr);
    assert!(is_well_formed(&svg), "{svg}");
    svg
}

#[test]
fn a_report_becomes_a_well_formed_drawing() {
    let svg = drawn(vec![
        row("lager", Mode::Block, 2_300),
        row("iceoryx2", Mode::Block, 5_400),
        row("lager", Mode::Spin, 300),
    ]);
    assert!(!is_well_formed(&svg.replacen("</text>", "", 1)));
    // One bar for each row, ours highlighted, with its ratio and its processor time.
    assert_eq!(svg.matches("<rect class=\"ours\"").count(), 2);
    assert_eq!(svg.matches("<rect class=\"bar\"").count(), 1);
    assert!(
        svg.contains("2.30 µs · 1.25 × iceoryx2/header · 7 % CPU"),
        "{svg}"
    );
    assert!(svg.contains("Bus &amp; &lt;path&gt;"), "{svg}");
}

#[test]
fn less_than_the_clocks_tick_is_drawn_too() {
    let svg = drawn(vec![
        row("lager", Mode::Spin, 0),
        row("iceoryx2", Mode::Spin, 50),
    ]);
    assert_eq!(svg.matches("<rect class=\"ours\"").count(), 1);
    assert!(svg.contains("p50 0 ns"), "{svg}");
}

#[test]
fn what_is_no_report_is_refused_with_a_sentence() {
    let falling = r#"{"machine":"m","rows":[{"name":"lager","mode":"spin","regime":"plain",
        "p50_ns":5,"p99_ns":4,"p999_ns":6}]}"#;
    for (input, why) in [
        ("no JSON", "is no JSON"),
        ("[1, 2]", "has no list `rows`"),
        (r#"{"machine":"m","rows":[]}"#, "no rows to draw"),
        (r#"{"rows":[{"name":"lager"}]}"#, "has no text `mode`"),
        (falling, "percentiles that do not rise"),
    ] {
        let refused = plot(input);
        let said = String::from_utf8(refused.stderr).expect("UTF-8");
        assert_eq!(refused.status.code(), Some(1), "{input}: {said}");
        assert!(said.starts_with("plot: ") && said.contains(why), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}
