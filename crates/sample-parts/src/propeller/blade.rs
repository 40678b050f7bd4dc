use facemill_surface_model::TriMesh;

use crate::grouped_mesh::GroupedMesh;
use crate::propeller::blade_grid::BladeGrid;
use crate::propeller::blade_section::BladeSide;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::spec::PropellerSpec;
use crate::propeller::table::Hand;
use crate::sheets::{BLADE_GROUPS, EDGE, ROOT, Sheet, TIP, close_sheets};
use crate::spec_error::{SpecError, in_range};

/// Number of quads on one side of a blade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BladeResolution {
    n_radial: usize,
    n_chord: usize,
}

/// Most rows or columns of a [`BladeResolution`]: 16 million triangles.
pub(crate) const MOST_ROWS: usize = 2000;

impl Default for BladeResolution {
    /// 100 by 150: on a DTMB 4119 of 3,048 mm the facets are within 0.07 mm of both sides and 0.13
    /// mm of the edges.
    fn default() -> Self {
        Self { n_radial: 100, n_chord: 150 }
    }
}

impl BladeResolution {
    /// Quads from the hub to the rounding of the tip, and along the chord between the bands of the
    /// edges; 8 to 2000 each.
    ///
    /// The bands of the edges (3 % of the chord each), the tip's rounding and the root in the hub
    /// get rows and columns of their own in proportion.
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn new(n_radial: usize, n_chord: usize) -> Result<Self, SpecError> {
        #[expect(clippy::cast_precision_loss, reason = "numbers that large are refused")]
        for (field, n) in [("number of radial quads", n_radial), ("number of chordwise quads", n_chord)] {
            in_range(field, n as f64, 8.0, MOST_ROWS as f64)?;
        }
        Ok(Self { n_radial, n_chord })
    }

    /// Quads between hub and tip.
    pub fn n_radial(&self) -> usize {
        self.n_radial
    }

    /// Quads between leading and trailing edge.
    pub fn n_chord(&self) -> usize {
        self.n_chord
    }
}

/// One blade, closed, in mm: shaft axis +Z, suction side facing +Z, generator line in the half
/// plane of +X.
///
/// +Z points ahead; driving, the propeller turns about +Z if it is right-handed. The mesh of a
/// left-handed one is the mirror image in the plane y = 0, wound outward like the other. Vertices
/// lie on [`BladeSurface`], on cylinders of constant radius and at constant chord fractions, but
/// for columns of the suction side that make room for an anti-singing edge
/// ([`crate::AntiSingingEdge`]): its chamfer takes the trailing edge's band, whatever its width.
/// Groups:
/// - `suction`, `pressure`: structured patches of n_radial × n_chord quads from the hub's radius to
///   the rounding of the tip, without the bands of the edges;
/// - `edge`: leading and trailing edge, 3 % of the chord on both sides;
/// - `tip`: the rounding that closes the blade at R, over half its thickness;
/// - `root`: what is inside the hub, 0.15 hub radii deep, with the closing face.
///
/// The same arguments give the same mesh.
///
/// ```
/// use facemill_sample_parts::{BladeResolution, PropellerSeries, PropellerSpec, SpecError, blade};
///
/// let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0)?;
/// let mesh = blade(&spec, BladeResolution::new(20, 30)?);
/// assert_eq!(mesh.groups()[0].name, "suction");
/// assert_eq!(mesh.groups()[0].triangles.len(), 2 * 20 * 30);
/// # Ok::<(), SpecError>(())
/// ```
pub fn blade(spec: &PropellerSpec, resolution: BladeResolution) -> TriMesh {
    let surface = BladeSurface::new(spec);
    let grid = BladeGrid::new(&surface, resolution);
    let mut mesh = GroupedMesh::new(&BLADE_GROUPS);
    let sheets = sheets(&surface, &grid, &mut mesh);
    close_sheets(&mut mesh, &sheets, |row, column, side| group_of(&grid, row, column, side));
    if spec.hand() == Hand::Left {
        mesh.reverse();
    }
    mesh.build()
}

/// Vertices of both sides by row and column; both edges and the last row are shared.
fn sheets(surface: &BladeSurface, grid: &BladeGrid, mesh: &mut GroupedMesh) -> [Sheet; 2] {
    let last = grid.fractions.len() - 1;
    let (mut suction, mut pressure) = (Vec::new(), Vec::new());
    for (row, &radius) in grid.radii.iter().enumerate() {
        let section = surface.section(radius);
        let on_suction: Vec<u32> = grid
            .fractions
            .iter()
            .map(|&x| mesh.vertex(section.point(BladeSide::Suction, section.column(BladeSide::Suction, x))))
            .collect();
        let on_pressure = if row + 1 == grid.radii.len() {
            on_suction.clone()
        } else {
            let inner = grid.fractions[1..last].iter().map(|&x| mesh.vertex(section.point(BladeSide::Pressure, x)));
            let mut row = vec![on_suction[0]];
            row.extend(inner);
            row.push(on_suction[last]);
            row
        };
        suction.push(on_suction);
        pressure.push(on_pressure);
    }
    [suction, pressure]
}

/// Group of a quad that is inside on `side`.
fn group_of(grid: &BladeGrid, row: usize, column: usize, side: usize) -> usize {
    let n_columns = grid.fractions.len() - 1;
    if row < grid.hub_row {
        ROOT
    } else if row >= grid.tip_row {
        TIP
    } else if column < grid.n_edge || column + grid.n_edge >= n_columns {
        EDGE
    } else {
        side
    }
}
