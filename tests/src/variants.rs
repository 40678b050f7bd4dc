//! Variants of a small job, planned by the command, with everything that is read back from what it
//! wrote.

use std::sync::OnceLock;

use serde_json::{Value, json};

use facemill::new_job::NewJob;
use facemill::sample_parts::{PatchSpec, patch};
use facemill::surface_model::{NamedNode, write_obj};
use nalgebra::Isometry3;

use crate::jobs::JobFolder;
use crate::oracles::interpreter::{self, Motion};
use crate::oracles::read_back::{ReadBack, TipAndAxis, apt_feeds, number};
use crate::program::{code_and_errors, faults, run};

/// A wavy patch of 80 mm, six passes along x about its middle, a face mill of 8 mm. The tilt is so
/// large that the tool is never upright, where the machine is singular.
///
/// # Panics
/// When it cannot be written.
pub fn tiny_patch() -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 80.0 });
    // The example's surface with a quarter of its facets: distances by brute force are what takes
    // time here.
    write_patch(&job, 60);
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set(
        "job.json",
        &[
            ("/operations/0/tolerances/max_step_mm", json!(3.0)),
            ("/operations/0/search/tilt_deg", json!([14.0, 20.0])),
            ("/operations/0/search/rotate_deg", json!([0.0, 40.0])),
            ("/operations/0/feeds/approach_mm_min", json!(APPROACH)),
            ("/operations/0/path/strategy/edge_fill", json!(false)),
            (&format!("{planes}/from_mm"), json!(-4.0)),
            (&format!("{planes}/to_mm"), json!(4.0)),
        ],
    );
    job
}

/// Writes the surface of [`tiny_patch`], `quads` along each side.
///
/// # Panics
/// When it cannot be written.
pub fn write_patch(job: &JobFolder, quads: usize) {
    let spec = PatchSpec::new([80.0, 80.0], 1.6, [1.2, 1.0]).expect("numbers in range");
    let mesh = patch(&spec, quads, quads).expect("numbers in range");
    let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
    job.write("patch.obj", &write_obj(&[&mesh], &nodes).expect("a mesh"));
}

/// [`tiny_patch`] with values of its job file set.
///
/// # Panics
/// When it cannot be written.
pub fn variant(values: &[(&str, Value)]) -> JobFolder {
    let job = tiny_patch();
    job.set("job.json", values);
    job
}

/// [`tiny_patch`] with one or two passes of few points over few facets: planned in a blink.
///
/// # Panics
/// When it cannot be written.
pub fn blink_patch() -> JobFolder {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = variant(&[
        (&format!("{planes}/from_mm"), json!(0.0)),
        (&format!("{planes}/to_mm"), json!(1.0)),
        ("/operations/0/tolerances/max_step_mm", json!(8.0)),
    ]);
    write_patch(&job, 30);
    job
}

/// Tip feed of the example's cuts, mm/min.
pub const CUTTING: f64 = 1200.0;

/// Tip feed of the example's entries and exits, mm/min: slower than its cuts, so that it is theirs
/// in the stock, too.
pub const APPROACH: f64 = 1000.0;

/// Largest distance of a place of `a` from the nearest of `b`: of tips, and of the rims of a cutter
/// of this radius.
pub fn strays(a: &[TipAndAxis], b: &[TipAndAxis], radius: f64) -> f64 {
    let apart =
        |p: &TipAndAxis, q: &TipAndAxis| (p.0 - q.0).norm() + radius * (p.1.into_inner() - q.1.into_inner()).norm();
    a.iter().map(|p| b.iter().map(|q| apart(p, q)).fold(f64::INFINITY, f64::min)).fold(0.0, f64::max)
}

/// Gives the job's tool so long a cutting edge that it cuts from the top of a solid stock, and to
/// its centre.
///
/// # Panics
/// When the tool file cannot be read or written.
pub fn with_long_flute(job: &JobFolder, flute: f64) {
    let tool = job.json("tool.json");
    let radius = number(&tool["radius_mm"]);
    let holder = tool["holder"]["sections"].as_array().expect("sections");
    let holder: f64 = holder.iter().map(|s| number(&s["length_mm"])).sum();
    let neck = json!([{ "length_mm": 8.0, "diameter_low_mm": 1.5 * radius, "diameter_high_mm": 1.5 * radius }]);
    job.set(
        "tool.json",
        &[
            ("/flute_length_mm", json!(flute)),
            ("/dead_core_radius_mm", json!(0.0)),
            ("/max_ramp_angle_deg", json!(90.0)),
            ("/stick_out_mm", json!(flute + 8.0)),
            ("/gauge_length_mm", json!(flute + 8.0 + holder)),
            ("/body", json!({ "clearance_mm": 0.1, "sections": neck })),
        ],
    );
}

