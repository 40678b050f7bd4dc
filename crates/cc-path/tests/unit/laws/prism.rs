//! Prisms over profiles of lines and arcs, for laws of passes along edges and roots.

use facemill_surface_model::Group;

use super::*;

/// Part of a profile: a line where the curvature is 0, else an arc.
#[derive(Clone, Copy, Debug)]
struct ProfilePart {
    /// Way along the profile to its beginning, mm.
    way: f64,
    length: f64,
    /// 1/mm, above 0 where it is convex.
    curvature: f64,
    start: [f64; 2],
    /// Direction at its beginning, from +x toward +z, rad.
    heading: f64,
}

/// Prism along y over a profile in the xz plane; the material is to the right of the profile.
pub(super) struct Prism {
    parts: Vec<ProfilePart>,
    pub(super) depth: f64,
}

impl Prism {
    /// The parts are length (mm) and turn (rad, above 0 to the right, which is convex).
    pub(super) fn new(heading: f64, parts: &[[f64; 2]], depth: f64) -> Self {
        let mut this = Self { parts: Vec::new(), depth };
        let (mut way, mut start, mut heading) = (0.0, [0.0; 2], heading);
        for &[length, turn] in parts {
            let part = ProfilePart { way, length, curvature: turn / length, start, heading };
            this.parts.push(part);
            (way, start, heading) = (way + length, part.at(length), heading - turn);
        }
        this
    }

    /// Two planes of the lengths with a convex edge of this radius, which turns by `turn`.
    pub(super) fn rounded(flank: f64, radius: f64, turn: f64, depth: f64) -> Self {
        Self::new(0.5 * turn, &[[flank, 0.0], [radius * turn, turn], [flank, 0.0]], depth)
    }

    /// Two planes that meet at an opening angle, with a fillet of this radius, or none.
    pub(super) fn corner(flank: f64, radius: f64, opening: f64, depth: f64) -> Self {
        let turn = std::f64::consts::PI - opening;
        let parts = [[flank, 0.0], [radius * turn, -turn], [flank, 0.0]];
        let heading = -0.5 * turn;
        if radius > 0.0 {
            return Self::new(heading, &parts, depth);
        }
        let mut this = Self::new(heading, &[[flank, 0.0]], depth);
        let start = this.parts[0].at(flank);
        this.parts.push(ProfilePart { way: flank, length: flank, curvature: 0.0, start, heading: heading + turn });
        this
    }

    /// The mesh with a group for each part, cut into so many strips each.
    pub(super) fn mesh(&self, n: &[u32], n_along: u32, names: &[&str]) -> TriMesh {
        let mut profile = vec![self.parts[0].start];
        let (mut triangles, mut groups) = (Vec::new(), Vec::new());
        for ((part, &n), name) in self.parts.iter().zip(n).zip(names) {
            let first = triangles.len();
            for k in 1..=n {
                let column = (profile.len() - 1) as u32;
                profile.push(part.at(part.length * f64::from(k) / f64::from(n)));
                let at = |i: u32, j: u32| (column + i) * (n_along + 1) + j;
                for j in 0..n_along {
                    let (a, b, c, d) = (at(0, j), at(1, j), at(1, j + 1), at(0, j + 1));
                    triangles.extend(if (k + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
                }
            }
            groups.push(Group { name: (*name).to_owned(), triangles: first..triangles.len() });
        }
        let y = |j: u32| self.depth * f64::from(j) / f64::from(n_along);
        let vertices = profile.iter().flat_map(|&[x, z]| (0..=n_along).map(move |j| Point3::new(x, y(j), z))).collect();
        TriMesh::with_groups(vertices, triangles, groups).unwrap()
    }

    /// Way along the profile to the place of it nearest to a point.
    pub(super) fn way(&self, p: &Point3<f64>) -> f64 {
        let foot = |part: &ProfilePart| part.nearest([p.x, p.z]);
        let feet = self.parts.iter().map(|part| (foot(part), part));
        let nearest = feet.min_by(|a, b| a.0.1.total_cmp(&b.0.1)).unwrap();
        nearest.1.way + nearest.0.0
    }

    /// Way to the middle of a part.
    pub(super) fn middle(&self, part: usize) -> f64 {
        self.parts[part].way + 0.5 * self.parts[part].length
    }

    /// Way to the beginning of a part.
    pub(super) fn start(&self, part: usize) -> f64 {
        self.parts[part].way
    }

    /// A place of the surface, at shares of its lengths.
    pub(super) fn place(&self, way: f64, y: f64) -> Point3<f64> {
        let part = self.parts.iter().rev().find(|p| p.way <= way).unwrap();
        let [x, z] = part.at(way - part.way);
        Point3::new(x, y, z)
    }
}

impl ProfilePart {
    fn at(&self, way: f64) -> [f64; 2] {
        let (s, c) = self.heading.sin_cos();
        let [along, right] = if self.curvature == 0.0 {
            [way, 0.0]
        } else {
            let angle = way * self.curvature;
            [angle.sin() / self.curvature, (1.0 - angle.cos()) / self.curvature]
        };
        [self.start[0] + along * c + right * s, self.start[1] + along * s - right * c]
    }

    /// Way to the place nearest to a point, and the distance of both.
    fn nearest(&self, p: [f64; 2]) -> (f64, f64) {
        let (s, c) = self.heading.sin_cos();
        let [x, z] = [p[0] - self.start[0], p[1] - self.start[1]];
        let (along, right) = (x * c + z * s, x * s - z * c);
        let way = if self.curvature == 0.0 {
            along
        } else {
            let k = self.curvature;
            (along * k.abs()).atan2((1.0 / k - right) * k.signum() * k.abs()) / k.abs()
        };
        let way = way.clamp(0.0, self.length);
        let [a, b] = self.at(way);
        (way, (a - p[0]).hypot(b - p[1]))
    }
}
