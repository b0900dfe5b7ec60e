//! Reads every topic as a tool sees it that was not built with the topic.

use lager_sample::{Coded, Description, Field, Tag, Topic, bytes_of, coded, describe, payload};
use lager_topics::{Role, TOPICS, TopicVisitor, visit};
use proptest::prelude::*;
use serde_json::{Value, json};

coded! {
    /// The clouds in the sky.
    pub enum Sky {
        /// Nothing.
        Clear = 0,
        /// Many.
        Fog = 7,
        /// As many as possible.
        Storm = 8,
    }
}

payload! {
    /// A part of a payload.
    pub struct Gust: 4 bytes {
        /// In mm/s.
        pub mm_s: i16,
        /// The clouds at that time.
        pub sky: Tag<Sky>,
        /// Fills the gap.
        pub reserved: u8,
    }
}

payload! {
    /// A payload that is in no table.
    pub struct Weather: 24 bytes {
        /// In m/s.
        pub wind: f64,
        /// Three gusts.
        pub gusts: [Gust; 3],
        /// The clouds now.
        pub sky: Tag<Sky>,
        /// Fills the gap.
        pub reserved: [u8; 3],
    }
}

#[test]
fn a_type_is_named_in_full_once() {
    assert_eq!(
        describe(&Weather::MAKE),
        "Weather{wind:f64,\
         gusts:[Gust{mm_s:i16,sky:Sky<Clear,7=Fog,Storm>,reserved:u8};3],\
         sky:Sky,reserved:[u8;3]}"
    );
}

#[test]
fn a_sample_reads_as_its_type_would_write_it() {
    let description = Description::parse(&describe(&Weather::MAKE)).unwrap();
    let mut weather = Weather {
        wind: -2.5,
        ..Weather::default()
    };
    weather.gusts[1] = Gust {
        mm_s: -300,
        sky: Sky::Storm.into(),
        reserved: 9,
    };
    weather.sky = Tag::from_raw(99);
    let seen = serde_json::to_value(description.read(bytes_of(&weather)).unwrap()).unwrap();
    assert_eq!(
        seen,
        json!({
            "wind": -2.5,
            "gusts": [
                {"mm_s": 0, "sky": "Clear"},
                {"mm_s": -300, "sky": "Storm"},
                {"mm_s": 0, "sky": "Clear"},
            ],
            "sky": 99,
        })
    );
    assert_eq!(description.size(), 24);
    assert!(description.read(&bytes_of(&weather)[1..]).is_none());
}

/// A blank sample as the topic's own type shows it, and as the topic's description shows it.
struct Both;

impl TopicVisitor for Both {
    type Output = (Value, Value);

    fn visit<T: Topic>(self) -> (Value, Value) {
        let blank = T::Payload::default();
        let description = Description::parse(&describe(&T::Payload::MAKE)).unwrap();
        assert_eq!(description.size(), size_of::<T::Payload>(), "{}", T::NAME);
        let described = description.read(bytes_of(&blank)).unwrap();
        (
            serde_json::to_value(blank).unwrap(),
            serde_json::to_value(described).unwrap(),
        )
    }
}

/// Whether `full` contains everything in `short`; lists may be longer.
fn says(full: &Value, short: &Value) -> bool {
    match (full, short) {
        (Value::Object(full), Value::Object(short)) => {
            full.len() == short.len()
                && short
                    .iter()
                    .all(|(name, value)| full.get(name).is_some_and(|seen| says(seen, value)))
        }
        (Value::Array(full), Value::Array(short)) => {
            full.len() >= short.len() && full.iter().zip(short).all(|(a, b)| says(a, b))
        }
        (a, b) => a == b,
    }
}

#[test]
fn every_topic_of_the_table_is_described_as_it_is() {
    for entry in TOPICS {
        let (own, described) = visit(entry.name, Both).unwrap();
        assert!(says(&described, &own), "{}: {described} {own}", entry.name);
    }
}

