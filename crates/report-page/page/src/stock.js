// The stock at any moment, from lines with the changes of each, as a surface of tops and bottoms.

import { BufferAttribute, BufferGeometry } from 'three';
import { numbers } from './data.js';
import { lastUpTo } from './motion.js';

const starts = (counts) => {
  const all = new Uint32Array(counts.length + 1);
  for (let k = 0; k < counts.length; k++) all[k + 1] = all[k] + counts[k];
  return all;
};

export class Stock {
  static async read(data) {
    if (!data) return null;
    const s = new Stock();
    Object.assign(s, { origin: data.origin, cell: data.cell, nx: data.n_lines[0], ny: data.n_lines[1] });
    const [firstCounts, changeCounts, intervalCounts] = await Promise.all(
      [data.first_counts, data.change_counts, data.interval_counts].map((a) => numbers(a, Uint32Array)),
    );
    [s.keys, s.changeKeys] = await Promise.all([numbers(data.keys, Uint32Array), numbers(data.change_keys, Uint32Array)]);
    [s.firstEnds, s.ends] = await Promise.all([numbers(data.first_ends, Float32Array), numbers(data.ends, Float32Array)]);
    s.firstStarts = starts(firstCounts);
    s.changeStarts = starts(changeCounts);
    s.intervalStarts = starts(intervalCounts);
    s.makeGeometry();
    return s;
  }

  /** Sheets: the top and the bottom of each line's material, between neighbours that have some. */
  makeGeometry() {
    const n = this.nx * this.ny;
    this.positions = new Float32Array(2 * n * 3);
    this.normals = new Float32Array(2 * n * 3);
    this.colours = new Float32Array(2 * n * 3);
    for (let j = 0; j < this.ny; j++) {
      for (let i = 0; i < this.nx; i++) {
        for (const sheet of [0, 1]) {
          const at = 3 * (sheet * n + j * this.nx + i);
          this.positions[at] = this.origin[0] + (i + 0.5) * this.cell;
          this.positions[at + 1] = this.origin[1] + (j + 0.5) * this.cell;
        }
      }
    }
    this.indices = new Uint32Array((this.nx - 1) * (this.ny - 1) * 12 + 24 * n);
    this.geometry = new BufferGeometry();
    this.geometry.setAttribute('position', new BufferAttribute(this.positions, 3));
    this.geometry.setAttribute('normal', new BufferAttribute(this.normals, 3));
    this.geometry.setAttribute('color', new BufferAttribute(this.colours, 3));
    this.geometry.setIndex(new BufferAttribute(this.indices, 1));
    this.shownKey = -2;
    this.show(-1);
  }

  /** Number of keys that are done when a number of motions is. */
  keyOf(motions) {
    return lastUpTo(this.keys, motions);
  }

  /** Shows the stock when so many motions are done; 0: as it is before the program. */
  show(motions) {
    const key = motions < 0 ? -1 : this.keyOf(motions);
    if (key === this.shownKey) return false;
    this.shownKey = key;
    const n = this.nx * this.ny;
    this.has = this.has || new Uint8Array(n);
    this.cut = this.cut || new Uint8Array(n);
    for (let line = 0; line < n; line++) {
      const [from, to] = [this.changeStarts[line], this.changeStarts[line + 1]];
      let change = -1;
      if (to > from && key >= 0) {
        let [low, high] = [from, to];
        while (low < high) {
          const middle = (low + high) >> 1;
          if (this.changeKeys[middle] <= key) low = middle + 1;
          else high = middle;
        }
        change = low - 1 >= from ? low - 1 : -1;
      }
      const [ends, first, last] = change < 0
        ? [this.firstEnds, this.firstStarts[line], this.firstStarts[line + 1]]
        : [this.ends, this.intervalStarts[change], this.intervalStarts[change + 1]];
      this.has[line] = last > first ? 1 : 0;
      this.cut[line] = change < 0 ? 0 : 1;
      if (last > first) {
        this.positions[3 * line + 2] = ends[2 * last - 1];
        this.positions[3 * (n + line) + 2] = ends[2 * first];
      }
    }
    this.connect();
    return true;
  }

  connect() {
    const { nx, ny, has, positions, normals, indices, colours, cell } = this;
    const n = nx * ny;
    let used = 0;
    const add = (...corners) => {
      for (const corner of corners) indices[used++] = corner;
    };
    const wall = (a, b) => add(a, b, n + b, a, n + b, n + a);
    for (let j = 0; j + 1 < ny; j++) {
      for (let i = 0; i + 1 < nx; i++) {
        const [a, b, c, d] = [j * nx + i, j * nx + i + 1, (j + 1) * nx + i + 1, (j + 1) * nx + i];
        const count = has[a] + has[b] + has[c] + has[d];
        if (count === 4) {
          add(a, b, c, a, c, d, n + a, n + c, n + b, n + a, n + d, n + c);
        } else if (count === 3) {
          const [p, q, r] = [a, b, c, d].filter((line) => has[line]);
          add(p, q, r, n + p, n + r, n + q);
        }
        if (count !== 4) continue;
        // Walls where no neighbouring cell goes on.
        const whole = (i2, j2) => {
          if (i2 < 0 || j2 < 0 || i2 + 1 >= nx || j2 + 1 >= ny) return false;
          const at = j2 * nx + i2;
          return has[at] && has[at + 1] && has[at + nx] && has[at + nx + 1];
        };
        if (used + 24 > indices.length) continue;
        if (!whole(i, j - 1)) wall(b, a);
        if (!whole(i, j + 1)) wall(d, c);
        if (!whole(i - 1, j)) wall(a, d);
        if (!whole(i + 1, j)) wall(c, b);
      }
    }
    for (let line = 0; line < n; line++) {
      const [i, j] = [line % nx, Math.floor(line / nx)];
      for (const sheet of [0, n]) {
        const z = (at, other) => (at >= 0 && at < n && has[at] ? positions[3 * (sheet + at) + 2] : other);
        const here = positions[3 * (sheet + line) + 2];
        const dx = (z(i + 1 < nx ? line + 1 : -1, here) - z(i > 0 ? line - 1 : -1, here)) / (2 * cell);
        const dy = (z(j + 1 < ny ? line + nx : -1, here) - z(j > 0 ? line - nx : -1, here)) / (2 * cell);
        const size = (sheet ? -1 : 1) / Math.hypot(dx, dy, 1);
        const at = 3 * (sheet + line);
        normals[at] = -dx * size;
        normals[at + 1] = -dy * size;
        normals[at + 2] = size;
        const colour = this.cut[line] ? this.cutColour : this.rawColour;
        if (colour) colours.set(colour, at);
      }
    }
    this.geometry.setDrawRange(0, used);
    this.geometry.index.needsUpdate = true;
    for (const name of ['position', 'normal', 'color']) this.geometry.attributes[name].needsUpdate = true;
    this.geometry.computeBoundingSphere();
  }

  setColours(raw, cut) {
    [this.rawColour, this.cutColour] = [raw, cut];
    this.connect();
  }
}
