"""Reads a recording with other people's packages, and prints how many messages each topic has.

Every CRC is compared and every message validated against its schema.
"""

import collections
import json
import sys

import jsonschema
from mcap.reader import make_reader

validators = {}
counts = collections.Counter()
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    for schema, channel, message in reader.iter_messages():
        if schema.id not in validators:
            text = json.loads(schema.data)
            jsonschema.Draft202012Validator.check_schema(text)
            validators[schema.id] = jsonschema.Draft202012Validator(text)
        validators[schema.id].validate(json.loads(message.data))
        counts[channel.topic] += 1
    assert reader.get_summary().statistics.message_count == sum(counts.values())
print(json.dumps(counts))
