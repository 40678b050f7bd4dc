use std::time::Instant;

use super::RawMesh;

/// The time of a group does not grow with the number of those before it.
#[test]
fn many_groups_take_bounded_time() {
    const N: usize = 200_000;
    let start = Instant::now();
    let mut mesh = RawMesh::default();
    for k in 0..N {
        mesh.begin_group("without a triangle");
        mesh.begin_group(["a", "b"][k % 2]);
        mesh.push([0, 1, 2]).unwrap();
    }
    let are_in_turn =
        mesh.groups.iter().enumerate().all(|(k, g)| g.name == ["a", "b"][k % 2] && g.triangles == (k..k + 1));
    assert!(mesh.groups.len() == N && are_in_turn);
    assert!(start.elapsed().as_secs() < 4, "{:?}", start.elapsed());
}
