//! `lager doctor` at boards that are played here, so that they can be stuck, or have another image.

use std::fs;
use std::path::PathBuf;

use lager_rig::boards::{Built, Peer, Plugged, SensorBoard, SteeringBoard};
use lager_tests::Domain;
use lager_wire::BUILD;

use crate::{assert_says, text};

/// A robot that is down, and the ports of its boards.
struct Robot {
    domain: Domain,
    config: PathBuf,
    ports: [PathBuf; 2],
}

impl Robot {
    fn new() -> Self {
        let domain = Domain::among_others();
        let at = |name: &str| domain.folder().join(name);
        let (config, ports) = (at("lager.toml"), [at("ttyUSB0"), at("ttyUSB1")]);
        let [sensor, steering] = &ports;
        let serial = format!("[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n");
        fs::write(&config, format!("body = \"serial\"\n{serial}")).expect("a file");
        Self {
            domain,
            config,
            ports,
        }
    }

    fn plug<P: Peer>(&self, place: usize, board: P) -> Plugged<P> {
        Plugged::new(board, self.ports[place].clone(), 1.0)
    }

    fn doctor(&self, more: &[&str]) -> String {
        let args = [&["--config", text(&self.config), "doctor"], more].concat();
        String::from_utf8_lossy(&self.domain.run(&args).stdout).into_owned()
    }
}

#[test]
fn the_doctor_restarts_a_board_that_answers_and_does_not_work_only_if_it_may() {
    let robot = Robot::new();
    let board = robot.plug(0, SensorBoard::new());
    let doctor = |more: &[&str]| robot.doctor(more);
    let well = ["ok    sensor board", "tape under ....###...."];
    assert_says(&doctor(&[]), &well);
    board.with(|board| board.deaf = true);
    let advice = "`lager doctor --fix` or `lager board reset sensor` restarts it";
    assert_says(
        &doctor(&[]),
        &["no reading of the line sensors came", advice],
    );
    assert_eq!(board.with(|board| board.restarts), 0, "it only looked");
    let fixed = doctor(&["--fix"]);
    assert_says(&fixed, &well);
    assert_says(&fixed, &["it was restarted; build"]);
    assert_eq!(board.with(|board| board.restarts), 1);
    assert!(!doctor(&["--fix"]).contains("it was restarted"), "it works");
    drop(board);
    robot.domain.assert_clean();
}

#[test]
fn an_image_that_does_not_fit_is_named_by_its_board_with_what_helps_and_no_other_part_is() {
    let (older, newer) = (BUILD - 1, BUILD + 1);
    let update = "`lager board update` gives it the image that fits";
    let install = "install the newer program that came with that image";
    for (builds, misfits, helps) in [
        ([older, BUILD], 1, update),
        ([BUILD, older], 1, update),
        ([older, older], 2, update),
        // It is the Pi that is old.
        ([newer, newer], 2, install),
        ([BUILD, BUILD], 0, update),
    ] {
        let robot = Robot::new();
        let [sensor, steering] = builds;
        let boards = (
            robot.plug(
                0,
                Built {
                    board: SensorBoard::new(),
                    build: sensor,
                },
            ),
            robot.plug(
                1,
                Built {
                    board: SteeringBoard::new(),
                    build: steering,
                },
            ),
        );
        let said = robot.doctor(&[]);
        for (board, build) in [("sensor board", sensor), ("steering board", steering)] {
            assert_says(&said, &[board, &format!("build {build} at ")]);
            let is_told = said.contains(&format!("{board}: its image has build {build}"));
            assert_eq!(is_told, build != BUILD, "{board} of {builds:?}: {said}");
        }
        assert_eq!(said.matches(helps).count(), misfits, "{builds:?}: {said}");
        assert_eq!(
            said.matches("its image has build").count(),
            misfits,
            "{said}"
        );
        drop(boards);
        robot.domain.assert_clean();
    }
}
