// Panels beside the scene: findings, surface, postures, facts.

import { bytes } from './data.js';
import { h, put, svg } from './dom.js';
import { linePlace, linePlaces } from './lines.js';
import { Postures } from './postures.js';
import { css, diverging } from './scales.js';
import { fileLine, kindText, measureText, untimedText } from './sheet-content.js';
import { clock, figure, fixed, length } from './units.js';

/** Fills the panels; again when the unit changes. */
export function panels(page) {
  const { doc } = page;
  const list = doc.result.findings || [];
  const faults = list.filter((f) => f.isFault).length;
  const panel = (label, name, count) => {
    if (page.panels[name]) {
      put(page.panels[name].panel);
      return page.panels[name].panel;
    }
    return page.addPanel(label, name, count);
  };
  findingsPanel(page, panel('Findings', 'findings', list.length ? { n: list.length, isQuiet: !faults } : null), list);
  if (doc.deviation) surfacePanel(page, panel('Surface', 'surface'));
  if (doc.pictures.length || doc.postures) posturesPanel(page, panel('Postures', 'postures'));
  factsPanel(page, panel('Facts', 'facts'));
}

/** Shows the moment of a finding: its block and pose, the bodies in red, the place marked. */
export function showFinding(page, finding) {
  page.play(false);
  page.seekLine(finding.worst_line);
  if (finding.pose) {
    const values = new Map(finding.pose.axis_values.map((a) => [a.axis, a.value]));
    page.q = page.machine.axes.map((axis, k) => {
      const value = values.get(axis.letter);
      return value === undefined ? page.q[k] : axis.is_rotary ? (value * Math.PI) / 180 : value;
    });
    page.view.setPosition(page.q, page.k);
    page.showReadout();
  }
  page.view.highlight([finding.body, finding.obstacle].filter(Boolean));
  page.view.setMarks(finding.place_work_mm ? [{ at: finding.place_work_mm, colour: 0xd00020, size: 1 }] : []);
  if (finding.place_work_mm) page.view.look('place', finding.place_work_mm);
}

function findingsPanel(page, panel, list) {
  const { result } = page.doc;
  const buttons = [];
  const choose = (button, show) => {
    for (const other of buttons) other.removeAttribute('aria-current');
    button.setAttribute('aria-current', 'true');
    show();
  };
  const entry = (kind, title, lines, onclick) => {
    const button = h(`button.row.${kind}`, { onclick: () => choose(button, onclick) }, h('b', title), lines.filter((line) => line && line.length).map((line) => h('span', line)));
    buttons.push(button);
    return button;
  };
  const range = (f) => (f.first_line === f.last_line ? fileLine(page.doc, f.first_line) : [`${linePlaces(page.doc, f.first_line, f.last_line)}, worst in `, fileLine(page.doc, f.worst_line)]);
  panel.append(h('h2', 'Findings of the written program'));
  if (!list.length) panel.append(h('p', result.verified === false ? 'The program was not run on the virtual machine: faults are not known.' : 'None.'));
  list.forEach((f, index) => {
    const bodies = [f.axis, f.body, f.obstacle].filter(Boolean).join(' – ');
    const button = entry(f.isFault ? 'bad' : 'warn', `${kindText(f.kind)}${f.measure ? `: ${measureText(f.measure)}` : ''}`, [range(f), bodies, f.note, f.time_s !== undefined ? `at ${clock(f.time_s)} of constant speed` : ''], () => showFinding(page, f));
    button.dataset.finding = index;
    panel.append(button);
  });
  const { uncertified = [] } = result.certified || {};
  if (uncertified.length) {
    panel.append(h('h2', 'Not proven'));
    for (const u of uncertified) panel.append(entry('warn', u.reason, [`${linePlaces(page.doc, u.first_line, u.last_line)}, ${u.blocks} blocks`], () => page.seekLine(u.first_line)));
  }
  if (result.infeasible) {
    panel.append(h('h2', 'Left out'));
    if (!result.infeasible.length) panel.append(h('p', 'No CC point is left out.'));
    for (const left of result.infeasible) {
      const help = left.would_help.map((x) => `would help: ${x.field} ${fieldValue(x.field, x.value)}`);
      panel.append(entry('warn', left.reason, [`${left.points} CC points`, ...help], () => {
        page.play(false);
        page.seekMotion(nearestCut(page, left.first_place_mm));
        page.view.setMarks([{ at: left.first_place_mm, colour: 0xe69f00 }]);
        page.view.look('place', left.first_place_mm);
      }));
    }
  }
  panel.append(h('h2', 'Assumptions'));
  const { assumptions = [] } = result;
  if (!assumptions.length) panel.append(h('p', 'None.'));
  for (const a of assumptions) panel.append(a.line ? entry('plain', fileLine(page.doc, a.line), [a.text], () => page.seekLine(a.line)) : h('p', a.text));
}

/** Value of a field of job or tool file; its name says the unit. */
function fieldValue(field, value) {
  if (field.endsWith('_mm')) return length(value);
  if (field.endsWith('_deg')) return `${fixed(value, 3)}°`;
  return fixed(value, 3);
}

