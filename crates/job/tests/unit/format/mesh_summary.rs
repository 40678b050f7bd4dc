use crate::format::report::mesh_summary::*;
use facemill_surface_model::{ImportSettings, MeshFormat, RepairReport};

#[test]
fn a_mesh_is_described_by_its_repairs() {
    let reported = |repair: &RepairReport| {
        MeshReport::new("a.stl", ImportSettings::default_for(MeshFormat::Stl), repair).summary_line()
    };
    let clean = RepairReport { n_triangles_in: 12, n_components: 1, n_closed: 1, ..RepairReport::default() };
    assert_eq!(reported(&clean), "read 12 triangles, kept 12 triangles in 1 component, closed");
    let dirty = RepairReport {
        n_triangles_in: 566_670,
        n_welded_vertices: 6660,
        n_degenerate: 1,
        n_duplicates: 3,
        n_open_edges: 5,
        n_components: 3,
        n_closed: 2,
        n_inverted: 1,
        ..RepairReport::default()
    };
    assert_eq!(
        reported(&dirty),
        "read 566670 triangles, welded 6660 vertices to others at the same place, dropped 1 triangle without area, dropped 3 \
             triangles that were there twice, kept 566666 triangles in 3 components, 2 of them closed, 5 edges have one triangle, 1 \
             closed component is wound inside out"
    );
}
