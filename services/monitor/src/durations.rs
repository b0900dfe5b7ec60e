//! Shows a histogram of durations to people: as quantiles, not as buckets.
//!
//! This file stands apart because [`crate::block`] knows no types, and because a person cannot read
//! a histogram bucket by bucket. Programs take the JSON, which has the buckets.

use lager_sample::Schema;
use lager_topics::Durations;
use serde_json::{Value, json};

/// Replaces the histograms in `payload` by what people see.
pub(crate) fn readable(payload: &Value) -> Value {
    match payload {
        Value::Object(members) if is_histogram(payload) => serde_json::from_value(payload.clone())
            .map_or_else(
                |_| Value::Object(members.clone()),
                |durations| told(&durations),
            ),
        Value::Object(members) => members
            .iter()
            .map(|(name, value)| (name.clone(), readable(value)))
            .collect(),
        other => other.clone(),
    }
}

fn is_histogram(value: &Value) -> bool {
    let fields = Durations::FIELDS;
    let has = |name| value.get(name).is_some();
    value.as_object().map(serde_json::Map::len) == Some(fields.len())
        && fields.iter().all(|field| has(field.name))
}

fn told(durations: &Durations) -> Value {
    json!({
        "count": durations.count,
        "mean_ns": durations.mean_ns(),
        "p50_ns": durations.quantile_ns(0.5),
        "p90_ns": durations.quantile_ns(0.9),
        "p99_ns": durations.quantile_ns(0.99),
        "p999_ns": durations.tail_ns(0.999),
        "max_ns": durations.max_ns,
    })
}
