// The setup sheet: what an operator needs at the machine, for A4.

import { h, svg } from './dom.js';
import { linePlace, linePlaces } from './lines.js';
import { axisValue, clock, fixed, isInch, length, lengthUnit, speed } from './units.js';

const VERDICTS = { good: 'ok', partly_tested: 'warn', incomplete: 'warn', not_verified: 'warn', faulty: 'bad' };

/** Words of a verdict and the kind that it is shown in. */
export const verdictText = (verdict) => [verdict.stamp, VERDICTS[verdict.state]];

const row = (name, ...value) => h('tr', h('th', name), h('td', ...value));
const section = (title, ...content) => h('section', h('h2', title), ...content);
const table = (head, rows, kind = 'table') => h(kind, head && h('thead', h('tr', head.map((cell) => h('th', cell)))), h('tbody', rows));

/** The measure of a finding with its name and unit: `depth 0.123 mm`, `angle 12.000°`. */
export function measureText(measure) {
  if (!measure) return '';
  const [key, value] = Object.entries(measure)[0];
  if (key.endsWith('_mm')) return `${key.slice(0, -3).replaceAll('_', ' ')} ${length(value)}`;
  if (key.endsWith('_deg')) return `${key.slice(0, -4).replaceAll('_', ' ')} ${fixed(value, 3)}°`;
  if (key.endsWith('ratio')) return `${key.replaceAll('_', ' ')} ${fixed(value, 3)}`;
  return `${key.replaceAll('_', ' ')} ${fixed(value, 3)}`;
}

export const kindText = (kind) => String(kind ?? 'of no kind').replaceAll('_', ' ');

/** Whether the page is that of a program from anywhere: what the job says need not be the program's. */
const isForeign = (doc) => doc.result.format === 'facemill-verification/1';

/** A line of the program with its text: a control counts blocks, not lines of a file. */
export function fileLine(doc, line) {
  const text = doc.line_texts[line];
  return text ? [`${linePlace(doc, line)}: `, h('span.mono', text)] : [linePlace(doc, line)];
}

/** Returns the sheet as an element. */
export function sheet(doc) {
  const { setup, machine, tools, program, verdict } = doc;
  const [text, kind] = verdictText(verdict);
  const [number, of] = setup.number;
  // The head of a table is on every page that it is printed on.
  return h('article.sheet', h('table.paged', h('thead', h('tr', h('td', h(`div.running.${kind}`, h('b', text), ` · ${doc.job} · ${setup.file.name} · ${program.file}`)))), h('tbody', h('tr', h('td.paper',
    h('header',
      h('div', h('h1', 'Setup sheet'), h('p.sheet-job', doc.job), h('p', `Setup ${number} of ${of}: ${setup.file.name}`)),
      h(`div.stamp.${kind}`, text, verdict.because.concat(verdict.notes).map((why) => h('small', why)))),
    section('Program', programs(doc)),
    section('Control and machine', control(doc)),
    section('Work offset', offset(doc)),
    section('What the control must be set to', controlSettings(doc)),
    section('How the part lies on the table', h('div.drawings', drawing(doc, 'top'), drawing(doc, 'front')), standing(doc)),
    section('Distances to measure', distances(doc)),
    section('Tools', tools.map((tool, k) => toolBlock(tool, k, tools.length, doc))),
    section('Axis travel', travel(machine)),
    section('Times', times(doc)),
    section(isForeign(doc) ? 'Spindle, feeds and coolant of the job, not of the program' : 'Spindle, feeds and coolant', feeds(doc)),
    section('First motion', firstMotion(doc)),
    section('Findings', findings(doc)),
    section('Assumptions to check at the control', assumptions(doc)),
    h('footer', h('p', `Checksum of ${program.file}: ${program.blake3}`), h('table.signatures', h('tbody', h('tr', ['Set up by', 'Checked by', 'Date'].map((who) => h('td', who)))))))))));
}

function controlSettings(doc) {
  const notes = [isForeign(doc) && 'From the text of the program, the machine file and the tool of the job.', isInch() && 'Numbers in these texts are mm and degrees.'];
  return [table(null, doc.control_settings.map(({ name, value }) => row(name, value)), 'table.pairs'), notes.filter(Boolean).map((note) => h('p.note', note))];
}

