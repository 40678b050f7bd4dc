use super::*;
use crate::test_kit::{cylinder, plane, surface};
use facemill_surface_model::{Group, TriMesh};
use nalgebra::Point3;

fn reason(e: PathError) -> &'static str {
    match e {
        PathError::EmptyRegion { reason } => reason,
        other => panic!("{other}"),
    }
}

#[test]
fn a_cone_keeps_the_triangles_that_face_its_axis() {
    let s = surface(cylinder(50.0, 100.0, 1.2, 4, 60));
    let cone = NormalCone { axis: Vector3::z_axis(), half_angle: 0.6 };
    let kept = triangles_of(&s, &Region { normal_cone: Some(cone), ..Region::default() }).unwrap();
    let angle = |t: u32| s.facet_normal(t).unwrap().angle(&Vector3::z());
    assert!(kept.iter().all(|&t| angle(t) <= 0.6));
    assert_eq!(kept.len(), (0..480).filter(|&t| angle(t) <= 0.6).count());
    assert!((200..280).contains(&kept.len()), "half of 480, not {}", kept.len());
    let cone = NormalCone { axis: -Vector3::z_axis(), half_angle: 0.6 };
    let none = triangles_of(&s, &Region { normal_cone: Some(cone), ..Region::default() });
    assert_eq!(reason(none.unwrap_err()), "no normal lies in the normal cone");
}

#[test]
fn groups_are_found_by_name_and_a_wrong_name_is_reported_with_the_right_ones() {
    let p = plane(10.0, 10.0, 2, 2);
    let group = |name: &str, triangles| Group { name: name.to_owned(), triangles };
    let groups = vec![group("hub", 0..3), group("blade", 3..8)];
    let s = surface(TriMesh::with_groups(p.vertices().to_vec(), p.triangles().to_vec(), groups).unwrap());
    let of = |names: &[&str]| {
        let groups = Some(names.iter().map(|&n| n.to_owned()).collect());
        triangles_of(&s, &Region { groups, ..Region::default() })
    };
    assert_eq!(of(&["blade"]).unwrap(), [3, 4, 5, 6, 7]);
    assert_eq!(of(&["blade", "hub"]).unwrap().len(), 8);
    let e = of(&["blade", "tip"]).unwrap_err();
    assert_eq!(e.to_string(), r#"the drive surface has no group "tip"; it has "hub", "blade""#);
}

#[test]
fn a_box_beside_the_surface_and_an_empty_mesh_are_distinguished() {
    let s = surface(plane(10.0, 10.0, 2, 2));
    let bounds = Some(Aabb { min: Point3::new(20.0, 0.0, 0.0), max: Point3::new(30.0, 1.0, 1.0) });
    let e = triangles_of(&s, &Region { bounds, ..Region::default() }).unwrap_err();
    assert_eq!(reason(e), "the box holds none");
    let e = triangles_of(&surface(TriMesh::default()), &Region::default()).unwrap_err();
    assert_eq!(reason(e), "the mesh has none with an area");
}
