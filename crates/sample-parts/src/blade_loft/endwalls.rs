//! Hub and shroud: the surfaces of revolution between which a blade is.

use nalgebra::{Point2, Point3, Unit, Vector2, Vector3};

use crate::spec_error::LoftError;

/// Hub and shroud of a blade, as polylines that turn about an axis through the origin.
#[derive(Clone, Debug)]
pub struct Endwalls {
    /// Axis of rotation.
    pub axis: Unit<Vector3<f64>>,
    /// Hub from inlet to outlet, mm; empty where the blade ends at its first section.
    pub hub: Vec<Point3<f64>>,
    /// Shroud from inlet to outlet, mm; empty where the blade ends at its last section.
    pub shroud: Vec<Point3<f64>>,
    /// Sector of the hub that the mesh has around the blade.
    pub hub_sector: Option<HubSector>,
}

/// Sector of a hub: from inlet to outlet, and to both sides half of the way to the next blade.
#[derive(Clone, Debug, PartialEq)]
pub struct HubSector {
    /// Number of blades around the axis, or of their sets.
    pub n_blades: u32,
    /// Thickness of the sector, mm.
    pub thickness: f64,
    /// The blades of the set; `None` of a blade alone.
    pub set: Option<HubSet>,
}

/// The blades of a set, and which of them a sector is of.
#[derive(Clone, Debug, PartialEq)]
pub struct HubSet {
    /// Lines of all blades ([`BladeLoft::line_on_hub`](crate::BladeLoft::line_on_hub)), in the same
    /// order for the sector of each.
    pub lines: Vec<HubLine>,
    /// Number of the sector's own blade.
    pub own: usize,
}

/// The line on the hub midway between the sides of a blade, between its edges.
#[derive(Clone, Debug, PartialEq)]
pub struct HubLine {
    /// Points in the order of their length along the hub.
    pub(crate) points: Vec<Point3<f64>>,
}

/// How a blade ends at its root or tip.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LoftEnd {
    /// First or last section: there is no wall.
    Section,
    /// Wall: the surface is cut there.
    Wall,
    /// Section that is on the wall within the chord tolerance.
    SectionOnWall,
    /// Section that ends before the wall.
    SectionBeforeWall {
        /// Largest distance of its points from the wall, mm.
        gap_mm: f64,
    },
}

/// Most points of a polyline: the foot of every point of the blade is sought on all of it.
const MOST_POINTS: usize = 5000;

/// Smallest side of a meridional polyline, mm.
const LEAST_SIDE: f64 = 1e-9;

/// A wall: a polyline in the meridional plane, turned about the axis. Its first and last side go on
/// beyond its ends.
#[derive(Clone, Debug)]
pub(crate) struct RevolvedWall {
    /// The axis, the direction of angle 0, and the one of a right angle.
    frame: [Vector3<f64>; 3],
    /// Place along the axis and radius of each point.
    points: Vec<Point2<f64>>,
    /// Length along the polyline up to each point.
    pub(crate) lengths: Vec<f64>,
    /// 1 where the blade is on the left of the polyline, else −1.
    sense: f64,
}

impl RevolvedWall {
    /// The wall, of which most points of the blade at half of its span are on the good side; angles
    /// count from the first of them. Their mean may be on the other side: of an impeller it is
    /// inside the bend.
    pub(crate) fn new(
        name: &'static str,
        axis: &Unit<Vector3<f64>>,
        points: &[Point3<f64>],
        blade: &[Point3<f64>],
    ) -> Result<Self, LoftError> {
        let along = axis.into_inner();
        let out = blade.first().and_then(|p| Unit::try_new(p.coords - along * along.dot(&p.coords), 0.0));
        let wrong = |what| LoftError::WrongWall { wall: name, what };
        let out = out.ok_or(wrong("has the middle of the blade on its axis"))?.into_inner();
        if points.len() > MOST_POINTS {
            return Err(wrong("has more than 5000 points; leave out some of them"));
        }
        let frame = [along, out, along.cross(&out)];
        let mut flat: Vec<Point2<f64>> = Vec::new();
        for point in points {
            if !point.coords.iter().all(|c| c.is_finite()) {
                return Err(wrong("has a coordinate that is not finite"));
            }
            let point = meridional(&frame, point);
            if flat.last().is_none_or(|last| (point - last).norm() > LEAST_SIDE) {
                flat.push(point);
            }
        }
        if flat.len() < 2 {
            return Err(wrong("has fewer than two points along the axis or in radius"));
        }
        let mut lengths = vec![0.0];
        lengths.extend(flat.windows(2).scan(0.0, |sum, pair| {
            *sum += (pair[1] - pair[0]).norm();
            Some(*sum)
        }));
        let mut wall = Self { frame, points: flat, lengths, sense: 1.0 };
        let above = blade.iter().filter(|p| wall.height(p) > 0.0).count();
        wall.sense = if 2 * above >= blade.len() { 1.0 } else { -1.0 };
        Ok(wall)
    }