/** Distances between the part and what can be touched on the table. */
function distances(doc) {
  const { setup, machine } = doc;
  const part = boxOf(setup.outlines, ['part']);
  if (!part) return h('p', 'The job has no part.');
  const rows = [];
  const add = (from, name, ...values) => rows.push(h('tr', h('td', from), h('td', name), values.map((value) => h('td.number', value))));
  const sides = [0, 1, 2].map((k) => part[k]);
  const origin = [3, 7, 11].map((k) => setup.table_from_work[k]);
  add('origin of the table', 'low side of the part', ...sides.map(([low]) => length(low, 2)));
  add('origin of the table', 'high side of the part', ...sides.map(([, high]) => length(high, 2)));
  add('origin of the workpiece frame', 'low side of the part', ...sides.map(([low], k) => length(low - origin[k], 2)));
  add('origin of the workpiece frame', 'high side of the part', ...sides.map(([, high], k) => length(high - origin[k], 2)));
  for (const body of setup.outlines.filter((o) => o.role === 'table')) {
    const box = boxOf([body], ['table']);
    add(`low side of ${body.name}`, 'low side of the part', ...sides.map(([low], k) => length(low - box[k][0], 2)));
    add('high side of the part', `high side of ${body.name}`, ...sides.map(([, high], k) => length(box[k][1] - high, 2)));
  }
  const others = setup.outlines.filter((o) => o.role === 'fixture' || o.role === 'check');
  const outline = setup.outlines.find((o) => o.role === 'part');
  const held = others.map((o) => {
    const box = boxOf([o], [o.role]);
    const gap = gapOf(outline.top, o.top);
    const span = ([low, high]) => `${length(low, 1, true)} to ${length(high, 1, true)}`;
    return h('tr', h('td', o.name), box.map((range) => h('td.number', span(range))), h('td.number', gap > 0 ? length(gap, 1) : 'over or under it'));
  });
  return [
    table(['From', 'To', 'X', 'Y', 'Z'], rows),
    others.length ? table([`Clamp or check surface (${lengthUnit()}, from the origin of the table)`, 'X', 'Y', 'Z', 'Gap to the part'], held) : h('p', 'The job names no clamps: nothing has been tested against any. Add them to the job before clamping where tool or head pass.'),
    h('p.note', `Along the axes of the table, with ${machine.axes.filter((a) => a.is_rotary).map((a) => a.letter).join(' and ')} at home. Low and high sides are the extremes along each axis, of the part those of its mesh; a gap is seen from above, between hulls.`),
  ];
}

/** Distance of two convex outlines; 0 if they overlap. */
function gapOf(a, b) {
  if (!a.length || !b.length) return NaN;
  const isInside = (p, hull) => hull.length > 2 && hull.every((q, k) => {
    const r = hull[(k + 1) % hull.length];
    return (r[0] - q[0]) * (p[1] - q[1]) - (r[1] - q[1]) * (p[0] - q[0]) >= 0;
  });
  if (a.some((p) => isInside(p, b)) || b.some((p) => isInside(p, a))) return 0;
  const edges = (hull) => hull.map((p, k) => [p, hull[(k + 1) % hull.length]]);
  const side = (p, [q, r]) => (r[0] - q[0]) * (p[1] - q[1]) - (r[1] - q[1]) * (p[0] - q[0]);
  const crosses = (e, f) => side(e[0], f) * side(e[1], f) < 0 && side(f[0], e) * side(f[1], e) < 0;
  if (edges(a).some((e) => edges(b).some((f) => crosses(e, f)))) return 0;
  const toEdge = (p, [q, r]) => {
    const [dx, dy] = [r[0] - q[0], r[1] - q[1]];
    const share = Math.min(Math.max(((p[0] - q[0]) * dx + (p[1] - q[1]) * dy) / (dx * dx + dy * dy || 1), 0), 1);
    return Math.hypot(q[0] + share * dx - p[0], q[1] + share * dy - p[1]);
  };
  const least = (points, hull) => Math.min(...points.map((p) => Math.min(...edges(hull).map((e) => toEdge(p, e)))));
  return Math.min(least(a, b), least(b, a));
}

