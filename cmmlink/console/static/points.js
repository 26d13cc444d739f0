// What the page holds of a scan: per bin of station its lowest and its highest point, however many points were measured.

const HEAD_BYTES = 32;
export const STATION = 0, DEVIATION = 1, X = 2, Y = 3, NX = 4, NY = 5, VERDICT = 6;
export const CONFORM = 0, UNCERTAIN = 1, NONCONFORM = 2;

export class Points {
  constructor() {
    this.clear(0);
    this.generation = -1;
    this.newest = 0;
  }

  clear(bins) {
    this.bins = bins;
    this.held = 0;
    // sides[0] lowest, sides[1] highest: seven columns each
    this.sides = [0, 1].map(() => Array.from({ length: 7 }, () => new Float32Array(bins).fill(NaN)));
  }

  take(buffer) {
    const head = new DataView(buffer);
    const generation = head.getUint32(4, true), rows = head.getUint32(8, true), bins = head.getFloat64(24, true);
    if (generation !== this.generation || bins !== this.bins) this.clear(bins);
    this.generation = generation;
    this.newest = head.getFloat64(16, true);
    const which = new Uint32Array(buffer, HEAD_BYTES, rows);
    for (let side = 0; side < 2; side++) {
      for (let column = 0; column < 7; column++) {
        const values = new Float32Array(buffer, HEAD_BYTES + 4 * rows * (1 + side * 7 + column), rows);
        const into = this.sides[side][column];
        if (side === 0 && column === 0) for (let k = 0; k < rows; k++) if (into[which[k]] !== into[which[k]]) this.held++;
        for (let k = 0; k < rows; k++) into[which[k]] = values[k];
      }
    }
  }

  at(side, bin) {
    const c = this.sides[side];
    const deviation = c[DEVIATION][bin];
    return {
      side, bin, deviation, station: c[STATION][bin], verdict: c[VERDICT][bin],
      x: c[X][bin] + deviation * c[NX][bin], y: c[Y][bin] + deviation * c[NY][bin],
    };
  }
}

export class Nominal {
  constructor(buffer) {
    const head = new DataView(buffer);
    const rows = head.getUint32(8, true);
    this.closed = (head.getUint32(12, true) & 1) === 1;
    this.length = head.getFloat64(24, true);
    const column = (k) => new Float32Array(buffer, HEAD_BYTES + 4 * rows * k, rows);
    [this.station, this.x, this.y, this.nx, this.ny] = [0, 1, 2, 3, 4].map(column);
    this.rows = rows;
    const known = (values) => values.filter((value) => value === value);
    this.box = [Math.min(...known(this.x)), Math.min(...known(this.y)), Math.max(...known(this.x)), Math.max(...known(this.y))];
  }
}

export const kindOf = (buffer) => new DataView(buffer).getUint32(0, true);

// How much of the tolerance a deviation uses: 1 at a limit.
export function toleranceUse(deviation, zone) {
  const middle = (zone.lower_mm + zone.upper_mm) / 2;
  return Math.abs(deviation - middle) / ((zone.upper_mm - zone.lower_mm) / 2);
}

// The class that colours and marks a point: in, near, unsure, over, under.
export function classOf(deviation, verdict, zone) {
  if (verdict === NONCONFORM) return deviation > (zone.lower_mm + zone.upper_mm) / 2 ? "over" : "under";
  if (verdict === UNCERTAIN) return "unsure";
  return toleranceUse(deviation, zone) > 0.8 ? "near" : "in";
}

export const CLASSES = ["in", "near", "unsure", "over", "under"];
