//! Golden jobs: small jobs on every control and on machines of every kind, and the checksums of all
//! files that the commands write for them.

use std::path::Path;
use std::process::Command;

use facemill::new_job::NewJob;
use serde_json::json;

use crate::jobs::{JobFolder, unfinished};
use crate::program::{code_and_errors, facemill};
use crate::variants::tiny_patch;

/// A folder with a job, and the commands that run in it, apart by spaces.
struct GoldenJob {
    name: String,
    folder: JobFolder,
    commands: Vec<String>,
}

/// Controls of the golden jobs, and the ending of their programs.
pub const CONTROLS: [(&str, &str); 6] = [
    ("fanuc", "nc"),
    ("haas", "nc"),
    ("mazak", "nc"),
    ("linuxcnc", "ngc"),
    ("siemens_840d", "mpf"),
    ("heidenhain", "h"),
];

/// Machines that get the patch besides the example's own.
const MACHINES: [&str; 3] = ["table-table-a-c", "head-head-c-a", "head-b-nutating-table-c"];

const PLANES: &str = "/operations/0/path/strategy/strategy/parallel_planes";

/// The tiny patch for each control; with certificates and chips, and its program verified, for
/// FANUC.
fn controls() -> impl Iterator<Item = GoldenJob> {
    CONTROLS.into_iter().map(|(control, ending)| {
        let folder = tiny_patch();
        let mode = if control == "linuxcnc" { "g93" } else { "g94" };
        folder.set("job.json", &[("/post/dialect", json!(control)), ("/post/feed_mode", json!(mode)), unfinished()]);
        let program = format!("out/program.{ending}");
        let mut commands = vec!["plan job.json --out out --certificates --chips".to_owned()];
        commands.push(format!("verify {program} --job job.json -o verification.json"));
        if control == "fanuc" {
            commands.push(format!(
                "verify {program} --job job.json --stock-cell-mm 1 --deviation deviation.glb --rest-out rest.stock -o cut.json"
            ));
            commands.push(format!("lengths {program} --job job.json -o lengths.json --tool-out shorter.json"));
        }
        commands.push(format!("rapids {program} --job job.json -o links.nc --report links.json"));
        GoldenJob { name: control.to_owned(), folder, commands }
    })
}

/// A patch on machines of other kinds.
fn machines() -> impl Iterator<Item = GoldenJob> {
    MACHINES.into_iter().map(|machine| {
        let folder = JobFolder::of(&[]);
        let planes = [("from_mm", -4.0), ("to_mm", 4.0)].map(|(key, value)| format!("--set {PLANES}/{key}={value}"));
        let commands = vec![
            format!("new patch job --size-mm 80 --machine {machine}"),
            format!(
                "plan job --out out --certificates {} --set /operations/0/finish/max_above_fraction=1 --set \
                 /operations/0/finish/max_never_cut_fraction=1",
                planes.join(" ")
            ),
        ];
        GoldenJob { name: machine.to_owned(), folder, commands }
    })
}

/// A band of both sides of a blade on the mill with two heads.
///
/// # Panics
/// When it cannot be written.
#[must_use]
pub fn two_heads() -> JobFolder {
    let folder = JobFolder::new(&NewJob::DualPropeller { diameter_mm: 1000.0 });
    for k in 0..2 {
        let sections = format!("/operations/{k}/path/strategy/strategy/cylindrical_sections");
        folder.set(
            "job.json",
            &[
                (&format!("/operations/{k}/pattern"), json!(null)),
                (&format!("{sections}/from_radius_mm"), json!(440.0)),
                (&format!("{sections}/to_radius_mm"), json!(449.0)),
                (&format!("/operations/{k}/tolerances/max_step_mm"), json!(12.0)),
                (&format!("/operations/{k}/tolerances/path_chord_mm"), json!(0.1)),
                (&format!("/operations/{k}/finish"), unfinished().1),
            ],
        );
    }
    folder
}

fn two_heads_planned() -> GoldenJob {
    let folder = two_heads();
    let commands = vec![
        "plan job.json --out out --certificates".to_owned(),
        "verify out/program.nc --job job.json -o verification.json".to_owned(),
    ];
    GoldenJob { name: "two_heads".to_owned(), folder, commands }
}

/// New feeds for a foreign program, with the time law and without.
fn feeds() -> GoldenJob {
    let folder = JobFolder::of(&[]);
    folder.write("machine.json", facemill::inverse_kinematics::preset_head_b_table_c().as_bytes());
    let place = |k: u32| {
        let s = f64::from(k);
        let (b, c) = (-10.0 + 8.0 * (0.05 * s).sin(), 20.0 + 15.0 * (0.03 * s).cos());
        format!("G1 X{:.3} Y{:.3} Z150. B{b:.4} C{c:.4}\n", 2.0 * s, 20.0 * (0.1 * s).sin())
    };
    let text: String = (0..120).map(place).collect();
    folder.write("table.nc", format!("%\nO1 (FEEDS)\nG21 G90 G94 G54\nG43 H1\nF1000.\n{text}M30\n%\n").as_bytes());
    let common = "feedrate table.nc --machine machine.json --tool-length-mm 100 --tip-feed 1000";
    let commands = vec![format!("{common} -o feeds.nc"), format!("{common} --time-law -o law.nc")];
    GoldenJob { name: "feedrate".to_owned(), folder, commands }
}

/// Checksum and name of every file that the golden jobs end with, in order of names; the folder
/// `keep` gets the files.
///
/// # Panics
/// When a command cannot be started, or ends with an exit code that means no result.
#[must_use]
pub fn golden_bytes(keep: Option<&Path>) -> Vec<String> {
    let jobs = controls().chain(machines()).chain([two_heads_planned(), feeds()]);
    let mut lines = Vec::new();
    for job in jobs {
        for command in &job.commands {
            let mut facemill = Command::new(facemill());
            let output = facemill.args(command.split(' ')).current_dir(job.folder.path("")).output();
            let (code, errors) = code_and_errors(&output.expect("facemill starts"));
            assert!([0, 1].contains(&code), "{}: {command}: exit code {code}: {errors}", job.name);
        }
        let root = job.folder.path("");
        let mut files = Vec::new();
        files_below(&root, &mut files);
        for file in files {
            let name = file.strip_prefix(&root).expect("a file of the folder");
            // Times by the clock are of the machine, not of the job.
            if name.ends_with("timings.json") {
                continue;
            }
            // A page is made from the files compared, with maps that it alone shows: a change of
            // them is none of a plan.
            let is_for_pages = name.file_name().is_some_and(|n| n.to_string_lossy().starts_with("postures"));
            if is_for_pages || name.extension().is_some_and(|e| e == "html") {
                continue;
            }
            let bytes = std::fs::read(&file).expect("a file");
            lines.push(format!("{}  {}/{}", blake3::hash(&bytes).to_hex(), job.name, name.display()));
            if let Some(keep) = keep {
                let copy = keep.join(&job.name).join(name);
                std::fs::create_dir_all(copy.parent().expect("a folder")).expect("a folder");
                std::fs::write(copy, bytes).expect("a copy");
            }
        }
    }
    lines.sort_by(|a, b| a[64..].cmp(&b[64..]));
    lines
}

fn files_below(folder: &Path, files: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files_below(&path, files);
        } else {
            files.push(path);
        }
    }
}
