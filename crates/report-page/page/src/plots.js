// Plots over time on canvases: axes against their limits, and figures of motions.

import { ticks } from './scales.js';

const PAD = { left: 132, right: 10, top: 5, bottom: 3 };

/**
 * Rows of plots with one cursor. A row has `label`, `unit`, `value(k)` of a motion, `atEnds` where the value is
 * that at the end of the motion, and `limits`, lines across it.
 */
export class Plots {
  constructor(parent, motion, onseek) {
    this.parent = parent;
    this.motion = motion;
    this.onseek = onseek;
    this.canvas = document.createElement('canvas');
    this.cursor = document.createElement('canvas');
    this.cursor.className = 'cursor';
    parent.append(this.canvas, this.cursor);
    this.rows = [];
    this.range = [0, motion.total || 1];
    this.time = 0;
    new ResizeObserver(() => this.draw()).observe(parent);
    const seek = (event) => {
      const box = this.cursor.getBoundingClientRect();
      const share = (event.clientX - box.left - PAD.left) / (box.width - PAD.left - PAD.right);
      this.onseek(this.range[0] + Math.min(Math.max(share, 0), 1) * (this.range[1] - this.range[0]));
    };
    this.cursor.addEventListener('pointerdown', (event) => {
      this.cursor.setPointerCapture(event.pointerId);
      seek(event);
    });
    this.cursor.addEventListener('pointermove', (event) => event.buttons && seek(event));
    this.cursor.addEventListener('wheel', (event) => {
      event.preventDefault();
      const box = this.cursor.getBoundingClientRect();
      const share = Math.min(Math.max((event.clientX - box.left - PAD.left) / (box.width - PAD.left - PAD.right), 0), 1);
      this.zoom(event.deltaY > 0 ? 1.4 : 1 / 1.4, share);
    }, { passive: false });
  }

  zoom(factor, share = 0.5) {
    const total = this.motion.total || 1;
    const [low, high] = this.range;
    const at = low + share * (high - low);
    const span = Math.min(Math.max((high - low) * factor, 0.5), total);
    const from = Math.min(Math.max(at - share * span, 0), total - span);
    this.range = [from, from + span];
    this.draw();
  }

  setRows(rows) {
    this.rows = rows;
    this.draw();
  }

  /** Moves the cursor, and the range with it. */
  setTime(time) {
    this.time = time;
    const [low, high] = this.range;
    if (time < low || time > high) {
      const total = this.motion.total || 1;
      const span = high - low;
      const from = Math.min(Math.max(time - 0.2 * span, 0), total - span);
      this.range = [from, from + span];
      this.draw();
    } else {
      this.drawCursor();
    }
  }

  fit(canvas) {
    const ratio = Math.min(window.devicePixelRatio, 2);
    const { clientWidth: width, clientHeight: height } = this.parent;
    canvas.width = Math.max(1, Math.round(width * ratio));
    canvas.height = Math.max(1, Math.round(height * ratio));
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return { context, width, height };
  }

