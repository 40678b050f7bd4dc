//! Bodies of the machine as hulls of meshes, on the virtual machine.

use std::sync::Arc;

use crate::kit::{Shop, Text};
use facemill_cl_data::{ConvexPolyhedron, Silent};
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, MeshShapeFile, ShapeFile};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::{Certificate, Finding, FindingKind, Measure, VerifySettings, VirtualSetup, certify};
use nalgebra::Point3;

/// The shape of a box, or the hull of its corners.
fn block(size_mm: [f64; 3], as_mesh: bool) -> ShapeFile {
    if !as_mesh {
        return ShapeFile::Box { size_mm };
    }
    let end = |k: usize, axis: usize| (if k >> axis & 1 == 0 { -0.5 } else { 0.5 }) * size_mm[axis];
    let corners: Vec<_> = (0..8).map(|k| Point3::new(end(k, 0), end(k, 1), end(k, 2))).collect();
    let hull = Some(Arc::new(ConvexPolyhedron::around(&corners, []).unwrap()));
    ShapeFile::Mesh(MeshShapeFile { file: "block.stl".to_owned(), unit: None, groups: None, hull })
}

/// The preset with a block on its bed beside the middle of the plate, `top` above it; boxes of the
/// head and the block are meshes on request.
fn shop(top: f64, as_mesh: bool) -> Shop {
    let foot = Shop::new().table_from_work * Point3::new(0.0, 180.0, 0.0);
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    let mut n_boxes = 0;
    for body in file.tool_chains[0].rows.iter_mut().flat_map(|row| row.bodies.iter_mut()) {
        if let ShapeFile::Box { size_mm } = body.shape {
            body.shape = block(size_mm, as_mesh);
            n_boxes += 1;
        }
    }
    assert!(n_boxes > 1, "{n_boxes}");
    file.bed_bodies = vec![BodyFile {
        name: "block".to_owned(),
        shape: block([120.0, 100.0, 600.0], as_mesh),
        position_mm: [foot.x, foot.y, foot.z + top - 300.0],
        rotation_xyz_deg: [0.0; 3],
        clearance_mm: 5.0,
    }];
    Shop::with_machine(Machine::from_file(file).unwrap())
}

/// Past the block at tip height 300, upright and leaning: the head's lower side, 370 mm above the
/// tip, passes over it.
fn past(shop: &Shop, lean: f64) -> (Vec<Finding>, Certificate) {
    let axis = [lean.sin(), 0.0, lean.cos()];
    let setup = VirtualSetup { obstacles: Vec::new(), ..shop.setup() };
    let text = Text::new(shop).rapid([-400.0, 0.0, 300.0]).cut_tilted([400.0, 0.0, 300.0], axis);
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    let settings = VerifySettings { gouge_limit: 0.1, ..VerifySettings::default() };
    let last = certify(&program, &setup, &settings, &Silent).unwrap().certificates.pop().unwrap();
    let mut findings = text.verify_in(&setup).findings;
    // C is not 0 at the end, and the start is at the pole.
    findings.retain(|f| f.kind != FindingKind::Singularity);
    (findings, last)
}

fn distance(finding: &Finding) -> f64 {
    match finding.measure {
        Some(Measure::DistanceMm(d)) => d,
        _ => f64::NAN,
    }
}

#[test]
fn boxes_as_meshes_give_the_findings_and_certificates_of_boxes() {
    let (mut n_findings, mut n_certified) = (0, 0);
    for lean in [0.0, 0.05] {
        for top in [700.0, 670.0 - 14.5, 600.0, 300.0] {
            let [(boxes, of_boxes), (meshes, of_meshes)] = [false, true].map(|as_mesh| past(&shop(top, as_mesh), lean));
            assert_eq!(boxes.len(), meshes.len(), "{boxes:#?} and {meshes:#?}");
            for (a, b) in boxes.iter().zip(&meshes) {
                assert_eq!((a.kind, &a.body, &a.obstacle, a.worst_line), (b.kind, &b.body, &b.obstacle, b.worst_line));
                assert!((distance(a) - distance(b)).abs() < 1e-9, "{a} and {b}");
            }
            assert_eq!(of_boxes.certified, of_meshes.certified, "{of_boxes:?} and {of_meshes:?}");
            assert_eq!(of_boxes.uncertified_between, of_meshes.uncertified_between);
            n_findings += boxes.len();
            n_certified += usize::from(of_boxes.certified);
        }
    }
    assert!(n_findings > 2 && n_certified > 1, "{n_findings} findings, {n_certified} certified");
}
