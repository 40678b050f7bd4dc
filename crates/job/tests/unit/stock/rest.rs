use crate::stock::rest::*;
use nalgebra::{Isometry3, Point3, Vector3};

fn sheet() -> TriMesh {
    let corner = |x: f64, y: f64| Point3::new(x, y, 0.1235);
    let vertices = vec![corner(-5.0, 1.25), corner(7.5, 1.25), corner(7.5, 9.0), corner(-5.0, 9.0)];
    TriMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

#[test]
fn origins_come_back_from_their_bytes_and_from_no_others() {
    let origin = Origin::of(&sheet(), 2.5);
    let bytes = origin.to_bytes();
    assert_eq!(Origin::from_bytes(&bytes), Some(origin));
    assert_eq!(Origin::from_bytes(&[]), None);
    assert_eq!(Origin::from_bytes(&bytes[1..]), None);
    assert_eq!(Origin::from_bytes(&[&bytes[..], &[0]].concat()), None);
}

#[test]
fn differences_are_reported_and_rounding_is_none() {
    let own = Origin::of(&sheet(), 2.5);
    let moved = |by: Vector3<f64>| Origin::of(&sheet().transformed(&Isometry3::translation(by.x, by.y, by.z)), 2.5);
    assert_eq!(moved(Vector3::new(1e-12, -1e-12, 1e-12)), own);
    let there_and_back = Isometry3::rotation(Vector3::new(0.3, 0.2, 2.0));
    let turned = sheet().transformed(&there_and_back).transformed(&there_and_back.inverse());
    assert_eq!(Origin::of(&turned, 2.5), own);
    assert!(moved(Vector3::new(0.0, 0.0, 0.02)).differs_from(&own).contains("(-5.000, 1.250, 0.144)"));
    assert!(Origin::of(&sheet(), 3.0).differs_from(&own).contains("allowance of 3 mm"));
    let other_way = TriMesh::new(sheet().vertices().to_vec(), vec![[0, 1, 3], [1, 2, 3]]).unwrap();
    assert!(Origin::of(&other_way, 2.5).differs_from(&own).contains("another one"));
}

/// A square block that is turned by half a turn has the same corners, and the part in it lies the
/// other way up.
#[test]
fn a_block_in_another_frame_of_the_part_is_another_stock() {
    let own = Origin::of(&sheet(), 0.0);
    let turned = Isometry3::rotation(Vector3::x() * std::f64::consts::PI);
    assert_eq!(own.in_frame(&Isometry3::identity()), own);
    assert_ne!(own.in_frame(&turned), own);
    assert_eq!(own.in_frame(&turned), own.in_frame(&turned));
    assert_ne!(own.in_frame(&turned), own.in_frame(&Isometry3::translation(1.0, 0.0, 0.0)));
}
