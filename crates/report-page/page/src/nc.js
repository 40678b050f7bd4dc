// Text of the program as a list of which the visible lines alone are elements.

import { h } from './dom.js';
import { writtenPlace } from './lines.js';

const ROW = 18;
/** Height beyond which browsers lay out no element, px. */
const TALLEST = 15e6;

export class ProgramList {
  /** `written` says where the lines are written: their numbers there are shown. */
  constructor(parent, bytes, marks, onpick, written) {
    this.parent = parent;
    this.bytes = bytes;
    this.marks = marks;
    this.written = written;
    this.decoder = new TextDecoder();
    this.starts = [0];
    for (let k = 0; k < bytes.length; k++) if (bytes[k] === 10) this.starts.push(k + 1);
    this.n = this.starts.length - (this.starts.at(-1) === bytes.length ? 1 : 0);
    this.line = 0;
    this.scale = Math.max(1, (this.n * ROW) / TALLEST);
    this.space = h('.nc-space', { style: { height: `${(this.n * ROW) / this.scale}px` } });
    this.rows = h('.nc-rows');
    this.space.append(this.rows);
    parent.append(this.space);
    parent.tabIndex = 0;
    parent.setAttribute('role', 'listbox');
    parent.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const page = Math.max(1, Math.floor(parent.clientHeight / ROW) - 2);
      const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
      const step = steps[event.key];
      if (step === undefined) return;
      event.preventDefault();
      onpick(Math.min(Math.max(this.line + step, 1), this.n));
    });
    parent.addEventListener('scroll', () => this.draw());
    new ResizeObserver(() => this.draw()).observe(parent);
    this.rows.addEventListener('click', (event) => {
      const row = event.target.closest('[data-line]');
      if (row) onpick(Number(row.dataset.line));
    });
  }

  /** Number of a line as it is written, with its file where there are several. */
  number(line) {
    const place = writtenPlace(this.written, line);
    return place ? `${place.file} ${place.line}` : `${line}`;
  }

  /** Line of the text for a number of the program's own file: the last one up to it that runs. */
  lineOf(number) {
    const within = (line) => Math.min(Math.max(line, 1), this.n);
    if (!this.written || !this.written.length) return within(number);
    const own = this.written.filter((run) => run.file === this.written[0].file && run.line <= number);
    const run = own.at(-1) ?? this.written[0];
    const next = this.written[this.written.indexOf(run) + 1];
    return within(Math.min(run.first_line + number - run.line, next ? next.first_line - 1 : this.n));
  }

  /** Text of a line, from 1. */
  text(line) {
    const end = line < this.starts.length ? this.starts[line] - 1 : this.bytes.length;
    return this.decoder.decode(this.bytes.subarray(this.starts[line - 1], end)).replace(/\r$/, '');
  }

  /** Marks the current line and scrolls to it. */
  show(line) {
    if (line === this.line) return;
    this.line = line;
    const top = ((line - 1) * ROW) / this.scale;
    const { scrollTop, clientHeight } = this.parent;
    if (top < scrollTop + 2 * ROW || top > scrollTop + clientHeight - 4 * ROW) {
      this.parent.scrollTop = Math.max(0, top - 0.4 * clientHeight);
    }
    this.draw();
  }

  draw() {
    const { scrollTop, clientHeight } = this.parent;
    if (!clientHeight) return;
    const first = Math.max(1, Math.floor((scrollTop * this.scale) / ROW) - 4);
    const last = Math.min(this.n, first + Math.ceil(clientHeight / ROW) + 10);
    this.rows.style.transform = `translateY(${this.scale === 1 ? (first - 1) * ROW : scrollTop}px)`;
    const rows = [];
    for (let line = first; line <= last; line++) {
      const mark = this.marks.get(line);
      rows.push(h('.nc-row', {
        'data-line': line, id: `nc-line-${line}`, role: 'option', 'aria-selected': line === this.line ? 'true' : 'false', class: `nc-row${line === this.line ? ' now' : ''}${mark ? ` ${mark.kind}` : ''}`, title: mark ? mark.title : null,
      }, h('span.nc-number', this.number(line)), h('span.nc-text', this.text(line))));
    }
    this.rows.replaceChildren(...rows);
    if (this.line >= first && this.line <= last) this.parent.setAttribute('aria-activedescendant', `nc-line-${this.line}`);
    else this.parent.removeAttribute('aria-activedescendant');
  }
}
