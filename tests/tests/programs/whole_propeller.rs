//! The whole propeller: tools and parts of its job, and how much of the wetted surface it cuts.

use facemill_tests::oracles::gltf_groups::groups_of;
use facemill_tests::program::{code_and_errors, run};
use nalgebra::{Point3, Rotation3, Unit, Vector3};
use serde_json::Value;

/// Finishing operations of a side.
const PARTS: [&str; 9] = [
    "finish",
    "root finish",
    "hub finish",
    "fillet low",
    "fillet up",
    "fillet end",
    "strip beside the fillet",
    "leading edge",
    "trailing edge",
];

/// Operations of the whole propeller: their regions and tools cover every part of both sides.
#[test]
fn a_whole_propeller_is_a_job_of_two_setups_and_three_tools() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("whole");
    let path = dir.to_str().unwrap();
    let (code, errors) = code_and_errors(&run(&["new", "propeller-whole", path, "--blades", "1"]));
    assert_eq!(code, 0, "{errors}");
    let job: Value = serde_json::from_slice(&std::fs::read(dir.join("job.json")).unwrap()).unwrap();
    let operations = job["operations"].as_array().unwrap();
    let has = |name: &str| operations.iter().any(|operation| operation["name"] == name);
    for part in PARTS {
        for side in ["suction", "pressure"] {
            assert!(has(&format!("{side} {part}")), "{side} {part}");
        }
    }
    assert!(has("suction leading edge root") && has("pressure trailing edge root"));
    for operation in operations {
        let tool = operation["tool"].as_str().unwrap();
        assert!(dir.join(job["tools"][tool].as_str().unwrap()).exists(), "{tool}");
        assert_eq!(operation["pattern"]["copies"], 1);
        let groups = operation["path"]["strategy"]["region"]["groups"].as_array().unwrap();
        let side = operation["name"].as_str().unwrap().split(' ').next().unwrap();
        // The root of an edge is cut whole from the setup in which it is above the hub's middle.
        let is_root = operation["name"].as_str().unwrap().ends_with("edge root");
        let is_own = |group: &Value| {
            group == "hub/cylinder" || group.as_str().unwrap().contains(if is_root { "-edge" } else { side })
        };
        assert!(groups.iter().all(is_own), "{groups:?} of {side}");
    }
    for (name, wrong) in [("diameter", ["--diameter-mm", "3000"]), ("blades", ["--blades", "4"])] {
        let other = folder.path().join(name);
        let mut arguments = vec!["new", "propeller-whole", other.to_str().unwrap()];
        arguments.extend(wrong);
        let (code, errors) = code_and_errors(&run(&arguments));
        assert!(code == 2 && errors.contains(name) && !other.exists(), "{code}: {errors}");
    }
}

fn vector(of: &Value) -> Vector3<f64> {
    Vector3::from_iterator(of.as_array().unwrap().iter().map(|c| c.as_f64().unwrap()))
}

/// Whether a point lies between the levels of planes or cylinders about z through the origin.
fn is_between(sections: &Value, p: &Point3<f64>) -> bool {
    let (of, level) = match (sections.get("parallel_planes"), sections.get("cylindrical_sections")) {
        (Some(planes), _) => (planes, p.coords.dot(&vector(&planes["normal"]).normalize())),
        (_, Some(cylinders)) => {
            assert_eq!(vector(&cylinders["axis_direction"]), Vector3::z());
            (cylinders, p.x.hypot(p.y))
        }
        _ => return true,
    };
    let limit = |keys: [&str; 2]| keys.iter().find_map(|key| of.get(key)).map(|v| v.as_f64().unwrap());
    limit(["from_mm", "from_radius_mm"]).is_none_or(|from| from <= level)
        && limit(["to_mm", "to_radius_mm"]).is_none_or(|to| level <= to)
}

