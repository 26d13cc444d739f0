// The socket to the station: token first, then messages both ways. It comes back by itself when the server does.

import { WRONG_TOKEN } from "./protocol.js";

/** @import { Answer, Command, Message } from "./protocol.js" */
/** @typedef {"connecting" | "live" | "stale" | "away" | "refused"} LinkState */
/** @typedef {Pick<Answer, "ok" | "message">} Outcome of a command */
/**
 * @typedef {object} Handlers
 * @property {(message: Message) => void} onMessage
 * @property {(buffer: ArrayBuffer) => void} onBinary
 * @property {(state: LinkState) => void} onLink
 */

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 3000;
const STALE_AFTER_MS = 2000;

export const OUT_OF_REACH = "the station cannot be reached";

export class Link {
  /**
   * @param {string} token
   * @param {Handlers} handlers
   */
  constructor(token, handlers) {
    this.token = token;
    this.handlers = handlers;
    this.number = 0;
    /** @type {Map<number, (outcome: Outcome) => void>} */
    this.waiting = new Map();
    this.waitMs = FIRST_WAIT_MS;
    this.heardAt = 0;
    /** @type {LinkState} */
    this.state = "connecting";
    this.socket = this.open();
    setInterval(() => this.look(), 250);
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => socket.send(JSON.stringify({ token: this.token }));
    socket.onmessage = (message) => this.take(message.data);
    socket.onclose = (event) => this.lose(event.code);
    return socket;
  }

  /** @param {ArrayBuffer | string} data */
  take(data) {
    this.heardAt = performance.now();
    this.waitMs = FIRST_WAIT_MS;
    this.turn("live");
    if (data instanceof ArrayBuffer) return this.handlers.onBinary(data);
    /** @type {Message} */
    const message = JSON.parse(data);
    if (message.type === "answer") this.settle(message);
    this.handlers.onMessage(message);
  }

  /** @param {number} code */
  lose(code) {
    for (const settle of this.waiting.values()) settle({ ok: false, message: OUT_OF_REACH });
    this.waiting.clear();
    if (code === WRONG_TOKEN) return this.turn("refused");
    this.turn("away");
    setTimeout(() => (this.socket = this.open()), this.waitMs);
    this.waitMs = Math.min(this.waitMs * 1.5, LONGEST_WAIT_MS);
  }

  look() {
    if (this.state === "live" && performance.now() - this.heardAt > STALE_AFTER_MS) this.turn("stale");
  }

  /** @param {LinkState} state */
  turn(state) {
    if (state === this.state) return;
    this.state = state;
    this.handlers.onLink(state);
  }

  /**
   * Send a command.
   * @param {Command} command
   * @returns {Promise<Outcome>}
   */
  ask(command) {
    if (this.socket.readyState !== WebSocket.OPEN) return Promise.resolve({ ok: false, message: OUT_OF_REACH });
    const number = ++this.number;
    return new Promise((resolve) => {
      this.waiting.set(number, resolve);
      this.socket.send(JSON.stringify({ number, ...command }));
    });
  }

  /** @param {Answer} answer */
  settle(answer) {
    const number = answer.number ?? -1;
    this.waiting.get(number)?.(answer);
    this.waiting.delete(number);
  }
}
