use facemill_cl_data::CcPoint;
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

use crate::error::PathError;
use crate::layout::levels::Band;
use crate::sections::Sections;
use crate::strategy::patch::Patch;
use crate::strategy::settings::{Direction, LaySettings};
use crate::strategy::size::StepOverCause;

/// Allowed distance between passes at a CC point, mm, measured along the surface: a function of the
/// caller.
pub(crate) type StripWidth<'a> = &'a (dyn Fn(&CcPoint) -> f64 + Sync);

/// Sine of the least angle between surface and level set that step-overs are made for, 3°. Flatter
/// places would ask for passes without end: they are cut as if they stood at this angle, and count
/// as wide strips. Larger: real blade edges would be cut too coarsely. Smaller: a single flat facet
/// multiplies the passes.
pub(crate) const MIN_SLOPE: f64 = 0.052;

/// Facets with a lower height over longest side are slivers: rounding of the mesh file turns their
/// normals, so the smooth normal decides on their slope.
const SLIVER: f64 = 0.02;

/// Returns the strip that each triangle of a patch allows, and its cause.
///
/// On a plane facet the level rises evenly by slope × way. So a way up the steepest lines from one
/// pass to the next is no longer than the width, if the step of level is at most width × slope on
/// every facet it crosses.
///
/// # Errors
/// When a width is NaN.
pub(crate) fn bands(
    patch: &Patch,
    sections: &Sections,
    settings: &LaySettings,
    strip_width: StripWidth,
) -> Result<(Vec<Band>, StepOverCause), PathError> {
    let gradient = |v: usize| sections.gradient(&patch.mesh.vertices()[v]).map(Unit::into_inner);
    let widths = vertex_widths(patch, gradient, settings, strip_width)?;
    let band = |t: usize| {
        let v = patch.mesh.triangles()[t].map(|v| v as usize);
        let levels = v.map(|v| patch.levels[v]);
        let slopes = slopes(patch, sections, t as u32);
        let at_least = |k: usize| widths[v[k]].max(settings.min_step_over) * slopes[k].max(MIN_SLOPE);
        Band {
            low: least(levels),
            high: levels.into_iter().fold(f64::NEG_INFINITY, f64::max),
            limit: least([0, 1, 2].map(at_least)),
            requested: least([0, 1, 2].map(|k| widths[v[k]] * slopes[k])),
            slope: least(slopes).max(MIN_SLOPE),
        }
    };
    let bands = (0..patch.mesh.triangles().len()).into_par_iter().map(band).collect();
    let largest = settings.max_step_over;
    Ok((bands, StepOverCause { largest, is_largest: widths.iter().all(|&w| w >= largest) }))
}

pub(crate) fn least(values: [f64; 3]) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

/// Slopes of a facet at its corners.
fn slopes(patch: &Patch, sections: &Sections, triangle: u32) -> [f64; 3] {
    let facet = patch.facet_normal(triangle).filter(|_| patch.facet_shape(triangle) >= SLIVER);
    patch.mesh.corners(triangle as usize).map(|p| {
        let normal = facet.unwrap_or_else(|| patch.normal(triangle, &p));
        sections.slope(&p, &normal)
    })
}

/// The width allowed at each vertex of the patch, at most the largest step-over; the level rises
/// there along the `gradient`.
///
/// # Errors
/// When a width is NaN.
pub(crate) fn vertex_widths(
    patch: &Patch,
    gradient: impl Fn(usize) -> Option<Vector3<f64>> + Sync,
    settings: &LaySettings,
    strip_width: StripWidth,
) -> Result<Vec<f64>, PathError> {
    let n_vertices = patch.mesh.vertices().len();
    let mut triangle_at = vec![u32::MAX; n_vertices];
    for (t, v) in patch.mesh.triangles().iter().enumerate().rev() {
        for &v in v {
            triangle_at[v as usize] = t as u32;
        }
    }
    let width = |v: usize| {
        if triangle_at[v] == u32::MAX {
            return Ok(settings.max_step_over);
        }
        let p = patch.mesh.vertices()[v];
        let cc = cc_point(gradient(v), settings.first_direction(), p, patch.normal(triangle_at[v], &p));
        allowed_width(&cc, settings, strip_width)
    };
    (0..n_vertices).into_par_iter().map(width).collect::<Vec<_>>().into_iter().collect()
}

/// The width allowed at a CC point, at most the largest step-over, mm.
///
/// # Errors
/// When it is NaN.
pub(crate) fn allowed_width(cc: &CcPoint, settings: &LaySettings, strip_width: StripWidth) -> Result<f64, PathError> {
    let width = strip_width(cc);
    if width.is_nan() {
        return Err(PathError::StripWidth { position: cc.position });
    }
    Ok(width.min(settings.max_step_over))
}

/// The CC point of a level curve: the feed runs along the level, the higher levels to the left of
/// it when forward.
pub(crate) fn cc_point(
    gradient: Option<Vector3<f64>>,
    direction: Direction,
    p: Point3<f64>,
    normal: Unit<Vector3<f64>>,
) -> CcPoint {
    let across = gradient.and_then(|g| Unit::try_new(g.cross(&normal), 1e-9));
    // Where the surface lies along the level there is no curve: any tangent serves, the width there
    // hardly matters.
    let forward = across.unwrap_or_else(|| any_tangent(&normal));
    let feed = match direction {
        Direction::Forward => forward,
        Direction::Reverse => -forward,
    };
    CcPoint { position: p, normal, feed }
}

/// Some direction at right angles to the normal.
pub(crate) fn any_tangent(normal: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let mut farthest_axis = Vector3::zeros();
    farthest_axis[normal.iamin()] = 1.0;
    Unit::new_normalize(normal.cross(&farthest_axis))
}
