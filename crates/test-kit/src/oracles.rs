//! Slow answers by their definition.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

/// Volume that a closed mesh encloses, by the divergence theorem, mm³; negative where it is wound
/// inward.
pub fn volume(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let corners = triangles.iter().map(|t| t.map(|v| vertices[v as usize].coords));
    corners.map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

/// Number of directed edges without an opposite one: 0 of closed meshes alone.
pub fn open_edges(triangles: &[[u32; 3]]) -> usize {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for (a, b) in triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]) {
        *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
    }
    edges.values().map(|n| n.unsigned_abs() as usize).sum()
}

/// Parameter t with which the line `origin` + t · `direction` crosses a triangle, its edges
/// included, by the method of Möller and Trumbore; `None` where it passes by.
///
/// A line in the plane of the triangle, or one without an area, is not crossed.
pub fn crossing_of_line([a, b, c]: &[Point3<f64>; 3], origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
    let (u, v) = (b - a, c - a);
    let h = direction.cross(&v);
    let det = u.dot(&h);
    let s = origin - a;
    let q = s.cross(&u);
    let [along_u, along_v] = [s.dot(&h), direction.dot(&q)].map(|x| x / det);
    (along_u >= 0.0 && along_v >= 0.0 && along_u + along_v <= 1.0).then(|| v.dot(&q) / det)
}

/// Least value of a convex function on [0, 1], both ends included, by golden sections: the last
/// interval has the length 0.618^`steps`.
pub fn golden_least(steps: u32, f: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    let (mut x, mut y) = (1.0 - ratio, ratio);
    let (mut f_x, mut f_y) = (f(x), f(y));
    let mut least = f(0.0).min(f(1.0)).min(f_x).min(f_y);
    for _ in 0..steps {
        if f_x <= f_y {
            (high, y, f_y) = (y, x, f_x);
            x = high - ratio * (high - low);
            f_x = f(x);
        } else {
            (low, x, f_x) = (x, y, f_y);
            y = low + ratio * (high - low);
            f_y = f(y);
        }
        least = least.min(f_x).min(f_y);
    }
    least
}

/// Least value of a convex function on a triangle, by [`golden_least`] in two nested directions:
/// slow, and nothing but convexity.
pub fn least_over_triangle(steps: u32, [a, b, c]: &[Point3<f64>; 3], f: impl Fn(&Point3<f64>) -> f64) -> f64 {
    // The least over t of a convex function of (s, t) on a convex set is convex in s.
    golden_least(steps, |s| golden_least(steps, |t| f(&(a + (b - a) * s + (c - a) * (t * (1.0 - s))))))
}
