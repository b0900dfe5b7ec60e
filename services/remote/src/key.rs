//! [`Keys`]: the names under which a robot's topics are found in Zenoh.
//!
//! ```text
//! lager/r1/sensor/line              a topic: its samples as they come; a state answers queries
//! lager/r1/@layout/sensor/line      how its payload is laid out; answers queries
//! lager/r1/@counts                  once a second what each topic has carried, and a sign of life
//! lager/r1/@alive                   a liveliness token, which is there while the gateway is
//! lager/r1/@time                    the robot's clocks at this moment; answers queries
//! ```
//!
//! A part of a key that begins with `@` is met only by a key that names it, so whoever subscribes
//! to `lager/r1/**` gets samples of topics and nothing else.

use lager_home::UnitName;

/// The part under which layouts stand.
const LAYOUT: &str = "@layout";
/// The longest name of a topic that is carried, in bytes.
const LONGEST: usize = 200;

/// The liveliness tokens of all robots.
#[cfg(feature = "zenoh")]
pub(crate) const EVERY_ALIVE: &str = "lager/*/@alive";

/// The robot whose liveliness token this is; `None` for any other key.
#[cfg(feature = "zenoh")]
pub(crate) fn alive_of(key: &str) -> Option<UnitName> {
    let name = key.strip_prefix("lager/")?.strip_suffix("/@alive")?;
    name.parse().ok()
}

/// The keys of one robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Keys {
    /// `lager/<robot>`.
    robot: String,
}

impl Keys {
    /// The keys of `robot`.
    pub fn of(robot: &UnitName) -> Self {
        let robot = format!("lager/{robot}");
        Self { robot }
    }

    /// The key of a topic; `None` if a topic of this name cannot be carried ([`is_carried`]).
    pub fn topic(&self, name: &str) -> Option<String> {
        is_carried(name).then(|| format!("{}/{name}", self.robot))
    }

    /// The key of a topic's layout; `None` as for [`Keys::topic`].
    pub fn layout(&self, name: &str) -> Option<String> {
        is_carried(name).then(|| format!("{}/{LAYOUT}/{name}", self.robot))
    }

    /// Every topic.
    pub fn topics(&self) -> String {
        format!("{}/**", self.robot)
    }

    /// Every layout.
    pub fn layouts(&self) -> String {
        format!("{}/{LAYOUT}/**", self.robot)
    }

    /// What each topic has carried.
    pub fn counts(&self) -> String {
        format!("{}/@counts", self.robot)
    }

    /// The liveliness token.
    pub fn alive(&self) -> String {
        format!("{}/@alive", self.robot)
    }

    /// The robot's clocks.
    pub fn time(&self) -> String {
        format!("{}/@time", self.robot)
    }

    /// All of these, for rules of access.
    #[cfg(feature = "zenoh")]
    pub(crate) fn all(&self) -> [String; 5] {
        [
            self.topics(),
            self.layouts(),
            self.counts(),
            self.alive(),
            self.time(),
        ]
    }

    /// The topic of a key that [`Keys::topic`] has made; `None` for other keys.
    pub fn topic_of<'key>(&self, key: &'key str) -> Option<&'key str> {
        let name = key.strip_prefix(&self.robot)?.strip_prefix('/')?;
        is_carried(name).then_some(name)
    }

    /// The topic of a key that [`Keys::layout`] has made; `None` for other keys.
    pub fn layout_of<'key>(&self, key: &'key str) -> Option<&'key str> {
        let name = key.strip_prefix(&self.robot)?.strip_prefix('/')?;
        let name = name.strip_prefix(LAYOUT)?.strip_prefix('/')?;
        is_carried(name).then_some(name)
    }
}

/// Whether a topic of this name can be carried: parts of letters, digits, `-`, `_` and `.`,
/// with `/` between them. Every topic of the robot's table is.
pub fn is_carried(name: &str) -> bool {
    let is_free = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let mut parts = name.split('/');
    name.len() <= LONGEST && parts.all(|part| !part.is_empty() && part.chars().all(is_free))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn keys() -> Keys {
        Keys::of(&UnitName::default())
    }

    #[test]
    fn keys_are_golden() {
        let keys = keys();
        assert_eq!(
            keys.topic("sensor/line").as_deref(),
            Some("lager/r1/sensor/line")
        );
        assert_eq!(
            keys.layout("sensor/line").as_deref(),
            Some("lager/r1/@layout/sensor/line")
        );
        assert_eq!(keys.counts(), "lager/r1/@counts");
        assert_eq!(keys.alive(), "lager/r1/@alive");
        assert_eq!(keys.time(), "lager/r1/@time");
        assert_eq!(keys.topics(), "lager/r1/**");
        assert_eq!(alive_of(&keys.alive()), Some(UnitName::default()));
        assert_eq!(alive_of("lager/r1/@alive/more"), None);
        assert_eq!(alive_of("lager/R 1/@alive"), None);
        assert_eq!(keys.layouts(), "lager/r1/@layout/**");
    }

    #[test]
    fn a_name_that_would_mean_something_else_in_a_key_is_not_carried() {
        for name in [
            "",
            "/",
            "a/",
            "/a",
            "a//b",
            "a/*",
            "**",
            "@layout/a",
            "a$*",
            "a?b",
            "a#b",
            "å",
        ] {
            assert_eq!(keys().topic(name), None, "{name}");
            assert_eq!(keys().layout(name), None, "{name}");
        }
        assert_eq!(keys().topic(&"a".repeat(LONGEST + 1)), None);
    }

    #[test]
    fn another_robots_key_is_no_topic_of_this_one() {
        for key in [
            "lager/r2/sensor/line",
            "lager/r11/a",
            "lager/r1",
            "lager/r1/",
            "r1/a",
        ] {
            assert_eq!(keys().topic_of(key), None, "{key}");
            assert_eq!(keys().layout_of(key), None, "{key}");
        }
        assert_eq!(keys().topic_of("lager/r1/@layout/a"), None);
        assert_eq!(keys().layout_of("lager/r1/a"), None);
    }

    proptest! {
        #[test]
        fn any_text_is_a_key_or_none_and_a_key_leads_back_to_its_topic(text in ".{0,40}") {
            let keys = keys();
            keys.topic_of(&text);
            keys.layout_of(&text);
            if let Some(key) = keys.topic(&text) {
                prop_assert_eq!(keys.topic_of(&key), Some(text.as_str()));
                let layout = keys.layout(&text).expect("as for the topic");
                prop_assert_eq!(keys.layout_of(&layout), Some(text.as_str()));
                prop_assert_eq!(keys.topic_of(&layout), None);
            }
        }
    }
}
