//! Checks of a job file's numbers that its types cannot express. Every message names the field and what it must be.

use crate::job_file::{
    ApproachFile, ClearanceFile, DirectionFile, InfeasibleFile, JOB_FORMAT, JobFile, LinkingFile, OperationFile,
    PathFile, RoleFile, SetupFile, StockFile,
};

/// First thing wrong with a job, as `field: what it must be`.
///
/// # Errors
/// When there is one.
pub(crate) fn validate(job: &JobFile) -> Result<(), String> {
    if job.format != JOB_FORMAT {
        return Err(format!("format: must be \"{JOB_FORMAT}\", is \"{}\"", job.format));
    }
    if job.setups.is_empty() {
        return Err("setups: at least one is needed".to_owned());
    }
    if job.operations.is_empty() {
        return Err("operations: at least one is needed".to_owned());
    }
    for (k, operation) in job.operations.iter().enumerate() {
        check_operation(&Field::new("operations", k), operation)?;
        check_setup_name(k, operation, job)?;
    }
    for (k, setup) in job.setups.iter().enumerate() {
        check_setup(&Field::new("setups", k), setup)?;
        if job.setups[..k].iter().any(|s| s.name == setup.name) {
            return Err(format!("setups[{k}].name: \"{}\" is the name of another setup", setup.name));
        }
        if !job.operations.iter().any(|o| belongs(o, setup, job)) {
            return Err(format!("setups[{k}]: no operation belongs to \"{}\"", setup.name));
        }
    }
    Ok(())
}

