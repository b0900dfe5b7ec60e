//! Publishes the weather ten times a second: `cargo run -p lager-ports --example publish`.

mod weather;

use std::{error::Error, thread::sleep, time::Duration};

use lager_ports::{Bus, BusConfig};
use lager_sample::Part;
use weather::{WEATHER, WeatherNow};

/// The part of the process that measures the weather.
const STATION: Part = Part::new(12, "station");

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(Into::into);
    let bus = Bus::open(
        &BusConfig {
            folder,
            ..BusConfig::of(&WEATHER)
        },
        STATION,
    )?;
    let weather = bus.publisher::<WeatherNow>()?;
    for wind in 0.. {
        let mut sample = weather.loan()?;
        sample.wind = wind;
        sample.send()?;
        sleep(Duration::from_millis(100));
    }
    Ok(())
}