/// A box as OBJ.
pub fn box_obj(low: [f64; 3], high: [f64; 3]) -> String {
    let mut text = String::from("o box\n");
    for k in 0..8 {
        let at = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        text += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    // Counter-clockwise from outside.
    for face in ["1 5 7 3", "2 4 8 6", "1 2 6 5", "3 7 8 4", "1 3 4 2", "5 6 8 7"] {
        text += &format!("f {face}\n");
    }
    text
}

/// Files of a plan for one setup.
pub struct Written {
    /// Report.
    pub report: Value,
    /// NC text.
    pub nc: String,
    /// APT text.
    pub apt: String,
    /// The motions of the NC text.
    pub motions: Vec<Motion>,
    /// Of each motion the tip feed by the APT file, `None` for rapids.
    pub feeds: Vec<Option<f64>>,
    /// Independent reading of the program.
    pub back: ReadBack,
}

/// Runs `facemill plan` into `out` beside the job, which must end with exit code 0.
///
/// # Panics
/// When it does not.
pub fn plan(job: &JobFolder) {
    let (file, out) = (job.job(), job.path("out"));
    let output = run(&["plan".as_ref(), file.as_os_str(), "--out".as_ref(), out.as_os_str()]);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 0, "{errors}{}", String::from_utf8_lossy(&output.stdout));
}

/// Plans a job of one setup; see [`written`].
pub fn planned(job: &JobFolder) -> Written {
    plan(job);
    written(job, 0, "")
}

/// [`tiny_patch`] planned, once for all tests of an executable.
///
/// # Panics
/// As [`planned`].
pub fn tiny_patch_planned() -> &'static Written {
    static WRITTEN: OnceLock<Written> = OnceLock::new();
    WRITTEN.get_or_init(|| planned(&tiny_patch()))
}

/// Returns the files of a setup, `suffix` behind their names; the program must be verified and
/// without faults.
///
/// # Panics
/// When it is not, or files are missing.
pub fn written(job: &JobFolder, setup: usize, suffix: &str) -> Written {
    let text = |name: String| {
        let path = job.path("out").join(&name);
        std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let report: Value = serde_json::from_str(&text(format!("report{suffix}.json"))).expect("JSON");
    assert_eq!(report["verified"], true);
    let nc = text(format!("program{suffix}.nc"));
    let apt = text(format!("program{suffix}.apt"));
    let (motions, feeds) = (interpreter::run(&nc), apt_feeds(&apt));
    assert_eq!(motions.len(), feeds.len(), "motions and APT points");
    assert!(motions.iter().zip(&feeds).all(|(m, f)| m.rapid == f.is_none()), "rapids of NC and APT differ");
    let written = Written { report, nc, apt, motions, feeds, back: ReadBack::of(job, setup) };
    assert_eq!(written.faults(), 0, "{}", written.report["findings"]);
    written
}

impl Written {
    /// Number of findings that are faults.
    pub fn faults(&self) -> usize {
        faults(&self.report).len()
    }

    /// A number of the report's totals.
    ///
    /// # Panics
    /// When there is none.
    pub fn total(&self, key: &str) -> f64 {
        number(&self.report["totals"][key])
    }

    /// Motions with this tip feed and the places where they end.
    pub fn with_feed(&self, feed: f64) -> Vec<(&Motion, TipAndAxis)> {
        let wanted = self.motions.iter().zip(&self.feeds).filter(|(_, f)| **f == Some(feed));
        wanted.map(|(m, _)| (m, self.back.end(m))).collect()
    }

    /// Index of the operation a line belongs to, by the operations' comments.
    ///
    /// # Panics
    /// When the line precedes all of them.
    pub fn operation_of(&self, line: usize) -> usize {
        let budgets = self.report["budgets"].as_array().expect("budgets");
        let names: Vec<String> =
            budgets.iter().map(|b| format!("({})", b["operation"].as_str().unwrap_or("?").to_uppercase())).collect();
        let before = self.nc.lines().take(line).filter_map(|l| names.iter().position(|n| n == l));
        before.last().unwrap_or_else(|| panic!("line {line} belongs to no operation of {names:?}"))
    }

    /// Holds the program to what every clean program is held to: the cutter nowhere deeper than the
    /// budget of its operation, but deep enough somewhere to cut; bodies as far from everything as
    /// their clearances want, up to 0.1 mm between planned points; rapids with the whole tool away
    /// from part, stock and fixtures; and the report not better than the truth.
    ///
    /// # Panics
    /// When it does not hold.
    pub fn check(&self) {
        let mut deepest = f64::NEG_INFINITY;
        for m in &self.motions {
            let budget = number(&self.report["budgets"][self.operation_of(m.line)]["against_mesh_mm"]);
            for place in self.back.places(m, 1.0) {
                let depth = self.back.depth(&place);
                assert!(depth <= budget, "line {}: {depth} mm deep, budget {budget}", m.line);
                deepest = f64::max(deepest, depth);
                let room = self.back.room(&place, 0.0);
                assert!(room >= -0.1, "line {}: a body {} mm too near", m.line, -room);
            }
        }
        assert!(deepest > 0.0, "the cutter touches nothing");
        let reported = self.report["worst"]["gouge_mm"].as_f64().unwrap_or(0.0);
        // The virtual machine looks every half millimetre; between, an edge may be as deep as the
        // rim's arc over it.
        let between = 0.5 * 0.5 / (8.0 * self.back.cutter.radius);
        assert!(reported >= deepest - between, "report {reported}, by brute force {deepest}");
        self.check_rapids();
    }

    /// Rapids keep the rapid clearance, up to what their path may leave the straight way.
    fn check_rapids(&self) {
        let clearance = self.back.rapid_clearance;
        for m in self.motions.iter().filter(|m| m.rapid) {
            for place in self.back.places(m, 1.0) {
                let d = self.back.distance(&place, clearance);
                assert!(d >= 0.9 * clearance, "line {}: {d} mm in a rapid that keeps {clearance}", m.line);
            }
        }
    }
}
