//! Both boards wired to each other, from the sensors over ExDe and its handshake to the wheels.

mod support;

use lager_control::{Motor, SensorConfig, SteeringConfig};
use lager_exde::{Receiver, Timing, Transmitter, WireAction};
use lager_wire::SteerFlags;
use support::servos::Servos;
use support::{Bench, SensorBench};

const MIDDLE: u16 = 0b000_0111_0000;
const FOLLOW: u8 = 3;

/// The two benches and the three wires between them; a step is 10 us for all.
struct Robot {
    sensor: SensorBench,
    steering: Bench,
    sender: Transmitter,
    /// Rest of the sender's wait; `None` while it is ready.
    wait_us: Option<u16>,
    receiver: Receiver,
    /// Time since the last pulse; `None` once the receiver knows of the silence.
    since_us: Option<u16>,
    data: bool,
    /// Words that the sensor board has handed to the sender.
    begun: usize,
    returns: usize,
    /// So many pulses do not reach the steering board.
    lose: usize,
}

impl Robot {
    fn new(now_us: u32) -> Self {
        let mut sensor = SensorBench::boot(now_us, SensorConfig::default());
        sensor.pins.word_us = 310;
        Self {
            sensor,
            steering: Bench::boot(now_us, SteeringConfig::default(), Servos::at([512; 8])),
            sender: Transmitter::new(),
            wait_us: Some(0),
            receiver: Receiver::new(),
            since_us: None,
            data: false,
            begun: 0,
            returns: 0,
            lose: 0,
        }
    }

    fn run_ms(&mut self, span_ms: u32) {
        for _ in 0..span_ms * 100 {
            self.sensor.pins.now_us = self.sensor.pins.now_us.wrapping_add(10);
            self.sensor.step();
            self.move_wires();
            self.steering.pins.exde_errors = self.receiver.errors();
            self.steering.run_us(10);
            self.steering.step();
        }
    }

    /// Lets ten microseconds pass on the wires.
    fn move_wires(&mut self) {
        self.since_us = self.since_us.map(|us| us + 10);
        if self.since_us == Some(Timing::STANDARD.idle_us) {
            self.since_us = None;
            if self.receiver.on_silence() {
                self.returns += 1;
                self.sender.on_return();
                self.sensor.pins.answered = true;
            }
        }
        let words = &self.sensor.pins.words;
        let step = if words.len() > self.begun {
            self.begun = words.len();
            self.sender.start(words[self.begun - 1].1)
        } else {
            self.wait_us = self.wait_us.map(|us| us.saturating_sub(10));
            (self.wait_us == Some(0)).then(|| self.sender.advance())
        };
        let Some(step) = step else { return };
        self.wait_us = step.wait_us;
        match step.action {
            WireAction::Nothing => {}
            WireAction::Place(level) => self.data = level,
            WireAction::Release => self.data = false,
            WireAction::Pulse if self.lose > 0 => self.lose -= 1,
            WireAction::Pulse => {
                let word = self
                    .receiver
                    .on_sync(self.data, self.since_us.unwrap_or(u16::MAX));
                self.since_us = Some(0);
                let now_us = self.sensor.pins.now_us;
                self.steering
                    .pins
                    .words
                    .extend(word.map(|word| (word, now_us)));
            }
        }
    }

    fn restart_sensor(&mut self) {
        self.sensor = SensorBench::boot(self.sensor.pins.now_us, SensorConfig::default());
        self.sensor.pins.word_us = 310;
        self.sender = Transmitter::new();
        self.wait_us = Some(0);
        self.begun = 0;
    }

    fn restart_steering(&mut self) {
        self.steering = Bench::boot(
            self.sensor.pins.now_us,
            SteeringConfig::default(),
            Servos::at([512; 8]),
        );
        self.receiver = Receiver::new();
        self.since_us = None;
        self.returns = 0;
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
    robot.restart_sensor();
    robot.sensor.tape(MIDDLE);
    robot.run_ms(130);
    assert!(robot.steering.report().flags.contains(SteerFlags::EXDE_OK));
    assert_ne!(robot.steering.pins.motors.0, Motor::OFF);

    robot.restart_steering();
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
