// The stock at any moment, from lines with the changes of each, as a surface of tops, bottoms and walls of all pieces.

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

  makeGeometry() {
    const n = this.nx * this.ny;
    // Of each line: number of its intervals, the vertices of the first one, whether it has been cut.
    this.counts = new Uint8Array(n);
    this.first = new Uint32Array(n);
    this.cut = new Uint8Array(n);
    this.vertices = 0;
    this.used = 0;
    this.geometry = new BufferGeometry();
    this.reserve(2 * n, 12 * n);
    this.shownKey = -2;
  }

  /** Makes room for so many vertices and corners of triangles. */
  reserve(vertices, corners) {
    if (!this.positions || this.positions.length < 3 * vertices) {
      const size = 3 * Math.ceil(1.3 * vertices);
      for (const [key, name] of [['positions', 'position'], ['normals', 'normal'], ['colours', 'color']]) {
        const all = new Float32Array(size);
        if (this[key]) all.set(this[key]);
        this[key] = all;
        this.geometry.setAttribute(name, new BufferAttribute(all, 3));
      }
    }
    if (!this.indices || this.indices.length < corners) {
      const all = new Uint32Array(Math.ceil(1.3 * corners));
      if (this.indices) all.set(this.indices);
      this.indices = all;
      this.geometry.setIndex(new BufferAttribute(all, 1));
    }
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
    this.vertices = 0;
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
      this.counts[line] = last - first;
      this.first[line] = this.vertices;
      this.cut[line] = change < 0 ? 0 : 1;
      for (let k = first; k < last; k++) {
        // Bottom, then top.
        this.vertex(line, ends[2 * k]);
        this.vertex(line, ends[2 * k + 1]);
      }
    }
    this.onLines = this.vertices;
    this.connect();
    return true;
  }

  /** Adds a vertex on a line, or beside it by shares of a cell. */
  vertex(line, z, dx = 0, dy = 0) {
    if (3 * (this.vertices + 1) > this.positions.length) this.reserve(this.vertices + 1, 0);
    const at = 3 * this.vertices;
    this.positions[at] = this.origin[0] + ((line % this.nx) + 0.5 + dx) * this.cell;
    this.positions[at + 1] = this.origin[1] + (Math.floor(line / this.nx) + 0.5 + dy) * this.cell;
    this.positions[at + 2] = z;
    return this.vertices++;
  }

  add(...corners) {
    if (this.used + corners.length > this.indices.length) this.reserve(0, this.used + corners.length);
    for (const corner of corners) this.indices[this.used++] = corner;
  }

  /** Material of a line as one piece: lowest vertex and highest one. */
  lowest(line) {
    return this.first[line];
  }

  highest(line) {
    return this.first[line] + 2 * this.counts[line] - 1;
  }

  /** Tops and bottoms between neighbouring lines that have material, and walls where it ends. */
  connect() {
    const { nx, ny, counts } = this;
    this.vertices = this.onLines;
    this.used = 0;
    const several = counts.some((count) => count > 1);
    const hasSeveral = (i, j) => {
      for (let y = Math.max(j - 1, 0); y <= Math.min(j + 2, ny - 1); y++) {
        for (let x = Math.max(i - 1, 0); x <= Math.min(i + 2, nx - 1); x++) if (counts[y * nx + x] > 1) return true;
      }
      return false;
    };
    for (let j = 0; j + 1 < ny; j++) {
      for (let i = 0; i + 1 < nx; i++) {
        if (several && hasSeveral(i, j)) this.cellOfPieces(i, j);
        else this.cellOfOne(i, j);
      }
    }
    this.shade();
    this.geometry.boundingSphere = null;
    this.geometry.setDrawRange(0, this.used);
    this.geometry.index.needsUpdate = true;
    for (const name of ['position', 'normal', 'color']) this.geometry.attributes[name].needsUpdate = true;
  }

  /** Lines at the corners of a cell, around it. */
  corners(i, j) {
    const a = j * this.nx + i;
    return [a, a + 1, a + this.nx + 1, a + this.nx];
  }

  wall(a, b, [low, high]) {
    this.add(high(a), high(b), low(b), high(a), low(b), low(a));
  }

  cellOfOne(i, j) {
    const { nx, ny, counts } = this;
    const corners = this.corners(i, j);
    const [low, high] = [(line) => this.first[line], (line) => this.first[line] + 1];
    const shown = corners.filter((line) => counts[line]);
    if (shown.length < 3) return;
    const [p, q, r, s] = shown;
    this.add(high(p), high(q), high(r), low(p), low(r), low(q));
    if (shown.length === 3) return;
    this.add(high(p), high(r), high(s), low(p), low(s), low(r));
    // Walls where no neighbouring cell goes on.
    const whole = (i2, j2) => i2 >= 0 && j2 >= 0 && i2 + 1 < nx && j2 + 1 < ny && this.corners(i2, j2).every((line) => counts[line]);
    const [a, b, c, d] = corners;
    if (!whole(i, j - 1)) this.wall(b, a, [low, high]);
    if (!whole(i, j + 1)) this.wall(d, c, [low, high]);
    if (!whole(i - 1, j)) this.wall(a, d, [low, high]);
    if (!whole(i + 1, j)) this.wall(c, b, [low, high]);
  }

  /** Pieces of material in a cell: intervals of its lines that overlap, as lists by corner. */
  pieces(lines) {
    const all = [];
    lines.forEach((line, corner) => {
      for (let k = 0; k < this.counts[line]; k++) {
        const vertex = this.first[line] + 2 * k;
        all.push({ corner, vertex, low: this.positions[3 * vertex + 2], high: this.positions[3 * vertex + 5] });
      }
    });
    all.sort((p, q) => p.low - q.low);
    const pieces = [];
    let top = -Infinity;
    for (const interval of all) {
      if (interval.low >= top) pieces.push([[], [], [], []]);
      pieces.at(-1)[interval.corner].push(interval);
      top = Math.max(top, interval.high);
    }
    return pieces;
  }

  /** A cell near lines with several intervals: each piece by itself, gaps of a line as steps beside it. */
  cellOfPieces(i, j) {
    const { nx, ny } = this;
    const lines = this.corners(i, j);
    for (const piece of this.pieces(lines)) {
      const shown = [0, 1, 2, 3].filter((corner) => piece[corner].length);
      if (shown.length < 3) continue;
      const low = (corner) => piece[corner][0].vertex;
      const high = (corner) => piece[corner].at(-1).vertex + 1;
      const [p, q, r, s] = shown;
      this.add(high(p), high(q), high(r), low(p), low(r), low(q));
      if (shown.length === 4) {
        this.add(high(p), high(r), high(s), low(p), low(s), low(r));
        const goesOn = (i2, j2, here) => {
          if (i2 < 0 || j2 < 0 || i2 + 1 >= nx || j2 + 1 >= ny) return false;
          const beside = this.pieces(this.corners(i2, j2)).filter((other) => other.every((intervals) => intervals.length));
          return beside.some((other) => other.flat().some(({ vertex }) => vertex === low(here)));
        };
        for (const [from, to, i2, j2] of [[1, 0, i, j - 1], [3, 2, i, j + 1], [0, 3, i - 1, j], [2, 1, i + 1, j]]) {
          if (!goesOn(i2, j2, from) || !goesOn(i2, j2, to)) this.wall(from, to, [low, high]);
        }
      }
      for (const corner of shown) {
        for (let k = 0; k + 1 < piece[corner].length; k++) this.gap(lines[corner], corner, piece[corner][k].high, piece[corner][k + 1].low);
      }
    }
  }

  /** A gap in a line within material: floor, ceiling and sides of the quarter of the cell beside it. */
  gap(line, corner, floor, ceiling) {
    const [dx, dy] = [[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]][corner];
    const square = (z) => [this.vertex(line, z), this.vertex(line, z, dx, 0), this.vertex(line, z, dx, dy), this.vertex(line, z, 0, dy)];
    const quad = (a, b, c, d) => this.add(a, b, c, a, c, d);
    const [f, c] = [square(floor), square(ceiling)];
    quad(...f);
    quad(...c);
    quad(f[1], f[2], c[2], c[1]);
    quad(f[2], f[3], c[3], c[2]);
  }

  /** Normals from the slopes between lines, and colours. */
  shade() {
    const { nx, ny, counts, positions, normals, colours, cell } = this;
    const n = nx * ny;
    for (let line = 0; line < n; line++) {
      if (!counts[line]) continue;
      const [i, j] = [line % nx, Math.floor(line / nx)];
      const colour = this.cut[line] ? this.cutColour : this.rawColour;
      for (let vertex = this.lowest(line); vertex <= this.highest(line); vertex++) {
        const isTop = vertex === this.highest(line);
        const isOuter = isTop || vertex === this.lowest(line);
        const here = positions[3 * vertex + 2];
        const z = (at) => (at >= 0 && counts[at] && isOuter ? positions[3 * (isTop ? this.highest(at) : this.lowest(at)) + 2] : here);
        const dx = (z(i + 1 < nx ? line + 1 : -1) - z(i > 0 ? line - 1 : -1)) / (2 * cell);
        const dy = (z(j + 1 < ny ? line + nx : -1) - z(j > 0 ? line - nx : -1)) / (2 * cell);
        const size = ((vertex - this.first[line]) % 2 ? 1 : -1) / Math.hypot(dx, dy, 1);
        normals[3 * vertex] = -dx * size;
        normals[3 * vertex + 1] = -dy * size;
        normals[3 * vertex + 2] = size;
        if (colour) colours.set(colour, 3 * vertex);
      }
    }
    for (let vertex = this.onLines; vertex < this.vertices; vertex++) {
      normals.set([0, 0, 1], 3 * vertex);
      if (this.cutColour) colours.set(this.cutColour, 3 * vertex);
    }
  }

  setColours(raw, cut) {
    [this.rawColour, this.cutColour] = [raw, cut];
    if (this.shownKey === -2) this.show(-1);
    else this.connect();
  }
}
