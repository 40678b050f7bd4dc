//! Format of the job file, `"format": "facemill-job/1"`.

use std::collections::BTreeMap;

use facemill_cc_path::files::{ProgramWithToolFile, RegionFile, StrategyFile};
use facemill_nc_program::dialect::PostFile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Value of the key `format` in a job file.
pub const JOB_FORMAT: &str = "facemill-job/1";

/// Job: parts, tools, machine, operations and the form of the program.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JobFile {
    /// Always `"facemill-job/1"`.
    pub format: String,
    /// Name of the job; the program carries it as a comment.
    pub name: String,
    /// Tool file of all operations, relative to the job file; on a machine with two heads that of
    /// head 1. Leave it out where there are `tools`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Tool files by name, relative to the job file, in place of `tool`: each operation names one
    /// of them. Operations of a setup that follow each other with one tool have a program of their
    /// own (docs/cookbook.md#several-tools). Not on a machine with two heads. The numbers and
    /// length registers of the tools must differ.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub tools: BTreeMap<String, String>,
    /// Tool file of head 2, relative to the job file: required on a machine with two heads, refused
    /// on any other. Its `number` and `length_register` must not be those of the first tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_tool: Option<String>,
    /// Machine file, relative to the job file.
    pub machine: String,
    /// Setups (clampings) in the order they are machined; each gets a program of its own. Each
    /// needs an operation, and their names must differ.
    #[schemars(length(min = 1))]
    pub setups: Vec<SetupFile>,
    /// Operations in the order they are machined.
    #[schemars(length(min = 1))]
    pub operations: Vec<OperationFile>,
    /// Operations that two heads machine at the same time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairFile>,
    /// How the program is written.
    pub post: PostFile,
    /// Limits of the axes that the feeds of cutting moves keep.
    #[serde(default)]
    pub feeds_within: FeedsWithin,
    /// How the programs of `plan` are verified. `plan --no-verify` leaves all verification out.
    #[serde(default)]
    pub verification: VerificationSettingsFile,
}

/// How the programs of a plan are verified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VerificationSettingsFile {
    /// Cut the stock of every setup as its program goes, and report collisions with the stock as it
    /// then is, besides those with the initial stock. Contacts of machine bodies with the initial
    /// stock alone are no finding, unless the setup begins with the rest of another one.
    pub cut_stock: bool,
    /// Distance of the lines that the stock is made of (docs/dexel.md); `plan --stock-cell-mm`
    /// overrides it. Default: by the region. That is 200 lines along the longer side of the region
    /// that the operations cut, no less than 1 mm apart, and close enough for half the diagonal of
    /// a cell to be within 0.85 of `rapid_clearance_mm`; with more than 1,000 lines the stock is
    /// not cut, and the report says so.
    #[schemars(range(min = 0.001, max = 1_000))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock_cell_mm: Option<f64>,
    /// Largest error of the cut stock on every line.
    #[schemars(range(min = 0.0001, max = 0.5))]
    pub stock_tolerance_mm: f64,
}

/// Largest error of the cut stock where no other is given, mm: by jobs, commands and tasks.
pub const STOCK_TOLERANCE: f64 = 0.05;

impl Default for VerificationSettingsFile {
    fn default() -> Self {
        Self { cut_stock: true, stock_cell_mm: None, stock_tolerance_mm: STOCK_TOLERANCE }
    }
}

/// Limits of the axes that feeds keep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FeedsWithin {
    /// Largest velocity of each axis; the control slows down where the axes cannot accelerate so
    /// fast.
    Velocity,
    /// Velocity, acceleration and jerk of each axis: each cutting block has the largest speed that
    /// the axes reach in it by the time law of the whole program
    /// (docs/time-law.md#in-plans-and-new-feeds). If the machine file lacks a limit, as `velocity`.
    #[default]
    Acceleration,
}

