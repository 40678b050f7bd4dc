//! Error budget of an operation.

/// Error budget of an operation, mm: the contribution of each stage to the depth below the true
/// surface.
///
/// Their [sum](ErrorBudget::total) is the largest depth below the true surface that a clean program
/// may reach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorBudget {
    /// Mesh facets against the true surface.
    pub mesh_chord: f64,
    /// Straight path between two CC points against the surface.
    pub path_chord: f64,
    /// The control's motion between two blocks against the straight path with turning axis.
    pub linearisation: f64,
    /// Smoothing and blending of the control: path + R × orientation.
    pub control: f64,
    /// Tolerance t of the cutter's test body.
    pub gouge_tolerance: f64,
}

impl ErrorBudget {
    /// Returns the sum of all parts, mm.
    pub fn total(&self) -> f64 {
        self.mesh_chord + self.control + self.simulated()
    }

    /// Returns the part of the budget that shows when the programmed motion itself is compared with
    /// the mesh, mm: all but the mesh's own error and the control's, which are absent then.
    pub fn simulated(&self) -> f64 {
        self.path_chord + self.linearisation + self.gouge_tolerance
    }
}
