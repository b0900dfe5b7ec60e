//! Tests of the navigator on whole missions in virtual time, with a small double of the robot.

mod double;
mod floor;
mod goods;
mod holds;
mod interventions;
mod missions;
mod obstacles;
mod picking;
mod queue;
mod restarts;
mod trial;
mod ways;