/// One clamping of the part.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupFile {
    /// Name; operations refer to it.
    pub name: String,
    /// Pose of the part (the meshes' frame) in the workpiece frame. Default: identity.
    #[serde(default)]
    pub work_from_part: PoseFile,
    /// Pose of the workpiece frame on the machine's table: how the part is mounted. Default:
    /// identity.
    #[serde(default)]
    pub table_from_work: PoseFile,
    /// Work offset that the program runs under. Default: `G54`, all 0.
    #[serde(default)]
    pub work_offset: WorkOffsetFile,
    /// Meshes with their roles; at least one has the role `drive`.
    #[schemars(length(min = 1))]
    pub meshes: Vec<MeshFile>,
    /// Material on the part before machining.
    pub stock: StockFile,
    /// Programs of other jobs that have cut this stock before, in this setup's mounting on the
    /// job's machine, each with its tool, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub programs_before: Vec<ProgramWithToolFile>,
    /// Distance of the lines on which what the programs before leave is bounded from outside:
    /// postures, entries, links and chips are planned on this bound
    /// (docs/dexel.md#a-bound-of-what-is-left). Default: 200 lines along the longer side of the
    /// stock, or a sixth of the shortest flute of the job's tools if that is less, and so close
    /// that
    /// `layers` are known to be cut; but no less than 0.1 mm, and so far apart that no more than
    /// 60,000 lines meet stock.
    #[schemars(range(min = 0.05, max = 100))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest_cell_mm: Option<f64>,
    /// Surface outside of which rapids are free; the whole workpiece must lie inside.
    pub clearance: ClearanceFile,
    /// Clearance surface of head 2 of a machine with two; refused on any other. Default: as
    /// `clearance`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_clearance: Option<ClearanceFile>,
    /// Distance that the whole tool keeps from part, stock and fixtures in rapids.
    #[schemars(range(min = 0.001, max = 1_000))]
    #[serde(default = "default_rapid_clearance_mm")]
    pub rapid_clearance_mm: f64,
    /// Links from one pass to the next.
    #[serde(default)]
    pub links: LinksFile,
}

/// How the links from one pass to the next are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LinksFile {
    /// Replace each link by the fastest one that is found and proven free
    /// (docs/rapids.md#in-plans), if the stock is cut; else links go over the clearance surface.
    pub shorten: bool,
    /// Stock that shortened links avoid.
    pub stock: LinkStockFile,
    /// Order in which the pieces of an operation's passes, and the runs of a pair, are cut.
    pub order: PassOrderFile,
    /// Turn from pass to pass with the tool down where passes are laid in `zigzag`
    /// (docs/rapids.md#turns-in-place-of-links).
    pub turns: bool,
}

impl Default for LinksFile {
    fn default() -> Self {
        Self { shorten: true, stock: LinkStockFile::default(), order: PassOrderFile::default(), turns: true }
    }
}

/// Stock that links avoid.
// Exhaustive for callers: links must not be tested against another stock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinkStockFile {
    /// The stock as it was before the program: the whole tool is proven to keep 0.9 of the rapid
    /// clearance from it everywhere.
    #[default]
    AtFirst,
    /// The stock as it is at the time of the link, on the lines of the cut stock: links go through
    /// cut regions, and near their ends closer than the rapid clearance
    /// (docs/rapids.md#choice-of-the-path).
    AsCut,
}

/// Order in which the pieces of an operation's passes are cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PassOrderFile {
    /// Pass by pass in the order of the path, place by place of the pattern.
    #[default]
    AsLaid,
    /// Shortest links (docs/rapids.md#order-of-passes); pieces so close that the cutter on either
    /// reaches a common place keep their order.
    Shortest,
}

fn default_rapid_clearance_mm() -> f64 {
    5.0
}

/// A pose: rotation about an axis through the origin, then translation.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseFile {
    /// Translation, behind the rotation.
    #[serde(default)]
    pub translation_mm: [f64; 3],
    /// Direction of the rotation axis, through the origin.
    #[serde(default = "z_axis")]
    pub rotation_axis: [f64; 3],
    /// Angle, right-handed.
    #[schemars(range(min = -360, max = 360))]
    #[serde(default)]
    pub rotation_deg: f64,
}

/// Returns the direction of the z axis.
pub fn z_axis() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

impl Default for PoseFile {
    fn default() -> Self {
        Self { translation_mm: [0.0; 3], rotation_axis: z_axis(), rotation_deg: 0.0 }
    }
}

/// Work offset of the control: machine axis values where the program's words are zero.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WorkOffsetFile {
    /// Register: `G54` to `G59`, or `G54.1 P1` to `G54.1 P300`.
    #[serde(default = "default_register")]
    pub register: String,
    /// Offsets of linear axes by letter, such as `{"X": 120.0}`; axes not named have 0.
    #[serde(default)]
    pub linear_mm: BTreeMap<String, f64>,
    /// Offsets of rotary axes by letter, −360 to 360; axes not named have 0.
    #[serde(default)]
    pub rotary_deg: BTreeMap<String, f64>,
}

fn default_edge_fill() -> bool {
    true
}

fn default_register() -> String {
    "G54".to_owned()
}

impl Default for WorkOffsetFile {
    fn default() -> Self {
        Self { register: default_register(), linear_mm: BTreeMap::new(), rotary_deg: BTreeMap::new() }
    }
}

