//! The mesh of a lofted blade.

use facemill_surface_model::TriMesh;
use nalgebra::{Point3, Unit, Vector3};

use crate::blade_loft::endwalls::{Endwalls, LoftEnd};
use crate::blade_loft::hub_sector::HubSectorMesh;
use crate::blade_loft::loft_caps::{MeshInWork, close_row, lay_on_wall};
use crate::blade_loft::loft_columns::{LoftColumn, LoftEnds, checked_normal};
use crate::blade_loft::loft_edges::{LOFT_GROUPS, PRESSURE, ROOT, SUCTION, TIP};
use crate::blade_loft::loft_surface::BladeLoft;
use crate::blade_loft::section_curve::SectionCurve;
use crate::grouped_mesh::GroupedMesh;
use crate::spec_error::LoftError;

/// Most vertices of a mesh.
const MOST_VERTICES: usize = 2_000_000;

/// Parts of the hub at first, from the blade to the side of its sector.
const FIRST_HUB_PARTS: usize = 3;

/// Share of the tolerance that each of both directions of facets may use at first.
const FIRST_SHARE: f64 = 0.4;

/// Rounds of refinement where the first one leaves more than the tolerance.
const MOST_ROUNDS: usize = 8;

/// Mesh of a blade with the normals of its smooth surface.
#[derive(Clone, Debug)]
pub struct LoftedBlade {
    /// Closed mesh, wound outward, with the groups `suction`, `pressure`, `leading-edge`,
    /// `trailing-edge`, `tip` and `root`; with a sector of the hub, `hub` and `hub-ends` instead of
    /// `root`.
    pub mesh: TriMesh,
    /// Outward unit normal of the smooth surface at each vertex; at a corner that of the side
    /// behind it, in the order of the points. Vertices of the blade come first, those inside its
    /// ends and on the hub last.
    pub normals: Vec<Unit<Vector3<f64>>>,
    /// Vertices at corners of the sections, in ascending order, with the normal of the side before
    /// them.
    pub normals_before: Vec<(u32, Unit<Vector3<f64>>)>,
    /// Natural coordinates of each vertex of the blade: share of the span from root to tip, and
    /// share of the side's length around the blade, from 0 at the leading to 1 at the trailing
    /// edge, negative on the pressure side.
    pub coordinates: Vec<[f64; 2]>,
    /// Largest distance of the surface from the facets, measured at the middle of each facet and of
    /// its sides, mm. Of ends without a wall there is no surface.
    pub chord_mm: f64,
    /// Ends at root and tip.
    pub ends: [LoftEnd; 2],
}

impl LoftedBlade {
    /// Returns the normal of the smooth surface at a vertex of a triangle: at a corner of the
    /// sections, where there are two, that of the triangle's side. So the facets of a flat end have
    /// its normal, and those of the sides theirs.
    ///
    /// ```
    /// use facemill_sample_parts::{BladeLoft, BladeSections};
    /// use nalgebra::Point3;
    ///
    /// let bar = [[20, 2], [0, 2], [-20, 2], [-20, 0], [-20, -2], [0, -2], [20, -2], [20, 0]];
    /// let section = |z: f64| bar.map(|[x, y]| Point3::new(f64::from(x), f64::from(y), z)).to_vec();
    /// let given = BladeSections { sections: vec![section(0.0), section(30.0)], ..BladeSections::default() };
    /// let blade = BladeLoft::new(&given, |p| p.x)?.mesh(0.01)?;
    /// let edge = blade.mesh.groups().iter().find(|group| group.name == "trailing-edge").expect("a flat edge");
    /// for facet in edge.triangles.clone() {
    ///     for vertex in blade.mesh.triangles()[facet] {
    ///         assert!((blade.normal_in(facet, vertex).x - 1.0).abs() < 1e-9);
    ///     }
    /// }
    /// # Ok::<(), facemill_sample_parts::LoftError>(())
    /// ```
    ///
    /// # Panics
    /// If the mesh has no such triangle or vertex.
    #[must_use]
    pub fn normal_in(&self, triangle: usize, vertex: u32) -> Unit<Vector3<f64>> {
        let behind = self.normals[vertex as usize];
        let Ok(at) = self.normals_before.binary_search_by_key(&vertex, |(vertex, _)| *vertex) else { return behind };
        let before = self.normals_before[at].1;
        let facet = self.mesh.scaled_normal(triangle);
        if before.dot(&facet) > behind.dot(&facet) { before } else { behind }
    }
}

