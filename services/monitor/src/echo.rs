//! `topic echo`: each sample with its stamp, as a block or a row for people or as JSON.

use std::collections::HashMap;
use std::io::Write;
use std::time::Instant;

use lager_ports::Clock;
use lager_topics::{Stamp, Topic, TopicVisitor, by_id, visit};
use serde_json::{Value, json};

use crate::block::Blocks;
use crate::{Count, ToolError, Tools};

impl<W: Write> Tools<'_, W> {
    /// `topic echo`: each sample of `name`, until `count` samples or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, it cannot be read, or the output cannot be written.
    pub fn echo(&mut self, name: &str, count: Option<u64>) -> Result<(), ToolError> {
        visit(name, Echo { tools: self, count })?
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
        let Self { tools, count } = self;
        let mut subscriber = tools.subscriber::<T>()?;
        let mut blocks = Blocks::new::<T>()?;
        let mut writers = HashMap::new();
        let (mut shown, mut lost) = (0, 0);
        let mut heard = Instant::now();
        while !tools.shutdown.is_requested() && count.is_none_or(|count| shown < count) {
            let Some(sample) = tools.receive(&mut subscriber)? else {
                tools.out.flush()?;
                tools.pause(heard)?;
                continue;
            };
            heard = Instant::now();
            let received_ns = Clock::monotonic_ns();
            let stamp = *sample.stamp();
            let payload = serde_json::to_value(*sample)?;
            drop(sample);
            if tools.as_json {
                let value = json!({
                    "topic": T::NAME, "sequence": stamp.sequence, "epoch": stamp.epoch,
                    "writer": stamp.writer, "source_time_ns": stamp.source_time_ns,
                    "publish_time_ns": stamp.publish_time_ns, "cause": cause(&stamp),
                    "lost": subscriber.lost(), "payload": payload,
                });
                writeln!(tools.out, "{value}")?;
            } else {
                if subscriber.lost() > lost {
                    let newly = usize::try_from(subscriber.lost() - lost).unwrap_or(usize::MAX);
                    writeln!(tools.out, "-- {} lost", Count(newly, "sample"))?;
                }
                let writer = writers
                    .entry(stamp.writer)
                    .or_insert_with(|| tools.writer(stamp.writer));
                let text = blocks.sample(&stamp, received_ns, writer, &payload);
                tools.out.write_all(text.as_bytes())?;
            }
            lost = subscriber.lost();
            shown += 1;
        }
        tools.out.flush()?;
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
