//! Publishes the weather ten times a second: `cargo run -p lager-ports --example publish`.

mod weather;

use std::{error::Error, thread::sleep, time::Duration};

use lager_ports::{Bus, BusConfig};
use lager_topics::Role;
use weather::WeatherNow;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(Into::into);
    let bus = Bus::open(
        &BusConfig {
            folder,
            ..BusConfig::default()
        },
        Role::Guest,
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
