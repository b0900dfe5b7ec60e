//! `topic echo`: each sample with its stamp, for people as a block or a row, for programs as JSON.

use std::collections::HashMap;
use std::io::Write;
use std::time::{Duration, Instant};

use lager_ports::Source;
use lager_sample::{Description, Stamp, Topic};
use lager_topics::{TopicVisitor, by_id, visit};
use lager_wake::urgency;
use serde_json::{Value, json};

use crate::block::Blocks;
use crate::measure::Limits;
use crate::origin::Origin;
use crate::source::Shown;
use crate::wakeful::Wakeful;
use crate::{Count, POLL, ToolError, Tools};

/// The shortest time between two wakes. No eye sees the samples of 2 ms one after the other.
const REST: Duration = Duration::from_millis(2);

/// What `topic echo` shows, and when it ends.
#[derive(Clone, Debug, Default)]
pub struct EchoConfig {
    /// Dotted paths of the fields to show; empty for whole samples.
    pub fields: Vec<String>,
    /// When to end.
    pub limits: Limits,
}

impl<W: Write, P: Origin> Tools<'_, W, P> {
    /// `topic echo`: each sample of `name`, or some of its fields, until a limit or the shutdown.
    ///
    /// # Errors
    /// No topic has that name, its samples have no such field, it cannot be read, or the output
    /// cannot be written.
    pub fn echo(&mut self, name: &str, config: &EchoConfig) -> Result<(), ToolError> {
        let tools = &mut *self;
        if let Ok(Some(echoed)) = visit(name, Echo { tools, config }) {
            return echoed;
        }
        let found = self.described(name)?;
        let description = found.description();
        must_have(&description, config)?;
        let blocks = Blocks::of_found(name, &description)?;
        self.echo_from(name, found, blocks, config)
    }

    /// The writer in words: its role if that is known, and its process.
    fn writer(&self, pid: u32) -> String {
        let looked = || self.place.role_of(pid);
        match self.watchdog.over("looking for the writer", looked) {
            Some(role) => format!("{role} ({pid})"),
            None => format!("process {pid}"),
        }
    }
}

struct Echo<'a, 'b, W, P> {
    tools: &'a mut Tools<'b, W, P>,
    config: &'a EchoConfig,
}

fn must_have(description: &Description, config: &EchoConfig) -> Result<(), ToolError> {
    let mut fields = config.fields.iter();
    Ok(fields.try_for_each(|field| description.must_have(field))?)
}

impl<W: Write, P: Origin> TopicVisitor for Echo<'_, '_, W, P> {
    /// `None` if the topic has another layout than this program's.
    type Output = Option<Result<(), ToolError>>;

    fn visit<T: Topic>(self) -> Self::Output {
        let (tools, config) = (self.tools, self.config);
        let opened = must_have(&Description::of::<T::Payload>(), config)
            .and_then(|()| Ok((tools.typed::<T>()?, Blocks::new::<T>()?)));
        match opened {
            Ok((Some(from), blocks)) => Some(tools.echo_from(T::NAME, from, blocks, config)),
            Ok((None, _)) => None,
            Err(error) => Some(Err(error)),
        }
    }
}

impl<W: Write, P: Origin> Tools<'_, W, P> {
    fn echo_from(
        &mut self,
        name: &str,
        mut from: impl Source,
        mut blocks: Blocks,
        config: &EchoConfig,
    ) -> Result<(), ToolError> {
        let mut writers = HashMap::new();
        let (mut shown, mut lost) = (0, 0);
        let began = Instant::now();
        let mut heard = began;
        urgency::wake_with_others(POLL);
        let mut wakeful = Wakeful::new(self, &from, POLL, REST)?;
        while !self.shutdown.is_requested() && !config.limits.are_reached(began, shown) {
            let Some((stamp, payload)) = self.receive(&mut from, Shown)? else {
                self.out.flush()?;
                self.ask_why(heard)?;
                wakeful.wait(config.limits.left(began));
                continue;
            };
            let payload = payload?;
            heard = Instant::now();
            let received_ns = self.place.time().after(stamp.publish_time_ns);
            if self.as_json {
                let value = json!({
                    "topic": name, "sequence": stamp.sequence, "epoch": stamp.epoch,
                    "writer": stamp.writer, "source_time_ns": stamp.source_time_ns,
                    "publish_time_ns": stamp.publish_time_ns, "cause": cause(&stamp),
                    "lost": from.lost(), "payload": chosen(payload, &config.fields),
                });
                writeln!(self.out, "{value}")?;
            } else {
                if from.lost() > lost {
                    let newly = usize::try_from(from.lost() - lost).unwrap_or(usize::MAX);
                    writeln!(self.out, "-- {} lost", Count(newly, "sample"))?;
                }
                if !config.fields.is_empty() {
                    let values = config.fields.iter().map(|path| plain(at(&payload, path)));
                    let values: Vec<String> = values.collect();
                    writeln!(self.out, "{}", values.join("\t"))?;
                    (lost, shown) = (from.lost(), shown + 1);
                    continue;
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

/// The wished part of a sample: all of it, or an object of the fields by their paths.
fn chosen(payload: Value, fields: &[String]) -> Value {
    if fields.is_empty() {
        return payload;
    }
    let value = |path: &String| (path.clone(), at(&payload, path).clone());
    Value::Object(fields.iter().map(value).collect())
}

/// The value at a path; null beyond the end of a list.
fn at<'a>(payload: &'a Value, path: &str) -> &'a Value {
    path.split('.').fold(payload, |value, part| match value {
        Value::Array(list) => part
            .parse()
            .ok()
            .and_then(|place: usize| list.get(place))
            .unwrap_or(&Value::Null),
        value => &value[part],
    })
}

/// A value for people: text without quotes.
fn plain(value: &Value) -> String {
    match value.as_str() {
        Some(text) => text.to_owned(),
        None => value.to_string(),
    }
}

/// The cause of a sample, for programs; null if no sample caused it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_found_by_its_path() {
        let payload = json!({"sensor": {"up": 1}, "orders": [{"id": 7}], "mode": "Manual"});
        assert_eq!(at(&payload, "sensor.up"), &json!(1));
        assert_eq!(at(&payload, "orders.0.id"), &json!(7));
        assert_eq!(at(&payload, "orders.1.id"), &Value::Null);
        assert_eq!(plain(at(&payload, "mode")), "Manual");
        let fields = ["mode".to_owned(), "sensor.up".to_owned()];
        let chosen = chosen(payload, &fields);
        assert_eq!(chosen, json!({"mode": "Manual", "sensor.up": 1}));
    }
}
