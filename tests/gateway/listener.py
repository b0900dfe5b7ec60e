"""A listener of somebody else: eclipse-zenoh and the attachment's layout, nothing of ours.

usage: listener.py ENDPOINT ROBOT TOPIC COUNT

Prints one JSON object: the numbers of the samples that came, and what the gateway answers.
"""

import json
import queue
import struct
import sys

import zenoh

endpoint, robot, topic, count = sys.argv[1:]
config = zenoh.Config.from_json5(
    json.dumps(
        {
            "mode": "client",
            "connect": {"endpoints": [endpoint]},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        }
    )
)
# version, flags; the stamp: six long numbers, writer, cause's topic; run, number, left out, lost,
# layout. services/remote/src/note.rs draws it.
NOTE = struct.Struct("<BB6x6QII5Q")

with zenoh.open(config) as session:
    samples: "queue.Queue[tuple[bytes, bytes]]" = queue.Queue()

    def take(sample: zenoh.Sample) -> None:
        samples.put((sample.payload.to_bytes(), sample.attachment.to_bytes()))

    subscriber = session.declare_subscriber(f"lager/{robot}/{topic}", take)
    told = []
    while len(told) < int(count):
        payload, attachment = samples.get(timeout=60)
        version, _flags, *stamp_and_more = NOTE.unpack(attachment)
        sequence, _source, _cause, _received, published, epoch, writer, _topic = stamp_and_more[:8]
        run, number, left_out, lost, _layout = stamp_and_more[8:]
        told.append(
            {
                "version": version,
                "sequence": sequence,
                "epoch": epoch,
                "writer": writer,
                "published": published,
                "run": run,
                "number": number,
                "left_out": left_out,
                "lost": lost,
                "payload": payload.hex(),
            }
        )
    layouts = {}
    for reply in session.get(f"lager/{robot}/@layout/**"):
        about = json.loads(reply.ok.payload.to_bytes())
        layouts[str(reply.ok.key_expr)] = about["layout"]
    alive = [str(reply.ok.key_expr) for reply in session.liveliness().get("lager/*/@alive")]
    print(json.dumps({"samples": told, "layouts": layouts, "alive": alive}))
