// How fast the page is, measured all along in constant room: the time from a verdict to its drawing, and the cost of drawing.
// latency: of the newest verdict drawn. oldest: what the oldest verdict drawn with it took at most, which is the time since the
// newest verdict of the drawing before.

const KEPT = 4096;

export class Figures {
  constructor() {
    this.latency = new Float32Array(KEPT);
    this.oldest = new Float32Array(KEPT);
    this.drawing = new Float32Array(KEPT);
    this.batches = this.drawn = this.bytes = 0;
    this.newest = 0;
  }

  drew(tookMs, newestMs) {
    this.drawing[this.drawn++ % KEPT] = tookMs;
    if (newestMs && newestMs !== this.newest) {
      const now = performance.timeOrigin + performance.now();
      this.oldest[this.batches % KEPT] = now - (this.newest || newestMs);
      this.latency[this.batches++ % KEPT] = now - newestMs;
      this.newest = newestMs;
    }
  }

  summary() {
    const kept = (values, count) => [...values.slice(0, Math.min(count, KEPT))];
    const { latency, oldest, drawing, batches, drawn, bytes } = this;
    return { latency_ms: kept(latency, batches), oldest_ms: kept(oldest, batches), drawing_ms: kept(drawing, drawn), bytes };
  }
}
