//! Figures of the motions of a page.

use std::collections::HashMap;

use facemill_cl_data::ClPoint;
use facemill_job::failure::Failure;
use facemill_job::stages::SilentStages;
use facemill_nc_program::ReadProgram;
use facemill_verification::remaining::{LeftByLine, RunningHead, remaining};
use facemill_virtual_machine::VerifySettings;
use rayon::prelude::*;
use serde_json::Value;

use crate::clearance::{FARTHEST, end_clearances};
use crate::contact::{TOUCHES_WITHIN, tilt_to_surface};
use crate::document::{MOST, PageScene, PageSource};
use crate::format::FigureData;
use crate::line_figures::{LineChip, LineProof, chips, left_along, proofs};
use crate::motion::{ProgramMotion, Segment, SegmentKind, TipPath, tip_path};
use crate::packed::Arrays;

/// Measurements of motions.
pub(super) struct MotionMeasures {
    /// Path of each head's tip.
    pub(super) paths: Vec<TipPath>,
    /// Poses of the first head at the ends of cuts, with the indices of their motions.
    pub(super) cut_poses: Vec<(u32, ClPoint)>,
    /// Straight distance of the tip in each cut, mm; of several heads the longest.
    ways: Vec<Option<f64>>,
    /// Clearances at ends, if they are wanted and not too many.
    clearances: Option<Vec<Option<f64>>>,
    /// Tilt to the surface at ends, deg, if they are not too many.
    tilts: Option<Vec<Option<f64>>>,
    /// Heights that are left beside blocks, if the report says what is left.
    left: Option<LeftByLine>,
}

impl MotionMeasures {
    /// Returns the speed of the tip in each cut, mm/min.
    fn speeds(&self, segments: &[Segment]) -> Vec<Option<f64>> {
        let speed = |(s, way): (&Segment, &Option<f64>)| {
            let way = way.filter(|way| *way > 1e-6 && s.time > 1e-6)?;
            Some(60.0 * way / s.time)
        };
        segments.iter().zip(&self.ways).map(speed).collect()
    }
}

