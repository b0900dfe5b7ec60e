//! Which motor is which, from the ways in which the wheels turned twice.
//!
//! ```text
//!   drivers     first: both forwards      second: left backwards, right forwards
//!   wheels      a wheel backwards:        a side as the first time: it hangs at the right driver,
//!               its motor is reversed     so if that is the left side, the motors are swapped
//! ```

use lager_wire::WheelsProfile;

use crate::answer::Way;
use crate::words::Said;

/// The wheels as the boards obey a description without swapped or reversed motors.
pub(crate) fn plain(wheels: WheelsProfile) -> WheelsProfile {
    WheelsProfile {
        swapped: false,
        left_reversed: false,
        right_reversed: false,
        ..wheels
    }
}

/// How the motors are connected, whose wheels turned so when both drivers ran forwards, and so when
/// they ran as for a turn to the left.
///
/// # Errors
/// A wheel stood, or no robot turns its wheels so.
pub(crate) fn connected(
    wheels: WheelsProfile,
    ahead: [Way; 2],
    left: [Way; 2],
) -> Result<WheelsProfile, Said> {
    if ahead.iter().chain(&left).any(|way| *way == Way::Still) {
        return Err("wheel_still".into());
    }
    let swapped = match [left[0] == ahead[0], left[1] == ahead[1]] {
        [false, true] => false,
        [true, false] => true,
        _ => return Err("wheels_odd".into()),
    };
    Ok(WheelsProfile {
        swapped,
        left_reversed: ahead[0] == Way::Backwards,
        right_reversed: ahead[1] == Way::Backwards,
        ..wheels
    })
}

/// What was found, as a sentence.
pub(crate) fn said(wheels: &WheelsProfile) -> Said {
    let flag = |is_so| Said::from(if is_so { "flag_yes" } else { "flag_no" });
    Said::of(
        "found_wheels",
        [
            ("swapped", flag(wheels.swapped)),
            ("left", flag(wheels.left_reversed)),
            ("right", flag(wheels.right_reversed)),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_connection_is_found_from_what_its_wheels_do() {
        for bits in 0..8 {
            let bit = |place: u8| bits >> place & 1 == 1;
            let wheels = WheelsProfile {
                swapped: bit(0),
                left_reversed: bit(1),
                right_reversed: bit(2),
                ..WheelsProfile::default()
            };
            // What the wheels do when the drivers run so.
            let turned = |[left, right]: [bool; 2]| {
                let [left, right] = if wheels.swapped {
                    [right, left]
                } else {
                    [left, right]
                };
                let way = |forwards| {
                    if forwards {
                        Way::Forwards
                    } else {
                        Way::Backwards
                    }
                };
                [
                    way(left != wheels.left_reversed),
                    way(right != wheels.right_reversed),
                ]
            };
            let found = connected(plain(wheels), turned([true, true]), turned([false, true]));
            assert_eq!(found, Ok(wheels));
        }
    }

    #[test]
    fn wheels_that_stand_and_answers_that_contradict_each_other_are_refused() {
        use Way::{Backwards, Forwards, Still};
        for (ahead, left, name) in [
            ([Forwards, Still], [Backwards, Forwards], "wheel_still"),
            ([Forwards, Forwards], [Forwards, Forwards], "wheels_odd"),
            ([Forwards, Backwards], [Backwards, Forwards], "wheels_odd"),
        ] {
            let refused = connected(WheelsProfile::default(), ahead, left);
            assert_eq!(refused.expect_err("impossible").name(), name);
        }
    }
}
