//! Moves between two stops that are known, and their law.

use facemill_cl_data::{ControlTolerance, RapidLaw};
use facemill_feedrate::{
    AxisBounds, DeviationSettings, MissingLimit, MotionLimit, ProgramBlock, ProgramSettings, TrapezoidSettings,
    deviation_law, machine_bounds, program_law, program_law_of, trapezoid_law, within_look_ahead,
};
use facemill_inverse_kinematics::{Axis, AxisKind, AxisValues, Machine};
use facemill_nc_program::dialect::{ControlMotion, CornerRule, LimitedBy, RotaryBlocks};

use crate::program_time::tolerance::{Levers, MachineView, blend_tolerance, moving};
use crate::program_time::vectors::{Evened, VectorRounding, evened};

/// Moves of one kind, between which the axes need not stand.
pub struct MotionRun {
    /// Where the first one starts.
    pub start: AxisValues,
    /// The moves; their least times are those of their feeds.
    pub blocks: Vec<ProgramBlock>,
    /// Whether they are rapids.
    pub is_rapid: bool,
    /// The tool axis that each move's text says in place of rotary words, frame of the words; empty
    /// where none does.
    pub vectors: Vec<Option<[f64; 3]>>,
}

/// The law of a run, move by move.
pub struct RunLaw {
    /// Times, s.
    pub times: Vec<f64>,
    /// Times at the largest speed of each move, s.
    pub peak_times: Vec<f64>,
    /// Limiting factor of each; `None` without motion. Empty if not requested, and in rapids.
    pub limits: Vec<Option<MotionLimit>>,
    /// Whether the axes stop at every corner, for want of a tolerance that counts.
    pub stops_at_corners: bool,
}

/// Times runs on a machine.
pub struct Timer<'a> {
    views: &'a [MachineView<'a>],
    bounds: Vec<AxisBounds>,
    tolerance: ControlTolerance,
    /// How the control runs its blocks; `None`: jerk limited, with all of them in sight.
    control: Option<ControlMotion>,
    rapid: RapidLaw,
    /// Uncertainty of the text's tool vectors; `None` if they are exact.
    rounding: Option<VectorRounding>,
    /// Whether the result holds the limiting factor of each move.
    tells_limits: bool,
}

/// Limits of axes that a machine file does not give, without which there is no law.
pub fn missing_limits(machine: &Machine) -> Vec<MissingLimit> {
    let missing = |axis: &facemill_inverse_kinematics::Axis| {
        let limits = [("acceleration", axis.max_acceleration), ("jerk", axis.max_jerk)];
        let letter = axis.letter;
        limits.into_iter().filter(|(_, limit)| limit.is_none()).map(move |(what, _)| MissingLimit { letter, what })
    };
    machine.axes().iter().flat_map(missing).collect()
}

