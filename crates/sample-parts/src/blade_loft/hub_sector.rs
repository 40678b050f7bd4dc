//! The sector of a hub around a lofted blade, as a shell that carries the blade.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, center};

use crate::blade_loft::endwalls::{HubLine, HubSector, HubSet, RevolvedWall};
use crate::blade_loft::loft_caps::{MeshInWork, close_row};
use crate::blade_loft::loft_edges::{HUB, HUB_ENDS};
use crate::grouped_mesh::GroupedMesh;
use crate::spec_error::LoftError;

/// Places along the blade at which the middle between its sides is taken for the sector's sides.
const MIDDLE_PLACES: u32 = 9;

/// Largest share of the blade's length, and of the hub up to its next corners, by which lines
/// across the hub fan out: facets before a flat edge would have no area otherwise.
const FAN: [f64; 2] = [0.1, 0.25];

/// Share of a range of the wall within which a corner counts as the range's end.
const LEAST: f64 = 1e-3;

/// A sector of the hub to be made.
pub(crate) struct HubSectorMesh<'w> {
    pub(crate) wall: &'w RevolvedWall,
    /// Vertices of the blade's root on the wall, in the order of its columns.
    pub(crate) row: &'w [u32],
    /// Columns at both edges.
    pub(crate) edge_columns: [usize; 2],
    /// Whether columns run counter-clockwise, seen from the tip.
    pub(crate) is_counter_clockwise: bool,
    /// Parts from the blade to the side of the sector.
    pub(crate) parts: usize,
    pub(crate) sector: &'w HubSector,
}

/// A line across the hub from the blade, or from the line through its edges, to a side.
struct CrossLine {
    /// Length along the wall at both ends.
    lengths: [f64; 2],
    /// Angle at its start.
    angle: f64,
    /// Vertex at its start.
    vertex: u32,
}

/// Angle of the middle between the blade's sides over the length along the wall.
struct MiddleLine(Vec<[f64; 2]>);

/// The middle between the sides of the blade whose sector it is, and the way to the sector's sides.
struct SectorMiddle {
    line: MiddleLine,
    /// Half of the angle between two blades of which each is alone.
    half_pitch: f64,
    set: Option<SetLines>,
}

/// The row of a blade on the wall, from its first to its last place along the wall on both sides.
struct RowChains {
    /// Numbers of the first and the last place.
    ends: [usize; 2],
    /// Numbers of the places on the side with the larger angles, and on the other.
    chains: [Vec<usize>; 2],
    /// Whether the first chain goes as the row does.
    is_onward_upper: bool,
}

/// Lines of the blades of a set as angles on the wall of one of them.
struct SetLines {
    lines: Vec<MiddleLine>,
    /// Number of the line of this blade.
    own: usize,
    /// Number of the longest line.
    longest: usize,
    /// Angle from one set to the next.
    pitch: f64,
}

/// A vertex of the hub with its place on the wall.
type HubVertex = (u32, [f64; 2]);

