//! The robot as one of the chains that take turns: it finds its way back after it stood still, and
//! answers frames.

use std::time::Instant;

use lager_rig::interrupted;

use super::{Answer, FOLLOW, IN_A_ROW, Robot, UP_WITHIN};
use crate::error::BenchError;
use crate::path::pace::ANSWER_WITHIN;
use crate::path::processes::Processes;
use crate::path::services::{RealTime, bus_error};
use crate::path::stages::Counted;
use crate::path::turn::Chain;

impl Chain for Robot {
    fn processes(&mut self) -> &mut Processes {
        &mut self.processes
    }

    fn begin(&mut self) -> Result<(), BenchError> {
        let start = Instant::now();
        let mut in_a_row = 0;
        // It may have stood still for longer than leases and links hold, and finds its way back by
        // itself; or for nearly as long, and then the next report must not be late.
        self.reported_ns = 0;
        while in_a_row < IN_A_ROW {
            if interrupted() {
                return Err(BenchError::Interrupted);
            }
            if start.elapsed() > UP_WITHIN {
                return Err(self.processes.fault(&self.name, self.frames));
            }
            self.play_boards()?;
            in_a_row = match self.exchange(20_000_000)? {
                Answer::After(_) => in_a_row + 1,
                Answer::Overtaken(_) | Answer::None => 0,
            };
        }
        Ok(())
    }

    fn frame(&mut self) -> Result<u64, BenchError> {
        let time = match self.exchange(ANSWER_WITHIN)? {
            Answer::After(time) => time,
            Answer::Overtaken(time) => {
                if self.counts {
                    self.overtaken.push(time);
                }
                time
            }
            Answer::None => return Err(self.processes.fault(&self.name, self.frames)),
        };
        // While the robot stands: a report is news to logic too, which then looks for the line.
        if self.last.0 != FOLLOW {
            self.report()?;
        }
        Ok(time)
    }

    fn counts(&mut self, counts: bool) -> Result<(), BenchError> {
        self.counts = counts;
        let priority = self.boards_priority.filter(|_| counts);
        self.urgent = priority.map(RealTime::begin).transpose()?;
        Ok(())
    }

    fn overtaken(&self) -> &[u64] {
        &self.overtaken
    }

    fn counted(&mut self) -> Result<Option<Counted>, BenchError> {
        let reading = "reading the robot's latencies";
        let path = self.path_latency.latest().map_err(bus_error(reading))?;
        let command = self.command_latency.latest().map_err(bus_error(reading))?;
        Ok(path.zip(command).map(|(path, command)| Counted {
            path: *path,
            command: *command,
        }))
    }
}
