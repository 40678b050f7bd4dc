/// One of the two positions of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// The one before the step.
    First,
    /// The one after the step.
    Second,
}

impl std::fmt::Display for Position {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::First => "first",
            Self::Second => "second",
        })
    }
}

/// Reason why a section has no chip area.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChipAreaError {
    /// A value is NaN or infinite.
    #[error("{field} is not finite")]
    NotFinite {
        /// Field of [`ChipSection`](crate::section::ChipSection).
        field: &'static str,
    },
    /// A radius is not positive.
    #[error("{field} is {value} mm, but must be positive")]
    NotPositive {
        /// `cutter.radius` or `surface.radius`.
        field: &'static str,
        /// Its value, mm.
        value: f64,
    },
    /// A length is negative.
    #[error("{field} is {value} mm, but must not be negative")]
    Negative {
        /// Field of [`ChipSection`](crate::section::ChipSection).
        field: &'static str,
        /// Its value, mm.
        value: f64,
    },
    /// A ball does not fit into a concave surface.
    #[error("a ball of radius {cutter_radius} mm does not fit into a concave surface of radius {surface_radius} mm")]
    BallTooLarge {
        /// Radius of the ball, mm.
        cutter_radius: f64,
        /// Radius of the surface, mm.
        surface_radius: f64,
    },
    /// The stock reaches the centre of a concave surface.
    #[error(
        "a depth of cut of {depth_of_cut} mm reaches the centre of a concave surface of radius {surface_radius} mm"
    )]
    DepthReachesCentre {
        /// Depth of cut, mm.
        depth_of_cut: f64,
        /// Radius of the surface, mm.
        surface_radius: f64,
    },
    /// The step leads half around the surface or farther.
    #[error("a step-over of {step_over} mm goes half around a surface of radius {surface_radius} mm or farther")]
    StepTooLong {
        /// Step-over, mm.
        step_over: f64,
        /// Radius of the surface, mm.
        surface_radius: f64,
    },
    /// The cutter is below the surface: at the CC point, or with the other end of a flat bottom, or
    /// with a flute that runs into a concave surface before it has left the stock of the cut.
    #[error("the cutter is below the surface at the {position} position")]
    BelowSurface {
        /// The position.
        position: Position,
    },
    /// The tool lies along a plane: its flute cuts without end.
    #[error("the tool axis lies in the plane that is cut, so that the chip has no end")]
    AxisInPlane,
    /// One corner of the flat cutter touches at the first position and the other one at the second:
    /// the surface turns through the direction of the bottom between them.
    #[error("the flat cutter changes the corner it touches the surface with between the two positions")]
    CornerChanges,
}