/** The cut whose end is nearest to a place of the workpiece; of many motions the nearest of some, then of those around it. */
function nearestCut(page, place) {
  const { motion, machine } = page;
  const nearest = (from, to, step) => {
    let [best, least] = [-1, Infinity];
    for (let k = Math.max(from, 0); k < Math.min(to, motion.n); k += step) {
      if (motion.kinds[k] !== 1) continue;
      for (const head of machine.heads.keys()) {
        const { tip } = machine.pose(motion.end(k), head);
        const distance = Math.hypot(...tip.map((x, c) => x - place[c]));
        if (distance < least) [best, least] = [k, distance];
      }
    }
    return best;
  };
  const step = Math.max(1, Math.ceil(motion.n / 20000));
  const about = nearest(0, motion.n, step);
  return about < 0 ? -1 : nearest(about - step, about + step + 1, 1);
}

function surfacePanel(page, panel) {
  const { deviation } = page.doc;
  const buttons = deviation.worst.map((place, k) => h('button.row', { onclick: () => {
    page.setSurface('deviation');
    page.view.setMarks([{ at: place.at, colour: place.value < 0 ? 0xd0481e : 0x00629b, size: 0.8 }]);
    page.view.look('place', place.at);
  } }, h('b', `${k + 1}: ${place.value < 0 ? 'gouge' : 'excess'} ${length(Math.abs(place.value))}`), h('span', `at ${place.at.map((x) => length(x, 1, true)).join(', ')}`)));
  panel.append(
    h('h2', 'Deviation of the cut stock from the part'),
    h('p', `Computed for this page on lines ${length(page.doc.stock.cell, 2)} apart along z, each within 0.1 mm. ${deviation.permitted === null ? `There are no operations that permit a deviation: ${length(deviation.tolerance)} is only that of the scale.` : `Of the operations, the strictest permits ${length(deviation.permitted)}.`} Between lines nothing is known here. Excess is high where passes end: at the border of what is cut.`),
    ...(page.doc.motion.not_followed ? [h('p.bad', `From there on the program is not followed as it is, and stock and deviation are not known: ${page.doc.motion.not_followed}.`)] : []),
    h('p', h('button', { onclick: () => page.setSurface(page.surface === 'plain' ? 'deviation' : 'plain') }, 'Colours on or off (D)')),
    h('h2', 'Cut area by deviation'), histogram(deviation),
    h('h2', 'Worst places'), ...(buttons.length ? buttons : [h('p', 'The program cuts nothing of the part.')]),
    h('p', h('button', { onclick: () => page.view.setMarks(deviation.worst.map((w) => ({ at: w.at, colour: w.value < 0 ? 0xd0481e : 0x00629b, size: 0.6 }))) }, 'Mark all')),
  );
}

function histogram({ histogram: bins, tolerance }) {
  const shown = bins.filter((bin) => bin[2] > 0);
  const [first, last] = shown.length ? [bins.indexOf(shown[0]), bins.indexOf(shown.at(-1))] : [0, 0];
  const part = bins.slice(Math.max(0, first - 1), last + 2);
  const most = Math.max(...part.map((bin) => bin[2]), 1e-9);
  const [W, H] = [330, 130];
  const step = (W - 10) / part.length;
  const bars = part.map((bin, k) => svg('rect', { x: 5 + k * step, y: 105 - (95 * bin[2]) / most, width: Math.max(step - 1, 0.5), height: (95 * bin[2]) / most, fill: css(diverging((bin[0] + bin[1]) / 2 / (2 * tolerance))), stroke: 'currentColor', 'stroke-width': 0.3 }, svg('title', `${fixed(bin[0], 3)} to ${fixed(bin[1], 3)} mm: ${fixed(bin[2] / 100, 1)} cm²`)));
  const labels = part.map((bin, k) => (k % Math.ceil(part.length / 6) ? null : svg('text', { x: 5 + k * step, y: 118 }, fixed(bin[0], 2))));
  return svg('svg', { viewBox: `0 0 ${W} ${H}`, class: 'histogram', role: 'img', 'aria-label': 'cut area by deviation' }, bars, svg('path', { d: `M5 105H${W - 5}`, stroke: 'currentColor', 'stroke-width': 0.7 }), labels, svg('text', { x: W - 5, y: 129, 'text-anchor': 'end' }, 'mm'));
}

