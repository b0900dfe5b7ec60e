//! A payload and a topic of a user's own; what a crate of his would define.

use lager_topics::{Qos, Role, Topic, payload};

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

/// `weather/now`, which wakes the processes that act on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WeatherNow;

impl Topic for WeatherNow {
    const NAME: &'static str = "weather/now";
    type Payload = Weather;
    const QOS: Qos = Qos::stream(16).waking(&[Role::Guest]);
    const SUMMARY: &'static str = "The weather, ten times a second.";
}
