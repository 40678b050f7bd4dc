//! Check that the size of a part is plausible, and the units that would make it so.

use facemill_cl_data::Aabb;
use facemill_cutter_location::links::link::ClearanceSurface;
use facemill_inverse_kinematics::AxisKind;
use facemill_surface_model::LengthUnit;
use nalgebra::{Isometry3, Point3};

use crate::load::job::{Job, Setup};
use crate::load::obstacle_meshes::{ObstacleMesh, ObstacleRole};

/// Shortest plausible part, as a fraction of the cutter's diameter.
const SHORTEST: f64 = 0.5;

/// Longest plausible part, as a multiple of the longest travel: half of a part that turns on a
/// table is cut at a time.
const LONGEST: f64 = 2.0;

/// Units in the order in which they are proposed.
const UNITS: [LengthUnit; 4] = [LengthUnit::Millimetre, LengthUnit::Inch, LengthUnit::Metre, LengthUnit::Centimetre];

/// Plausible lengths of a part for its tool and machine, mm.
struct Suitable {
    diameter: f64,
    travel: f64,
}

impl Suitable {
    fn of(job: &Job) -> Self {
        let linear = job.machine.axes().iter().filter(|a| a.kind == AxisKind::Linear);
        Self {
            diameter: job.all_tools().map(|t| 2.0 * t.cutter().radius()).fold(f64::INFINITY, f64::min),
            travel: linear.map(|a| a.max - a.min).fold(0.0, f64::max),
        }
    }

    /// Returns whether a part of this length is plausible.
    fn may_be(&self, length: f64) -> bool {
        length >= SHORTEST * self.diameter && length <= LONGEST * self.travel
    }

    /// Returns whether a length is likely enough to be proposed.
    fn is_likely(&self, length: f64) -> bool {
        length >= self.diameter && length <= self.travel
    }
}

/// Returns the box of the part's own meshes (drive, part and check surfaces) in the frame of their
/// files, mm.
pub fn part_box(obstacles: &[ObstacleMesh], work_from_part: &Isometry3<f64>) -> Aabb {
    let part_from_work = work_from_part.inverse();
    let corners = parts(obstacles).flat_map(|o| {
        o.mesh.triangles().iter().flatten().map(move |&v| part_from_work * o.mesh.vertices()[v as usize])
    });
    corners.fold(Aabb::EMPTY, |b, p| b.with_point(&p))
}

fn parts(obstacles: &[ObstacleMesh]) -> impl Iterator<Item = &ObstacleMesh> {
    obstacles.iter().filter(|o| matches!(o.role, ObstacleRole::Part | ObstacleRole::Check))
}

fn length(b: &Aabb) -> f64 {
    2.0 * b.half_extents().max()
}

/// Names the units in which a part would have a likely size, if its size as read does not suit tool
/// and machine.
pub fn unit_advice(job: &Job, setup: &Setup<'_>) -> Option<String> {
    let suitable = Suitable::of(job);
    let length = length(&part_box(&setup.obstacles, &crate::frames::pose(&setup.file.work_from_part)));
    if suitable.may_be(length) {
        return None;
    }
    let unit = setup.reports.first()?.unit;
    let likely = UNITS.into_iter().filter(|u| suitable.is_likely(length * u.in_mm() / unit.in_mm()));
    advice(&suitable, length, unit, likely)
}

/// Names the units in which a part that reaches beyond the clearance surface would lie inside it
/// and have a likely size.
pub(crate) fn unit_inside(
    job: &Job,
    unit: LengthUnit,
    obstacles: &[ObstacleMesh],
    work_from_part: &Isometry3<f64>,
    clearance: &ClearanceSurface,
) -> Option<String> {
    let suitable = Suitable::of(job);
    let length = length(&part_box(obstacles, work_from_part));
    let part_from_work = work_from_part.inverse();
    let lies_inside = |scale: f64| {
        let moved = |p: Point3<f64>| work_from_part * Point3::from((part_from_work * p).coords * scale);
        parts(obstacles).all(|o| o.mesh.vertices().iter().all(|p| clearance.height(&moved(*p)) <= 0.0))
    };
    let likely = UNITS.into_iter().filter(|u| {
        let scale = u.in_mm() / unit.in_mm();
        *u != unit && suitable.is_likely(length * scale) && lies_inside(scale)
    });
    advice(&suitable, length, unit, likely)
}

fn advice(
    suitable: &Suitable,
    length: f64,
    unit: LengthUnit,
    likely: impl Iterator<Item = LengthUnit>,
) -> Option<String> {
    let in_unit = |u: LengthUnit| format!("{:.1} mm in {}", length * u.in_mm() / unit.in_mm(), units(u));
    let likely: Vec<String> = likely.map(in_unit).collect();
    if likely.is_empty() {
        return None;
    }
    Some(format!(
        "the longest side of the part is {length:.3} mm, read in {}; the cutter's diameter is {:.1} mm, the longest travel \
         {:.0} mm. It would be {}: is the unit right (setups[].meshes[].unit)?",
        units(unit),
        suitable.diameter,
        suitable.travel,
        likely.join(", ")
    ))
}

/// Returns the name of a unit.
pub fn units(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Metre => "metres",
        LengthUnit::Centimetre => "centimetres",
        LengthUnit::Millimetre => "millimetres",
        LengthUnit::Inch => "inches",
    }
}
