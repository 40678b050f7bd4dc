use facemill_cl_data::{Aabb, RoundFrustum, Solid};
use nalgebra::{Isometry3, Point3, Vector3};

/// How a box lies to the undilated body of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Gap {
    /// A plane between them proves at least this distance.
    AtLeast(f64),
    /// Two points of them are no farther apart than was asked for.
    Within,
    /// Neither was found.
    Unknown,
}

/// Looks for a proof that a box is farther than `distance` from the undilated body of a solid.
///
/// Projecting a point from one convex body onto the other and back closes in on the nearest points of the two. Each
/// pair proposes the direction between its points, and whatever direction that is, the extents of both bodies along it
/// are a proof, so that rounding and slow convergence cost only yield, never truth.
pub(crate) fn gap(
    body: &Aabb,
    solid: &Solid,
    frame_from_solid: &Isometry3<f64>,
    distance: f64,
    max_steps: usize,
) -> Gap {
    let (center, half) = (body.center(), body.half_extents());
    let mut on_box = center;
    for _ in 0..max_steps {
        let on_core = frame_from_solid * nearest_of_core(solid, &frame_from_solid.inverse_transform_point(&on_box));
        on_box = on_core.coords.sup(&body.min.coords).inf(&body.max.coords).into();
        let between = on_box - on_core;
        let length = between.norm();
        if length <= distance {
            return Gap::Within;
        }
        let away = between / length;
        let reach = core_support(solid, &frame_from_solid.inverse_transform_vector(&away));
        let proven = away.dot(&(center - frame_from_solid.translation.vector).coords) - away.abs().dot(&half) - reach;
        if proven > distance {
            return Gap::AtLeast(proven);
        }
    }
    Gap::Unknown
}

/// Nearest point of the undilated body, own frame.
fn nearest_of_core(solid: &Solid, p: &Point3<f64>) -> Point3<f64> {
    match solid {
        Solid::Frustum(f) => nearest_of_frustum(f, p),
        Solid::Box(b) => p.coords.sup(&-b.half_extents).inf(&b.half_extents).into(),
        Solid::Hull(h) => h.core.nearest(p).point,
    }
}

fn nearest_of_frustum(f: &RoundFrustum, p: &Point3<f64>) -> Point3<f64> {
    let radial = p.x.hypot(p.y);
    let (r, z) = nearest_of_profile(f, radial, p.z);
    if radial > 0.0 { Point3::new(p.x * (r / radial), p.y * (r / radial), z) } else { Point3::new(r, 0.0, z) }
}

/// Nearest point of the frustum's half section, in (radial, z).
fn nearest_of_profile(f: &RoundFrustum, radial: f64, z: f64) -> (f64, f64) {
    let (dr, dz) = (f.radius_high - f.radius_low, f.z_high - f.z_low);
    let length_sq = dr * dr + dz * dz;
    // The slanted side, the ends, and the point itself where it is inside.
    let t = if length_sq > 0.0 {
        (((radial - f.radius_low) * dr + (z - f.z_low) * dz) / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut best = (f.radius_low + t * dr, f.z_low + t * dz);
    let mut consider = |r: f64, h: f64| {
        if (radial - r).hypot(z - h) < (radial - best.0).hypot(z - best.1) {
            best = (r, h);
        }
    };
    consider(radial.min(f.radius_low), f.z_low);
    consider(radial.min(f.radius_high), f.z_high);
    if f.z_low < z && z < f.z_high {
        let wall = f.radius_low + dr * ((z - f.z_low) / dz);
        consider(radial.min(wall), z);
    }
    best
}

/// Largest coordinate of the undilated body along a direction, own frame.
fn core_support(solid: &Solid, direction: &Vector3<f64>) -> f64 {
    match solid {
        Solid::Frustum(f) => {
            let across = direction.x.hypot(direction.y);
            let low = f.z_low * direction.z + f.radius_low * across;
            low.max(f.z_high * direction.z + f.radius_high * across)
        }
        Solid::Box(b) => direction.abs().dot(&b.half_extents),
        Solid::Hull(h) => direction.dot(&h.core.support(direction).coords),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use facemill_cl_data::RoundBox;

    fn solids() -> Vec<Solid> {
        let mut all = vec![Solid::Box(RoundBox { half_extents: Vector3::new(3.0, 2.0, 0.5), rounding: 1.0 })];
        for (radius_low, radius_high) in [(4.0, 4.0), (4.0, 1.0), (0.0, 3.0), (0.0, 0.0)] {
            for z_high in [1.0, 5.0] {
                all.push(Solid::Frustum(RoundFrustum { z_low: 1.0, z_high, radius_low, radius_high, rounding: 0.5 }));
            }
        }
        all
    }

    #[test]
    fn the_nearest_point_is_in_the_body_and_at_its_distance() {
        for solid in solids() {
            for i in 0..1000i32 {
                let at = |k: i32| f64::from((i / k) % 10) * 1.7 - 7.0;
                let p = Point3::new(at(1), at(10), at(100));
                let near = nearest_of_core(&solid, &p);
                assert!(solid.core_distance(&near) < 1e-12, "{solid:?} {p}: {near}");
                assert!(((p - near).norm() - solid.core_distance(&p)).abs() < 1e-12, "{solid:?} {p}: {near}");
                // No point of the body is beyond the support in the direction away from it.
                let direction = p - near;
                assert!(direction.dot(&near.coords) <= core_support(&solid, &direction) + 1e-9);
            }
        }
    }

    #[test]
    fn a_proven_gap_is_not_more_than_the_distance_and_close_to_it() {
        for solid in solids() {
            for i in 0..1000i32 {
                let at = |k: i32| f64::from((i / k) % 10) * 2.3 - 10.0;
                let min = Point3::new(at(1), at(10), at(100));
                let body = Aabb { min, max: min + Vector3::new(1.0, 2.0, 8.0) };
                let pose = Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.4, f64::from(i), 0.1));
                // Distance of points on a grid of the box, which is at most a grid step too large.
                let n = 8;
                let points = (0..=n).flat_map(|a| (0..=n).flat_map(move |b| (0..=n).map(move |c| [a, b, c])));
                let sampled = points
                    .map(|k| {
                        let t = k.map(|k| f64::from(k) / f64::from(n));
                        let p = min + Vector3::new(t[0], 2.0 * t[1], 8.0 * t[2]);
                        solid.core_distance(&pose.inverse_transform_point(&p))
                    })
                    .fold(f64::INFINITY, f64::min);
                match gap(&body, &solid, &pose, 0.25, 50) {
                    Gap::AtLeast(d) => assert!(d > 0.25 && d <= sampled + 1e-12, "{solid:?} {body:?}: {d} {sampled}"),
                    Gap::Within => assert!(sampled < 0.25 + 0.6, "{solid:?} {body:?}: {sampled}"),
                    Gap::Unknown => assert!(sampled < 0.25 + 0.6, "{solid:?} {body:?}: {sampled}"),
                }
            }
        }
    }
}