impl HubSectorMesh<'_> {
    /// Adds the groups `hub` and `hub-ends`: hub, sides, inlet, outlet and inside of the sector.
    pub(crate) fn fill(&self, mesh: &mut GroupedMesh, made: &mut MeshInWork) -> Result<(), LoftError> {
        if self.sector.n_blades < 2 && self.sector.set.as_ref().is_none_or(|set| set.lines.len() < 2) {
            return no_sector("a single blade has no neighbour up to which it could go; leave the hub out");
        }
        if self.wall.smallest_radius() <= self.sector.thickness {
            return no_sector("it comes as near to its axis as the sector is thick; begin its curve farther out");
        }
        let places: Vec<[f64; 2]> = self.row.iter().map(|&v| self.wall.place(&mesh.point(v))).collect();
        let RowChains { ends: [first, last], chains: [upper, lower], is_onward_upper } = RowChains::of(&places);
        let whole = self.wall.lengths[self.wall.lengths.len() - 1];
        if places[first][0] <= 0.0 || places[last][0] >= whole {
            return no_sector("the blade goes beyond the ends of the hub; lengthen the hub's curve");
        }
        let middle = SectorMiddle {
            line: MiddleLine::between([&upper, &lower], &places),
            half_pitch: PI / f64::from(self.sector.n_blades),
            set: self.sector.set.as_ref().map(|set| SetLines::new(self.wall, set, self.sector.n_blades)),
        };
        if middle.set.as_ref().is_some_and(SetLines::is_at_another) {
            return no_sector("another blade of the set is at the same place around the axis; move one of them");
        }
        // Lines before and behind the blade, which both halves share.
        let [before, behind] = [[0.0, places[first][0]], [places[last][0], whole]].map(|range| self.lengths(range));
        let mut straight = |lengths: &[f64], from: usize| -> Vec<HubVertex> {
            let offset = places[from][1] - middle.angle(places[from][0]);
            lengths.iter().map(|&s| self.vertex(mesh, made, [s, middle.angle(s) + offset])).collect()
        };
        let inlet = straight(&before[..before.len() - 1], first);
        let outlet = straight(&behind[1..], last);
        let is_flipped = is_onward_upper == self.is_counter_clockwise;
        let mut halves = Vec::new();
        for (chain, sign) in [(&upper, 1.0), (&lower, -1.0)] {
            let on_blade = chain.iter().map(|&k| (self.row[k], places[k]));
            let starts: Vec<HubVertex> = inlet.iter().copied().chain(on_blade).chain(outlet.iter().copied()).collect();
            let lines = self.cross_lines(mesh, &starts, [inlet.len(), inlet.len() + chain.len() - 1]);
            halves.push(self.half(mesh, made, &lines, &middle, sign));
        }
        for (half, sign) in halves.iter().zip([1.0, -1.0]) {
            self.fill_half(mesh, made, half, (sign, is_flipped != (sign < 0.0)))?;
        }
        self.close(mesh, made, &halves, is_flipped);
        Ok(())
    }

    /// Lengths of a range of the wall with its corners, each gap in parts.
    fn lengths(&self, [from, to]: [f64; 2]) -> Vec<f64> {
        let least = LEAST * (to - from);
        let corners = self.wall.lengths.iter().copied().filter(|s| *s > from + least && *s < to - least);
        let ends: Vec<f64> = [from].into_iter().chain(corners).chain([to]).collect();
        let parts = |pair: &[f64]| {
            let (a, b) = (pair[0], pair[1]);
            (0..self.parts).map(move |k| a + (b - a) * n_of(k) / n_of(self.parts)).collect::<Vec<_>>()
        };
        ends.windows(2).flat_map(parts).chain([to]).collect()
    }

    /// New vertex of the hub.
    fn vertex(&self, mesh: &mut GroupedMesh, made: &mut MeshInWork, place: [f64; 2]) -> HubVertex {
        let point = self.wall.point(place, 0.0);
        made.normals.push(self.wall.normal(&point));
        (mesh.vertex(point), place)
    }

    /// Lines across from their starts; `blade` are the first and last one on the blade.
    fn cross_lines(&self, mesh: &GroupedMesh, starts: &[HubVertex], [first, last]: [usize; 2]) -> Vec<CrossLine> {
        let [leading, trailing] = [first, last].map(|k| starts[k].1[0]);
        // Corners of the wall stay on lines across: only those between the blade and the next
        // corner fan out.
        let corners = &self.wall.lengths;
        let whole = corners[corners.len() - 1];
        let nearest = [leading - LEAST * leading, trailing + LEAST * (whole - trailing)];
        let before = corners[corners.partition_point(|s| *s < nearest[0]).saturating_sub(1)];
        let behind = corners[corners.partition_point(|s| *s <= nearest[1]).min(corners.len() - 1)];
        let room = FAN[1] * (leading - before).min(behind - trailing);
        let fan = (FAN[0] * (trailing - leading)).min(room);
        let mut along = vec![0.0];
        for pair in starts[first..=last].windows(2) {
            along.push(along[along.len() - 1] + mesh.distance_sq(pair[0].0, pair[1].0).sqrt());
        }
        let side = |k: usize, s: f64| {
            if k < first {
                if s < before { s } else { before + (s - before) * (leading - fan - before) / (leading - before) }
            } else if k > last {
                if s > behind { s } else { behind - (behind - s) * (behind - trailing - fan) / (behind - trailing) }
            } else {
                s + fan * (2.0 * along[k - first] / along[along.len() - 1] - 1.0)
            }
        };
        let line =
            |(k, &(vertex, [s, angle])): (usize, &HubVertex)| CrossLine { lengths: [s, side(k, s)], angle, vertex };
        starts.iter().enumerate().map(line).collect()
    }

    /// Vertices of one half of the hub by line, from the blade to the side of the sector.
    fn half(
        &self,
        mesh: &mut GroupedMesh,
        made: &mut MeshInWork,
        lines: &[CrossLine],
        middle: &SectorMiddle,
        sign: f64,
    ) -> Vec<Vec<HubVertex>> {
        let to_side = middle.to_side(sign);
        let mut vertices = Vec::with_capacity(lines.len());
        for line in lines {
            let [from, to] = line.lengths;
            let offset = line.angle - middle.angle(from);
            let mut across = vec![(line.vertex, [from, line.angle])];
            for k in 1..=self.parts {
                let share = n_of(k) / n_of(self.parts);
                let s = from + share * (to - from);
                let angle = middle.angle(s) + offset + share * (to_side(s) - offset);
                across.push(self.vertex(mesh, made, [s, angle]));
            }
            vertices.push(across);
        }
        vertices
    }

    /// Facets of one half; all must have the same sense on the wall.
    fn fill_half(
        &self,
        mesh: &mut GroupedMesh,
        made: &mut MeshInWork,
        half: &[Vec<HubVertex>],
        // Lines with the angle growing from the blade turn the other way than those with it
        // falling.
        (sense, is_flipped): (f64, bool),
    ) -> Result<(), LoftError> {
        for pair in half.windows(2) {
            for t in 0..self.parts {
                let [a, b, c, d] = [pair[0][t], pair[1][t], pair[1][t + 1], pair[0][t + 1]];
                let is_first = mesh.distance_sq(a.0, c.0) <= mesh.distance_sq(b.0, d.0);
                let split = if is_first { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                for facet in split {
                    let [p, q, r] = facet.map(|(_, place)| place);
                    let area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
                    if area.is_nan() || area * sense <= 0.0 {
                        return no_sector("blades leave no room between them there; correct their number or the hub");
                    }
                    let [i, j, k] = facet.map(|(vertex, _)| vertex);
                    mesh.triangle(HUB, if is_flipped { [i, k, j] } else { [i, j, k] });
                    for [v, w] in [[i, j], [j, k], [k, i]] {
                        let off = self.wall.height(&center(&mesh.point(v), &mesh.point(w))).abs();
                        made.chord = made.chord.max(off);
                    }
                }
            }
        }
        Ok(())
    }

    /// Sides, inlet, outlet and inside of the sector.
    fn close(&self, mesh: &mut GroupedMesh, made: &mut MeshInWork, halves: &[Vec<Vec<HubVertex>>], is_flipped: bool) {
        let mut inner: BTreeMap<u32, u32> = BTreeMap::new();
        for &(vertex, place) in halves.iter().flatten().flatten() {
            if let std::collections::btree_map::Entry::Vacant(entry) = inner.entry(vertex) {
                let point = self.wall.point(place, -self.sector.thickness);
                made.normals.push(-self.wall.normal(&point));
                entry.insert(mesh.vertex(point));
            }
        }
        for [a, b, c] in mesh.triangles_mut(HUB).clone() {
            mesh.triangle(HUB_ENDS, [a, c, b].map(|v| inner[&v]));
        }
        let root: Vec<u32> = self.row.iter().map(|v| inner[v]).collect();
        close_row(mesh, HUB_ENDS, &root, self.edge_columns, self.is_counter_clockwise);
        let [upper, lower] = [&halves[0], &halves[1]];
        let side = |half: &[Vec<HubVertex>]| -> Vec<u32> { half.iter().map(|line| line[self.parts].0).collect() };
        let end = |half: &[Vec<HubVertex>], k: usize| -> Vec<u32> { half[k].iter().map(|v| v.0).collect() };
        let back = |mut row: Vec<u32>| {
            row.reverse();
            row
        };
        let last = |half: &[Vec<HubVertex>]| half.len() - 1;
        let rows = [
            side(upper),
            back(end(upper, last(upper))),
            end(lower, last(lower)),
            back(side(lower)),
            back(end(lower, 0)),
            end(upper, 0),
        ];
        for pair in rows.iter().flat_map(|row| row.windows(2)) {
            let [p, q] = [pair[0], pair[1]];
            let corners = [p, q, inner[&q], inner[&p]];
            mesh.quad(HUB_ENDS, if is_flipped { [corners[0], corners[3], corners[2], corners[1]] } else { corners });
        }
    }
}

