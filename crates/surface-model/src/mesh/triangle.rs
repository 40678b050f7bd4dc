use nalgebra::Point3;

/// Returns the weights of the corners for the point of a triangle nearest to `p`.
///
/// The signs of scalar products of the sides with the lines to `p` distinguish the regions of
/// corners, sides and face (Ericson, Real-Time Collision Detection, 5.1.5). A triangle without area
/// gives a point on one of its sides.
pub(crate) fn closest_on_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (ab_ap, ac_ap) = (ab.dot(&ap), ac.dot(&ap));
    if ab_ap <= 0.0 && ac_ap <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (ab_bp, ac_bp) = (ab.dot(&bp), ac.dot(&bp));
    if ab_bp >= 0.0 && ac_bp <= ab_bp {
        return [0.0, 1.0, 0.0];
    }
    let (ab_cp, ac_cp) = (ab.dot(&cp), ac.dot(&cp));
    if ac_cp >= 0.0 && ab_cp <= ac_cp {
        return [0.0, 0.0, 1.0];
    }
    let area_c = ab_ap * ac_bp - ab_bp * ac_ap;
    if area_c <= 0.0 && ab_ap >= 0.0 && ab_bp <= 0.0 {
        let v = ratio(ab_ap, ab_ap - ab_bp);
        return [1.0 - v, v, 0.0];
    }
    let area_b = ab_cp * ac_ap - ab_ap * ac_cp;
    if area_b <= 0.0 && ac_ap >= 0.0 && ac_cp <= 0.0 {
        let w = ratio(ac_ap, ac_ap - ac_cp);
        return [1.0 - w, 0.0, w];
    }
    let area_a = ab_bp * ac_cp - ab_cp * ac_bp;
    let (along, against) = (ac_bp - ab_bp, ab_cp - ac_cp);
    if area_a <= 0.0 && along >= 0.0 && against >= 0.0 {
        let w = ratio(along, along + against);
        return [0.0, 1.0 - w, w];
    }
    let area = area_a + area_b + area_c;
    let (v, w) = (ratio(area_b, area), ratio(area_c, area));
    let face = [(1.0 - v - w).max(0.0), v, w];
    // The areas are differences of these products. In a sliver they are mostly rounding, and the
    // sides are more reliable.
    let product = (ab_ap * ac_bp).abs().max((ab_cp * ac_ap).abs()).max((ab_bp * ac_cp).abs());
    if area > 1e-9 * product { face } else { best_of_face_and_sides(p, [a, b, c], face) }
}

fn best_of_face_and_sides(p: &Point3<f64>, t: [&Point3<f64>; 3], face: [f64; 3]) -> [f64; 3] {
    let distance_sq =
        |w: &[f64; 3]| (t[0].coords * w[0] + t[1].coords * w[1] + t[2].coords * w[2] - p.coords).norm_squared();
    let mut best = (distance_sq(&face), face);
    for k in 0..3 {
        let (i, j) = (k, (k + 1) % 3);
        let side = t[j] - t[i];
        let along = ratio(side.dot(&(p - t[i])), side.norm_squared());
        let mut weights = [0.0; 3];
        (weights[i], weights[j]) = (1.0 - along, along);
        let d = distance_sq(&weights);
        if d < best.0 {
            best = (d, weights);
        }
    }
    best.1
}

/// Returns `part / whole` within 0..1; 0 where both are 0.
fn ratio(part: f64, whole: f64) -> f64 {
    let r = part / whole;
    if r.is_finite() { r.clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
#[path = "../../tests/unit/mesh/triangle.rs"]
mod tests;
