//! The whole distribution of a row's times, what is read off it, and medians over runs.
//!
//! A [`Distribution`] is an HdrHistogram that grows with its values, so no time is too long for it,
//! and the longest one is kept as it was. Distributions of several rounds add up; percentiles do
//! not, so nothing here averages percentiles.

use core::fmt;

use hdrhistogram::Histogram;
use hdrhistogram::serialization::{Deserializer, Serializer as _, V2DeflateSerializer};
use serde::{Deserialize, Serialize};

/// A percentile is a figure only if this many samples lie beyond it.
const BEYOND: u64 = 10;

/// Times in ns. Each is kept with three digits; their number and the longest one are exact.
#[derive(Clone, PartialEq)]
pub struct Distribution {
    histogram: Histogram<u64>,
    max_ns: u64,
}

impl fmt::Debug for Distribution {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.quantiles().fmt(formatter)
    }
}

impl Default for Distribution {
    fn default() -> Self {
        Self {
            histogram: Histogram::new(3).expect("three digits are allowed"),
            max_ns: 0,
        }
    }
}

impl Extend<u64> for Distribution {
    fn extend<I: IntoIterator<Item = u64>>(&mut self, times_ns: I) {
        for ns in times_ns {
            self.histogram
                .record(ns)
                .expect("it grows up to every number");
            self.max_ns = self.max_ns.max(ns);
        }
    }
}

impl FromIterator<u64> for Distribution {
    fn from_iter<I: IntoIterator<Item = u64>>(times_ns: I) -> Self {
        let mut distribution = Self::default();
        distribution.extend(times_ns);
        distribution
    }
}

impl Distribution {
    /// Adds the times of another one.
    pub fn add(&mut self, other: &Self) {
        self.histogram
            .add(&other.histogram)
            .expect("it grows up to every number");
        self.max_ns = self.max_ns.max(other.max_ns);
    }

    /// The time that a share of the samples does not exceed, in ns. `None` if fewer than ten samples
    /// lie beyond it: it would be little more than the longest time by another name.
    #[must_use]
    pub fn percentile(&self, percent: f64) -> Option<u64> {
        let n = self.histogram.len();
        let beyond = n as f64 * (1.0 - percent / 100.0);
        // A share such as 0.1 is not exact in binary.
        (beyond + 1e-6 >= BEYOND as f64)
            .then(|| self.histogram.value_at_percentile(percent).min(self.max_ns))
    }

    /// The figures of a report.
    #[must_use]
    pub fn quantiles(&self) -> Quantiles {
        Quantiles {
            n: self.histogram.len(),
            p50_ns: self.percentile(50.0),
            p90_ns: self.percentile(90.0),
            p99_ns: self.percentile(99.0),
            p999_ns: self.percentile(99.9),
            p9999_ns: self.percentile(99.99),
            p99999_ns: self.percentile(99.999),
            max_ns: self.max_ns,
        }
    }

    /// The number of times of at least that many ns; one more or less where the digits end.
    #[must_use]
    pub fn at_least(&self, ns: u64) -> u64 {
        self.histogram.count_between(ns, u64::MAX)
    }

    /// The histogram, for HdrHistogram's own formats.
    pub(crate) const fn histogram(&self) -> &Histogram<u64> {
        &self.histogram
    }
}

/// In JSON: HdrHistogram's compressed format in base64, as in its logs, and the longest time.
#[derive(Serialize, Deserialize)]
struct Packed {
    v2_deflate: String,
    max_ns: u64,
}

impl Serialize for Distribution {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut bytes = Vec::new();
        V2DeflateSerializer::new()
            .serialize(&self.histogram, &mut bytes)
            .map_err(serde::ser::Error::custom)?;
        let packed = Packed {
            v2_deflate: data_encoding::BASE64.encode(&bytes),
            max_ns: self.max_ns,
        };
        packed.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Distribution {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let packed = Packed::deserialize(deserializer)?;
        let bytes = data_encoding::BASE64
            .decode(packed.v2_deflate.as_bytes())
            .map_err(D::Error::custom)?;
        let mut read = Deserializer::new()
            .deserialize(&mut &bytes[..])
            .map_err(D::Error::custom)?;
        // One that was read does not grow by itself.
        read.auto(true);
        Ok(Self {
            histogram: read,
            max_ns: packed.max_ns,
        })
    }
}