function programs(doc) {
  const listed = doc.result.programs || (doc.result.program ? [doc.result.program] : [doc.program]);
  const rows = listed.map((p) => h('tr', h('td', p.file), h('td.mono', p.blake3)));
  return [table(['File', 'BLAKE3 checksum'], rows), h('p.note', `${doc.program.lines} lines, played on this page: ${doc.program.file}. Compare the checksum (b3sum and the name of the file) before the first run.`)];
}

function control(doc) {
  const { machine, setup, result } = doc;
  return table(null, [
    row('Control', doc.program.dialect),
    row('Machine', machine.name),
    row('Axes', machine.axes.map((a) => a.letter).join(' ')),
    row('Machine values that are typical, not measured', machine.assumed.length ? machine.assumed.map((a) => a.replaceAll('_', ' ')).join(', ') : 'none'),
    !isForeign(doc) && row('Rapids keep from part, stock and fixtures', length(setup.file.rapid_clearance_mm ?? 5)),
    row(isForeign(doc) ? 'Sheet made by' : 'Made by', `facemill ${doc.facemill}`, result.made_from && result.made_from.inputs ? ` from ${result.made_from.inputs.map((i) => i.file).join(', ')}` : ''),
  ].filter(Boolean), 'table.pairs');
}

function offset(doc) {
  const { machine } = doc;
  const { work_offset: at } = doc.setup;
  const zero = at.program_zero;
  const rows = machine.axes.map((axis, k) => {
    const value = (x) => h('td.number', axisValue(axis, x, axis.is_rotary ? 4 : 3));
    return h('tr', h('td', axis.letter), value(at.axes[k].value), zero && value(at.axes[k].reading_at_datum), h('td', how(axis, at, at.axes[k])));
  });
  const head = ['Axis', 'Value in the register', zero && 'Reading expected at the workpiece datum', 'How to check'];
  return [
    h('p', 'Register ', h('b', at.register), '. Positions of the scales at which the words of the program are 0, without the length of a tool:'),
    table(head.filter(Boolean), rows),
    zero && h('p', 'Program zero on the table: ', h('b', placeText(zero)), at.is_same_frame ? ', the datum of the workpiece frame.' : '. It is not the datum of the workpiece frame: a probe at the datum reads the third column, not the register.'),
    zero ? h('p.note', `Probe with all rotary axes at their offsets. Positions count from the gauge line of the spindle: take the length of the probe off.${at.is_same_frame ? '' : ' If a reading differs, the part lies elsewhere: put it right, or plan again with the place measured. The register keeps its values.'}`)
      : h('p.note', 'The words of this machine have no frame on its table: the values are those of axes, and no probe at the part reads them.'),
  ];
}

const placeText = (p) => `X ${length(p[0])}, Y ${length(p[1])}, Z ${length(p[2])}`;

function how(axis, at, { probe_lengths: share }) {
  if (axis.is_rotary) return 'Zero of the scale; set the value, then check that the part lies as drawn with a dial along an edge.';
  if (!at.program_zero) return 'Axis value; do not probe.';
  if (!/^[XYZ]$/.test(axis.letter)) return 'Keep the axis at the value while the others are probed.';
  const off = Math.abs(share) < 1e-6 ? '' : `, less ${Math.abs(share - 1) < 1e-6 ? '' : `${fixed(share, 4)} times `}the length of the probe,`;
  return `Probe the datum of the workpiece frame along ${axis.letter}; compare the reading${off} with the ${at.is_same_frame ? 'value' : 'third column'}.`;
}

/** Box around points of the outlines of a role, table frame. */
function boxOf(outlines, roles) {
  const of = outlines.filter((o) => roles.includes(o.role));
  const x = of.flatMap((o) => o.top.map((p) => p[0]));
  const y = of.flatMap((o) => o.top.map((p) => p[1]));
  const z = of.flatMap((o) => o.front.map((p) => p[1]));
  const range = (all) => [Math.min(...all), Math.max(...all)];
  return x.length ? [range(x), range(y), range(z)] : null;
}

