use facemill_cl_data::{CcPoint, Monitor};
use facemill_surface_model::{LevelCurve, level_curves_among};
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::error::PathError;
use crate::layout::field::accumulated::AccumulatedWidth;
use crate::layout::field::ends::border_edges;
use crate::layout::field::field_bands::FieldBands;
use crate::layout::field::gradients::vertex_gradients;
use crate::layout::field::walk::{Helix, SidePoint};
use crate::layout::field::winding::Winding;
use crate::layout::level_set::LevelSet;
use crate::layout::levels::{Band, triangles_at};
use crate::layout::pass_level::Strips;
use crate::layout::section_layout::{BORDER_INSET, border_levels, extent};
use crate::layout::strip_width::{StripWidth, allowed_width, any_tangent};
use crate::layout::trace::{Curve, TracedLevel};
use crate::sections::Sections;
use crate::strategy::patch::Patch;
use crate::strategy::settings::{Direction, LaySettings, LevelOrder};

/// A spiral on a patch: a turn on the first level, turns that rise evenly by one strip each, and a
/// turn on the last level.
pub(crate) struct SpiralLayout {
    gradients: Vec<Vector3<f64>>,
    nodes: Vec<Point3<f64>>,
    triangles: Vec<u32>,
    tangents: Vec<Vector3<f64>>,
    first: f64,
    pub(crate) n_turns: usize,
    pub(crate) strips: Strips,
}

impl SpiralLayout {
    /// Plans the spiral over the levels of the patch.
    ///
    /// # Errors
    /// When a level is not one closed curve, a width is NaN, there would be too many turns, or the
    /// monitor cancels.
    pub(crate) fn plan(
        patch: &Patch,
        sections: Option<&Sections>,
        settings: &LaySettings,
        strip_width: StripWidth,
        monitor: &dyn Monitor,
    ) -> Result<Self, PathError> {
        let field = FieldBands::of(patch, settings, strip_width)?;
        monitor.checkpoint()?;
        let range = sections.map_or((f64::NEG_INFINITY, f64::INFINITY), Sections::range);
        let [first, last] = closed_range(patch, &field, range)?;
        let width = AccumulatedWidth::of(field.edges(patch), [first, last]);
        let n_steps = width.n_steps(&field.bands, field.cause)?;
        let even = LaySettings { even: true, ..settings.clone() };
        let levels = width.levels(n_steps, &even);
        let rings = rings(patch, &field.bands, &levels, settings)?;
        monitor.checkpoint()?;
        let winding =
            Winding::of(patch, [first, last])?.ok_or_else(|| no_spiral(patch, first, "is not joined with the last"))?;
        monitor.checkpoint()?;
        let rises = (settings.first_direction() == Direction::Forward) == (settings.order == LevelOrder::Increasing);
        let turns = |level: f64| {
            let share = width.strips(level) / width.total();
            n_steps as f64 * if rises { share } else { 1.0 - share }
        };
        let progress: Vec<f64> = patch.levels.iter().map(|&l| turns(l)).collect();
        let helix =
            Helix { patch, winding: &winding, progress: &progress, rises, end: if rises { last } else { first } };
        let (start, end) = if rises { (&rings[0], &rings[1]) } else { (&rings[1], &rings[0]) };
        let mut this = Self {
            strips: Strips::between(&field.bands, &levels),
            gradients: field.gradients,
            nodes: Vec::new(),
            triangles: Vec::new(),
            tangents: Vec::new(),
            first: if rises { first } else { last },
            n_turns: n_steps + 2,
        };
        this.wind(patch, &helix, start, end, settings.closed_start)?;
        Ok(this)
    }

    /// Puts the turn on the first level, the turns between and the turn on the last level together.
    fn wind(
        &mut self,
        patch: &Patch,
        helix: &Helix,
        start: &LevelCurve,
        end: &LevelCurve,
        closed_start: Option<Point3<f64>>,
    ) -> Result<(), PathError> {
        let n = start.points.len();
        let first = closed_start.map_or(0, |p| nearest(start, &p));
        for k in 0..n {
            self.ring_node(patch, start, (first + k) % n);
        }
        let gradients = vertex_gradients(patch, |t| helix.corner_values(t as u32));
        let walked = helix.walk(side_point(patch, start, first), &gradients)?;
        let sign = if helix.rises { 1.0 } else { -1.0 };
        let n_walked = walked.nodes.len();
        for (k, node) in walked.nodes.iter().enumerate() {
            let triangle = walked.triangles[k];
            let mut tangent = tangent(patch, triangle, node, &(walked.gradients[k] * sign));
            // Half of the turn from ring to spiral is taken at the node where they meet.
            if k == 0 {
                tangent += self.tangents[0];
            }
            if k + 1 < n_walked {
                self.push(*node, triangle, tangent);
            } else {
                self.last_ring(patch, end, (*node, triangle, tangent));
            }
        }
        Ok(())
    }

