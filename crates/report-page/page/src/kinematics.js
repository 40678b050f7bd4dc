// Machine kinematics from the rows of its file, in mm and rad. Transforms are 3 × 4, row by row.

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];

export function multiply(a, b) {
  const m = new Array(12);
  for (let r = 0; r < 3; r++) {
    for (let c = 0; c < 4; c++) {
      m[4 * r + c] = a[4 * r] * b[c] + a[4 * r + 1] * b[4 + c] + a[4 * r + 2] * b[8 + c] + (c === 3 ? a[4 * r + 3] : 0);
    }
  }
  return m;
}

/** Inverse of a rigid motion. */
export function inverse(m) {
  const back = (r) => -(m[r] * m[3] + m[4 + r] * m[7] + m[8 + r] * m[11]);
  return [m[0], m[4], m[8], back(0), m[1], m[5], m[9], back(1), m[2], m[6], m[10], back(2)];
}

export function transformed(m, [x, y, z]) {
  return [0, 4, 8].map((r) => m[r] * x + m[r + 1] * y + m[r + 2] * z + m[r + 3]);
}

export function turned(m, [x, y, z]) {
  return [0, 4, 8].map((r) => m[r] * x + m[r + 1] * y + m[r + 2] * z);
}

const radians = (degrees) => (degrees * Math.PI) / 180;

/** RotX(alpha) · TransX(a) · RotZ(theta) · TransZ(d). */
function rowTransform(row, value) {
  const joint = row.joint && (row.joint.prismatic || row.joint.revolute);
  const signed = joint ? (joint.sense === 'negative' ? -value : value) : 0;
  const isLinear = Boolean(row.joint && row.joint.prismatic);
  const alpha = radians(row.alpha_deg || 0);
  const theta = radians(row.theta_deg || 0) + (isLinear ? 0 : signed);
  const d = (row.d_mm || 0) + (isLinear ? signed : 0);
  const [ca, sa, ct, st] = [exactCos(alpha), exactSin(alpha), exactCos(theta), exactSin(theta)];
  return [ct, -st, 0, row.a_mm || 0, st * ca, ct * ca, -sa, -sa * d, st * sa, ct * sa, ca, ca * d];
}

// Quarter turns are exact, so that 6·10⁻¹⁷ does not become an offset at a lever of metres.
const exactSin = (x) => snapped(Math.sin(x));
const exactCos = (x) => snapped(Math.cos(x));
const snapped = (x) => (Math.abs(x) < 2e-16 ? 0 : x);

const axisOf = (row) => row.joint && (row.joint.prismatic || row.joint.revolute).axis;

/** Frames of a machine at positions of its axes. */
export class Machine {
  constructor(data, tableFromWork, gaugeLengths) {
    this.axes = data.axes;
    const index = new Map(data.axes.map((axis, k) => [axis.letter, k]));
    const chain = (rows) => rows.map((row) => ({ row, axis: row.joint ? index.get(axisOf(row)) : -1 }));
    this.table = chain(data.workpiece_rows);
    this.heads = data.tool_rows.map(chain);
    this.tableFromWork = tableFromWork;
    this.gaugeLengths = gaugeLengths;
    this.linear = data.axes.map((axis, k) => k).filter((k) => !data.axes[k].is_rotary);
  }

  /** Bed ← frame behind each row of a chain. */
  frames(chain, q) {
    let m = IDENTITY;
    return chain.map(({ row, axis }) => (m = multiply(m, rowTransform(row, axis < 0 ? 0 : q[axis]))));
  }

  /** Bed ← table. */
  bedFromTable(q) {
    return this.frames(this.table, q).at(-1) || IDENTITY;
  }

  /** Table ← tool of a head: origin at the tip, z toward the spindle. */
  tableFromTool(q, head = 0) {
    const nose = this.frames(this.heads[head], q).at(-1) || IDENTITY;
    const tip = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -this.gaugeLengths[head]];
    return multiply(inverse(this.bedFromTable(q)), multiply(nose, tip));
  }

  /** Tip and tool axis of a head, workpiece frame. */
  pose(q, head = 0) {
    const m = multiply(inverse(this.tableFromWork), this.tableFromTool(q, head));
    return { tip: [m[3], m[7], m[11]], axis: [m[2], m[6], m[10]] };
  }

  /** Position at a fraction of a motion's time. */
  between(from, to, law, t) {
    if (t <= 0) return from;
    if (t >= 1) return to;
    const q = from.map((value, k) => value + (to[k] - value) * t);
    if (law === 1) return this.eachAtItsSpeed(from, to, t);
    if (law === 0) return q;
    const [a, b] = [this.tableFromTool(from), this.tableFromTool(to)];
    return this.withTip(q, [3, 7, 11].map((c) => a[c] + (b[c] - a[c]) * t));
  }

  eachAtItsSpeed(from, to, t) {
    const times = from.map((value, k) => Math.abs(to[k] - value) / this.axes[k].max_velocity);
    const all = Math.max(...times);
    return from.map((value, k) => (times[k] > 0 ? value + (to[k] - value) * Math.min(1, (t * all) / times[k]) : value));
  }

  /** The position with linear axes that bring the tip there; as it is with two linear axes. */
  withTip(q, tip) {
    if (this.linear.length !== 3) return q;
    const at = (p) => {
      const m = this.tableFromTool(p);
      return [m[3], m[7], m[11]];
    };
    const zero = at(q);
    const columns = this.linear.map((k) => {
      const p = q.slice();
      p[k] += 1000;
      return at(p).map((x, c) => (x - zero[c]) / 1000);
    });
    const right = tip.map((x, c) => x - zero[c]);
    const [u, v, w] = columns;
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const det = dot(u, cross(v, w));
    if (Math.abs(det) < 1e-9) return q;
    const steps = [dot(right, cross(v, w)) / det, dot(right, cross(w, u)) / det, dot(right, cross(u, v)) / det];
    const p = q.slice();
    this.linear.forEach((k, c) => (p[k] += steps[c]));
    return p;
  }
}
