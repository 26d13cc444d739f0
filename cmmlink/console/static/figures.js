// How fast the page is, measured all along in constant room: the time from a verdict to its drawing, and the cost of drawing.

const KEPT = 4096;

export class Figures {
  constructor() {
    this.latency = new Float32Array(KEPT);
    this.drawing = new Float32Array(KEPT);
    this.batches = this.drawn = this.bytes = 0;
    this.newest = 0;
  }

  drew(tookMs, newestMs) {
    this.drawing[this.drawn++ % KEPT] = tookMs;
    if (newestMs && newestMs !== this.newest) {
      this.newest = newestMs;
      this.latency[this.batches++ % KEPT] = performance.timeOrigin + performance.now() - newestMs;
    }
  }

  summary() {
    return { latency_ms: [...this.latency.slice(0, Math.min(this.batches, KEPT))], drawing_ms: [...this.drawing.slice(0, Math.min(this.drawn, KEPT))], bytes: this.bytes };
  }
}