impl MiddleLine {
    /// The middle between two chains of places whose lengths grow.
    fn between(chains: [&[usize]; 2], places: &[[f64; 2]]) -> Self {
        let [first, last] = [0, chains[0].len() - 1].map(|k| places[chains[0][k]][0]);
        let angle = |chain: &[usize], s: f64| {
            let k = chain.partition_point(|&k| places[k][0] <= s).clamp(1, chain.len() - 1);
            let [a, b] = [places[chain[k - 1]], places[chain[k]]];
            let step = b[0] - a[0];
            if step > 0.0 { a[1] + (b[1] - a[1]) * ((s - a[0]) / step).clamp(0.0, 1.0) } else { a[1] }
        };
        let place = |k: u32| {
            let s = first + (last - first) * (f64::from(k) + 0.5) / f64::from(MIDDLE_PLACES);
            [s, 0.5 * (angle(chains[0], s) + angle(chains[1], s))]
        };
        Self((0..MIDDLE_PLACES).map(place).collect())
    }

    /// Lengths of its ends.
    fn ends(&self) -> [f64; 2] {
        [self.0[0][0], self.0[self.0.len() - 1][0]]
    }

    /// Angle at a length; beyond its ends that of the nearest one.
    fn angle(&self, s: f64) -> f64 {
        let k = self.0.partition_point(|p| p[0] <= s).clamp(1, self.0.len() - 1);
        let [a, b] = [self.0[k - 1], self.0[k]];
        a[1] + (b[1] - a[1]) * ((s - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0)
    }
}

impl RowChains {
    fn of(places: &[[f64; 2]]) -> Self {
        let n = places.len();
        let by_length = |a: &usize, b: &usize| places[*a][0].total_cmp(&places[*b][0]);
        let (first, last) = ((0..n).min_by(by_length).unwrap_or(0), (0..n).max_by(by_length).unwrap_or(0));
        let onward: Vec<usize> = (0..=(last + n - first) % n).map(|k| (first + k) % n).collect();
        let backward: Vec<usize> = (0..=(first + n - last) % n).map(|k| (first + n - k) % n).collect();
        let mean = |chain: &[usize]| chain.iter().map(|&k| places[k][1]).sum::<f64>() / n_of(chain.len());
        let is_onward_upper = mean(&onward) > mean(&backward);
        let chains = if is_onward_upper { [onward, backward] } else { [backward, onward] };
        Self { ends: [first, last], chains, is_onward_upper }
    }
}

impl HubLine {
    /// The line of a blade by its section at the hub.
    pub(crate) fn of(wall: &RevolvedWall, section: &[Point3<f64>]) -> Self {
        let places: Vec<[f64; 2]> = section.iter().map(|p| wall.place(p)).collect();
        let [upper, lower] = RowChains::of(&places).chains;
        let middle = MiddleLine::between([&upper, &lower], &places);
        Self { points: middle.0.iter().map(|place| wall.point(*place, 0.0)).collect() }
    }
}

impl SectorMiddle {
    /// Angle at a length; of a set, beyond the ends as its longest line goes on.
    fn angle(&self, s: f64) -> f64 {
        self.line.angle(s) + self.set.as_ref().map_or(0.0, |set| set.onward(self.line.ends(), s))
    }