/// A mesh, or some groups of it, with its role.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// Mesh file (OBJ, STL, glTF, GLB, 3MF), relative to the job file (docs/formats.md#meshes).
    pub file: String,
    /// Groups to use; `*` matches any run of characters, and every entry must match a group.
    /// Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groups: Option<Vec<String>>,
    /// Role of the mesh.
    pub role: RoleFile,
    /// Unit of the file. Default: by format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<UnitFile>,
    /// Axis of the file that becomes +Z. Default: by format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up_axis: Option<UpAxisFile>,
    /// Reverses all triangles of a file that is wound inside out (docs/formats.md#meshes); all
    /// entries with the same file must agree.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reverse_winding: bool,
    /// Material that the cutter must leave on it; the same for all drive surfaces of a setup.
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub allowance_mm: f64,
}

/// Role of a mesh (APT's part, check and drive surfaces).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RoleFile {
    /// Cut by the passes; counts as part, too.
    Drive,
    /// Must not be gouged.
    Part,
    /// Must not be gouged, by its own allowance.
    Check,
    /// Must not be touched, by its allowance.
    Fixture,
    /// Finished before this clamping, which locates the part by it: counts as part, no operation
    /// may cut it, and the report on the job says where it is on the table.
    Datum,
}

/// Length unit of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum UnitFile {
    /// 1000 mm.
    Metre,
    /// 10 mm.
    Centimetre,
    /// 1 mm.
    Millimetre,
    /// 25.4 mm.
    Inch,
}

/// Axis of a mesh file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UpAxisFile {
    /// File (x, y, z) becomes (y, z, x).
    X,
    /// File (x, y, z) becomes (x, −z, y).
    Y,
    /// As it is.
    Z,
}

/// Material before machining, workpiece frame.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum StockFile {
    /// The part and check surfaces with a layer of material on them; on both sides, where they are
    /// not closed together, which `assumptions` of plan and verification say.
    Offset(OffsetStockFile),
    /// Axis-parallel box, workpiece frame.
    Box(BoxStockFile),
    /// Round bar, workpiece frame.
    Cylinder(CylinderStockFile),
    /// Casting, in the part's frame.
    Mesh(MeshStockFile),
}

impl StockFile {
    /// Returns the stock in a few words.
    pub fn in_words(&self) -> String {
        match self {
            Self::Offset(offset) => format!("{} mm on part and check surfaces", offset.allowance_mm),
            Self::Box(_) => "a box".to_owned(),
            Self::Cylinder(_) => "a cylinder".to_owned(),
            Self::Mesh(mesh) => format!("mesh {}", mesh.file),
        }
    }
}

/// The part with a layer of material on it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OffsetStockFile {
    /// Thickness of the layer.
    #[schemars(range(min = 0))]
    pub allowance_mm: f64,
}

/// An axis-parallel box.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxStockFile {
    /// Smallest coordinates.
    pub min_mm: [f64; 3],
    /// Largest coordinates, above the smallest.
    pub max_mm: [f64; 3],
}

/// A round bar.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderStockFile {
    /// Middle of the base.
    pub base_mm: [f64; 3],
    /// Direction from the base to the top.
    #[serde(default = "z_axis")]
    pub axis: [f64; 3],
    /// Radius.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius_mm: f64,
    /// Height.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub height_mm: f64,
}

/// A casting as a mesh, in the part's frame.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshStockFile {
    /// Mesh file, relative to the job file.
    pub file: String,
    /// Unit of the file, as for meshes of the part. Default: by format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<UnitFile>,
    /// Up axis of the file, as for meshes of the part. Default: by format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up_axis: Option<UpAxisFile>,
    /// Reverses all triangles, as for meshes of the part.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reverse_winding: bool,
}

/// Surface that encloses the whole workpiece, workpiece frame.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ClearanceFile {
    /// Plane; its normal points to the free side.
    Plane(PlaneFile),
    /// Endless cylinder.
    Cylinder(CylinderFile),
    /// Sphere.
    Sphere(SphereFile),
}

/// A plane.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneFile {
    /// A point of the plane.
    pub origin_mm: [f64; 3],
    /// Its normal.
    #[serde(default = "z_axis")]
    pub normal: [f64; 3],
}

/// An endless cylinder.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderFile {
    /// A point of its axis.
    #[serde(default)]
    pub origin_mm: [f64; 3],
    /// Direction of its axis.
    #[serde(default = "z_axis")]
    pub axis: [f64; 3],
    /// Radius.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius_mm: f64,
}

/// A sphere.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereFile {
    /// Middle.
    #[serde(default)]
    pub center_mm: [f64; 3],
    /// Radius.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius_mm: f64,
}

