//! Checks of a job file's numbers that its types cannot express. Every message names the field and
//! its permitted values.

pub mod feeds;
pub(crate) mod layers;
pub(crate) mod levels;
pub mod limits;
pub mod setup_chain;
pub mod setup_names;
pub mod tip_feed;
pub mod tools;

use facemill_inverse_kinematics::FeedRange;
use facemill_nc_program::FeedMode;
use facemill_nc_program::dialect::RoundingBound;

use crate::format::job_file::{
    AxisTargetFile, ClearanceFile, DirectionFile, InfeasibleFile, JOB_FORMAT, JobFile, LinkStockFile, LinkingFile,
    OperationFile, PairFile, PathFile, PatternFile, PoseFile, PostureModeFile, RoleFile, SetupFile, StockFile,
};
use crate::validate::feeds::{check_feed_laws, check_stock_to_cut, feeds_of_chips};
use crate::validate::layers::{check_extension, check_layers};
use crate::validate::levels::check_levels;
use crate::validate::limits::{JOB_LIMITS, OPERATION_LIMITS, SETUP_LIMITS, SMALLEST_TOLERANCE, check_limits};
use crate::validate::setup_names::{belongs, file_stem};
use crate::validate::tools::check_tool_names;

/// Returns the first fault of a job as `field: what it must be`.
///
/// # Errors
/// If there is a fault.
pub fn validate(job: &JobFile) -> Result<(), String> {
    if job.format != JOB_FORMAT {
        return Err(format!("format: must be \"{JOB_FORMAT}\", is \"{}\"", job.format));
    }
    if job.setups.is_empty() {
        return Err("setups: at least one is needed".to_owned());
    }
    if job.operations.is_empty() {
        return Err("operations: at least one is needed".to_owned());
    }
    check_operations(job)?;
    check_setups(job)?;
    check_tool_names(job)?;
    check_links(job)?;
    check_limits(&Field("verification".to_owned()), &JOB_LIMITS, job)?;
    let unused = job.setups.iter().position(|s| !job.operations.iter().any(|o| belongs(o, s, job)));
    unused.map_or(Ok(()), |k| Err(format!("setups[{k}]: no operation belongs to \"{}\"", job.setups[k].name)))
}

/// Refuses links that go through cut stock in a job that does not cut the stock.
fn check_links(job: &JobFile) -> Result<(), String> {
    for (k, setup) in job.setups.iter().enumerate().filter(|(_, s)| s.links.stock == LinkStockFile::AsCut) {
        let why = if !setup.links.shorten {
            "links are not shortened (links.shorten)"
        } else if !job.verification.cut_stock {
            "the stock is not cut (verification.cut_stock)"
        } else {
            continue;
        };
        return Err(format!("setups[{k}].links.stock: as_cut has no effect, because {why}; take at_first"));
    }
    Ok(())
}

fn check_operations(job: &JobFile) -> Result<(), String> {
    for (k, operation) in job.operations.iter().enumerate() {
        check_operation(&Field::new("operations", k), operation)?;
        check_layers(k, operation)?;
        check_extension(k, operation)?;
        check_setup_name(k, operation, job)?;
        check_levels(k, operation, job)?;
        check_stock_to_cut(k, operation, job)?;
    }
    Ok(())
}

/// Returns the first fault of a job's setups as `field: what it must be`.
///
/// # Errors
/// If there is a fault.
pub fn check_setups(job: &JobFile) -> Result<(), String> {
    for (k, setup) in job.setups.iter().enumerate() {
        check_setup(&Field::new("setups", k), setup)?;
        if let Some(other) = job.setups[..k].iter().find(|s| file_stem(&s.name) == file_stem(&setup.name)) {
            return Err(format!(
                "setups[{k}].name: \"{}\" gives the same file names as \"{}\", program-{}; name one of them otherwise",
                setup.name,
                other.name,
                file_stem(&setup.name)
            ));
        }
    }
    Ok(())
}

