use crate::mesh::caps::*;

fn is_flat(points: &[Point3<f64>], t: [u32; 3]) -> bool {
    let [a, b, c] = t.map(|v| points[v as usize]);
    (b - a).cross(&(c - a)).norm() < 1e-9
}

/// A square fan over (0,0)…(4,0) whose lower side has two caps on each other.
#[test]
fn caps_on_each_other_are_turned_and_no_slit_opens() {
    let points: Vec<Point3<f64>> = [(0.0, 0.0), (4.0, 0.0), (2.0, 3.0), (1.0, 0.0), (2.0, 0.0), (2.0, -3.0)]
        .iter()
        .map(|&(x, y)| Point3::new(x, y, 0.0))
        .collect();
    // Below the line, triangles reach its inner points; above, one spans it; caps fill the gap of
    // no width.
    let mut triangles = vec![[0, 1, 2], [0, 4, 1], [0, 3, 4], [0, 5, 3], [3, 5, 4], [4, 5, 1]];
    let area = |ts: &[[u32; 3]]| {
        let mesh = TriMesh::new(points.clone(), ts.to_vec()).unwrap();
        (0..ts.len()).map(|t| mesh.scaled_normal(t).z).sum::<f64>()
    };
    let open = |ts: &[[u32; 3]]| {
        let mesh = TriMesh::new(points.clone(), ts.to_vec()).unwrap();
        let edges = Edges::of(&mesh);
        (0..edges.len() as u32).filter(|&e| edges.sides(e).len() != 2).count()
    };
    assert_eq!((area(&triangles), open(&triangles)), (24.0, 4));
    assert_eq!(turn_caps(&points, &mut triangles, |t| is_flat(&points, t)), 2);
    assert!(triangles.iter().all(|&t| !is_flat(&points, t)));
    assert_eq!((area(&triangles), open(&triangles)), (24.0, 4));
}

#[test]
fn a_cap_without_neighbour_stays() {
    let points: Vec<Point3<f64>> = [0.0, 1.0, 2.0].iter().map(|&x| Point3::new(x, 0.0, 0.0)).collect();
    let mut triangles = vec![[0, 1, 2]];
    assert_eq!(turn_caps(&points, &mut triangles, |t| is_flat(&points, t)), 0);
    assert_eq!(triangles, [[0, 1, 2]]);
}
