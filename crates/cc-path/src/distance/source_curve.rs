//! Curves on a patch that distances are measured from: nodes, smooth tangents and feet.

use nalgebra::{Point3, Unit, Vector3};

/// A polyline on the surface with its smooth normals, oriented.
///
/// Between nodes it is the cubic through them with their tangents, so that a few nodes per radius
/// of curvature are enough: the error is the fourth power of the step.
#[derive(Clone, Debug)]
pub(crate) struct SourceCurve {
    nodes: Vec<Point3<f64>>,
    normals: Vec<Unit<Vector3<f64>>>,
    tangents: Vec<Unit<Vector3<f64>>>,
    /// Triangle of the patch that each node lies in.
    triangles: Vec<u32>,
    /// Way to each node, mm; of a closed curve, one more for the way back to the first.
    ways: Vec<f64>,
    closed: bool,
}

/// A node of a curve as its maker knows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurveNode {
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Unit<Vector3<f64>>,
    /// Triangle of the patch that it lies in.
    pub(crate) triangle: u32,
}

/// Where a place has its foot on a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurvePlace {
    /// Node before the foot.
    pub(crate) node: u32,
    /// Way along the curve, mm.
    pub(crate) way: f64,
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Unit<Vector3<f64>>,
    pub(crate) tangent: Vector3<f64>,
    /// Distance beyond an end of an open curve, along its last tangent, mm; 0 beside the curve.
    pub(crate) beyond: f64,
}

/// Nodes nearer than this share of the mean step are the same node: their chord has no direction.
const SAME_NODE: f64 = 1e-6;

/// Cosine of the turn from which a node is a corner (30°): the curve is straight up to it.
const CORNER: f64 = 0.866;

impl SourceCurve {
    /// `None` where fewer than two nodes, or three of a closed curve, are apart.
    pub(crate) fn new(mut nodes: Vec<CurveNode>, closed: bool) -> Option<Self> {
        let length: f64 = nodes.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum();
        let least = SAME_NODE * length / nodes.len().max(1) as f64;
        nodes.dedup_by(|b, a| (b.position - a.position).norm() <= least);
        if closed && nodes.len() > 1 && (nodes[0].position - nodes[nodes.len() - 1].position).norm() <= least {
            nodes.pop();
        }
        if nodes.len() < if closed { 3 } else { 2 } {
            return None;
        }
        let positions: Vec<Point3<f64>> = nodes.iter().map(|n| n.position).collect();
        let tangents = tangents(&positions, closed)?;
        let mut ways = vec![0.0];
        for k in 0..positions.len() - usize::from(!closed) {
            let step = (positions[(k + 1) % positions.len()] - positions[k]).norm();
            ways.push(ways[k] + step);
        }
        let normals = nodes.iter().map(|n| n.normal).collect();
        let triangles = nodes.iter().map(|n| n.triangle).collect();
        Some(Self { nodes: positions, normals, tangents, triangles, ways, closed })
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Length, mm.
    pub(crate) fn length(&self) -> f64 {
        self.ways[self.ways.len() - 1]
    }

    /// The nodes with the triangles that they lie in.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.triangles.iter().enumerate().map(|(k, &t)| (k as u32, t))
    }