function posturesPanel(page, panel) {
  if (page.doc.postures) {
    const index = page.postures ? page.postures.index : -1;
    const maps = h('div');
    panel.append(maps);
    page.postures = new Postures(page, maps);
    if (index >= 0) page.postures.show(index, false);
  }
  if (page.doc.pictures.length) panel.append(h('h2', 'The narrowest point of the first operation, as the plan drew it'), h('p.muted', 'Green postures are feasible. Click the map to see the pass.'));
  for (const picture of page.doc.pictures) {
    const image = h('img.picture', { alt: picture.name });
    panel.append(image);
    (page.pictureBytes ??= new Map());
    const show = (data) => {
      page.pictureBytes.set(picture.name, data);
      let text = '';
      for (const byte of data) text += String.fromCharCode(byte);
      image.src = `data:image/svg+xml;base64,${btoa(text)}`;
      const found = /pass (\d+), point (\d+)/.exec(new TextDecoder().decode(data));
      const pass = found && page.doc.program.passes.find((p) => p.pass === Number(found[1]));
      if (pass) image.addEventListener('click', () => page.seekLine(pass.line));
    };
    const known = page.pictureBytes.get(picture.name);
    if (known) show(known);
    else bytes(picture.svg).then(show);
  }
}

function factsPanel(page, panel) {
  const { result, machine, motion, thinned, not_shown: notShown } = page.doc;
  const rows = [];
  const add = (name, value) => value !== null && value !== undefined && rows.push(h('tr', h('th', name), h('td', value)));
  const { totals, times, worst = {} } = result;
  if (times) {
    add('time at a feed', clock(times.cutting_s ?? times.constant_cutting_s));
    add('time in rapids', clock(times.rapid_s ?? times.constant_rapid_s));
    if (times.cutting_s === null || times.cutting_s === undefined) add('times', `at constant speed: ${times.no_law_because.join('; ')}`);
  }
  if (totals) {
    add('passes', totals.passes);
    add('CC points, planned', `${totals.cc_points}, ${fixed(100 * totals.planned_fraction, 2)} %`);
    add('length of passes', length(totals.passes_length_mm, 0));
  }
  add('blocks with a motion', result.n_blocks ?? (totals && totals.blocks));
  const gouge = result.largest_gouge ? { depth: result.largest_gouge.depth_mm, line: result.largest_gouge.line } : { depth: worst.gouge_mm, line: worst.gouge_line };
  const link = (text, line) => (line ? h('span', text, ' ', h('button', { onclick: () => page.seekLine(line) }, linePlace(page.doc, line))) : text);
  if (gouge.depth !== null && gouge.depth !== undefined) add('largest gouge', link(length(gouge.depth, 4), gouge.line));
  const near = result.smallest_clearance;
  if (near) add('smallest clearance', link(`${length(near.distance_mm)}, ${near.body} to ${near.obstacle}`, near.line));
  else if (worst.clearance_mm !== null && worst.clearance_mm !== undefined) add('smallest clearance', link(`${length(worst.clearance_mm)}, ${worst.clearance_between}`, worst.clearance_line));
  if (worst.cusp_mm) add('largest predicted cusp', length(worst.cusp_mm));
  for (const r of (result.remaining && result.remaining.operations) || []) add(`left: ${r.operation}`, `99 % at most ${length(r.p99_mm)}, largest ${length(r.largest ? r.largest.height_mm : 0)}, permitted ${length(r.limit_mm)}`);
  for (const b of result.budgets || []) add(`gouge budget: ${b.operation}`, `${length(b.against_mesh_mm)}, used ${length(b.largest_gouge_mm)}`);
  for (const e of result.efficiency || []) if (e.efficiency) add(`passes over their floor: ${e.operation}`, fixed(e.efficiency, 3));
  const { time_law: law } = result;
  for (const limit of (law && law.held_back_by) || []) if (limit.share > 0.005) add(`limited by ${limit.limit}`, `${fixed(100 * limit.share, 1)} % of the cutting time`);
  if (result.certified) add('certified blocks', `${result.certified.certified} of ${result.certified.blocks}`);
  panel.append(h('h2', 'Program'), h('table', h('tbody', rows)));
  const axes = machine.axes.map((axis) => h('tr', h('th', axis.letter), h('td', axis.is_rotary ? `${fixed((axis.max_velocity * 180) / Math.PI, 1)} °/s` : figure(axis.max_velocity * 60, 'mm/min')), h('td', axis.max_acceleration ? (axis.is_rotary ? `${fixed((axis.max_acceleration * 180) / Math.PI, 0)} °/s²` : `${fixed(axis.max_acceleration, 0)} mm/s²`) : 'no acceleration')));
  panel.append(h('h2', `Machine: ${machine.name}`), h('table', h('tbody', axes)));
  if (machine.assumed.length) panel.append(h('p', `Typical values, not the machine's: ${machine.assumed.join(', ').replaceAll('_', ' ')}.`));
  panel.append(h('h2', 'About this page'), h('p', `Positions are those of the text, read back line by line. ${motion.by_law ? 'Times are within velocity, acceleration and jerk of every axis.' : 'Times are at constant speed.'} Speeds and accelerations in the plots are means of blocks.`));
  const notes = [...thinned, ...notShown, ...(motion.n_untimed ? [`${untimedText(motion.n_untimed)}: 0.1 s is shown for each`] : []), ...(motion.not_followed ? [`not followed: ${motion.not_followed}`] : [])];
  panel.append(h('ul', notes.map((note) => h('li', note))));
}
