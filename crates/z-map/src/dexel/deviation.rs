//! How far the cut stock is from the part that it should have become.

pub(crate) mod line;

use facemill_cl_data::{Cancelled, Monitor};
use facemill_surface_model::{Surface, TriMesh};
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::dexel::crossings::{Crossing, crossings_of_tile, merged, outer};
use crate::dexel::deviation::line::LinePair;
use crate::dexel::grid::DexelGrid;
use crate::dexel::map::DexelMap;
use crate::dexel::mesh_stock::{MAX_REACH, bins};
use crate::dexel::tile::{LINES, SIDE};

/// A place where a line of a map goes through the surface of a part, and how far the stock's
/// surface is from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviationPoint {
    /// On the part, workpiece frame, mm.
    pub position: Point3<f64>,
    /// Triangle of the part.
    pub triangle: u32,
    /// Material too much (positive) or too little (negative: a gouge), mm; −∞ where there is no
    /// stock at all under the surface of a part that is not closed.
    pub deviation: f64,
    /// Whether the stock's surface there is another than before: something was cut.
    pub is_cut: bool,
}

/// Part that is gone although the stock reaches the part's surface on both sides of it along a
/// line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cavity {
    /// Middle of the gap, workpiece frame, mm.
    pub position: Point3<f64>,
    /// Distance from the part's surface that no point of the gap is beyond, at most a twentieth and
    /// 0.01 mm too much, mm.
    pub depth: f64,
}

/// Reason why stock cannot be compared with a part.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviationError {
    /// The two maps have different lines.
    #[error("the stock before and after cutting are not on the same lines")]
    OtherLines,
    /// The part is too far from the map's origin to be counted in whole quanta of 2⁻²⁶ mm.
    #[error("the part reaches {reach:.3e} mm from the dexels' origin, more than {:.3e} mm; move it", MAX_REACH)]
    TooFar {
        /// Largest coordinate, map frame, mm.
        reach: f64,
    },
    /// The monitor requested cancellation.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Comparison of the stock with a part, at every place where a line of the map goes through the
/// part's surface.
///
/// At such a place the stock's end is looked for along the line: with material over the place the
/// upper end of that material, else the end of what is next below it; for a surface that looks down
/// the same the other way round. The deviation is the distance of this end from that part of the
/// surface that looks the same way as the place (normals less than 90° apart) and sees the end from
/// the same side, so that a neighbouring blade is not taken for it. So it is:
/// - exact up to rounding (10⁻⁷ mm) for every line, whatever its slope to the surface: the end is a
///   point of the stock's surface;
/// - never less than the end's distance from the whole part, and never more than its distance along
///   the line;
/// - stopped where the line comes to the next surface of the part: a blade that is cut through is
///   gouged by its thickness, a gap between two blades that is full of stock is an excess of its
///   width.
///
/// For a closed part, all material missing on a line is found: what is missing away from a surface
/// is reported as [`Cavity`]. Stock that hangs in the air, with a gap between it and the part, is
/// no deviation. Between the lines nothing is said: a gouge narrower than the cell can be missed.
/// Walls along the lines are not crossed by them; they have no places.
#[derive(Clone, Debug)]
pub struct Deviation<'a> {
    part: &'a Surface,
    grid: DexelGrid,
    tiles: Vec<TilePlaces>,
}

/// Record of a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    pub height: f64,
    pub deviation: f64,
    pub triangle: u32,
    pub is_cut: bool,
}

/// Places of a tile, by line.
#[derive(Clone, Debug, Default)]
struct TilePlaces {
    /// First record of each line, and the number of all; empty where there are none.
    starts: Vec<u32>,
    records: Vec<Record>,
    cavity: Option<Cavity>,
}

impl DexelMap {
    /// Holds this stock against a part in the workpiece frame. `before` is the stock before it was
    /// cut, on the same lines.
    ///
    /// Of the part's closed components only the outside counts, also where they overlap; of others
    /// every triangle. The result does not depend on the number of threads; `monitor` is notified
    /// of every tile.
    ///
    /// # Errors
    /// When the maps have different lines, the part is too far away, or the monitor cancels.
    pub fn deviation<'a>(
        &self,
        before: &DexelMap,
        part: &'a Surface,
        monitor: &dyn Monitor,
    ) -> Result<Deviation<'a>, DeviationError> {
        if before.grid != self.grid {
            return Err(DeviationError::OtherLines);
        }
        let mesh = part.mesh().transformed(&self.grid.work_from_map().inverse());
        let bounds = mesh.aabb();
        let reach = bounds.min.coords.amax().max(bounds.max.coords.amax());
        if !mesh.triangles().is_empty() && reach > MAX_REACH {
            return Err(DeviationError::TooFar { reach });
        }
        let bins = bins(self, &mesh, 0.0);
        let held = Held { map: self, before, part, mesh: &mesh };
        let tile = |k: usize| {
            monitor.checkpoint()?;
            let found = held.tile(k, &bins[k]);
            monitor.advance(1);
            Ok(found)
        };
        let tiles = (0..self.tiles.len()).into_par_iter().map(tile).collect::<Result<Vec<_>, Cancelled>>()?;
        Ok(Deviation { part, grid: self.grid, tiles })
    }

    /// Number of tiles: steps of [`DexelMap::deviation`].
    pub fn n_tiles(&self) -> usize {
        self.tiles.len()
    }
}

