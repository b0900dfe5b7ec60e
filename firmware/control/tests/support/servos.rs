//! Eight scripted AX-12 servos on one wire.

use std::collections::VecDeque;

use lager_ax12::{ErrorBits, Frame, Instruction, InstructionDecoder, table};

/// Time until the first byte of an answer: six bytes of question and the servo's delay, in us.
const ANSWER_US: u32 = 600;
/// One byte at 1 Mbit/s, in microseconds.
const BYTE_US: u32 = 10;

/// One servo and its faults.
#[derive(Clone, Debug)]
pub struct Servo {
    pub position: f64,
    pub goal: u16,
    pub torque: bool,
    speed: u16,
    pub torque_limit: u16,
    pub load: i16,
    pub errors: ErrorBits,
    pub present: bool,
    /// So many of its next answers have a wrong checksum.
    pub spoiled: usize,
    /// So many of its next answers have another servo's id.
    pub misnamed: usize,
    /// The servo cannot move below this position.
    pub stop: f64,
    /// Load per position unit between its goal and the stop.
    pub stiffness: i16,
    /// The servo does not move at all.
    pub stuck: bool,
    /// Every goal that the board wrote.
    pub goals: Vec<u16>,
    pub looks: usize,
}

/// The servos on their wire.
#[derive(Clone, Debug)]
pub struct Servos {
    pub servos: Vec<Servo>,
    /// The id of each of them.
    pub ids: [u8; 8],
    decoder: InstructionDecoder,
    answers: VecDeque<(u32, u8)>,
    moved_us: Option<u32>,
    pub full: bool,
}

impl Servos {
    /// Servos without torque at these positions.
    pub fn at(positions: [u16; 8]) -> Self {
        let servos = positions
            .iter()
            .map(|position| Servo {
                position: f64::from(*position),
                goal: 0,
                torque: false,
                speed: 0,
                torque_limit: 0,
                load: 0,
                errors: ErrorBits::NONE,
                present: true,
                spoiled: 0,
                misnamed: 0,
                stop: 0.0,
                stiffness: 40,
                stuck: false,
                goals: Vec::new(),
                looks: 0,
            })
            .collect();
        Self {
            servos,
            ids: [1, 2, 3, 4, 5, 6, 7, 8],
            decoder: InstructionDecoder::new(),
            answers: VecDeque::new(),
            moved_us: None,
            full: false,
        }
    }

    /// Servo by its id.
    pub fn id(&mut self, id: u8) -> &mut Servo {
        let place = self.ids.iter().position(|own| *own == id);
        &mut self.servos[place.expect("a servo with this id")]
    }

    pub fn positions(&self) -> Vec<u16> {
        self.servos
            .iter()
            .map(|servo| servo.position.round() as u16)
            .collect()
    }

    pub fn next_byte_us(&self) -> Option<u32> {
        self.answers.front().map(|(at, _)| *at)
    }

    pub fn read(&mut self, now_us: u32) -> Option<u8> {
        let (at, byte) = *self.answers.front()?;
        let due = now_us.wrapping_sub(at) < 1 << 31;
        due.then(|| {
            self.answers.pop_front();
            byte
        })
    }

    pub fn write(&mut self, bytes: &[u8], now_us: u32) -> bool {
        if self.full {
            return false;
        }
        assert!(
            self.answers.is_empty(),
            "two talk at once on the servos' wire"
        );
        self.advance(now_us);
        for byte in bytes {
            let Some(packet) = self.decoder.push(*byte) else {
                continue;
            };
            let (id, instruction) = (packet.id, packet.instruction());
            let parameters = packet.parameters.to_vec();
            let place = self.ids.iter().position(|own| *own == id);
            let servo = place.map(|place| &mut self.servos[place]);
            let Some(servo) = servo.filter(|servo| servo.present) else {
                continue;
            };
            let registers = servo.obey(instruction.expect("a known instruction"), &parameters);
            let name = if servo.misnamed > 0 { id % 8 + 1 } else { id };
            servo.misnamed = servo.misnamed.saturating_sub(1);
            let mut answer = Frame::status(name, servo.errors, &registers)
                .unwrap()
                .as_bytes()
                .to_vec();
            if servo.spoiled > 0 {
                servo.spoiled -= 1;
                *answer.last_mut().unwrap() ^= 0x55;
            }
            for (index, byte) in answer.into_iter().enumerate() {
                let at = now_us.wrapping_add(ANSWER_US + BYTE_US * index as u32);
                self.answers.push_back((at, byte));
            }
        }
        true
    }

    fn advance(&mut self, now_us: u32) {
        let seconds = self
            .moved_us
            .map_or(0.0, |before| f64::from(now_us.wrapping_sub(before)) / 1e6);
        self.moved_us = Some(now_us);
        for servo in &mut self.servos {
            servo.advance(seconds);
        }
    }
}

impl Servo {
    fn advance(&mut self, seconds: f64) {
        if !self.torque || self.stuck {
            return;
        }
        let goal = f64::from(self.goal);
        // One speed unit is 0.111 rpm, one position unit 0.29 degrees; speed 0 is full speed.
        let speed = if self.speed == 0 {
            1_200.0
        } else {
            f64::from(self.speed) * 0.666 / 0.29
        };
        let way = (goal - self.position).clamp(-speed * seconds, speed * seconds);
        self.position = (self.position + way).max(self.stop.min(self.position));
        let missing = goal - self.position;
        self.load = if goal < self.stop && self.position <= self.stop {
            (missing.round() as i16)
                .saturating_mul(self.stiffness)
                .clamp(-1023, 1023)
        } else {
            0
        };
    }

    fn is_moving(&self) -> bool {
        let goal = f64::from(self.goal);
        self.torque && !self.stuck && self.position != goal && self.position > self.stop
    }

    fn obey(&mut self, instruction: Instruction, parameters: &[u8]) -> Vec<u8> {
        match instruction {
            Instruction::Read => {
                self.looks += 1;
                assert_eq!(parameters, [table::PRESENT_POSITION_L, 11]);
                let mut registers = vec![0; 11];
                let position = self.position.round() as u16;
                registers[..2].copy_from_slice(&position.to_le_bytes());
                registers[4..6].copy_from_slice(&table::unsigned(self.load).to_le_bytes());
                registers[6] = 117;
                registers[7] = 41;
                registers[10] = u8::from(self.is_moving());
                registers
            }
            Instruction::Write if parameters.len() == 2 => {
                assert_eq!(parameters[0], table::TORQUE_ENABLE);
                self.torque = parameters[1] == 1;
                Vec::new()
            }
            Instruction::Write => {
                assert_eq!(
                    (parameters[0], parameters.len()),
                    (table::GOAL_POSITION_L, 7)
                );
                let word = |at: usize| u16::from_le_bytes([parameters[at], parameters[at + 1]]);
                self.goal = word(1);
                self.speed = word(3);
                self.torque_limit = word(5);
                self.torque = true;
                self.goals.push(self.goal);
                Vec::new()
            }
            other => panic!("{other:?} is not for this robot"),
        }
    }
}
