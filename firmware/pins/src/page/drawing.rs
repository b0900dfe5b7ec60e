//! The drawing: both boards side by side, what is connected with each beside it, the Pi below.
//!
//! ```text
//!   devices === sensor board === ExDe === steering board === devices
//!      |                                                        |
//!      '--- USB cable --------------- Pi ---------- USB cable --'
//! ```
//!
//! Each wire has the colour that the original gave it by its way: green into the chip, yellow out of
//! it (P9). Its arrow says the same without a colour.

use core::fmt::Write as _;

use super::tables::through;
use crate::pin::{Connection, Device, Way};
use crate::{both, pi, sensor, steering};

const WIDTH: i32 = 1_280;
const MARGIN: i32 = 24;
/// From one pin to the next.
const ROW: i32 = 28;
/// A device's box is at least so high, for its three lines of text.
const LEAST: i32 = 66;
/// Between two devices.
const GAP: i32 = 14;
const TOP: i32 = 118;
const DEVICE: i32 = 236;
const CHIP: i32 = 148;
/// The left edges of the two chips.
const CHIPS: [i32; 2] = [MARGIN + DEVICE + 168, WIDTH - MARGIN - DEVICE - 168 - CHIP];
/// How far below the devices the Pi's box begins.
const BELOW: i32 = 44;
const PI: i32 = 60 + 2 * (LEAST + GAP);