/// Checks a job's use of heads against the number of the machine's heads.
///
/// # Errors
/// If the job names a head that does not exist, or pairs operations that cannot be paired.
pub fn check_heads(job: &JobFile, n_heads: usize) -> Result<(), String> {
    for (k, operation) in job.operations.iter().enumerate() {
        if operation.head == 0 || operation.head as usize > n_heads {
            return Err(format!(
                "operations[{k}].head: the machine has {n_heads} head(s), numbered from 1; there is no head {}",
                operation.head
            ));
        }
    }
    if n_heads < 2 {
        let only_two = |key: &str| Err(format!("{key}: is for machines with two heads; the machine has one"));
        if job.second_tool.is_some() {
            return only_two("second_tool");
        }
        if let Some(k) = job.setups.iter().position(|s| s.second_clearance.is_some()) {
            return only_two(&format!("setups[{k}].second_clearance"));
        }
        if !job.pairs.is_empty() {
            return only_two("pairs");
        }
    } else if job.second_tool.is_none() && job.tools.is_empty() {
        return Err(
            "second_tool: is needed, because the machine has two heads, and each has a tool of its own".to_owned()
        );
    }
    if n_heads >= 2 {
        if let Some(k) = job.operations.iter().position(|o| o.depth_of_layer().is_some() || o.allowance_mm > 0.0) {
            return Err(format!(
                "operations[{k}]: layers, levels and allowance_mm are for machines with one head; of two give the drive surface an \
                 allowance_mm"
            ));
        }
        if let Some(k) = job.setups.iter().position(|s| !s.programs_before.is_empty() || s.rest_cell_mm.is_some()) {
            return Err(format!("setups[{k}]: programs_before and rest_cell_mm are for machines with one head"));
        }
        if !job.tools.is_empty() {
            return Err(
                "tools: are for machines with one head; of two each has one tool, `tool` and `second_tool`".to_owned()
            );
        }
        check_one_coolant(job)?;
        if job.post.feed_mode == FeedMode::Rtcp {
            return Err(
                "post.feed_mode: rtcp can follow the tip of one head; take g94 or g93 on a machine with two".to_owned()
            );
        }
    }
    job.pairs.iter().enumerate().try_for_each(|(k, pair)| check_pair(job, k, pair))
}

/// Refuses operations with different coolants: a program of two heads switches the coolant once.
fn check_one_coolant(job: &JobFile) -> Result<(), String> {
    for (k, operation) in job.operations.iter().enumerate() {
        for (j, before) in job.operations[..k].iter().enumerate().filter(|(_, o)| o.setup == operation.setup) {
            if operation.feeds.coolant != before.feeds.coolant {
                return Err(format!(
                    "operations[{k}].feeds.coolant: differs from that of operations[{j}] in the same setup; a program of two \
                     heads switches the coolant once: give both the same, or put them into setups of their own"
                ));
            }
        }
    }
    Ok(())
}

fn check_pair(job: &JobFile, k: usize, pair: &PairFile) -> Result<(), String> {
    Field::new("pairs", k).within("lean_back_deg", pair.lean_back_deg, 0.0, 180.0)?;
    let mut found = Vec::new();
    for (key, name, head) in [("first", &pair.first, 1), ("second", &pair.second, 2)] {
        let at = format!("pairs[{k}].{key}");
        let named: Vec<&OperationFile> = job.operations.iter().filter(|o| o.name == *name).collect();
        let [operation] = named[..] else {
            return Err(format!("{at}: {} operations are named \"{name}\", must be one", named.len()));
        };
        if operation.head != head {
            return Err(format!("{at}: \"{name}\" is of head {}, must be of head {head}", operation.head));
        }
        if operation.keeps_axes() {
            return Err(format!(
                "{at}: \"{name}\" keeps the axes of a CL file, and a pair chooses them: let path.cl.axes be \"searched\", or leave it \
                 out of the pair"
            ));
        }
        let again = job.pairs[..k].iter().any(|p| p.first == *name || p.second == *name);
        if again {
            return Err(format!("{at}: \"{name}\" is in a pair already"));
        }
        found.push(operation);
    }
    if found[0].setup != found[1].setup {
        return Err(format!("pairs[{k}]: both operations must be of one setup"));
    }
    Ok(())
}

