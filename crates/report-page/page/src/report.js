// Entry of the page: scene, player, program text, plots and panels around one moment of the program.

import { bytes, numbers, readDocument } from './data.js';
import { h, put } from './dom.js';
import { Machine } from './kinematics.js';
import { linePlace } from './lines.js';
import { Motion, lastUpTo } from './motion.js';
import { ProgramList } from './nc.js';
import { panels } from './panels.js';
import { NoView } from './no-view.js';
import { Plots } from './plots.js';
import { css, diverging, gradient, kind, sequential } from './scales.js';
import { View } from './scene.js';
import { kindText, sheet, untimedText, verdictText } from './sheet-content.js';
import { Stock } from './stock.js';
import { Timeline } from './timeline.js';
import { axisValue, clock, figure, fixed, isInch, length, setInch, speed } from './units.js';

const app = document.getElementById('app');
put(app, h('.loading', 'Opening …'));

/** Groups of the path. */
const PATHS = ['path', 'links', 'rapids'];
/** Names of figures where there is little room. */
const SHORT = { clearance: 'clearance', left: 'cusp left', surface_tilt: 'tilt', depth: 'gouge depth', tip: 'tip speed', chip: 'chip', removal: 'removal', feed: 'feed F', inverse: 'feed F, G93', load: 'axis load' };
/** Names of `uncertified` of a motion. */
const PROOF = ['certified', 'not certified', 'without a certificate'];
/** Whether a figure's thousandths count, and its greatest value. */
const isFine = (f) => f.key === 'depth' || f.key === 'left';
const shortName = (f) => SHORT[f.key] || f.name;

const nextPicture = () => new Promise((resolve) => requestAnimationFrame(resolve));

/** Whether an element has a use of its own for a key: fields take all, a checkbox the space, a slider what moves it. */
function takesKey(target, key) {
  const field = target.closest('input, select, textarea');
  if (!field) return false;
  if (field.type === 'checkbox') return key === ' ';
  if (field.type === 'range') return /^(Arrow|Page|Home$|End$)/.test(key);
  return true;
}

/** The page and its state. Tests and scripts reach it as `window.facemill`. */
class Page {
  constructor(doc) {
    this.doc = doc;
    this.time = 0;
    this.speed = 20;
    this.isPlaying = false;
    this.figureKey = 'depth';
    this.fallbackKey = 'tip';
    this.surface = 'plain';
  }

  async open() {
    const { doc } = this;
    this.machine = new Machine(doc.machine, doc.setup.table_from_work, doc.tools.map((t) => t.gauge_length_mm));
    this.theme = matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
    this.motion = await Motion.read(doc.motion, this.machine);
    this.figures = this.allFigures();
    this.layout();
    try {
      this.view = new View(doc, this.machine, this.viewElement);
      this.view.theme = this.theme;
      await this.view.build(this.motion);
    } catch (error) {
      // Program, findings and sheet need no picture.
      this.view = new NoView(this.viewElement, error);
    }
    document.documentElement.dataset.theme = this.theme;
    this.setFigure(this.figureKey);
    this.view.drawNow();
    // The picture is on the screen before the rest is read; a page in the background has none.
    await Promise.race([nextPicture().then(nextPicture), new Promise((resolve) => setTimeout(resolve, 1500))]);
    this.firstPicture = performance.now();
    this.view.isHeld = true;
    const { deviation, postures } = doc;
    [this.text, this.stock] = await Promise.all([bytes(doc.program.text), Stock.read(doc.stock)]);
    if (deviation) this.deviation = { values: await numbers(deviation.values, Float32Array), cut: await numbers(deviation.cut, Uint8Array) };
    if (this.stock) this.view.addStock(this.stock);
    this.view.addNarrowPoints(postures ? postures.maps : []);
    this.view.ondraw = () => this.placeLabels();
    this.groupBox();
    this.timeline = new Timeline(this.timelineElement, this, (time) => this.seek(time));
    this.plots = new Plots(this.plotArea, this.motion, (time) => this.seek(time));
    this.setPlot('position');
    this.program = new ProgramList(this.ncElement, this.text, this.lineMarks(), (line) => this.seekLine(line), this.doc.program.written);
    panels(this);
    this.printed.append(sheet(doc));
    this.figureSelect.value = this.figureKey;
    this.keys();
    this.pointer();
    this.seek(0);
    this.view.isHeld = false;
    this.view.drawNow();
    this.view.prepareMotion();
    this.isReady = true;
  }