const STYLE: &str = "\
  svg { color-scheme: light dark; }
  text { font: 13px system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif; fill: #1f2328; }
  .page { fill: #ffffff; stroke: #d1d9e0; }
  .title { font-size: 18px; font-weight: 600; }
  .name { font-weight: 600; }
  .quiet { fill: #59636e; }
  .box { fill: #f6f8fa; stroke: #8c959f; }
  .chip { fill: #eaeef2; stroke: #57606a; stroke-width: 1.5; }
  .wire { stroke-width: 2; fill: none; }
  .in { stroke: #1a7f37; } .in-head { fill: #1a7f37; }
  .out { stroke: #9a6700; } .out-head { fill: #9a6700; }
  .other { stroke: #57606a; } .other-head { fill: #57606a; }
  @media (prefers-color-scheme: dark) {
    text { fill: #e6edf3; }
    .page { fill: #0d1117; stroke: #30363d; }
    .quiet { fill: #9198a1; }
    .box { fill: #151b23; stroke: #656c76; }
    .chip { fill: #212830; stroke: #9198a1; }
    .in { stroke: #3fb950; } .in-head { fill: #3fb950; }
    .out { stroke: #d29922; } .out-head { fill: #d29922; }
    .other { stroke: #9198a1; } .other-head { fill: #9198a1; }
  }
";

/// On which side of its chip something is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

/// The drawing, as the text of an SVG file.
pub fn drawing() -> String {
    let columns = [column(&sensor::TABLE), column(&steering::TABLE)];
    let devices_end = columns
        .iter()
        .filter_map(|column| column.last().map(|device| device.top + device.height))
        .max()
        .unwrap_or(TOP);
    let height = devices_end + BELOW + PI + MARGIN + 30;
    let mut svg = head(height);
    let sides = [Side::Left, Side::Right];
    for ((column, side), name) in columns
        .iter()
        .zip(sides)
        .zip(["Sensor board", "Steering board"])
    {
        chip(&mut svg, side, name, devices_end);
        for device in column {
            device.draw(&mut svg, side);
        }
    }
    exde(&mut svg, devices_end);
    the_pi(&mut svg, &columns, devices_end + BELOW);
    let _ = writeln!(
        svg,
        "<text class=\"quiet\" x=\"{MARGIN}\" y=\"{}\">The grounds of battery, motor drivers, servos, \
         both boards and the Pi are connected. Numbers beside pins count on the 40-pin case.</text>",
        height - 22
    );
    svg + "</svg>\n"
}

fn head(height: i32) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" role=\"img\" aria-labelledby=\"title about\">\n\
         <title id=\"title\">How the boards are wired</title>\n\
         <desc id=\"about\">The tables of firmware/WIRING.md say the same in words.</desc>\n\
         <style>\n{STYLE}</style>\n\
         <rect class=\"page\" x=\"0.5\" y=\"0.5\" width=\"{}\" height=\"{}\" rx=\"8\"/>\n\
         <text class=\"title\" x=\"{MARGIN}\" y=\"36\">How the boards are wired</text>\n\
         <text class=\"quiet\" x=\"{MARGIN}\" y=\"60\">Made from the tables in firmware/pins. \
         Wires and their ways:</text>\n\
         <text x=\"470\" y=\"60\">into the chip</text>{}\n\
         <text x=\"640\" y=\"60\">out of the chip</text>{}\n\
         <text x=\"820\" y=\"60\">both ways, or the programmer's</text>{}\n",
        WIDTH - 1,
        height - 1,
        wire(&[(426, 56), (460, 56)], Look::In, (false, true)),
        wire(&[(596, 56), (630, 56)], Look::Out, (false, true)),
        wire(&[(776, 56), (810, 56)], Look::Other, (true, true)),
    )
}

/// How a wire looks.
#[derive(Clone, Copy)]
enum Look {
    In,
    Out,
    Other,
}

impl Look {
    fn of(way: Way) -> Self {
        match way {
            Way::In | Way::InPulledUp => Self::In,
            Way::Out | Way::OutOfUart => Self::Out,
            Way::InAndOut | Way::Programmer => Self::Other,
        }
    }

    fn class(self) -> &'static str {
        match self {
            Self::In => "in",
            Self::Out => "out",
            Self::Other => "other",
        }
    }
}

/// A wire along these points, with an arrow's head at its beginning, at its end, or at both.
fn wire(points: &[(i32, i32)], look: Look, heads: (bool, bool)) -> String {
    let class = look.class();
    let path: Vec<String> = points.iter().map(|(x, y)| format!("{x} {y}")).collect();
    let mut text = format!("<path class=\"wire {class}\" d=\"M{}\"/>", path.join("L"));
    let mut arrow = |tip: (i32, i32), before: (i32, i32)| {
        let (x, y) = tip;
        let (dx, dy) = ((before.0 - x).signum() * 9, (before.1 - y).signum() * 9);
        let (sx, sy) = (dy.signum() * 5, dx.signum() * 5);
        let _ = write!(
            text,
            "<path class=\"{class}-head\" d=\"M{x} {y}L{} {}L{} {}Z\"/>",
            x + dx + sx,
            y + dy + sy,
            x + dx - sx,
            y + dy - sy
        );
    };
    if let [first, second, ..] = points
        && heads.0
    {
        arrow(*first, *second);
    }
    if let [.., second, last] = points
        && heads.1
    {
        arrow(*last, *second);
    }
    text
}

/// A device beside its chip.
struct Placed {
    device: Device,
    rows: Vec<Connection>,
    top: i32,
    height: i32,
}

/// The devices of a board from top to bottom, without the other board.
fn column(table: &[Connection]) -> Vec<Placed> {
    let mut placed: Vec<Placed> = Vec::new();
    let beside = table
        .iter()
        .filter(|row| row.to != sensor::STEERING && row.to != steering::SENSOR);
    for row in beside {
        match placed.last_mut() {
            Some(last) if last.device == row.to => last.rows.push(*row),
            _ => placed.push(Placed {
                device: row.to,
                rows: vec![*row],
                top: 0,
                height: 0,
            }),
        }
    }
    let mut top = TOP;
    for device in &mut placed {
        device.top = top;
        device.height = LEAST.max(device.rows.len() as i32 * ROW + 8);
        top += device.height + GAP;
    }
    placed
}

impl Placed {
    /// The middle of a wire.
    fn row(&self, row: usize) -> i32 {
        let rows = self.rows.len() as i32;
        self.top + self.height / 2 + (2 * row as i32 + 1 - rows) * ROW / 2
    }

    fn draw(&self, svg: &mut String, side: Side) {
        let (left, edge, pins) = match side {
            Side::Left => (MARGIN, MARGIN + DEVICE, CHIPS[0]),
            Side::Right => (
                WIDTH - MARGIN - DEVICE,
                WIDTH - MARGIN - DEVICE,
                CHIPS[1] + CHIP,
            ),
        };
        device_box(svg, left, (self.top, self.height), &self.device);
        for (place, row) in self.rows.iter().enumerate() {
            let y = self.row(place);
            let heads = match row.way {
                Way::In | Way::InPulledUp => (false, true),
                Way::Out | Way::OutOfUart => (true, false),
                Way::InAndOut => (true, true),
                Way::Programmer => (false, false),
            };
            let _ = writeln!(
                svg,
                "{}<text class=\"quiet\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                wire(&[(edge, y), (pins, y)], Look::of(row.way), heads),
                (edge + pins) / 2,
                y - 5,
                row.wire
            );
            pin(svg, side, row, y);
        }
    }
}

fn device_box(svg: &mut String, left: i32, (top, height): (i32, i32), device: &Device) {
    let (x, middle) = (left + 12, top + height / 2);
    let _ = writeln!(
        svg,
        "<rect class=\"box\" x=\"{left}\" y=\"{top}\" width=\"{DEVICE}\" height=\"{height}\" rx=\"6\"/>\
         <text class=\"name\" x=\"{x}\" y=\"{}\">{}</text>",
        middle - 14,
        device.name
    );
    let lines = [device.note.to_owned(), through(device.connector)];
    for (line, y) in lines.iter().zip([middle + 5, middle + 24]) {
        let _ = writeln!(
            svg,
            "<text class=\"quiet\" x=\"{x}\" y=\"{y}\">{line}</text>"
        );
    }
}

/// A pin's name inside its chip, at the side where its wire ends.
fn pin(svg: &mut String, side: Side, row: &Connection, y: i32) {
    let left = match side {
        Side::Left => CHIPS[0],
        Side::Right => CHIPS[1],
    };
    pin_at(svg, side == Side::Left, left, row, y);
}

fn pin_at(svg: &mut String, at_left: bool, left: i32, row: &Connection, y: i32) {
    let (x, anchor) = match at_left {
        true => (left + 8, "start"),
        false => (left + CHIP - 8, "end"),
    };
    let name = format!(
        "<tspan class=\"name\">P{}{}</tspan>",
        row.pin.port.letter(),
        row.pin.bit
    );
    let number = format!("<tspan class=\"quiet\">{}</tspan>", row.pin.on_case());
    let text = match at_left {
        true => format!("{name} {number}"),
        false => format!("{number} {name}"),
    };
    let _ = writeln!(
        svg,
        "<text x=\"{x}\" y=\"{}\" text-anchor=\"{anchor}\">{text}</text>",
        y + 5
    );
}

fn chip(svg: &mut String, side: Side, name: &str, bottom: i32) {
    let left = CHIPS[side as usize];
    let top = TOP - 8;
    let _ = writeln!(
        svg,
        "<rect class=\"chip\" x=\"{left}\" y=\"{top}\" width=\"{CHIP}\" height=\"{}\" rx=\"6\"/>\
         <text class=\"name\" x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{name}</text>\
         <text class=\"quiet\" x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">ATmega1284P</text>",
        bottom + 8 - top,
        top - 24,
        top - 8,
        middle = left + CHIP / 2,
    );
}

/// The wires between the boards. Both tables name them alike.
fn exde(svg: &mut String, bottom: i32) {
    let ends = |wire: &str| {
        let of = |table: &[Connection], other: &Device| {
            let row = table
                .iter()
                .find(|row| row.to == *other && row.wire == wire);
            row.copied()
        };
        Some((
            of(&sensor::TABLE, &sensor::STEERING)?,
            of(&steering::TABLE, &steering::SENSOR)?,
        ))
    };
    let rows = sensor::TABLE
        .iter()
        .filter(|row| row.to == sensor::STEERING);
    let (from, to) = (CHIPS[0] + CHIP, CHIPS[1]);
    let mut y = (TOP + bottom) / 2 - ROW;
    let _ = writeln!(
        svg,
        "<text class=\"name\" x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">ExDe</text>\
         <text class=\"quiet\" x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{} to {}</text>",
        y - 44,
        y - 26,
        through(sensor::STEERING.connector),
        through(steering::SENSOR.connector),
        middle = (from + to) / 2,
    );
    for (sensor, steering) in rows.filter_map(|row| ends(row.wire)) {
        // The sensor board's way: its output is the other board's input.
        let is_out = sensor.way == Way::Out;
        let look = if is_out { Look::Out } else { Look::In };
        let _ = writeln!(
            svg,
            "{}<text class=\"quiet\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            wire(&[(from, y), (to, y)], look, (!is_out, is_out)),
            (from + to) / 2,
            y - 5,
            sensor.wire.trim_start_matches("ExDe ")
        );
        pin_at(svg, false, CHIPS[0], &sensor, y);
        pin_at(svg, true, CHIPS[1], &steering, y);
        y += ROW;
    }
}

/// The Pi, the cables to it, and its buttons.
fn the_pi(svg: &mut String, columns: &[Vec<Placed>; 2], top: i32) {
    let (left, right) = (CHIPS[0], CHIPS[1] + CHIP);
    let _ = writeln!(
        svg,
        "<rect class=\"chip\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{PI}\" rx=\"6\"/>\
         <text class=\"name\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">Raspberry Pi</text>\
         <text class=\"quiet\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">any two USB ports: the boards \
         say who they are</text>",
        right - left,
        top + 24,
        top + 44,
        x = (left + right) / 2,
    );
    let usb = top + 34;
    let sides = [(MARGIN + 60, left), (WIDTH - MARGIN - 60, right)];
    for (column, (x, edge)) in columns.iter().zip(sides) {
        let Some(cable) = column.iter().find(|placed| placed.device == both::CABLE) else {
            continue;
        };
        let points = [(x, cable.top + cable.height), (x, usb), (edge, usb)];
        let _ = writeln!(svg, "{}", wire(&points, Look::Other, (false, false)));
        let _ = writeln!(
            svg,
            "<text class=\"quiet\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">USB</text>",
            (x + edge) / 2,
            usb - 5
        );
    }
    let mut y = top + 60;
    for button in pi::BUTTONS {
        let middle = y + LEAST / 2;
        let _ = writeln!(
            svg,
            "<rect class=\"box\" x=\"{MARGIN}\" y=\"{y}\" width=\"{DEVICE}\" height=\"{LEAST}\" rx=\"6\"/>\
             <text class=\"name\" x=\"{tx}\" y=\"{}\">{}</text>\
             <text class=\"quiet\" x=\"{tx}\" y=\"{}\">the other end to ground, pin {}</text>\
             {}<text x=\"{px}\" y=\"{}\"><tspan class=\"name\">GPIO {}</tspan> \
             <tspan class=\"quiet\">pin {} of the header</tspan></text>",
            middle - 5,
            button.name,
            middle + 15,
            button.ground,
            wire(
                &[(MARGIN + DEVICE, middle), (left, middle)],
                Look::In,
                (false, true)
            ),
            middle + 5,
            button.line,
            button.header,
            tx = MARGIN + 12,
            px = left + 8,
        );
        y += LEAST + GAP;
    }
}
