use facemill_surface_model::{LevelCurve, level_curves_among};
use nalgebra::{Point3, Unit, Vector3};

use crate::layout::level_set::LevelSet;
use crate::layout::scallop::surface_path::SurfacePath;
use crate::strategy::patch::Patch;
use crate::strategy::settings::Direction;

/// A section of the patch: one piece per triangle, the higher levels to the left seen from outside.
///
/// A place on it is its way along the chords from node to node, mm.
pub(crate) struct Curve<'a> {
    patch: &'a Patch<'a>,
    set: LevelSet<'a>,
    /// Where the curve crosses the patch's edges; of a closed curve, the last is the first again.
    nodes: Vec<Point3<f64>>,
    /// The triangle between each node and the next.
    triangles: Vec<u32>,
    /// Smooth normals at the beginning and the end of each piece: they differ from piece to piece
    /// at creases.
    normals: Vec<[Unit<Vector3<f64>>; 2]>,
    /// Where the set is not linear, the corner that each piece cuts off its triangle.
    lone: Vec<LoneCorner>,
    /// Distance of each piece from its chord at the middle, mm.
    bulges: Vec<f64>,
    /// Way to each node, mm.
    ways: Vec<f64>,
    /// Direction of the feed at each node, of a curve on a field or a path that is given by its
    /// nodes; empty on others.
    tangents: Vec<Vector3<f64>>,
    pub(crate) closed: bool,
    /// Whether it is open, but does not end at a border.
    pub(crate) winds: bool,
}

/// The corner of a triangle that is on one side of a level, and both others on the other side.
#[derive(Clone, Copy)]
struct LoneCorner {
    /// Its index in the triangle.
    index: u8,
    /// Whether it is above the level, or on it.
    is_above: bool,
    /// The value of the set there.
    value: f64,
    /// Shares of both sides from there at which the piece begins and ends.
    shares: [f64; 2],
}

/// The curves of a level set.
pub(crate) struct TracedLevel<'a> {
    pub(crate) set: LevelSet<'a>,
    pub(crate) curves: Vec<Curve<'a>>,
    /// As in [`PassLevel`](crate::layout::pass_level::PassLevel).
    pub(crate) starts: Option<Direction>,
}

impl<'a> TracedLevel<'a> {
    /// The curves of paths, with tangents of smooth curves through nodes about `spacing` (mm)
    /// apart.
    pub(crate) fn of_paths(patch: &'a Patch<'a>, paths: &[SurfacePath], level: f64, spacing: f64) -> Self {
        let set = LevelSet::Path { level };
        let curves = paths.iter().filter_map(|p| Curve::of_path(patch, set, p, spacing)).collect();
        Self { set, curves, starts: None }
    }
}

/// A place on a curve.
#[derive(Clone, Copy)]
pub(crate) struct TracePoint {
    /// Way from the beginning, mm.
    pub(crate) way: f64,
    /// The piece it lies on.
    pub(crate) piece: usize,
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Unit<Vector3<f64>>,
}

/// The sections by a level set, in the order of the patch's triangles; `among` are those that reach
/// it, in rising order, and `values` those of the set at their corners.
pub(crate) fn trace<'a>(patch: &'a Patch<'a>, set: LevelSet<'a>, values: &[f64], among: &[u32]) -> Vec<Curve<'a>> {
    level_curves_among(&patch.mesh, &patch.edges, values, set.level(), among.iter().copied())
        .into_iter()
        .filter_map(|c| Curve::new(patch, set, values, &c))
        .flat_map(Curve::parts)
        .collect()
}

