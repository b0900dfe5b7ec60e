// How long the path from sensor to steering has taken, from the counts that a robot tells.

/** The last bucket; it has no upper end. */
const LAST = 89;

/**
 * Below which time in us a bucket's frames lie: steps of 256 ns, then four buckets for each doubling.
 *
 * @param {number} bucket
 */
function upper(bucket) {
  if (bucket < 1) return (256 * (bucket + 1)) / 1_000;
  return ((5 + ((bucket - 1) % 4)) * 2 ** (6 + Math.floor((bucket - 1) / 4))) / 1_000;
}

/**
 * The time that a part of all frames did not exceed, in us, interpolated within its bucket.
 *
 * @param {number} part from 0 to 1
 * @param {number[]} counted the number and the count of each bucket in turn
 * @param {number} longest the longest time of all, in us
 * @returns {number}
 */
export function quantile(part, counted, longest) {
  const buckets = [];
  for (let i = 0; i + 1 < counted.length; i += 2) buckets.push({ bucket: counted[i] ?? 0, count: counted[i + 1] ?? 0 });
  const frames = buckets.reduce((sum, { count }) => sum + count, 0);
  let left = Math.max(1, Math.ceil(part * frames));
  for (const { bucket, count } of buckets) {
    if (left <= count) {
      const lower = upper(bucket - 1);
      const end = bucket === LAST ? longest : upper(bucket);
      return Math.round(Math.min(longest, lower + ((end - lower) * left) / count));
    }
    left -= count;
  }
  return longest;
}

/** A percentile is a figure only if so many frames lie beyond it: it would be little more than the longest by another name. */
const BEYOND = 10;

/** The frames of many reports, by how long they took. */
export class Frames {
  constructor() {
    /** The last report. */
    this.last = "";
    /** The longest time of all, in us. */
    this.longest = 0;
    /**
     * How many each bucket holds.
     *
     * @type {number[]}
     */
    this.counts = Array(LAST + 1).fill(0);
  }

  /**
   * Adds a report.
   *
   * @param {number} longest in us
   * @param {number[]} counted the number and the count of each bucket in turn
   */
  add(longest, counted) {
    // The station tells its last report again on each connection.
    const report = [longest, ...counted].join();
    if (report === this.last) return;
    this.last = report;
    for (let i = 0; i + 1 < counted.length; i += 2) {
      const [bucket = 0, count = 0] = counted.slice(i, i + 2);
      this.counts[bucket] = (this.counts[bucket] ?? 0) + count;
    }
    if (counted.length) this.longest = Math.max(this.longest, longest);
  }

  /**
   * The time that a part of them did not exceed, in us; null if fewer than ten lie beyond it.
   *
   * @param {number} part from 0 to 1
   * @returns {number | null}
   */
  quantile(part) {
    const frames = this.counts.reduce((sum, count) => sum + count, 0);
    // A part such as 0.999 is not exact in binary.
    if (frames * (1 - part) + 1e-6 < BEYOND) return null;
    return quantile(part, this.counts.flatMap((count, bucket) => [bucket, count]), this.longest);
  }

  /**
   * The steps of a histogram: where each bucket begins, in us, and how many it holds; the last one is empty.
   *
   * @returns {{ from: number[], counts: number[] }}
   */
  steps() {
    const first = Math.max(1, this.counts.findIndex((count) => count > 0));
    const last = Math.max(first, this.counts.findLastIndex((count) => count > 0));
    const buckets = Array.from({ length: last - first + 1 }, (_, index) => first + index);
    // A logarithmic axis has no 0: what is faster than the first of them stands in it.
    const counts = buckets.map((bucket) => (this.counts[bucket] ?? 0) + (bucket === 1 ? (this.counts[0] ?? 0) : 0));
    return { from: [...buckets.map((bucket) => upper(bucket - 1)), last === LAST ? this.longest : upper(last)], counts: [...counts, 0] };
  }
}
