// The socket to the station: code or token first, then messages both ways. It comes back by itself when the server does.

import { WRONG_TOKEN } from "./protocol.js";
import { gettext } from "./words.js";

/** @import { Answer, Command, Message } from "./protocol.js" */
/** @typedef {"connecting" | "live" | "stale" | "away" | "refused"} LinkState */
/** @typedef {Pick<Answer, "ok" | "message">} Outcome of a command */
/** @typedef {{ ok: true, given: unknown } | { ok: false, message: string }} Posted what came of a post, or of what was asked for */
/**
 * @typedef {object} Handlers
 * @property {(message: Message) => void} onMessage
 * @property {(buffer: ArrayBuffer) => void} onBinary
 * @property {(state: LinkState) => void} onLink
 */

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 3000;
const STALE_AFTER_MS = 2000;

export const OUT_OF_REACH = gettext("the station cannot be reached");

export class Link {
  /**
   * @param {string} code of a one-time address, empty where the page is loaded anew
   * @param {Handlers} handlers
   */
  constructor(code, handlers) {
    this.code = code;
    this.token = kept();
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
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => socket.send(JSON.stringify(this.code ? { once: this.code } : { token: this.token }));
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
    if (message.type === "admitted") return this.enter(message.token);
    if (message.type === "answer") this.settle(message);
    this.handlers.onMessage(message);
  }

  /** @param {number} code */
  lose(code) {
    for (const settle of this.waiting.values()) settle({ ok: false, message: OUT_OF_REACH });
    this.waiting.clear();
    if (code === WRONG_TOKEN && !(this.code && this.token)) {
      keep("");
      return this.turn("refused");
    }
    if (code === WRONG_TOKEN) this.enter(this.token); // the address was used by this very tab before it was loaded anew
    this.turn("away");
    setTimeout(() => (this.socket = this.open()), this.waitMs);
    this.waitMs = Math.min(this.waitMs * 1.5, LONGEST_WAIT_MS);
  }

  /** The address has done its work: it goes, and the token stays with this tab. @param {string} token */
  enter(token) {
    this.token = token;
    this.code = "";
    keep(token);
    history.replaceState(null, "", location.pathname + location.search);
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

  /**
   * Ask for something that the station looks up.
   * @param {string} path
   * @param {Record<string, string>} asked
   * @returns {Promise<Posted>}
   */
  async get(path, asked) {
    const headers = { Authorization: `Bearer ${this.token}` };
    try {
      const answer = await fetch(`${path}?${new URLSearchParams(asked)}`, { headers });
      return answer.ok ? { ok: true, given: await answer.json() } : { ok: false, message: await answer.text() };
    } catch {
      return { ok: false, message: OUT_OF_REACH };
    }
  }

  /**
   * Hand a file in, with answers beside it.
   * @param {string} path
   * @param {Record<string, string>} answers
   * @param {Blob} content
   * @returns {Promise<Posted>}
   */
  async post(path, answers, content) {
    const headers = { Authorization: `Bearer ${this.token}` };
    try {
      const answer = await fetch(`${path}?${new URLSearchParams(answers)}`, { method: "POST", headers, body: content });
      return answer.ok ? { ok: true, given: await answer.json() } : { ok: false, message: await answer.text() };
    } catch {
      return { ok: false, message: OUT_OF_REACH };
    }
  }

  /** @param {Answer} answer */
  settle(answer) {
    const number = answer.number ?? -1;
    this.waiting.get(number)?.(answer);
    this.waiting.delete(number);
  }
}

// The token outlives loading the page anew, in this tab alone. A browser may keep nothing; then it is gone with the page.

const KEY = "cmmlink-token";

function kept() {
  try {
    return sessionStorage.getItem(KEY) ?? "";
  } catch {
    return "";
  }
}

/** @param {string} token */
function keep(token) {
  try {
    sessionStorage.setItem(KEY, token);
  } catch {
    // the page works until it is closed
  }
}