function standing(doc) {
  const { setup } = doc;
  const m = setup.table_from_work;
  const part = boxOf(setup.outlines, ['part']);
  const stock = setup.stock_box;
  const others = setup.outlines.filter((o) => o.role === 'fixture' || o.role === 'check');
  const span = ([low, high]) => `${length(low)} to ${length(high)}`;
  return table(null, [
    row('Origin of the workpiece frame on the table', placeText([m[3], m[7], m[11]])),
    setup.work_offset.program_zero && row('Program zero on the table', placeText(setup.work_offset.program_zero)),
    row('Turn of the workpiece frame on the table', turnText(m)),
    part && row('Part on the table, to measure', h('span', `X ${span(part[0])}`), h('br'), `Y ${span(part[1])}`, h('br'), `Z ${span(part[2])} (above the table's frame)`),
    stock && row('Stock box, workpiece frame', stock[0].map((low, k) => `${'XYZ'[k]} ${length(low)} to ${length(stock[1][k])} (${length(stock[1][k] - low)})`).join('; ')),
    row('Stock', stockText(setup.file.stock)),
    row('Clamps and surfaces to keep off', others.length ? others.map((o) => o.name).join(', ') : 'none named in the job'),
  ].filter(Boolean), 'table.pairs');
}

function turnText(m) {
  const angle = Math.acos(Math.min(Math.max((m[0] + m[5] + m[10] - 1) / 2, -1), 1));
  if (angle < 1e-9) return 'none';
  const axis = [m[9] - m[6], m[2] - m[8], m[4] - m[1]].map((x) => x / (2 * Math.sin(angle) || 1));
  return `${fixed((angle * 180) / Math.PI, 4)}° about (${axis.map((x) => fixed(x, 4)).join(', ')})`;
}

function stockText(stock) {
  const [kind, value] = Object.entries(stock)[0];
  if (kind === 'offset') return `layer of ${length(value.allowance_mm)} on the part`;
  return kind === 'mesh' ? `mesh ${value.file || ''}` : kind;
}