/// How many parts each gap between sections, and between columns, is divided into.
struct Divisions {
    spans: Vec<usize>,
    gaps: Vec<usize>,
    /// Parts of the hub from the blade to the side of its sector.
    hub: usize,
}

/// Largest distances of the surface from the facets of the sides, by what they depend on, mm.
struct Chords {
    /// Between two sections: of edges along columns, and of those that lead on over rows.
    spans: Vec<f64>,
    /// Between two columns of points: of edges across.
    gaps: Vec<f64>,
}

/// A vertex of a column: its row, its place on the span.
#[derive(Clone, Copy)]
struct ColumnVertex {
    row: usize,
    at: f64,
    vertex: u32,
}

/// Rows of the ends of columns; those of the grid are between.
const LOW: usize = 0;
const HIGH: usize = usize::MAX;

/// Share of a row's distance from the next one that a column's end keeps from it.
const LEAST_STEP: f64 = 0.3;

impl BladeLoft {
    /// The blade from its first to its last section as a mesh whose facets are nearer to the
    /// surface than a tolerance, mm. Every point of the sections is a vertex; tip and root are
    /// closed by facets between the points of the last and first section.
    ///
    /// # Errors
    /// If the tolerance is not above zero or needs more than 2,000,000 vertices, or the surface
    /// folds.
    pub fn mesh(&self, chord_tolerance: f64) -> Result<LoftedBlade, LoftError> {
        self.mesh_of(chord_tolerance, |_| Ok(LoftEnds::sections()))
    }

    /// The blade from hub to shroud as a mesh, as [`Self::mesh`]: where its surface goes through a
    /// wall it is cut there, and root and tip are facets on the walls within the tolerance. Every
    /// point of the sections between the walls is a vertex. A section that is on the wall within
    /// the tolerance, goes through it by less than 2e-4 of the span, or ends before it, stays the
    /// blade's end ([`LoftedBlade::ends`]).
    ///
    /// # Errors
    /// As [`Self::mesh`], and if a wall is no surface of revolution, the blade reaches it at some
    /// places but ends more than a tenth of the span before it at others, or a sector of the hub
    /// leaves no room between blades.
    pub fn mesh_between(&self, walls: &Endwalls, chord_tolerance: f64) -> Result<LoftedBlade, LoftError> {
        self.mesh_of(chord_tolerance, |tolerance| LoftEnds::of(self, walls, tolerance))
    }

    fn mesh_of(
        &self,
        chord_tolerance: f64,
        ends: impl Fn(f64) -> Result<LoftEnds, LoftError>,
    ) -> Result<LoftedBlade, LoftError> {
        let too_fine = || LoftError::TooFine { tolerance: chord_tolerance, most: MOST_VERTICES };
        if !chord_tolerance.is_finite() || chord_tolerance <= 0.0 {
            return Err(too_fine());
        }
        let ends = ends(chord_tolerance)?;
        let mut divisions = self.first_divisions(FIRST_SHARE * chord_tolerance);
        for _ in 0..MOST_ROUNDS {
            let [rows, columns] = [&divisions.spans, &divisions.gaps].map(|parts| parts.iter().sum::<usize>());
            // Each line across the hub has so many vertices above and below: lines of columns, and
            // those before and behind the blade.
            let [across, corners] = ends.hub_work(divisions.hub);
            let beside = across.saturating_mul(corners).saturating_mul(divisions.hub);
            if rows.saturating_add(across).saturating_mul(columns).saturating_add(beside) > MOST_VERTICES {
                break;
            }
            let (made, chords) = self.divided(&divisions, &ends, chord_tolerance)?;
            if made.chord_mm <= chord_tolerance {
                return Ok(made);
            }
            // Only what is too coarse gets finer; on walls and hub there is no telling by what.
            let is_on_sides = chords.spans.iter().chain(&chords.gaps).any(|chord| *chord > chord_tolerance);
            let finer = |parts: &mut [usize], chords: &[f64]| {
                for (parts, chord) in parts.iter_mut().zip(chords) {
                    if *chord > chord_tolerance || !is_on_sides {
                        *parts += parts.div_ceil(3);
                    }
                }
            };
            finer(&mut divisions.spans, &chords.spans);
            finer(&mut divisions.gaps, &chords.gaps);
            if !is_on_sides {
                divisions.hub += divisions.hub.div_ceil(3);
            }
        }
        Err(too_fine())
    }

