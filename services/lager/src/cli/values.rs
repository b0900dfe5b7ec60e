//! Reads arguments of the command line that clap does not know by itself. Each reader returns the
//! value, or a sentence that says why it refuses the text.
//!
//! A value that makes no sense is refused here, before a bus is opened. So clap names the argument
//! and ends with its exit code for wrong usage. Numbers may be negative, so that clap does not
//! refuse `-1` as an unknown flag.

use std::ffi::OsStr;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use anyhow::Context as _;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, Command};
use lager_home::UnitName;
use lager_lines::{Called, Name};
use lager_orders::{Mode, Pick};
use lager_topics::TOPICS;
use lager_wire::{OperatorCommand, Speed, parse_code};

pub use crate::address::{calls, listens};
use crate::config::{BAUD_RATES, SPEEDS};
use crate::meant::{meant, unknown_topic};

/// The longest that `lager drive --seconds` holds, in seconds: a day.
const LONGEST_DRIVE_S: f64 = 86_400.0;
/// The longest virtual time of `lager simulate`, in seconds: a year.
const LONGEST_RUN_S: u64 = 365 * 86_400;
/// The allowed rates of publishing, in samples a second.
const HZ: RangeInclusive<f64> = 0.001..=10_000.0;
/// The allowed speeds of a player.
const RATES: RangeInclusive<f64> = 0.01..=100.0;

/// Products for a robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fetch {
    /// Which robot.
    pub robot: Name,
    /// Which goods, in this order.
    pub products: Vec<Called>,
}

/// A robot and the goods that it has to fetch.
pub fn fetch(text: &str) -> Result<Fetch, String> {
    let usage = || format!("`{text}` is no order; write a robot and its goods, as in r1=3,1");
    let (robot, products) = text.split_once('=').ok_or_else(usage)?;
    let robot = Name::new(robot).map_err(|error| error.to_string())?;
    let products: Result<_, String> = products.split(',').map(product).collect();
    Ok(Fetch {
        robot,
        products: products?,
    })
}

/// A command for the wheels, by its name or its code.
pub fn wheel_command(text: &str) -> Result<OperatorCommand, String> {
    let command = command(text, OperatorCommand::wheel)?;
    if matches!(command, OperatorCommand::Arm(_)) {
        return Err(format!(
            "0x{:02X} moves the arm; use `lager arm`",
            command.code()
        ));
    }
    Ok(command)
}

/// A command for the arm, by its name or its code.
pub fn arm_command(text: &str) -> Result<OperatorCommand, String> {
    let command = command(text, OperatorCommand::arm)?;
    if !matches!(command, OperatorCommand::Arm(_)) {
        return Err(format!(
            "0x{:02X} drives the wheels; use `lager drive`",
            command.code()
        ));
    }
    Ok(command)
}

/// Who steers, by its word.
pub fn mode() -> impl TypedValueParser<Value = Mode> {
    PossibleValuesParser::new([
        PossibleValue::new("manual").help("The operator steers"),
        PossibleValue::new("autonomous").help("Logic steers"),
    ])
    .try_map(|word| Mode::from_word(&word).ok_or("no mode"))
}

/// How fast to drive, by its word.
pub fn driving_speed() -> impl TypedValueParser<Value = Speed> {
    PossibleValuesParser::new(["slow", "middle", "full"])
        .try_map(|word| Speed::from_word(&word).ok_or("no speed"))
}

/// A command at the speed that was asked for.
pub fn at_speed(command: OperatorCommand, speed: Option<Speed>) -> anyhow::Result<OperatorCommand> {
    let Some(speed) = speed else {
        return Ok(command);
    };
    command.at(speed).with_context(|| {
        let name = command.name();
        format!("`{name}` has no --speed; forward, backward, left and right have one")
    })
}

/// Who picks the goods up, by its word.
pub fn pick() -> impl TypedValueParser<Value = Pick> {
    PossibleValuesParser::new([
        PossibleValue::new("manual").help("A person moves the arm and says when it is done"),
        PossibleValue::new("auto").help("The robot, by itself"),
    ])
    .try_map(|word| Pick::from_word(&word).ok_or("nobody"))
}

