// A recording, read back by the layout that the format's specification gives.

import assert from "node:assert/strict";
import { test } from "node:test";
import { crc32 } from "node:zlib";
import { mcap } from "../page/log/mcap.js";

const text = (bytes) => new TextDecoder().decode(bytes);

/** Reads a record's content from the front. */
class Reader {
  constructor(bytes) {
    Object.assign(this, { bytes, at: 0, view: new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength) });
  }
  take(length) {
    this.at += length;
    assert.ok(this.at <= this.bytes.length, "the record is too short");
    return this.bytes.subarray(this.at - length, this.at);
  }
  u16 = () => (this.take(2), this.view.getUint16(this.at - 2, true));
  u32 = () => (this.take(4), this.view.getUint32(this.at - 4, true));
  u64 = () => (this.take(8), Number(this.view.getBigUint64(this.at - 8, true)));
  text = () => text(this.take(this.u32()));
}

/** The records of a stretch of a file: operation, place and content. */
function records(bytes, from = 0, to = bytes.length) {
  const all = [];
  for (let at = from; at < to; ) {
    const length = new Reader(bytes.subarray(at + 1)).u64();
    all.push({ operation: bytes[at], at, content: new Reader(bytes.subarray(at + 9, at + 9 + length)) });
    at += 9 + length;
  }
  return all;
}

const CHANNELS = [
  { topic: "state", schema: { title: "State", type: "object" }, messages: [{ at: 1_000, value: { x: 1 } }, { at: 3_000, value: { x: 2 } }] },
  { topic: "events", schema: { title: "Event", type: "object" }, messages: [{ at: 2_000, value: { words: ["å", "\n"] } }] },
  { topic: "empty", schema: { title: "Empty", type: "object" }, messages: [] },
];

test("a recording has every message once, in the order of time, under its topic", () => {
  const file = mcap("a test", CHANNELS);
  assert.deepEqual([...file.subarray(0, 8)], [...file.subarray(-8)]);
  assert.equal(text(file.subarray(1, 5)), "MCAP");
  const all = records(file, 8, file.length - 8);
  const [chunk] = all.filter(({ operation }) => operation === 6);
  const [first, last, size, crc] = [chunk.content.u64(), chunk.content.u64(), chunk.content.u64(), chunk.content.u32()];
  assert.deepEqual([first, last], [1_000e6, 3_000e6]);
  assert.equal(chunk.content.text(), "", "it is not packed");
  const inside = chunk.content.take(chunk.content.u64());
  assert.equal(inside.length, size);
  assert.equal(crc32(inside), crc);
  const topics = new Map();
  const messages = [];
  for (const { operation, content } of records(inside)) {
    if (operation === 4) topics.set(content.u16(), (content.u16(), content.text()));
    if (operation !== 5) continue;
    const [topic, , at] = [topics.get(content.u16()), content.u32(), content.u64(), content.u64()];
    messages.push([topic, at / 1e6, JSON.parse(text(content.bytes.subarray(content.at)))]);
  }
  assert.deepEqual([...topics.values()], ["state", "events", "empty"]);
  assert.deepEqual(messages, [["state", 1_000, { x: 1 }], ["events", 2_000, { words: ["å", "\n"] }], ["state", 3_000, { x: 2 }]]);
});

test("the index leads to each message", () => {
  const file = mcap("a test", CHANNELS);
  const all = records(file, 8, file.length - 8);
  const [{ content: footer }] = all.filter(({ operation }) => operation === 2);
  const summary = footer.u64();
  const [{ content: index }] = all.filter(({ operation, at }) => operation === 8 && at >= summary);
  const [first, last, chunkStart] = [index.u64(), index.u64(), index.u64()];
  assert.deepEqual([first, last], [1_000e6, 3_000e6]);
  const chunk = all.find(({ at }) => at === chunkStart).content;
  [8, 8, 8, 4].forEach((bytes) => chunk.take(bytes));
  chunk.text();
  const inside = chunk.take(chunk.u64());
  const found = [];
  for (const { content } of all.filter(({ operation }) => operation === 7)) {
    const channel = content.u16();
    const entries = new Reader(content.take(content.u32()));
    while (entries.at < entries.bytes.length) {
      const [at, offset] = [entries.u64(), entries.u64()];
      const [message] = records(inside, offset, offset + 1);
      assert.equal(message.operation, 5);
      assert.equal(message.content.u16(), channel);
      message.content.u32();
      assert.equal(message.content.u64(), at);
      found.push(at / 1e6);
    }
  }
  assert.deepEqual(found, [1_000, 3_000, 2_000]);
});

test("a recording of nothing is a file all the same", () => {
  const file = mcap("a test", []);
  assert.equal(records(file, 8, file.length - 8).at(-1).operation, 2);
});