/// One operation.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperationFile {
    /// Name; findings and the report refer to it.
    pub name: String,
    /// Setup of the operation; required if there are several. Default: the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setup: Option<String>,
    /// Its tool, by its name in `tools`; required if there are several. Default: the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Head that machines it, 1 or 2: the number of its chain in the machine file. Default: 1.
    #[schemars(range(min = 1, max = 2))]
    #[serde(default = "first_head", skip_serializing_if = "is_first_head")]
    pub head: u32,
    /// Source of the cutter-contact (CC) points.
    pub path: PathFile,
    /// Material that the operation leaves on the drive surface, besides the allowance of its
    /// meshes. Operations of a setup that follow each other with one tool and leave the same have a
    /// program of their own (docs/cookbook.md#roughing).
    #[schemars(range(min = 0, max = 1_000))]
    #[serde(default, skip_serializing_if = "is_zero")]
    pub allowance_mm: f64,
    /// Cuts the region in layers parallel to it, from the outermost to the one that leaves
    /// `allowance_mm`: each an operation of its own, with passes only where there is material more
    /// than `cusp_mm` above its layer, and `max_step_over_mm` around it
    /// (docs/cookbook.md#roughing). Not on a machine with two heads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers: Option<LayersFile>,
    /// Cuts the stock level by level across an axis, from its top down to the part with
    /// `allowance_mm` on its drive and part surfaces (docs/cookbook.md#levels-in-a-block): each
    /// level is an operation of its own with a plane in place of the drive surface, and passes
    /// where there is material and the part is not in the way. The strategy is `parallel_planes`,
    /// the stock a solid of its own. Not on a machine with two heads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<LevelsFile>,
    /// Cutting direction (docs/formats.md#climb-and-the-sign-of-rotate).
    pub direction: DirectionFile,
    /// Entry of every pass.
    pub entry: ApproachFile,
    /// Exit of every pass.
    pub exit: ApproachFile,
    /// Copies about an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternFile>,
    /// Search for tilt and rotate.
    pub search: SearchFile,
    /// Feeds and spindle.
    pub feeds: FeedsFile,
    /// Tolerances: the error budget.
    pub tolerances: TolerancesFile,
    /// Largest amount of material that may be left on the region, measured on the written program.
    /// Default: that of a finished part.
    #[serde(default)]
    pub finish: FinishFile,
    /// Treatment of points without a feasible posture.
    pub infeasible: InfeasibleFile,
}

impl OperationFile {
    /// Returns the largest thickness of its layers or levels, mm.
    pub fn depth_of_layer(&self) -> Option<f64> {
        self.layers.map(|l| l.depth_mm).or(self.levels.map(|l| l.depth_mm))
    }

    /// Returns the region of its strategy or path file.
    pub fn region(&self) -> &RegionFile {
        match &self.path {
            PathFile::Strategy(strategy) => &strategy.region,
            PathFile::File(file) => &file.region,
            PathFile::Cl(file) => &file.region,
        }
    }

    /// Returns whether the tool axes are those of a CL file.
    pub fn keeps_axes(&self) -> bool {
        matches!(&self.path, PathFile::Cl(file) if file.axes == ClAxesFile::Kept)
    }
}

/// Layers of roughing, parallel to the drive surface and equally thick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayersFile {
    /// Largest height of material above the drive surface with its meshes' allowance. Where there
    /// is more, the job is refused: the first layer would be thicker than the others.
    #[schemars(range(min = 0.01, max = 1_000))]
    pub from_mm: f64,
    /// Largest thickness of a layer; with `cusp_mm` less than the length of the tool's flute.
    #[schemars(range(min = 0.01, max = 1_000))]
    pub depth_mm: f64,
}

impl LayersFile {
    /// Returns what each layer leaves, mm, from the outermost; the last one leaves `allowance`. Of
    /// more than [`MOST_LAYERS`] returns one more than that.
    pub fn allowances(&self, allowance: f64) -> Vec<f64> {
        let all = self.from_mm - allowance;
        let n = (all / self.depth_mm - LAYER_ROUNDING).ceil().clamp(1.0, MOST_LAYERS + 1.0);
        (1..=n as usize).rev().map(|k| allowance + all * (k - 1) as f64 / n).collect()
    }
}

/// Largest number of layers of an operation: more are a depth in the wrong unit.
pub const MOST_LAYERS: f64 = 200.0;

/// Share of a layer's thickness that counts as rounding in the number of layers.
const LAYER_ROUNDING: f64 = 1e-9;

/// Levels of roughing: planes across an axis, equally far apart. Heights are coordinates along the
/// axis, workpiece frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelsFile {
    /// Direction from which the tool comes, workpiece frame; of any length above 0.
    #[serde(default = "z_axis")]
    pub axis: [f64; 3],
    /// Height of the top of the material, above `to_mm`. Where there is material above it, the job
    /// is refused: the first level would be thicker than the others. Default: the top of the box or
    /// cylinder; required for stock that is a mesh.
    #[schemars(range(min = -100_000, max = 100_000))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Height of the last level.
    #[schemars(range(min = -100_000, max = 100_000))]
    pub to_mm: f64,
    /// Largest distance of levels; with `cusp_mm` less than the length of the tool's flute.
    #[schemars(range(min = 0.01, max = 1_000))]
    pub depth_mm: f64,
    /// Whether this is not the first of several levels, once each is an operation.
    #[serde(skip)]
    pub is_later: bool,
}

