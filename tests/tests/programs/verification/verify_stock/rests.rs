//! A rest belongs to the stock that it was cut from.

use std::path::Path;

use facemill::z_map::DexelMap;
use facemill::{Job, read_rest};
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

use super::{plate, program, verified};

/// Reads the file as a rest of a setup of the job.
fn read(job: &JobFolder, setup: usize, file: &Path) -> Result<DexelMap, String> {
    read_rest(&Job::read(&job.job()).unwrap(), setup, file).map_err(|e| e.to_string())
}

#[test]
fn a_rest_of_other_stock_is_refused_and_one_of_another_setup_is_taken() {
    let job = plate();
    let rest = verified(&job, &program(0, 0.0), 2.0, None).unwrap().rest.unwrap();
    let file = job.path("left.stock");
    std::fs::write(&file, rest.to_bytes()).unwrap();
    assert!(read(&job, 0, &file).unwrap() == rest);

    // Another setup of the same job: in the same frame, mounted elsewhere; in another frame; with
    // other stock.
    let setup = job.json("job.json")["setups"][0].clone();
    let with = |name: &str, changes: &[(&str, Value)]| {
        let mut setup = setup.clone();
        setup["name"] = json!(name);
        for (at, value) in changes {
            *setup.pointer_mut(at).unwrap_or_else(|| panic!("no {at}")) = value.clone();
        }
        setup
    };
    let setups = json!([
        setup.clone(),
        with("turned", &[("/table_from_work/translation_mm", json!([10, 0, 300]))]),
        with("thicker", &[("/stock/offset/allowance_mm", json!(0.75))]),
    ]);
    let operation = job.json("job.json")["operations"][0].clone();
    let of_setup = |setup: &Value| {
        let mut operation = operation.clone();
        (operation["setup"], operation["name"]) = (setup["name"].clone(), setup["name"].clone());
        operation
    };
    let operations: Vec<Value> = setups.as_array().unwrap().iter().map(of_setup).collect();
    job.set("job.json", &[("/setups", setups), ("/operations", json!(operations))]);
    assert!(read(&job, 1, &file).unwrap() == rest);
    let why = read(&job, 2, &file).unwrap_err();
    for part in ["left.stock", "thicker", "allowance of 0.5 mm", "0.75 mm", "--stock-cell-mm"] {
        assert!(why.contains(part), "{part}: {why}");
    }

    // Another part, which is 1 mm lower.
    let obj = std::fs::read_to_string(job.path("plate.obj")).unwrap();
    job.write("plate.obj", obj.replace(" -6\n", " -7\n").as_bytes());
    let why = read(&job, 0, &file).unwrap_err();
    assert!(why.contains("-6.000") && why.contains("-7.000"), "{why}");
}

#[test]
fn a_rest_that_says_nothing_of_its_stock_or_is_damaged_is_refused() {
    let job = plate();
    let rest = verified(&job, &program(0, 0.0), 2.0, None).unwrap().rest.unwrap();
    let file = job.path("left.stock");
    let refused = |bytes: &[u8]| {
        std::fs::write(&file, bytes).unwrap();
        read(&job, 0, &file).unwrap_err()
    };
    let why = refused(&rest.clone().with_origin(Vec::new()).to_bytes());
    assert!(why.contains("left.stock") && why.contains("--rest-out"), "{why}");
    let mut bytes = rest.to_bytes();
    bytes[130] ^= 1;
    let why = refused(&bytes);
    assert!(why.contains("left.stock") && why.contains("damaged"), "{why}");
}
