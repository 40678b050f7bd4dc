//! Motion laws of a machine: cuts, rapids and the tolerance of the control.

/// Motion of a control between two programmed positions of a cutting move.
///
/// Exhaustive, so that a new one is handled everywhere: motion must not be taken for another law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CuttingLaw {
    /// All machine axes move linearly together: the tip moves along a curve. Five-axis moves
    /// without RTCP.
    AxesLinear,
    /// RTCP: the tip moves on a straight line in the workpiece frame, the rotary axes linearly.
    TipAndRotariesLinear,
    /// RTCP: the tip moves on a straight line, the tool vector turns uniformly in the plane of its
    /// two ends.
    TipLinearVectorTurned,
}

/// Motion of a control between two programmed positions of a rapid. Under RTCP some controls keep
/// the tip on a line at rapid rate, too: their rapids then have a [`CuttingLaw`].
///
/// Exhaustive, so that a new one is handled everywhere: motion must not be taken for another law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RapidLaw {
    /// All machine axes start and end together.
    Linear,
    /// Each axis moves at its own speed and stops when it arrives: the path bends.
    PerAxis,
}

/// Largest deviation of the control from the programmed motion by smoothing and corner blending.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControlTolerance {
    /// Deviation of the tip, mm.
    pub path: f64,
    /// Deviation of the tool axis, rad.
    pub orientation: f64,
}

impl ControlTolerance {
    /// Returns the largest resulting deviation of a cutter of radius `radius`, mm: path + R ×
    /// orientation.
    pub fn charge(&self, radius: f64) -> f64 {
        self.path + radius * self.orientation
    }
}

/// Motion assumed by every guarantee between two positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLaw {
    /// Motion between the positions of cutting moves.
    pub cutting: CuttingLaw,
    /// Motion between the positions of rapids; under RTCP only with a control that does not keep
    /// the tip on a line there.
    pub rapid: RapidLaw,
    /// Deviation from either.
    pub control_tolerance: ControlTolerance,
}
