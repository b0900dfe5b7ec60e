//! How long the robot's own actors took with the samples of a topic, as they count it themselves.
//!
//! `topic delay` is an observer that nobody wakes, so what it sees says little of the actor that the
//! bus wakes. Logic and bridge count every frame and every order, and publish whole histograms
//! (`latency/path`, `latency/command`). This file reads the stages that belong to a topic.

use lager_ports::{Place, ReceiveError, Source, newest};
use lager_sample::Topic;
use lager_topics::{
    CommandLatency, Durations, LatencyCommand, LatencyPath, PathLatency, SensorDistance,
    SensorLine, SteeringCommand,
};
use serde_json::{Value, json};

/// Two stages of an actor's work, by name.
type Stages = [(&'static str, Durations); 2];

/// Reads the newest counts, if there are any.
type Look = Box<dyn FnMut() -> Result<Option<Stages>, ReceiveError>>;

/// The actor of a topic that counts how long it takes.
pub(crate) struct Actor {
    role: &'static str,
    /// Where it tells its counts.
    topic: &'static str,
    look: Look,
    /// All since it started.
    counted: Option<Stages>,
}

impl Actor {
    /// The actor of the topic with that name; `None` if none counts its samples, or none runs.
    ///
    /// # Errors
    /// Its counts are there and cannot be read.
    pub(crate) fn of<P: Place>(name: &str, place: &P) -> Result<Option<Self>, P::OpenError> {
        let (role, topic, look) = if [SensorLine::NAME, SensorDistance::NAME].contains(&name) {
            let look = reads::<LatencyPath>(place.typed::<LatencyPath>()?, |path: &PathLatency| {
                [
                    ("publish_to_receive", path.publish_receive),
                    ("read_to_decided", path.total),
                ]
            });
            ("logic", LatencyPath::NAME, look)
        } else if name == SteeringCommand::NAME {
            let look = reads::<LatencyCommand>(
                place.typed::<LatencyCommand>()?,
                |command: &CommandLatency| {
                    [
                        ("publish_to_receive", command.order_receive),
                        ("read_to_written", command.total),
                    ]
                },
            );
            ("bridge", LatencyCommand::NAME, look)
        } else {
            return Ok(None);
        };
        Ok(look.map(|look| Self {
            role,
            topic,
            look,
            counted: None,
        }))
    }

    /// Takes over the newest counts.
    ///
    /// # Errors
    /// The transport failed.
    pub(crate) fn look(&mut self) -> Result<(), ReceiveError> {
        self.counted = (self.look)()?.or(self.counted);
        Ok(())
    }

    /// For programs; null before the first counts have come.
    pub(crate) fn as_json(&self) -> Value {
        let Some(stages) = &self.counted else {
            return Value::Null;
        };
        let mut told = json!({ "role": self.role });
        for (name, stage) in stages {
            told[*name] = json!({
                "samples": stage.count, "p50_ns": stage.tail_ns(0.5),
                "p99_ns": stage.tail_ns(0.99), "p999_ns": stage.tail_ns(0.999),
                "max_ns": stage.max_ns,
            });
        }
        told
    }

    /// For people; empty before the first counts have come.
    pub(crate) fn as_text(&self) -> String {
        let Some(stages) = &self.counted else {
            return String::new();
        };
        let ms = |ns: Option<u64>| {
            ns.map_or_else(
                || "       -".to_owned(),
                |ns| format!("{:8.3}", ns as f64 / 1e6),
            )
        };
        let mut text = format!(
            "{} itself, which the bus wakes; all since it started ({}):",
            self.role, self.topic
        );
        for (name, stage) in stages {
            text += &format!(
                "\n  {:18}  p50 {}  p99 {}  p99.9 {}  max {} ms  of {}",
                name.replace("_to_", " -> "),
                ms(stage.tail_ns(0.5)),
                ms(stage.tail_ns(0.99)),
                ms(stage.tail_ns(0.999)),
                ms((stage.count > 0).then_some(stage.max_ns)),
                stage.count,
            );
        }
        text
    }
}

/// Reads `stages` off the newest sample of a topic that is there.
fn reads<T: Topic>(
    from: Option<impl Source + 'static>,
    stages: impl Fn(&T::Payload) -> Stages + 'static,
) -> Option<Look> {
    let mut from = from?;
    Some(Box::new(move || {
        Ok(newest::<T>(&mut from)?.map(|(_, payload)| stages(&payload)))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_actor_tells_the_tail_of_all_that_it_has_counted() {
        let mut stage = Durations::default();
        (0..10_000).for_each(|_| stage.record(100_000));
        let few = [7_000, 9_000]
            .into_iter()
            .fold(Durations::default(), |mut few, ns| {
                few.record(ns);
                few
            });
        let mut told = Some([("publish_to_receive", stage), ("read_to_decided", few)]);
        let mut actor = Actor {
            role: "logic",
            topic: "latency/path",
            look: Box::new(move || Ok(told.take())),
            counted: None,
        };
        assert_eq!(
            (actor.as_json(), actor.as_text()),
            (Value::Null, String::new())
        );
        // Counts stay until newer ones come.
        actor.look().expect("counts");
        actor.look().expect("none");
        let json = actor.as_json();
        assert_eq!(json["publish_to_receive"]["p999_ns"], 100_000);
        let expected = json!({
            "samples": 2, "p50_ns": null, "p99_ns": null, "p999_ns": null, "max_ns": 9_000,
        });
        assert_eq!(json["read_to_decided"], expected);
        let text = actor.as_text();
        assert!(text.contains("p99.9    0.100"), "{text}");
        assert!(
            text.lines().all(|line| line.chars().count() <= 100),
            "{text}"
        );
    }
}