    /// Returns the angle from the middle to a side of the sector at a length.
    fn to_side(&self, sign: f64) -> impl Fn(f64) -> f64 {
        let side = self.set.as_ref().map(|set| (set, set.next(sign)));
        move |s| side.map_or(sign * self.half_pitch, |(set, next)| set.midway(next, s) - self.angle(s))
    }
}

impl SetLines {
    fn new(wall: &RevolvedWall, set: &HubSet, n_blades: u32) -> Self {
        let line = |line: &HubLine| {
            let mut before: Option<f64> = None;
            let place = |p: &Point3<f64>| {
                let [s, angle] = wall.place(p);
                // No step turns by more than a half.
                let angle = before.map_or(angle, |b| b + (angle - b + PI).rem_euclid(TAU) - PI);
                before = Some(angle);
                [s, angle]
            };
            MiddleLine(line.points.iter().map(place).collect())
        };
        let lines: Vec<MiddleLine> = set.lines.iter().map(line).collect();
        let length = |k: &usize| -> f64 {
            let [first, last] = lines[*k].ends();
            last - first
        };
        // The first of those as long, so that it is the same for all blades.
        let most = (0..lines.len()).map(|k| length(&k)).fold(0.0, f64::max);
        let longest = (0..lines.len()).find(|k| length(k) >= (1.0 - LEAST) * most).unwrap_or(0);
        Self { lines, own: set.own, longest, pitch: TAU / f64::from(n_blades) }
    }

