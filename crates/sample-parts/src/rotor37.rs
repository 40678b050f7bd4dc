//! Rotor 37 as a mesh, from its published table.

pub(crate) mod table;

use facemill_surface_model::TriMesh;
use nalgebra::Point3;

use crate::grouped_mesh::GroupedMesh;
use crate::rotor37::table::SURFACES;
use crate::sheets::{BLADE_GROUPS, EDGE, Sheet, close_sheets};
use crate::spec_error::{SpecError, in_range};
use crate::spline::CubicSpline;
use crate::spline::SplineEnd::NotAKnot;

/// Stations of the table on each side of a surface.
const N_STATIONS: usize = 100;

/// Stations from each end that make up the group `edge`: the arcs of the edges end at station 17 of
/// the table.
const EDGE_STATIONS: usize = 18;

/// Station by whose radius the surfaces are ordered from hub to tip.
const MIDDLE: usize = N_STATIONS / 2;

/// mm in the table's cm.
const MM: f64 = 10.0;

/// Rows and columns of [`rotor37`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RotorResolution {
    n_span: usize,
    n_between: usize,
}

impl Default for RotorResolution {
    /// 48 quads along the span, the table's stations along the chord.
    fn default() -> Self {
        Self { n_span: 48, n_between: 1 }
    }
}

impl RotorResolution {
    /// Quads from hub to tip, 2 to 2000, and quads between neighbouring stations of the table (99
    /// pairs), 1 to 20.
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn new(n_span: usize, n_between: usize) -> Result<Self, SpecError> {
        #[expect(clippy::cast_precision_loss, reason = "numbers that large are refused")]
        let (span, between) = (n_span as f64, n_between as f64);
        in_range("number of spanwise quads", span, 2.0, 2000.0)?;
        in_range("number of quads between stations", between, 1.0, 20.0)?;
        Ok(Self { n_span, n_between })
    }
}

/// One of the 36 blades of the compressor rotor NASA Rotor 37: closed, in mm, rotor axis +Z in the
/// direction of flow.
///
/// The table's 13 surfaces are joined by cubic splines along the span through each of its 100
/// stations, and by cubic splines around each section through its leading edge; so the blade goes
/// through every table point and has two continuous derivatives but at the trailing edge.
/// (Mid-chord the table itself is slightly wavy.) Angle θ is about +Z from +X. The suction side
/// faces +θ, the rotor turns about −Z. Groups as for [`crate::blade`]: `suction` and `pressure` are
/// structured patches, `edge` holds the arcs of both edges, 1 % of the chord, `tip` and `root`
/// close the blade on the outermost and innermost surface.
///
/// ```
/// use facemill_sample_parts::{RotorResolution, rotor37};
///
/// let mesh = rotor37(RotorResolution::default());
/// assert_eq!(mesh.groups().len(), 5);
/// ```
pub fn rotor37(resolution: RotorResolution) -> TriMesh {
    let mut mesh = GroupedMesh::new(&BLADE_GROUPS);
    let sheets = sheets(resolution, &mut mesh);
    let edge = EDGE_STATIONS * resolution.n_between;
    let n_columns = (N_STATIONS - 1) * resolution.n_between;
    close_sheets(&mut mesh, &sheets, |_, k, side| if k < edge || k + edge >= n_columns { EDGE } else { side });
    mesh.build()
}

fn sheets(resolution: RotorResolution, mesh: &mut GroupedMesh) -> [Sheet; 2] {
    let span = SpanSplines::new();
    let (mut suction, mut pressure) = (Sheet::new(), Sheet::new());
    for row in 0..=resolution.n_span {
        #[expect(clippy::cast_precision_loss, reason = "at most 2000")]
        let loop_points = refined(&span.section(row as f64 / resolution.n_span as f64), resolution.n_between);
        let vertices: Vec<u32> = loop_points.into_iter().map(|point| mesh.vertex(point)).collect();
        let leading = vertices.len() / 2;
        suction.push(vertices[..=leading].iter().rev().copied().collect());
        let mut on_pressure = vertices[leading..].to_vec();
        on_pressure.push(vertices[0]);
        pressure.push(on_pressure);
    }
    [suction, pressure]
}

/// Splines over the span for each station: Z, R, θ of both sides.
struct SpanSplines {
    stations: Vec<[CubicSpline; 4]>,
}

impl SpanSplines {
    fn new() -> Self {
        let [hub, tip] = [0, SURFACES.len() - 1].map(|surface| SURFACES[surface][MIDDLE][1]);
        let share = |surface: &[[f64; 4]; N_STATIONS]| (surface[MIDDLE][1] - hub) / (tip - hub);
        let spline = |station: usize, column: usize| {
            CubicSpline::new(SURFACES.iter().map(|s| (share(s), s[station][column])), NotAKnot, NotAKnot)
        };
        Self { stations: (0..N_STATIONS).map(|station| [0, 1, 2, 3].map(|column| spline(station, column))).collect() }
    }

    /// Points at a share of the span, from the trailing edge over the suction side and the leading
    /// edge along the pressure side; the last one is before the trailing edge, which both sides
    /// share.
    fn section(&self, share: f64) -> Vec<Point3<f64>> {
        let point = |station: usize, theta_column: usize| {
            let [z, r, theta] = [0, 1, theta_column].map(|column| self.stations[station][column].value(share));
            Point3::new(MM * r * theta.cos(), MM * r * theta.sin(), MM * z)
        };
        let suction = (0..N_STATIONS).rev().map(|station| point(station, 2));
        suction.chain((1..N_STATIONS - 1).map(|station| point(station, 3))).collect()
    }
}

/// The closed section with `n_between` pieces in place of one, on splines over the index from
/// trailing edge to trailing edge.
fn refined(section: &[Point3<f64>], n_between: usize) -> Vec<Point3<f64>> {
    if n_between == 1 {
        return section.to_vec();
    }
    #[expect(clippy::cast_precision_loss, reason = "a few thousand")]
    let number = |k: usize| k as f64;
    let closed = || section.iter().chain(&section[..1]).enumerate();
    let along =
        [0, 1, 2].map(|axis| CubicSpline::new(closed().map(|(k, point)| (number(k), point[axis])), NotAKnot, NotAKnot));
    let indices = (0..section.len() * n_between).map(|k| number(k) / number(n_between));
    indices.map(|index| Point3::from([0, 1, 2].map(|axis| along[axis].value(index)))).collect()
}
