//! `lager obstacle`: what stands on the ways of a simulated world.

use std::fmt::Write;

use anyhow::{Result, bail};
use lager_topics::TruthPose;

use super::{Operator, first};

impl Operator {
    /// `lager obstacle`: what stands on the ways.
    pub fn obstacles(&self) -> Result<String> {
        self.must_be_simulated()?;
        let mut truth = self.bus.subscriber::<TruthPose>()?;
        let world = first(&mut truth, &self.bus, &self.patience)?;
        let mut told = String::new();
        for stands in world.obstacles() {
            let heading = match stands.heading.get() {
                Some(heading) => heading.to_string(),
                None => "somewhere".into(),
            };
            let leaves = match stands.by_chance {
                0 => "",
                _ => ", goes by itself",
            };
            writeln!(told, "{},{},{heading}{leaves}", stands.x, stands.y)?;
        }
        Ok(match told.trim_end() {
            "" => "nothing stands on the ways".into(),
            listed => listed.into(),
        })
    }

    pub(super) fn must_be_simulated(&self) -> Result<()> {
        if self.running.body.service().is_none() {
            bail!("only a simulated floor can do that; on a real floor, do it with your hands");
        }
        Ok(())
    }
}
