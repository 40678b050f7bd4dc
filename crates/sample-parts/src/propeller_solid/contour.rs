//! Blade surface over contour angle and radius.

use std::f64::consts::TAU;

use nalgebra::{Point3, Unit, Vector3};

use crate::propeller::blade_section::BladeSection;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller_solid::root_fillet::place_of;

/// Step of the differences along the contour, rad.
///
/// Larger misses the curvature of a thin trailing edge, whose ellipse takes up a few hundredths of
/// a radian; smaller loses digits there, where a chord fraction is near 1.
const ANGLE_STEP: f64 = 2e-5;

/// Step of the differences along the radius over the hub radius.
const RADIUS_STEP: f64 = 1e-4;

/// Blade as a smooth surface over contour angle and radius, right-handed whatever the propeller.
///
/// The contour angle β goes around a section: from 0 at the leading edge over the suction side to
/// the trailing edge at π and back along the pressure side, at chord fraction sin²(β/2). In it
/// round noses are smooth, as half the thickness goes with the root of the chord fraction there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contour<'s> {
    surface: &'s BladeSurface,
}

impl<'s> Contour<'s> {
    pub(crate) fn new(surface: &'s BladeSurface) -> Self {
        Self { surface }
    }

    pub(crate) fn surface(&self) -> &'s BladeSurface {
        self.surface
    }

    /// Returns the section at a radius, mm.
    pub(crate) fn section(&self, radius: f64) -> BladeSection<'s> {
        BladeSection { is_left_handed: false, ..self.surface.section(radius) }
    }

    /// Returns point and outward normal at a contour angle and a radius in mm; no normal at a sharp
    /// edge.
    ///
    /// Normals are from central differences, exact to about 1e-8 rad where the surface has
    /// continuous curvature.
    pub(crate) fn point_and_normal(&self, angle: f64, radius: f64) -> (Point3<f64>, Option<Unit<Vector3<f64>>>) {
        let step = RADIUS_STEP * self.surface.spec().hub_radius();
        let [low, here, high] = [radius - step, radius, radius + step].map(|radius| self.section(radius));
        let along = section_point(&here, angle + ANGLE_STEP) - section_point(&here, angle - ANGLE_STEP);
        let up = section_point(&high, angle) - section_point(&low, angle);
        let least = 1e-6 * ANGLE_STEP * here.thickness;
        let normal = (along.norm() > least).then(|| Unit::try_new(along.cross(&up), 0.0)).flatten();
        (section_point(&here, angle), normal)
    }
}

/// Returns the point of a section at a contour angle.
fn section_point(section: &BladeSection<'_>, angle: f64) -> Point3<f64> {
    let (side, chord_fraction) = place_of(angle.rem_euclid(TAU));
    section.point(side, chord_fraction)
}
