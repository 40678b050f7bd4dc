//! Small jobs in temporary folders, and ways to change and plan them.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use facemill::job_file::JobFile;
use facemill::new_job::{NewJob, Series, new_job, propeller_glb};
use facemill::sample_parts::{BladeResolution, PropellerSeries, PropellerSpec};
use facemill::{Failure, Job, PlanSettings, Planned, SilentStages, plan_setup};
use serde_json::{Value, json};

/// A job in a folder that goes when this goes.
pub struct JobFolder {
    folder: tempfile::TempDir,
}

impl JobFolder {
    /// The folder of an example job.
    ///
    /// # Panics
    /// When the example does not exist or cannot be written.
    pub fn new(job: &NewJob) -> Self {
        Self::of(&new_job(job).expect("an example"))
    }

    /// A folder with these files.
    ///
    /// # Panics
    /// When they cannot be written.
    pub fn of(files: &[(String, Vec<u8>)]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, bytes) in files {
            std::fs::write(folder.path().join(name), bytes).expect("a file in it");
        }
        Self { folder }
    }

    /// A file of the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The job file.
    pub fn job(&self) -> PathBuf {
        self.path("job.json")
    }

    /// A JSON file of the folder.
    ///
    /// # Panics
    /// When it is none.
    pub fn json(&self, name: &str) -> Value {
        let bytes = std::fs::read(self.path(name)).expect("a file");
        serde_json::from_slice(&bytes).expect("JSON")
    }

    /// Sets values of a JSON file by pointer; what is missing on the way is made, `null` removes.
    ///
    /// # Panics
    /// When the way leads through something that is no object or list.
    pub fn set(&self, name: &str, values: &[(&str, Value)]) -> &Self {
        let mut file = self.json(name);
        for (pointer, value) in values {
            set(&mut file, pointer, value.clone());
        }
        self.write(name, facemill::file_format::to_json(&file).as_bytes())
    }

    /// Writes a file of the folder.
    ///
    /// # Panics
    /// When it cannot.
    pub fn write(&self, name: &str, bytes: &[u8]) -> &Self {
        std::fs::write(self.path(name), bytes).expect("a file that can be written");
        self
    }

    /// Plans the job's first setup.
    ///
    /// # Errors
    /// As [`plan_setup`].
    pub fn try_plan(&self) -> Result<Planned, Failure> {
        plan_setup(&Job::read(&self.job())?, 0, PlanSettings { verify: true, certificates: false }, &SilentStages)
    }

    /// Plans the job's first setup.
    ///
    /// # Panics
    /// When it cannot be planned.
    pub fn plan(&self) -> Planned {
        self.try_plan().unwrap_or_else(|e| panic!("{e}"))
    }

    /// The job file as it is typed.
    ///
    /// # Panics
    /// When it is none.
    pub fn file(&self) -> JobFile {
        let bytes = std::fs::read(self.job()).expect("a job");
        facemill::file_format::from_json(&bytes).expect("a job file")
    }
}

/// Sets a value by JSON pointer; `null` removes.
///
/// # Panics
/// When the way leads through something that is no object or list.
pub fn set(file: &mut Value, pointer: &str, value: Value) {
    let mut at = file;
    let keys: Vec<&str> = pointer.trim_start_matches('/').split('/').collect();
    let (last, way) = keys.split_last().expect("a key");
    for key in way {
        at = match at {
            Value::Object(map) => map.entry((*key).to_owned()).or_insert_with(|| json!({})),
            Value::Array(list) => &mut list[key.parse::<usize>().expect("an index")],
            _ => panic!("{pointer}: nothing below {key}"),
        };
    }
    match at {
        Value::Object(map) if value.is_null() => drop(map.remove(*last)),
        Value::Object(map) => drop(map.insert((*last).to_owned(), value)),
        Value::Array(list) => list[last.parse::<usize>().expect("an index")] = value,
        _ => panic!("{pointer}: no object"),
    }
}

/// Text of a file of a plan.
///
/// # Panics
/// When there is none.
pub fn text_of(planned: &Planned, name: &str) -> String {
    let file = planned.files.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}"));
    String::from_utf8(file.1.clone()).expect("text")
}

