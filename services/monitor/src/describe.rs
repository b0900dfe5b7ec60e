//! `topic list` and `topic info`: the topics of the bus, and the properties of one.

use std::io::Write;

use lager_ports::{Layout, TopicInfo};
use lager_topics::{TOPICS, UnknownTopic};
use serde_json::json;

use crate::origin::Origin;
use crate::{Count, ToolError, Tools};

/// A topic's line in the list, with how many publishers, subscribers and observers it has.
fn listed(name: &str, [publishers, subscribers, observers]: [usize; 3]) -> String {
    let publishers = Count(publishers, "publisher").to_string();
    let subscribers = Count(subscribers, "subscriber").to_string();
    let observers = Count(observers, "observer");
    format!("{name:30}  {publishers:>13}  {subscribers:>14}, {observers} among them")
}

impl<W: Write> Tools<'_, W> {
    /// `topic list` of every robot on the bus. Returns how many there are.
    ///
    /// # Errors
    /// The state of the bus cannot be read, or the output cannot be written.
    pub fn list_every_robot(&mut self) -> Result<usize, ToolError> {
        let topics = self
            .watchdog
            .over("listing the topics", || self.place.topics())?;
        self.print_list(topics, true)
    }
}

impl<W: Write, P: Origin> Tools<'_, W, P> {
    /// `topic list`: every open topic of the robot. Returns how many there are.
    ///
    /// # Errors
    /// They cannot be listed, or the output cannot be written.
    pub fn list(&mut self) -> Result<usize, ToolError> {
        let topics = self
            .watchdog
            .over("listing the topics", || self.place.every_topic());
        self.print_list(topics.map_err(Into::into)?, false)
    }

    fn print_list(
        &mut self,
        mut topics: Vec<TopicInfo>,
        every_robot: bool,
    ) -> Result<usize, ToolError> {
        topics.sort_by(|a, b| a.unit.cmp(&b.unit));
        let count = topics.len();
        if topics.is_empty() && !self.as_json {
            let of = match every_robot {
                true => "on this bus".to_owned(),
                false => format!("of the robot `{}`", self.place.unit()),
            };
            writeln!(self.out, "no topic {of} is open; `lager up` starts a robot")?;
        }
        for topic in topics {
            if self.as_json {
                let value = json!({
                    "robot": topic.unit.as_str(), "topic": topic.name,
                    "publishers": topic.publishers, "subscribers": topic.subscribers,
                    "observers": topic.observers, "ours": topic.layout == Layout::Ours,
                });
                writeln!(self.out, "{value}")?;
                continue;
            }
            let name = format!("lager/{}/{}", topic.unit, topic.name);
            match topic.layout {
                Layout::Ours | Layout::Described => {
                    let ends = [topic.publishers, topic.subscribers, topic.observers];
                    writeln!(self.out, "{}", listed(&name, ends))?;
                }
                _ => writeln!(
                    self.out,
                    "{name:30}  of another build: its layout is not this one's"
                )?,
            }
        }
        Ok(count)
    }

    /// `topic info`: what one topic carries, its limits, and who writes and reads it now.
    ///
    /// # Errors
    /// No topic has that name, or the output cannot be written.
    pub fn info(&mut self, name: &str) -> Result<(), ToolError> {
        let Some(entry) = TOPICS.iter().find(|entry| entry.name == name) else {
            return self.info_of_found(name);
        };
        let layout = entry.layout;
        let topics = self
            .watchdog
            .over("looking at the topic", || self.place.every_topic());
        let topics = topics.map_err(Into::into)?;
        let live = topics.into_iter().find(|topic| topic.name == name);
        if live
            .as_ref()
            .is_some_and(|live| live.layout == Layout::Described)
        {
            // The robot is of another build.
            return self.info_of_found(name);
        }
        let (publishers, subscribers) = live
            .as_ref()
            .map_or((0, 0), |topic| (topic.publishers, topic.subscribers));
        let woken: Vec<u32> = live
            .iter()
            .flat_map(|topic| topic.woken.iter().map(|peer| peer.pid))
            .collect();
        let actors: Vec<String> = entry.qos.actors.iter().map(ToString::to_string).collect();
        if self.as_json {
            let fields: Vec<_> = layout
                .fields
                .iter()
                .map(|field| {
                    json!({"name": field.name, "type": field.type_name, "offset": field.offset})
                })
                .collect();
            let value = json!({
                "name": name, "summary": entry.summary, "type": layout.type_name,
                "hash": format!("{:016x}", layout.hash), "size": layout.size, "fields": fields,
                "buffer": entry.qos.buffer, "history": entry.qos.history, "actors": actors,
                "publishers": publishers, "subscribers": subscribers, "woken": woken,
            });
            writeln!(self.out, "{value}")?;
            return Ok(());
        }
        let out = &mut *self.out;
        writeln!(out, "{name}: {}", entry.summary)?;
        writeln!(
            out,
            "  carries     {}, {}, schema {:016x}",
            layout.type_name,
            Count(layout.size, "byte"),
            layout.hash
        )?;
        for field in layout.fields {
            writeln!(
                out,
                "    {:4}  {:24} {}",
                field.offset, field.name, field.type_name
            )?;
        }
        writeln!(
            out,
            "  keeps       {} for each subscriber, {}",
            Count(entry.qos.buffer, "sample"),
            match entry.qos.history {
                0 => "nothing for late joiners",
                _ => "the last one for late joiners",
            }
        )?;
        let awake = if actors.is_empty() {
            "nobody".to_owned()
        } else {
            actors.join(", ")
        };
        writeln!(out, "  wakes       {awake}")?;
        writeln!(
            out,
            "  has now     {}, {}",
            Count(publishers, "publisher"),
            Count(subscribers, "subscriber")
        )?;
        let ends = live.iter().flat_map(|topic| {
            let writers = topic.writers.iter().map(|peer| ("written", peer));
            let readers = topic.readers.iter().map(|peer| ("read", peer));
            let woken = topic.woken.iter().map(|peer| ("woken", peer));
            writers.chain(readers).chain(woken)
        });
        for (done, peer) in ends {
            let by = if done == "woken" { "is" } else { "by" };
            writeln!(
                out,
                "    {done:7} {by} {}, process {}",
                peer.who(),
                peer.pid
            )?;
        }
        Ok(())
    }

    /// Describes a topic that is not in the table.
    fn info_of_found(&mut self, name: &str) -> Result<(), ToolError> {
        let topics = self
            .watchdog
            .over("looking at the topic", || self.place.every_topic());
        let mut topics = topics.map_err(Into::into)?.into_iter();
        let topic = topics.find(|topic| topic.name == name);
        let described = topic.and_then(|mut topic| Some((topic.description.take()?, topic)));
        let (description, topic) = described.ok_or_else(|| UnknownTopic(name.to_owned()))?;
        let (publishers, subscribers) = (topic.publishers, topic.subscribers);
        let fields: Vec<&str> = description.fields().collect();
        if self.as_json {
            let value = json!({
                "name": name, "type": description.name(), "size": description.size(),
                "fields": fields, "publishers": publishers, "subscribers": subscribers,
            });
            writeln!(self.out, "{value}")?;
            return Ok(());
        }
        let size = Count(description.size(), "byte");
        writeln!(self.out, "{name}: not as in a table of this build")?;
        writeln!(self.out, "  carries     {}, {size}", description.name())?;
        writeln!(self.out, "    {}", fields.join(", "))?;
        let publishers = Count(publishers, "publisher");
        let subscribers = Count(subscribers, "subscriber");
        writeln!(self.out, "  has now     {publishers}, {subscribers}")?;
        Ok(())
    }
}
