//! Fronts of a patch: from the columns that they are planned on to the triangles that they cross.

use std::borrow::Cow;

use crate::layout::edge_fill::columns::Columns;
use crate::layout::edge_fill::front::{Front, FrontSet};
use crate::layout::edge_fill::fronts::{FrontSettings, cost_of_levels, plan_fronts};
use crate::layout::level_set::LevelSet;
use crate::layout::levels::Band;
use crate::layout::pass_level::{PassLevel, Strips};
use crate::sections::Sections;
use crate::strategy::patch::Patch;
use crate::strategy::settings::{Direction, LaySettings, LevelOrder, Pattern};
use crate::strategy::size::MAX_CROSSINGS;

/// The fronts of a region, in cutting order.
pub(crate) struct FrontLayout {
    columns: Columns,
    fronts: Vec<Front>,
    triangles: Vec<Vec<u32>>,
}

/// Fronts have to be shorter than levels by this share: a smaller gain is within the error of the
/// estimate, and levels are simpler to follow.
const LEAST_GAIN: f64 = 0.01;

/// Fronts may be so many times as many as levels, partial ones included.
const MOST_PER_LEVEL: usize = 3;

impl FrontLayout {
    /// `None` where the passes turn too much for fronts, or where the `rising` levels serve: no
    /// place of a border is too far from a pass on them, and fronts are no shorter.
    pub(crate) fn plan(
        patch: &Patch,
        sections: &Sections,
        settings: &LaySettings,
        bands: &[Band],
        rising: &[f64],
    ) -> Option<Self> {
        let (first, last) = (*rising.first()?, *rising.last()?);
        let (range, sign) = match settings.order {
            LevelOrder::Increasing => ([first, last], 1.0),
            LevelOrder::Decreasing => ([-last, -first], -1.0),
        };
        let columns = Columns::of(patch, sections, settings, bands, range, sign)?;
        let plan = plan_fronts(&columns, &front_settings(settings, &columns), MOST_PER_LEVEL * rising.len() + 8)?;
        let mut levels: Vec<f64> = rising.iter().map(|l| sign * l).collect();
        levels.sort_by(f64::total_cmp);
        let of_levels = cost_of_levels(&columns, &levels, settings.pass_cost);
        let served = columns.borders_served(&levels, settings.min_pass_length + 2.0 * settings.edge_margin);
        if served && plan.cost >= (1.0 - LEAST_GAIN) * of_levels {
            return None;
        }
        let triangles = triangles_at(patch, &columns, &plan.fronts, bands)?;
        Some(Self { columns, fronts: plan.fronts, triangles })
    }

    /// The fronts with the triangles that reach them, in cutting order.
    pub(crate) fn levels<'a>(&'a self, sections: &'a Sections) -> Vec<PassLevel<'a>> {
        let Columns { row, along, sign, last, .. } = &self.columns;
        let level = |(front, among): (&'a Front, &'a Vec<u32>)| {
            let set = LevelSet::Front { sections, front: FrontSet { front, row, along, sign: *sign, last: *last } };
            PassLevel { set, among: Cow::Borrowed(among), starts: starts(front) }
        };
        self.fronts.iter().zip(&self.triangles).map(level).collect()
    }

    /// Returns the strips from one front to the next.
    pub(crate) fn strips(&self) -> Strips {
        let mut wide = vec![false; self.fronts.len()];
        let mut widest: f64 = 0.0;
        for i in 0..self.columns.row.n {
            let over = |f: &Front| f.whole_columns().contains(&i);
            let mut before: Option<&Front> = None;
            for (k, front) in self.fronts.iter().enumerate().filter(|(_, f)| over(f)) {
                if let Some(before) = before {
                    let steps = front.levels[i..i + 3].iter().zip(&before.levels[i..i + 3]).map(|(b, a)| b - a);
                    let levels = [before.bounds(i).0, front.bounds(i).1];
                    let (way, is_wide) = self.columns.strip(i, levels, steps.fold(0.0, f64::max));
                    widest = widest.max(way);
                    wide[k] |= is_wide;
                }
                before = Some(front);
            }
        }
        Strips { n_wide: wide.into_iter().filter(|&w| w).count(), widest }
    }
}

/// The direction in which a partial pass starts at an end of the region and joins the pass before
/// inside it; `None` for a pass from end to end.
fn starts(front: &Front) -> Option<Direction> {
    match front.joins {
        [false, true] => Some(Direction::Forward),
        [true, false] => Some(Direction::Reverse),
        _ => None,
    }
}

/// The triangles that each front may cross, in rising order; `None` where they are too many.
fn triangles_at(patch: &Patch, columns: &Columns, fronts: &[Front], bands: &[Band]) -> Option<Vec<Vec<u32>>> {
    let index: Vec<ColumnIndex> = (0..columns.row.n).map(|i| ColumnIndex::of(fronts, i)).collect();
    let mut at = vec![Vec::new(); fronts.len()];
    let mut reached: Vec<u32> = Vec::new();
    let mut n_crossings = 0;
    for (t, band) in bands.iter().enumerate() {
        let levels = if columns.sign > 0.0 { [band.low, band.high] } else { [-band.high, -band.low] };
        reached.clear();
        for column in &index[columns.of_triangle(patch.mesh.triangles()[t].map(|v| v as usize))] {
            reached.extend(column.between(levels));
        }
        reached.sort_unstable();
        reached.dedup();
        n_crossings += reached.len();
        reached.iter().for_each(|&k| at[k as usize].push(t as u32));
    }
    (n_crossings <= MAX_CROSSINGS).then_some(at)
}

/// The fronts on one column, by their least level.
struct ColumnIndex {
    /// Least and largest level, and index of each front.
    fronts: Vec<(f64, f64, u32)>,
    /// Largest difference between largest and least level.
    reach: f64,
}

impl ColumnIndex {
    /// Of the fronts that run over column i, or end beside it.
    fn of(fronts: &[Front], i: usize) -> Self {
        let over = |f: &Front| f.span[0] <= i + 2 && i <= f.span[1] + 2;
        let entry = |(k, f): (usize, &Front)| {
            let (low, high) = f.bounds(i);
            (low, high, k as u32)
        };
        let mut fronts: Vec<_> = fronts.iter().enumerate().filter(|(_, f)| over(f)).map(entry).collect();
        fronts.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        let reach = fronts.iter().map(|(low, high, _)| high - low).fold(0.0, f64::max);
        Self { fronts, reach }
    }

    /// The fronts that have a level between two.
    fn between(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = u32> {
        let from = self.fronts.partition_point(|f| f.0 < low - self.reach);
        let near = self.fronts[from..].iter().take_while(move |f| f.0 <= high);
        near.filter(move |f| f.1 >= low).map(|f| f.2)
    }
}

fn front_settings(settings: &LaySettings, columns: &Columns) -> FrontSettings {
    let [partial_from, may_join] = match (settings.pattern, settings.first_direction()) {
        (Pattern::Zigzag, _) => [[true; 2], [false; 2]],
        (Pattern::OneWay, Direction::Forward) => [[true, false], [false, true]],
        (Pattern::OneWay, Direction::Reverse) => [[false, true], [true, false]],
    };
    // A partial pass is cut at columns, and its length is an estimate.
    let shortest = 1.5 * settings.min_pass_length + 2.0 * settings.edge_margin + 2.0 * columns.row.width;
    FrontSettings { partial_from, may_join, shortest, pass_cost: settings.pass_cost, even: settings.even }
}