impl PageScene<'_> {
    /// Measures the motions of a program.
    ///
    /// # Errors
    /// If the material that is left cannot be measured.
    pub(super) fn measured(
        &self,
        motion: &ProgramMotion,
        source: &PageSource<'_>,
        program: &ReadProgram,
    ) -> Result<MotionMeasures, Failure> {
        let (setup, segments, poses) = (self.scene.setup, &motion.segments, self.poses());
        let way = |s: &Segment| {
            let ways = poses.iter().map(|(poses, _)| (poses.at(&s.to).tip - poses.at(&s.from).tip).norm());
            (s.kind == SegmentKind::Cut).then(|| ways.fold(0.0, f64::max))
        };
        let are_few = segments.len() <= MOST.clearances;
        let is_proven = source.certificates.as_ref().is_some_and(|file| !proofs(file).is_empty());
        let clearances = (are_few && !is_proven).then(|| end_clearances(segments, setup, &self.heads));
        let tilt = |s: &Segment| {
            if s.kind != SegmentKind::Cut {
                return None;
            }
            let of_head = poses.iter().filter_map(|(poses, tool)| {
                tilt_to_surface(&poses.at(&s.to), tool, &setup.around_drive, setup.drive_allowance)
            });
            // Of two heads one alone cuts, or both do the same.
            of_head.reduce(f64::max)
        };
        let cuts = (0_u32..).zip(segments).filter(|(_, s)| s.kind == SegmentKind::Cut);
        let cut_poses = poses.first().map(|(poses, _)| cuts.map(|(k, s)| (k, poses.at(&s.to))).collect());
        let tilts = are_few.then(|| segments.par_iter().map(tilt).collect());
        Ok(MotionMeasures {
            paths: poses.iter().map(|(poses, _)| tip_path(poses, motion, MOST.points)).collect(),
            cut_poses: cut_poses.unwrap_or_default(),
            ways: segments.par_iter().map(way).collect(),
            clearances,
            tilts,
            left: self.left(source, program)?,
        })
    }

    /// Returns the heights that are left: as given, or measured as the verification does.
    fn left(&self, source: &PageSource<'_>, program: &ReadProgram) -> Result<Option<LeftByLine>, Failure> {
        if source.left.is_some() || source.result.get("remaining").is_none_or(Value::is_null) {
            return Ok(source.left.clone());
        }
        let settings = VerifySettings { is_whole: true, ..VerifySettings::default() };
        let setups: Vec<_> = self.scenes.iter().map(|scene| scene.virtual_setup(source.dialect)).collect();
        let heads: Vec<RunningHead<'_>> = setups.iter().map(|at| RunningHead { at, settings: &settings }).collect();
        let found = remaining(self.scene.job, self.scene.setup, program, &heads, &SilentStages)?;
        Ok(found.map(|found| found.by_line))
    }

    /// Returns the figures of motions.
    pub(super) fn figures(
        &self,
        segments: &[Segment],
        (source, measured, of_lines): (&PageSource<'_>, &MotionMeasures, HashMap<u32, LineProof>),
        arrays: &mut Arrays,
        not_shown: &mut Vec<String>,
    ) -> Vec<FigureData> {
        let chips: HashMap<u32, LineChip> =
            source.chips.map(|csv| chips(&String::from_utf8_lossy(csv))).unwrap_or_default();
        let mut figures = Vec::new();
        let mut add = |(key, name, unit, low_is_critical): (&'static str, &'static str, &'static str, bool),
                       note: String,
                       (values, step): (Vec<Option<f64>>, f64)| {
            if let Some(values) = arrays.numbers_with_gaps(&values, step) {
                figures.push(FigureData { key, name, unit, low_is_critical, note, values });
            }
        };
        let of_line = |value: &dyn Fn(u32) -> Option<f64>| segments.iter().map(|s| value(s.line)).collect::<Vec<_>>();
        if of_lines.is_empty() {
            not_shown.push(
                "certified depths and clearances of blocks: plan or view with --certificates to have them".to_owned(),
            );
            if let Some(values) = &measured.clearances {
                let note = format!(
                    "nearest of tool body, holder and head to part, check surfaces and fixtures, up to {FARTHEST} mm, measured at \
                     the ends of blocks alone"
                );
                add(("clearance", "clearance at block end", "mm", true), note, (values.clone(), 1e-3));
            } else {
                not_shown.push(format!("clearances at block ends: there are more than {} blocks", MOST.clearances));
            }
        } else {
            let depth = of_line(&|line| of_lines.get(&line).and_then(|p| p.depth_with_control.or(p.depth)));
            let has_control = of_lines.values().all(|p| p.depth.is_none() || p.depth_with_control.is_some());
            let note = if has_control {
                "no point of the cutter is ever deeper in the block, the tolerance of the control included, proven"
            } else {
                "no point of the cutter is ever deeper in the block, proven; of some blocks without the tolerance of the \
                 control"
            }
            .to_owned();
            add(("depth", "certified gouge depth", "mm", false), note, (depth, 1e-4));
            let clearance = of_line(&|line| of_lines.get(&line)?.clearance);
            let note = "no body ever comes nearer in the block, proven".to_owned();
            add(("clearance", "certified clearance", "mm", true), note, (clearance, 1e-3));
        }
        let note = "straight distance of the tip over the time of the block".to_owned();
        add(("tip", "tip speed", "mm/min", false), note, (measured.speeds(segments), 0.1));
        if let Some(left) = &measured.left {
            let note = format!(
                "highest material left on the surface beside the block, over places {:.2} mm apart of which it or a block \
                 within that distance cuts each lowest, measured on the text; what is narrower may be missed",
                left.spacing_mm
            );
            let lines: Vec<u32> = segments.iter().map(|s| s.line).collect();
            let values = left_along(&measured.ways, &lines, left);
            add(("left", "cusp left beside the block", "mm", false), note, (values, 1e-4));
        } else {
            not_shown.push("cusps along passes: the report does not say what the program leaves".to_owned());
        }
        if let Some(tilts) = &measured.tilts {
            let note = format!(
                "between tool axis and normal of the surface at the point of contact, at the end of the block; of blocks \
                 that touch the part within {TOUCHES_WITHIN} mm there"
            );
            add(("surface_tilt", "tilt to the surface", "°", false), note, (tilts.clone(), 1e-3));
        } else {
            not_shown.push(format!("tilt to the surface: there are more than {} blocks", MOST.clearances));
        }
        let note = "section of the chip across the feed, the largest of the line".to_owned();
        add(("chip", "chip section", "mm²", false), note, (of_line(&|line| chips.get(&line)?.area), 1e-3));
        let note = "at the written feed".to_owned();
        let rate = of_line(&|line| chips.get(&line)?.removal_rate);
        add(("removal", "removal rate", "cm³/min", false), note, (rate, 1e-3));
        figures
    }
}
