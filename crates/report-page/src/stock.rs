//! Stock as the program cuts it, as lines with the changes of each, and the deviation that is left.

use facemill_cl_data::{ClPoint, Silent};
use facemill_job::load::job::{Job, Setup};
use facemill_job::stock::map::{StockMeshes, StockRegion};
use facemill_surface_model::Surface;
use facemill_tool_model::ToolAssembly;
use facemill_verification::stock_run::stock_before;
use facemill_z_map::{DexelMap, Step, Sweep, TurnedBody};
use nalgebra::{Point3, Vector3};

use crate::motion::{Poses, ProgramMotion, Segment, SegmentKind};

/// Cut stock: lines along z of the workpiece frame.
pub(crate) struct KeyedStock {
    /// Before the program.
    pub(crate) before: DexelMap,
    /// After it.
    pub(crate) rest: DexelMap,
    /// Number of segments done at each key.
    pub(crate) keys: Vec<u32>,
    /// Changes line by line, each with its key.
    pub(crate) changes: Vec<Vec<LineChange>>,
}

/// Material of a line from a key on.
pub(crate) struct LineChange {
    pub(crate) key: u32,
    /// Bottom and top of each interval, from below.
    pub(crate) intervals: Vec<[f64; 2]>,
}

/// Most lines along the longer side.
pub(crate) const LINES: f64 = 160.0;

/// Most keys.
const KEYS: usize = 800;

/// Largest error of the cut, mm.
pub(crate) const TOLERANCE: f64 = 0.05;

/// Poses between which a tool is swept: bulge of its tip, mm, and turn, rad.
const SWEPT_WITHIN: [f64; 2] = [0.05, 0.02];

/// Changes of an end of a line's material below which it is as before, mm.
const SAME: f64 = 1e-3;

/// Returns the stock of a setup, cut by the program; `None` with the reason if there is none.
pub(crate) fn keyed_stock(
    job: &Job,
    setup: &Setup<'_>,
    motion: &ProgramMotion,
    heads: &[(Poses<'_>, &ToolAssembly)],
) -> Result<KeyedStock, String> {
    let meshes = StockMeshes::of(setup);
    let box_ = meshes.extents();
    let length = (box_.max.x - box_.min.x).max(box_.max.y - box_.min.y);
    if !(length > 0.0 && length.is_finite()) {
        return Err("there is no stock".to_owned());
    }
    let before = stock_before(job, setup, length / LINES, StockRegion::Whole, TOLERANCE).map_err(|e| e.to_string())?;
    let mut rest = before.clone();
    let [nx, ny] = rest.grid().n_lines();
    let mut changes: Vec<Vec<LineChange>> = (0..nx * ny).map(|_| Vec::new()).collect();
    let bodies: Vec<TurnedBody> = heads.iter().map(|(_, tool)| TurnedBody::of_cutter(tool.cutter())).collect();
    let reach = heads.iter().map(|(_, tool)| reach(tool)).fold(0.0, f64::max);
    let cuts = motion.segments.iter().filter(|s| s.kind != SegmentKind::Rapid).count();
    let per_key = cuts.div_ceil(KEYS).max(1);
    let mut keys = Vec::new();
    let mut at = 0;
    while at < motion.segments.len() {
        let (mut end, mut n) = (at, 0);
        while end < motion.segments.len() && n < per_key {
            n += usize::from(motion.segments[end].kind != SegmentKind::Rapid);
            end += 1;
        }
        let sweeps = sweeps(&motion.segments[at..end], heads, &bodies);
        let near = lines_near(&sweeps, reach, &rest);
        at = end;
        if sweeps.is_empty() {
            continue;
        }
        let steps: Vec<Step<'_>> = sweeps.into_iter().map(Step::Remove).collect();
        let done = rest.run(&steps, TOLERANCE).map_err(|e| format!("the stock is not cut here: {e}"))?;
        if done.iter().any(|step| step.lines > 0) {
            let key = keys.len() as u32;
            keys.push(end as u32);
            note_changes(&rest, (&before, near), key, &mut changes);
        }
    }
    Ok(KeyedStock { before, rest, keys, changes })
}

/// Returns the ways of all cutters on motions at a feed.
fn sweeps<'b>(segments: &[Segment], heads: &[(Poses<'_>, &ToolAssembly)], bodies: &'b [TurnedBody]) -> Vec<Sweep<'b>> {
    let mut sweeps = Vec::new();
    for segment in segments.iter().filter(|s| s.kind != SegmentKind::Rapid) {
        for ((poses, _), body) in heads.iter().zip(bodies) {
            let mut from = poses.at(&segment.from);
            for (_, to) in poses.along(segment, SWEPT_WITHIN) {
                if differs(&from, &to) {
                    sweeps.push(Sweep { body, from, to });
                }
                from = to;
            }
        }
    }
    sweeps
}

fn differs(a: &ClPoint, b: &ClPoint) -> bool {
    let turn = a.axis.into_inner().dot(&b.axis);
    ((a.tip - b.tip).norm() > 0.0 || turn < 1.0) && turn > -0.99
}

/// Returns the distance from the tip beyond which a cutter has no point, mm.
fn reach(tool: &ToolAssembly) -> f64 {
    let cutter = tool.cutter();
    cutter.radius().hypot(cutter.flute_length())
}

