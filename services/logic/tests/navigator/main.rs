//! The navigator on whole missions in virtual time, against a small double of the robot.

mod double;
mod floor;
mod interventions;
mod missions;
mod restarts;
mod trial;