/** Drawing of what stands on the table, from above or from the front. */
function drawing(doc, side) {
  const { outlines, table_from_work: m, work_offset: offset } = doc.setup;
  const key = side === 'top' ? 'top' : 'front';
  const seen = ([px, py, pz]) => [px, side === 'top' ? py : pz];
  const origins = [['table', [0, 0], 'of-table'], ['workpiece', seen([m[3], m[7], m[11]]), 'of-work']];
  const shown = outlines.filter((o) => o[key].length > 2);
  const near = shown.filter((o) => o.role !== 'table');
  const points = (near.length ? near : shown).flatMap((o) => o[key]).concat(origins.map(([, at]) => at));
  const low = [0, 1].map((k) => Math.min(...points.map((p) => p[k])));
  const high = [0, 1].map((k) => Math.max(...points.map((p) => p[k])));
  // Program zero may be far away: the part has to stay visible.
  const zero = offset.program_zero && seen(offset.program_zero);
  const reach = 1.5 * Math.max(high[0] - low[0], high[1] - low[1], 1);
  const isOutside = Boolean(zero) && [0, 1].some((k) => zero[k] < low[k] - reach || zero[k] > high[k] + reach);
  if (zero && !isOutside) {
    origins.push(['program zero', zero, 'of-program']);
    for (const k of [0, 1]) [low[k], high[k]] = [Math.min(low[k], zero[k]), Math.max(high[k], zero[k])];
  }
  const span = Math.max(high[0] - low[0], high[1] - low[1], 1);
  const [W, H] = [330, 300];
  const scale = 196 / span;
  const middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
  const x = (value) => W / 2 + (value - middle[0]) * scale;
  const y = (value) => H / 2 - (value - middle[1]) * scale - 6;
  const path = (o) => svg('polygon', { points: o[key].map((p) => `${x(p[0]).toFixed(1)},${y(p[1]).toFixed(1)}`).join(' '), class: `outline ${o.role}` }, svg('title', o.name));
  const ordered = ['table', 'stock', 'part', 'check', 'fixture'].flatMap((role) => shown.filter((o) => o.role === role));
  const part = boxOf(outlines, ['part']) || [[low[0], high[0]], [low[1], high[1]], [low[1], high[1]]];
  const [h0, v0] = [part[0], side === 'top' ? part[1] : part[2]];
  const axis2 = side === 'top' ? 'Y' : 'Z';
  const origin = (px, py, name, kind) => [
    svg('circle', { cx: x(px), cy: y(py), r: 4, class: `origin ${kind}` }),
    svg('path', { d: `M${x(px) - 9} ${y(py)}h18M${x(px)} ${y(py) - 9}v18`, class: `origin ${kind}` }),
    svg('text', { x: x(px) + 7, y: y(py) - 7, class: 'label' }, name),
  ];
  const across = (a, b, at, name) => {
    const [x1, x2] = [x(a), x(b)];
    return [
      svg('path', { d: `M${x1} ${at}H${x2}M${x1} ${at - 4}v8M${x2} ${at - 4}v8`, class: 'dimension' }),
      svg('text', { x: (x1 + x2) / 2, y: at - 4, class: 'value', 'text-anchor': 'middle' }, name),
    ];
  };
  const up = (a, b, at, name) => {
    const [y1, y2] = [y(a), y(b)];
    return [
      svg('path', { d: `M${at} ${y1}V${y2}M${at - 4} ${y1}h8M${at - 4} ${y2}h8`, class: 'dimension' }),
      svg('text', { transform: `translate(${at - 5} ${(y1 + y2) / 2}) rotate(-90)`, class: 'value', 'text-anchor': 'middle' }, name),
    ];
  };
  // Lowest face above the origin or highest below it, or the lowest where the origin is between.
  const fromOrigin = ([a, b]) => (a > 0 || (a < 0 && b > 0) ? a : b);
  const clip = `clip-${side}`;
  const marks = [];
  for (const [name, at, kind] of origins) {
    const same = marks.find((mark) => Math.hypot(mark.at[0] - at[0], mark.at[1] - at[1]) * scale < 3);
    if (same) same.name += ` = ${name}`;
    else marks.push({ name, at, kind });
  }
  return h('figure',
    svg('svg', { viewBox: `0 0 ${W} ${H}`, width: W, height: H, role: 'img', 'aria-label': `part on the table from the ${side}` },
      svg('defs', svg('clipPath', { id: clip }, svg('rect', { x: 0, y: 0, width: W, height: H - 14 }))),
      svg('g', { 'clip-path': `url(#${clip})` }, ordered.map(path)),
      across(h0[0], h0[1], H - 22, length(h0[1] - h0[0], 1)), up(v0[0], v0[1], 22, length(v0[1] - v0[0], 1)),
      // From the origin of the table to the nearer faces of the part.
      fromOrigin(h0) && across(0, fromOrigin(h0), H - 42, length(Math.abs(fromOrigin(h0)), 1)), fromOrigin(v0) && up(0, fromOrigin(v0), 44, length(Math.abs(fromOrigin(v0)), 1)),
      marks.map(({ name, at, kind }) => origin(at[0], at[1], name, kind)),
      svg('text', { x: W - 6, y: 14, class: 'label', 'text-anchor': 'end' }, side === 'top' ? 'from above: X right, Y up' : `from the front: X right, ${axis2} up`)),
    h('figcaption', `Hulls of what stands on the table, ${side === 'top' ? 'from above' : 'from the front'}; ${lengthUnit()}.${isOutside ? ` Program zero is outside: ${placeText(offset.program_zero)}.` : ''}`));
}

