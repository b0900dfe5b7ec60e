//! The tables of the page, each between two marks.

use crate::pin::{Connection, Connector, Way};
use crate::{pi, sensor, steering};

/// The page with its tables.
pub(super) fn filled(page: &str) -> Result<String, String> {
    let made = [
        ("the sensor board's pins", board(&sensor::TABLE)),
        ("the steering board's pins", board(&steering::TABLE)),
        ("the buttons", buttons()),
        ("the buttons' configuration", configuration()),
    ];
    let mut page = page.to_owned();
    for (name, table) in made {
        let (begin, end) = (format!("<!-- {name}: made -->\n"), "<!-- end -->\n");
        let place = page.split_once(&begin).and_then(|(before, rest)| {
            let (_, after) = rest.split_once(end)?;
            Some(format!("{before}{begin}{table}{end}{after}"))
        });
        page = place
            .ok_or_else(|| format!("the page has no place for {name}: the lines `{begin}{end}`"))?;
    }
    Ok(page)
}

fn board(table: &[Connection]) -> String {
    let mut text = String::from(
        "| pin | on the case | function | way | wire | leads to | through |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for row in table {
        text += &format!(
            "| P{}{} | {} | {} | {} | {} | {} | {} |\n",
            row.pin.port.letter(),
            row.pin.bit,
            row.pin.on_case(),
            row.function.unwrap_or_default(),
            way(row.way),
            row.wire,
            row.to.name,
            through(row.to.connector),
        );
    }
    text
}

fn way(way: Way) -> &'static str {
    match way {
        Way::In => "in",
        Way::InPulledUp => "in, pulled up",
        Way::Out | Way::OutOfUart => "out",
        Way::InAndOut => "in, and out while the board sends",
        Way::Programmer => "the programmer's",
    }
}

/// A connector's name.
pub(super) fn through(connector: Connector) -> String {
    match connector {
        Connector::Port(number) => format!("PORT {number}"),
        Connector::Isp => "ISP header".to_owned(),
    }
}

fn buttons() -> String {
    let mut text = String::from(
        "| contact | GPIO | pin on the Pi's header | other end |\n|---|---|---|---|\n",
    );
    for button in pi::BUTTONS {
        text += &format!(
            "| {} | {} | {} | ground, such as pin {} |\n",
            button.name, button.line, button.header, button.ground
        );
    }
    text
}

fn configuration() -> String {
    let mut text = format!("```toml\n[buttons]\nchip = \"{}\"\n", pi::CHIP);
    for button in pi::BUTTONS {
        text += &format!("{} = {}\n", button.key, button.line);
    }
    text + "```\n"
}
