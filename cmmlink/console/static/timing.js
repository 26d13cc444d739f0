// How fast the page is, measured all along in constant room: the time from a verdict to its drawing, and the cost of drawing.

const KEPT = 4096;

export class Timing {
  constructor() {
    this.latency = new Float32Array(KEPT); // of the newest verdict in a drawing, ms
    this.oldest = new Float32Array(KEPT); // of the oldest verdict at most: since the newest verdict of the drawing before, ms
    this.drawing = new Float32Array(KEPT); // cost of a drawing, ms
    this.batches = this.drawings = this.bytes = 0;
    this.newestMs = 0;
  }

  /**
   * Note a drawing: how long it took, and when its newest verdict was given (ms since 1970, 0 for none).
   * @param {number} tookMs
   * @param {number} newestMs
   */
  note(tookMs, newestMs) {
    this.drawing[this.drawings++ % KEPT] = tookMs;
    if (!newestMs || newestMs === this.newestMs) return;
    const nowMs = performance.timeOrigin + performance.now();
    this.oldest[this.batches % KEPT] = nowMs - (this.newestMs || newestMs);
    this.latency[this.batches++ % KEPT] = nowMs - newestMs;
    this.newestMs = newestMs;
  }

  summary() {
    const kept = (/** @type {Float32Array} */ values, /** @type {number} */ count) => [...values.slice(0, Math.min(count, KEPT))];
    const { latency, oldest, drawing, batches, drawings, bytes } = this;
    return { latency_ms: kept(latency, batches), oldest_ms: kept(oldest, batches), drawing_ms: kept(drawing, drawings), bytes };
  }
}
