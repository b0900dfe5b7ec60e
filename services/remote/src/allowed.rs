//! [`Allowed`]: which topics leave the robot, and how often.

use std::collections::BTreeMap;
use std::fmt;

use crate::key::is_carried;
use crate::limit::Limit;

/// The list of topics that are carried, and the limits of their rates.
#[derive(Clone, Debug, PartialEq)]
pub struct Allowed {
    topics: Vec<Pattern>,
    rates: BTreeMap<String, f64>,
}

/// One entry of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Pattern {
    All,
    /// All that begin so; it ends with `/`.
    Under(String),
    One(String),
}

/// Why a list or a limit makes no sense.
#[derive(Clone, Debug, PartialEq)]
pub enum AllowedError {
    /// An entry of the list is no topic and no pattern.
    Topic(String),
    /// A limit stands under a name that no topic can have.
    RateOf(String),
    /// A limit is no rate.
    Rate {
        /// Of this topic.
        topic: String,
        /// What stands there.
        hz: f64,
    },
    /// A limit of a topic that is not carried.
    NotCarried(String),
}

impl fmt::Display for AllowedError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Topic(entry) => write!(
                formatter,
                "`{entry}` is no topic; write a topic such as \"sensor/line\", all below a name as in \
                 \"sensor/*\", or \"*\" for every topic"
            ),
            Self::RateOf(topic) => write!(
                formatter,
                "`{topic}` is no topic that can have a rate; write a topic such as \"sensor/line\""
            ),
            Self::Rate { topic, hz } => write!(
                formatter,
                "{hz} is no rate for {topic}; write how many samples a second are sent at most, above \
                 0, or take the topic from the list"
            ),
            Self::NotCarried(topic) => write!(
                formatter,
                "{topic} has a rate and is not among the topics that are carried; add it to the list \
                 of topics or remove its rate"
            ),
        }
    }
}

impl std::error::Error for AllowedError {}

impl Allowed {
    /// The topics that `topics` lists, each at most so many times a second as `rates` says.
    ///
    /// # Errors
    /// An entry is no topic or pattern, or a rate is none or of a topic that is not carried.
    pub fn new(topics: &[String], rates: &BTreeMap<String, f64>) -> Result<Self, AllowedError> {
        let topics = topics.iter().map(|entry| Pattern::of(entry));
        let allowed = Self {
            topics: topics.collect::<Result<_, _>>()?,
            rates: rates.clone(),
        };
        for (topic, hz) in rates {
            let topic = topic.clone();
            if !is_carried(&topic) {
                return Err(AllowedError::RateOf(topic));
            }
            if !(*hz > 0.0 && hz.is_finite()) {
                return Err(AllowedError::Rate { topic, hz: *hz });
            }
            if !allowed.has(&topic) {
                return Err(AllowedError::NotCarried(topic));
            }
        }
        Ok(allowed)
    }

    /// Whether a topic is carried.
    pub fn has(&self, topic: &str) -> bool {
        is_carried(topic) && self.topics.iter().any(|pattern| pattern.has(topic))
    }

    /// How many samples a second of a topic are sent at most; `None` if all are.
    pub fn rate(&self, topic: &str) -> Option<f64> {
        self.rates.get(topic).copied()
    }

    /// The limit of a topic.
    pub fn limit(&self, topic: &str, is_state: bool) -> Limit {
        Limit::new(self.rate(topic), is_state)
    }
}

impl Pattern {
    fn of(entry: &str) -> Result<Self, AllowedError> {
        if entry == "*" {
            return Ok(Self::All);
        }
        match entry.strip_suffix("/*") {
            Some(under) if is_carried(under) => Ok(Self::Under(format!("{under}/"))),
            None if is_carried(entry) => Ok(Self::One(entry.to_owned())),
            _ => Err(AllowedError::Topic(entry.to_owned())),
        }
    }

    fn has(&self, topic: &str) -> bool {
        match self {
            Self::All => true,
            Self::Under(under) => topic.starts_with(under),
            Self::One(one) => topic == one,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn allowed(topics: &[&str], rates: &[(&str, f64)]) -> Result<Allowed, AllowedError> {
        let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
        let rates = rates.iter().map(|(topic, hz)| ((*topic).to_owned(), *hz));
        Allowed::new(&topics, &rates.collect())
    }

    #[test]
    fn the_list_names_topics_all_below_a_name_or_all() {
        let some = allowed(&["sensor/*", "nav/status"], &[]).expect("a list");
        for (topic, is_in) in [
            ("sensor/line", true),
            ("sensor/a/b", true),
            ("sensors/line", false),
            ("sensor", false),
            ("nav/status", true),
            ("nav/status/more", false),
            ("nav/map", false),
        ] {
            assert_eq!(some.has(topic), is_in, "{topic}");
        }
        let all = allowed(&["*"], &[]).expect("a list");
        assert!(all.has("my/own") && !all.has("my own"));
        assert!(!allowed(&[], &[]).expect("a list").has("nav/map"));
    }

    #[test]
    fn only_topics_with_a_rate_have_a_limit() {
        let some = allowed(&["*"], &[("nav/status", 5.0)]).expect("a list");
        assert!(some.limit("nav/status", true).is_set());
        assert!(!some.limit("nav/map", true).is_set());
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_what_to_write() {
        for entry in ["", "/", "*/line", "sensor*", "a//b", "@layout", "a/**"] {
            let refused = allowed(&[entry], &[]).expect_err(entry).to_string();
            assert!(refused.contains("\"sensor/*\""), "{refused}");
        }
        for hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let refused = allowed(&["*"], &[("nav/map", hz)]).expect_err("no rate");
            assert!(refused.to_string().contains("above 0"), "{refused}");
        }
        let refused = allowed(&["*"], &[("a*", 1.0)]).expect_err("no topic");
        assert!(refused.to_string().contains("`a*`"), "{refused}");
        let refused = allowed(&["sensor/*"], &[("nav/map", 1.0)]).expect_err("not carried");
        assert!(
            refused.to_string().contains("add it to the list"),
            "{refused}"
        );
    }
}
