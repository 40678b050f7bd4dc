// Maps of feasible postures at the narrowest point of each pass.

import { h, put } from './dom.js';
import { linePlace } from './lines.js';
import { ticks } from './scales.js';
import { fixed } from './units.js';

/** Letters of cells with their colours and meaning, as in the picture of a plan. */
const KINDS = [
  ['f', [47, 158, 98], 'feasible'],
  ['g', [201, 80, 63], 'cutter gouges'],
  ['c', [217, 162, 59], 'body collides'],
  ['l', [122, 111, 176], 'axis limits'],
  ['a', [154, 163, 171], 'outside the tool-axis cone'],
];
const [W, H, LEFT, TOP, RIGHT, BOTTOM] = [420, 300, 46, 10, 12, 36];

/** The panel of the maps, one at a time. */
export class Postures {
  constructor(page, parent) {
    this.page = page;
    this.data = page.doc.postures;
    this.index = -1;
    const name = (map) => `pass ${map.pass}, place ${map.place}${page.doc.setup.operations.length > 1 ? ` of ${map.operation}` : ''}`;
    this.select = h('select', { 'aria-label': 'Pass', onchange: () => this.show(Number(this.select.value)) }, this.data.maps.map((map, k) => h('option', { value: k }, name(map))));
    const step = (label, title, by) => h('button', { title, 'aria-label': title, onclick: () => this.show(this.index + by) }, label);
    this.facts = h('p');
    this.canvas = h('canvas.posture-map', { role: 'img', width: W, height: H });
    this.legend = h('.keys');
    put(parent,
      h('h2', 'Feasible tilt and rotate where a pass has the narrowest choice'),
      h('.map-bar', step('◀', 'Pass before', -1), this.select, step('▶', 'Next pass', 1)),
      this.canvas, this.legend, this.facts,
      h('p.muted', 'Strong colours are proven for the whole cell; pale ones are tested in its middle. Line: postures that the search tries, from the smallest tilt on. Ring: the posture of the program. Narrowest of some points of the pass: that whose smallest feasible tilt is the largest. Click a mark in the scene to see its map.'));
  }

  /** Shows the marks, and the map of the current pass. */
  open() {
    if (!this.page.view.groups.narrow?.isShown) this.page.toggleGroup('narrow', true);
    if (this.index >= 0) return;
    const pass = this.page.passOf(this.page.line);
    const found = pass ? this.data.maps.findIndex((map) => map.pass === pass.pass && map.place === pass.place) : -1;
    this.show(Math.max(found, 0), false);
  }

  /** Shows a map; the tool moves to its point. */
  show(index, moves = true) {
    const { page, data } = this;
    if (!data.maps.length) return;
    this.index = Math.min(Math.max(index, 0), data.maps.length - 1);
    this.select.value = this.index;
    const map = data.maps[this.index];
    if (moves && map.motion !== null) page.seekMotion(map.motion);
    page.view.setMarks([{ at: map.tip_mm, colour: 0xcc79a7, size: 1 }]);
    const [free, blocked] = map.proven.map((share) => fixed(100 * share, 1));
    const line = map.motion === null ? null : page.motion.lines[map.motion];
    put(this.facts,
      h('b', `Tilt ${fixed(map.taken_deg[0], 3)}°, rotate ${fixed(map.taken_deg[1], 3)}°`), ` in the program. Proven feasible ${free} %, proven blocked ${blocked} % of the map. `,
      line === null ? 'No block ends at this point.' : h('button', { onclick: () => { page.seekMotion(map.motion); page.view.look('place', map.tip_mm); } }, `${linePlace(this.page.doc, line)}: look there`));
    this.draw(map);
  }

  draw(map) {
    const { canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = W * ratio;
    canvas.height = H * ratio;
    const context = canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue('--ink').trim();
    const paper = style.getPropertyValue('--paper').trim();
    context.fillStyle = paper;
    context.fillRect(0, 0, W, H);
    const [n, m] = map.n_cells;
    const [from, to] = map.rotate_deg;
    // Rotate 0 is at the bottom.
    const isDown = Math.abs(from) > Math.abs(to);
    const [width, height] = [W - LEFT - RIGHT, H - TOP - BOTTOM];
    const x = (tilt) => LEFT + ((tilt - map.tilt_deg[0]) / (map.tilt_deg[1] - map.tilt_deg[0])) * width;
    const y = (rotate) => {
      const share = (rotate - from) / (to - from);
      return TOP + (isDown ? share : 1 - share) * height;
    };
    const found = new Set();
    for (let row = 0; row < m; row++) {
      const [y0, y1] = [y(from + ((to - from) * row) / m), y(from + ((to - from) * (row + 1)) / m)].sort((a, b) => a - b).map(Math.round);
      for (let column = 0; column < n; column++) {
        const letter = map.cells[row * n + column];
        const [name, rgb] = KINDS.find(([known]) => known === letter.toLowerCase()) || KINDS.at(-1);
        found.add(name);
        const [x0, x1] = [LEFT + (column * width) / n, LEFT + ((column + 1) * width) / n].map(Math.round);
        const isProven = letter !== letter.toLowerCase();
        context.fillStyle = `rgb(${rgb.map((c) => (isProven ? c : Math.round(c + (255 - c) * 0.5))).join(' ')})`;
        context.fillRect(x0, y0, x1 - x0, y1 - y0);
      }
    }
    const line = (width2, colour) => {
      context.strokeStyle = colour;
      context.lineWidth = width2;
      context.beginPath();
      this.data.curves_deg[map.curve].forEach(([tilt, rotate], k) => (k ? context.lineTo(x(tilt), y(rotate)) : context.moveTo(x(tilt), y(rotate))));
      context.stroke();
    };
    line(4, '#ffffff');
    line(1.8, '#10222e');
    context.beginPath();
    context.arc(x(map.taken_deg[0]), y(map.taken_deg[1]), 7, 0, 2 * Math.PI);
    context.lineWidth = 2.4;
    context.fillStyle = '#ffffff';
    context.fill();
    context.strokeStyle = '#10222e';
    context.stroke();
    context.strokeStyle = ink;
    context.lineWidth = 1;
    context.strokeRect(LEFT - 0.5, TOP - 0.5, width + 1, height + 1);
    context.fillStyle = ink;
    context.font = '12px system-ui, sans-serif';
    context.textAlign = 'center';
    for (const tick of ticks(...map.tilt_deg, 6)) context.fillText(`${tick}°`, x(tick), H - BOTTOM + 16);
    context.fillText('tilt', LEFT + width / 2, H - 4);
    context.textAlign = 'right';
    for (const tick of ticks(from, to, 5)) context.fillText(`${fixed(tick, 0)}°`, LEFT - 5, y(tick) + 4);
    context.save();
    context.translate(12, TOP + height / 2);
    context.rotate(-Math.PI / 2);
    context.textAlign = 'center';
    context.fillText('rotate', 0, 0);
    context.restore();
    canvas.setAttribute('aria-label', `map of pass ${map.pass}, place ${map.place}: ${fixed(100 * map.proven[0], 1)} % proven feasible`);
    put(this.legend, KINDS.filter(([name]) => found.has(name)).map(([, rgb, text]) => h('span', h('i', { style: { background: `rgb(${rgb.join(' ')})` } }), text)));
  }
}