    fn push(&mut self, node: Point3<f64>, triangle: u32, tangent: Vector3<f64>) {
        self.nodes.push(node);
        self.triangles.push(triangle);
        self.tangents.push(tangent);
    }

    fn ring_node(&mut self, patch: &Patch, ring: &LevelCurve, k: usize) {
        let at = &ring.points[k];
        let [a, b] = at.edge.map(|v| self.gradients[v as usize]);
        let tangent = tangent(patch, at.triangle, &at.position, &a.lerp(&b, at.fraction));
        self.push(at.position, at.triangle, tangent);
    }

    /// The ring from the end of the spiral inside a triangle, once round and back.
    fn last_ring(
        &mut self,
        patch: &Patch,
        ring: &LevelCurve,
        (node, triangle, tangent): (Point3<f64>, u32, Vector3<f64>),
    ) {
        let n = ring.points.len();
        // A ring along edges, or rounding, lets the spiral end in a triangle beside the ring's.
        let detour = |k: &usize| {
            let [a, b] = [*k, (k + 1) % n].map(|k| ring.points[k].position);
            nalgebra::distance(&a, &node) + nalgebra::distance(&node, &b) - nalgebra::distance(&a, &b)
        };
        let beside = || (0..n).min_by(|a, b| detour(a).total_cmp(&detour(b))).unwrap_or(0);
        let at = ring.points.iter().position(|p| p.triangle == triangle).unwrap_or_else(beside);
        let of_ring = self.nodes.len() + 1;
        self.push(node, ring.points[at].triangle, tangent);
        for k in 1..=n {
            self.ring_node(patch, ring, (at + k) % n);
        }
        let along = self.tangents[of_ring];
        self.tangents[of_ring - 1] += along;
        self.nodes.push(node);
        self.tangents.push(along);
    }

    /// The spiral as a curve of the patch, forward.
    pub(crate) fn traced<'a>(&'a self, patch: &'a Patch<'a>) -> TracedLevel<'a> {
        let set = LevelSet::Field { gradients: &self.gradients, level: self.first };
        let curve = Curve::wound(patch, set, &self.nodes, &self.triangles, &self.tangents);
        TracedLevel { set, curves: curve.into_iter().collect(), starts: None }
    }
}

/// Unit direction along the higher values' right side; zero where there is none.
fn tangent(patch: &Patch, triangle: u32, node: &Point3<f64>, gradient: &Vector3<f64>) -> Vector3<f64> {
    Unit::try_new(gradient.cross(&patch.normal(triangle, node)), 0.0).map_or_else(Vector3::zeros, Unit::into_inner)
}

/// The point of a level curve on a side of the triangle that follows it.
fn side_point(patch: &Patch, curve: &LevelCurve, k: usize) -> SidePoint {
    let at = &curve.points[k];
    let v = patch.mesh.triangles()[at.triangle as usize];
    let side = (0..3).find(|&k| at.edge.contains(&v[k]) && at.edge.contains(&v[(k + 1) % 3])).unwrap_or(0);
    let share = if v[side] == at.edge[0] { at.fraction } else { 1.0 - at.fraction };
    SidePoint { triangle: at.triangle, side, share }
}

/// The closed curves of the first and the last level, once every level is known to be one.
fn rings(patch: &Patch, bands: &[Band], levels: &[f64], settings: &LaySettings) -> Result<[LevelCurve; 2], PathError> {
    let among = triangles_at(bands, levels);
    // Hills that lie within a strip need no turn of their own.
    let is_long = |curve: &LevelCurve| !curve.closed || ring_length(curve) > 2.0 * settings.min_step_over;
    let ring = |(&level, among): (&f64, &Vec<u32>)| {
        let all = level_curves_among(&patch.mesh, &patch.edges, &patch.levels, level, among.iter().copied());
        let mut long = all.into_iter().filter(is_long);
        let Some(ring) = long.next() else { return Err(no_spiral(patch, level, "has no closed curve")) };
        let fault = |fault: &'static str, at: &LevelCurve| PathError::NoSpiral {
            level,
            fault,
            position: at.points[0].position,
        };
        match long.next() {
            _ if !ring.closed => Err(fault("is open", &ring)),
            Some(other) if !other.closed => Err(fault("is open", &other)),
            Some(other) => Err(fault("has more than one closed curve", &other)),
            None => Ok(ring),
        }
    };
    let rings = levels.par_iter().zip(&among).map(ring).collect::<Vec<_>>();
    let mut rings = rings.into_iter().collect::<Result<Vec<_>, _>>()?;
    let last = rings.pop();
    match (rings.into_iter().next(), last) {
        (Some(first), Some(last)) => Ok([first, last]),
        _ => Err(no_spiral(patch, levels[0], "has no level above it")),
    }
}