impl LevelsFile {
    /// Returns the heights of the levels below a top, mm, from the highest; the last one is
    /// `to_mm`. Of more than [`MOST_LAYERS`] returns one more than that.
    pub fn heights(&self, top: f64) -> Vec<f64> {
        let all = LayersFile { from_mm: top - self.to_mm, depth_mm: self.depth_mm };
        all.allowances(0.0).into_iter().map(|above| self.to_mm + above).collect()
    }
}

fn first_head() -> u32 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde passes")]
fn is_first_head(head: &u32) -> bool {
    *head == first_head()
}

/// Two operations of one setup that two heads machine at the same time, on a machine whose heads
/// share the workpiece's axes: their passes are paired, and both heads' postures chosen so that
/// they agree on the shared axis.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairFile {
    /// Name of the operation of head 1.
    pub first: String,
    /// Name of the operation of head 2.
    pub second: String,
    /// Largest turn of rotate away from the uncut stock for the common value of the shared axis:
    /// with opposite sides of a blade, one head leans to one side and the other head to the other.
    /// At most the largest of the operation's `rotate_deg` counts.
    #[schemars(range(min = 0, max = 180))]
    #[serde(default = "default_lean_back_deg")]
    pub lean_back_deg: f64,
}

fn default_lean_back_deg() -> f64 {
    85.0
}

/// Source of CC points.
// Exhaustive for callers: each is read in its own way.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PathFile {
    /// Path file, projected on the drive surface (docs/formats.md#path-file).
    File(PathFromFile),
    /// CL file (APT) of a CAM system: its cuts become passes (docs/formats.md#cl-file-as-a-path).
    Cl(PathFromCl),
    /// Passes generated on the drive surface.
    Strategy(PathFromStrategy),
}

/// A path from a file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathFromFile {
    /// Path file ("facemill-path/1"), relative to the job file.
    pub file: String,
    /// Largest permitted distance of a point from the drive surface.
    #[schemars(range(min = 0))]
    pub max_distance_mm: f64,
    /// Side of the feed on which the uncut stock lies, seen from outside.
    #[serde(default)]
    pub uncut_side: UncutSideFile,
    /// Region that the passes finish: the remaining material is measured on it. Default: all of the
    /// drive surface.
    #[serde(default)]
    pub region: RegionFile,
}

/// A path from the cuts of a CL file.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathFromCl {
    /// CL file (APT), relative to the job file, in the workpiece frame. Its tool must be the
    /// operation's, where it says so (CUTTER).
    pub file: String,
    /// Origin of the tool axes.
    pub axes: ClAxesFile,
    /// Number of the tool (LOADTL) whose cuts are taken; required if several cut. Default: the only
    /// one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<u32>,
    /// Unit of a file without UNITS; refused where UNITS says another one. Default: mm, with a
    /// note.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<ClUnitFile>,
    /// Largest distance of the file's cutter from the drive surface with its allowance. Motion at
    /// feed that is farther above it, as entries, exits and links, is left out, and counted; where
    /// the cutter is deeper in it, the job is refused.
    #[schemars(range(min = 0.0001, max = 100))]
    pub max_distance_mm: f64,
    /// Side of the feed on which the uncut stock lies, seen from outside.
    #[serde(default)]
    pub uncut_side: UncutSideFile,
    /// Region that the passes finish: the remaining material is measured on it. Default: all of the
    /// drive surface.
    #[serde(default)]
    pub region: RegionFile,
}

/// Unit of the lengths of a CL file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClUnitFile {
    /// mm.
    Mm,
    /// 10 mm.
    Cm,
    /// 25.4 mm.
    Inch,
}

impl From<ClUnitFile> for facemill_cl_file::ClUnit {
    fn from(unit: ClUnitFile) -> Self {
        match unit {
            ClUnitFile::Mm => Self::Millimetre,
            ClUnitFile::Cm => Self::Centimetre,
            ClUnitFile::Inch => Self::Inch,
        }
    }
}

/// Origin of the tool axes of passes from a CL file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ClAxesFile {
    /// Those of the file, with its tips: mode and ranges of `search` do not count, and points where
    /// the pose is not feasible are left out. Only with direction `either`.
    Kept,
    /// Searched by `search` at the places where the file's cutter touches the drive surface.
    Searched,
}

/// A side of the feed, seen from outside the part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UncutSideFile {
    /// Left of the feed.
    Left,
    /// Right of the feed.
    #[default]
    Right,
}

