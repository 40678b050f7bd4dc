use super::*;

#[test]
fn an_outline_on_the_sheet_is_that_of_the_whole_surface_and_not_of_the_thinned_one() {
    // A dome on a square of 300 mm: 180,000 triangles.
    let n = 300_u32;
    let vertices = (0..=n).flat_map(|j| (0..=n).map(move |i| [f64::from(i), f64::from(j)]));
    let dome = |[x, y]: [f64; 2]| Point3::new(x, y, 40.0 - ((x - 150.0).powi(2) + (y - 150.0).powi(2)) / 1000.0);
    let vertices: Vec<Point3<f64>> = vertices.map(dome).collect();
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let squares = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let halves = |(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let full = TriMesh::new(vertices, squares.flat_map(halves).collect()).expect("a mesh");
    assert!(full.triangles().len() > MOST.triangles);
    // As small a share as a part has beside much larger fixtures.
    let shown = thinned(&full, 2_000);
    let surface = ShownSurface { name: "part".to_owned(), role: "part", full, shown };
    let drawn = surface.outline(&Isometry3::translation(10.0, 20.0, 30.0));
    let range = |points: &[[f64; 2]], k: usize| {
        points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p[k]), b.max(p[k])])
    };
    assert_eq!([range(&drawn.top, 0), range(&drawn.top, 1)], [[10.0, 310.0], [20.0, 320.0]]);
    assert_eq!([range(&drawn.front, 0), range(&drawn.front, 1)], [[10.0, 310.0], [25.0, 70.0]]);
    let least = surface.shown.vertices.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    assert!(least > 0.0, "the thinned surface is as wide: this tests nothing");
}