/// Index of the point of a curve that is nearest to a place.
fn nearest(curve: &LevelCurve, p: &Point3<f64>) -> usize {
    let distance_sq = |k: &usize| (curve.points[*k].position - p).norm_squared();
    (0..curve.points.len()).min_by(|a, b| distance_sq(a).total_cmp(&distance_sq(b))).unwrap_or(0)
}

fn ring_length(curve: &LevelCurve) -> f64 {
    let n = curve.points.len();
    (0..n).map(|k| (curve.points[(k + 1) % n].position - curve.points[k].position).norm()).sum()
}

/// Returns the error of a level at the vertex nearest to it.
fn no_spiral(patch: &Patch, level: f64, fault: &'static str) -> PathError {
    no_spiral_at(patch, 0..patch.levels.len() as u32, level, fault)
}

/// Returns the error of a level at that of these vertices that is nearest to it.
fn no_spiral_at(patch: &Patch, vertices: impl IntoIterator<Item = u32>, level: f64, fault: &'static str) -> PathError {
    let off = |v: &u32| (patch.levels[*v as usize] - level).abs();
    let nearest = vertices.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    let position = nearest.map_or_else(Point3::origin, |v| patch.mesh.vertices()[v as usize]);
    PathError::NoSpiral { level, fault, position }
}

/// The range of levels between the lower and the upper border of the patch, within those to be cut.
///
/// # Errors
/// When both are the same border, or a border is so far from being a level that half a strip does
/// not reach it.
fn closed_range(patch: &Patch, field: &FieldBands, range: (f64, f64)) -> Result<[f64; 2], PathError> {
    let borders = border_ranges(patch);
    let by_low = |a: &&[f64; 2], b: &&[f64; 2]| a[0].total_cmp(&b[0]);
    let by_high = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
    let (Some(&[low, lower]), Some(&[upper, high])) = (borders.iter().min_by(by_low), borders.iter().max_by(by_high))
    else {
        return Err(no_spiral(patch, 0.0, "has no border below and above it"));
    };
    // The mesh reaches beyond the levels to be cut, by up to a triangle.
    let open = |level: f64| {
        let level = level.max(range.0).min(range.1);
        Err(no_spiral_at(patch, border_edges(patch).into_iter().flatten(), level, "is open"))
    };
    let (lowest, highest) = border_levels(patch, range)?;
    let inset = (BORDER_INSET * extent(&patch.mesh)).min(1e-3 * (highest - lowest));
    let (first, last) = ((lower + inset).max(lowest), (upper - inset).min(highest));
    if first >= last {
        return open(lower);
    }
    for (from, to, at) in [(lowest, first, low), (last, highest, high)] {
        if to > from && AccumulatedWidth::of(field.edges(patch), [from, to]).total() > 0.5 {
            return open(at);
        }
    }
    Ok([first, last])
}

/// Lowest and highest level of each border of a patch, in the order of their first edge.
fn border_ranges(patch: &Patch) -> Vec<[f64; 2]> {
    let mut next: Vec<Vec<u32>> = vec![Vec::new(); patch.mesh.vertices().len()];
    let borders: Vec<[u32; 2]> = border_edges(patch);
    for &[a, b] in &borders {
        next[a as usize].push(b);
        next[b as usize].push(a);
    }
    let mut ranges = Vec::new();
    for &[first, _] in &borders {
        let mut queue = vec![first];
        let mut range: Option<[f64; 2]> = None;
        while let Some(v) = queue.pop() {
            let neighbours = std::mem::take(&mut next[v as usize]);
            if neighbours.is_empty() {
                continue;
            }
            let level = patch.levels[v as usize];
            let [low, high] = range.unwrap_or([level; 2]);
            range = Some([low.min(level), high.max(level)]);
            queue.extend(neighbours);
        }
        ranges.extend(range);
    }
    ranges
}

/// Share of the strip width that the ring around a pole may be away from it.
const POLE: f64 = 0.25;

/// Cuts the patch open at its highest and lowest vertex where they lie inside it: a spiral winds
/// around them. The hole is within a quarter of a strip.
///
/// # Errors
/// When nothing is left.
pub(crate) fn without_poles<'a>(
    mut patch: Patch<'a>,
    sections: &Sections,
    settings: &LaySettings,
    strip_width: StripWidth,
) -> Result<Patch<'a>, PathError> {
    for highest in [false, true] {
        let Some((pole, normal)) = patch.pole(highest) else { continue };
        let cc = CcPoint { position: pole, normal, feed: any_tangent(&normal) };
        let radius = POLE * allowed_width(&cc, settings, strip_width)?.max(settings.min_step_over);
        patch = patch.open_at(&pole, radius, sections)?;
    }
    Ok(patch)
}