/// A path generated by a strategy.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathFromStrategy {
    /// Arrangement of the passes.
    pub strategy: StrategyFile,
    /// Region of the drive surface to cover with passes. Default: all of the drive surface.
    #[serde(default)]
    pub region: RegionFile,
    /// Order of the levels (distance along the planes' normal, radius of the cylinders).
    #[serde(default)]
    pub order: LevelOrderFile,
    /// Direction of successive passes.
    #[serde(default)]
    pub linking: LinkingFile,
    /// Distance kept from the region's edge along each pass.
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub edge_margin_mm: f64,
    /// Passes shorter than this are left out and counted.
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub min_pass_length_mm: f64,
    /// Whether passes follow the local strip width, with partial passes where strips are narrow at
    /// an edge, wherever that is shorter. Without it, every pass is a level, and its narrowest
    /// strip decides on the step. Only sections by planes, cylinders and other surfaces in space
    /// have levels: other strategies follow the width by themselves.
    #[serde(default = "default_edge_fill")]
    pub edge_fill: bool,
    /// Largest number of times that passes are laid again, with narrower strips where the text
    /// leaves more than `cusp_mm` (docs/method.md#rounds-of-widths). The best round is cut: within
    /// `cusp_mm` before others, then by time. Default: 3 for `constant_scallop` without layers, 0
    /// for all else.
    #[schemars(range(min = 0, max = 3))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_rounds: Option<u32>,
}

/// Rounds of widths of `constant_scallop`, whose fronts meet at places that expected strips do not
/// tell.
const ROUNDS_OF_FRONTS: u32 = 3;

impl PathFromStrategy {
    /// Returns the largest number of times that passes are laid again, as given or by the strategy.
    pub fn largest_width_rounds(&self) -> u32 {
        let of_strategy = match &self.strategy {
            StrategyFile::ConstantScallop(_) => ROUNDS_OF_FRONTS,
            _ => 0,
        };
        self.width_rounds.unwrap_or(of_strategy)
    }
}

/// Order of levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LevelOrderFile {
    /// From the smallest level to the largest.
    #[default]
    Increasing,
    /// From the largest level to the smallest.
    Decreasing,
}

/// How passes follow each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LinkingFile {
    /// Every pass the same way.
    #[default]
    OneWay,
    /// Back and forth; only with direction `either`.
    Zigzag,
}

/// Cutting direction. With the sense of the spindle it determines the side of the feed on which the
/// uncut stock lies; rotate turns toward that side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DirectionFile {
    /// Down milling: teeth move against the feed where they are in the stock.
    Climb,
    /// Up milling.
    Conventional,
    /// Either, as the order of passes gives it.
    Either,
}

/// Entry or exit of a pass.
// Exhaustive for callers: each has its own path.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ApproachFile {
    /// Arc in the plane of feed and normal, tangent to the pass.
    TangentialArc(ArcFile),
    /// Arc in the tangent plane from the side that is already cut, rising by a tenth of its
    /// sideways way.
    RollIn(ArcFile),
    /// The shortest way in the plane of feed and normal up to this arc: smaller arcs, continued by
    /// lines, as steep as the tool may go down (exits: as the end of the arc). The straight line
    /// before it is as long as the region goes on beside it, at most `straight_mm`.
    Shortest(ArcFile),
}

/// An arc.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArcFile {
    /// Radius.
    #[schemars(range(min = 0.001, max = 10_000))]
    pub radius_mm: f64,
    /// Angle that the arc runs through.
    #[schemars(range(min = 1, max = 90))]
    pub angle_deg: f64,
    /// Straight line along the feed between the pass and the arc. Where the border of the region
    /// leans, it cuts the strip beside the end of the pass down to the cusp before the arc rises:
    /// `shortest` takes no more of it than that needs, other arcs take more where the border asks
    /// for it.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0, max = 1_000))]
    pub straight_mm: f64,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Copies of the passes about an axis, workpiece frame.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatternFile {
    /// Number of places, the first included; none may coincide with another one.
    #[schemars(range(min = 1, max = 1_000))]
    pub copies: u32,
    /// Angle from one place to the next, right-handed.
    #[schemars(range(min = -360, max = 360))]
    pub index_angle_deg: f64,
    /// A point of the axis.
    #[serde(default)]
    pub origin_mm: [f64; 3],
    /// Direction of the axis.
    #[serde(default = "z_axis")]
    pub axis: [f64; 3],
}

