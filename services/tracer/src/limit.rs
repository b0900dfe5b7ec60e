//! From when on a frame is late, as a person writes it.

/// The ns of a text such as `200us`, `1.5ms` or `1s`.
///
/// # Errors
/// A sentence that says what can be given.
pub fn limit(text: &str) -> Result<u64, String> {
    let rule = || "give a time from 1us to 10s, such as 200us or 1.5ms".to_owned();
    let units = [("us", 1e3), ("ms", 1e6), ("s", 1e9)];
    let of = |(unit, ns): &(&str, f64)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * ns)
    };
    let ns = units.iter().find_map(of).ok_or_else(rule)?;
    let fits = (1e3..=1e10).contains(&ns);
    fits.then_some(ns as u64).ok_or_else(rule)
}

#[cfg(test)]
mod tests {
    use super::limit;

    #[test]
    fn a_time_needs_its_unit() {
        for (text, ns) in [
            ("200us", 200_000),
            ("1.5ms", 1_500_000),
            ("1 s", 1_000_000_000),
        ] {
            assert_eq!(limit(text), Ok(ns), "{text}");
        }
        for wrong in ["", "200", "us", "0us", "-1ms", "NaNs", "11s", "5min"] {
            assert!(limit(wrong).is_err(), "{wrong}");
        }
    }
}