/// The part of `value` that does not fit `schema`, for the schemas that this crate writes.
fn misfit(schema: &Value, value: &Value) -> Option<String> {
    let is_of_type = match schema["type"].as_str().expect("a type") {
        "object" => {
            let Some(fields) = value.as_object() else {
                return Some(format!("{value} is no object"));
            };
            let required = schema["required"].as_array().expect("names");
            let is_there = |name: &&Value| fields.contains_key(name.as_str().expect("a name"));
            if let Some(name) = required.iter().find(|name| !is_there(name)) {
                return Some(format!("{name} is missing"));
            }
            return fields.iter().find_map(|(name, value)| {
                let Some(schema) = schema["properties"].get(name) else {
                    return Some(format!("{name} is in no schema"));
                };
                misfit(schema, value)
            });
        }
        "array" => {
            let items = value.as_array().expect("a list");
            let most = schema["maxItems"].as_u64().expect("a length");
            items.len() as u64 <= most
                && items
                    .iter()
                    .all(|item| misfit(&schema["items"], item).is_none())
        }
        "integer" => {
            let number = value.as_i64().map(i128::from);
            let number = number.or(value.as_u64().map(i128::from));
            let limit = |name: &str| {
                let limit = &schema[name];
                let number = limit.as_i64().map(i128::from);
                number.or(limit.as_u64().map(i128::from)).expect("a limit")
            };
            number.is_some_and(|number| (limit("minimum")..=limit("maximum")).contains(&number))
        }
        "number" => value.is_number(),
        "string" => schema["enum"].as_array().expect("names").contains(value),
        other => panic!("no schema of ours says {other}"),
    };
    (!is_of_type).then(|| format!("{value} does not fit {schema}"))
}

#[test]
fn every_topic_of_the_table_fits_its_schema() {
    struct SchemaOf;
    impl TopicVisitor for SchemaOf {
        type Output = Value;

        fn visit<T: Topic>(self) -> Value {
            let description = Description::parse(&describe(&T::Payload::MAKE)).unwrap();
            serde_json::to_value(description.json_schema()).unwrap()
        }
    }
    for entry in TOPICS {
        let schema = visit(entry.name, SchemaOf).unwrap();
        let (own, described) = visit(entry.name, Both).unwrap();
        assert_eq!(misfit(&schema, &own), None, "{}", entry.name);
        assert_eq!(misfit(&schema, &described), None, "{}", entry.name);
    }
}

#[test]
fn a_schema_says_what_may_stand_where() {
    let description = Description::parse(&describe(&Weather::MAKE)).unwrap();
    let schema = serde_json::to_value(description.json_schema()).unwrap();
    let fits = |text: &str| misfit(&schema, &serde_json::from_str(text).unwrap()).is_none();
    assert!(fits(
        r#"{"wind":1.5,"gusts":[{"mm_s":-32768,"sky":"Fog"}],"sky":"Clear"}"#
    ));
    for wrong in [
        r#"{"wind":1.5,"gusts":[]}"#,
        r#"{"wind":1.5,"gusts":[],"sky":"Rain"}"#,
        r#"{"wind":"x","gusts":[],"sky":"Fog"}"#,
        r#"{"wind":1,"gusts":[{"mm_s":32768,"sky":"Fog"}],"sky":"Fog"}"#,
        r#"{"wind":1,"gusts":[{},{},{},{}],"sky":"Fog"}"#,
    ] {
        assert!(!fits(wrong), "{wrong}");
    }
}

/// The bytes of a description that fit into one service: seven of its eight attributes.
const ROOM: usize = 7 * 256;

#[test]
fn every_topic_of_the_table_can_carry_its_description() {
    struct Length;
    impl TopicVisitor for Length {
        type Output = usize;

        fn visit<T: Topic>(self) -> usize {
            describe(&T::Payload::MAKE).len()
        }
    }
    for entry in TOPICS {
        let length = visit(entry.name, Length).unwrap();
        assert!(length <= ROOM, "{}: {length} bytes", entry.name);
    }
}

#[test]
fn what_describes_nothing_is_refused() {
    let deep = format!("A{{x:{}u8{}}}", "[".repeat(40), ";1]".repeat(40));
    for text in [
        "",
        "u8",
        "A",
        "A{}",
        "A{x}",
        "A{x:u8",
        "A{x:u8}}",
        "A{x:B}",
        "A{x:A}",
        "A{x:[u8;0]}",
        "A{x:[u64;9999999999999999999]}",
        "A{x:[[u64;99999999999];99999999999]}",
        "A{x:E<300=Far>}",
        "A{x:E<255=Last,After>}",
        deep.as_str(),
    ] {
        assert!(Description::parse(text).is_err(), "{text}");
    }
}

#[test]
fn the_codes_of_an_enum_are_its_variants_codes() {
    for (variant, (code, name)) in Role::VARIANTS.iter().zip(Role::CODES) {
        assert_eq!((variant.0.to_code(), variant.1), (*code, *name));
    }
}

proptest! {
    #[test]
    fn no_text_is_too_strange_to_be_read(text in r"[A-C]\{[a-c:,;\[\]{}<>=0-9u8]{0,60}\}?") {
        if let Ok(description) = Description::parse(&text) {
            prop_assume!(description.size() < 1 << 16);
            let bytes = vec![1; description.size()];
            let seen = serde_json::to_value(description.read(&bytes).unwrap());
            prop_assert!(seen.is_ok());
        }
    }
}