/// Writes the mesh of a DTMB 4119 job with a third of the example's facets: for short plans that
/// take longer to read the mesh than to cut it.
///
/// # Panics
/// When it cannot be written.
pub fn write_coarse_propeller(job: &JobFolder, diameter: f64) {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, diameter).expect("a propeller");
    let resolution = BladeResolution::new(96, 72).expect("in range");
    let (mesh, _) = propeller_glb(&spec, resolution).expect("a mesh");
    job.write("propeller.glb", &mesh);
}

/// A DTMB 4119 of 400 mm with few CC points on narrow bands of its blades and a holder slim enough
/// for it.
///
/// # Panics
/// When it cannot be written.
pub fn small_propeller() -> JobFolder {
    let job = JobFolder::new(&NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 400.0 });
    write_coarse_propeller(&job, 400.0);
    job.set(
        "job.json",
        &[
            ("/operations/0/tolerances/max_step_mm", json!(4.0)),
            ("/operations/0/tolerances/max_lift_mm", json!(0.06)),
            ("/operations/0/search/mode", json!("smallest")),
            ("/operations/0/entry", json!({ "tangential_arc": { "radius_mm": 125.0, "angle_deg": 8.0 } })),
            ("/operations/0/exit", json!({ "tangential_arc": { "radius_mm": 125.0, "angle_deg": 8.0 } })),
            ("/operations/0/path/strategy/edge_fill", json!(false)),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/from_radius_mm", json!(140.0)),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/to_radius_mm", json!(150.0)),
        ],
    );
    // The example's arbor, longer: the head stays above the neighbouring blade.
    let tool = job.json("tool.json");
    let arbor = tool["holder"]["sections"][0]["length_mm"].as_f64().expect("a length");
    let gauge = tool["gauge_length_mm"].as_f64().expect("a length");
    job.set(
        "tool.json",
        &[
            ("/holder/sections/0/length_mm", json!(arbor + 120.0)),
            ("/gauge_length_mm", json!(gauge + 120.0)),
            ("/holder/sections/0/diameter_high_mm", json!(16.0)),
            ("/holder/sections/1/diameter_low_mm", json!(40.0)),
            ("/holder/sections/1/diameter_high_mm", json!(40.0)),
        ],
    );
    job
}

/// The value of a job file that lets its operation leave as much as it likes: for plans that cut
/// but a part of what they ask for.
pub fn unfinished() -> (&'static str, Value) {
    ("/operations/0/finish", json!({ "max_above_fraction": 1.0, "max_never_cut_fraction": 1.0 }))
}

/// A wavy patch of 200 mm with few CC points: passes over a band along its middle. The tilt is so
/// large that the tool is never upright, where the machine is singular.
///
/// # Panics
/// When it cannot be written.
pub fn small_patch() -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 200.0 });
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set(
        "job.json",
        &[
            (&format!("{planes}/from_mm"), json!(-24.0)),
            (&format!("{planes}/to_mm"), json!(24.0)),
            ("/operations/0/tolerances/max_step_mm", json!(4.0)),
            ("/operations/0/search/tilt_deg", json!([14.0, 20.0])),
            ("/operations/0/search/rotate_deg", json!([0.0, 40.0])),
        ],
    );
    job
}

/// [`small_patch`] planned, once for all tests of an executable.
///
/// # Panics
/// When it cannot be planned.
pub fn small_patch_planned() -> &'static Planned {
    static PLANNED: OnceLock<Planned> = OnceLock::new();
    PLANNED.get_or_init(|| small_patch().plan())
}

/// A copy of a folder of files.
///
/// # Panics
/// When it cannot be read or written.
pub fn copy_of(folder: &Path) -> JobFolder {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let files: Vec<(String, Vec<u8>)> = entries
        .map(|e| e.expect("an entry").path())
        .filter(|p| p.is_file())
        .map(|p| {
            let name = p.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read(&p).expect("a file"))
        })
        .collect();
    JobFolder::of(&files)
}
