//! Noise on the Pi's line.

use std::time::Duration;

use lager_emulator::rig::Board;
use lager_plant::noise::Noise;

use crate::support::Robot;

/// Sends random bytes at the full rate, so that the Pi's own SYNs and ACKs do not get through.
fn disturb(board: Board, seconds: u64) {
    let mut robot = Robot::up(1);
    let mut noise = Noise::new(99, 7);
    robot.rig.take_motor_changes();
    let slice = Duration::from_millis(10);
    for _ in 0..seconds * 100 {
        // 10 ms at 50 000 bytes a second.
        let bytes: Vec<u8> = (0..500).map(|_| noise.bits() as u8).collect();
        robot.rig.write(board, &bytes);
        robot.rig.run_for(slice);
        let _ = robot.rig.read(Board::Sensor);
        let _ = robot.rig.read(Board::Steering);
    }
    for board in Board::BOTH {
        assert_eq!(robot.rig.chip(board).resets(), 0, "no reset");
        assert_eq!(robot.rig.chip(board).crashes(), 0);
    }
    assert_eq!(robot.rig.take_motor_changes(), [], "no motion");
    // Afterwards the board still works.
    robot.run(Duration::from_millis(1_500));
    assert!(robot.sensor.is_up() && robot.steering.is_up());
}

#[test]
fn noise_moves_nothing_and_resets_nothing() {
    disturb(Board::Steering, 20);
}

#[test]
fn noise_on_the_sensor_boards_line_resets_nothing() {
    disturb(Board::Sensor, 5);
}