  /** Figures that colour the path: those of the document and those that follow from the motion. */
  allFigures() {
    const { motion } = this;
    const own = motion.figures.map((f) => ({ ...f, value: (k) => f.values[k] }));
    const computed = [
      { key: 'feed', name: 'feed F', unit: 'mm/min', value: (k) => motion.feeds[k], note: 'as the block says it, or the last one before' },
      ...(this.doc.motion.inverse_feeds ? [{ key: 'inverse', name: 'feed F in inverse time', unit: '1/min', value: (k) => motion.inverseFeeds[k], note: 'G93: the reciprocal of the time of the block' }] : []),
      { key: 'load', name: 'axis load', unit: '', value: (k) => (motion.kinds[k] ? motion.axisLoad(k) : NaN), note: 'mean speed of the axis nearest to its largest, as a share of it' },
      { key: 'tilt', name: 'angle of the tool to z', unit: '°', value: (k) => this.toolAngle(k), note: 'between tool axis and z of the workpiece at the end of the block' },
    ];
    if (motion.uncertified) computed.push({ key: 'proof', name: 'proof of the block', kinds: PROOF, value: (k) => motion.uncertified[k], note: '' });
    if (motion.limitNames.length) computed.push({ key: 'limit', name: 'limiting factor', kinds: ['none', ...motion.limitNames], value: (k) => motion.limits[k], note: 'which limit holds the feed back, by the law of motion' });
    if (this.doc.program.operations.length > 1) {
      const starts = this.doc.program.operations.map((o) => o.first_line);
      computed.push({ key: 'operation', name: 'operation', kinds: this.doc.program.operations.map((o) => o.operation), value: (k) => Math.max(0, lastUpTo(starts, motion.lines[k])), note: '' });
    }
    if (motion.isCut) computed.push({ key: 'kind', name: 'pass, or entry and exit', kinds: ['pass', 'entry, exit, link at a feed'], value: (k) => (motion.isCut(k) ? 0 : 1), note: '' });
    return [...own, ...computed];
  }

  toolAngle(k) {
    if (!this.angles) this.angles = new Float32Array(this.motion.n).fill(NaN);
    if (Number.isNaN(this.angles[k])) {
      const { axis } = this.machine.pose(this.motion.end(k));
      this.angles[k] = (Math.atan2(Math.hypot(axis[0], axis[1]), axis[2]) * 180) / Math.PI;
    }
    return this.angles[k];
  }

