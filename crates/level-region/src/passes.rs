//! All passes of a level.

use std::f64::consts::TAU;

use facemill_cl_data::{CcPoint, Pass};
use nalgebra::{Point3, Rotation3, Unit};

use crate::contour::{ContourSettings, contour_passes};
use crate::pieces::{PieceSettings, fitting_pieces};
use crate::reach::Reach;
use crate::room::LevelRoom;

/// Pass, and whether the uncut stock lies to the left of its feed.
pub type SidedPass = (Pass<CcPoint>, bool);

/// Settings of a level's passes.
pub struct LevelPassSettings<'s> {
    /// Shortest piece, mm; at least a cell of the lattice.
    pub least: f64,
    /// Whether pieces and contours may be cut the other way.
    pub is_reversible: bool,
    /// Whether contours have what is there on the left of the feed.
    pub is_left: bool,
    /// Largest distance of a contour from the border of the room, mm.
    pub tolerance: f64,
    /// Largest distance of points on contours, mm.
    pub max_step: f64,
    /// Farthest way from the stock's outside to a contour, mm.
    pub max_run_in: f64,
    /// Whether a point of the level is to be cut.
    pub is_cut: &'s (dyn Fn(&Point3<f64>) -> bool + Sync),
}

/// Directions from the tip in which material is sought for a contour.
const AROUND: u32 = 16;

/// Returns the pieces of straight passes where an upright tool has room, then passes around what
/// is there, and the number of pieces that are too short. `stock` is the room past the stock:
/// passes begin there if they can.
pub fn level_passes(
    room: &LevelRoom<'_>,
    stock: &LevelRoom<'_>,
    reach: &Reach,
    passes: &[SidedPass],
    settings: &LevelPassSettings<'_>,
) -> (Vec<SidedPass>, usize) {
    let is_open = |tip: &Point3<f64>| stock.fits(tip);
    let least = settings.least.max(reach.cell());
    let is_reversible = settings.is_reversible;
    let pieces = PieceSettings { step: reach.cell(), least, is_reversible, is_open: &is_open };
    let (mut laid, mut n_short) = (Vec::new(), 0);
    for (pass, uncut_left) in passes {
        let (found, short) = fitting_pieces(room, &pass.points, &pieces);
        n_short += short;
        laid.extend(found.into_iter().map(|points| {
            let is_turned = pass.points[0].feed.dot(&points[0].feed) < 0.0;
            (Pass::new(points), *uncut_left != is_turned)
        }));
    }
    let normal = room.plane().axis();
    let across = Unit::new_normalize(room.plane().at(1.0, 0.0) - room.plane().at(0.0, 0.0));
    let turned = |k: u32| Rotation3::from_axis_angle(&normal, TAU * f64::from(k) / f64::from(AROUND)) * across;
    let rim: Vec<_> = (0..AROUND).map(|k| turned(k).into_inner() * room.rim_radius()).collect();
    let is_needed = |tip: &Point3<f64>| (settings.is_cut)(tip) || rim.iter().any(|to| (settings.is_cut)(&(tip + to)));
    let contours = ContourSettings {
        tolerance: settings.tolerance,
        max_step: settings.max_step,
        max_run_in: settings.max_run_in,
        is_left: settings.is_left,
        is_reversible,
        is_needed: &is_needed,
        is_open: &is_open,
    };
    let around = contour_passes(room, reach, &contours);
    laid.extend(around.into_iter().map(|contour| (Pass::new(contour.points), contour.is_left)));
    (laid, n_short)
}
