use nalgebra::Point3;

use crate::error::PathError;
use crate::strategy::size::MAX_POINTS;

/// How passes are laid and points put on them.
#[derive(Clone, Debug, PartialEq)]
pub struct LaySettings {
    /// Largest distance of the surface's section from the straight line between two points, mm; at
    /// least 1e-6.
    pub chord_tolerance: f64,
    /// Largest distance between two points of a pass, mm.
    pub max_step: f64,
    /// Largest angle between the normals of two points of a pass, rad; no bound where there is
    /// none. Where the normal jumps, at a crease, two points come to lie within half the chord
    /// tolerance of each other instead.
    pub max_normal_change: Option<f64>,
    /// Largest distance between neighbouring passes along the surface, mm.
    pub max_step_over: f64,
    /// Strip widths below this are taken for it, mm;
    /// [`PassLayout::n_wide_strips`](crate::layout::generate_passes::PassLayout) counts where that
    /// was done.
    pub min_step_over: f64,
    /// Whether all step-overs shrink by one factor, so that the last is no narrower than it has to
    /// be.
    pub even: bool,
    /// Order of the levels.
    pub order: LevelOrder,
    /// Whether the feed turns from level to level.
    pub pattern: Pattern,
    /// Direction of feed; of a zigzag, on the first level.
    pub direction: Direction,
    /// Where it is given, `direction` is chosen so that the uncut stock lies on this side; of a
    /// zigzag, on the first level.
    pub uncut: Option<UncutSide>,
    /// How far before the region's border a pass ends, measured along it, mm. Closed passes have no
    /// end.
    pub edge_margin: f64,
    /// Shorter passes are left out and counted, mm.
    pub min_pass_length: f64,
    /// Whether passes follow the local strip width: they lean by up to 11° from the levels, and
    /// partial passes fill up an edge where strips are narrow. Where passes turn too much for it,
    /// such as closed ones, or would get no shorter by it, they are levels all the same.
    pub edge_fill: bool,
    /// Length of cutting that takes as long as entry, exit and link of a pass, mm: a partial pass
    /// has to save more.
    pub pass_cost: f64,
    /// Closed curves are cut open where they cross the mesh edge nearest to this point. Without it,
    /// the first is cut open where the mesh has it begin, and each further one nearest to the cut
    /// of the one before.
    pub closed_start: Option<Point3<f64>>,
    /// Radius of the cutter's corner, mm: of the ball that rolls along a root. 0 of a sharp cutter.
    pub corner_radius: f64,
    /// Most points that all passes may have together, up to 2,000,000.
    pub max_points: usize,
}

impl Default for LaySettings {
    /// Chord 0.01 mm, steps to 5 mm, step-over between 0.1 mm and 5 mm, evenly, one way from the
    /// lowest level up, forward, to the border of the region.
    fn default() -> Self {
        Self {
            chord_tolerance: 0.01,
            max_step: 5.0,
            max_normal_change: None,
            max_step_over: 5.0,
            min_step_over: 0.1,
            even: true,
            order: LevelOrder::Increasing,
            pattern: Pattern::OneWay,
            direction: Direction::Forward,
            uncut: None,
            edge_margin: 0.0,
            min_pass_length: 0.0,
            edge_fill: false,
            pass_cost: 0.0,
            closed_start: None,
            corner_radius: 0.0,
            max_points: MAX_POINTS,
        }
    }
}

/// Which level is cut first. Of cylindrical sections, increasing is outward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelOrder {
    /// From the lowest level up.
    Increasing,
    /// From the highest level down.
    Decreasing,
}

/// Whether all passes run alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pattern {
    /// All in one direction.
    OneWay,
    /// Every level against the one before it.
    Zigzag,
}

/// Direction of feed, given by the side on which the levels rise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Higher levels lie to the left of the feed, seen from outside: Et along gradient × N.
    Forward,
    /// Higher levels lie to the right.
    Reverse,
}

/// On which side of the feed the stock remains, seen from outside the material with the feed
/// ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UncutSide {
    /// At N × Et, [`CcPoint::left`](facemill_cl_data::CcPoint::left).
    Left,
    /// At Et × N.
    Right,
}

impl Direction {
    /// The other one.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Forward => Self::Reverse,
            Self::Reverse => Self::Forward,
        }
    }

    /// Returns the side of the stock when levels are cut in this order: on the side of the levels
    /// that are cut later.
    pub fn uncut_side(self, order: LevelOrder) -> UncutSide {
        match (self, order) {
            (Self::Forward, LevelOrder::Increasing) | (Self::Reverse, LevelOrder::Decreasing) => UncutSide::Left,
            _ => UncutSide::Right,
        }
    }
}

/// Least chord tolerance, mm. Smaller ones are lost in the rounding of mesh files, and would ask
/// for points without end.
const LEAST_CHORD: f64 = 1e-6;

impl LaySettings {
    /// # Errors
    /// When a length is not finite or not in its range.
    pub(crate) fn check(&self) -> Result<(), PathError> {
        let positive = [
            ("max_step", self.max_step),
            ("max_normal_change", self.max_normal_change.unwrap_or(1.0)),
            ("max_step_over", self.max_step_over),
            ("min_step_over", self.min_step_over),
        ];
        for (setting, value) in positive {
            require(setting, value, "finite and above 0", value.is_finite() && value > 0.0)?;
        }
        let chord = self.chord_tolerance;
        require("chord_tolerance", chord, "finite and at least 1e-6", chord.is_finite() && chord >= LEAST_CHORD)?;
        let not_negative = [
            ("edge_margin", self.edge_margin),
            ("min_pass_length", self.min_pass_length),
            ("pass_cost", self.pass_cost),
            ("corner_radius", self.corner_radius),
        ];
        for (setting, value) in not_negative {
            require(setting, value, "finite and not below 0", value.is_finite() && value >= 0.0)?;
        }
        let few = (1..=MAX_POINTS).contains(&self.max_points);
        require("max_points", self.max_points as f64, "from 1 to 2,000,000", few)?;
        let ordered = self.min_step_over <= self.max_step_over;
        require("min_step_over", self.min_step_over, "at most max_step_over", ordered)?;
        let start_is_finite = self.closed_start.is_none_or(|p| p.coords.iter().all(|c| c.is_finite()));
        require("closed_start", f64::NAN, "finite", start_is_finite)
    }

    /// Turns levels round where the highest is cut first.
    pub(crate) fn in_cutting_order<T>(&self, mut rising: Vec<T>) -> Vec<T> {
        if self.order == LevelOrder::Decreasing {
            rising.reverse();
        }
        rising
    }

    /// Direction of feed on the first level.
    pub(crate) fn first_direction(&self) -> Direction {
        match self.uncut {
            Some(side) if self.direction.uncut_side(self.order) != side => self.direction.reversed(),
            _ => self.direction,
        }
    }
}

pub(crate) fn require(setting: &'static str, value: f64, range: &'static str, holds: bool) -> Result<(), PathError> {
    if holds { Ok(()) } else { Err(PathError::Setting { setting, value, range }) }
}
