"""Looks at a robot live with a foreign client; arguments: URL, then topics. Prints the server's
data about itself, each channel's schema, and each topic's last message. Checks all schemas."""

import asyncio
import contextlib
import functools
import json
import sys

import jsonschema
from robo_ws_bridge import WebSocketBridgeClient

url, wanted = sys.argv[1], set(sys.argv[2:])


async def look():
    client = WebSocketBridgeClient(url, min_retry_delay=0.1)
    last, refused, whole = {}, [], asyncio.Event()

    # Cached: a client that is slower than the robot would not answer its pings in time.
    @functools.cache
    def validator(schema):
        schema = json.loads(schema)
        return jsonschema.validators.validator_for(schema)(schema)

    def message(channel, unix_ns, data):
        # The client would only log an exception of this handler.
        try:
            value = json.loads(data)
            validator(channel["schema"]).validate(value)
            assert (channel["encoding"], channel["schemaEncoding"]) == ("json", "jsonschema")
            assert unix_ns > 1_700_000_000_000_000_000, unix_ns
            last[channel["topic"]] = value
        except Exception as error:
            refused.append(f"{channel['topic']}: {error}")
        if refused or wanted <= last.keys():
            whole.set()

    client.on_message(message)
    await client.connect()
    while not wanted <= {channel["topic"] for channel in client.channels.values()}:
        await asyncio.sleep(0.05)
    while not whole.is_set():
        # The client may miss a message that comes at once: subscribe again to topics without one.
        for topic in wanted - last.keys():
            await client.unsubscribe(topic)
            await client.subscribe(topic)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(whole.wait(), 5)
    told = {
        "server": client.server_info["name"],
        "capabilities": client.server_info["capabilities"],
        "schemas": {channel["topic"]: channel["schemaName"] for channel in client.channels.values()},
        "last": last,
    }
    await client.disconnect()
    assert not refused, refused[0]
    print(json.dumps(told))


asyncio.run(asyncio.wait_for(look(), 120))
