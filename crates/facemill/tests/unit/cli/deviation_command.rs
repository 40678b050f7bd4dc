use super::*;
use facemill::surface_model::{ImportSettings, MeshFormat, Surface, SurfaceSettings, import_mesh, no_external_files};

/// Each format reads back as a closed mesh with the lines' volume, at the position of the stock.
#[test]
fn the_rest_is_a_closed_mesh_in_every_format() {
    let frame = Isometry3::rotation(nalgebra::Vector3::new(0.3, -0.2, 0.1));
    let stock = DexelMap::of_cylinder(&frame, [5.0, -3.0], 8.0, [1.0, 12.0], 1.0).expect("a cylinder");
    for name in ["rest.obj", "rest.STL", "rest.glb"] {
        let file = rest_mesh(name).expect("a known ending");
        let bytes = mesh_bytes(&file, &stock).expect("a mesh");
        let format = MeshFormat::from_extension(&name[5..]).expect("a format");
        let settings = ImportSettings::default_for(format);
        let mesh = import_mesh(name, &bytes, format, &settings, &no_external_files).expect("a mesh").mesh;
        let surface = Surface::new(mesh, SurfaceSettings::default());
        let volume: f64 = surface.topology().components.iter().map(|c| c.volume_mm3.expect("closed")).sum();
        assert!((volume / stock.volume() - 1.0).abs() < 1e-4, "{name}: {volume} {}", stock.volume());
        let middle = frame * nalgebra::Point3::new(5.0, -3.0, 6.0);
        assert!(surface.is_inside(&middle) && !surface.is_inside(&(frame * nalgebra::Point3::new(5.0, -3.0, 0.5))));
    }
}

#[test]
fn other_endings_are_refused_before_anything_is_cut() {
    assert!(rest_mesh("rest.ply").is_err_and(|e| e.contains(".stl")) && rest_mesh("rest").is_err());
    assert!(painted_mesh("part.stl").is_err_and(|e| e.contains(".glb")) && painted_mesh("part.GLB").is_ok());
    let empty = DexelMap::of_box(&Isometry3::identity(), [0.0; 3], [1.0; 3], 1.0).map(|m| DexelMap::empty(*m.grid()));
    let why = mesh_bytes(Path::new("rest.stl"), &empty.expect("a box")).expect_err("no mesh").to_string();
    assert!(why.contains("rest.stl") && why.contains("no stock is left"), "{why}");
}
