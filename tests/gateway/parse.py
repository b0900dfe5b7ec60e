"""Reads Prometheus text with the official parser, and prints the samples and kinds in it."""

import json
import sys

from prometheus_client.parser import text_string_to_metric_families

families = list(text_string_to_metric_families(sys.stdin.read()))
for family in families:
    assert family.documentation, family.name
    if family.type == "histogram":
        # Each series is cumulative, and its last bucket is the count.
        series = {}
        for sample in family.samples:
            labels = tuple(sorted((k, v) for k, v in sample.labels.items() if k != "le"))
            part = sample.name[len(family.name) :]
            series.setdefault(labels, {}).setdefault(part, []).append(sample)
        for parts in series.values():
            buckets = sorted((float(each.labels["le"]), each.value) for each in parts["_bucket"])
            counts = [count for _, count in buckets]
            assert counts == sorted(counts) and buckets[-1][0] == float("inf")
            assert counts[-1] == parts["_count"][0].value and len(parts["_sum"]) == 1
print(
    json.dumps(
        {
            "samples": sum(len(family.samples) for family in families),
            "kinds": {family.name: family.type for family in families},
        }
    )
)
