//! Third-party meshes, dirty ones among them, compared with the data of their sources. They are not
//! part of the project; where the folder is absent the tests say so and pass.
use facemill_surface_model::{
    ImportSettings, Imported, LengthUnit, MeshFormat, Surface, SurfaceSettings, UpAxis, import_mesh, no_external_files,
};
use std::path::PathBuf;

fn read(file: &str, unit: LengthUnit, up_axis: UpAxis) -> Option<Imported> {
    let root = std::env::var_os("FACEMILL_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join("data/meshes").join(file);
    let Ok(bytes) = std::fs::read(&path) else {
        eprintln!("SKIPPED: {} is absent", path.display());
        return None;
    };
    let format = path.extension().and_then(|e| MeshFormat::from_extension(e.to_str()?)).unwrap();
    let settings = ImportSettings { unit, up_axis, ..ImportSettings::default_for(format) };
    Some(import_mesh(file, &bytes, format, &settings, &no_external_files).unwrap())
}

const MM: LengthUnit = LengthUnit::Millimetre;

#[test]
fn openfoam_propeller_has_952_open_edges_and_four_components() {
    let Some(Imported { mesh, report }) = read("openfoam_propeller.obj", LengthUnit::Metre, UpAxis::Y) else { return };
    assert_eq!((report.n_triangles_in, report.n_degenerate, report.n_duplicates), (37_240, 0, 0));
    assert_eq!((report.n_open_edges, report.n_components, report.n_closed), (952, 4, 0));
    let names: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
    assert!(names.contains(&"propellerTip") && names.contains(&"propellerStem"), "{names:?}");
}

#[test]
fn pptc_propeller_is_non_manifold_with_eleven_degenerate_triangles() {
    let Some(Imported { mesh, report }) = read("pptc_vp1304_bladex_ascii.stl", MM, UpAxis::X) else { return };
    assert_eq!((report.n_triangles_in, report.n_degenerate, mesh.triangles().len()), (6899, 11, 6888));
    assert!(report.n_non_manifold_edges > 0 && report.n_open_edges == 0);
    // D = 250 mm about the axis, which points up here.
    let radius = mesh.vertices().iter().map(|p| p.coords.xy().norm()).fold(0.0, f64::max);
    assert!((radius - 125.0).abs() < 0.2, "{radius}");
}

#[test]
fn pptc_solids_overlap_and_are_wound_outward() {
    let Some(Imported { mesh, report }) = read("pptc_vp1304_bladex.obj", MM, UpAxis::X) else { return };
    assert_eq!((report.n_components, report.n_closed, report.n_inverted), (5, 5, 0));
    assert!(report.n_non_manifold_edges > 0);
    // Where the blades reach into the hub two solids wind around the same point.
    let surface = Surface::new(mesh, SurfaceSettings::default());
    let b = surface.aabb();
    let n = 40;
    let grid = (0..n * n * n).map(|k| [k % n, k / n % n, k / n / n].map(|i| (i as f64 + 0.5) / n as f64));
    let windings: Vec<i32> = grid
        .map(|[x, y, z]| b.min + (b.max - b.min).component_mul(&nalgebra::Vector3::new(x, y, 0.9 + 0.1 * z)))
        .filter_map(|p| surface.winding(&p))
        .collect();
    assert!(windings.iter().all(|w| (0..=2).contains(w)) && windings.contains(&1), "{:?}", windings.iter().max());
}

#[test]
fn uuv_propeller_has_568_open_edges_and_eight_components() {
    let Some(Imported { mesh, report }) = read("uuv_rov_propeller.glb", LengthUnit::Metre, UpAxis::Y) else { return };
    assert_eq!((report.n_triangles_in, report.n_open_edges, report.n_components), (2598, 568, 8));
    assert!((mesh.aabb().max.x - 179.997_668).abs() < 1e-3, "metres became mm");
}

#[test]
fn r2b2_propeller_is_watertight_with_three_degenerate_triangles() {
    let Some(Imported { report, .. }) = read("r2b2_propeller.stl", MM, UpAxis::Z) else { return };
    assert_eq!((report.n_triangles_in, report.n_degenerate + report.n_turned), (8548, 3));
    assert_eq!(report.n_open_edges, 0);
    assert!(report.components.iter().all(|c| c.closed));
}

#[test]
fn rotor_37_is_the_same_watertight_blade_in_both_files() {
    for file in ["nasa_rotor37_blade.stl", "nasa_rotor37_blade.obj"] {
        let Some(Imported { report, .. }) = read(file, MM, UpAxis::X) else { return };
        assert_eq!((report.n_open_edges, report.n_components, report.n_closed, report.n_inverted), (0, 1, 1, 0));
        assert!((report.components[0].volume_mm3.unwrap() - 7916.0).abs() < 0.1);
    }
}

#[test]
fn bladex_blade_sides_are_open_patches() {
    for file in ["bladex_blade_upper.stl", "bladex_blade_lower.stl"] {
        let Some(Imported { report, .. }) = read(file, MM, UpAxis::X) else { return };
        assert!(report.n_open_edges > 0 && report.n_non_manifold_edges == 0 && report.n_closed == 0);
        assert_eq!(report.n_components, 1);
    }
}