  layout() {
    const { doc } = this;
    const [text, state] = verdictText(doc.verdict);
    document.body.classList.toggle('is-faulty', state === 'bad');
    const button = (label, title, onclick, more = {}) => h('button', { title, onclick, 'aria-label': title, ...more }, label);
    this.themeButton = button('◐', 'Light or dark (T)', () => this.setTheme(this.theme === 'dark' ? 'light' : 'dark'));
    this.unitButton = button('mm', 'Millimetre or inch (U)', () => this.setUnits(!isInch()));
    const bar = h('header.bar', h('h1', doc.job), h('span.where', `${doc.setup.file.name} · ${doc.program.file} · ${doc.machine.name}`), h('span.grow'), h(`span.chip.${state}`, { title: doc.verdict.notes.join('; ') }, text), this.unitButton, this.themeButton, button('Setup sheet', 'Setup sheet, for print (P)', () => this.openSheet()), button('?', 'Keys', () => this.openHelp()));
    const alarm = h('.alarm', { role: 'alert', class: `alarm ${state}` });
    if (state === 'bad') put(alarm, 'REJECTED: this program has faults and must not be run.', h('small', doc.verdict.because.join('; ')));
    else if (state === 'warn') put(alarm, { not_verified: 'Not verified: faults of this program are not known.', partly_tested: 'No fault was found, but not all is tested.', incomplete: 'No fault, but the job is not met.' }[doc.verdict.state], h('small', doc.verdict.because.join('; ')));
    this.viewElement = h('.view');
    this.labels = h('.labels');
    this.hint = h('.hint', { role: 'status' });
    this.legend = h('.legend');
    this.groupsElement = h('details.groups', { open: true });
    const views = [['Iso', 'iso', '1'], ['Top', 'top', '2'], ['Front', 'front', '3'], ['Right', 'right', '4'], ['Tool', 'tool', '5']];
    this.measureButton = button('Measure', 'Distance of two points (M)', () => this.setMeasure(!this.measuring));
    this.frameButton = button('Machine', 'Part stands still, or machine bed (B)', () => this.setFrameMode(this.view.frameMode === 'part' ? 'machine' : 'part'));
    const tools = h('.tools', h('.set', views.map(([label, name, key]) => button(label, `View: ${label} (${key})`, () => this.view.look(name)))), h('.set', this.frameButton, this.measureButton));
    this.viewElement.append(this.labels, tools, this.groupsElement, this.legend, this.hint);
    this.plotArea = h('.plot-area');
    this.plotSelect = h('select', { onchange: () => this.setPlot(this.plotSelect.value), 'aria-label': 'Plots' }, [['position', 'Axis positions'], ['speed', 'Axis speeds'], ['acceleration', 'Axis accelerations'], ['figures', 'Clearance, cusp, tilt, speed']].map(([value, label]) => h('option', { value }, label)));
    this.limitBox = h('input', { type: 'checkbox', onchange: () => this.setPlot(this.plotSelect.value) });
    this.plotsElement = h('section.plots', h('.plot-bar', this.plotSelect, h('label', this.limitBox, ' up to limits'), h('span.grow', { style: { flex: 1 } }), button('−', 'Plot: longer time', () => this.plots.zoom(2)), button('+', 'Plot: shorter time', () => this.plots.zoom(0.5)), button('All', 'Plot: whole program', () => this.plots.zoom(1e9)), button('▾', 'Fold the plots', () => this.plotsElement.classList.toggle('closed'))), this.plotArea);
    const stage = h('.stage', this.viewElement, this.plotsElement);
    this.tabs = h('.tabs', { role: 'tablist' });
    this.side = h('aside.side', this.tabs);
    this.readout = h('.readout');
    this.ncElement = h('.nc', { 'aria-label': 'Program' });
    this.finder = h('input', { placeholder: 'Line, N… or text', 'aria-label': 'Find in the program', onkeydown: (e) => e.key === 'Enter' && this.find(this.finder.value) });
    this.addPanel('Program', 'program', null, this.readout, h('.finder', this.finder, button('Find', 'Find next', () => this.find(this.finder.value))), this.ncElement);
    this.playButton = h('button.play', { onclick: () => this.play(!this.isPlaying), title: 'Play or pause (space)' }, '▶  Play');
    this.speedSelect = h('select', { onchange: () => (this.speed = Number(this.speedSelect.value)), 'aria-label': 'Speed' }, [1, 5, 20, 60, 200, 1000].map((s) => h('option', { value: s, selected: s === this.speed }, `${s}×`)));
    this.timelineElement = h('.timeline', { role: 'slider', 'aria-label': 'Time in the program', tabindex: 0, 'aria-valuemin': 0, 'aria-valuemax': Math.round(this.motion.total), 'aria-valuenow': 0 });
    this.clockElement = h('.clock');
    const player = h('footer.player', this.playButton, h('.set', button('|◀', 'Start (Home)', () => this.seek(0)), button('◀', 'Block back (left)', () => this.step(-1)), button('▶', 'Block on (right)', () => this.step(1)), button('▶|', 'End (End)', () => this.seek(this.motion.total))), this.speedSelect, this.timelineElement, this.clockElement);
    this.cover = h('.cover', { onclick: (e) => e.target === this.cover && this.closeCover() });
    this.printed = h('.cover', { id: 'printed' });
    this.pageElement = h('.page', bar, alarm, stage, this.side, player);
    put(app, this.pageElement, this.printed, this.cover);
    this.select('program');
  }

  addPanel(label, name, count, ...content) {
    const tab = h('button', { role: 'tab', onclick: () => this.select(name), 'data-tab': name }, label, count ? h(`span.count${count.isQuiet ? '.quiet' : ''}`, count.n) : null);
    const panel = h(`div.panel.${name}`, { role: 'tabpanel' }, ...content);
    this.tabs.append(tab);
    this.side.append(panel);
    this.panels = { ...(this.panels || {}), [name]: { tab, panel } };
    return panel;
  }

  select(name) {
    for (const [key, { tab, panel }] of Object.entries(this.panels)) {
      tab.setAttribute('aria-selected', key === name);
      panel.classList.toggle('open', key === name);
    }
    if (name === 'postures' && this.postures) this.postures.open();
    if (name === 'surface' && this.surface === 'plain' && this.deviation) this.setSurface('deviation');
    if (this.program) this.program.draw();
  }

