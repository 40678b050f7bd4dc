use facemill_cl_data::{Cancelled, CcPoint, Monitor, Posture};
use rayon::prelude::*;

use crate::{Hints, Infeasible, PoseTest};

/// The feasible set over tilt × rotate at one CC point (CLOPT fig. 3), tested at the nodes of a grid: an estimate between
/// them.
#[derive(Clone, Debug)]
pub struct SolutionSpace {
    /// Tilts of the columns, rad, ascending.
    pub tilts: Vec<f64>,
    /// Rotates of the rows, rad, in the given order.
    pub rotates: Vec<f64>,
    /// Row by row: `None` where the posture is feasible, else the reason.
    pub blocked_by: Vec<Option<Infeasible>>,
}

/// Tests every node of the grid `tilts` × `rotates`.
///
/// # Errors
/// When the monitor cancels.
pub fn solution_space(
    test: &PoseTest<'_>,
    cc: &CcPoint,
    tilts: Vec<f64>,
    rotates: Vec<f64>,
    monitor: &dyn Monitor,
) -> Result<SolutionSpace, Cancelled> {
    let rows: Vec<Vec<Option<Infeasible>>> = rotates
        .par_iter()
        .map(|&rotate| {
            monitor.checkpoint()?;
            let mut hints = Hints::default();
            Ok(tilts
                .iter()
                .map(|&tilt| test.try_posture(cc, Posture { tilt, rotate }, None, &mut hints).err())
                .collect())
        })
        .collect::<Result<_, Cancelled>>()?;
    Ok(SolutionSpace { tilts, rotates, blocked_by: rows.into_iter().flatten().collect() })
}
