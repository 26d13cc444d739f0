// From where the page looks at a part: turned, moved and enlarged, with lines that stay parallel.

/** @typedef {readonly [x: number, y: number, z: number]} Spot a place or a direction in space, mm */
/** @typedef {{ low: Spot, high: Spot }} Box */

const ROOM = 0.92; // of the sheet that the whole part may take
const CLOSEST = 200; // most that the view enlarges the whole
const FIRST = /** @type {const} */ ([1, -1, 1]); // the corner that the part is first seen from, as in the report
const LEAST = 0.3; // of that direction along any axis, so that no face is only seen from the side
const UPRIGHT = 0.95; // cosine from which on z does not show which way is up

export class Turn {
  constructor() {
    /** Unit directions to the right, up and towards the viewer. @type {[Spot, Spot, Spot]} */
    this.axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    /** @type {Box} */
    this.box = { low: [0, 0, 0], high: [1, 1, 1] };
    this.width = this.height = 1;
    this.scale = 1; // pixels per mm
    this.x = this.y = 0; // where the middle of the part is seen, pixels to the right of and below that of the sheet
  }

  /** The middle of the part. @returns {Spot} */
  get centre() {
    const { low, high } = this.box;
    return [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2];
  }

  /** Half of the longest line in the box of the part. */
  get radius() {
    const { low, high } = this.box;
    return Math.max(Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / 2, 1e-6);
  }

  /**
   * Look at a part that lies in a box.
   * @param {Box} box
   */
  behold(box) {
    this.box = box;
    const extent = box.high.map((value, k) => Math.max(value - box.low[k], 0)), longest = Math.max(...extent, 1e-9);
    const straight = extent.map((value) => 1 / Math.sqrt(Math.max(value, 1e-3 * longest))), most = Math.max(...straight);
    const [x, y, z] = straight.map((value, k) => FIRST[k] * Math.max(value, LEAST * most));
    this.lookFrom([x, y, z]);
    this.fit();
  }

  /**
   * See the part from a direction, with z upright where that can be.
   * @param {Spot} direction
   */
  lookFrom(direction) {
    const towards = unit(direction);
    const upright = /** @type {Spot} */ (Math.abs(towards[2]) < UPRIGHT ? [0, 0, 1] : [0, 1, 0]);
    const right = unit(cross(upright, towards));
    this.axes = [right, cross(towards, right), towards];
  }

  /**
   * See a place from straight above, in the middle of the sheet, this much closer than the whole part.
   * @param {Spot} place
   * @param {Spot} normal
   * @param {number} closer
   */
  goTo(place, normal, closer) {
    this.lookFrom(normal);
    this.scale = this.whole * closer;
    this.x = this.y = 0;
    const [x, y] = this.seen(place);
    this.x = this.width / 2 - x;
    this.y = this.height / 2 - y;
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  resize(width, height) {
    const share = this.scale / this.whole;
    [this.width, this.height] = [Math.max(width, 1), Math.max(height, 1)];
    this.scale = this.whole * share;
  }

  /** The scale at which the whole part fits the sheet, however it is seen now. */
  get whole() {
    const { low, high } = this.box, [right, up] = this.axes;
    const span = (/** @type {Spot} */ axis) => axis.reduce((sum, value, k) => sum + Math.abs(value) * (high[k] - low[k]), 0);
    return ROOM * Math.min(this.width / Math.max(span(right), 1e-6), this.height / Math.max(span(up), 1e-6));
  }

  fit() {
    this.scale = this.whole;
    this.x = this.y = 0;
  }

  /**
   * Turn the part as if its front were pushed, by angles in rad.
   * @param {number} right
   * @param {number} down
   */
  push(right, down) {
    const [a, b, c] = this.axes;
    const front = sum(c, Math.cos(right), a, -Math.sin(right)); // about what is upright on the sheet
    const towards = unit(sum(front, Math.cos(down), b, Math.sin(down))); // about what is level on it
    const level = unit(cross(sum(b, Math.cos(down), front, -Math.sin(down)), towards));
    this.axes = [level, cross(towards, level), towards];
  }

  /**
   * @param {number} right pixels
   * @param {number} down pixels
   */
  move(right, down) {
    this.x += right;
    this.y += down;
  }

  /**
   * Enlarge what is seen at a place of the sheet.
   * @param {number} factor
   * @param {number} x
   * @param {number} y
   */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const { whole } = this, scale = Math.min(Math.max(this.scale * factor, whole / 4), whole * CLOSEST), share = scale / this.scale;
    const [fromX, fromY] = [x - this.width / 2, y - this.height / 2];
    [this.x, this.y] = [fromX - (fromX - this.x) * share, fromY - (fromY - this.y) * share];
    this.scale = scale;
  }

  /**
   * Where a place in space is seen: pixels from the left and from above, and mm in front of the middle of the part.
   * @param {Spot} place
   * @returns {[x: number, y: number, nearness: number]}
   */
  seen(place) {
    const [right, up, towards] = this.axes, from = sum(place, 1, this.centre, -1);
    return [
      this.width / 2 + this.x + dot(from, right) * this.scale, this.height / 2 + this.y - dot(from, up) * this.scale, dot(from, towards),
    ];
  }
}

/**
 * @param {Spot} a
 * @param {number} share
 * @param {Spot} b
 * @param {number} other
 * @returns {Spot}
 */
const sum = (a, share, b, other) => [a[0] * share + b[0] * other, a[1] * share + b[1] * other, a[2] * share + b[2] * other];

/**
 * @param {Spot} a
 * @param {Spot} b
 */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * @param {Spot} a
 * @param {Spot} b
 * @returns {Spot}
 */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/**
 * @param {Spot} a
 * @returns {Spot}
 */
function unit(a) {
  const length = Math.hypot(...a) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}