/// A blank `Weather`, filled from `text`.
fn filled(text: &str) -> Result<Vec<u8>, String> {
    let mut filled = bytes_of(&Weather::default()).to_vec();
    let mut json = serde_json::Deserializer::from_str(text);
    let made = Description::of::<Weather>().fill(&mut json, &mut filled);
    made.map(|()| filled).map_err(|error| error.to_string())
}

#[test]
fn a_payload_is_made_of_what_a_person_writes() {
    let text = r#"{"gusts": [{}, {"mm_s": -300, "sky": "storm"}], "wind": 3, "sky": 7}"#;
    let mut weather = Weather {
        wind: 3.0,
        sky: Sky::Fog.into(),
        ..Weather::default()
    };
    weather.gusts[1].mm_s = -300;
    weather.gusts[1].sky = Sky::Storm.into();
    assert_eq!(filled(text).unwrap(), bytes_of(&weather));
    assert_eq!(filled("{}").unwrap(), bytes_of(&Weather::default()));
}

#[test]
fn what_is_refused_names_the_field_and_what_it_may_be() {
    for (text, said) in [
        (
            r#"{"wnd": 1}"#,
            "`Weather` has no field `wnd`; its fields are wind, gusts, sky",
        ),
        (r#"{"reserved": [1]}"#, "no field `reserved`"),
        (
            r#"{"gusts": [{"mms": 1}]}"#,
            "`gusts.0` has no field `mms`; its fields are mm_s, sky",
        ),
        (
            r#"{"gusts": [{}, {"mm_s": 40000}]}"#,
            "integer `40000`, expected a whole number from -32768 to 32767 in `gusts.1.mm_s`",
        ),
        (
            r#"{"gusts": [{"mm_s": 1.5}]}"#,
            "a whole number from -32768 to 32767 in `gusts.0.mm_s`",
        ),
        (
            r#"{"sky": "blue"}"#,
            "one of Clear, Fog, Storm, or a code from 0 to 255, in `sky`",
        ),
        (r#"{"sky": 256}"#, "or a code from 0 to 255, in `sky`"),
        (r#"{"wind": "strong"}"#, "expected a number in `wind`"),
        (r#"{"wind": 1, "wind": 2}"#, "`wind` stands twice"),
        (
            r#"{"gusts": [{}, {}, {}, {}]}"#,
            "a list of at most 3 in `gusts`",
        ),
        (r#"{"gusts": {}}"#, "a list of at most 3 in `gusts`"),
        ("[1]", "an object with wind, gusts, sky for `Weather`"),
    ] {
        let error = filled(text).expect_err(text);
        assert!(error.contains(said), "{text}: {error}");
    }
    let mut short = vec![0; 3];
    let text = &mut serde_json::Deserializer::from_str("{}");
    assert!(Description::of::<Weather>().fill(text, &mut short).is_err());
}

#[test]
fn a_path_leads_to_a_field_or_says_what_there_is() {
    let weather = Description::of::<Weather>();
    for path in ["wind", "gusts", "gusts.2", "gusts.2.sky"] {
        assert_eq!(weather.must_have(path), Ok(()), "{path}");
    }
    for (path, said) in [
        (
            "wnd",
            "there is no field `wnd`; the payload has wind, gusts, sky",
        ),
        ("gusts.3", "`gusts` has the places 0 to 2"),
        ("gusts.0.mms", "`gusts.0` has mm_s, sky"),
        ("wind.x", "`wind` has no parts"),
        ("reserved", "the payload has wind"),
        ("", "the payload has wind"),
    ] {
        let error = weather.must_have(path).unwrap_err().to_string();
        assert!(error.contains(said), "{path}: {error}");
    }
}

/// Shows random bytes of a topic's payload and makes them again.
struct ThereAndBack(u64);

impl TopicVisitor for ThereAndBack {
    type Output = ();

    fn visit<T: Topic>(self) {
        let description = Description::of::<T::Payload>();
        let mut dice = self.0 | 1;
        let any: Vec<u8> = (0..description.size())
            .map(|_| {
                dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (dice >> 56) as u8
            })
            .collect();
        let shown = serde_json::to_string(&description.read(&any).unwrap()).unwrap();
        let mut made = vec![0; any.len()];
        let json = &mut serde_json::Deserializer::from_str(&shown);
        description.fill(json, &mut made).unwrap();
        let again = serde_json::to_string(&description.read(&made).unwrap()).unwrap();
        assert_eq!(shown, again, "{}", T::NAME);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn whatever_a_sample_shows_makes_the_same_sample(dice: u64) {
        for entry in TOPICS {
            visit(entry.name, ThereAndBack(dice)).unwrap();
        }
    }
}