/// Whether an operation is machined in a setup.
pub(crate) fn belongs(operation: &OperationFile, setup: &SetupFile, job: &JobFile) -> bool {
    operation.setup.as_ref().map_or(job.setups.len() == 1, |name| *name == setup.name)
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

/// A place in the job file.
struct Field(String);

impl Field {
    fn new(list: &str, index: usize) -> Self {
        Self(format!("{list}[{index}]"))
    }

    fn positive(&self, key: &str, value: f64) -> Result<(), String> {
        self.require(key, value, value > 0.0, "more than 0")
    }

    fn not_negative(&self, key: &str, value: f64) -> Result<(), String> {
        self.require(key, value, value >= 0.0, "0 or more")
    }

    fn within(&self, key: &str, value: f64, min: f64, max: f64) -> Result<(), String> {
        self.require(key, value, (min..=max).contains(&value), &format!("from {min} to {max}"))
    }

    fn require(&self, key: &str, value: f64, holds: bool, what: &str) -> Result<(), String> {
        if holds && value.is_finite() { Ok(()) } else { Err(format!("{}.{key}: must be {what}, is {value}", self.0)) }
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
    at.positive("rapid_clearance_mm", setup.rapid_clearance_mm)?;
    at.direction("work_from_part.rotation_axis", &setup.work_from_part.rotation_axis)?;
    at.direction("table_from_work.rotation_axis", &setup.table_from_work.rotation_axis)?;
    if !setup.meshes.iter().any(|m| m.role == RoleFile::Drive) {
        return Err(format!("{}.meshes: one with role \"drive\" is needed", at.0));
    }
    for (k, mesh) in setup.meshes.iter().enumerate() {
        let key = format!("meshes[{k}].allowance_mm");
        at.not_negative(&key, mesh.allowance_mm)?;
        let drive = setup.meshes.iter().find(|m| m.role == RoleFile::Drive);
        if mesh.role == RoleFile::Drive && drive.is_some_and(|d| d.allowance_mm != mesh.allowance_mm) {
            return Err(format!("{}.{key}: all drive surfaces of a setup must have the same", at.0));
        }
    }
    match &setup.stock {
        StockFile::Offset(s) => at.not_negative("stock.offset.allowance_mm", s.allowance_mm)?,
        StockFile::Box(s) => {
            for k in 0..3 {
                at.positive("stock.box.max_mm minus min_mm", s.max_mm[k] - s.min_mm[k])?;
            }
        }
        StockFile::Cylinder(s) => {
            at.direction("stock.cylinder.axis", &s.axis)?;
            at.positive("stock.cylinder.radius_mm", s.radius_mm)?;
            at.positive("stock.cylinder.height_mm", s.height_mm)?;
        }
        StockFile::Mesh(_) => {}
    }
    match &setup.clearance {
        ClearanceFile::Plane(p) => at.direction("clearance.plane.normal", &p.normal),
        ClearanceFile::Cylinder(c) => {
            at.direction("clearance.cylinder.axis", &c.axis)?;
            at.positive("clearance.cylinder.radius_mm", c.radius_mm)
        }
        ClearanceFile::Sphere(s) => at.positive("clearance.sphere.radius_mm", s.radius_mm),
    }
}

fn check_operation(at: &Field, o: &OperationFile) -> Result<(), String> {
    match &o.path {
        PathFile::File(f) => at.not_negative("path.file.max_distance_mm", f.max_distance_mm)?,
        PathFile::Strategy(s) => {
            at.not_negative("path.strategy.edge_margin_mm", s.edge_margin_mm)?;
            at.not_negative("path.strategy.min_pass_length_mm", s.min_pass_length_mm)?;
            if s.linking == LinkingFile::Zigzag && o.direction != DirectionFile::Either {
                return Err(format!(
                    "{}.path.strategy.linking: zigzag cuts climb and conventional by turns, so direction must be \"either\"",
                    at.0
                ));
            }
        }
    }
    for (key, approach) in [("entry", &o.entry), ("exit", &o.exit)] {
        let (name, arc) = match approach {
            ApproachFile::TangentialArc(arc) => ("tangential_arc", arc),
            ApproachFile::RollIn(arc) => ("roll_in", arc),
        };
        at.positive(&format!("{key}.{name}.radius_mm"), arc.radius_mm)?;
        at.within(&format!("{key}.{name}.angle_deg"), arc.angle_deg, 1.0, 90.0)?;
    }
    if let Some(p) = &o.pattern {
        at.within("pattern.copies", f64::from(p.copies), 1.0, 1000.0)?;
        at.within("pattern.index_angle_deg", p.index_angle_deg, -360.0, 360.0)?;
        at.direction("pattern.axis", &p.axis)?;
    }
    check_search(at, o)?;
    at.positive("feeds.cutting_mm_min", o.feeds.cutting_mm_min)?;
    at.positive("feeds.approach_mm_min", o.feeds.approach_mm_min)?;
    at.positive("feeds.spindle_rpm", o.feeds.spindle_rpm)?;
    let t = &o.tolerances;
    at.not_negative("tolerances.mesh_chord_mm", t.mesh_chord_mm)?;
    at.positive("tolerances.path_chord_mm", t.path_chord_mm)?;
    at.positive("tolerances.max_step_mm", t.max_step_mm)?;
    at.positive("tolerances.linearisation_mm", t.linearisation_mm)?;
    at.positive("tolerances.gouge_mm", t.gouge_mm)?;
    at.not_negative("tolerances.max_lift_mm", t.max_lift_mm)?;
    at.positive("tolerances.cusp_mm", t.cusp_mm)?;
    at.positive("tolerances.max_step_over_mm", t.max_step_over_mm)?;
    if let InfeasibleFile::Trim(trim) = &o.infeasible {
        at.within("infeasible.trim.max_trimmed_fraction", trim.max_trimmed_fraction, 0.0, 1.0)?;
    }
    Ok(())
}

fn check_search(at: &Field, o: &OperationFile) -> Result<(), String> {
    let s = &o.search;
    let [from, to] = s.tilt_deg;
    at.within("search.tilt_deg[0]", from, 0.0, 89.0)?;
    at.within("search.tilt_deg[1]", to, from, 89.0)?;
    for (k, rotate) in s.rotate_deg.into_iter().enumerate() {
        at.within(&format!("search.rotate_deg[{k}]"), rotate, -180.0, 180.0)?;
    }
    let [from, to] = s.rotate_deg;
    if from * to < 0.0 || from.abs() > to.abs() {
        return Err(format!(
            "{}.search.rotate_deg: must run away from 0 on one side of it, is {:?}",
            at.0, s.rotate_deg
        ));
    }
    at.positive("search.weight", s.weight)?;
    at.within("search.u_step", s.u_step, 0.001, 1.0)?;
    at.within("search.u_tolerance", s.u_tolerance, 1e-6, 1.0)?;
    at.positive("search.max_turn_deg_per_mm", s.max_turn_deg_per_mm)?;
    if let Some(cone) = &s.tool_axis_cone {
        at.direction("search.tool_axis_cone.axis", &cone.axis)?;
        at.within("search.tool_axis_cone.half_angle_deg", cone.half_angle_deg, 0.0, 180.0)?;
    }
    Ok(())
}
