//! The staircase that rounding makes of tool vectors, evened out within the decimals of the text.

#[cfg(test)]
#[path = "../../tests/unit/program_time/vectors_laws.rs"]
mod laws;

use facemill_cl_data::{ClPoint, ControlTolerance};
use facemill_feedrate::{ProgramBlock, smoothest_within};
use facemill_inverse_kinematics::AxisValues;
use nalgebra::{Isometry3, Unit, Vector3};

use crate::program_time::run::MotionRun;
use crate::program_time::tolerance::{MachineView, stops_at_corners};

/// Decimals at most that a component is looked at for: beyond them it is no rounded number but a
/// computed one.
const MOST_DECIMALS: i32 = 12;

/// Arm on which turns of the tool count as ways, mm: where the tip moves, its way decides; where it
/// rests, the turn does. On a longer one the steps of the vectors would make the lengths uneven.
const ARM: f64 = 10.0;

/// Least length of a move, mm: lengths are to grow.
const SHORTEST: f64 = 1e-6;

/// Largest difference of equal vectors: the accuracy of solved positions.
const STILL: f64 = 1e-12;

/// Decimals that a program has at least: where all components have fewer, as 0.6 and 0.8 do, they
/// are exact numbers rather than rounded ones. Fewer would let a control without a tolerance of its
/// own turn far.
const LEAST_DECIMALS: i32 = 4;

/// With how many decimals a program says its tool vectors: the most that any component has.
#[derive(Clone, Copy, Debug)]
pub struct VectorDecimals(i32);

impl Default for VectorDecimals {
    fn default() -> Self {
        Self(LEAST_DECIMALS)
    }
}

impl VectorDecimals {
    /// Counts a vector in.
    pub fn read(&mut self, vector: &[f64; 3]) {
        for component in vector {
            while self.0 < MOST_DECIMALS && (component * self.scale()).round() / self.scale() != *component {
                self.0 += 1;
            }
        }
    }

    fn scale(self) -> f64 {
        10f64.powi(self.0)
    }

    /// Returns the largest error of a component: half of the last decimal.
    pub fn half(self) -> f64 {
        0.5 / self.scale()
    }
}

/// Uncertainty of the text's tool vectors.
#[derive(Clone, Copy, Debug)]
pub struct VectorRounding {
    /// Frame of the vectors on the table.
    pub table_from_words: Isometry3<f64>,
    /// Largest error of each component.
    pub half: f64,
}

/// A run whose rotary axes go smoothly within the rounding of its vectors.
pub struct Evened {
    /// The run with other positions at the ends of its moves: of the same tip, and of a vector that
    /// has the same text.
    pub run: MotionRun,
    /// Rest of the control's tolerance for blends.
    pub tolerance: ControlTolerance,
}

/// Places of a run's moves over its length; moves without a way end at the place of the one before.
struct Places {
    at: Vec<f64>,
    /// Unit tool axis, frame of the words.
    axes: Vec<Vector3<f64>>,
    /// Largest error of each of its components.
    widths: Vec<f64>,
    /// Place at the end of each move.
    of_moves: Vec<usize>,
}

/// The positions of a run taken so that its tool axis turns smoothly within what rounding leaves
/// open. Every component of a vector stays within half of its last decimal, and the tool's
/// direction within half of the control's tolerance, by which a control evens out such steps
/// itself; the tip stays where its words put it. Both ends of the run and positions of rotary words
/// stay as they are.
///
/// `None` where there is nothing to even out: no vectors, or a control without a tolerance, which
/// stops at every step.
pub fn evened(
    view: MachineView<'_>,
    run: &MotionRun,
    rounding: &VectorRounding,
    tolerance: ControlTolerance,
) -> Option<Evened> {
    if run.is_rapid || stops_at_corners(tolerance) || run.vectors.iter().all(Option::is_none) {
        return None;
    }
    // Three components of this width together turn a unit vector by no more than half of the
    // tolerance.
    let most = (0.5 * tolerance.orientation).sin() / 3f64.sqrt();
    let places = Places::of(view, run, rounding, most);
    let smooth = [0, 1, 2].map(|k| {
        let components: Vec<f64> = places.axes.iter().map(|axis| axis[k]).collect();
        smoothest_within(&places.at, &components, &places.widths)
    });
    let even = |(place, block): (&usize, &ProgramBlock)| {
        let axis = Vector3::from([0, 1, 2].map(|k| smooth[k][*place]));
        let stays = (axis - places.axes[*place]).norm() <= STILL;
        ProgramBlock { end: if stays { block.end } else { turned(view, rounding, &block.end, &axis) }, ..*block }
    };
    let blocks = places.of_moves.iter().zip(&run.blocks).map(even).collect();
    let widest = places.widths.iter().fold(0.0, |most: f64, w| most.max(*w));
    let orientation = tolerance.orientation - (3f64.sqrt() * widest).min(1.0).asin();
    let run = MotionRun { start: run.start, blocks, is_rapid: false, vectors: Vec::new() };
    Some(Evened { run, tolerance: ControlTolerance { orientation, ..tolerance } })
}

impl Places {
    fn of((machine, tool_length): MachineView<'_>, run: &MotionRun, rounding: &VectorRounding, most: f64) -> Self {
        let in_words = |cl: &ClPoint| rounding.table_from_words.inverse_transform_vector(&cl.axis);
        let (mut before, mut cl) = (run.start, machine.cl_point(&run.start, tool_length));
        let mut places = Self { at: vec![0.0], axes: vec![in_words(&cl)], widths: vec![0.0], of_moves: Vec::new() };
        for (block, vector) in run.blocks.iter().zip(&run.vectors) {
            if block.end != before {
                let next = machine.cl_point(&block.end, tool_length);
                let (axis, width) = match vector.map(Vector3::from) {
                    Some(v) => (v / v.norm(), (rounding.half / v.norm()).min(most)),
                    None => (in_words(&next), 0.0),
                };
                places.at.push(places.at[places.at.len() - 1] + length(&cl, &next));
                places.axes.push(axis);
                places.widths.push(width);
                (before, cl) = (block.end, next);
            }
            places.of_moves.push(places.at.len() - 1);
        }
        // The next run starts there.
        if let Some(last) = places.widths.last_mut() {
            *last = 0.0;
        }
        places
    }
}

/// Length of a move, mm: the way of the tip and the turn of the tool on a short arm. Axis values
/// would not do, as the steps that are to be evened out are in them, times their levers.
fn length(from: &ClPoint, to: &ClPoint) -> f64 {
    let (way, turn) = ((to.tip - from.tip).norm(), (to.axis.into_inner() - from.axis.into_inner()).norm());
    way.hypot(ARM * turn).max(SHORTEST)
}

/// The position with the same tip and this tool axis (frame of the words) next to `end`; `end`
/// where that is not clear, which is so at the rim of the cone around the pole alone.
fn turned(
    (machine, tool_length): MachineView<'_>,
    rounding: &VectorRounding,
    end: &AxisValues,
    axis: &Vector3<f64>,
) -> AxisValues {
    let axis = Unit::new_normalize(rounding.table_from_words * axis);
    let cl = ClPoint { axis, ..machine.cl_point(end, tool_length) };
    machine.control_choice(end, &cl, tool_length).unwrap_or(*end)
}
