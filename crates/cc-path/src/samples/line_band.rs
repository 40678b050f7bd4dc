//! Band along the lines that passes of edges and roots are laid beside.

use std::ops::Range;

use facemill_surface_model::Surface;
use nalgebra::Point3;

use crate::distance::patch_vertices::PatchVertices;
use crate::distance::source_curve::SourceCurve;
use crate::error::PathError;
use crate::layout::offset::edge_lines::group_indices;
use crate::layout::offset::fillet::Fillet;
use crate::layout::offset::offset_field::OffsetField;
use crate::layout::offset::ridge::lines_of_edge;
use crate::layout::offset::rolling_ball::RollingBall;
use crate::layout::offset::root_sides::root_sides;
use crate::layout::scallop::surface_path::SurfacePath;
use crate::layout::section_layout::extent;
use crate::region::Region;
use crate::samples::region_lines::RegionLines;
use crate::strategy::Strategy;
use crate::strategy::edge::{Edge, Root, RootLine};
use crate::strategy::patch::{Fineness, Patch};

/// Longest edge of the pieces that distances are taken at, as a share of the band's width.
const PIECES: f64 = 0.125;

/// Piece of a facet with the distances of its corners from the line, mm.
#[derive(Clone, Debug)]
struct BandPiece {
    facet: u32,
    corners: [Point3<f64>; 3],
    distances: [f64; 3],
}

/// The part of a surface within a distance of lines on it, along the surface, on both sides.
#[derive(Clone, Debug)]
pub(crate) struct LineBand {
    width: f64,
    /// The lines, where the band has no width and is nothing else.
    lines: Option<RegionLines>,
    /// By rising facets.
    pieces: Vec<BandPiece>,
    /// Pieces of each facet of the surface.
    of_facet: Vec<Range<u32>>,
}

impl LineBand {
    /// The band of an edge or root; none for other strategies, which reach all of a region.
    ///
    /// # Errors
    /// When there is no such line in the region.
    pub(crate) fn of(
        surface: &Surface,
        region: &Region,
        strategy: &Strategy,
        corner_radius: f64,
    ) -> Result<Option<Self>, PathError> {
        match strategy {
            Strategy::Edge(edge) => of_edge(surface, region, edge).map(Some),
            Strategy::Root(root) => of_root(surface, region, root, corner_radius).map(Some),
            _ => Ok(None),
        }
    }

    fn new(surface: &Surface, width: f64, parts: BandParts) -> Self {
        let BandParts { lines, mut pieces } = parts;
        let lines = (width == 0.0).then(|| RegionLines::new(lines));
        pieces.sort_by_key(|p| p.facet);
        let facets = 0..surface.mesh().triangles().len() as u32;
        let up_to = |facet: u32| pieces.partition_point(|p| p.facet < facet) as u32;
        let of_facet = facets.map(|f| up_to(f)..up_to(f + 1)).collect();
        Self { width, lines, pieces, of_facet }
    }

    /// The lines that a band without width consists of.
    pub(crate) fn lines(&self) -> Option<&RegionLines> {
        self.lines.as_ref()
    }

    /// Whether the band holds a point of a facet; one without width holds none.
    pub(crate) fn contains(&self, facet: u32, point: &Point3<f64>) -> bool {
        let of_facet = &self.of_facet[facet as usize];
        let pieces = &self.pieces[of_facet.start as usize..of_facet.end as usize];
        // The piece that holds the point, to rounding.
        let nearest =
            pieces.iter().map(|p| (p, p.weights(point))).max_by(|(_, a), (_, b)| least(a).total_cmp(&least(b)));
        nearest.is_some_and(|(piece, weights)| {
            let distance: f64 = (0..3).map(|k| weights[k] * piece.distances[k]).sum();
            distance.abs() <= self.width
        })
    }
}

impl BandPiece {
    /// Barycentric coordinates of a point in the plane of the piece.
    fn weights(&self, point: &Point3<f64>) -> [f64; 3] {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(&(c - a));
        let share =
            |p: &Point3<f64>, q: &Point3<f64>| (p - point).cross(&(q - point)).dot(&normal) / normal.norm_squared();
        [share(&b, &c), share(&c, &a), share(&a, &b)]
    }
}

fn least(weights: &[f64; 3]) -> f64 {
    // NaN of a piece without area is below all.
    weights.iter().map(|w| if w.is_nan() { f64::NEG_INFINITY } else { *w }).fold(f64::INFINITY, f64::min)
}

fn patch_of<'a>(surface: &'a Surface, region: &Region, width: f64) -> Result<Patch<'a>, PathError> {
    let max_edge = (PIECES * width).max(extent(surface.mesh()) / 300.0);
    Patch::new(surface, region, None, &Fineness { max_edge, max_bend: f64::INFINITY, cuts_range: false })
}

fn of_edge(surface: &Surface, region: &Region, edge: &Edge) -> Result<LineBand, PathError> {
    let patch = patch_of(surface, region, edge.width)?;
    let vertices = PatchVertices::of(&patch);
    let lines = lines_of_edge(&patch, &vertices, &edge.line)?;
    let mut parts = BandParts::default();
    parts.add(&patch, &vertices, lines, edge.width);
    Ok(LineBand::new(surface, edge.width, parts))
}

fn of_root(surface: &Surface, region: &Region, root: &Root, corner_radius: f64) -> Result<LineBand, PathError> {
    let mut parts = BandParts::default();
    match &root.line {
        RootLine::Fillet(group) => {
            let [index] = group_indices(surface, std::array::from_ref(group))?;
            let patch = patch_of(surface, region, root.width)?;
            let vertices = PatchVertices::of(&patch);
            let lines = Fillet::new(&patch, &vertices, index).middle(PIECES * root.width)?;
            parts.add(&patch, &vertices, lines, root.width);
        }
        RootLine::BetweenGroups(groups) => {
            for side in root_sides(surface, region, groups)? {
                let patch = patch_of(surface, &side.region, root.width)?;
                let vertices = PatchVertices::of(&patch);
                let track = RollingBall::new(&patch, &vertices, &side.other, corner_radius).track();
                parts.add(&patch, &vertices, track, root.width);
            }
        }
    }
    Ok(LineBand::new(surface, root.width, parts))
}

/// Lines of a band, and the pieces beside them.
#[derive(Default)]
struct BandParts {
    lines: Vec<SurfacePath>,
    pieces: Vec<BandPiece>,
}

impl BandParts {
    /// Adds lines on a patch, with the pieces within `width` (mm), if it is above 0.
    fn add(&mut self, patch: &Patch, vertices: &PatchVertices, lines: Vec<SurfacePath>, width: f64) {
        if width > 0.0 {
            self.pieces.extend(pieces_beside(patch, vertices, &lines, width));
        }
        self.lines.extend(lines);
    }
}

/// Pieces of a patch that reach into the band.
fn pieces_beside(patch: &Patch, vertices: &PatchVertices, lines: &[SurfacePath], width: f64) -> Vec<BandPiece> {
    let curves: Vec<SourceCurve> = lines.iter().filter_map(|l| l.source(patch, PIECES * width)).collect();
    let field = OffsetField::new(patch, vertices, &curves, width * (1.0 + 2.0 * PIECES));
    let piece = |&t: &u32| {
        let distances = patch.mesh.triangles()[t as usize].map(|v| field.values[v as usize]);
        BandPiece { facet: patch.parent(t), corners: patch.mesh.corners(t as usize), distances }
    };
    field.triangles.iter().map(piece).collect()
}