/** Drawing of a tool assembly, in scale. */
export function toolDrawing(tool) {
  const stack = (sections, from) => {
    let z = from;
    return sections.map((s) => [z, (z += s.length_mm), s.diameter_low_mm / 2, s.diameter_high_mm / 2]);
  };
  const body = stack(tool.body.sections, tool.flute_length_mm);
  const holder = stack(tool.holder.sections, tool.stick_out_mm);
  const [R, r, flute] = [tool.radius_mm, tool.corner_radius_mm, tool.flute_length_mm];
  const widest = Math.max(R, ...[...body, ...holder].map((s) => Math.max(s[2], s[3])));
  const tall = Math.max(tool.gauge_length_mm, ...holder.map((s) => s[1]), ...body.map((s) => s[1]));
  const [W, H] = [250, 250];
  const scale = Math.min((H - 36) / tall, 120 / (2 * widest));
  const x = (radius) => 80 + radius * scale;
  const y = (z) => H - 18 - z * scale;
  const frustum = ([z1, z2, r1, r2], kind) => svg('polygon', { points: [[-r1, z1], [r1, z1], [r2, z2], [-r2, z2]].map(([a, b]) => `${x(a)},${y(b)}`).join(' '), class: kind });
  const corner = r * scale;
  const cutter = svg('path', { class: 'tool-cutter', d: `M${x(-R)} ${y(flute)}V${y(r)}a${corner} ${corner} 0 0 0 ${corner} ${corner}H${x(R - r)}a${corner} ${corner} 0 0 0 ${corner} ${-corner}V${y(flute)}Z` });
  const dimension = (z, at, name) => [
    svg('path', { d: `M${at} ${y(0)}V${y(z)}M${at - 3} ${y(0)}h6M${at - 3} ${y(z)}h6M${x(widest * 0.2)} ${y(z)}H${at}`, class: 'dimension' }),
    svg('text', { x: at + 4, y: (y(0) + y(z)) / 2, class: 'value' }, name),
  ];
  return svg('svg', { viewBox: `0 0 ${W} ${H}`, width: W, height: H, role: 'img', 'aria-label': `tool ${tool.number}` },
    holder.map((s) => frustum(s, 'tool-holder')), body.map((s) => frustum(s, 'tool-body')), cutter,
    svg('path', { d: `M${x(0)} ${y(0) + 10}V${y(tall) - 8}`, class: 'centre' }),
    svg('path', { d: `M${x(-widest) - 6} ${y(tool.gauge_length_mm)}H${x(widest) + 6}`, class: 'gauge' }),
    dimension(tool.stick_out_mm, 162, length(tool.stick_out_mm, 1, true)), dimension(tool.gauge_length_mm, 205, length(tool.gauge_length_mm, 1, true)),
    svg('text', { x: 158, y: 12, class: 'label' }, 'stick-out · gauge'));
}

function toolBlock(tool, k, n, doc) {
  const operations = doc.setup.operations.filter((o) => n === 1 || (o.head ?? 1) === k + 1);
  return h('div.tool', toolDrawing(tool), table(null, [
    row('Tool', h('b', `T${tool.number}`), ` ${tool.name}`, n > 1 ? ` (head ${k + 1})` : ''),
    row('Place of the length', tool.length_place),
    row('Diameter D, radius R, corner r', `${length(2 * tool.radius_mm)}, ${length(tool.radius_mm)}, ${length(tool.corner_radius_mm)}`),
    row('Gauge length to enter', h('b', length(tool.gauge_length_mm))),
    row('Stick-out from the holder', length(tool.stick_out_mm)),
    row('Flute length, teeth', `${length(tool.flute_length_mm)}, ${tool.n_inserts}`),
    row(isForeign(doc) ? 'Spindle, as the tool needs it' : 'Spindle', tool.spindle_rotation === 'clockwise' ? 'clockwise (M3)' : 'counterclockwise (M4)'),
    row('Largest ramp; dead core', `${fixed(tool.max_ramp_angle_deg, 1)}°; radius ${length(tool.dead_core_radius_mm || 0)}`),
    row(isForeign(doc) ? 'Operations of the job' : 'Operations', operations.map((o) => o.name).join(', ') || '–'),
    row('Time in cut; in rapids', `${clock(tool.times[0])}; ${clock(tool.times[1])}`),
  ], 'table.pairs'));
}

