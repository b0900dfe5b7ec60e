//! Compares the regulator with tables calculated by hand.

use lager_control::pd::{Gains, Pd};

/// Rows of (time in ms, error, expected u).
fn table(gains: Gains, start_us: u32, rows: &[(u32, i8, i16)]) {
    let mut pd = Pd::new(gains);
    for (ms, error, expected) in rows {
        let now = start_us.wrapping_add(ms * 1_000);
        assert_eq!(
            pd.update(*error, now),
            *expected,
            "at {ms} ms, error {error}, {gains:?}"
        );
    }
}

#[test]
fn the_originals_gains_over_a_word_every_5_ms() {
    // u = 2 e + 2 (e - e 10 ms ago); before the first two words there is no sample that old.
    table(
        Gains::default(),
        0,
        &[
            (0, 3, 6),
            (5, 4, 8),
            (10, 4, 8 + 2),
            (15, 5, 10 + 2),
            (20, 2, 4 - 4),
            (25, -1, -2 - 12),
            (30, -1, -2 - 6),
            (35, -1, -2),
            (40, -1, -2),
        ],
    );
}

#[test]
fn each_gain_works_alone() {
    table(
        Gains { p: 7, d: 0 },
        0,
        &[(0, -5, -35), (5, 5, 35), (10, 5, 35), (15, 0, 0)],
    );
    table(
        Gains { p: 0, d: 5 },
        0,
        &[(0, 0, 0), (5, 1, 0), (10, 2, 10), (15, 3, 10), (20, 3, 5)],
    );
}

#[test]
fn under_the_outer_sensors_p_counts_once_more() {
    // u = 2 e + 2 (|e| - 5), with the sign of e.
    table(
        Gains { p: 2, d: 0 },
        0,
        &[
            (0, 5, 10),
            (5, 6, 14),
            (10, -6, -14),
            (15, -8, -22),
            (20, 10, 30),
            (25, -10, -30),
        ],
    );
}

#[test]
fn the_derivative_is_over_ten_milliseconds_at_every_pace() {
    // A line that moves one half step every 5 ms changes by 2 in 10 ms: D = 10 * 2, plus or minus
    // the rounding to whole half steps.
    for pace_us in [500, 1_000, 2_600, 5_000, 8_000, 11_500, 20_000, 40_000] {
        let mut pd = Pd::new(Gains { p: 0, d: 10 });
        for step in 0.. {
            let now_us = step * pace_us;
            let error = (now_us / 5_000) as i8;
            let d = pd.update(error, now_us);
            if now_us > 30_000 {
                assert!((10..=30).contains(&d), "{d} at a word every {pace_us} us");
            }
            if now_us > 100_000 {
                break;
            }
        }
    }
    // 12 ms apart, a change of 3: 2 * 3 * 10 / 12 = 5.
    table(
        Gains { p: 0, d: 2 },
        0,
        &[(0, 0, 0), (12, 3, 5), (24, 0, -5)],
    );
    // 11.5 ms apart, a change of 1, rounded: 2 * 1 * 10 / 11.5 = 1.74 -> 2.
    let mut pd = Pd::new(Gains { p: 0, d: 2 });
    pd.update(0, 0);
    assert_eq!(pd.update(1, 11_500), 2);
    let mut pd = Pd::new(Gains { p: 0, d: 2 });
    pd.update(0, 0);
    assert_eq!(pd.update(-1, 11_500), -2);
}

#[test]
fn after_a_pause_the_past_tells_nothing() {
    table(
        Gains { p: 0, d: 2 },
        0,
        &[(0, 0, 0), (10, 4, 8), (61, -4, 0), (71, -2, 4)],
    );
}

#[test]
fn the_clocks_end_changes_nothing() {
    table(
        Gains::default(),
        u32::MAX - 7_000,
        &[(0, 1, 2), (5, 2, 4), (10, 3, 10), (15, 3, 8)],
    );
}

#[test]
fn the_largest_gains_and_errors_stay_in_range() {
    let gains = Gains { p: 255, d: 255 };
    table(
        gains,
        0,
        &[(0, -10, -3_825), (10, 10, 3_825 + 5_100), (20, -10, -8_925)],
    );
}

#[test]
fn gains_change_without_forgetting_the_past() {
    let mut pd = Pd::new(Gains::default());
    pd.update(0, 0);
    pd.set_gains(Gains { p: 1, d: 10 });
    assert_eq!(pd.gains(), Gains { p: 1, d: 10 });
    assert_eq!(pd.update(2, 10_000), 2 + 20);
}