    /// The nodes' places with the triangles that they lie in.
    pub(crate) fn positions(&self) -> impl Iterator<Item = (Point3<f64>, u32)> + '_ {
        self.nodes.iter().copied().zip(self.triangles.iter().copied())
    }

    /// The curve with the part between two ways replaced by another curve, which begins at its
    /// start, or ends at its end; they go over into each other within `blend` (mm).
    pub(crate) fn joined(&self, other: &Self, [from, to]: [f64; 2], at_end: bool, blend: f64) -> Option<Self> {
        let nodes = |curve: &Self, keep: &dyn Fn(f64) -> bool| -> Vec<CurveNode> {
            let all = (0..curve.nodes.len()).filter(|&k| keep(curve.ways[k]));
            let node = |k: usize| CurveNode {
                position: curve.nodes[k],
                normal: curve.normals[k],
                triangle: curve.triangles[k],
            };
            all.map(node).collect()
        };
        let partial = nodes(other, &|_| true);
        let joined = if at_end {
            [nodes(self, &|way| way < from - blend), partial].concat()
        } else {
            [partial, nodes(self, &|way| way > to + blend)].concat()
        };
        Self::new(joined, false)
    }

    /// Value at a way, linear between values at the nodes.
    pub(crate) fn interpolated(&self, way: f64, values: &[f64]) -> f64 {
        let k = self.ways.partition_point(|&w| w <= way).clamp(1, self.ways.len() - 1) - 1;
        let t = ((way - self.ways[k]) / (self.ways[k + 1] - self.ways[k])).clamp(0.0, 1.0);
        values[k] * (1.0 - t) + values[(k + 1) % values.len()] * t
    }

    /// Way of a place ahead of a node, mm: above 0 where the foot comes later.
    fn ahead(&self, k: usize, p: &Point3<f64>) -> f64 {
        self.tangents[k].dot(&(p - self.nodes[k]))
    }

    fn next(&self, k: usize) -> Option<usize> {
        if k + 1 < self.nodes.len() { Some(k + 1) } else { self.closed.then_some(0) }
    }

    fn previous(&self, k: usize) -> Option<usize> {
        if k > 0 { Some(k - 1) } else { self.closed.then_some(self.nodes.len() - 1) }
    }

    /// The foot of a place that is reached from a node going downhill: where the line to the place
    /// is at right angles to the smooth tangent.
    pub(crate) fn foot(&self, p: &Point3<f64>, from: u32) -> CurvePlace {
        let mut k = from as usize;
        let back = self.ahead(k, p) < 0.0;
        // Each node is passed at most once.
        for _ in 0..self.nodes.len() {
            let Some(next) = (if back { self.previous(k) } else { self.next(k) }) else { return self.end(k, p) };
            let is_past = self.ahead(next, p) < 0.0;
            if back != is_past {
                return if back { self.between(next, k, p) } else { self.between(k, next, p) };
            }
            k = next;
        }
        self.end(k, p)
    }

    fn end(&self, k: usize, p: &Point3<f64>) -> CurvePlace {
        CurvePlace {
            node: k as u32,
            way: self.ways[k],
            position: self.nodes[k],
            normal: self.normals[k],
            tangent: self.tangents[k].into_inner(),
            beyond: self.ahead(k, p).abs(),
        }
    }

    /// The foot between a node and the next: the root of (p − c)·T, both linear between the nodes.
    fn between(&self, k: usize, next: usize, p: &Point3<f64>) -> CurvePlace {
        let (a, b) = (self.nodes[k], self.nodes[next]);
        let (chord, turn) = (b - a, self.tangents[next].into_inner() - self.tangents[k].into_inner());
        let off = p - a;
        let constant = self.ahead(k, p);
        let linear = off.dot(&turn) - chord.dot(&self.tangents[k]);
        let square = -chord.dot(&turn);
        let t = root_in_unit(square, linear, constant);
        self.at(k, next, t)
    }

    /// The place a share of the way between two neighbouring nodes.
    fn at(&self, k: usize, next: usize, t: f64) -> CurvePlace {
        let (a, b) = (self.nodes[k], self.nodes[next]);
        let chord = b - a;
        let length = chord.norm();
        let (from, to) = (self.tangents[k].into_inner(), self.tangents[next].into_inner());
        let bulge = if from.dot(&to) > CORNER {
            let straight = chord / length;
            ((from - straight) * (1.0 - t) - (to - straight) * t) * (length * t * (1.0 - t))
        } else {
            Vector3::zeros()
        };
        let normal = self.normals[k].into_inner() * (1.0 - t) + self.normals[next].into_inner() * t;
        CurvePlace {
            node: k as u32,
            way: self.ways[k] + length * t,
            position: a + chord * t + bulge,
            normal: Unit::try_new(normal, 1e-9).unwrap_or(self.normals[k]),
            tangent: from * (1.0 - t) + to * t,
            beyond: 0.0,
        }
    }
}

/// Root in 0..1 of a quadratic that is not negative at 0 and not positive at 1; the nearer end
/// where rounding leaves none.
fn root_in_unit(square: f64, linear: f64, constant: f64) -> f64 {
    let discriminant = linear * linear - 4.0 * square * constant;
    if discriminant < 0.0 {
        return if constant.abs() < (square + linear + constant).abs() { 0.0 } else { 1.0 };
    }
    // The root that goes over into −constant / linear as the square vanishes.
    let t = 2.0 * constant / (-linear + discriminant.sqrt().copysign(-linear));
    if t.is_nan() { 0.5 } else { t.clamp(0.0, 1.0) }
}

/// Tangents at the nodes: of the parabola through each node and its neighbours; at a corner, the
/// bisector.
fn tangents(nodes: &[Point3<f64>], closed: bool) -> Option<Vec<Unit<Vector3<f64>>>> {
    let n = nodes.len();
    let chord = |k: usize| nodes[(k + 1) % n] - nodes[k % n];
    let tangent = |k: usize| {
        let (before, after) = (chord(k + n - 1), chord(k));
        if !closed && (k == 0 || k == n - 1) {
            return end_tangent(&chord, k, n);
        }
        let (lb, la) = (before.norm(), after.norm());
        let mean = before * (la / lb) + after * (lb / la);
        Unit::try_new(mean, 1e-12 * (la + lb)).or_else(|| Unit::try_new(after, 0.0))
    };
    (0..n).map(tangent).collect()
}

/// Tangent at an end of an open curve: that of the parabola through the last three nodes, unless
/// they turn at a corner.
fn end_tangent(chord: &dyn Fn(usize) -> Vector3<f64>, k: usize, n: usize) -> Option<Unit<Vector3<f64>>> {
    let (own, other) = if k == 0 { (chord(0), chord(1)) } else { (chord(n - 2), chord(n.saturating_sub(3))) };
    let straight = Unit::try_new(own, 0.0)?;
    let beside = Unit::try_new(other, 0.0).filter(|o| n > 2 && o.dot(&straight) > CORNER);
    let Some(beside) = beside else { return Some(straight) };
    let share = own.norm() / (own.norm() + other.norm());
    Unit::try_new(straight.into_inner() + (straight.into_inner() - beside.into_inner()) * share, 1e-9)
}
