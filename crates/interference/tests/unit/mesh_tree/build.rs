use crate::mesh_tree::build::*;
use crate::test_kit::{Random, soup, sphere};

/// Places below a child, all of whose corners must be in the slab given for it.
fn places(tree: &Tree, child: Child, slab: Option<&Slab>, all: &mut Vec<u32>) {
    let first = all.len();
    match child {
        Child::Triangle(place) => all.push(place),
        Child::Node(at) => {
            let node = &tree.nodes[at as usize];
            for (lane, packed) in node.packed_children() {
                places(tree, Child::unpack(packed), Some(&node.slabs.get(lane)), all);
            }
        }
    }
    for p in all[first..].iter().flat_map(|&place| &tree.corners[place as usize]) {
        let Some(slab) = slab else { break };
        let from_center = p - slab.center;
        let height = from_center.dot(&slab.normal);
        assert!(height.abs() <= slab.half_thickness && (from_center - slab.normal * height).norm() <= slab.radius);
    }
}

#[test]
fn every_triangle_is_in_the_tree_once_and_in_the_slabs_above_it() {
    let mut meshes: Vec<_> = (1..140).map(|n| soup(&mut Random(n as u64), n)).collect();
    meshes.extend([511, 512, 513, 4096, 4097, 9000].map(|n| soup(&mut Random(n as u64), n)));
    meshes.push(sphere(30.0, 60));
    // All centres the same.
    meshes.push(TriMesh::new(soup(&mut Random(1), 1).vertices().to_vec(), vec![[0, 1, 2]; 700]).unwrap());
    for mesh in meshes {
        let tree = Tree::build(&mesh);
        let mut all = Vec::new();
        places(&tree, Child::Node(0), None, &mut all);
        assert_eq!(all, (0..mesh.triangles().len() as u32).collect::<Vec<_>>());
        let mut order = tree.order.clone();
        order.sort_unstable();
        assert_eq!(order, all);
        assert!(tree.order.iter().zip(&tree.corners).all(|(&t, c)| mesh.corners(t as usize) == *c));
        // Full subtrees: a node for seven triangles, and some above.
        assert!(tree.nodes.len() <= 2 + mesh.triangles().len() / 3, "{} nodes", tree.nodes.len());
    }
}

#[test]
fn any_number_of_threads_builds_the_same_tree() {
    let mesh = soup(&mut Random(8), 40_000);
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| Tree::build(&mesh))
    };
    let one = on(1);
    for n in [2, 5] {
        let tree = on(n);
        assert!(tree.order == one.order);
        assert!(tree.nodes.iter().zip(&one.nodes).all(|(a, b)| format!("{a:?}") == format!("{b:?}")));
    }
}
