//! Setup without a job: part, stock, machine and tool, each named by its own option.

use std::path::{Path, PathBuf};

use facemill_cl_data::Aabb;
use facemill_nc_program::{Dialect, FeedMode};
use facemill_tool_model::{ToolAssembly, ToolFile};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::files;
use crate::format::job_file::{JOB_FORMAT, JobFile, UnitFile, UpAxisFile};
use crate::load::job::Job;
use crate::load::mesh_files::read_mesh;
use crate::validate::check_setups;

/// Depth of the cutter below the part beyond which it is a finding, mm, if no operation of a job
/// sets the limit.
pub const AD_HOC_GOUGE_LIMIT: f64 = 0.02;

/// Setup to run a program on. Paths are those of the caller, not of a job file.
#[derive(Clone, Debug)]
pub struct AdHocSetup {
    /// Mesh file of the part. Its frame is the workpiece frame, also of the stock.
    pub part: PathBuf,
    /// Meshes that nothing may touch, in the same frame.
    pub fixtures: Vec<PathBuf>,
    /// Unit of all mesh files; if not given, as in a job.
    pub unit: Option<UnitFile>,
    /// Their up axis; if not given, as in a job.
    pub up_axis: Option<UpAxisFile>,
    /// Material before the program.
    pub stock: AdHocStock,
    /// Machine file.
    pub machine: PathBuf,
    /// Tool file.
    pub tool: PathBuf,
    /// Register of the control that holds the tool's length; if not given, that of the tool file.
    pub length_register: Option<u32>,
    /// Control that the program is for.
    pub dialect: Dialect,
    /// Dialect file of that control, whose harmless functions count; if not given, the dialect's
    /// own.
    pub dialect_file: Option<PathBuf>,
    /// Position of the workpiece frame on the machine's table, mm along the table's axes.
    pub mount: [f64; 3],
    /// Machine's X, Y and Z at the program's zero, mm.
    pub work_offset: [f64; 3],
    /// Register of the control that holds the work offset.
    pub register: String,
}

/// Material before a program.
///
/// Exhaustive, so that a new one is handled everywhere: each comes from its own source.
#[derive(Clone, Debug, PartialEq)]
pub enum AdHocStock {
    /// The smallest axis-parallel box around the part.
    Box,
    /// The part with a layer of this thickness, mm.
    Offset(f64),
    /// A mesh file.
    Mesh(PathBuf),
}

/// Name that errors use in place of a job file.
const PLACE: &str = "setup without a job";

impl Job {
    /// Returns a job without operations: machine and tool, and a setup with part, fixtures and
    /// stock. Functions that need operations do not work with it: nothing can be planned, and feeds
    /// are not checked.
    ///
    /// # Errors
    /// If a file cannot be read or is wrong, a number is out of its range, or the machine has two
    /// heads.
    pub fn of_ad_hoc_setup(stand: &AdHocSetup) -> Result<Self, Failure> {
        stand.check_numbers().map_err(|e| Failure::input(Path::new(PLACE), e))?;
        let file: JobFile = serde_json::from_value(stand.file()?).map_err(|e| Failure::Internal(e.to_string()))?;
        let at = Path::new(PLACE);
        check_setups(&file).map_err(|e| Failure::input(at, e))?;
        let tool = stand.length_register.map(|register| tool_with(&stand.tool, register)).transpose()?;
        let job = Self::of(at, file)?;
        Ok(Self { tool: tool.unwrap_or_else(|| job.tool.clone()), ..job })
    }
}

/// Returns the tool of a file with its length in this register.
fn tool_with(path: &Path, register: u32) -> Result<ToolAssembly, Failure> {
    let file: ToolFile =
        facemill_file_format::from_json(&files::read_named_text(path)?).map_err(|e| Failure::input(path, e))?;
    let file = ToolFile { length_register: Some(register), ..file };
    ToolAssembly::new(file).map_err(|e| Failure::input(path, e))
}

impl AdHocSetup {
    /// Checks the numbers that JSON cannot express.
    fn check_numbers(&self) -> Result<(), String> {
        let offset = if let AdHocStock::Offset(mm) = self.stock { mm } else { 0.0 };
        let all = [("mount", &self.mount[..]), ("work_offset", &self.work_offset), ("stock offset", &[offset])];
        let wrong = all.iter().find(|(_, numbers)| numbers.iter().any(|v| !v.is_finite()));
        wrong.map_or(Ok(()), |(what, numbers)| Err(format!("{what}: must be finite numbers in mm, is {numbers:?}")))
    }

    /// Returns the equivalent job file.
    fn file(&self) -> Result<Value, Failure> {
        let mesh = |role: &str, file: &Path| -> Result<Value, Failure> {
            Ok(json!({ "file": name(file)?, "role": role, "unit": self.unit, "up_axis": self.up_axis }))
        };
        let fixtures = self.fixtures.iter().map(|file| mesh("fixture", file));
        let meshes: Vec<Value> =
            std::iter::once(mesh("drive", &self.part)).chain(fixtures).collect::<Result<_, _>>()?;
        let offsets: serde_json::Map<String, Value> = ["X", "Y", "Z"]
            .iter()
            .zip(self.work_offset)
            .filter(|(_, value)| *value != 0.0)
            .map(|(letter, value)| ((*letter).to_owned(), json!(value)))
            .collect();
        let part = self.part.file_stem().map_or_else(|| "part".into(), |stem| stem.to_string_lossy());
        Ok(json!({
            "format": JOB_FORMAT,
            "name": part,
            "tool": name(&self.tool)?,
            "machine": name(&self.machine)?,
            "setups": [{
                "name": "as given",
                "table_from_work": { "translation_mm": self.mount },
                "work_offset": { "register": self.register, "linear_mm": offsets },
                "meshes": meshes,
                "stock": self.stock()?,
                // Everything is inside it: only the run shows whether rapids are free.
                "clearance": { "plane": { "origin_mm": [0.0, 0.0, crate::validate::FARTHEST] } },
            }],
            "operations": [],
            // No program is written, so words that the control lacks do not matter.
            "post": {
                "dialect": self.dialect,
                "feed_mode": feed_mode(self.dialect),
                "dialect_file": self.dialect_file.as_deref().map(name).transpose()?,
            },
        }))
    }

    fn stock(&self) -> Result<Value, Failure> {
        Ok(match &self.stock {
            AdHocStock::Offset(allowance) => json!({ "offset": { "allowance_mm": allowance } }),
            AdHocStock::Mesh(file) => {
                json!({ "mesh": { "file": name(file)?, "unit": self.unit, "up_axis": self.up_axis } })
            }
            AdHocStock::Box => {
                let Aabb { min, max } = read_mesh(&self.part, self.unit, self.up_axis)?.mesh.aabb();
                json!({ "box": { "min_mm": [min.x, min.y, min.z], "max_mm": [max.x, max.y, max.z] } })
            }
        })
    }
}

/// Returns a feed mode that a control has.
fn feed_mode(dialect: Dialect) -> FeedMode {
    let feeds = dialect.file().feeds;
    match (feeds.g94, feeds.g93) {
        (Some(_), _) => FeedMode::G94,
        (None, Some(_)) => FeedMode::G93,
        (None, None) => FeedMode::Rtcp,
    }
}

/// Returns a path as the text of a file.
fn name(path: &Path) -> Result<&str, Failure> {
    path.to_str().ok_or_else(|| Failure::input(path, "the path is not UTF-8 text; give one that is"))
}
