//! The configuration of a robot behind two ports, as that of real boards, which somebody has
//! described: it is built as the simulated one.

use std::fs;
use std::io;
use std::path::Path;

/// The text of that configuration; its last section is `[serial]`. The description is a file beside
/// the sensor board's port.
///
/// # Errors
/// That file cannot be written.
pub fn behind_ports(sensor: &Path, steering: &Path) -> io::Result<String> {
    let robot = sensor.with_file_name("described.toml");
    fs::write(&robot, "")?;
    Ok(format!(
        "body = \"serial\"\nrobot = {robot:?}\n[serial]\nsensor = {sensor:?}\nsteering = {steering:?}\n"
    ))
}
