// Motions of the program: positions by time, line and motion.

import { numbers } from './data.js';

/** Index of the last element not above a value in an ascending array; −1 if all are. */
export function lastUpTo(array, value) {
  let [low, high] = [0, array.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (array[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

export class Motion {
  static async read(data, machine) {
    const m = new Motion();
    m.machine = machine;
    m.n = data.n;
    m.start = data.start;
    m.byLaw = data.by_law;
    m.notFollowed = data.not_followed;
    m.limitNames = data.limit_names;
    const unknown = () => new Float32Array(data.n).fill(NaN);
    let ends, times;
    [ends, times, m.lines, m.kinds, m.laws, m.rtcp, m.limits, m.untimed, m.uncertified, m.feeds, m.inverseFeeds, m.figures] = await Promise.all([
      Promise.all(data.ends.map((array) => numbers(array))), numbers(data.times), numbers(data.lines, Uint32Array), numbers(data.kinds, Uint8Array),
      numbers(data.laws, Uint8Array), numbers(data.rtcp, Uint8Array), numbers(data.limits, Uint8Array), numbers(data.untimed, Uint8Array),
      numbers(data.uncertified, Uint8Array), numbers(data.feeds, Float32Array), numbers(data.inverse_feeds, Float32Array),
      Promise.all(data.figures.map(async (f) => ({ ...f, values: await numbers(f.values, Float32Array) }))),
    ]);
    m.feeds ??= unknown();
    m.inverseFeeds ??= unknown();
    m.ends = ends.map((values, k) => (machine.axes[k].is_rotary ? values.map((v) => (v * Math.PI) / 180) : values));
    m.times = times;
    m.endTimes = new Float64Array(data.n);
    let sum = 0;
    for (let k = 0; k < data.n; k++) m.endTimes[k] = sum += times[k];
    m.total = sum;
    m.nUntimed = data.n_untimed;
    const known = ['chip', 'surface_tilt'].map((key) => m.figures.find((f) => f.key === key)).find((f) => f && f.values.some(Number.isFinite));
    /** Whether a motion at a feed cuts along the surface, if anything of the page says so. */
    m.isCut = known ? (k) => Number.isFinite(known.values[k]) : null;
    m.isAscending = m.lines.every((line, k) => !k || m.lines[k - 1] <= line);
    return m;
  }

  /** Position at the end of a motion; −1: at the start. */
  end(k) {
    return k < 0 ? this.start.slice() : this.ends.map((values) => values[k]);
  }

  startTime(k) {
    return k > 0 ? this.endTimes[k - 1] : 0;
  }

  /** Motion and fraction at a time. */
  at(time) {
    if (!this.n) return { k: -1, t: 1 };
    const k = Math.min(lastUpTo(this.endTimes, time - 1e-12) + 1, this.n - 1);
    const span = this.times[k];
    return { k, t: span > 0 ? Math.min(Math.max((time - this.startTime(k)) / span, 0), 1) : 1 };
  }

  position(k, t) {
    if (k < 0) return this.start.slice();
    return this.machine.between(this.end(k - 1), this.end(k), this.laws[k], t);
  }

  /** Last motion of a line, or of the last line before it with one. */
  ofLine(line) {
    if (this.isAscending) return lastUpTo(this.lines, line);
    let best = -1;
    for (let k = 0; k < this.n; k++) {
      if (this.lines[k] === line) best = k;
    }
    return best;
  }

  /** Mean speed of an axis in a motion, per s. */
  axisSpeed(axis, k) {
    const before = k > 0 ? this.ends[axis][k - 1] : this.start[axis];
    return this.times[k] > 1e-6 ? (this.ends[axis][k] - before) / this.times[k] : 0;
  }

  /** Change of mean speed of an axis from the motion before, per s². */
  axisAcceleration(axis, k) {
    if (k === 0) return 0;
    const time = 0.5 * (this.times[k] + this.times[k - 1]);
    return time > 1e-6 ? (this.axisSpeed(axis, k) - this.axisSpeed(axis, k - 1)) / time : 0;
  }

  /** Largest share of any axis' largest speed in a motion. */
  axisLoad(k) {
    let load = 0;
    this.machine.axes.forEach((axis, i) => (load = Math.max(load, Math.abs(this.axisSpeed(i, k)) / axis.max_velocity)));
    return load;
  }
}