impl Deviation<'_> {
    /// The direction along the lines, workpiece frame.
    pub fn along(&self) -> Unit<Vector3<f64>> {
        self.grid.work_from_map().rotation * Vector3::z_axis()
    }

    /// All places, line by line within tiles, upward.
    pub fn places(&self) -> impl Iterator<Item = DeviationPoint> + '_ {
        let tiles_x = self.grid.n_lines()[0].div_ceil(SIDE);
        self.tiles.iter().enumerate().filter(|(_, t)| !t.starts.is_empty()).flat_map(move |(k, tile)| {
            let (i0, j0) = (k % tiles_x * SIDE, k / tiles_x * SIDE);
            (0..LINES).flat_map(move |line| {
                tile.of_line(line).iter().map(move |r| self.place(i0 + line % SIDE, j0 + line / SIDE, r))
            })
        })
    }

    /// The deepest of all cavities; of equal ones the first by tile.
    pub fn deepest_cavity(&self) -> Option<Cavity> {
        self.tiles.iter().filter_map(|t| t.cavity).reduce(deeper)
    }

    /// The place next to a point of the part with this normal: the nearest one on the nine lines
    /// around it, of those whose normals are within 60° of it, and that are not farther away than
    /// lines may be along such a slope, nor than eight cells: beside a wall along the lines there
    /// may be none but on another surface.
    pub fn near(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> Option<DeviationPoint> {
        let frame = self.grid.work_from_map();
        let p = frame.inverse_transform_point(point);
        let rise = frame.inverse_transform_vector(normal).z.abs();
        let [i, j] = [0, 1].map(|k| ((p[k] - self.grid.origin()[k]) / self.grid.cell()).floor() as i64);
        let mut nearest: Option<(f64, DeviationPoint)> = None;
        for (a, b) in (-1..=1).flat_map(|b| (-1..=1).map(move |a| (i + a, j + b))) {
            let (Ok(a), Ok(b)) = (usize::try_from(a), usize::try_from(b)) else { continue };
            for record in self.records(a, b) {
                let place = self.place(a, b, record);
                let distance = (place.position - point).norm();
                let reach = (2.0 / rise).min(WALL_CELLS) * self.grid.cell();
                let is_near = distance <= reach && nearest.is_none_or(|(d, _)| distance < d);
                let looks_alike = || self.part.facet_normal(place.triangle).is_some_and(|n| n.dot(normal) > 0.5);
                if is_near && looks_alike() {
                    nearest = Some((distance, place));
                }
            }
        }
        nearest.map(|(_, place)| place)
    }

    fn records(&self, i: usize, j: usize) -> &[Record] {
        let [nx, ny] = self.grid.n_lines();
        if i >= nx || j >= ny {
            return &[];
        }
        self.tiles[j / SIDE * nx.div_ceil(SIDE) + i / SIDE].of_line(j % SIDE * SIDE + i % SIDE)
    }

    fn place(&self, i: usize, j: usize, record: &Record) -> DeviationPoint {
        let Record { height, deviation, triangle, is_cut } = *record;
        DeviationPoint { position: self.grid.in_work(i, j, height), triangle, deviation, is_cut }
    }
}

impl TilePlaces {
    fn of_line(&self, line: usize) -> &[Record] {
        match self.starts.get(line..line + 2) {
            Some(ends) => &self.records[ends[0] as usize..ends[1] as usize],
            None => &[],
        }
    }
}

/// Largest distance of a place from a point, in cells. Where the lines are 5° or more off the
/// surface, one of those around it has a nearer place; along steeper walls there may be none.
const WALL_CELLS: f64 = 8.0;

/// Two maps and a part.
struct Held<'a> {
    map: &'a DexelMap,
    before: &'a DexelMap,
    part: &'a Surface,
    /// In the map's frame.
    mesh: &'a TriMesh,
}

impl Held<'_> {
    fn tile(&self, index: usize, bin: &[u32]) -> TilePlaces {
        let tiles_x = self.map.tiles_x();
        let (i0, j0) = (index % tiles_x * SIDE, index / tiles_x * SIDE);
        let crossings = crossings_of_tile(&self.map.grid, [i0, j0], self.mesh, bin);
        let mut out = TilePlaces::default();
        if crossings.is_empty() {
            return out;
        }
        for of_line in crossings.chunk_by(|a, b| a.line == b.line) {
            let line = usize::from(of_line[0].line);
            let is_closed = |c: &&Crossing| self.part.component(c.triangle).closed;
            let (closed, open): (Vec<&Crossing>, Vec<&Crossing>) = of_line.iter().partition(is_closed);
            let solid = outer(closed.into_iter().copied());
            let kept = match &solid {
                Some(solid) => merged(solid, open),
                None => of_line.to_vec(),
            };
            out.starts.resize(line + 1, out.records.len() as u32);
            let at = LinePair {
                part: self.part,
                grid: &self.map.grid,
                i: i0 + line % SIDE,
                j: j0 + line / SIDE,
                now: self.map.tiles[index].intervals(line).collect(),
                before: self.before.tiles[index].intervals(line).collect(),
            };
            out.records.extend((0..kept.len()).map(|k| at.record(&kept, k)));
            if let Some(solid) = &solid {
                out.cavity = out.cavity.into_iter().chain(at.cavities(solid)).reduce(deeper);
            }
        }
        out.starts.resize(LINES + 1, out.records.len() as u32);
        out
    }
}

pub(crate) fn deeper(a: Cavity, b: Cavity) -> Cavity {
    if b.depth > a.depth { b } else { a }
}