/// The figures of a row; times in ns. A percentile with fewer than ten samples beyond it is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Quantiles {
    /// The number of samples.
    pub n: u64,
    /// The median.
    pub p50_ns: Option<u64>,
    /// 90 % of the samples are at most this, and so on.
    pub p90_ns: Option<u64>,
    /// 99 %.
    pub p99_ns: Option<u64>,
    /// 99.9 %.
    pub p999_ns: Option<u64>,
    /// 99.99 %.
    pub p9999_ns: Option<u64>,
    /// 99.999 %.
    pub p99999_ns: Option<u64>,
    /// The longest.
    pub max_ns: u64,
}

/// The median; the mean of the middle two of an even number. `None` if there is no value.
#[must_use]
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(f64::midpoint(lower, upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_a_sample_with_three_digits() {
        let ascending: Distribution = (1..=1_000_000).collect();
        let quantiles = ascending.quantiles();
        let close = |ns: Option<u64>, to: u64| ns.unwrap().abs_diff(to) <= to / 1000;
        assert!(close(quantiles.p50_ns, 500_000), "{quantiles:?}");
        assert!(close(quantiles.p90_ns, 900_000), "{quantiles:?}");
        assert!(close(quantiles.p99999_ns, 999_990), "{quantiles:?}");
        assert_eq!((quantiles.n, quantiles.max_ns), (1_000_000, 1_000_000));
    }

    #[test]
    fn a_percentile_needs_ten_samples_beyond_it() {
        let at = |n: u64| (0..n).map(|_| 7).collect::<Distribution>().quantiles();
        for (n, percentile) in [
            (20, (|found| found.p50_ns) as fn(Quantiles) -> Option<u64>),
            (100, |found| found.p90_ns),
            (1_000, |found| found.p99_ns),
            (10_000, |found| found.p999_ns),
            (100_000, |found| found.p9999_ns),
            (1_000_000, |found| found.p99999_ns),
        ] {
            assert_eq!(percentile(at(n)), Some(7), "{n} samples");
            assert_eq!(percentile(at(n - 1)), None, "{n} samples but one");
        }
        assert_eq!(at(3).max_ns, 7);
    }

    #[test]
    fn rounds_add_up_to_what_one_long_round_would_have_been() {
        let times = |from: u64| (from..20_000).step_by(2).map(|time| time * 37);
        let (mut even, odd): (Distribution, Distribution) =
            (times(0).collect(), times(1).collect());
        even.add(&odd);
        assert_eq!(even, times(0).chain(times(1)).collect());
    }

    #[test]
    fn no_time_is_too_long() {
        let two_minutes = 120_000_000_001;
        let mut some: Distribution = (0..2_000).collect();
        some.extend([two_minutes, u64::MAX]);
        assert_eq!(some.at_least(1_000_000_000), 2);
        assert_eq!(some.quantiles().max_ns, u64::MAX);
        assert!(some.quantiles().p99_ns.unwrap() < 2_000);
    }

    #[test]
    fn what_was_saved_is_read_again_and_still_grows() {
        let some: Distribution = (0..5_000).map(|time| time * time).collect();
        let json = serde_json::to_string(&some).unwrap();
        let mut again: Distribution = serde_json::from_str(&json).unwrap();
        assert_eq!(again, some);
        again.extend([u64::MAX / 2]);
        assert_eq!(again.quantiles().n, 5_001);
        for damaged in [json.replace("SIST", "SISU"), json.replace("HIST", "?!")] {
            assert!(serde_json::from_str::<Distribution>(&damaged).is_err() || damaged == json);
        }
    }

    #[test]
    fn the_median_lies_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