    /// Smallest radius of the polyline's points, mm.
    pub(crate) fn smallest_radius(&self) -> f64 {
        self.points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min)
    }

    /// Distance from the wall, positive on the side of the blade.
    pub(crate) fn height(&self, point: &Point3<f64>) -> f64 {
        self.foot(&meridional(&self.frame, point)).1
    }

    /// Length along the polyline, and angle about the axis, of the foot of a point on the wall.
    pub(crate) fn place(&self, point: &Point3<f64>) -> [f64; 2] {
        let angle = self.frame[2].dot(&point.coords).atan2(self.frame[1].dot(&point.coords));
        [self.foot(&meridional(&self.frame, point)).0, angle]
    }

    /// Point of the wall, lifted off it.
    pub(crate) fn point(&self, [length, angle]: [f64; 2], lift: f64) -> Point3<f64> {
        let (side, share) = self.side_at(length);
        let (a, b) = (self.points[side], self.points[side + 1]);
        let at = a + (b - a) * share + self.lift_direction(side, share) * lift;
        let (sin, cos) = angle.sin_cos();
        Point3::from(self.frame[0] * at.x + (self.frame[1] * cos + self.frame[2] * sin) * at.y)
    }

    /// Normal toward the blade at the foot of a point.
    pub(crate) fn normal(&self, point: &Point3<f64>) -> Unit<Vector3<f64>> {
        let [length, angle] = self.place(point);
        let normal = self.side_normal(self.side_at(length).0);
        let (sin, cos) = angle.sin_cos();
        Unit::new_normalize(self.frame[0] * normal.x + (self.frame[1] * cos + self.frame[2] * sin) * normal.y)
    }

    /// Side of the polyline at a length, and the share of it.
    fn side_at(&self, length: f64) -> (usize, f64) {
        let side = self.lengths.partition_point(|l| *l <= length).clamp(1, self.points.len() - 1) - 1;
        (side, (length - self.lengths[side]) / (self.lengths[side + 1] - self.lengths[side]))
    }

    fn side_normal(&self, side: usize) -> Vector2<f64> {
        let along = (self.points[side + 1] - self.points[side]).normalize();
        Vector2::new(-along.y, along.x) * self.sense
    }

    /// Normals of the sides, blended so that a lifted polyline has no gaps at its corners.
    fn lift_direction(&self, side: usize, share: f64) -> Vector2<f64> {
        let at_corner = |corner: usize| {
            let before = self.side_normal(corner.saturating_sub(1));
            let behind = self.side_normal(corner.min(self.points.len() - 2));
            (before + behind).normalize()
        };
        (at_corner(side) * (1.0 - share.clamp(0.0, 1.0)) + at_corner(side + 1) * share.clamp(0.0, 1.0)).normalize()
    }

    /// Length along the polyline of the nearest point, and the distance from it with its sign.
    fn foot(&self, point: &Point2<f64>) -> (f64, f64) {
        let last = self.points.len() - 2;
        let mut best = (f64::INFINITY, 0, 0.0);
        for (side, pair) in self.points.windows(2).enumerate() {
            let along = pair[1] - pair[0];
            let share = (point - pair[0]).dot(&along) / along.norm_squared();
            let low = if side == 0 { f64::NEG_INFINITY } else { 0.0 };
            let share = share.clamp(low, if side == last { f64::INFINITY } else { 1.0 });
            let distance_sq = (point - (pair[0] + along * share)).norm_squared();
            if distance_sq < best.0 {
                best = (distance_sq, side, share);
            }
        }
        let (distance_sq, side, share) = best;
        let along = self.points[side + 1] - self.points[side];
        // At a corner the sum of both normals tells the sides apart.
        let mut normal = self.side_normal(side);
        if share <= 0.0 && side > 0 {
            normal += self.side_normal(side - 1);
        } else if share >= 1.0 && side < last {
            normal += self.side_normal(side + 1);
        }
        let off = point - (self.points[side] + along * share);
        (self.lengths[side] + share * along.norm(), distance_sq.sqrt().copysign(off.dot(&normal)))
    }
}

fn meridional(frame: &[Vector3<f64>; 3], point: &Point3<f64>) -> Point2<f64> {
    let across = [1, 2].map(|k: usize| frame[k].dot(&point.coords));
    Point2::new(frame[0].dot(&point.coords), across[0].hypot(across[1]))
}
