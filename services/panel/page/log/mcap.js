// A recording as an MCAP file (specification: mcap.dev): one chunk, not packed, with index and CRCs.
//
//   magic, header, chunk { schemas, channels, messages }, message indexes, end of data,
//   schemas, channels, statistics, chunk index, footer, magic

/** @typedef {{ at: number, value: unknown }} Message `at` is in ms since 1970. */
/** @typedef {{ topic: string, schema: { title: string } & Record<string, unknown>, messages: Message[] }} Channel `schema` is a JSON Schema. */

const MAGIC = [0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a];
const HEADER = 1;
const FOOTER = 2;
const SCHEMA = 3;
const CHANNEL = 4;
const MESSAGE = 5;
const CHUNK = 6;
const MESSAGE_INDEX = 7;
const CHUNK_INDEX = 8;
const STATISTICS = 11;
const DATA_END = 15;

/**
 * The bytes of a file.
 *
 * @param {string} library the name of what writes it
 * @param {Channel[]} channels
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function mcap(library, channels) {
  const file = new Bytes().raw(MAGIC);
  file.record(HEADER, new Bytes().text("").text(library));

  const described = new Bytes();
  channels.forEach(({ topic, schema }, index) => {
    const [id, json] = [index + 1, encode(JSON.stringify(schema))];
    described.record(SCHEMA, new Bytes().u16(id).text(schema.title).text("jsonschema").u32(json.length).raw(json));
    described.record(CHANNEL, new Bytes().u16(id).u16(id).text(topic).text("json").u32(0));
  });
  const chunk = new Bytes().raw(described.done());
  /** @type {[bigint, number][][]} */
  const indexes = channels.map(() => []);
  const all = channels.flatMap(({ messages }, channel) => messages.map((message, number) => ({ channel, number, ...message })));
  all.sort((a, b) => a.at - b.at);
  for (const { channel, number, at, value } of all) {
    indexes[channel]?.push([nanoseconds(at), chunk.length]);
    const times = new Bytes().u16(channel + 1).u32(number + 1).u64(nanoseconds(at)).u64(nanoseconds(at));
    chunk.record(MESSAGE, times.raw(encode(JSON.stringify(value))));
  }
  const records = chunk.done();
  const [first, last] = [nanoseconds(all[0]?.at ?? 0), nanoseconds(all.at(-1)?.at ?? 0)];
  const chunkStart = file.length;
  file.record(CHUNK, new Bytes().u64(first).u64(last).u64(records.length).u32(crc32(records)).text("").u64(records.length).raw(records));
  const indexStart = file.length;
  const offsets = new Bytes();
  indexes.forEach((index, channel) => {
    offsets.u16(channel + 1).u64(file.length);
    const entries = index.reduce((bytes, [at, offset]) => bytes.u64(at).u64(offset), new Bytes()).done();
    file.record(MESSAGE_INDEX, new Bytes().u16(channel + 1).u32(entries.length).raw(entries));
  });
  const indexEnd = file.length;
  file.record(DATA_END, new Bytes().u32(crc32(file.done())));

  const summaryStart = file.length;
  file.raw(described.done());
  const counts = indexes.reduce((bytes, { length }, channel) => bytes.u16(channel + 1).u64(length), new Bytes()).done();
  file.record(STATISTICS, new Bytes().u64(all.length).u16(channels.length).u32(channels.length).u32(0).u32(0).u32(1)
    .u64(first).u64(last).u32(counts.length).raw(counts));
  const places = offsets.done();
  file.record(CHUNK_INDEX, new Bytes().u64(first).u64(last).u64(chunkStart).u64(indexStart - chunkStart)
    .u32(places.length).raw(places).u64(indexEnd - indexStart).text("").u64(records.length).u64(records.length));
  // The summary's CRC is of the footer's beginning, too.
  const footer = new Bytes().raw([FOOTER]).u64(20).u64(summaryStart).u64(0).done();
  const summary = new Bytes().raw(file.done().subarray(summaryStart)).raw(footer).done();
  return file.raw(footer).u32(crc32(summary)).raw(MAGIC).done();
}

/** @param {number} at */
function nanoseconds(at) {
  return BigInt(Math.round(at)) * 1_000_000n;
}

/** @param {string} text */
function encode(text) {
  return new TextEncoder().encode(text);
}

/** Bytes that are added at the end; numbers have their low byte first. */
class Bytes {
  constructor() {
    this.bytes = new Uint8Array(64);
    this.length = 0;
  }

  /** All of them so far. */
  done() {
    return this.bytes.subarray(0, this.length);
  }

  /**
   * Room at the end for so many more.
   *
   * @param {number} more
   */
  room(more) {
    if (this.length + more > this.bytes.length) {
      const larger = new Uint8Array(Math.max(2 * this.bytes.length, this.length + more));
      larger.set(this.done());
      this.bytes = larger;
    }
    this.length += more;
    return new DataView(this.bytes.buffer, this.length - more, more);
  }

  /** @param {ArrayLike<number>} bytes */
  raw(bytes) {
    this.room(bytes.length);
    this.bytes.set(bytes, this.length - bytes.length);
    return this;
  }

  /** @param {number} value */
  u16(value) {
    this.room(2).setUint16(0, value, true);
    return this;
  }

  /** @param {number} value */
  u32(value) {
    this.room(4).setUint32(0, value, true);
    return this;
  }

  /** @param {number | bigint} value */
  u64(value) {
    this.room(8).setBigUint64(0, BigInt(value), true);
    return this;
  }

  /** @param {string} value */
  text(value) {
    const bytes = encode(value);
    return this.u32(bytes.length).raw(bytes);
  }

  /**
   * @param {number} operation
   * @param {Bytes} content
   */
  record(operation, content) {
    return this.raw([operation]).u64(content.length).raw(content.done());
  }
}

const CRC = Uint32Array.from({ length: 256 }, (_, byte) => {
  let rest = byte;
  for (let bit = 0; bit < 8; bit++) rest = rest & 1 ? (rest >>> 1) ^ 0xedb88320 : rest >>> 1;
  return rest;
});

/** @param {Uint8Array} bytes */
function crc32(bytes) {
  let rest = ~0;
  for (const byte of bytes) rest = (rest >>> 8) ^ (CRC[(rest ^ byte) & 0xff] ?? 0);
  return ~rest >>> 0;
}