impl<'a> Timer<'a> {
    /// A machine as each of its heads sees it, with the length of its tool; corners are blended
    /// within `tolerance`.
    ///
    /// # Errors
    /// The first axis without a limit.
    pub fn new(views: &'a [MachineView<'a>], tolerance: ControlTolerance) -> Result<Self, MissingLimit> {
        let bounds = views.first().map_or_else(|| Ok(Vec::new()), |(machine, _)| machine_bounds(machine))?;
        let rapid = views.first().map_or(RapidLaw::Linear, |(machine, _)| machine.motion_law().rapid);
        Ok(Self { views, bounds, tolerance, control: None, rapid, rounding: None, tells_limits: true })
    }

    /// The same without the limiting factor of each move, which takes as long as half of the law.
    pub fn without_limits(self) -> Self {
        Self { tells_limits: false, ..self }
    }

    /// The same on a control that runs its blocks so.
    pub fn on_control(self, control: &ControlMotion) -> Self {
        Self { control: Some(control.clone()), ..self }
    }

    /// The same where vectors are evened out within their rounding.
    pub fn with_rounded_vectors(self, rounding: Option<VectorRounding>) -> Self {
        Self { rounding, ..self }
    }

    /// The law of a run, from rest to rest.
    ///
    /// # Errors
    /// If a block has a fault, which the message names.
    pub fn time(&self, run: &MotionRun) -> Result<RunLaw, String> {
        if run.is_rapid && self.rapid == RapidLaw::PerAxis {
            return self.each_axis_on_its_own(run);
        }
        // Where too little is left for blends, the axes stop at every corner, and so where the text
        // puts it.
        let evened = self.evened(run).and_then(|e| self.blend(&e.run, e.tolerance).map(|blend| (e.run, blend)));
        let (run, blend) = match &evened {
            Some((evened, blend)) => (evened, Some(*blend)),
            None => (run, self.blend(run, self.tolerance)),
        };
        if let Some(control) = self.control.as_ref().filter(|c| c.limited_by == LimitedBy::Acceleration) {
            return self.by_trapezoids(run, control);
        }
        let stops_at_corners = blend.is_none();
        let settings = blend.map_or_else(ProgramSettings::stopping, ProgramSettings::blended);
        let seen = self.seen(run);
        let law = match &seen {
            None => program_law(&run.start, &run.blocks, &self.bounds, &settings),
            Some(times) => {
                let blocks = (0..run.blocks.len()).map(|k| self.seen_block(run, times, k));
                program_law_of(&run.start, blocks, &self.bounds, &settings)
            }
        };
        let law = law.map_err(|e| e.to_string())?;
        drop(seen);
        let limits = if run.is_rapid || !self.tells_limits { Vec::new() } else { law.block_limits(&self.bounds) };
        let limits = limits.into_iter().map(|held| held.map(|(limit, _)| limit)).collect();
        Ok(RunLaw { times: law.block_times(), peak_times: law.block_peak_times().to_vec(), limits, stops_at_corners })
    }

    /// Least times of the blocks by what the control's look-ahead makes of them; `None` where it
    /// runs them as they are.
    fn seen(&self, run: &MotionRun) -> Option<Vec<f64>> {
        let control = self.control.as_ref()?;
        let look_ahead = control.look_ahead_blocks as usize;
        let stops = control.rotary_blocks == RotaryBlocks::Stopped;
        (stops || run.blocks.len() > look_ahead)
            .then(|| within_look_ahead(&run.start, &run.blocks, &self.bounds, look_ahead))
    }

    /// A block as the control runs it, with its stops at rotary blocks and a least time.
    fn seen_block(&self, run: &MotionRun, times: &[f64], index: usize) -> ProgramBlock {
        let axes = self.views.first().map_or(&[][..], |(machine, _)| machine.axes());
        let turns = |k: usize| {
            let from = if k == 0 { &run.start } else { &run.blocks[k - 1].end };
            let is_turned =
                |(axis, of): (usize, &Axis)| of.kind != AxisKind::Linear && from[axis] != run.blocks[k].end[axis];
            axes.iter().enumerate().any(is_turned)
        };
        let stops = self.control.as_ref().is_some_and(|control| control.rotary_blocks == RotaryBlocks::Stopped);
        let block = run.blocks[index];
        let is_stop = stops && (turns(index) || (index + 1 < run.blocks.len() && turns(index + 1)));
        ProgramBlock { tip_time: times[index], exact_stop: block.exact_stop || is_stop, ..block }
    }

    /// The law of a control that limits acceleration alone.
    fn by_trapezoids(&self, run: &MotionRun, control: &ControlMotion) -> Result<RunLaw, String> {
        let look_ahead = control.look_ahead_blocks as usize;
        let is_linear = self.linear_axes();
        let axes = (self.bounds.as_slice(), is_linear.as_slice());
        let keeps_to_lines = control.corners == CornerRule::JunctionDeviation;
        let law = if keeps_to_lines {
            let deviation = f64::from(control.junction_deviation_um) * 1e-3;
            let small_segments = f64::from(control.small_segments_mm);
            let settings = DeviationSettings { deviation, small_segments, look_ahead };
            deviation_law(&run.start, &run.blocks, axes, &settings)
        } else {
            let (tolerance, cycle) = (self.tolerance.path, f64::from(control.cycle_us) * 1e-6);
            trapezoid_law(&run.start, &run.blocks, axes, &TrapezoidSettings { tolerance, look_ahead, cycle })
        };
        let law = law.map_err(|e| e.to_string())?;
        let limits = if run.is_rapid || !self.tells_limits { Vec::new() } else { law.limits };
        let stops_at_corners = !keeps_to_lines && self.tolerance.path <= 0.0;
        Ok(RunLaw { times: law.times, peak_times: law.peak_times, limits, stops_at_corners })
    }

    /// Which axes are linear.
    fn linear_axes(&self) -> Vec<bool> {
        let axes = self.views.first().map_or(&[][..], |(machine, _)| machine.axes());
        axes.iter().map(|axis| axis.kind == AxisKind::Linear).collect()
    }

    /// The run without the steps that rounding makes in its vectors; `None` where it stays as it
    /// is.
    fn evened(&self, run: &MotionRun) -> Option<Evened> {
        // Vectors are followed on machines with one head.
        let ([view], Some(rounding)) = (self.views, &self.rounding) else { return None };
        evened(*view, run, rounding, self.tolerance)
    }

    /// Returns the distance that every axis may keep from the lines of a run; `None` for none.
    fn blend(&self, run: &MotionRun, tolerance: ControlTolerance) -> Option<AxisValues> {
        let levers: Vec<Levers> = self.views.iter().map(|view| Levers::over(*view, run)).collect();
        let moving = self.views.first().map(|(machine, _)| moving(machine, run))?;
        blend_tolerance(tolerance, self.views, &levers, &moving)
    }

    /// Rapids in which every axis goes from stop to stop as fast as it can; the slowest one's time
    /// counts.
    fn each_axis_on_its_own(&self, run: &MotionRun) -> Result<RunLaw, String> {
        let mut at = run.start;
        let mut times = Vec::with_capacity(run.blocks.len());
        for block in &run.blocks {
            let mut time = 0.0_f64;
            for (k, bounds) in self.bounds.iter().enumerate() {
                let [start, end] = [at[k], block.end[k]].map(|q| AxisValues::from([q]));
                let alone = [ProgramBlock { end, tip_time: 0.0, exact_stop: true }];
                let law = program_law(&start, &alone, &[*bounds], &ProgramSettings::stopping());
                time = time.max(law.map_err(|e| e.to_string())?.total_time());
            }
            times.push(time);
            at = block.end;
        }
        Ok(RunLaw { peak_times: times.clone(), times, limits: Vec::new(), stops_at_corners: true })
    }
}