  /** Box of groups, colours and section. */
  groupBox() {
    const { view } = this;
    const rows = Object.entries(view.groups).filter(([name]) => name !== 'marks').map(([name, group]) => {
      const box = h('input', { type: 'checkbox', 'data-group': name, onchange: () => {
        view.setVisible(name, box.checked);
        if (name === 'stockNow' && this.stock) this.stock.show(view.k + 1);
      } });
      box.checked = group.isShown;
      return h('label', box, group.label);
    });
    this.figureSelect = h('select', { onchange: () => this.setFigure(this.figureSelect.value), 'aria-label': 'Colour of the path' }, this.figures.map((f) => h('option', { value: f.key }, f.name)));
    const surfaces = [['plain', 'plain'], ...(this.deviation ? [['deviation', 'deviation']] : [])];
    this.surfaceSelect = h('select', { onchange: () => this.setSurface(this.surfaceSelect.value), 'aria-label': 'Colour of the part' }, surfaces.map(([value, label]) => h('option', { value }, label)));
    const done = h('select', { onchange: () => view.setPathDone(done.value), 'aria-label': 'Part of the path' }, [['all', 'all'], ['done', 'done so far']].map(([value, label]) => h('option', { value }, label)));
    const axis = h('select', { onchange: () => cut(), 'aria-label': 'Section across' }, [['-1', 'off'], ['0', 'across X'], ['1', 'across Y'], ['2', 'across Z'], ['10', 'across X, back'], ['11', 'across Y, back'], ['12', 'across Z, back']].map(([value, label]) => h('option', { value }, label)));
    const share = h('input', { type: 'range', min: 0, max: 1, step: 0.005, value: 0.5, oninput: () => cut(), 'aria-label': 'Place of the section', style: { flex: 1, minWidth: '60px' } });
    const cut = () => {
      const value = Number(axis.value);
      view.setSection(value < 0 ? -1 : value % 10, Number(share.value), value >= 10);
    };
    this.sectionAxis = axis;
    const pair = (name, element) => h('.pair', h('span', name), element);
    put(this.groupsElement, h('summary', 'Show'), rows, h('hr'), pair('Path', done), pair('Colour', this.figureSelect), pair('Part', this.surfaceSelect), h('hr'), pair('Section', axis), pair('at', share));
  }

  setFigure(key) {
    const wanted = (name) => this.figures.find((f) => f.key === name && this.hasValues(f));
    const figureOf = wanted(key) || wanted(this.fallbackKey) || this.figures.find((f) => this.hasValues(f)) || this.figures[0];
    this.figureKey = figureOf.key;
    if (this.figureSelect) this.figureSelect.value = figureOf.key;
    this.range = figureOf.kinds ? null : this.rangeOf(figureOf);
    const missing = this.theme === 'dark' ? [0.42, 0.46, 0.5] : [0.62, 0.66, 0.7];
    const share = (value) => {
      const [low, high] = this.range;
      const s = high > low ? (value - low) / (high - low) : 0.5;
      return figureOf.low_is_critical ? s : 1 - s;
    };
    this.pathColour = (k) => {
      const value = figureOf.value(k);
      if (!Number.isFinite(value)) return missing;
      return figureOf.kinds ? kind(value) : sequential(1 - share(value));
    };
    this.view.colourPath(this.pathColour);
    if (this.timeline) this.timeline.draw();
    this.showLegend();
  }

  hasValues(f) {
    for (let k = 0; k < this.motion.n; k++) if (this.motion.kinds[k] && Number.isFinite(f.value(k))) return true;
    return false;
  }

  /** Range of a figure over cuts, without the outermost hundredth. */
  rangeOf(f) {
    const values = [];
    for (let k = 0; k < this.motion.n; k++) {
      const value = this.motion.kinds[k] ? f.value(k) : NaN;
      if (Number.isFinite(value)) values.push(value);
    }
    values.sort((a, b) => a - b);
    if (!values.length) return [0, 1];
    const at = (share) => values[Math.min(values.length - 1, Math.round(share * (values.length - 1)))];
    return f.low_is_critical ? [values[0], at(0.95)] : [at(0.01), isFine(f) ? values.at(-1) : at(0.99)];
  }

  setSurface(name) {
    this.surface = name;
    if (this.surfaceSelect) this.surfaceSelect.value = name;
    if (name === 'deviation' && this.deviation) {
      const { values, cut } = this.deviation;
      const full = 2 * this.doc.deviation.tolerance;
      this.view.colourPart((v) => (values && Number.isFinite(values[v]) && cut[v] ? diverging(values[v] / full) : [0.55, 0.55, 0.56]));
      for (const name of PATHS) if (this.view.groups[name]?.isShown) this.toggleGroup(name, false);
      if (this.view.groups.stockNow && this.view.groups.stockNow.isShown) this.toggleGroup('stockNow', false);
    } else {
      this.view.colourPart(null);
      for (const name of PATHS) if (this.view.groups[name]) this.toggleGroup(name, true);
    }
    this.showLegend();
  }