/// Search for tilt and rotate (CLOPT).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SearchFile {
    /// Smallest and largest tilt: the axis leans into the feed, so that the cutter touches in front
    /// and its rear is up.
    #[schemars(inner(range(min = 0, max = 89)))]
    pub tilt_deg: [f64; 2],
    /// Smallest and largest turn of the lean about the normal from the feed toward the uncut stock.
    /// The sign of rotate follows from direction, spindle sense and the side of the uncut stock
    /// (docs/formats.md#climb-and-the-sign-of-rotate).
    #[schemars(inner(range(min = 0, max = 180)))]
    pub rotate_deg: [f64; 2],
    /// How the postures of a pass are chosen.
    #[serde(default)]
    pub mode: PostureModeFile,
    /// Angle that grows first.
    #[serde(default)]
    pub order: OrderFile,
    /// Weight of the curve's middle control point; larger: closer to the corner.
    #[schemars(range(min = 1e-06, max = 1_000_000))]
    #[serde(default = "one")]
    pub weight: f64,
    /// Coarse step of the curve's parameter; feasible stretches shorter than it may be stepped
    /// over.
    #[schemars(range(min = 0.001, max = 1))]
    #[serde(default = "default_u_step")]
    pub u_step: f64,
    /// Accuracy of the curve's parameter.
    #[schemars(range(min = 1e-06, max = 1))]
    #[serde(default = "default_u_tolerance")]
    pub u_tolerance: f64,
    /// Proves (docs/method.md#search) that no posture before the one found is feasible, except
    /// feasible stretches of the curve's parameter shorter than this; takes several times as long.
    /// At a point that takes more than 4,096 intervals the width is doubled, which report
    /// (`postures[].search_proof`) and summary state. Default: the search steps by `u_step`.
    #[schemars(range(min = 1e-06, max = 0.1))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certified_u_width: Option<f64>,
    /// Largest turn of the tool axis relative to the surface per mm of path.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(default = "default_turn")]
    pub max_turn_deg_per_mm: f64,
    /// Permitted directions of the tool axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_axis_cone: Option<ConeFile>,
    /// Angle between the tool axis and the rotary axis nearest to the workpiece, below which that
    /// axis turns fast for little motion of the tool. The plan uses postures below this angle only
    /// if no other is feasible, and reports them. 0 avoids nothing.
    #[schemars(range(min = 0, max = 10))]
    #[serde(default = "default_singular_cone")]
    pub singular_cone_deg: f64,
    /// Solution of the machine that the program starts with.
    #[serde(default)]
    pub preferred_branch: BranchFile,
}

fn one() -> f64 {
    1.0
}

fn default_u_step() -> f64 {
    0.1
}

fn default_u_tolerance() -> f64 {
    0.001
}

fn default_singular_cone() -> f64 {
    1.0
}

fn default_turn() -> f64 {
    0.1
}

/// How the postures of a pass are chosen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PostureModeFile {
    /// At every point the smallest feasible posture of the search curve, raised where neighbours
    /// need larger ones.
    Smallest,
    /// The sequence of postures over the whole pass with the least cost of cusps and axis motion,
    /// smoothed, within the ranges (docs/method.md#the-cheapest-postures-along-the-pass).
    #[default]
    Smooth,
    /// The same posture at every point; the ranges do not count, and points where it is not
    /// feasible are left out.
    Fixed(FixedPostureFile),
    /// The tool axis from the CC point toward a point or line, the spindle on its side; workpiece
    /// frame, in copies of a pattern turned with them. Points where this posture is not feasible
    /// are left out.
    Toward(AxisTargetFile),
}

/// A posture in terms of lead and lean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedPostureFile {
    /// Inclination of the tool axis along the feed.
    #[schemars(range(min = -89, max = 89))]
    pub lead_deg: f64,
    /// Inclination of the tool axis across the feed, toward the uncut stock.
    #[schemars(range(min = -89, max = 89))]
    #[serde(default)]
    pub lean_deg: f64,
}

/// Target of the tool axis: the spindle is on its side of the surface. Workpiece frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum AxisTargetFile {
    /// A point.
    Point(TargetPointFile),
    /// The nearest point of a line.
    Line(TargetLineFile),
}

/// Point that the tool axis points to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TargetPointFile {
    /// Its position.
    pub position_mm: [f64; 3],
}

/// Line that the tool axis points to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TargetLineFile {
    /// A point of the line.
    pub origin_mm: [f64; 3],
    /// Its direction.
    pub direction: [f64; 3],
}

/// Angle that grows first along the search curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrderFile {
    /// Tilt, then rotate.
    #[default]
    TiltFirst,
    /// Rotate, then tilt.
    RotateFirst,
}

/// Directions within an angle of an axis, workpiece frame.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConeFile {
    /// Middle of the cone.
    #[serde(default = "z_axis")]
    pub axis: [f64; 3],
    /// Angle from the middle to the border.
    #[schemars(range(min = 0, max = 180))]
    pub half_angle_deg: f64,
}

/// Which of the machine's solutions is used if no pose precedes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BranchFile {
    /// Nearest to the home position.
    #[default]
    NearestHome,
    /// First rotary axis of the tool (else of the table) not negative.
    Positive,
    /// First rotary axis of the tool (else of the table) not positive.
    Negative,
}