/// A command by its name (`by_name` knows the names), or by its code in one of three forms.
fn command(
    text: &str,
    by_name: fn(&str) -> Option<OperatorCommand>,
) -> Result<OperatorCommand, String> {
    let coded = || OperatorCommand::from_code(parse_code(text).ok()?);
    by_name(text).or_else(coded).ok_or_else(|| {
        let names: Vec<_> = OperatorCommand::ALL
            .into_iter()
            .filter(|command| by_name(command.name()) == Some(*command))
            .map(OperatorCommand::name)
            .collect();
        format!(
            "`{text}` is no command{}; the names are {}, and the codes 1 to 9 for the wheels and 0xF1 to 0xFA for the arm",
            meant(text, names.iter().copied()),
            names.join(", ")
        )
    })
}

/// A rate of publishing, in samples a second.
pub fn hz(text: &str) -> Result<f64, String> {
    let (least, most) = (HZ.start(), HZ.end());
    let rule = format!("give {least} to {most} samples a second");
    number(text, |rate| HZ.contains(&rate), &rule)
}

/// A topic of the table, or a topic of another program: its first part is then not a first part in
/// the table.
fn topic(text: &str) -> Result<String, String> {
    let family = |name: &str| name.split_once('/').map(|(family, _)| family.to_owned());
    let asked = family(text);
    let is_foreign = asked.is_some() && TOPICS.iter().all(|entry| family(entry.name) != asked);
    if is_foreign || TOPICS.iter().any(|entry| entry.name == text) {
        Ok(text.to_owned())
    } else {
        Err(unknown_topic(text, []))
    }
}

/// The name of a topic. A shell completes the names of the table.
#[derive(Clone, Copy, Debug)]
pub struct TopicName;

impl TypedValueParser for TopicName {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        arg: Option<&Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        topic.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = TOPICS.iter().map(|entry| PossibleValue::new(entry.name));
        Some(Box::new(names))
    }
}

/// The name of a robot.
pub fn robot(text: &str) -> Result<String, String> {
    let name: UnitName = text.parse().map_err(said)?;
    Ok(name.as_str().to_owned())
}

/// `7`, or `1..20` with both ends.
pub fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let seed = |seed: &str| {
        seed.parse::<u64>().map_err(|_| {
            format!("`{seed}` is no seed; write --seeds 7 or --seeds 1..20 (both ends run)")
        })
    };
    let (first, last) = match text.split_once("..") {
        Some((first, last)) => (seed(first)?, seed(last.trim_start_matches('='))?),
        None => (seed(text)?, seed(text)?),
    };
    if last < first {
        return Err(format!(
            "{text} is empty; the first seed comes first, as in 1..3"
        ));
    }
    Ok(first..=last)
}

/// How many, at least one.
pub fn count(text: &str) -> Result<u64, String> {
    whole(text, 1..=u64::MAX, "one is the least")
}

/// A seed of the noise.
pub fn seed(text: &str) -> Result<u64, String> {
    whole(text, 0..=u64::MAX, "seeds start at 0")
}

/// A product by its number or its name.
pub fn product(text: &str) -> Result<Called, String> {
    text.parse().map_err(said)
}

/// How many things stand on the floor.
pub fn obstacles(text: &str) -> Result<u32, String> {
    whole(text, 0..=64, "there are 0 to 64 obstacles")
}

/// A gain of the line following.
pub fn gain(text: &str) -> Result<u8, String> {
    whole(text, 0..=u8::MAX, "a gain is from 0 to 255")
}

/// Virtual time in seconds.
pub fn limit(text: &str) -> Result<u64, String> {
    whole(
        text,
        1..=LONGEST_RUN_S,
        "the limit is from one second to a year, in seconds",
    )
}

/// A baud rate that the boards can have.
pub fn baud(text: &str) -> Result<u32, String> {
    let [usual, slow] = BAUD_RATES;
    let known = || format!("`{text}` is no rate of the boards; those are {usual} and {slow}");
    let baud = text.parse().map_err(|_| known())?;
    if BAUD_RATES.contains(&baud) {
        Ok(baud)
    } else {
        Err(known())
    }
}

/// The speed of the robot's clock; 1 is real time.
pub fn speed(text: &str) -> Result<f64, String> {
    let rule = format!(
        "the clock runs from {} to {} times as fast as real time (`lager simulate` runs faster)",
        SPEEDS.start(),
        SPEEDS.end()
    );
    number(text, |speed| SPEEDS.contains(&speed), &rule)
}

/// How long to drive, in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    let rule = format!("give a time of more than 0 and at most {LONGEST_DRIVE_S} seconds");
    let fits = |seconds| seconds > 0.0 && seconds <= LONGEST_DRIVE_S;
    number(text, fits, &rule)
}

