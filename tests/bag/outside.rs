//! Tests that the Python packages `mcap` and `jsonschema`, which know nothing of this project, can
//! read a recording. They are in the environment that `tests/run` makes.

use std::process::Command;

use lager_sample::Topic as _;
use lager_tests::{Domain, wait_for};
use serde_json::Value;

use crate::{NoiseNow, Noisy, end, guest, recorder, said};

#[test]
#[ignore = "needs LAGER_PYTHON, a Python with mcap and jsonschema; tests/run makes one"]
fn other_peoples_readers_find_every_message_and_each_fits_its_schema() {
    let domain = Domain::new();
    let recorder = recorder(&domain, &["tour.mcap"]);
    let up = domain.start(&["up", "--headless", "--mission", "1", "--speed", "4"]);
    // Besides the robot's topics, one that its table does not have.
    let bus = guest(&domain);
    let mut noisy = Noisy::new(&bus);
    wait_for("a thousand lines", || {
        noisy.send();
        let said = recorder.output();
        let progress: Value = serde_json::from_str(said.lines().last()?).ok()?;
        let topics = progress["topics"].as_array()?;
        let line = topics
            .iter()
            .find(|topic| topic["topic"] == "sensor/line")?;
        (line["received"].as_u64()? > 1_000).then_some(())
    });
    drop(up);
    let told = end(recorder);
    drop((noisy, bus));
    let python = std::env::var_os("LAGER_PYTHON").expect("LAGER_PYTHON names a Python");
    let read = Command::new(python)
        .arg(lager_tests::in_tree("tests/bag/read.py"))
        .arg(domain.folder().join("tour.mcap"))
        .output()
        .expect("Python starts");
    assert!(read.status.success(), "{}", said(&read));
    let read: Value = serde_json::from_slice(&read.stdout).expect("JSON");
    let (counts, numbered) = (&read["messages"], &read["numbered"]);
    let topics = told["topics"].as_array().expect("topics");
    for topic in topics {
        assert_eq!(topic["dropped"], 0);
        let name = topic["topic"].as_str().expect("a name");
        let there = counts.get(name).and_then(Value::as_u64).unwrap_or_default();
        assert_eq!(topic["received"].as_u64(), Some(there), "{name}");
        // The robot's writers began after the recorder, so each of their samples was received or
        // counted as lost. The recorder finds a topic outside the table a little later.
        let sent = numbered
            .get(name)
            .and_then(Value::as_u64)
            .unwrap_or_default();
        let lost = topic["lost"].as_u64().expect("a number");
        if name != NoiseNow::NAME {
            assert_eq!(there + lost, sent, "{name}");
        }
    }
    assert!(counts["sensor/line"].as_u64() > Some(1_000), "{counts}");
    // Each view fits the exact schema that the file has for it.
    for view in lager_journal::View::ALL {
        assert!(counts[view.topic()].as_u64() > Some(0), "{view:?}");
    }

    // The project's own package, which reads a recording as it reads a robot.
    let read = Command::new(std::env::var_os("LAGER_PYTHON").expect("as above"))
        .arg(lager_tests::in_tree("bus/python/tests/bag.py"))
        .arg(domain.folder().join("tour.mcap"))
        .output()
        .expect("Python starts");
    assert!(read.status.success(), "{}", said(&read));
    let read: Value = serde_json::from_slice(&read.stdout).expect("JSON");
    for topic in topics
        .iter()
        .filter(|topic| topic["received"].as_u64() > Some(0))
    {
        let found = &read[topic["topic"].as_str().expect("a name")];
        assert_eq!(found["received"], topic["received"], "{topic}");
        assert_eq!(found["missing"], topic["lost"], "{topic}");
    }

    let picture = domain.folder().join("mission.png");
    let plotted = Command::new(std::env::var_os("LAGER_PYTHON").expect("as above"))
        .arg(lager_tests::in_tree("bus/python/examples/mission.py"))
        .arg(domain.folder().join("tour.mcap"))
        .arg(&picture)
        .output()
        .expect("Python starts");
    assert!(plotted.status.success(), "{}", said(&plotted));
    let picture = std::fs::read(picture).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 10_000);
    domain.assert_clean();
}