/// Feeds and spindle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedsFile {
    /// Speed of the tool tip along the passes.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub cutting_mm_min: f64,
    /// Speed of the tool tip in entries and exits; with the cutter in the stock not faster than
    /// `cutting_mm_min`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub approach_mm_min: f64,
    /// Speed of the tool tip in turns from pass to pass with the tool down, not faster than along
    /// the passes. Default: `approach_mm_min`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_mm_min: Option<f64>,
    /// Keeps the removal rate (chip area times tip feed) in passes at a target by a tip feed
    /// between `min_mm_min` and `cutting_mm_min`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removal_rate: Option<RemovalRateFile>,
    /// Keeps the thickest place of a tooth's chip in passes below a limit by the tip feed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chip_thickness: Option<ChipThicknessFile>,
    /// Speed of the tool tip along the passes where nothing is cut, not below `cutting_mm_min`; on
    /// entries and exits outside the stock, too, if it is above `approach_mm_min`. Default:
    /// `cutting_mm_min`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub air_mm_min: Option<f64>,
    /// Spindle speed.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub spindle_rpm: f64,
    /// Coolant.
    #[serde(default)]
    pub coolant: CoolantFile,
}

/// Largest removal rate: the section of the chip times the speed of the tool tip.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RemovalRateFile {
    /// Target of the removal rate.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub target_cm3_min: f64,
    /// Smallest speed of the tool tip that the target may lead to, at most `cutting_mm_min`; larger
    /// chips exceed the removal rate.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub min_mm_min: f64,
}

/// Largest chip thickness: the feed per tooth times the sine of the angles at which the cutting
/// edge meets the stock.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChipThicknessFile {
    /// Largest thickness of a tooth's chip, at its thickest place; so large that a tooth's feed of
    /// that much is not below the control's smallest F. The tip feed falls below
    /// `removal_rate.min_mm_min`, too, if it has to.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_mm: f64,
}

/// Coolant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CoolantFile {
    /// None.
    #[default]
    Off,
    /// M8.
    Flood,
    /// M7.
    Mist,
    /// M7.
    Air,
}

/// Tolerances of an operation.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TolerancesFile {
    /// Largest distance of the mesh's facets from the true surface, as the mesh's maker states it;
    /// only adds to the budget.
    #[schemars(range(min = 0, max = 100))]
    pub mesh_chord_mm: f64,
    /// Deviation of the straight path between two CC points from the surface.
    #[schemars(range(min = 1e-06, max = 2))]
    pub path_chord_mm: f64,
    /// Largest distance between two CC points.
    #[schemars(range(min = 0.001, max = 10_000))]
    pub max_step_mm: f64,
    /// Deviation of the control's motion between two blocks from the straight path with turning
    /// axis.
    #[schemars(range(min = 1e-06, max = 2))]
    pub linearisation_mm: f64,
    /// Largest depth of the cutter in the part's mesh; at most a tenth of the cutter's radius.
    #[schemars(range(min = 1e-06, max = 2))]
    pub gouge_mm: f64,
    /// Largest lift along the normal that may free a pose of facets.
    #[schemars(range(min = 0, max = 2))]
    pub max_lift_mm: f64,
    /// Largest cusp between passes.
    #[schemars(range(min = 1e-06, max = 100))]
    pub cusp_mm: f64,
    /// Largest distance between passes.
    #[schemars(range(min = 0.001, max = 10_000))]
    pub max_step_over_mm: f64,
}

/// Largest amount of material that an operation may leave on its region, measured on the written
/// program; if more is left, the plan has failed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FinishFile {
    /// Fraction of the area that may be left higher than `cusp_mm` with path chord, linearisation
    /// and gouge tolerance.
    #[schemars(range(min = 0, max = 1))]
    pub max_above_fraction: f64,
    /// Fraction of the area that no cut may reach.
    #[schemars(range(min = 0, max = 1))]
    pub max_never_cut_fraction: f64,
}

impl Default for FinishFile {
    /// Returns the limits of a finished part: up to a hundredth at borders and corners of the
    /// region, next to nothing never cut.
    fn default() -> Self {
        Self { max_above_fraction: 0.01, max_never_cut_fraction: 0.002 }
    }
}

/// Treatment of points without a feasible posture.
// Exhaustive for callers: points must not be left out unasked.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InfeasibleFile {
    /// A point without a feasible posture makes the job infeasible; nothing is written.
    Stop,
    /// The pass leaves the part before such points and returns behind them.
    Trim(TrimFile),
}

/// Amount that may be left out.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrimFile {
    /// Largest fraction of the CC points that may be left out; with more, files are written and the
    /// exit code is 1.
    #[schemars(range(min = 0, max = 1))]
    pub max_trimmed_fraction: f64,
}
