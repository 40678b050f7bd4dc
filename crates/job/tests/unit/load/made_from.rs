use serde_json::json;

use super::*;
use crate::examples::new_job::{NewJob, new_job};
use crate::load::job::Setup;
use crate::load::job_source::read_job_file;

const TRIANGLE: [[f32; 3]; 3] = [[-30.0, -30.0, 0.0], [30.0, -30.0, 0.0], [0.0, 30.0, 0.0]];

/// A triangle in mm whose buffer is in a file of this address.
fn gltf(address: &str) -> Vec<u8> {
    let file = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "buffers": [{ "uri": address, "byteLength": 36 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [-30, -30, 0], "max": [30, 30, 0] }],
    });
    file.to_string().into_bytes()
}

/// The same in a container, without a chunk of its own for buffers.
fn glb(address: &str) -> Vec<u8> {
    let mut json = gltf(address);
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let chunk = [&word(json.len())[..], b"JSON", &json].concat();
    [b"glTF", &word(2)[..], &word(12 + chunk.len()), &chunk].concat()
}

/// A folder with an example whose parts and bodies are in files of every kind.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let buffer: Vec<u8> = TRIANGLE.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let mut json = BTreeMap::new();
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 60.0 }).unwrap() {
        write(&name, &bytes);
        if name.ends_with(".json") {
            json.insert(name, serde_json::from_slice::<Value>(&bytes).unwrap());
        }
    }
    write("check.gltf", &gltf("a%20b.bin"));
    write("a b.bin", &buffer);
    write("check.glb", &glb("c.bin"));
    write("c.bin", &buffer);
    let job = json.get_mut("job.json").unwrap();
    let meshes = job["setups"][0]["meshes"].as_array_mut().unwrap();
    for name in ["check.gltf", "check.glb"] {
        meshes.push(json!({ "file": name, "role": "check", "unit": "millimetre", "up_axis": "z" }));
    }
    job["machine"] = json!("machine.mill");
    write("job.json", job.to_string().as_bytes());
    let machine = json.get_mut("machine.json").unwrap();
    let bodies = machine["workpiece_chain"]["rows"][0]["bodies"].as_array_mut().unwrap();
    let mut body = bodies[0].clone();
    (body["name"], body["shape"]) = (json!("hood"), json!({ "mesh": { "file": "hood.obj" } }));
    bodies.push(body);
    write("machine.mill", machine.to_string().as_bytes());
    std::fs::remove_file(folder.path().join("machine.json")).unwrap();
    write("hood.obj", b"v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    folder
}

/// A file that is read after the inputs were listed, and is not among them, is an error.
#[test]
fn inputs_are_all_that_is_read_whatever_the_files_are_called() {
    let folder = folder();
    let path = folder.path().join("job.json");
    let (job, inputs) = Job::read_whole(&path, &[]).unwrap();
    let names: Vec<&str> = inputs.iter().map(|input| input.file.as_str()).collect();
    let all = ["a b.bin", "c.bin", "check.glb", "check.gltf", "hood.obj", "job.json", "machine.mill", "patch.obj"];
    assert_eq!(names, [&all[..], &["tool.json"]].concat());
    let of_report = MadeFrom::of(&Job::read(&path).unwrap()).inputs;
    assert_eq!(of_report, inputs);
    let file = read_job_file(&path, &[]).unwrap();
    assert_eq!(InputChecksums::default().of(&path, &file).unwrap(), inputs);
    drop(folder);
    Setup::read(&job, 0).map(drop).unwrap();
}

#[test]
fn a_file_that_is_not_among_the_inputs_is_not_read() {
    let folder = folder();
    let (mut job, _) = Job::read_whole(&folder.path().join("job.json"), &[]).unwrap();
    std::fs::copy(folder.path().join("patch.obj"), folder.path().join("other.obj")).unwrap();
    job.file.setups[0].meshes[0].file = "other.obj".to_owned();
    let why = Setup::read(&job, 0).map(drop).unwrap_err().to_string();
    assert!(why.contains("other.obj: is not among the inputs"), "{why}");
}

#[test]
fn an_input_that_cannot_be_read_is_named() {
    let folder = folder();
    let path = folder.path().join("job.json");
    for name in ["hood.obj", "c.bin", "patch.obj"] {
        let place = folder.path().join(name);
        let bytes = std::fs::read(&place).unwrap();
        std::fs::remove_file(&place).unwrap();
        let file = read_job_file(&path, &[]).unwrap();
        for failure in [InputChecksums::default().of(&path, &file).map(drop), Job::read_whole(&path, &[]).map(drop)] {
            let why = failure.unwrap_err().to_string();
            assert!(why.contains("cannot read") && why.contains(name), "{why}");
        }
        std::fs::write(place, bytes).unwrap();
    }
}
