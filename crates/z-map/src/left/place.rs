//! Cutters in motion, and the places of a surface that they pass.

use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};

/// Part of a cutting motion: the tip goes straight and the axis turns evenly, both from `from` to
/// `to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutterMotion {
    /// Tool at its start, workpiece frame.
    pub from: ClPoint,
    /// Tool at its end.
    pub to: ClPoint,
    /// Name of the motion for the caller, such as the line of its block.
    pub id: u32,
}

/// Place of the surface that a cut is to leave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePlace {
    /// The place, workpiece frame.
    pub position: Point3<f64>,
    /// Direction out of the material.
    pub normal: Unit<Vector3<f64>>,
    /// Height of the material along the normal before anything is cut, mm, finite and at least 0.
    pub stock: f64,
}

/// Material that is left on a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftHeight {
    /// Its height along the normal of the place, mm, at least 0; the stock's where nothing is cut.
    pub height: f64,
    /// `id` of the motion that cuts the place lowest; `None` where no motion cuts below the stock.
    pub cut_by: Option<u32>,
}
