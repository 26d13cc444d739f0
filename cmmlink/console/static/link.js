// The socket to the station: token first, then messages both ways; comes back by itself when the server does.

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 3000;
const STALE_AFTER_MS = 2000;

export class Link {
  // told: { onState(kind, content), onBinary(buffer), onLink(state) }
  constructor(token, told) {
    this.token = token;
    this.told = told;
    this.number = 0;
    this.waiting = new Map();
    this.pause = FIRST_WAIT_MS;
    this.heardAt = 0;
    this.state = "connecting";
    this.open();
    setInterval(() => this.look(), 250);
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.openedAt = performance.now();
    socket.onopen = () => socket.send(JSON.stringify({ token: this.token }));
    socket.onmessage = (message) => this.take(message.data);
    socket.onclose = (event) => this.lost(event.code);
  }

  take(data) {
    this.heardAt = performance.now();
    if (this.state !== "live") {
      this.pause = FIRST_WAIT_MS;
      this.turn("live");
    }
    if (data instanceof ArrayBuffer) return this.told.onBinary(data);
    const message = JSON.parse(data);
    if (message.type === "answer") this.answered(message);
    this.told.onState(message.type, message);
  }

  lost(code) {
    for (const refuse of this.waiting.values()) refuse({ ok: false, message: "the station cannot be reached" });
    this.waiting.clear();
    if (code === 4401) return this.turn("refused");
    this.turn("away");
    setTimeout(() => this.open(), this.pause);
    this.pause = Math.min(this.pause * 1.5, LONGEST_WAIT_MS);
  }

  look() {
    if (this.state === "live" && performance.now() - this.heardAt > STALE_AFTER_MS) this.turn("stale");
  }

  turn(state) {
    if (state === this.state) return;
    this.state = state;
    this.told.onLink(state);
  }

  // Gives a promise of { ok, message }.
  ask(what, more = {}) {
    const number = ++this.number;
    return new Promise((resolve) => {
      if (this.socket.readyState !== WebSocket.OPEN) return resolve({ ok: false, message: "the station cannot be reached" });
      this.waiting.set(number, resolve);
      this.socket.send(JSON.stringify({ do: what, number, ...more }));
    });
  }

  answered(message) {
    const resolve = this.waiting.get(message.number);
    this.waiting.delete(message.number);
    if (resolve) resolve(message);
  }
}
