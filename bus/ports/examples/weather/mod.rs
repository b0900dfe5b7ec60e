//! The examples' own application: a payload, a topic, and the part that the topic wakes.

use lager_sample::{Application, Part, Qos, Topic, payload};

payload! {
    /// What a weather station sees.
    pub struct Weather: 8 bytes {
        /// Wind in mm/s.
        pub wind: u32,
        /// From where it blows, in degrees; 65535 = not known.
        pub from: u16 = u16::MAX,
        /// Fills the gap.
        pub reserved: [u8; 2],
    }
}

/// The part of a process that acts on the weather.
pub(crate) const SAILOR: Part = Part::new(13, "sailor");

/// The topic `weather/now`, which wakes the sailors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WeatherNow;

impl Topic for WeatherNow {
    const NAME: &'static str = "weather/now";
    type Payload = Weather;
    const QOS: Qos = Qos::stream(16).waking(&[SAILOR]);
    const SUMMARY: &'static str = "The weather, ten times a second.";
}

/// Its names begin with `lager`, like a robot's, so that `lager topic` shows them. The robot uses
/// the parts 0 to 11. An application without a robot chooses its own names and numbers.
pub(crate) static WEATHER: Application = Application::new("lager");
