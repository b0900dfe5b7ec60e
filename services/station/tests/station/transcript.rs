//! A robot played by its lines.

use lager_floor::ProductId;
use lager_lines::conversation::{RobotLine, StationLine};
use lager_lines::to_line;
use lager_plant::Warehouse;
use lager_station::Robot;

/// A warehouse of 4 x 3 squares with the products 7 and 12.
pub(crate) const WAREHOUSE: &str = r#"
size = [4, 3]
side_length_cm = 40
delivery = [0, 0]

[[product]]
id = 7
name = "screws"
square = [1, 0]
side = "down"

[[product]]
id = 12
square = [0, 1]
side = "left"
"#;

pub(crate) fn warehouse() -> Warehouse {
    toml::from_str(WAREHOUSE).expect("a warehouse")
}

pub(crate) fn product(number: i32) -> ProductId {
    ProductId::new(number).expect("a number")
}

/// A robot that has connected, with its warehouse.
pub(crate) fn connected() -> Robot {
    let mut robot = Robot::default();
    assert_eq!(robot.set_warehouse(&warehouse()), Ok(None));
    robot.connected();
    robot
}

/// What the robot is told when it says `line`, as it stands on the wire; nothing is "".
pub(crate) fn say(robot: &mut Robot, line: &str) -> String {
    let line = RobotLine::read(line).expect("a robot's line");
    written(robot.heard(line))
}

/// What stands on the wire; nothing is "".
pub(crate) fn written(line: Option<StationLine>) -> String {
    let line = line.map(|line| to_line(&line).expect("it fits"));
    line.map_or(String::new(), |line| line.trim_end().to_owned())
}
