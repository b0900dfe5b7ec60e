//! `topic echo`: each sample with its stamp, as a block or a row for people or as JSON.

use std::collections::HashMap;
use std::io::Write;
use std::time::Instant;

use lager_ports::{Clock, Source};
use lager_topics::{Stamp, Topic, TopicVisitor, by_id, visit};
use serde_json::{Value, json};

use crate::block::Blocks;
use crate::source::Shown;
use crate::{Count, ToolError, Tools};

impl<W: Write> Tools<'_, W> {
    /// `topic echo`: each sample of `name`, until `count` samples or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, it cannot be read, or the output cannot be written.
    pub fn echo(&mut self, name: &str, count: Option<u64>) -> Result<(), ToolError> {
        match visit(name, Echo { tools: self, count }) {
            Ok(echoed) => echoed,
            Err(unknown) => {
                let found = self.found(name, unknown)?;
                let blocks = Blocks::of_found(&found)?;
                self.echo_from(name, found, blocks, count)
            }
        }
    }

    /// Who writes, in words: its role where the bus knows it, and its process.
    fn writer(&self, pid: u32) -> String {
        let nodes = self
            .watchdog
            .over("looking for the writer", || self.bus.nodes());
        let role = nodes
            .unwrap_or_default()
            .iter()
            .find_map(|node| node.role.filter(|_| node.pid == pid));
        match role {
            Some(role) => format!("{role} ({pid})"),
            None => format!("process {pid}"),
        }
    }
}

struct Echo<'a, 'b, W> {
    tools: &'a mut Tools<'b, W>,
    count: Option<u64>,
}

impl<W: Write> TopicVisitor for Echo<'_, '_, W> {
    type Output = Result<(), ToolError>;

    fn visit<T: Topic>(self) -> Self::Output {
        let subscriber = self.tools.subscriber::<T>()?;
        let blocks = Blocks::new::<T>()?;
        self.tools
            .echo_from(T::NAME, subscriber, blocks, self.count)
    }
}

impl<W: Write> Tools<'_, W> {
    fn echo_from(
        &mut self,
        name: &str,
        mut from: impl Source,
        mut blocks: Blocks,
        count: Option<u64>,
    ) -> Result<(), ToolError> {
        let mut writers = HashMap::new();
        let (mut shown, mut lost) = (0, 0);
        let mut heard = Instant::now();
        while !self.shutdown.is_requested() && count.is_none_or(|count| shown < count) {
            let Some((stamp, payload)) = self.receive(&mut from, Shown)? else {
                self.out.flush()?;
                self.pause(heard)?;
                continue;
            };
            let payload = payload?;
            heard = Instant::now();
            let received_ns = Clock::monotonic_ns();
            if self.as_json {
                let value = json!({
                    "topic": name, "sequence": stamp.sequence, "epoch": stamp.epoch,
                    "writer": stamp.writer, "source_time_ns": stamp.source_time_ns,
                    "publish_time_ns": stamp.publish_time_ns, "cause": cause(&stamp),
                    "lost": from.lost(), "payload": payload,
                });
                writeln!(self.out, "{value}")?;
            } else {
                if from.lost() > lost {
                    let newly = usize::try_from(from.lost() - lost).unwrap_or(usize::MAX);
                    writeln!(self.out, "-- {} lost", Count(newly, "sample"))?;
                }
                let writer = writers
                    .entry(stamp.writer)
                    .or_insert_with(|| self.writer(stamp.writer));
                let text = blocks.sample(&stamp, received_ns, writer, &payload);
                self.out.write_all(text.as_bytes())?;
            }
            lost = from.lost();
            shown += 1;
        }
        self.out.flush()?;
        Ok(())
    }
}

/// What a sample followed from, for programs; null = from no sample.
fn cause(stamp: &Stamp) -> Value {
    if stamp.cause_topic == 0 {
        return Value::Null;
    }
    json!({
        // A newer build may have topics that this one does not know.
        "topic": by_id(stamp.cause_topic).map(|entry| entry.name),
        "publish_time_ns": stamp.cause_publish_time_ns,
        "receive_time_ns": stamp.cause_receive_time_ns,
    })
}
