//! Example: is woken by each sample as an observer, after everybody who acts.

mod weather;

use std::{error::Error, time::Duration};

use lager_ports::{Bus, BusConfig};
use lager_sample::Part;
use weather::{WEATHER, WeatherNow};

/// The part of a process that only looks.
const ONLOOKER: Part = Part::new(14, "onlooker").observing();

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map(Into::into);
    let bus = Bus::open(
        &BusConfig {
            folder,
            ..BusConfig::of(&WEATHER)
        },
        ONLOOKER,
    )?;
    let mut weather = bus.subscriber::<WeatherNow>()?;
    let mut watcher = bus.watcher()?;
    weather.wakes(&mut watcher);
    loop {
        // Until there is a sample, or a second has passed.
        watcher.wait(Duration::from_secs(1));
        while let Some(sample) = weather.receive()? {
            println!("number {}: {:?}", sample.stamp().sequence, *sample);
        }
    }
}