  draw() {
    if (!this.parent.clientHeight) return;
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const { context, width, height } = this.fit(this.canvas);
    const n = Math.max(this.rows.length, 1);
    const rowHeight = height / n;
    const plotWidth = Math.max(width - PAD.left - PAD.right, 1);
    context.font = '11px system-ui, sans-serif';
    this.rows.forEach((row, r) => {
      const top = r * rowHeight + PAD.top;
      const bottom = (r + 1) * rowHeight - PAD.bottom;
      const columns = this.columns(row, Math.round(plotWidth));
      let [low, high] = [Infinity, -Infinity];
      for (let x = 0; x < columns.low.length; x++) {
        if (columns.low[x] < low) low = columns.low[x];
        if (columns.high[x] > high) high = columns.high[x];
      }
      const limits = (row.limits || []).filter((l) => Number.isFinite(l));
      if (row.showLimits) for (const limit of limits) [low, high] = [Math.min(low, limit), Math.max(high, limit)];
      if (!(low <= high)) [low, high] = [0, 1];
      const margin = 0.08 * (high - low || Math.abs(high) || 1);
      [low, high] = [low - margin, high + margin];
      const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
      context.strokeStyle = colour('--line');
      context.lineWidth = 1;
      context.strokeRect(PAD.left + 0.5, Math.round(top) + 0.5, plotWidth, Math.round(bottom - top));
      context.fillStyle = colour('--muted');
      context.textAlign = 'right';
      context.textBaseline = 'middle';
      const decimals = high - low < 5 ? (high - low < 0.5 ? 2 : 1) : 0;
      for (const tick of ticks(low, high, Math.max(1, Math.floor((bottom - top) / 22)))) {
        context.fillText(tick.toFixed(decimals), PAD.left - 5, y(tick));
        context.strokeStyle = colour('--faint');
        context.beginPath();
        context.moveTo(PAD.left, Math.round(y(tick)) + 0.5);
        context.lineTo(PAD.left + plotWidth, Math.round(y(tick)) + 0.5);
        context.stroke();
      }
      context.setLineDash([4, 3]);
      context.strokeStyle = colour('--bad');
      for (const limit of limits.filter((l) => l > low && l < high)) {
        context.beginPath();
        context.moveTo(PAD.left, y(limit));
        context.lineTo(PAD.left + plotWidth, y(limit));
        context.stroke();
      }
      context.setLineDash([]);
      context.strokeStyle = colour('--accent');
      context.lineWidth = 1.25;
      context.beginPath();
      let isDown = false;
      for (let x = 0; x < columns.low.length; x++) {
        if (!(columns.low[x] <= columns.high[x])) {
          isDown = false;
          continue;
        }
        const [a, b] = [y(columns.high[x]), y(columns.low[x])];
        if (isDown) context.lineTo(PAD.left + x, a);
        else context.moveTo(PAD.left + x, a);
        if (b - a > 0.5) context.lineTo(PAD.left + x, b);
        isDown = true;
      }
      context.stroke();
      context.textAlign = 'left';
      context.fillStyle = colour('--ink');
      context.font = '600 11px system-ui, sans-serif';
      context.fillText(row.label, 6, top + 8);
      // In low rows the unit is beside the name.
      const [x, below] = rowHeight < 34 ? [12 + context.measureText(row.label).width, 8] : [6, 21];
      context.font = '11px system-ui, sans-serif';
      context.fillStyle = colour('--muted');
      context.fillText(row.unit, x, top + below);
    });
    this.drawCursor();
  }

  /** Least and greatest value in each column of pixels. */
  columns(row, n) {
    const { motion } = this;
    const low = new Float64Array(n).fill(NaN);
    const high = new Float64Array(n).fill(NaN);
    if (!motion.n) return { low, high };
    const [from, to] = this.range;
    const perPixel = (to - from) / n;
    const first = motion.at(from).k;
    const put = (x, value) => {
      if (x < 0 || x >= n || !Number.isFinite(value)) return;
      if (!(low[x] <= value)) low[x] = value;
      if (!(high[x] >= value)) high[x] = value;
    };
    for (let k = first; k < motion.n; k++) {
      const [start, end] = [motion.startTime(k), motion.endTimes[k]];
      if (start > to) break;
      const value = row.value(k);
      const a = Math.max(0, Math.floor((start - from) / perPixel));
      const b = Math.min(n - 1, Math.floor((end - from) / perPixel));
      if (row.atEnds) {
        const before = row.value(k - 1);
        for (let x = a; x <= b; x++) {
          const share = end > start ? Math.min(Math.max((from + (x + 0.5) * perPixel - start) / (end - start), 0), 1) : 1;
          put(x, before + (value - before) * share);
        }
      } else {
        for (let x = a; x <= b; x++) put(x, value);
      }
    }
    return { low, high };
  }

  drawCursor() {
    if (!this.parent.clientHeight) return;
    const { context, width, height } = this.fit(this.cursor);
    const [low, high] = this.range;
    const x = PAD.left + ((this.time - low) / (high - low || 1)) * (width - PAD.left - PAD.right);
    context.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue('--cursor').trim();
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x, height);
    context.stroke();
  }
}
