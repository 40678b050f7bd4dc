//! With any job, `facemill plan` ends: with files, or with a message and the exit code of bad
//! input. No panic, no signal, no hang, no failure that it calls its own.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use facemill_test_kit::Random;
use facemill_tests::jobs::{JobFolder, copy_of};
use facemill_tests::program::facemill;
use facemill_tests::variants::blink_patch;
use serde_json::{Value, json};

/// How long a plan of a job of a few points may take, s.
const LIMIT: f64 = 60.0;

/// Exit code and standard error of a plan; `Err` says how else it ended.
fn plan(job: &JobFolder) -> Result<(i32, String), String> {
    let errors = job.path("errors.txt");
    let mut child = Command::new(facemill())
        .args(["plan".as_ref(), job.job().as_os_str(), "--out".as_ref(), job.path("out").as_os_str()])
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&errors).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            let said = String::from_utf8_lossy(&std::fs::read(&errors).unwrap()).into_owned();
            return status.code().map(|code| (code, said)).ok_or_else(|| format!("killed: {status}"));
        }
        if start.elapsed().as_secs_f64() > LIMIT {
            child.kill().unwrap();
            child.wait().unwrap();
            return Err(format!("not done after {LIMIT} s"));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Why a plan ended as it must not; `None` where all is well.
fn fault(ended: &Result<(i32, String), String>) -> Option<String> {
    match ended {
        Err(how) => Some(how.clone()),
        Ok((0, _)) => None,
        // Bad input and jobs that cannot be done have messages.
        Ok((1 | 2, said)) if !said.contains("panicked") => None,
        Ok((code, said)) => Some(format!("exit {code}: {said}")),
    }
}

/// Change with its place (file and pointer), new value, and a word that the message must hold.
type Nasty = (&'static str, &'static [(&'static str, &'static str)], fn() -> Value, &'static str);

const NASTY: &[Nasty] = &[
    (
        "a clearance plane beyond all machines",
        &[("job.json", "/setups/0/clearance/plane/origin_mm")],
        || json!([0.0, 0.0, 1e300]),
        "clearance",
    ),
    (
        "a clearance plane below the part",
        &[("job.json", "/setups/0/clearance/plane/origin_mm")],
        || json!([0.0, 0.0, -50.0]),
        "clearance",
    ),
    (
        "a clearance sphere in the part",
        &[("job.json", "/setups/0/clearance")],
        || json!({ "sphere": { "radius_mm": 10.0 } }),
        "clearance",
    ),
    ("a lift without end", &[("job.json", "/operations/0/tolerances/max_lift_mm")], || json!(1e300), "max_lift_mm"),
    ("a feed like light", &[("job.json", "/operations/0/feeds/cutting_mm_min")], || json!(1e300), "cutting_mm_min"),
    ("a feed like rock", &[("job.json", "/operations/0/feeds/cutting_mm_min")], || json!(1e-9), "cutting_mm_min"),
    (
        "an approach like light",
        &[("job.json", "/operations/0/feeds/approach_mm_min")],
        || json!(1e300),
        "approach_mm_min",
    ),
    (
        "an approach like rock",
        &[("job.json", "/operations/0/feeds/approach_mm_min")],
        || json!(1e-9),
        "approach_mm_min",
    ),
    ("a spindle of stars", &[("job.json", "/operations/0/feeds/spindle_rpm")], || json!(1e12), "spindle_rpm"),
    (
        "a stock a kilometre away",
        &[("job.json", "/setups/0/stock")],
        || json!({ "box": { "min_mm": [1e6, 1e6, 0.0], "max_mm": [1.0001e6, 1.0001e6, 10.0] } }),
        "stock",
    ),
];

#[test]
fn numbers_that_cannot_be_meant_are_exit_2_and_named() {
    let good = blink_patch();
    assert_eq!(plan(&good).map(|e| e.0), Ok(0));
    let folder = good.path("");
    let mut failures = Vec::new();
    for (name, places, value, word) in NASTY {
        let job = copy_of(&folder);
        for (file, pointer) in *places {
            job.set(file, &[(pointer, value())]);
        }
        failures.extend(not_refused(name, &job, &[word]));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Returns the fault if a job is not refused with all these words.
fn not_refused(name: &str, job: &JobFolder, words: &[&str]) -> Option<String> {
    let ended = plan(job);
    match &ended {
        Ok((2, said)) => {
            let missing: Vec<&&str> = words.iter().filter(|w| !said.contains(**w)).collect();
            let written = job.path("out").exists();
            (!missing.is_empty() || written).then(|| format!("{name}: without {missing:?}, written {written}: {said}"))
        }
        other => Some(format!("{name}: {other:?}")),
    }
}

#[test]
fn setups_whose_files_would_be_the_same_are_refused() {
    let job = blink_patch();
    let file = job.json("job.json");
    let (mut setups, mut operations) = (Vec::new(), Vec::new());
    for name in ["top side", "top/side"] {
        let (mut setup, mut operation) = (file["setups"][0].clone(), file["operations"][0].clone());
        setup["name"] = json!(name);
        operation["setup"] = json!(name);
        setups.push(setup);
        operations.push(operation);
    }
    job.set("job.json", &[("/setups", json!(setups)), ("/operations", json!(operations))]);
    let failure = not_refused("two setups", &job, &["job.json", "setups", "top side", "top/side"]);
    assert!(failure.is_none(), "{failure:?}");
}

/// Pointers to all numbers of a file, and to the objects and lists they are in.
fn places(value: &Value, at: &str, numbers: &mut Vec<String>, groups: &mut Vec<String>) {
    let mut below = |key: String, v: &Value| places(v, &format!("{at}/{key}"), numbers, groups);
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| below(k.clone(), v)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, v)| below(k.to_string(), v)),
        Value::Number(_) => numbers.push(at.to_owned()),
        _ => {}
    }
    if !at.is_empty() && (value.is_object() || value.is_array()) {
        groups.push(at.to_owned());
    }
}

/// A number in place of another: odd ones, and ones that might be meant.
fn odd_number(old: f64, random: &mut Random) -> Value {
    let odd = [0.0, -old, old * 1e3, old * 1e-3, 1e300, -1e300, 1e-300, 1e9, 1e-9, 90.0, 180.0, 0.5 * old];
    json!(odd[random.below(odd.len())])
}

/// A list or object that lost an entry, got one twice, or became something else.
fn odd_group(old: &Value, random: &mut Random) -> Value {
    match (random.below(3), old) {
        (0, Value::Array(list)) => json!(list.iter().chain(list.last()).collect::<Vec<_>>()),
        (1, Value::Array(list)) => json!(list[..list.len().saturating_sub(1)]),
        (0 | 1, Value::Object(map)) => {
            let mut map = map.clone();
            let key = map.keys().nth(random.below(map.len().max(1))).cloned();
            key.map(|k| map.remove(&k));
            Value::Object(map)
        }
        _ => [json!({}), json!([]), json!("flat"), json!(1)][random.below(4)].clone(),
    }
}

fn mutants_end(seed: u64, rounds: usize) {
    let good = blink_patch();
    let folder = good.path("");
    let mut random = Random(seed);
    let (mut failures, mut codes) = (Vec::new(), [0; 3]);
    for round in 0..rounds {
        let job = copy_of(&folder);
        let name = ["job.json", "job.json", "tool.json", "machine.json"][random.below(4)];
        let mut file = job.json(name);
        let (mut numbers, mut groups) = (Vec::new(), Vec::new());
        places(&file, "", &mut numbers, &mut groups);
        let from = if random.below(4) == 0 { &groups } else { &numbers };
        let pointer = from[random.below(from.len())].clone();
        let place = file.pointer_mut(&pointer).unwrap();
        *place = match place.as_f64() {
            Some(old) => odd_number(old, &mut random),
            None => odd_group(place, &mut random),
        };
        let what = format!("seed {seed}, round {round}: {name} {pointer} = {place}");
        job.write(name, file.to_string().as_bytes());
        let ended = plan(&job);
        failures.extend(fault(&ended).map(|why| format!("{what}: {why}")));
        if let Ok((code @ 0..=2, _)) = ended {
            codes[code as usize] += 1;
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    // Some are harmless, some are not.
    assert!(codes[0] > 0 && codes[2] > rounds / 4, "{codes:?}");
}

#[test]
fn mutants_of_a_job_end_well() {
    mutants_end(11, 15);
}

#[test]
#[ignore = "two hundred mutants more: two minutes"]
fn more_mutants_of_a_job_end_well() {
    mutants_end(12, 200);
}