impl<'a> Curve<'a> {
    /// `None` where nothing is left of it once its nodes have been put exactly on the level.
    fn new(patch: &'a Patch<'a>, set: LevelSet<'a>, values: &[f64], curve: &LevelCurve) -> Option<Self> {
        let (mut nodes, mut triangles): (Vec<Point3<f64>>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut tangents: Vec<Vector3<f64>> = Vec::new();
        for point in &curve.points {
            let [a, b] = point.edge.map(|v| patch.mesh.vertices()[v as usize]);
            let crossing = || set.crossing(&a, &b, point.edge.map(|v| values[v as usize]));
            let node = if set.is_linear() { point.position } else { a + (b - a) * crossing() };
            if nodes.last() == Some(&node) {
                nodes.pop();
                triangles.pop();
                tangents.pop();
            }
            if let LevelSet::Field { gradients, .. } = set {
                let gradient = point.edge.map(|v| gradients[v as usize]);
                let gradient = gradient[0].lerp(&gradient[1], point.fraction);
                tangents.push(gradient.cross(&patch.normal(point.triangle, &node)));
            }
            nodes.push(node);
            triangles.push(point.triangle);
        }
        if curve.closed {
            nodes.push(nodes[0]);
            tangents.extend(tangents.first().copied());
        } else {
            triangles.pop();
        }
        Self::through(patch, set, nodes, triangles, tangents, [curve.closed, false])
    }

    /// The curve of a path, with the tangents of the smooth curve through nodes about `spacing`
    /// (mm) apart.
    pub(crate) fn of_path(patch: &'a Patch<'a>, set: LevelSet<'a>, path: &SurfacePath, spacing: f64) -> Option<Self> {
        let source = path.source(patch, spacing)?;
        let (mut nodes, mut triangles): (Vec<Point3<f64>>, Vec<u32>) = (Vec::new(), Vec::new());
        for (&node, &triangle) in path.nodes.iter().zip(&path.triangles) {
            if nodes.last() != Some(&node) {
                nodes.push(node);
                triangles.push(triangle);
            }
        }
        let mut hint = 0;
        let tangent = |p: &Point3<f64>| {
            let at = source.foot(p, hint);
            hint = at.node;
            at.tangent
        };
        let mut tangents: Vec<Vector3<f64>> = nodes.iter().map(tangent).collect();
        if path.closed {
            nodes.push(nodes[0]);
            tangents.push(tangents[0]);
        } else {
            triangles.pop();
        }
        Self::through(patch, set, nodes, triangles, tangents, [path.closed, false])
    }

    /// An open curve that winds around and does not end at a border, through nodes with the
    /// triangle between each and the next. `None` where it has no length.
    pub(crate) fn wound(
        patch: &'a Patch<'a>,
        set: LevelSet<'a>,
        nodes: &[Point3<f64>],
        triangles: &[u32],
        tangents: &[Vector3<f64>],
    ) -> Option<Self> {
        let mut kept: Vec<usize> = Vec::with_capacity(nodes.len());
        for k in 0..nodes.len() {
            // Of nodes at the same place, the last one continues the curve.
            if kept.last().is_some_and(|&last| nodes[last] == nodes[k]) {
                kept.pop();
            }
            kept.push(k);
        }
        let before = kept.split_last()?.1;
        let triangles = before.iter().map(|&k| triangles[k.min(triangles.len() - 1)]).collect();
        let tangents = kept.iter().map(|&k| tangents[k]).collect();
        let nodes = kept.iter().map(|&k| nodes[k]).collect();
        Self::through(patch, set, nodes, triangles, tangents, [false, true])
    }

    /// The curve through nodes with the triangle between each and the next; `None` where there is
    /// none.
    fn through(
        patch: &'a Patch<'a>,
        set: LevelSet<'a>,
        nodes: Vec<Point3<f64>>,
        triangles: Vec<u32>,
        tangents: Vec<Vector3<f64>>,
        [closed, winds]: [bool; 2],
    ) -> Option<Self> {
        if triangles.is_empty() {
            return None;
        }
        let (normals, lone, bulges, ways) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut this = Self { patch, set, nodes, triangles, normals, lone, bulges, ways, tangents, closed, winds };
        this.measure();
        Some(this)
    }

    /// The parts of it that the pass runs over, each with one node more at its ends.
    fn parts(self) -> Vec<Self> {
        let covered: Vec<bool> = self.nodes.iter().map(|p| self.set.covers(p)).collect();
        if covered.iter().all(|&c| c) {
            return vec![self];
        }
        let mut parts = Vec::new();
        let mut from = 0;
        while let Some(first) = (from..covered.len()).find(|&k| covered[k]) {
            let end = (first..covered.len()).find(|&k| !covered[k]).unwrap_or(covered.len());
            let (start, last) = (first.saturating_sub(1), end.min(covered.len() - 1));
            if last > start {
                parts.push(self.part(start, last));
            }
            from = end;
        }
        parts
    }

    /// The open part between two nodes.
    fn part(&self, start: usize, last: usize) -> Self {
        Self {
            patch: self.patch,
            set: self.set,
            nodes: self.nodes[start..=last].to_vec(),
            triangles: self.triangles[start..last].to_vec(),
            normals: self.normals[start..last].to_vec(),
            lone: self.lone.get(start..last).unwrap_or_default().to_vec(),
            bulges: self.bulges[start..last].to_vec(),
            ways: self.ways[start..=last].iter().map(|w| w - self.ways[start]).collect(),
            tangents: self.tangents.get(start..=last).unwrap_or_default().to_vec(),
            closed: false,
            winds: false,
        }
    }

    fn measure(&mut self) {
        let ends = |(k, &t): (usize, &u32)| [self.nodes[k], self.nodes[k + 1]].map(|p| self.patch.normal(t, &p));
        self.normals = self.triangles.iter().enumerate().map(ends).collect();
        let lone = if self.set.is_linear() {
            Vec::new()
        } else {
            (0..self.triangles.len()).map(|k| self.lone_corner(k)).collect()
        };
        self.lone = lone;
        self.bulges = (0..self.triangles.len()).map(|k| self.bulge(k)).collect();
        self.ways = std::iter::once(0.0)
            .chain(self.nodes.windows(2).scan(0.0, |way, w| {
                *way += (w[1] - w[0]).norm();
                Some(*way)
            }))
            .collect();
    }

    fn bulge(&self, piece: usize) -> f64 {
        let chord = self.nodes[piece + 1] - self.nodes[piece];
        let off = self.inside(piece, 0.5) - self.nodes[piece];
        (off - chord * (off.dot(&chord) / chord.norm_squared())).norm()
    }

    /// Lets a closed curve begin and end at its node nearest to `p`; leaves an open one as it is.
    pub(crate) fn cut_open_near(&mut self, p: &Point3<f64>) {
        if !self.closed {
            return;
        }
        let distance_sq = |k: &usize| (self.nodes[*k] - p).norm_squared();
        let start = (0..self.triangles.len()).min_by(|a, b| distance_sq(a).total_cmp(&distance_sq(b))).unwrap_or(0);
        self.nodes.pop();
        self.nodes.rotate_left(start);
        self.nodes.push(self.nodes[0]);
        self.triangles.rotate_left(start);
        if self.tangents.pop().is_some() {
            self.tangents.rotate_left(start);
            self.tangents.push(self.tangents[0]);
        }
        self.measure();
    }

    /// Where it begins.
    pub(crate) fn start(&self) -> Point3<f64> {
        self.nodes[0]
    }

    /// Its length from node to node, mm.
    pub(crate) fn length(&self) -> f64 {
        self.ways[self.ways.len() - 1]
    }

    /// The place at this way from the beginning: on the surface and on the level up to rounding.
    pub(crate) fn at(&self, way: f64) -> TracePoint {
        let piece = self.ways.partition_point(|&w| w <= way).clamp(1, self.triangles.len()) - 1;
        let (from, to) = (self.ways[piece], self.ways[piece + 1]);
        let fraction = ((way - from) / (to - from)).clamp(0.0, 1.0);
        let position = match fraction {
            0.0 => self.nodes[piece],
            1.0 => self.nodes[piece + 1],
            _ => self.inside(piece, fraction),
        };
        TracePoint { way, piece, position, normal: self.patch.normal(self.triangles[piece], &position) }
    }

    fn lone_corner(&self, piece: usize) -> LoneCorner {
        let corners = self.patch.mesh.corners(self.triangles[piece] as usize);
        let values = corners.map(|corner| self.set.value(&corner));
        let above = values.map(|value| value >= self.set.level());
        let index = (0..3).find(|&k| above[k] != above[(k + 1) % 3] && above[k] != above[(k + 2) % 3]).unwrap_or(0);
        let (is_above, value) = (above[index], values[index]);
        let [lone, first, last] = in_order(corners, index, is_above);
        let share = |p: &Point3<f64>, end: &Point3<f64>| (p - lone).norm() / (end - lone).norm();
        let shares = [share(&self.nodes[piece], &first), share(&self.nodes[piece + 1], &last)];
        LoneCorner { index: index as u8, is_above, value, shares }
    }

    fn inside(&self, piece: usize, fraction: f64) -> Point3<f64> {
        if self.set.is_linear() {
            let (from, to) = (self.nodes[piece], self.nodes[piece + 1]);
            return from + (to - from) * fraction;
        }
        // Two corners lie on one side of the level, the lone one on the other, and every line from
        // the lone corner to the side across crosses the level once. The line is the one through
        // the point of the chord.
        let LoneCorner { index, is_above, value, shares } = self.lone[piece];
        let corners = self.patch.mesh.corners(self.triangles[piece] as usize);
        let [lone, first, last] = in_order(corners, usize::from(index), is_above);
        let (at_first, at_last) = ((1.0 - fraction) * shares[0], fraction * shares[1]);
        let foot = first + (last - first) * (at_last / (at_first + at_last));
        let at_foot = self.set.value(&foot);
        if (at_foot >= self.set.level()) != is_above {
            return lone + (foot - lone) * self.set.crossing(&lone, &foot, [value, at_foot]);
        }
        // Between corners above it, a side can dip below the level, and the curve leaves the
        // triangle for a while there. Then it is taken to stand where it leaves or comes back.
        let end = if fraction < 0.5 { first } else { last };
        foot + (end - foot) * self.set.crossing(&foot, &end, [at_foot, self.set.value(&end)])
    }

    /// Direction of the piece at a place, along its chord.
    pub(crate) fn chord_direction(&self, place: &TracePoint) -> Vector3<f64> {
        self.nodes[place.piece + 1] - self.nodes[place.piece]
    }

    /// Direction of the smooth surface's section at a place: along gradient × N; the chord's where
    /// there is none.
    pub(crate) fn tangent(&self, place: &TracePoint) -> Vector3<f64> {
        let chord = self.chord_direction(place);
        let smooth = match self.tangents.get(place.piece..place.piece + 2) {
            Some([from, to]) => {
                let share =
                    (place.way - self.ways[place.piece]) / (self.ways[place.piece + 1] - self.ways[place.piece]);
                Some(from.lerp(to, share.clamp(0.0, 1.0)))
            }
            _ => self.set.gradient(&place.position).map(|g| g.cross(&place.normal)),
        };
        // Where the surface lies along the level the product is rounding noise, or turns against
        // the way.
        smooth.filter(|s| s.norm() > 1e-6 && s.dot(&chord) > 0.0).unwrap_or(chord)
    }

    /// Normal of the facet at a place.
    pub(crate) fn facet_normal(&self, place: &TracePoint) -> Option<Unit<Vector3<f64>>> {
        self.patch.facet_normal(self.triangles[place.piece])
    }

    /// The nodes between two places, with the normals before and after each.
    pub(crate) fn between(
        &self,
        a: &TracePoint,
        b: &TracePoint,
    ) -> impl Iterator<Item = (&Point3<f64>, [Unit<Vector3<f64>>; 2])> {
        (a.piece + 1..=b.piece).map(|k| (&self.nodes[k], [self.normals[k - 1][1], self.normals[k][0]]))
    }

    /// Returns the largest distance of the curve between two places from the chords of its pieces,
    /// mm.
    pub(crate) fn bulge_between(&self, a: &TracePoint, b: &TracePoint) -> f64 {
        let bulge = |k: usize| {
            let (from, to) = (self.ways[k], self.ways[k + 1]);
            let covered = (b.way.min(to) - a.way.max(from)) / (to - from);
            self.bulges[k] * covered * covered
        };
        (a.piece..=b.piece).map(bulge).fold(0.0, f64::max)
    }
}

/// The lone corner of a triangle, and both others, from the side that the curve enters by to the
/// one that it leaves by: the higher levels are on its left.
fn in_order(corners: [Point3<f64>; 3], lone: usize, is_above: bool) -> [Point3<f64>; 3] {
    let [next, last] = [corners[(lone + 1) % 3], corners[(lone + 2) % 3]];
    if is_above { [corners[lone], next, last] } else { [corners[lone], last, next] }
}