    /// Divisions by the largest sagitta of each gap, at its middle.
    fn first_divisions(&self, tolerance: f64) -> Divisions {
        let n = self.parameters.n_columns();
        let n_spans = self.span.len() - 1;
        let (mut along, mut across) = (vec![0.0_f64; n], vec![0.0_f64; n_spans]);
        for (span, across) in across.iter_mut().enumerate() {
            let curves = [0.0, 0.5, 1.0].map(|share| self.curve(span, share));
            for (gap, along) in along.iter_mut().enumerate() {
                let [low, middle, high] = [0, 1, 2].map(|k| Point3::from(curves[k].at(gap, 0.0).0));
                *across = across.max(off_line(&middle, [&low, &high]));
                for curve in &curves {
                    let [a, b, c] = [0.0, 0.5, 1.0].map(|share| Point3::from(curve.at(gap, share).0));
                    *along = along.max(off_line(&b, [&a, &c]));
                }
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the number of vertices")]
        let parts = |sagitta: f64| (sagitta / tolerance).sqrt().ceil().clamp(1.0, MOST_VERTICES as f64) as usize;
        let [spans, gaps] = [across, along].map(|sagittas| sagittas.into_iter().map(parts).collect());
        Divisions { spans, gaps, hub: FIRST_HUB_PARTS }
    }

    fn divided(
        &self,
        divisions: &Divisions,
        ends: &LoftEnds,
        tolerance: f64,
    ) -> Result<(LoftedBlade, Chords), LoftError> {
        // Each second place is one between columns, to measure at.
        let places = halved(&divisions.gaps);
        let curves = self.section_curves();
        let columns =
            places.iter().map(|place| LoftColumn::new(self, &curves, *place, ends)).collect::<Result<Vec<_>, _>>()?;
        let rows = self.rows(&divisions.spans);
        let around = self.around_coordinates(&places);
        let mut made = MeshInWork::default();
        let mut normals_before = Vec::new();
        let mut mesh = GroupedMesh::new(&LOFT_GROUPS);
        let mut chains = Vec::with_capacity(columns.len() / 2);
        for k in (0..columns.len()).step_by(2) {
            let [low, high] = columns[k].ends;
            let before = self.before_corner(&curves, places[k], ends)?;
            let mut chain = Vec::new();
            for (row, at) in kept_rows(&rows, [low, high]) {
                let (point, derivatives) = columns[k].at(&self.span, at);
                let to_next = columns[k + 1].point(&self.span, at) - point;
                let section = self.span.partition_point(|s| *s <= at).clamp(1, self.span.len() - 1) - 1;
                let folded = LoftError::Folded { section, point: places[k].0 };
                made.normals.push(checked_normal(self, &derivatives, &to_next, folded.clone())?);
                made.coordinates.push([(at - low) / (high - low), around[k]]);
                let vertex = mesh.vertex(point);
                if let Some(before) = &before {
                    let normal = self.normal(&before.at(&self.span, at).1).ok_or(folded)?;
                    normals_before.push((vertex, normal));
                }
                chain.push(ColumnVertex { row, at, vertex });
            }
            chains.push(chain);
        }
        let n = chains.len();
        let mut chords = Chords { spans: vec![0.0; divisions.spans.len()], gaps: vec![0.0; divisions.gaps.len()] };
        for k in 0..n {
            let strip = [&chains[k], &chains[(k + 1) % n]];
            let group = self.groups[places[2 * k].0];
            let around = [&columns[2 * k], &columns[2 * k + 1], &columns[(2 * k + 2) % (2 * n)]];
            let chord = self.fill_strip(&mut mesh, (group, places[2 * k].0), (strip, around), &mut chords);
            made.chord = made.chord.max(chord);
        }
        let row = |place: fn(&Vec<ColumnVertex>) -> Option<&ColumnVertex>| -> Vec<u32> {
            chains.iter().filter_map(place).map(|v| v.vertex).collect()
        };
        let [low, high] = [row(|chain| chain.first()), row(|chain| chain.last())];
        // From the leading to the trailing edge: of flat ends from a corner, as a facet at their
        // middle would have no area.
        let edge_columns = self.edges.map(|[from, _]| divisions.gaps[..from].iter().sum());
        close_row(&mut mesh, TIP, &high, edge_columns, !self.is_counter_clockwise);
        lay_on_wall(&mut mesh, TIP, ends.met_wall(1), tolerance, &mut made);
        if let (Some(sector), Some(wall)) = (&ends.sector, ends.met_wall(0)) {
            let on_hub = HubSectorMesh {
                wall,
                row: &low,
                edge_columns,
                is_counter_clockwise: self.is_counter_clockwise,
                parts: divisions.hub,
                sector,
            };
            on_hub.fill(&mut mesh, &mut made)?;
        } else {
            close_row(&mut mesh, ROOT, &low, edge_columns, self.is_counter_clockwise);
            lay_on_wall(&mut mesh, ROOT, ends.met_wall(0), tolerance, &mut made);
        }
        let MeshInWork { normals, coordinates, chord } = made;
        let mesh = mesh.build();
        let made = LoftedBlade { mesh, normals, normals_before, coordinates, chord_mm: chord, ends: ends.kinds };
        Ok((made, chords))
    }

    /// Column at a corner with the derivatives of the side before it; none at other places.
    fn before_corner(
        &self,
        curves: &[SectionCurve<'_>],
        (gap, share): (usize, f64),
        ends: &LoftEnds,
    ) -> Result<Option<LoftColumn>, LoftError> {
        if share > 0.0 || !self.parameters.corners.contains(&gap) {
            return Ok(None);
        }
        let n = self.parameters.n_columns();
        LoftColumn::new(self, curves, ((gap + n - 1) % n, 1.0), ends).map(Some)
    }

    /// Rows of the grid: places on the span, each with whether it is a section.
    fn rows(&self, parts: &[usize]) -> Vec<(f64, bool)> {
        let rows = halved(parts).into_iter().step_by(2).map(|(span, share)| {
            let at = self.span[span] + share * (self.span[span + 1] - self.span[span]);
            (at, share == 0.0)
        });
        rows.chain([(self.span[parts.len()], true)]).collect()
    }

    /// Coordinate around the blade of places, by the mean lengths along its sections: 0 at the
    /// leading edge, 1 at the trailing edge, negative on the pressure side.
    fn around_coordinates(&self, places: &[(usize, f64)]) -> Vec<f64> {
        let n = self.parameters.n_columns();
        let whole = self.parameters.length(n);
        let [leading, trailing] =
            self.edges.map(|[from, to]| self.parameters.length((from + (to + n - from) % n / 2) % n));
        let onward = (trailing - leading).rem_euclid(whole);
        let [_, to] = self.edges[0];
        let is_first_suction = (0..n).map(|k| self.groups[(to + k) % n]).find(|g| *g <= PRESSURE) == Some(SUCTION);
        let sign = if is_first_suction { 1.0 } else { -1.0 };
        let coordinate = |(gap, share): &(usize, f64)| {
            let [from, to] = [*gap, gap + 1].map(|k| self.parameters.length(k));
            let at = (from + share * (to - from) - leading).rem_euclid(whole);
            if at <= onward { sign * at / onward } else { -sign * (whole - at) / (whole - onward) }
        };
        places.iter().map(coordinate).map(|c| if c == -1.0 { 1.0 } else { c }).collect()
    }

    /// Fills the strip between two columns, and returns how far the surface is from its facets.
    /// `columns` are the first, the one in the middle and the next one, of the gap between points.
    fn fill_strip(
        &self,
        mesh: &mut GroupedMesh,
        (group, gap): (usize, usize),
        (chains, columns): ([&Vec<ColumnVertex>; 2], [&LoftColumn; 3]),
        chords: &mut Chords,
    ) -> f64 {
        let mut chord = 0.0_f64;
        // Corners by chain and place in it.
        let mut add = |mesh: &mut GroupedMesh, corners: [[usize; 2]; 3]| {
            let ids = corners.map(|[side, k]| chains[side][k].vertex);
            mesh.triangle(group, if self.is_counter_clockwise { ids } else { [ids[0], ids[2], ids[1]] });
            let facet = ids.map(|v| mesh.point(v));
            let ats = corners.map(|[side, k]| chains[side][k].at);
            for k in 0..3 {
                let [[a, i], [b, j]] = [corners[k], corners[(k + 1) % 3]];
                let column = if a != b { columns[1] } else { columns[2 * a] };
                let at = 0.5 * (ats[k] + ats[(k + 1) % 3]);
                let off = off_plane(&column.point(&self.span, at), &facet);
                chord = chord.max(off);
                if a != b {
                    chords.gaps[gap] = chords.gaps[gap].max(off);
                }
                if chains[a][i].row != chains[b][j].row {
                    let span = self.span.partition_point(|s| *s <= at).clamp(1, self.span.len() - 1) - 1;
                    chords.spans[span] = chords.spans[span].max(off);
                }
            }
        };
        let (mut i, mut j) = (0, 0);
        let end = chains.map(|chain| chain.len() - 1);
        while i < end[0] || j < end[1] {
            let next = |side: usize, k: usize| chains[side].get(k + 1).map_or(HIGH, |v| v.row);
            let [here, there] = [next(0, i), next(1, j)];
            let (is_left, is_right) = (here <= there && i < end[0], there <= here && j < end[1]);
            match (is_left, is_right) {
                (true, true) => {
                    let [a, b, c, d] = [[0, i], [1, j], [1, j + 1], [0, i + 1]];
                    let id = |[side, k]: [usize; 2]| chains[side][k].vertex;
                    let is_first = mesh.distance_sq(id(a), id(c)) <= mesh.distance_sq(id(b), id(d));
                    let split = if is_first { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                    split.into_iter().for_each(|corners| add(mesh, corners));
                    (i, j) = (i + 1, j + 1);
                }
                (true, false) => {
                    add(mesh, [[0, i], [1, j], [0, i + 1]]);
                    i += 1;
                }
                _ => {
                    add(mesh, [[0, i], [1, j], [1, j + 1]]);
                    j += 1;
                }
            }
        }
        chord
    }
}

/// Places at the start and in the middle of each part of gaps.
fn halved(parts: &[usize]) -> Vec<(usize, f64)> {
    let of = |(k, &n): (usize, &usize)| {
        (0..2 * n).map(move |i| {
            #[expect(clippy::cast_precision_loss, reason = "at most the number of vertices")]
            let share = i as f64 / (2 * n) as f64;
            (k, share)
        })
    };
    parts.iter().enumerate().flat_map(of).collect()
}

/// Rows of a column with its ends: of the grid those between, and not too near to an end unless
/// they are sections.
fn kept_rows(rows: &[(f64, bool)], [low, high]: [f64; 2]) -> Vec<(usize, f64)> {
    let mut kept = vec![(LOW, low)];
    for (k, &(at, is_section)) in rows.iter().enumerate() {
        let step = |other: Option<&(f64, bool)>| {
            if is_section { 0.0 } else { LEAST_STEP * other.map_or(0.0, |(there, _)| (there - at).abs()) }
        };
        if at > low + step(rows.get(k + 1)) && at < high - step(k.checked_sub(1).and_then(|k| rows.get(k))) {
            kept.push((k + 1, at));
        }
    }
    kept.push((HIGH, high));
    kept
}

/// Distance of a point from the line through two others.
fn off_line(point: &Point3<f64>, [a, b]: [&Point3<f64>; 2]) -> f64 {
    let side = b - a;
    let from = point - a;
    (from - side * (from.dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE))).norm()
}

/// Distance of a point from the plane of a facet; zero from one without area.
fn off_plane(point: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let length = normal.norm();
    if length > 0.0 { (point - a).dot(&normal).abs() / length } else { 0.0 }
}
