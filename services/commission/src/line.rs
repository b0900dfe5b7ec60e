//! What the line sensors' bits over floor and on a line say of their polarity.

use lager_topics::Health;
use lager_wire::LineBits;

use crate::words::Said;

/// The three sensors in the middle.
const MIDDLE: u16 = 0b000_0111_0000;

/// Whether the sensors show tape where there is none.
///
/// # Errors
/// The bits do not fit the two places.
pub(crate) fn is_inverted(floor: u16, tape: u16) -> Result<bool, Said> {
    let inverted = floor.count_ones() > u32::from(LineBits::SENSORS) / 2;
    let plain = if inverted { LineBits::MASK } else { 0 };
    let odd = floor ^ plain;
    if odd != 0 {
        return Err(Said::new("line_mixed", &[("sensors", &list(odd))]));
    }
    // A line of one tape's width, and floor at least on one side of it.
    let seen = tape ^ plain;
    let outer = seen & !MIDDLE;
    if seen & MIDDLE == 0 || outer.count_ones() > 5 {
        let values: [(_, &dyn ToString); 2] = [("tape", &bar(tape)), ("floor", &bar(floor))];
        return Err(Said::new("line_same", &values));
    }
    Ok(inverted)
}

/// The sensors that a calibration did not see tell tape from floor.
pub(crate) fn dull(health: &Health) -> Option<Said> {
    let sensors = || health.calibrated.iter().enumerate();
    let is_dull = |(place, sensor): (usize, &lager_topics::CalibratedSensor)| {
        (sensor.tells_apart == 0).then_some((place, *sensor))
    };
    let (_, first) = sensors().find_map(is_dull)?;
    let places = sensors().filter_map(is_dull);
    let places: Vec<_> = places.map(|(place, _)| (place + 1).to_string()).collect();
    let values: [(_, &dyn ToString); 3] = [
        ("sensors", &places.join(", ")),
        ("low", &first.lowest.min(first.highest)),
        ("high", &first.highest),
    ];
    Some(Said::new("line_dull", &values))
}

/// The bits as a person sees them from above.
pub(crate) fn bar(bits: u16) -> String {
    let sensors = 0..LineBits::SENSORS;
    let tape = |index| LineBits::new(bits).sensor(index);
    sensors
        .map(|index| if tape(index) { '#' } else { '-' })
        .collect()
}

/// The numbers of these sensors, counted from the left.
fn list(bits: u16) -> String {
    let sensors = (0..LineBits::SENSORS).filter(|index| LineBits::new(bits).sensor(*index));
    let numbers: Vec<_> = sensors.map(|index| (index + 1).to_string()).collect();
    numbers.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: u16 = 0b000_0111_0000;
    const ALL: u16 = 0b111_1111_1111;

    #[test]
    fn either_polarity_is_told_from_the_two_places() {
        assert_eq!(is_inverted(0, LINE), Ok(false));
        assert_eq!(is_inverted(ALL, ALL ^ LINE), Ok(true));
        // The robot need not stand exactly on the line.
        assert_eq!(is_inverted(0, LINE << 2), Ok(false));
    }

    #[test]
    fn what_cannot_be_is_refused_and_names_the_sensors() {
        for (floor, tape, name) in [
            // Everything is saturated, or lifted: floor and tape are the same.
            (ALL, ALL, "line_same"),
            (0, 0, "line_same"),
            // The person has swapped the places.
            (LINE, 0, "line_mixed"),
            (ALL ^ LINE, ALL, "line_mixed"),
            // The sensors over tape lie at the wrong end of the row.
            (0, 0b110_0000_0000, "line_same"),
            // The robot stands across the tape.
            (0, ALL, "line_same"),
            // A sensor is dead.
            (1 << 10, LINE | 1 << 10, "line_mixed"),
        ] {
            let refused = is_inverted(floor, tape).expect_err("impossible");
            assert_eq!(refused.name(), name, "{floor:011b} {tape:011b}");
        }
        let dead = is_inverted(1 << 10, LINE).expect_err("impossible");
        let text = dead.text(lager_orders::Language::English);
        assert!(text.ends_with("from the left: 1"), "{text}");
        assert_eq!(bar(0b100_0000_0001), "#---------#");
    }
}