fn check_setup_name(k: usize, operation: &OperationFile, job: &JobFile) -> Result<(), String> {
    match &operation.setup {
        None if job.setups.len() > 1 => {
            Err(format!("operations[{k}].setup: is needed because there are several setups"))
        }
        Some(name) if !job.setups.iter().any(|s| s.name == *name) => {
            Err(format!("operations[{k}].setup: there is no setup \"{name}\""))
        }
        _ => Ok(()),
    }
}

/// Largest length and coordinate of a job, and of a mesh's vertices, mm. Beyond it, rounding alone
/// is 1e-10 mm and more, and no machine reaches.
pub const FARTHEST: f64 = 1e6;

/// Field of the job file.
pub struct Field(pub String);

impl Field {
    fn new(list: &str, index: usize) -> Self {
        Self(format!("{list}[{index}]"))
    }

    /// Refuses a value that is not above 0.
    pub fn positive(&self, key: &str, value: f64) -> Result<(), String> {
        self.require(key, value, value > 0.0, "more than 0")
    }

    /// Refuses a value beyond its limits.
    pub fn within(&self, key: &str, value: f64, min: f64, max: f64) -> Result<(), String> {
        self.require(key, value, (min..=max).contains(&value), &format!("from {min} to {max}"))
    }

    fn require(&self, key: &str, value: f64, holds: bool, what: &str) -> Result<(), String> {
        if holds && value.is_finite() { Ok(()) } else { Err(format!("{}.{key}: must be {what}, is {value}", self.0)) }
    }

    /// Refuses a length that is not more than 0.
    fn length(&self, key: &str, value: f64) -> Result<(), String> {
        self.require(key, value, value > 0.0 && value <= FARTHEST, &format!("more than 0 and at most {FARTHEST}"))
    }

    fn length_or_zero(&self, key: &str, value: f64) -> Result<(), String> {
        self.within(key, value, 0.0, FARTHEST)
    }

    fn point(&self, key: &str, p: &[f64; 3]) -> Result<(), String> {
        (0..3).try_for_each(|k| self.within(&format!("{key}[{k}]"), p[k], -FARTHEST, FARTHEST))
    }

    fn pose(&self, key: &str, pose: &PoseFile) -> Result<(), String> {
        self.point(&format!("{key}.translation_mm"), &pose.translation_mm)?;
        self.direction(&format!("{key}.rotation_axis"), &pose.rotation_axis)?;
        self.within(&format!("{key}.rotation_deg"), pose.rotation_deg, -360.0, 360.0)
    }

    fn direction(&self, key: &str, v: &[f64; 3]) -> Result<(), String> {
        let length_sq: f64 = v.iter().map(|c| c * c).sum();
        if length_sq > 0.0 && length_sq.is_finite() {
            Ok(())
        } else {
            Err(format!("{}.{key}: must be a direction, is {v:?}", self.0))
        }
    }
}

fn check_setup(at: &Field, setup: &SetupFile) -> Result<(), String> {
    check_limits(at, &SETUP_LIMITS, setup)?;
    at.pose("work_from_part", &setup.work_from_part)?;
    at.pose("table_from_work", &setup.table_from_work)?;
    let offsets = &setup.work_offset;
    for (letter, value) in &offsets.linear_mm {
        at.within(&format!("work_offset.linear_mm.{letter}"), *value, -FARTHEST, FARTHEST)?;
    }
    for (letter, value) in &offsets.rotary_deg {
        at.within(&format!("work_offset.rotary_deg.{letter}"), *value, -360.0, 360.0)?;
    }
    if !setup.meshes.iter().any(|m| m.role == RoleFile::Drive) {
        return Err(format!("{}.meshes: one with role \"drive\" is needed", at.0));
    }
    for (k, mesh) in setup.meshes.iter().enumerate() {
        let key = format!("meshes[{k}].allowance_mm");
        at.length_or_zero(&key, mesh.allowance_mm)?;
        if mesh.role == RoleFile::Datum && mesh.allowance_mm > 0.0 {
            return Err(format!("{}.{key}: a datum is finished, so leave this out", at.0));
        }
        let drive = setup.meshes.iter().find(|m| m.role == RoleFile::Drive);
        if mesh.role == RoleFile::Drive && drive.is_some_and(|d| d.allowance_mm != mesh.allowance_mm) {
            return Err(format!("{}.{key}: all drive surfaces of a setup must have the same", at.0));
        }
    }
    check_stock(at, &setup.stock)?;
    check_clearance(at, "clearance", &setup.clearance)?;
    setup.second_clearance.iter().try_for_each(|c| check_clearance(at, "second_clearance", c))
}

