use super::RawMesh;

/// Half a minute, where the time of a group grows with the number of those before it.
#[test]
fn many_groups_in_turn_are_kept() {
    const N: usize = 200_000;
    let mut mesh = RawMesh::default();
    for k in 0..N {
        mesh.begin_group("without a triangle");
        mesh.begin_group(["a", "b"][k % 2]);
        mesh.push([0, 1, 2]).unwrap();
    }
    let are_in_turn =
        mesh.groups.iter().enumerate().all(|(k, g)| g.name == ["a", "b"][k % 2] && g.triangles == (k..k + 1));
    assert!(mesh.groups.len() == N && are_in_turn);
}
