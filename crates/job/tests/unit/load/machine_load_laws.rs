//! Laws of machine files whose bodies are meshes.

use std::path::{Path, PathBuf};

use facemill_cl_data::Solid;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, MachineFile, MeshShapeFile, MeshUnitFile, ShapeFile};
use nalgebra::{Point3, Vector3};

use crate::load::machine_load::read_machine;

/// Two blocks of 2 × 2 × 2, one beside and above the other, each a group.
const STAIR: &str = "stair.obj";

/// Returns a block in the OBJ format, its vertices numbered from `first`.
fn block(name: &str, min: [f64; 3], max: [f64; 3], first: u32) -> String {
    let end = |k: usize, axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
    let mut text = format!("g {name}\n");
    for k in 0..8 {
        text.push_str(&format!("v {} {} {}\n", end(k, 0), end(k, 1), end(k, 2)));
    }
    for quad in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        let [a, b, c, d] = quad.map(|k: u32| k + first);
        text.push_str(&format!("f {a} {b} {c}\nf {a} {c} {d}\n"));
    }
    text
}

fn mesh(file: &str) -> MeshShapeFile {
    MeshShapeFile { file: file.to_owned(), unit: None, groups: None, hull: None }
}

/// Makes a folder with meshes and a machine file whose bed and first table row have a body of this
/// shape.
fn folder(shape: MeshShapeFile) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let upper = block("upper", [2.0, 0.0, 2.0], [4.0, 2.0, 4.0], 9);
    write(STAIR, &(block("lower", [0.0; 3], [2.0; 3], 1) + &upper));
    write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n");
    write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 2e6\nf 1 2 3\nf 1 2 4\n");
    write("odd.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nv 0 0 2\nf 1 2 3\nf 1 2 4\n");
    write("notes.txt", "no mesh");
    let mut file = plain();
    let (name, position_mm) = ("rail".to_owned(), [10.0, 0.0, 0.0]);
    let body =
        BodyFile { name, shape: ShapeFile::Mesh(shape), position_mm, rotation_xyz_deg: [0.0; 3], clearance_mm: 5.0 };
    file.workpiece_chain.rows[0].bodies = vec![body.clone()];
    file.bed_bodies = vec![body];
    write("machine.json", &facemill_file_format::to_json(&file));
    let path = folder.path().join("machine.json");
    (folder, path)
}

fn plain() -> MachineFile {
    Machine::head_b_table_c().unwrap().to_file()
}

fn refused(shape: MeshShapeFile) -> String {
    let (_folder, path) = folder(shape);
    read_machine(&path).err().expect("it is refused").to_string()
}

#[test]
fn body_is_the_hull_of_its_mesh_in_its_unit() {
    for (unit, mm) in [(None, 1.0), (Some(MeshUnitFile::Inch), 25.4), (Some(MeshUnitFile::Metre), 1e3)] {
        let (_folder, path) = folder(MeshShapeFile { unit, ..mesh(STAIR) });
        let read = read_machine(&path).unwrap();
        let bodies = read.heads[0].bodies();
        assert_eq!(bodies.iter().filter(|b| b.name() == "rail").count(), 2);
        for body in bodies.iter().filter(|b| b.name() == "rail") {
            let Solid::Hull(hull) = &body.body.solid else { panic!("{body:?}") };
            assert_eq!((hull.rounding, body.clearance), (5.0, 5.0));
            let bounds = hull.core.aabb();
            assert!(bounds.min.coords.norm() < 1e-9 * mm);
            assert!((bounds.max - Point3::new(4.0, 2.0, 4.0) * mm).norm() < 1e-9 * mm);
            assert_eq!(body.body.frame_from_solid.translation.vector, Vector3::new(10.0, 0.0, 0.0));
        }
        // The hull of the stair is a hexagonal prism: the square of 4 × 4 less two triangles of 2 ×
        // 2 / 2.
        let hull = &read.hulls[0];
        assert_eq!(hull.n_vertices, 12);
        assert!((hull.hull_mm3 / mm.powi(3) - 24.0).abs() < 1e-9);
        assert!((hull.excess().unwrap() - 0.5).abs() < 1e-9);
    }
}

#[test]
fn groups_of_a_mesh_are_bodies_of_their_own() {
    let (_folder, path) = folder(MeshShapeFile { groups: Some(vec!["low*".to_owned()]), ..mesh(STAIR) });
    let read = read_machine(&path).unwrap();
    assert_eq!(read.hulls.len(), 2);
    assert!(read.hulls.iter().all(|h| h.n_vertices == 8 && h.excess().unwrap() < 1e-12));
    assert!(read.heads[0].bodies().iter().any(|b| b.body.solid.aabb().max == Point3::new(7.0, 7.0, 7.0)));
}

#[test]
fn views_rebuilt_from_the_file_of_a_machine_keep_the_hulls() {
    let (_folder, path) = folder(mesh(STAIR));
    let machine = read_machine(&path).unwrap().heads.swap_remove(0);
    let again = Machine::from_file(machine.to_file()).unwrap();
    assert_eq!(again.bodies(), machine.bodies());
}

#[test]
fn what_is_no_body_is_refused_by_field_and_file() {
    let of = |file: &str| refused(mesh(file));
    let cases = [
        (of("gone.stl"), "relative to the machine file"),
        (of("notes.txt"), "unknown kind of mesh file"),
        (of("flat.obj"), "in one plane"),
        (of("far.obj"), "kilometre"),
        (of("odd.obj"), "odd.obj"),
        (refused(MeshShapeFile { groups: Some(vec!["ram".to_owned()]), ..mesh(STAIR) }), "the file has: lower, upper"),
    ];
    for (message, says) in cases {
        assert!(message.contains("bed_bodies[0].shape.mesh (body \"rail\"): mesh file"), "{message}");
        assert!(message.contains("machine.json") && message.contains(says), "{message}");
    }
}

#[test]
fn text_alone_makes_no_machine_with_meshes() {
    let (_folder, path) = folder(mesh(STAIR));
    let text = std::fs::read(Path::new(&path)).unwrap();
    let message = Machine::heads_from_json(&text).unwrap_err().to_string();
    assert!(message.contains("bed_bodies[0].shape.mesh") && message.contains("with_hulls"), "{message}");
}
