//! Setups that cut one stock, one after the other.

use facemill_cc_path::files::LeftOfFile;
use nalgebra::{Isometry3, Point3};

use crate::format::job_file::{BoxStockFile, CylinderStockFile, OperationFile, SetupFile, StockFile};
use crate::frames::{direction, pose};

/// Checks that a setup begins with the stock that another one leaves: with one stock for both, in
/// one workpiece frame or, if it is a solid, in any two. A box or a cylinder is the same in another
/// frame if it is where the part takes it.
///
/// # Errors
/// With the reason why it does not.
pub fn follows(before: &SetupFile, setup: &SetupFile) -> Result<(), String> {
    if !is_same_stock(before, setup) {
        let name = &before.name;
        return Err(match &setup.stock {
            StockFile::Box(_) | StockFile::Cylinder(_) => {
                format!(
                    "it is not where the part takes that of setup \"{name}\"; state it there or, where sides are not parallel \
                     to the axes, as a mesh"
                )
            }
            StockFile::Offset(_) | StockFile::Mesh(_) => format!("it is not stated as for setup \"{name}\""),
        });
    }
    if before.programs_before != setup.programs_before {
        return Err(format!("its programs_before are not those of setup \"{}\"", before.name));
    }
    if work_from_work(before, setup).is_some() && matches!(setup.stock, StockFile::Offset(_)) {
        return Err(format!(
            "its workpiece frame is not that of setup \"{}\"; stock that is a layer is not handed on to another frame, so \
             give a box, a cylinder or a mesh",
            before.name
        ));
    }
    Ok(())
}

/// Largest distance between corners, or between ends of an axis, of the same solid, mm: coordinates
/// of a box behind a turn are written to fewer digits.
const SAME_SOLID: f64 = 1e-3;

/// Returns whether two setups state the same stock on the part.
fn is_same_stock(before: &SetupFile, setup: &SetupFile) -> bool {
    let moved = |p: [f64; 3]| match work_from_work(before, setup) {
        Some(motion) => motion * Point3::from(p),
        None => Point3::from(p),
    };
    let are_near = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm() <= SAME_SOLID;
    match (&before.stock, &setup.stock) {
        (StockFile::Box(a), StockFile::Box(b)) => {
            let corners = |of: &BoxStockFile| {
                let [low, high] = [of.min_mm, of.max_mm];
                (0..8).map(|k| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { low[axis] } else { high[axis] })).collect()
            };
            let (of_a, of_b): (Vec<[f64; 3]>, Vec<[f64; 3]>) = (corners(a), corners(b));
            of_a.iter().all(|p| of_b.iter().any(|q| are_near(&moved(*p), &Point3::from(*q))))
        }
        (StockFile::Cylinder(a), StockFile::Cylinder(b)) => {
            let ends = |of: &CylinderStockFile| {
                let base = Point3::from(of.base_mm);
                [base, base + direction(&of.axis).into_inner() * of.height_mm]
            };
            let of_a = ends(a).map(|p| moved(p.into()));
            let of_b = ends(b);
            let is_so = |[p, q]: [usize; 2]| are_near(&of_a[0], &of_b[p]) && are_near(&of_a[1], &of_b[q]);
            (a.radius_mm - b.radius_mm).abs() <= SAME_SOLID && (is_so([0, 1]) || is_so([1, 0]))
        }
        (a, b) => serde_json::to_value(a).ok() == serde_json::to_value(b).ok(),
    }
}

/// Returns the pose of a setup's workpiece frame in that of another setup of the same part; `None`
/// if both are one frame.
pub fn work_from_work(of: &SetupFile, in_setup: &SetupFile) -> Option<Isometry3<f64>> {
    let motion = pose(&in_setup.work_from_part) * pose(&of.work_from_part).inverse();
    let is_one = motion.translation.vector.norm() <= SAME_FRAME[0] && motion.rotation.angle() <= SAME_FRAME[1];
    (!is_one).then_some(motion)
}

/// Returns the setups before one that cut the same stock ([`follows`]), in their order,
/// and the reason why there are no more.
pub fn programs_before(setups: &[SetupFile], index: usize) -> (Vec<usize>, String) {
    let mut before = Vec::new();
    for k in (0..index).rev() {
        if let Err(why) = follows(&setups[k], &setups[k + 1]) {
            before.reverse();
            return (before, why);
        }
        before.push(k);
    }
    before.reverse();
    (before, "its program is the first one".to_owned())
}

/// Returns whether an operation is laid where the programs before it leave material.
pub fn is_after_others(operation: &OperationFile) -> bool {
    operation.region().left_above.as_ref().is_some_and(|left| left.of == LeftOfFile::OperationsBefore)
}

/// Tolerance for one frame that is written in two ways: mm, and rad.
pub const SAME_FRAME: [f64; 2] = [1e-6, 1e-9];