  toggleGroup(name, isShown) {
    this.view.setVisible(name, isShown);
    const box = this.groupsElement.querySelector(`[data-group="${name}"]`);
    if (box) box.checked = isShown;
  }

  showLegend() {
    if (this.surface === 'deviation' && this.doc.deviation) {
      const full = 2 * this.doc.deviation.tolerance;
      put(this.legend, h('b', 'Deviation of the cut stock from the part'), h('.scale', { style: { background: gradient(diverging, -1, 1) } }), h('.ends', h('span', `gouge ${length(-full, 2)}`), h('span', '0'), h('span', `excess ${length(full, 2)}`)), h('.keys', h('span', h('i', { style: { background: 'rgb(140 140 143)' } }), 'not cut, or not measured')));
      return;
    }
    const f = this.figures.find((x) => x.key === this.figureKey);
    if (!f) return;
    if (f.kinds) {
      put(this.legend, h('b', `Path: ${f.name}`), h('.keys', f.kinds.map((name, k) => h('span', h('i', { style: { background: css(kind(k)) } }), name))), f.note ? h('.muted', f.note) : null);
      return;
    }
    const [low, high] = this.range;
    const scale = f.low_is_critical ? (s) => sequential(1 - s) : sequential;
    put(this.legend, h('b', `Path: ${f.name}`), h('.scale', { style: { background: gradient(scale, 0, 1) } }), h('.ends', h('span', figure(low, f.unit, isFine(f) ? 4 : 2)), h('span', figure(high, f.unit, isFine(f) ? 4 : 2))), f.note ? h('.muted', f.note) : null);
  }

  setTheme(theme) {
    this.theme = theme;
    document.documentElement.dataset.theme = theme;
    this.view.setTheme(theme);
    this.setFigure(this.figureKey);
    if (this.plots) this.plots.draw();
    if (this.timeline) this.timeline.draw();
  }

  setUnits(inch) {
    setInch(inch);
    this.unitButton.textContent = inch ? 'in' : 'mm';
    put(this.printed, sheet(this.doc));
    panels(this);
    this.showLegend();
    this.setPlot(this.plotSelect.value);
    this.show();
  }

  setFrameMode(mode) {
    this.frameButton.setAttribute('aria-pressed', mode === 'machine');
    this.view.setFrameMode(mode);
  }

  /** Rows of the plots. */
  setPlot(name) {
    const { motion, machine, figures } = this;
    const showLimits = this.limitBox.checked;
    const degrees = (axis) => (axis.is_rotary ? 180 / Math.PI : 1);
    const perMinute = (axis) => (axis.is_rotary ? 180 / Math.PI : 60);
    const unit = (axis) => (axis.is_rotary ? '°' : 'mm');
    const axes = machine.axes.map((axis, i) => ({ axis, i }));
    const rows = {
      position: () => axes.map(({ axis, i }) => ({ label: axis.letter, unit: unit(axis), atEnds: true, showLimits, limits: axis.limits.map((l) => (l === null ? NaN : l * degrees(axis))), value: (k) => (k < 0 ? motion.start[i] : motion.ends[i][k]) * degrees(axis) })),
      speed: () => axes.map(({ axis, i }) => ({ label: axis.letter, unit: axis.is_rotary ? '°/s' : 'mm/min', showLimits, limits: [-1, 1].map((s) => s * axis.max_velocity * perMinute(axis)), value: (k) => motion.axisSpeed(i, k) * perMinute(axis) })),
      acceleration: () => axes.map(({ axis, i }) => ({ label: axis.letter, unit: `${unit(axis)}/s²`, showLimits, limits: axis.max_acceleration ? [-1, 1].map((s) => s * axis.max_acceleration * degrees(axis)) : [], value: (k) => motion.axisAcceleration(i, k) * degrees(axis) })),
      figures: () => figures.filter((f) => !f.kinds && ['clearance', 'depth', 'left', 'surface_tilt', 'tip', 'feed', 'inverse', 'chip', 'removal', 'load'].includes(f.key) && this.hasValues(f)).map((f) => ({ label: shortName(f), unit: f.unit, limits: [], value: f.value })),
    }[name]();
    this.plots.setRows(rows);
  }

  /** Marks of lines in the program: faults and notes. */
  lineMarks() {
    const marks = new Map();
    for (const finding of this.doc.result.findings || []) {
      const { isFault } = finding;
      const last = Math.min(finding.last_line, finding.first_line + 5000);
      for (let line = finding.first_line; line <= last; line++) {
        if (!marks.has(line) || isFault) marks.set(line, { kind: isFault ? 'fault' : 'note', title: kindText(finding.kind) });
      }
    }
    const { uncertified } = this.motion;
    for (let k = 0; uncertified && k < this.motion.n; k++) {
      if (uncertified[k] && !marks.has(this.motion.lines[k])) marks.set(this.motion.lines[k], { kind: 'note', title: PROOF[uncertified[k]] });
    }
    return marks;
  }

