//! Both boards wired to each other: ExDe with its handshake, from the sensors to the wheels.

mod support;

use lager_control::{Motor, SensorConfig, SteeringConfig};
use lager_wire::SteerFlags;
use support::servos::Servos;
use support::{Bench, SensorBench};

const MIDDLE: u16 = 0b000_0111_0000;
const FOLLOW: u8 = 3;

/// The two benches and the three wires between them, stepped together every 10 us.
struct Robot {
    sensor: SensorBench,
    steering: Bench,
    high: bool,
    returns: usize,
    /// Rises of sync the steering board does not get.
    lose: usize,
}

impl Robot {
    fn new(now_us: u32) -> Self {
        Self {
            sensor: SensorBench::boot(now_us, SensorConfig::default()),
            steering: Bench::boot(now_us, SteeringConfig::default(), Servos::at([512; 8])),
            high: false,
            returns: 0,
            lose: 0,
        }
    }

    fn run_ms(&mut self, span_ms: u32) {
        for _ in 0..span_ms * 100 {
            self.sensor.pins.now_us = self.sensor.pins.now_us.wrapping_add(10);
            self.sensor.step();
            let (data, sync) = self.sensor.pins.exde;
            if sync && !self.high {
                if self.lose > 0 {
                    self.lose -= 1;
                } else {
                    self.steering
                        .pins
                        .bits
                        .push_back((data, self.sensor.pins.now_us));
                }
            }
            self.high = sync;
            self.steering.run_us(10);
            self.steering.step();
            if self.steering.pins.returns > self.returns {
                self.returns = self.steering.pins.returns;
                self.sensor.pins.returned = true;
            }
        }
    }
}

#[test]
fn tape_under_the_sensors_moves_the_wheels() {
    let mut robot = Robot::new(u32::MAX - 30_000);
    robot.sensor.tape(MIDDLE);
    robot.run_ms(60);
    assert_eq!(robot.returns, 1, "one return sync, the handshake's");
    robot.steering.command(FOLLOW);
    robot.run_ms(40);
    assert_eq!(
        robot.steering.pins.motors,
        (Motor::forward(100), Motor::forward(100))
    );
    robot.sensor.tape(MIDDLE >> 1);
    robot.run_ms(40);
    assert_eq!(
        robot.steering.pins.motors,
        (Motor::forward(104), Motor::forward(96))
    );
    assert_eq!(robot.returns, 1);
}

#[test]
fn a_lost_pulse_costs_one_word_and_is_counted() {
    let mut robot = Robot::new(0);
    robot.sensor.tape(MIDDLE);
    robot.run_ms(60);
    robot.steering.command(FOLLOW);
    robot.lose = 1;
    robot.run_ms(600);
    let report = robot.steering.report();
    assert!(report.flags.contains(SteerFlags::EXDE_OK));
    assert_eq!(
        report.line_error, 0,
        "the words after the lost pulse are whole"
    );
    let status = robot.steering.pi.all(|payload| match payload {
        lager_wire::Payload::BoardStatus(status) => Some(status.exde_errors),
        _ => None,
    });
    assert_eq!(status.last().unwrap().1, 1);
}

#[test]
fn either_board_may_restart_alone() {
    let mut robot = Robot::new(0);
    robot.sensor.tape(MIDDLE);
    robot.run_ms(60);
    robot.steering.command(FOLLOW);
    robot.run_ms(40);
    let now_us = robot.sensor.pins.now_us;
    robot.sensor = SensorBench::boot(now_us, SensorConfig::default());
    robot.sensor.tape(MIDDLE);
    robot.run_ms(130);
    assert!(robot.steering.report().flags.contains(SteerFlags::EXDE_OK));
    assert_ne!(robot.steering.pins.motors.0, Motor::OFF);

    robot.steering = Bench::boot(
        robot.sensor.pins.now_us,
        SteeringConfig::default(),
        Servos::at([512; 8]),
    );
    robot.returns = 0;
    robot.run_ms(60);
    assert_eq!(
        robot.steering.pins.motors,
        (Motor::OFF, Motor::OFF),
        "nothing was told it yet"
    );
    robot.steering.command(FOLLOW);
    robot.run_ms(40);
    assert!(robot.steering.report().flags.contains(SteerFlags::EXDE_OK));
    assert_ne!(robot.steering.pins.motors.0, Motor::OFF);
}