    /// Change of the longest line's angle from the ends of a line to a length beyond them, 0
    /// between. Lines go on by it, so that a blade that begins behind another leaves it room.
    fn onward(&self, [first, last]: [f64; 2], s: f64) -> f64 {
        let longest = &self.lines[self.longest];
        longest.angle(s) - longest.angle(s.clamp(first, last))
    }

    /// Angle of a line at a length.
    fn angle(&self, k: usize, s: f64) -> f64 {
        self.lines[k].angle(s) + self.onward(self.lines[k].ends(), s)
    }

    /// Angle from the own line to another in the middle of the own one.
    fn apart(&self, k: usize) -> f64 {
        let [first, last] = self.lines[self.own].ends();
        let middle = 0.5 * (first + last);
        self.angle(k, middle) - self.angle(self.own, middle)
    }

    /// Whether another blade is where this one is, or one of the next set.
    fn is_at_another(&self) -> bool {
        let is_near = |k: usize| {
            let share = (self.apart(k) / self.pitch).rem_euclid(1.0);
            share.min(1.0 - share) < LEAST
        };
        (0..self.lines.len()).any(|k| k != self.own && is_near(k))
    }

    /// Returns the number of the next line on a side, and what is to be added to its angles.
    fn next(&self, sign: f64) -> (usize, f64) {
        let around = |k: usize| if k == self.own { self.pitch } else { (sign * self.apart(k)).rem_euclid(self.pitch) };
        let next = (0..self.lines.len()).min_by(|a, b| around(*a).total_cmp(&around(*b))).unwrap_or(self.own);
        (next, sign * around(next) - self.apart(next))
    }

    /// Angle midway between the own line and another.
    fn midway(&self, (k, more): (usize, f64), s: f64) -> f64 {
        0.5 * (self.angle(self.own, s) + self.angle(k, s) + more)
    }
}

fn no_sector<T>(what: &'static str) -> Result<T, LoftError> {
    Err(LoftError::NoSector { what })
}

#[expect(clippy::cast_precision_loss, reason = "far fewer than 2^52")]
fn n_of(count: usize) -> f64 {
    count as f64
}
