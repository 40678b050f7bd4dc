//! Maps of feasible postures of a plan, at their motions.

use facemill_cl_data::ClPoint;
use facemill_job::format::solution_space_file::{POSTURE_MAPS_FORMAT, PostureMap};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use serde_json::Value;

use crate::format::{PostureMapData, PosturesData};

/// Distance of a motion's end from the tip of a map, mm, and turn of the axes, rad, within which
/// they are the same pose.
const SAME: [f64; 2] = [0.02, 1e-3];

/// Returns the maps of a file; `poses` are those at the ends of cuts, with the index of the motion.
/// Maps at whose pose no motion ends have none.
pub(crate) fn postures(file: &Value, poses: &[(u32, ClPoint)]) -> Result<PosturesData, String> {
    if file.get("format").and_then(Value::as_str) != Some(POSTURE_MAPS_FORMAT) {
        return Err(format!("its format is not \"{POSTURE_MAPS_FORMAT}\""));
    }
    let maps = file.get("maps").cloned().unwrap_or_default();
    let maps: Vec<PostureMap> = serde_json::from_value(maps).map_err(|e| e.to_string())?;
    if let Some(map) = maps.iter().find(|map| map.cells.len() != map.n_cells[0] * map.n_cells[1]) {
        return Err(format!("the map of pass {} has not as many cells as it says", map.pass));
    }
    let curves = file.get("curves_deg").cloned().unwrap_or_default();
    let curves_deg: Vec<Vec<[f64; 2]>> = serde_json::from_value(curves).map_err(|e| e.to_string())?;
    if let Some(map) = maps.iter().find(|map| map.curve >= curves_deg.len()) {
        return Err(format!("the map of pass {} has no curve", map.pass));
    }
    let motions: Vec<Option<u32>> = maps.par_iter().map(|map| motion_of(map, poses)).collect();
    let n_passes = file.get("n_passes").and_then(Value::as_u64).unwrap_or(0) as usize;
    let data = |(map, motion)| PostureMapData { motion, map };
    Ok(PosturesData { n_passes, curves_deg, maps: maps.into_iter().zip(motions).map(data).collect() })
}

fn motion_of(map: &PostureMap, poses: &[(u32, ClPoint)]) -> Option<u32> {
    let (tip, axis) = (Point3::from(map.tip_mm), Vector3::from(map.axis));
    let distance = |pose: &ClPoint| (pose.tip - tip).norm_squared();
    let near = poses.iter().filter(|(_, pose)| pose.axis.angle(&axis) <= SAME[1]);
    let (motion, pose) = near.min_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)))?;
    (distance(pose) <= SAME[0] * SAME[0]).then_some(*motion)
}