/// How large a file may become, in MiB.
pub fn split_size(text: &str) -> Result<u64, String> {
    whole(text, 1..=1 << 20, "a file has from 1 MiB to 1048576 MiB")
}

/// How long a bit takes on a programmer's wires, in microseconds.
pub fn bit_clock(text: &str) -> Result<f64, String> {
    let rule = "a bit takes from 0.1 to 1000 microseconds";
    number(text, |us| (0.1..=1000.0).contains(&us), rule)
}

/// How many samples may wait.
pub fn queue(text: &str) -> Result<usize, String> {
    whole(
        text,
        1..=10_000_000,
        "a queue has from 1 to 10000000 samples",
    )
}

/// The speed of a player; 1 is that of the recording.
pub fn rate(text: &str) -> Result<f64, String> {
    let rule = format!(
        "a recording is played from {} to {} times as fast as it was recorded",
        RATES.start(),
        RATES.end()
    );
    number(text, |rate| RATES.contains(&rate), &rule)
}

/// A moment of a recording, in seconds from its beginning.
pub fn moment(text: &str) -> Result<f64, String> {
    let rule = "give the seconds from the recording's beginning, 0 or more";
    let fits = |seconds| (0.0..=LONGEST_RUN_S as f64).contains(&seconds);
    number(text, fits, rule)
}

/// A constant of the navigator, and its value.
pub fn constant(text: &str) -> Result<(String, String), String> {
    let (name, value) = text
        .split_once('=')
        .ok_or("give the constant's name and value, as in tolerance=0.3")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// A whole number within `range`; else an error with `rule`.
fn whole<T: FromStr + PartialOrd>(
    text: &str,
    range: RangeInclusive<T>,
    rule: &str,
) -> Result<T, String> {
    if let Ok(number) = text.parse()
        && range.contains(&number)
    {
        return Ok(number);
    }
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    let is_whole = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    Err(match is_whole {
        true => format!("{text} does not fit: {rule}"),
        false => format!("`{text}` is not a whole number: {rule}"),
    })
}

/// A number that `fits`; else an error with `rule`.
fn number(text: &str, fits: impl Fn(f64) -> bool, rule: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if fits(number) => Ok(number),
        Ok(_) => Err(format!("{text} does not fit: {rule}")),
        Err(_) => Err(format!("`{text}` is not a number: {rule}")),
    }
}

/// A share of a whole, in percent.
pub fn percent(text: &str) -> Result<u8, String> {
    whole(text, 0..=100, "give 0 to 100 percent")
}

/// The number of an order, as `lager queue` shows it.
pub fn order(text: &str) -> Result<u32, String> {
    whole(
        text,
        0..=u32::MAX,
        "`lager queue` shows the orders' numbers",
    )
}