fn check_clearance(at: &Field, key: &str, clearance: &ClearanceFile) -> Result<(), String> {
    match clearance {
        ClearanceFile::Plane(p) => {
            at.point(&format!("{key}.plane.origin_mm"), &p.origin_mm)?;
            at.direction(&format!("{key}.plane.normal"), &p.normal)
        }
        ClearanceFile::Cylinder(c) => {
            at.point(&format!("{key}.cylinder.origin_mm"), &c.origin_mm)?;
            at.direction(&format!("{key}.cylinder.axis"), &c.axis)?;
            at.length(&format!("{key}.cylinder.radius_mm"), c.radius_mm)
        }
        ClearanceFile::Sphere(s) => {
            at.point(&format!("{key}.sphere.center_mm"), &s.center_mm)?;
            at.length(&format!("{key}.sphere.radius_mm"), s.radius_mm)
        }
    }
}

fn check_stock(at: &Field, stock: &StockFile) -> Result<(), String> {
    match stock {
        StockFile::Offset(s) => at.length_or_zero("stock.offset.allowance_mm", s.allowance_mm),
        StockFile::Box(s) => {
            at.point("stock.box.min_mm", &s.min_mm)?;
            at.point("stock.box.max_mm", &s.max_mm)?;
            (0..3).try_for_each(|k| at.positive("stock.box.max_mm minus min_mm", s.max_mm[k] - s.min_mm[k]))
        }
        StockFile::Cylinder(s) => {
            at.point("stock.cylinder.base_mm", &s.base_mm)?;
            at.direction("stock.cylinder.axis", &s.axis)?;
            at.length("stock.cylinder.radius_mm", s.radius_mm)?;
            at.length("stock.cylinder.height_mm", s.height_mm)
        }
        StockFile::Mesh(_) => Ok(()),
    }
}

fn check_operation(at: &Field, o: &OperationFile) -> Result<(), String> {
    check_limits(at, &OPERATION_LIMITS, o)?;
    if let PathFile::Strategy(s) = &o.path
        && s.linking == LinkingFile::Zigzag
        && o.direction != DirectionFile::Either
    {
        return Err(format!(
            "{}.path.strategy.linking: zigzag cuts climb and conventional by turns, so direction must be \"either\"",
            at.0
        ));
    }
    if o.keeps_axes() && o.direction != DirectionFile::Either {
        return Err(format!(
            "{}.path.cl.axes: kept cuts the passes as the file has them, so direction must be \"either\"; uncut_side says \
             where the uncut stock lies",
            at.0
        ));
    }
    if let Some(p) = &o.pattern {
        check_pattern(at, p)?;
    }
    check_search(at, o)?;
    at.positive("feeds.cutting_mm_min", o.feeds.cutting_mm_min)?;
    at.positive("feeds.approach_mm_min", o.feeds.approach_mm_min)?;
    check_feed_laws(at, &o.feeds)?;
    if let InfeasibleFile::Trim(trim) = &o.infeasible {
        at.within("infeasible.trim.max_trimmed_fraction", trim.max_trimmed_fraction, 0.0, 1.0)?;
    }
    Ok(())
}

/// Largest gouge tolerance as part of the cutter's radius: with more, the test body no longer
/// resembles the cutter.
const LARGEST_GOUGE: f64 = 0.1;

/// Returns the first tolerance of a tool's operations that does not fit its cutter, as `field: what
/// it must be`.
///
/// # Errors
/// If there is one.
pub fn check_gouge_tolerances(
    job: &JobFile,
    is_of: &dyn Fn(&OperationFile) -> bool,
    cutter_radius: f64,
) -> Result<(), String> {
    let mut of_tool = job.operations.iter().enumerate().filter(|(_, o)| is_of(o));
    of_tool.try_for_each(|(k, o)| {
        let at = Field(format!("operations[{k}]"));
        at.within("tolerances.gouge_mm", o.tolerances.gouge_mm, SMALLEST_TOLERANCE, LARGEST_GOUGE * cutter_radius)
            .map_err(|e| format!("{e} (at most a tenth of the cutter's radius)"))
    })
}

