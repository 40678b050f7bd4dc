//! No input makes the planner panic: seeded mutations of every file of a job, read as `facemill
//! check` reads them.

mod plan_mutants;
mod template_mutants;

use std::panic::{AssertUnwindSafe, catch_unwind};

use facemill::sample_parts::{PatchSpec, patch};
use facemill::surface_model::{NamedNode, TriMesh, write_glb, write_obj, write_stl_binary};
use facemill::{Failure, Job, describe_setup};
use facemill_test_kit::Random;
use facemill_tests::jobs::{JobFolder, small_patch};
use nalgebra::Isometry3;
use serde_json::{Value, json};

/// A job on a mesh so small that reading it is nothing.
fn tiny(mesh_name: &str) -> JobFolder {
    let job = small_patch();
    let mesh: TriMesh = patch(&PatchSpec::new([60.0, 60.0], 1.0, [1.0, 1.0]).unwrap(), 8, 8).unwrap();
    let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
    let bytes = match mesh_name.rsplit('.').next() {
        Some("obj") => write_obj(&[&mesh], &nodes).unwrap(),
        Some("stl") => write_stl_binary(&[&mesh], &nodes).unwrap(),
        Some("glb") => write_glb(&[&mesh], &nodes).unwrap(),
        other => panic!("{other:?}"),
    };
    job.write(mesh_name, &bytes);
    job.set(
        "job.json",
        &[
            ("/setups/0/meshes/0/file", json!(mesh_name)),
            // As the format has them.
            ("/setups/0/meshes/0/unit", Value::Null),
            ("/setups/0/meshes/0/up_axis", Value::Null),
            // A vertex that flies away must not make passes of kilometres.
            ("/operations/0/path/strategy/region", json!({"box": {"min_mm": [-90, -90, -90], "max_mm": [90, 90, 90]}})),
            ("/operations/0/tolerances/max_step_over_mm", json!(20.0)),
            ("/operations/0/tolerances/cusp_mm", json!(1.0)),
        ],
    );
    job
}

/// Reads and describes; `Err` where it was refused.
fn check(job: &JobFolder) -> Result<(), Failure> {
    let read = Job::read(&job.job())?;
    (0..read.file.setups.len()).try_for_each(|k| describe_setup(&read, k).map(drop))
}

/// Runs the check and fails the test where it panics.
fn must_not_panic(job: &JobFolder, what: &str) -> bool {
    let start = std::time::Instant::now();
    let accepted =
        catch_unwind(AssertUnwindSafe(|| check(job).is_ok())).unwrap_or_else(|_| panic!("{what} makes it panic"));
    let took = start.elapsed().as_secs_f64();
    if took > 1.0 {
        eprintln!("{what}: {took:.1} s");
    }
    accepted
}

/// Values that numbers are replaced by.
fn odd_values() -> Vec<Value> {
    let mut values: Vec<Value> =
        [0.0, -0.0, -1.0, 1e-300, -1e-9, 1e300, 180.0, 1e9].into_iter().map(|v| json!(v)).collect();
    values.extend([
        json!(null),
        json!("x"),
        json!([]),
        json!({}),
        json!(true),
        json!([1.0, 2.0, 3.0]),
        json!(u64::MAX),
    ]);
    values
}

/// Pointers to every value of a JSON file.
fn pointers(value: &Value, at: &str, all: &mut Vec<String>) {
    let mut below = |key: String, v: &Value| {
        let pointer = format!("{at}/{key}");
        all.push(pointer.clone());
        pointers(v, &pointer, all);
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| below(k.clone(), v)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, v)| below(k.to_string(), v)),
        _ => {}
    }
}

#[test]
fn no_value_in_a_json_file_makes_it_panic() {
    let job = tiny("patch.obj");
    check(&job).unwrap_or_else(|e| panic!("{e}"));
    let mut random = Random(2026);
    let odd = odd_values();
    let (mut n, mut refused) = (0, 0);
    for name in ["job.json", "tool.json", "machine.json"] {
        let good = job.json(name);
        let mut all = Vec::new();
        pointers(&good, "", &mut all);
        for pointer in &all {
            for _ in 0..3 {
                let value = odd[random.below(odd.len())].clone();
                let mut file = good.clone();
                *file.pointer_mut(pointer).unwrap() = value.clone();
                job.write(name, file.to_string().as_bytes());
                let accepted = must_not_panic(&job, &format!("{name}: {pointer} = {value}"));
                n += 1;
                refused += usize::from(!accepted);
            }
        }
        job.write(name, facemill::file_format::to_json(&good).as_bytes());
    }
    assert!(n >= 300 && refused > n / 2, "{n} mutants, {refused} refused");
}

/// A few bytes changed, cut out, doubled, or the end lost.
fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len().max(1)).min(bytes.len().saturating_sub(1));
        let to = (at + 1 + random.below(24)).min(bytes.len());
        match random.below(6) {
            0 => bytes[at] = random.bits() as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => drop(bytes.drain(at..to)),
            3 => {
                let piece = bytes[at..to].to_vec();
                bytes.splice(at..at, piece);
            }
            4 => bytes[at] = b"0123456789-.e{}[]\",:\n "[random.below(22)],
            _ => bytes.truncate(at.max(1)),
        }
        if bytes.is_empty() {
            bytes.push(b'x');
        }
    }
    bytes
}

#[test]
fn no_bytes_make_it_panic() {
    let mut random = Random(77);
    let (mut n, mut refused) = (0, 0);
    for mesh in ["patch.obj", "patch.stl", "patch.glb"] {
        let job = tiny(mesh);
        check(&job).unwrap_or_else(|e| panic!("{mesh}: {e}"));
        for name in ["job.json", "tool.json", "machine.json", mesh] {
            let good = std::fs::read(job.path(name)).unwrap();
            let rounds = if name == mesh { 120 } else { 30 };
            for round in 0..rounds {
                let bad = mutate(&good, &mut random);
                job.write(name, &bad);
                let accepted = must_not_panic(&job, &format!("{name}, round {round}"));
                n += 1;
                refused += usize::from(!accepted);
            }
            job.write(name, &good);
        }
    }
    assert!(n >= 300 && refused > n / 4, "{n} mutants, {refused} refused");
}
