use facemill_surface_model::TriMesh;

use crate::load::enclosure::*;
use crate::load::obstacle_meshes::obstacle;

/// Returns a setup whose part is a triangle with corners 10 mm along each axis.
fn obstacles() -> Vec<ObstacleMesh> {
    let corners = vec![Point3::new(10.0, 0.0, 0.0), Point3::new(0.0, 10.0, 0.0), Point3::new(0.0, 0.0, 10.0)];
    let mesh = TriMesh::new(corners, vec![[0, 1, 2]]).unwrap();
    let part = obstacle(ObstacleRole::Part, 0.0, "part".to_owned(), mesh);
    vec![ObstacleMesh { labels: vec!["part.stl".to_owned()], ..part }]
}

fn setup(stock: &str, clearance: &str) -> SetupFile {
    let text = format!(r#"{{"name": "s", "meshes": [], "stock": {stock}, "clearance": {clearance}}}"#);
    serde_json::from_str(&text).unwrap()
}

fn verdict(stock: &str, clearance: &str) -> Result<(), String> {
    let thickness = if stock.contains("offset") { 2.0 } else { 0.0 };
    check_enclosure("setups[0]", &setup(stock, clearance), thickness, &obstacles())
}

const OFFSET: &str = r#"{"offset": {"allowance_mm": 2}}"#;

#[test]
fn clearance_surfaces_enclose_part_and_stock() {
    let plane = |z: f64| format!(r#"{{"plane": {{"origin_mm": [0, 0, {z}]}}}}"#);
    assert_eq!(verdict(OFFSET, &plane(12.0)), Ok(()));
    let message = verdict(OFFSET, &plane(11.5)).unwrap_err();
    assert!(message.starts_with("setups[0].clearance: part") && message.contains("0.500 mm"), "{message}");
    assert!(verdict(OFFSET, &plane(-100.0)).is_err());
    for (radius, holds) in [(12.0, true), (11.9, false)] {
        let cylinder = format!(r#"{{"cylinder": {{"radius_mm": {radius}}}}}"#);
        let sphere = format!(r#"{{"sphere": {{"radius_mm": {radius}}}}}"#);
        assert_eq!(verdict(OFFSET, &cylinder).is_ok(), holds);
        assert_eq!(verdict(OFFSET, &sphere).is_ok(), holds);
    }
}

#[test]
fn stock_contains_the_part() {
    let sphere = r#"{"sphere": {"radius_mm": 1000}}"#;
    for (stock, holds) in [
        (r#"{"box": {"min_mm": [0, 0, 0], "max_mm": [10, 10, 10]}}"#, true),
        (r#"{"box": {"min_mm": [0, 0, 0], "max_mm": [10, 9.9, 10]}}"#, false),
        (r#"{"box": {"min_mm": [900000, 0, 0], "max_mm": [900010, 10, 10]}}"#, false),
        (r#"{"cylinder": {"base_mm": [0, 0, 0], "radius_mm": 10, "height_mm": 10}}"#, true),
        (r#"{"cylinder": {"base_mm": [0, 0, 0], "radius_mm": 10, "height_mm": 9}}"#, false),
        (r#"{"cylinder": {"base_mm": [0, 0, 1], "radius_mm": 10, "height_mm": 20}}"#, false),
        (r#"{"cylinder": {"base_mm": [0, 0, 0], "radius_mm": 9, "height_mm": 10}}"#, false),
    ] {
        let verdict = verdict(stock, sphere);
        assert_eq!(verdict.is_ok(), holds, "{stock}: {verdict:?}");
        assert!(verdict.is_ok() || verdict.unwrap_err().starts_with("setups[0].stock: "));
    }
}
