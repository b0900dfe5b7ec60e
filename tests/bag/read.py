"""Reads a recording with foreign packages. Prints how many messages each topic has, and how many
samples its writers had numbered up to the last one.

It compares every CRC, and validates every message against its schema.
"""

import collections
import json
import sys

import jsonschema
from mcap.reader import make_reader

validators = {}
counts = collections.Counter()
numbered = collections.defaultdict(dict)
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    for schema, channel, message in reader.iter_messages():
        if schema.id not in validators:
            text = json.loads(schema.data)
            jsonschema.Draft202012Validator.check_schema(text)
            validators[schema.id] = jsonschema.Draft202012Validator(text)
        content = json.loads(message.data)
        validators[schema.id].validate(content)
        counts[channel.topic] += 1
        if stamp := content.get("stamp"):
            stream = stamp["writer"], stamp["epoch"]
            last = numbered[channel.topic].get(stream, 0)
            numbered[channel.topic][stream] = max(last, stamp["sequence"] + 1)
    assert reader.get_summary().statistics.message_count == sum(counts.values())
sums = {topic: sum(streams.values()) for topic, streams in numbered.items()}
print(json.dumps({"messages": counts, "numbered": sums}))
