use super::*;

#[test]
fn hulls_are_described_with_the_volume_that_they_add() {
    assert!(describe_hulls(&[]).is_empty());
    let closed = BodyHull {
        body: "rail".to_owned(),
        file: "stair.obj".to_owned(),
        n_vertices: 12,
        hull_mm3: 24.0,
        mesh_mm3: Some(16.0),
    };
    let open = BodyHull { mesh_mm3: None, ..closed.clone() };
    let lines = describe_hulls(&[closed, open]);
    assert!(lines[1].contains("rail (stair.obj): 12 vertices, 50.0 % more volume"), "{lines:?}");
    assert!(lines[2].contains("the mesh is not closed"), "{lines:?}");
}