/// Whether a point of a group, with the normal there, lies in the region of an operation, in the
/// setup's frame.
fn is_in(operation: &Value, group: &str, p: &Point3<f64>, normal: &Vector3<f64>) -> bool {
    let path = &operation["path"]["strategy"];
    let region = &path["region"];
    let in_box = region.get("box").is_none_or(|of| {
        let (low, high) = (vector(&of["min_mm"]), vector(&of["max_mm"]));
        (0..3).all(|c| low[c] <= p[c] && p[c] <= high[c])
    });
    let in_cone = region.get("normal_cone").is_none_or(|cone| {
        let half = cone["half_angle_deg"].as_f64().unwrap().to_radians();
        vector(&cone["axis"]).normalize().dot(normal) >= half.cos()
    });
    let levels = path["strategy"].get("constant_scallop").map_or(&path["strategy"], |fronts| &fronts["within"]);
    region["groups"].as_array().unwrap().iter().any(|name| name == group)
        && in_box
        && in_cone
        && is_between(&region["between"], p)
        && is_between(levels, p)
}

/// Points of each triangle: in its middle, and between that and its corners.
const PLACES: [[f64; 3]; 4] = [
    [1.0 / 3.0; 3],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// Blades and the hub between them lie in the regions of finishing operations, by
/// an own reading of mesh and job: nothing is forgotten.
#[test]
fn the_regions_of_a_whole_propeller_cover_the_wetted_surface() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("whole");
    let (code, errors) = code_and_errors(&run(&["new", "propeller-whole", dir.to_str().unwrap()]));
    assert_eq!(code, 0, "{errors}");
    let job: Value = serde_json::from_slice(&std::fs::read(dir.join("job.json")).unwrap()).unwrap();
    let setups = job["setups"].as_array().unwrap();
    let to_setup = |name: &Value| {
        let setup = setups.iter().find(|setup| setup["name"] == *name).unwrap();
        let turn = &setup["work_from_part"];
        let axis = Unit::new_normalize(vector(&turn["rotation_axis"]));
        Rotation3::from_axis_angle(&axis, turn["rotation_deg"].as_f64().unwrap().to_radians())
    };
    let finishes: Vec<(&Value, Vec<Rotation3<f64>>)> = job["operations"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|operation| operation.get("layers").is_none())
        .map(|operation| {
            let pattern = &operation["pattern"];
            let step = pattern["index_angle_deg"].as_f64().unwrap().to_radians();
            let turn = |k: u64| Rotation3::from_axis_angle(&Vector3::z_axis(), -(k as f64) * step);
            let setup = to_setup(&operation["setup"]);
            (operation, (0..pattern["copies"].as_u64().unwrap()).map(|k| turn(k) * setup).collect())
        })
        .collect();
    let (mut wetted, mut outside) = (0.0, 0.0);
    for (group, triangles) in groups_of(&dir.join("propeller.glb")) {
        // Each blade is as the first one; ends and bore of the hub are turned.
        let weight = match &*group {
            "hub/cylinder" => 1.0,
            _ if group.starts_with("blade-1/") => 3.0,
            _ => continue,
        };
        for [a, b, c] in triangles {
            let twice = (b - a).cross(&(c - a));
            let area = 0.5 * weight * twice.norm();
            let Some(normal) = twice.try_normalize(0.0) else { continue };
            let is_out = |place: &&[f64; 3]| {
                let p = Point3::from(a.coords * place[0] + b.coords * place[1] + c.coords * place[2]);
                let on = |(operation, turns): &(&Value, Vec<Rotation3<f64>>)| {
                    // Only the hub is in more than the first place of a pattern.
                    let n = if group == "hub/cylinder" { turns.len() } else { 1 };
                    turns[..n].iter().any(|turn| is_in(operation, &group, &(turn * p), &(turn * normal)))
                };
                !finishes.iter().any(on)
            };
            wetted += area;
            outside += area * PLACES.iter().filter(is_out).count() as f64 / PLACES.len() as f64;
        }
    }
    assert!((1.1e6..1.2e6).contains(&wetted), "{wetted} mm2");
    assert!(outside < 0.0003 * wetted, "{outside} of {wetted} mm2 in no operation");
}
