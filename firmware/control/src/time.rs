//! Compares wrapping microseconds.
//!
//! A time is past if it lies less than half the clock's range behind. Code whose times may grow
//! older stores the result of the comparison instead.

/// Whether `now` is at or past `due`.
pub(crate) fn reached(now: u32, due: u32) -> bool {
    now.wrapping_sub(due) < 1 << 31
}

/// The earlier of two times; a time already past counts as now.
pub(crate) fn first(now: u32, one: u32, other: u32) -> u32 {
    if ahead(now, one) <= ahead(now, other) {
        one
    } else {
        other
    }
}

/// How far `due` lies ahead, 0 when past.
fn ahead(now: u32, due: u32) -> u32 {
    if reached(now, due) {
        0
    } else {
        due.wrapping_sub(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_compare_over_the_clocks_end() {
        let before = u32::MAX - 10;
        assert!(reached(5, before));
        assert!(!reached(before, 5));
        assert!(reached(7, 7));
        assert_eq!(first(before, 5, 3), 3);
        assert_eq!(first(before, 5, before - 100), before - 100);
        assert_eq!(first(0, 5, 9), 5);
    }
}
