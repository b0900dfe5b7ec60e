//! Goods as people call them: which number the robot is told for a name.
//!
//! ```text
//!   who describes the warehouse     where its names are found
//!   the robot's own station         in the file that it keeps, with what a panel has changed since
//!   nobody, it has no station       in the warehouse's file
//!   somebody else's station         nowhere here, since its numbers may mean other goods
//! ```

use anyhow::{Result, bail};
use lager_lines::Called;
use lager_station::{Warehouse, load};

use crate::config::Config;

/// The number of what a person calls so, for the robot that runs with `config`.
///
/// # Errors
/// Nothing there has that name, or names are not known here.
pub fn number(config: &Config, called: &Called) -> Result<i32> {
    match called {
        Called::Number(number) => Ok(number.get()),
        Called::Name(_) => Ok(described(config)?.find(called)?.get()),
    }
}

/// The warehouse with the names of its goods, as the robot that runs with `config` is told it.
///
/// # Errors
/// It is not known here.
pub fn described(config: &Config) -> Result<Warehouse> {
    let kept = &config.station.warehouse;
    if let Some(kept) = kept.as_ref().filter(|kept| kept.is_file()) {
        return Ok(load(kept)?);
    }
    if config.station.wanted && kept.is_none() {
        bail!(
            "the names of goods are known to the external computer alone, which is not the robot's own; give the number, which `lager map` shows"
        );
    }
    configured(config)
}

/// The configured warehouse as a station describes it.
///
/// # Errors
/// No station can describe it.
pub fn configured(config: &Config) -> Result<Warehouse> {
    described_by(&config.warehouse()?)
}

/// A simulated world's warehouse as a station describes it: both read the same file.
///
/// # Errors
/// No station can describe it.
pub fn described_by(warehouse: &lager_plant::Warehouse) -> Result<Warehouse> {
    let described: Warehouse = toml::from_str(&toml::to_string(warehouse)?)?;
    described.check()?;
    Ok(described)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_warehouse_file_of_the_readme_is_one_for_station_and_simulated_world() {
        let readme = include_str!("../../../README.md");
        let (_, rest) = readme
            .split_once("```toml\n# hall.toml")
            .expect("the example");
        let (example, _) = rest.split_once("```").expect("its end");
        let text = format!("# hall.toml{example}");
        let world: lager_plant::Warehouse = toml::from_str(&text).expect("a warehouse");
        world.validate().expect("it can be built");
        let told: Warehouse = toml::from_str(&text).expect("the same");
        told.check().expect("it can be told");
        assert_eq!(
            described_by(&world).expect("the same").products,
            told.products
        );
    }
}