/// Returns the lines, from and to along x and y, outside of which sweeps cut nothing.
fn lines_near(sweeps: &[Sweep<'_>], reach: f64, map: &DexelMap) -> [[usize; 2]; 2] {
    let (origin, cell, n_lines) = (map.grid().origin(), map.grid().cell(), map.grid().n_lines());
    [0, 1].map(|k| {
        // A turning tool is within its reach from a tip that is on or near the straight way.
        let tips = || sweeps.iter().flat_map(|s| [s.from.tip[k], s.to.tip[k]]);
        let line = |x: f64| (((x - origin[k]) / cell).floor().max(0.0) as usize).min(n_lines[k]);
        let low = tips().fold(f64::INFINITY, f64::min) - reach - cell;
        let high = tips().fold(f64::NEG_INFINITY, f64::max) + reach + 2.0 * cell;
        [line(low), line(high)]
    })
}

/// Takes note of lines in a range that are not as they were at the last change.
fn note_changes(
    now: &DexelMap,
    (before, [[from, to], rows]): (&DexelMap, [[usize; 2]; 2]),
    key: u32,
    changes: &mut [Vec<LineChange>],
) {
    let [nx, _] = now.grid().n_lines();
    let of_row = |(j, row): (usize, &mut [Vec<LineChange>])| {
        for (i, line) in row.iter_mut().enumerate().take(to).skip(from) {
            let intervals = || now.intervals(i, j).map(|v| [v.bottom, v.top]);
            let is_same = match line.last() {
                Some(last) => same(last.intervals.iter().copied(), intervals()),
                None => same(before.intervals(i, j).map(|v| [v.bottom, v.top]), intervals()),
            };
            if !is_same {
                line.push(LineChange { key, intervals: intervals().collect() });
            }
        }
    };
    changes.chunks_mut(nx).enumerate().take(rows[1]).skip(rows[0]).for_each(of_row);
}

fn same(mut a: impl Iterator<Item = [f64; 2]>, mut b: impl Iterator<Item = [f64; 2]>) -> bool {
    loop {
        match (a.next(), b.next()) {
            (None, None) => return true,
            (Some(a), Some(b)) if (a[0] - b[0]).abs() <= SAME && (a[1] - b[1]).abs() <= SAME => {}
            _ => return false,
        }
    }
}

/// Deviation at a vertex of the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VertexDeviation {
    /// Material too much (positive) or too little, mm.
    pub(crate) value: f64,
    /// Whether the program has cut there.
    pub(crate) is_cut: bool,
}

/// A place with its deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DeviationMark {
    pub(crate) position: Point3<f64>,
    pub(crate) value: f64,
}

/// Deviation of the part from the cut stock.
pub(crate) struct PartDeviation {
    /// Of each vertex; `None` where no line is near.
    pub(crate) vertices: Vec<Option<VertexDeviation>>,
    /// Deepest gouges, then highest excess, where the program has cut.
    pub(crate) worst: Vec<DeviationMark>,
    /// Cut area by deviation: from, to (mm), area (mm²).
    pub(crate) histogram: Vec<[f64; 3]>,
}

/// Number of worst places to each side.
const WORST: usize = 5;

/// Steps of the histogram within four tolerances, to each side.
const STEPS: i32 = 16;

/// Compares the stock with the part and its allowance, at vertices with normals; `tolerance` sets
/// the histogram's steps, mm.
pub(crate) fn part_deviation(
    stock: &KeyedStock,
    part: &Surface,
    allowance: f64,
    (vertices, normals): (&[Point3<f64>], &[Vector3<f64>]),
    tolerance: f64,
) -> Result<PartDeviation, String> {
    let found = stock.rest.deviation(&stock.before, part, &Silent).map_err(|e| e.to_string())?;
    let of_vertex = |(p, n): (&Point3<f64>, &Vector3<f64>)| {
        let place = found.near(p, n)?;
        place
            .deviation
            .is_finite()
            .then_some(VertexDeviation { value: place.deviation - allowance, is_cut: place.is_cut })
    };
    let cell = stock.rest.grid().cell();
    let along = found.along();
    let mut marks = Vec::new();
    let step = tolerance / f64::from(STEPS / 4);
    let mut histogram = vec![0.0; 2 * STEPS as usize + 2];
    for place in found.places().filter(|p| p.is_cut && p.deviation.is_finite()) {
        let value = place.deviation - allowance;
        let slope = part.facet_normal(place.triangle).map_or(0.0, |n| n.dot(&along).abs());
        let bin = ((value / step).floor() as i32).clamp(-STEPS - 1, STEPS) + STEPS + 1;
        histogram[bin as usize] += cell * cell / slope.max(0.1);
        marks.push(DeviationMark { position: place.position, value });
    }
    let (gouges, excess): (Vec<_>, Vec<_>) = marks.into_iter().partition(|m: &DeviationMark| m.value < 0.0);
    let worst = [gouges, excess].map(|marks| worst_of(marks, 4.0 * cell)).concat();
    let bounds = |k: usize| [k as f64 - f64::from(STEPS) - 1.0, k as f64 - f64::from(STEPS)].map(|x| x * step);
    Ok(PartDeviation {
        vertices: vertices.iter().zip(normals).map(of_vertex).collect(),
        worst,
        histogram: histogram.into_iter().enumerate().map(|(k, area)| [bounds(k)[0], bounds(k)[1], area]).collect(),
    })
}

/// Returns the largest deviations at places that are so far from each other, the largest first.
fn worst_of(mut marks: Vec<DeviationMark>, apart: f64) -> Vec<DeviationMark> {
    marks.sort_by(|a, b| b.value.abs().total_cmp(&a.value.abs()));
    let mut worst: Vec<DeviationMark> = Vec::new();
    for mark in marks {
        if worst.iter().all(|w| (w.position - mark.position).norm() > apart) {
            worst.push(mark);
        }
        if worst.len() == WORST {
            break;
        }
    }
    worst
}