  /** Shows the moment at a time, s. */
  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.motion.total);
    const { k, t } = this.motion.at(this.time);
    this.k = this.time <= 0 ? -1 : k;
    this.t = t;
    this.q = this.time <= 0 ? this.motion.end(-1) : this.motion.position(k, t);
    this.line = this.k < 0 ? (this.motion.n ? this.motion.lines[0] : 1) : this.motion.lines[this.k];
    this.show();
  }

  /** Shows the end of a motion; −1: the start. */
  seekMotion(k) {
    this.k = Math.min(Math.max(k, -1), this.motion.n - 1);
    this.t = 1;
    this.time = this.k < 0 ? 0 : this.motion.endTimes[this.k];
    this.q = this.motion.end(this.k);
    this.line = this.k < 0 ? 1 : this.motion.lines[this.k];
    this.show();
  }

  /** Shows the end of a line of the program. */
  seekLine(line) {
    this.seekMotion(this.motion.ofLine(line));
    this.line = line;
    this.show();
  }

  step(by) {
    this.play(false);
    const isInside = this.t < 1 && this.k >= 0;
    this.seekMotion(this.k + (isInside && by > 0 ? by - 1 : by));
  }

  /** Pose of the tool at the end of a line, as shown: workpiece frame. */
  poseOfLine(line, head = 0) {
    return this.machine.pose(this.motion.end(this.motion.ofLine(line)), head);
  }

  show() {
    const { view, motion, time, k } = this;
    view.setPosition(this.q, this.t < 1 ? k - 1 : k);
    this.clockElement.textContent = `${clock(time)} / ${clock(motion.total)}${motion.nUntimed ? ` · ${untimedText(motion.nUntimed)}` : ''}`;
    this.program.show(this.line);
    this.timeline.setTime(time);
    this.timelineElement.setAttribute('aria-valuenow', Math.round(time));
    this.timelineElement.setAttribute('aria-valuetext', `${clock(time)} of ${clock(motion.total)}, ${linePlace(this.doc, this.line)}`);
    this.plots.setTime(time);
    this.showReadout();
  }

  showReadout() {
    const { motion, machine, k } = this;
    const text = this.line >= 1 && this.line <= this.program.n ? this.program.text(this.line) : '';
    const rows = machine.axes.map((axis, i) => {
      const [low, high] = axis.limits;
      const share = low === null || high === null ? null : (this.q[i] - low) / (high - low);
      const rate = k >= 0 ? motion.axisSpeed(i, k) * (axis.is_rotary ? 180 / Math.PI : 60) : 0;
      return h('tr', h('th', axis.letter), h('td.number', axisValue(axis, this.q[i], axis.is_rotary ? 4 : 3)), h('td.number.muted', axis.is_rotary ? `${fixed(rate, 2)} °/s` : speed(rate)), h('td.bar-cell', share === null ? h('span.muted', 'no stops') : h(`div.track${share < 0 || share > 1 ? '.bad' : ''}`, { title: `limits ${axisValue(axis, low, 1)} to ${axisValue(axis, high, 1)}` }, h('i', { style: { left: `${Math.min(Math.max(share, 0), 1) * 100}%` } }))));
    });
    const kinds = ['rapid', 'at a feed', 'shown as a straight motion'];
    const facts = [];
    const add = (name, value) => value !== null && facts.push(h('dt', name), h('dd', value));
    add('motion', k < 0 ? 'start' : kinds[motion.kinds[k]]);
    add('feed F', k < 0 || !motion.kinds[k] ? '–' : Number.isFinite(motion.inverseFeeds[k]) ? `${fixed(motion.inverseFeeds[k], 3)} 1/min` : speed(motion.feeds[k]));
    add('RTCP', k >= 0 && motion.rtcp[k] ? 'on' : 'off');
    if (k >= 0 && motion.untimed && motion.untimed[k]) add('time', 'not timed');
    if (motion.uncertified) add('proof', k < 0 ? '–' : PROOF[motion.uncertified[k]]);
    for (const f of motion.figures) add(shortName(f), k >= 0 && Number.isFinite(f.values[k]) ? figure(f.values[k], f.unit) : '–');
    if (motion.limitNames.length) add('limited by', k >= 0 && motion.limits[k] ? motion.limitNames[motion.limits[k] - 1] : '–');
    const pass = this.passOf(this.line);
    if (pass) add('pass', `${pass.pass}, place ${pass.place}`);
    machine.heads.forEach((_, head) => {
      const { tip, axis } = machine.pose(this.q, head);
      const of = machine.heads.length > 1 ? ` ${head + 1}` : '';
      facts.push(h('dt.wide', `tip${of}`), h('dd.wide', tip.map((x) => length(x, 3, true)).join('   ')), h('dt.wide', `tool axis${of}`), h('dd.wide', axis.map((x) => fixed(x, 5)).join('   ')));
    });
    put(this.readout, h('.block', h('b', `${this.program.number(this.line)}  `), text), h('table', h('tbody', rows)), h('dl.facts2', facts));
  }

  passOf(line) {
    const { passes } = this.doc.program;
    if (!this.passStarts) this.passStarts = passes.map((p) => p.line);
    return passes[lastUpTo(this.passStarts, line)];
  }

  find(text) {
    const wanted = text.trim().toLowerCase();
    if (!wanted) return;
    if (/^\d+$/.test(wanted)) return this.seekLine(this.program.lineOf(Number(wanted)));
    for (let step = 1; step <= this.program.n; step++) {
      const line = ((this.line - 1 + step) % this.program.n) + 1;
      if (this.program.number(line).toLowerCase() === wanted || this.program.text(line).toLowerCase().includes(wanted)) return this.seekLine(line);
    }
    this.tell(`"${text}" is not in the program`);
  }

  tell(text) {
    this.hint.textContent = text;
    clearTimeout(this.hintTimer);
    if (text) this.hintTimer = setTimeout(() => (this.hint.textContent = ''), 4000);
  }

  play(isPlaying) {
    if (isPlaying === this.isPlaying) return;
    this.isPlaying = isPlaying;
    this.playButton.textContent = isPlaying ? 'Pause' : '▶ Play';
    if (!isPlaying) return;
    if (this.time >= this.motion.total) this.seek(0);
    let last = performance.now();
    const frame = (now) => {
      if (!this.isPlaying) return;
      const next = this.time + ((now - last) / 1000) * this.speed;
      last = now;
      this.seek(next);
      if (next >= this.motion.total) this.play(false);
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  setMeasure(on) {
    this.measuring = on ? [] : null;
    this.measureButton.setAttribute('aria-pressed', Boolean(on));
    this.measured = null;
    if (this.view) this.view.draw();
    this.tell(on ? 'Click two points of surfaces' : '');
  }

  pointer() {
    const canvas = this.view.renderer.domElement;
    let down = null;
    canvas.addEventListener('pointerdown', (e) => (down = [e.clientX, e.clientY]));
    canvas.addEventListener('pointerup', (e) => {
      if (!down || Math.hypot(e.clientX - down[0], e.clientY - down[1]) > 4) return;
      const box = canvas.getBoundingClientRect();
      const [x, y] = [e.clientX - box.left, e.clientY - box.top];
      if (this.measuring) return this.measureAt(x, y);
      const point = this.view.narrowPointAt(x, y);
      if (point >= 0) {
        this.play(false);
        this.select('postures');
        return this.postures.show(point);
      }
      const k = this.view.motionAt(x, y);
      if (k >= 0) {
        this.play(false);
        this.seekMotion(k);
        this.select('program');
      }
    });
  }

  measureAt(x, y) {
    const hit = this.view.pointAt(x, y);
    if (!hit) return this.tell('There is no surface here');
    if (this.measuring.length === 2) this.measuring = [];
    this.measuring.push(hit.at);
    this.view.setMarks(this.measuring.map((at) => ({ at, colour: 0xd0481e, size: 0.7 })));
    if (this.measuring.length === 2) {
      const [a, b] = this.measuring;
      const d = b.map((value, c) => value - a[c]);
      const distance = Math.hypot(...d);
      this.measured = { at: a.map((value, c) => (value + b[c]) / 2), distance };
      this.tell(`${length(distance)}  (ΔX ${length(d[0], 3, true)}, ΔY ${length(d[1], 3, true)}, ΔZ ${length(d[2], 3, true)})`);
    }
    this.placeLabels();
  }

  placeLabels() {
    const items = [];
    for (const { name, at } of this.view.frameLabels()) {
      const same = items.find((item) => Math.hypot(...item.at.map((x, c) => x - at[c])) < 1e-3);
      if (same) same.text += ` = ${name}`;
      else items.push({ text: name, at, kind: 'span' });
    }
    if (this.measured) items.push({ text: length(this.measured.distance), at: this.measured.at, kind: 'span.measure' });
    put(this.labels, items.map(({ text, at, kind: tag }) => {
      const { x, y, isVisible } = this.view.onScreen(at);
      return isVisible ? h(tag, { style: { left: `${x}px`, top: `${y}px` } }, text) : null;
    }));
  }

  openSheet() {
    const bar = h('nav.sheet-bar', h('button', { onclick: () => this.setUnits(!isInch()) || this.openSheet() }, 'mm / inch'), h('button', { onclick: () => window.print() }, 'Print'), h('button', { onclick: () => this.closeCover() }, 'Close'));
    this.openCover('Setup sheet', bar, sheet(this.doc));
  }

  openHelp() {
    const keys = [['space', 'play or pause'], ['← →', 'one block back or on; with shift ten'], ['PgUp PgDn', 'a pass back or on'], ['↑ ↓', 'in the program: a line back or on, PgUp PgDn a page'], ['Home End', 'start, end'], ['1 – 5', 'views'], ['B', 'part or machine bed stands still'], ['D', 'deviation'], ['M', 'measure'], ['S', 'section'], ['T', 'light or dark'], ['U', 'mm or inch'], ['P', 'setup sheet, open and close'], ['Esc', 'close']];
    this.openCover('Keys', h('.help', h('h2', 'Keys'), h('table', keys.map(([key, what]) => h('tr', h('td', h('kbd', key)), h('td', what)))), h('p.muted', 'Drag turns, right drag or two fingers shift, wheel zooms to the pointer. A click on the path leads to its line, a click on a line to its pose, a click on a point of a narrow choice to its map.'), h('button', { onclick: () => this.closeCover() }, 'Close')));
  }

  /** Shows something over the page, which takes no keys and no focus until it is closed. */
  openCover(name, ...content) {
    if (!this.cover.classList.contains('open')) this.focusBefore = document.activeElement;
    put(this.cover, ...content);
    for (const [key, value] of Object.entries({ role: 'dialog', 'aria-modal': 'true', 'aria-label': name, tabindex: -1 })) this.cover.setAttribute(key, value);
    this.cover.classList.add('open');
    this.pageElement.inert = true;
    this.cover.focus();
  }

  closeCover() {
    if (!this.cover.classList.contains('open')) return;
    this.cover.classList.remove('open');
    put(this.cover);
    this.pageElement.inert = false;
    if (this.focusBefore) this.focusBefore.focus();
  }

  keys() {
    const views = ['iso', 'top', 'front', 'right', 'tool'];
    const passes = (by) => {
      const { passes: all } = this.doc.program;
      const at = lastUpTo(all.map((p) => p.line), this.line) + by;
      if (all[at]) this.seekLine(all[at].line);
    };
    const actions = {
      ' ': () => this.play(!this.isPlaying), ArrowLeft: (e) => this.step(e.shiftKey ? -10 : -1), ArrowRight: (e) => this.step(e.shiftKey ? 10 : 1),
      Home: () => this.seek(0), End: () => this.seek(this.motion.total), PageUp: () => passes(-1), PageDown: () => passes(1),
      b: () => this.setFrameMode(this.view.frameMode === 'part' ? 'machine' : 'part'), d: () => this.setSurface(this.surface === 'plain' ? 'deviation' : 'plain'), m: () => this.setMeasure(!this.measuring), t: () => this.themeButton.click(), u: () => this.unitButton.click(), p: () => (this.cover.classList.contains('open') ? this.closeCover() : this.openSheet()),
      s: () => {
        this.sectionAxis.selectedIndex = (this.sectionAxis.selectedIndex + 1) % this.sectionAxis.options.length;
        this.sectionAxis.dispatchEvent(new Event('change'));
      },
      Escape: () => this.closeCover(), '?': () => this.openHelp(),
    };
    document.addEventListener('keydown', (event) => {
      if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || takesKey(event.target, event.key)) return;
      // Beneath something open nothing moves: other keys scroll it.
      if (this.cover.classList.contains('open') && !['Escape', 'p', 'P'].includes(event.key)) return;
      if (/^[1-5]$/.test(event.key)) return this.view.look(views[Number(event.key) - 1]);
      const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!action || (event.key === ' ' && event.target.closest('button'))) return;
      event.preventDefault();
      action(event);
    });
  }
}

const page = new Page(readDocument());
window.facemill = page;
page.ready = page.open().catch((error) => {
  put(app, h('.loading', `This page cannot be shown: ${error && error.message ? error.message : error}`));
  page.error = error;
  throw error;
});
