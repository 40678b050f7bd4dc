/// Pose of the cutter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pose {
    /// The pass whose chip is computed.
    This,
    /// The pass on its left.
    Left,
    /// The pass on its right.
    Right,
}

impl std::fmt::Display for Pose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::This => "this pass",
            Self::Left => "the pass on the left",
            Self::Right => "the pass on the right",
        })
    }
}

/// Reason why the chip of a pass has no area.
///
/// A `field` is the path of a field of [`PassSection`](crate::pass::PassSection), such as
/// `cutter.radius` or `engagement.left.step_over`. Messages give angles in degrees.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PassError {
    /// A value is NaN or infinite.
    #[error("{field} is {}: give a finite number", shown(*value))]
    NotFinite {
        /// Path of the field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A radius is not positive.
    #[error("{field} is {} mm: give a length above 0", shown(*value))]
    NotPositive {
        /// Path of the field.
        field: &'static str,
        /// Its value, mm.
        value: f64,
    },
    /// A length is negative.
    #[error("{field} is {} mm: give a length of 0 or above; the side says which way it goes", shown(*value))]
    Negative {
        /// Path of the field.
        field: &'static str,
        /// Its value, mm.
        value: f64,
    },
    /// A length that no cutter has: above 10 km, or a radius below a nanometre (or above 10¹⁵ mm,
    /// for a surface).
    #[error("{field} is {} mm, which is out of range: give it in mm (a flat surface is a plane)", shown(*value))]
    OutOfRange {
        /// Path of the field.
        field: &'static str,
        /// Its value, mm.
        value: f64,
    },
    /// The axis would not be above the surface.
    #[error("{field} is {}°: give an angle between −90° and 90° (neither included)", value.to_degrees())]
    AxisNotAbove {
        /// `orientation.lead` or `orientation.lean`.
        field: &'static str,
        /// Its value, rad.
        value: f64,
    },
    /// The corner is larger than the cutter.
    #[error(
        "cutter.corner_radius is {corner_radius} mm, but the cutter's radius is {radius} mm: give a corner radius from \
         0 (flat) to {radius} (ball)"
    )]
    CornerTooLarge {
        /// Corner radius, mm.
        corner_radius: f64,
        /// Radius of the cutter, mm.
        radius: f64,
    },
    /// The corner does not reach into a concave surface.
    #[error(
        "a corner of radius {corner_radius} mm does not reach into a concave surface of radius {surface_radius} mm: \
         take a cutter with a smaller corner"
    )]
    CornerDoesNotFit {
        /// Corner radius of the cutter, mm.
        corner_radius: f64,
        /// Radius of the surface, mm.
        surface_radius: f64,
    },
    /// The stock reaches the centre of a concave surface.
    #[error(
        "engagement.depth_of_cut is {depth_of_cut} mm and reaches the centre of the concave surface of radius \
         {surface_radius} mm: give a depth below that radius"
    )]
    DepthReachesCentre {
        /// Depth of cut, mm.
        depth_of_cut: f64,
        /// Radius of the surface, mm.
        surface_radius: f64,
    },
    /// A neighbour or a border is a quarter turn away or farther.
    #[error(
        "{field} is {value} mm and goes a quarter around the surface of radius {surface_radius} mm or farther: give \
         less, or stock without end on that side"
    )]
    TooFarAround {
        /// Path of the field.
        field: &'static str,
        /// Its value, mm along the surface.
        value: f64,
        /// Radius of the surface, mm.
        surface_radius: f64,
    },
    /// The neighbouring pass does not come near the cut of this one.
    #[error(
        "{field} is {step_over} mm, but the cutter is only {width} mm wide there: the passes do not meet; give a smaller \
         step-over, or stock without end on that side"
    )]
    StepBeyondCutter {
        /// Path of the field.
        field: &'static str,
        /// The step-over, mm along the surface.
        step_over: f64,
        /// Width of the cutter across its axis, mm.
        width: f64,
    },
    /// The cutter is below the surface: its bottom is too wide for a concave surface in this
    /// orientation, its flute runs into the surface before it has left the stock, or a neighbour's
    /// axis is not above the surface.
    #[error(
        "the cutter of {pose} is below the surface: give a smaller cutter, more lead or lean, or a shorter step on a \
         curved surface"
    )]
    BelowSurface {
        /// Pose of that cutter.
        pose: Pose,
    },
}

/// Returns a value as messages show it: with an exponent where it would be a row of zeros.
fn shown(value: f64) -> String {
    let is_plain = value == 0.0 || !value.is_finite() || (1e-6..1e9).contains(&value.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}