function travel(machine) {
  const rows = machine.axes.map((axis) => {
    const [low, high] = axis.limits;
    const at = axis.travel;
    const margins = at ? [low === null ? Infinity : at[0] - low, high === null ? Infinity : high - at[1]] : [NaN, NaN];
    const margin = Math.min(...margins);
    const value = (v) => (v === null || v === undefined ? '–' : axisValue(axis, v));
    const marginText = margin === Infinity ? 'no stops' : Number.isFinite(margin) ? axisValue(axis, margin) : '–';
    return h('tr', h('td', axis.letter), h('td.number', at ? value(at[0]) : '–'), h('td.number', at ? value(at[1]) : '–'), h('td.number', low === null ? 'no stop' : value(low)), h('td.number', high === null ? 'no stop' : value(high)), h(`td.number${margin < 0 ? '.bad' : ''}`, marginText));
  });
  return [table(['Axis', 'Least', 'Greatest', 'Lower limit', 'Upper limit', 'Margin'], rows), h('p.note', 'Positions of the scales at ends of blocks, as far as the program is followed. The start, the home position, is not among them.')];
}

function times(doc) {
  const { times: t } = doc.result;
  const rows = [];
  for (const part of doc.operation_times || []) rows.push(h('tr', h('td', part.operation || 'before the first operation'), h('td.number', clock(part.cut)), h('td.number', clock(part.rapid))));
  const law = t && t.cutting_s !== null && t.cutting_s !== undefined;
  if (t) rows.push(h('tr.sum', h('td', 'Program'), h('td.number', clock(law ? t.cutting_s : t.constant_cutting_s)), h('td.number', clock(law ? t.rapid_s : t.constant_rapid_s))));
  const note = law ? 'Within velocity, acceleration and jerk of every axis; without tool change and spindle.' : `At constant speed: the real times are longer. ${t && t.no_law_because ? t.no_law_because.join('; ') : ''}`;
  const untimed = doc.motion.n_untimed ? ` ${untimedText(doc.motion.n_untimed)}: their times are not in the table.` : '';
  return [table(['Part', 'At a feed', 'At rapid rate'], rows), h('p.note', note, untimed)];
}

export const untimedText = (n) => (n === 1 ? '1 motion is not timed' : `${n} motions are not timed`);

function feeds(doc) {
  const { setup } = doc;
  const rows = setup.operations.map((o) => h('tr', h('td', o.name), h('td.number', fixed(o.feeds.spindle_rpm, 0)), h('td.number', speed(o.feeds.cutting_mm_min)), h('td.number', speed(o.feeds.approach_mm_min)), h('td', o.feeds.coolant ?? '–')));
  if (rows.length) return [table(['Operation', 'S (1/min)', 'Feed in passes', 'Feed of entries', 'Coolant'], rows), isForeign(doc) ? h('p.note', 'Speeds and coolant of the program are in its text alone: read them there.') : null];
  return h('p', 'The job has no operations: speeds are those of the program.');
}

function firstMotion(doc) {
  const first = doc.first_motion;
  if (!first) return h('p', 'The program moves no axis.');
  const { axes } = doc.machine;
  const moving = axes.filter((_, k) => first.moves[k]).map((axis) => axis.letter);
  const values = axes.map((axis, k) => `${axis.letter} ${axisValue(axis, first.position[k])}`);
  return [h('p', 'In ', fileLine(doc, first.line)), h('p', `Axes that move from home: ${moving.join(', ')}. Machine positions (scales) at its end: ${values.join(', ')}.`), h('p.note', 'Run every new program in the air first, whatever this sheet says: block by block, with the feed override low.')];
}

function findings(doc) {
  const { result } = doc;
  const list = result.findings || [];
  if (!list.length) return h('p', result.verified === false ? 'The program was not run: faults are not known.' : 'None.');
  const rows = list.map((f) => h(`tr${f.isFault ? '.bad' : ''}`, h('td', kindText(f.kind)), h('td', f.first_line === f.last_line ? fileLine(doc, f.first_line) : [`${linePlaces(doc, f.first_line, f.last_line)}, worst in `, fileLine(doc, f.worst_line)]), h('td', measureText(f.measure)), h('td', [f.axis, f.body, f.obstacle].filter(Boolean).join(' / ')), h('td', f.note || '')));
  return table(['Kind', 'Lines', 'Measure', 'Bodies', 'Note'], rows);
}

function assumptions(doc) {
  const list = doc.result.assumptions || [];
  if (!list.length) return h('p', 'None.');
  return h('ul', list.map((a) => h('li', a.text, a.line ? [' In ', fileLine(doc, a.line)] : null)));
}
