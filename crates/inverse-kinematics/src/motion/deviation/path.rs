use facemill_cl_data::ClPoint;

use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::motion::deviation::{Block, Deviation, Meant, angle_of_chord, chord_of_angle, parts_for};
use crate::motion::per_axis;

/// Length that compares a turn with a way of the tip where the nearest pose of the ideal motion is
/// chosen, mm: about that of a tool. Any value gives a bound; a much smaller or larger one allows
/// the axis or the tip more deviation than necessary.
const LEVER: f64 = 100.0;

/// Returns the bound for a motion in which each axis stops at its own time.
pub(super) fn from_path(machine: &Machine, start: &AxisValues, end: &AxisValues, tool_length: f64) -> Deviation {
    let total = machine.travel_time(start, end);
    if total <= 0.0 {
        return Deviation::default();
    }
    let meant = Meant::new(machine, start, end, tool_length);
    let mut times: Vec<f64> = (0..start.len())
        .map(|k| (end.get_or_zero(k) - start[k]).abs() / machine.axes()[k].max_velocity / total)
        .filter(|&t| t > 0.0 && t < 1.0)
        .chain([1.0])
        .collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let at = |t: f64| machine.cl_point(&per_axis(machine, start, end, t), tool_length);
    // The real deviation at the bends decides the necessary sharpness of the bound.
    let bends = times.iter().map(|&t| meant.deviation_from_path(&at(t)));
    let found = bends.fold(Deviation::default(), |worst, here| worst.max(&here));
    let mut worst = Deviation::default();
    let mut from = 0.0;
    for to in times {
        let piece = [from, to].map(|t| per_axis(machine, start, end, t));
        worst = worst.max(&piece_bound(machine, &meant, &piece, tool_length, &found));
        from = to;
    }
    worst
}

/// Bounds a piece in which all moving axes move evenly.
fn piece_bound(
    machine: &Machine,
    meant: &Meant,
    [start, end]: &[AxisValues; 2],
    tool_length: f64,
    found: &Deviation,
) -> Deviation {
    let block = Block::new(machine, start, end, tool_length);
    let at = |t: f64| {
        let cl = machine.cl_point(&start.lerp(end, t), tool_length);
        let s = meant.fraction_near(&cl);
        (s, meant.deviation(&cl, s))
    };
    let found = found.max(&meant.deviation_from_path(&block.middle));
    let (first, last) = (at(0.0), at(1.0));
    let angle = meant.turn.angle;
    let curvature = Deviation {
        tip: block.tip().largest_second() / 8.0,
        axis: (block.axis().largest_second() + (angle * (last.0 - first.0)).powi(2)) / 8.0,
    };
    let n = parts_for(&curvature, &found);
    let within = 1.0 / (n * n) as f64;
    let axis_second = block.axis().largest_second() * within;
    let mut before = first;
    let mut worst = Deviation::default();
    for k in 1..=n {
        let here = if k == n { last } else { at(k as f64 / n as f64) };
        let ends = before.1.max(&here.1);
        let turn = angle * (here.0 - before.0);
        let chord = chord_of_angle(ends.axis) + (axis_second + turn * turn) / 8.0;
        worst = worst.max(&Deviation { tip: ends.tip + curvature.tip * within, axis: angle_of_chord(chord) });
        before = here;
    }
    worst
}

impl Meant {
    /// Returns the place of a pose on the ideal way: the mean of the places nearest to its tip and
    /// to its axis, each with the weight of the square of its way.
    fn fraction_near(&self, cl: &ClPoint) -> f64 {
        let (tip_weight, axis_weight) = (self.tip_way.norm_squared(), (LEVER * self.turn.angle).powi(2));
        let weight = tip_weight + axis_weight;
        if weight <= 0.0 {
            return 0.0;
        }
        let by_axis = if axis_weight > 0.0 { axis_weight * self.turn.fraction_of(&cl.axis) } else { 0.0 };
        (((cl.tip - self.start.tip).dot(&self.tip_way) + by_axis) / weight).clamp(0.0, 1.0)
    }

    fn deviation_from_path(&self, cl: &ClPoint) -> Deviation {
        self.deviation(cl, self.fraction_near(cl))
    }
}
