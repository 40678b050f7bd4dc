use nalgebra::{Point3, Unit, Vector3};

use crate::sections::{CylindricalSections, Sections};
use crate::strategy::patch::Patch;

/// Coordinate along the passes, mm: it grows in the direction in which the passes of a patch run
/// forward on the whole.
///
/// Planes: the distance along the mean direction of the passes. Cylinders: the same on the cylinder
/// of mean radius, unrolled.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Along {
    Line { direction: Unit<Vector3<f64>> },
    Unrolled { sections: CylindricalSections, zero: Unit<Vector3<f64>>, around: f64, axial: f64 },
}

/// Least length of the mean direction of passes, of 1 where all run alike. Passes that turn more
/// than this allows, closed ones above all, have no coordinate along them.
const LEAST_MEAN: f64 = 0.7;

/// Largest angle of a place from the middle of the region about the axis, rad. Farther round, the
/// unrolled cylinder would have to be cut open inside the region.
const MOST_AROUND: f64 = 2.8;

/// Mean direction of the passes of a patch, by area.
struct MeanDirection {
    sum: Vector3<f64>,
    area: f64,
}

impl MeanDirection {
    /// Sums up `components` of the forward direction at each facet.
    fn of(patch: &Patch, levels: &Sections, components: impl Fn(&Point3<f64>, &Vector3<f64>) -> Vector3<f64>) -> Self {
        let mut this = Self { sum: Vector3::zeros(), area: 0.0 };
        for (t, corners) in patch.mesh.triangles().iter().enumerate() {
            let [a, b, c] = corners.map(|v| patch.mesh.vertices()[v as usize]);
            let scaled = 0.5 * (b - a).cross(&(c - a));
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let Some(gradient) = levels.gradient(&middle) else { continue };
            let Some(normal) = patch.facet_normal(t as u32) else { continue };
            // As long as the sine of the angle between facet and level, so a facet along the
            // level, whose direction means nothing, does not count.
            let forward = gradient.cross(&normal) * scaled.norm();
            this.sum += components(&middle, &forward);
            this.area += forward.norm();
        }
        this
    }

    /// The unit direction; `None` where the passes run too differently.
    fn direction(&self) -> Option<Unit<Vector3<f64>>> {
        (self.sum.norm() >= LEAST_MEAN * self.area).then(|| Unit::try_new(self.sum, 0.0)).flatten()
    }
}

impl Along {
    /// The coordinate of a patch; `None` where its passes run too differently, or all round the
    /// axis.
    pub(crate) fn of(patch: &Patch, levels: &Sections) -> Option<Self> {
        match levels {
            Sections::ParallelPlanes(_) => {
                let direction = MeanDirection::of(patch, levels, |_, forward| *forward).direction()?;
                Some(Self::Line { direction })
            }
            Sections::CylindricalSections(sections) => Self::unrolled(patch, levels, sections),
        }
    }

    fn unrolled(patch: &Patch, levels: &Sections, sections: &CylindricalSections) -> Option<Self> {
        let used = || patch.mesh.triangles().iter().flatten().map(|&v| patch.mesh.vertices()[v as usize]);
        let n_used = 3 * patch.mesh.triangles().len();
        let middle = used().map(|p| sections.radial(&p)).sum::<Vector3<f64>>();
        let zero = Unit::try_new(middle, 1e-9)?;
        let radius = used().map(|p| sections.radial(&p).norm()).sum::<f64>() / n_used as f64;
        let unrolled = |around: f64, axial: f64| Self::Unrolled { sections: *sections, zero, around, axial };
        if used().any(|p| unrolled(1.0, 0.0).value(&p).abs() > MOST_AROUND) {
            return None;
        }
        let components = |p: &Point3<f64>, forward: &Vector3<f64>| {
            let axis = sections.axis_direction;
            let Some(out) = Unit::try_new(sections.radial(p), 0.0) else { return Vector3::zeros() };
            Vector3::new(axis.cross(&out).dot(forward), axis.dot(forward), 0.0)
        };
        let direction = MeanDirection::of(patch, levels, components).direction()?;
        Some(unrolled(direction.x * radius, direction.y))
    }

    /// The coordinate of a place, mm.
    pub(crate) fn value(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Line { direction } => direction.dot(&p.coords),
            Self::Unrolled { sections, zero, around, axial } => {
                let (out, axis) = (sections.radial(p), sections.axis_direction);
                let angle = axis.cross(zero).dot(&out).atan2(zero.dot(&out));
                around * angle + axial * axis.dot(&(p - sections.axis_origin))
            }
        }
    }

    /// Gradient of the coordinate in space.
    pub(crate) fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        match self {
            Self::Line { direction } => direction.into_inner(),
            Self::Unrolled { sections, around, axial, .. } => {
                let (out, axis) = (sections.radial(p), sections.axis_direction);
                let radius_sq = out.norm_squared().max(f64::MIN_POSITIVE);
                axis.cross(&out) * (around / radius_sq) + axis.into_inner() * *axial
            }
        }
    }
}