fn said(error: impl Display) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::seeds;
    use crate::cli::{Cli, Command};

    /// What `lager` says to `words`, which it refuses as wrong usage.
    fn refusal(words: &[&str]) -> String {
        let error = Cli::try_parse_from(["lager"].iter().chain(words)).expect_err("wrong usage");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    #[test]
    fn seeds_are_one_number_or_a_range_with_both_ends() {
        assert_eq!(seeds("7"), Ok(7..=7));
        assert_eq!(seeds("1..20"), Ok(1..=20));
        assert_eq!(seeds("1..=20"), Ok(1..=20));
        for wrong in ["", "x", "1..", "5..4", "-1"] {
            assert!(seeds(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_a_sentence_before_anything_is_opened() {
        for (words, said) in [
            (&["drive", "bogus"][..], "names are stop, forward"),
            (&["drive", "0x0F"], "names are stop, forward"),
            (&["drive", "-1"], "names are stop, forward"),
            (&["drive", "0xF1"], "use `lager arm`"),
            (&["arm", "forward"], "names are clockwise"),
            (&["arm", "2"], "use `lager drive`"),
            (&["topic", "echo", "sensor/lime"], "sensor/line"),
            (&["topic", "echo", "line"], "sensor/line"),
            (&["topic", "hz", "sensor/line", "--count", "-1"], "least"),
            (&["topic", "echo", "sensor/line", "--count", "0"], "least"),
            (&["simulate", "--seeds", "3..1"], "first seed comes first"),
            (&["simulate", "--seeds", "x"], "--seeds 1..20"),
            (&["simulate", "--limit", "-5"], "one second"),
            (&["fetch", "-1"], "numbered from 0"),
            (&["fetch", "99999999999"], "to 2147483647"),
            (&["fetch", "a;b"], "semicolon"),
            (&["up", "--mission", "-1"], "numbered from 0"),
            (&["up", "--mission", "1,,2"], "cannot stand for"),
            (&["station", "--fetch", "r1=1,-2"], "numbered from 0"),
            (&["station", "--fetch", "r1"], "as in r1=3,1"),
            (&["up", "--speed", "-1"], "0.01 to 20"),
            (&["up", "--speed", "nan"], "0.01 to 20"),
            (&["up", "--baud", "115200"], "500000 and 9600"),
            (&["up", "--seed", "-1"], "seeds start at 0"),
            (&["drive", "forward", "--seconds", "-1"], "more than 0"),
            (&["drive", "forward", "--seconds", "nan"], "more than 0"),
            (
                &["drive", "forward", "--seconds", "abc"],
                "`abc` is not a number: give a time",
            ),
            (&["drive", "forwrad"], "did you mean `forward`?"),
            (
                &["drive", "forward", "--speed", "0.5"],
                "slow, middle, full",
            ),
            (&["arm", "sqeeze"], "did you mean `squeeze`?"),
            (
                &["gains", "-1", "2"],
                "-1 does not fit: a gain is from 0 to 255",
            ),
            (
                &["gains", "300", "2"],
                "300 does not fit: a gain is from 0 to 255",
            ),
            (&["gains", "two", "2"], "`two` is not a whole number"),
            (&["gains", "1", "2.5"], "`2.5` is not a whole number"),
            (&["cancel", "last"], "`lager queue` shows"),
            (&["queue", "up", "-1"], "`lager queue` shows"),
            (&["simulate", "--battery", "101"], "0 to 100 percent"),
            (&["up", "--panel", "wherever"], "as in 7410"),
            (&["up", "--listen", "localhost"], "as in 7410"),
            (&["up", "--metrics", "70000"], "as in 7410"),
            (&["station", "--panel", ":7410"], "as in 7410"),
            (&["gateway", "--foxglove", "x:y"], "as in 7410"),
            (&["gateway", "--zenoh", "7447"], "tcp/127.0.0.1:7447"),
            (&["up", "--zenoh", "udp/[::]:7447"], "tcp/127.0.0.1:7447"),
            (&["up", "--station", "somewhere"], "as in 7420"),
            (&["comm", "--station", "192.168.1.5:0"], "as in 7420"),
            (&["topic", "hz", "nav/statsu"], "did you mean `nav/status`?"),
            (
                &["topic", "pub", "weather/now", "--rate", "fast"],
                "`fast` is not a number",
            ),
            (
                &["up", "--speed", "fast"],
                "`fast` is not a number: the clock runs",
            ),
            (
                &["bag", "play", "x.mcap", "--rate", "fast"],
                "`fast` is not a number",
            ),
            (
                &["bag", "play", "x.mcap", "--from", "begin"],
                "`begin` is not a number",
            ),
            (&["--name", "R 1", "stop"], "only a-z"),
            (&["bag", "record", "--topic", "sensor/lime"], "sensor/line"),
            (&["bag", "record", "--split-size", "0"], "from 1 MiB"),
            (&["bag", "record", "--split-time", "-1"], "more than 0"),
            (&["bag", "record", "--queue", "0"], "from 1 to"),
            (&["bag", "play", "x.mcap", "--rate", "0"], "0.01 to 100"),
            (&["bag", "play", "x.mcap", "--from", "-1"], "0 or more"),
            (&["bag", "play", "x.mcap", "--to", "nan"], "0 or more"),
        ] {
            let told = refusal(words);
            assert!(told.contains(said), "{words:?}: {told}");
        }
    }

    #[test]
    fn a_port_alone_is_one_of_this_machine() {
        let words = [
            "lager",
            "up",
            "--panel",
            "7411",
            "--listen",
            "localhost:7421",
        ];
        let more = ["--metrics", "7431", "--foxglove", "[::1]:8766"];
        let cli = Cli::try_parse_from(words.iter().chain(&more)).expect("right usage");
        let Command::Up(args) = cli.command else {
            panic!("another command");
        };
        let at = |text: &str| Some(text.parse().expect("an address"));
        assert_eq!(args.panel, at("127.0.0.1:7411"));
        assert_eq!(args.listen, at("127.0.0.1:7421"));
        assert_eq!(args.metrics, at("127.0.0.1:7431"));
        assert_eq!(args.foxglove, at("[::1]:8766"));
    }
}
