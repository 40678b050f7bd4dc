//! Meshes of K equal sectors about +Z.

use std::f64::consts::TAU;

use facemill_surface_model::{Group, TriMesh};
use nalgebra::{Point3, Rotation3, Vector3};

/// Groups of a propeller as one solid, in the order of its mesh: those of a blade, by side as
/// [`SideGroup`] has them, then the hub's.
pub(crate) const SECTOR_GROUPS: [&str; 14] = [
    "suction",
    "suction-leading-edge",
    "suction-trailing-edge",
    "suction-tip",
    "suction-fillet",
    "pressure",
    "pressure-leading-edge",
    "pressure-trailing-edge",
    "pressure-tip",
    "pressure-fillet",
    "hub/cylinder",
    "hub/ends",
    "hub/faces",
    "hub/bore",
];
pub(crate) const CYLINDER: usize = 10;
pub(crate) const ENDS: usize = 11;
pub(crate) const FACES: usize = 12;
pub(crate) const BORE: usize = 13;

/// Group of one side of a blade; edges, tip and fillet go as far as the line where both sides meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SideGroup {
    Side,
    LeadingEdge,
    TrailingEdge,
    Tip,
    Fillet,
}

impl SideGroup {
    /// Returns the group of the suction (0) or pressure side (1).
    pub(crate) fn of(self, side: usize) -> usize {
        self as usize + side * (CYLINDER / 2)
    }
}

/// Corner of a triangle of a sector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Corner {
    /// A vertex of the sector so many sectors on.
    Turned { vertex: u32, turn: i32 },
    /// A vertex on the axis, which all sectors share.
    OnAxis(u32),
}

/// Vertices and triangles that are there K times, each time turned by 2π/K about +Z.
#[derive(Debug)]
pub(crate) struct Sector {
    n_sectors: usize,
    vertices: Vec<Point3<f64>>,
    on_axis: Vec<Point3<f64>>,
    groups: [Vec<[Corner; 3]>; SECTOR_GROUPS.len()],
}

impl Sector {
    pub(crate) fn new(n_sectors: usize) -> Self {
        Self { n_sectors, vertices: Vec::new(), on_axis: Vec::new(), groups: Default::default() }
    }

    /// Returns the angle of a sector, rad.
    pub(crate) fn angle(&self) -> f64 {
        TAU / self.n_sectors as f64
    }

    /// Returns the index of a new vertex.
    pub(crate) fn vertex(&mut self, point: Point3<f64>) -> u32 {
        self.vertices.push(point);
        index(self.vertices.len() - 1)
    }

    /// Returns a new corner on the axis.
    pub(crate) fn axis_vertex(&mut self, z: f64) -> Corner {
        self.on_axis.push(Point3::new(0.0, 0.0, z));
        Corner::OnAxis(index(self.on_axis.len() - 1))
    }

    /// Returns the place of a corner.
    pub(crate) fn place(&self, corner: Corner) -> Point3<f64> {
        match corner {
            Corner::Turned { vertex, turn } => {
                Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(turn) * self.angle())
                    * self.vertices[vertex as usize]
            }
            Corner::OnAxis(vertex) => self.on_axis[vertex as usize],
        }
    }

    /// Adds a triangle to a group unless two of its corners are the same.
    pub(crate) fn triangle(&mut self, group: usize, [a, b, c]: [Corner; 3]) {
        if a != b && b != c && c != a {
            self.groups[group].push([a, b, c]);
        }
    }

    /// Adds the quad `a, b, c, d` to a group, split by [`split_quad`].
    pub(crate) fn quad(&mut self, group: usize, corners: [Corner; 4]) {
        self.quad_without(group, corners, |_| false);
    }

    /// As [`Self::quad`], with the other diagonal where the one would join two corners of a kind.
    pub(crate) fn quad_without(&mut self, group: usize, corners: [Corner; 4], is_of_kind: impl Fn(Corner) -> bool) {
        let mut split = split_quad(corners.map(|corner| self.place(corner)));
        let [from, to] = [split[1][0], split[0][2]];
        if is_of_kind(corners[from]) && is_of_kind(corners[to]) {
            split = SPLITS[usize::from(split == SPLITS[0])];
        }
        for triangle in split {
            self.triangle(group, triangle.map(|k| corners[k]));
        }
    }

    /// Returns the mesh of all sectors, or its mirror image in the plane y = 0, with groups
    /// `blade-k/…` by blade and `hub/…`; groups without triangles are left out.
    ///
    /// Sector k is the first turned by 2πk/K, in the mirror image, too.
    pub(crate) fn build(&self, is_mirrored: bool) -> TriMesh {
        let sense = if is_mirrored { -1.0 } else { 1.0 };
        let mut vertices = Vec::with_capacity(self.n_sectors * self.vertices.len() + self.on_axis.len());
        for k in 0..self.n_sectors {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), k as f64 * self.angle());
            vertices.extend(self.vertices.iter().map(|p| turn * Point3::new(p.x, sense * p.y, p.z)));
        }
        vertices.extend(&self.on_axis);
        let (mut triangles, mut groups) = (Vec::new(), Vec::new());
        let mut add = |name: String, group: usize, sectors: std::ops::Range<usize>| {
            let start = triangles.len();
            for k in sectors {
                triangles.extend(self.groups[group].iter().map(|t| self.turned(*t, k, is_mirrored)));
            }
            if triangles.len() > start {
                groups.push(Group { name, triangles: start..triangles.len() });
            }
        };
        for k in 0..self.n_sectors {
            for (group, name) in SECTOR_GROUPS[..CYLINDER].iter().enumerate() {
                add(format!("blade-{}/{name}", k + 1), group, k..k + 1);
            }
        }
        for (group, name) in SECTOR_GROUPS.iter().enumerate().skip(CYLINDER) {
            add((*name).to_owned(), group, 0..self.n_sectors);
        }
        TriMesh::with_groups(vertices, triangles, groups)
            .expect("coordinates of checked specifications are finite, indices come from `vertex`")
    }

    /// Returns vertex indices of a triangle in sector `k`.
    fn turned(&self, triangle: [Corner; 3], k: usize, is_mirrored: bool) -> [u32; 3] {
        let n = self.n_sectors as i64;
        let [a, b, c] = triangle.map(|corner| match corner {
            Corner::Turned { vertex, turn } => {
                let turn = i64::from(if is_mirrored { -turn } else { turn });
                let sector = (k as i64 + turn).rem_euclid(n) as usize;
                index(sector * self.vertices.len()) + vertex
            }
            Corner::OnAxis(vertex) => index(self.n_sectors * self.vertices.len()) + vertex,
        });
        if is_mirrored { [a, c, b] } else { [a, b, c] }
    }
}

/// Returns the triangles of a quad, split along the shorter diagonal, or that of the first corner
/// if both are equal up to rounding.
pub(crate) fn split_quad([a, b, c, d]: [Point3<f64>; 4]) -> [[usize; 3]; 2] {
    SPLITS[usize::from((c - a).norm() > (d - b).norm() * (1.0 + 1e-12))]
}

/// Triangles of a quad by its first diagonal, and by its second.
const SPLITS: [[[usize; 3]; 2]; 2] = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];

fn index(at: usize) -> u32 {
    u32::try_from(at).expect("sizes are limited to far fewer than 2^32 vertices")
}