/// Refuses a pattern in which a place coincides with another one: it would be cut twice.
fn check_pattern(at: &Field, p: &PatternFile) -> Result<(), String> {
    at.point("pattern.origin_mm", &p.origin_mm)?;
    at.direction("pattern.axis", &p.axis)?;
    let turns = |k: u32| p.index_angle_deg * f64::from(k) / 360.0;
    match (1..p.copies).find(|&k| (turns(k) - turns(k).round()).abs() < 1e-9) {
        None => Ok(()),
        Some(k) => Err(format!(
            "{}.pattern: with an index angle of {} deg, place {} is the first one again; have at most {k} copies",
            at.0,
            p.index_angle_deg,
            k + 1
        )),
    }
}

/// Checks feeds against the range of F that the control accepts.
///
/// # Errors
/// If a feed is outside the range.
pub fn check_feeds(job: &JobFile, range: &FeedRange) -> Result<(), String> {
    for (k, o) in job.operations.iter().enumerate() {
        let at = Field::new("operations", k);
        let given = [("cutting_mm_min", o.feeds.cutting_mm_min), ("approach_mm_min", o.feeds.approach_mm_min)];
        for (key, feed) in given.into_iter().chain(feeds_of_chips(&o.feeds)) {
            at.within(&format!("feeds.{key}"), feed, range.min, range.max)
                .map_err(|e| format!("{e}, the range of F that the machine's control accepts"))?;
        }
    }
    Ok(())
}

/// Checks linearisation tolerances against the part that the rounding of linear words consumes.
///
/// # Errors
/// If nothing remains, so that no number of blocks would keep the tolerance.
pub fn check_rounding(job: &JobFile, rounding: &RoundingBound) -> Result<(), String> {
    let words = rounding.linear * 3f64.sqrt();
    match job.operations.iter().position(|o| o.tolerances.linearisation_mm <= words) {
        None => Ok(()),
        Some(k) => Err(format!(
            "operations[{k}].tolerances.linearisation_mm: is {}, but words with so few decimals alone may be {words:.6} mm \
             off; give a larger one, or more post.decimals.linear",
            job.operations[k].tolerances.linearisation_mm
        )),
    }
}

fn check_mode(at: &Field, mode: &PostureModeFile) -> Result<(), String> {
    match mode {
        PostureModeFile::Smallest | PostureModeFile::Smooth => Ok(()),
        PostureModeFile::Fixed(f) => {
            at.within("search.mode.fixed.lead_deg", f.lead_deg, -89.0, 89.0)?;
            at.within("search.mode.fixed.lean_deg", f.lean_deg, -89.0, 89.0)
        }
        PostureModeFile::Toward(AxisTargetFile::Point(p)) => {
            at.point("search.mode.toward.point.position_mm", &p.position_mm)
        }
        PostureModeFile::Toward(AxisTargetFile::Line(l)) => {
            at.point("search.mode.toward.line.origin_mm", &l.origin_mm)?;
            at.direction("search.mode.toward.line.direction", &l.direction)
        }
    }
}

fn check_search(at: &Field, o: &OperationFile) -> Result<(), String> {
    let s = &o.search;
    let [from, to] = s.tilt_deg;
    at.within("search.tilt_deg[0]", from, 0.0, 89.0)?;
    at.within("search.tilt_deg[1]", to, from, 89.0)?;
    let [from, to] = s.rotate_deg;
    for (k, rotate) in s.rotate_deg.into_iter().enumerate() {
        at.within(&format!("search.rotate_deg[{k}]"), rotate, 0.0, 180.0).map_err(|e| {
            format!(
                "{e}; it is how far the axis turns toward the uncut stock, and direction decides to which side that is"
            )
        })?;
    }
    at.within("search.rotate_deg[1]", to, from, 180.0)?;
    check_mode(at, &s.mode)?;
    if let Some(cone) = &s.tool_axis_cone {
        at.direction("search.tool_axis_cone.axis", &cone.axis)?;
        at.within("search.tool_axis_cone.half_angle_deg", cone.half_angle_deg, 0.0, 180.0)?;
    }
    Ok(())
}
