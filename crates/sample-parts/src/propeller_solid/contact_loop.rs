//! Balls around a blade's root, and the columns of the mesh that go through their contacts.

use std::f64::consts::{PI, TAU};

use nalgebra::Point3;

use crate::propeller::blade_section::BladeSide;
use crate::propeller_solid::ball::{FilletContact, ball_at, fault};
use crate::propeller_solid::contour::Contour;
use crate::propeller_solid::root_fillet::{RootFillet, contour_angle};
use crate::propeller_solid::sector::split_quad;
use crate::spec_error::SpecError;

/// Balls at the columns of a blade, once around its root.
#[derive(Debug)]
pub(crate) struct ContactLoop {
    /// Contour angles of the columns from 0 at the leading edge to π at the trailing edge, growing.
    pub(crate) angles: Vec<f64>,
    /// Balls that touch the suction side, by column.
    pub(crate) suction: Vec<FilletContact>,
    /// Balls that touch the pressure side, by column; first and last are those of the suction side.
    pub(crate) pressure: Vec<FilletContact>,
    /// Segments of the arc from blade to hub.
    pub(crate) n_arc: usize,
}

/// Halvings of a column's width after which an edge counts as sharp.
const MOST_HALVINGS: usize = 14;

/// Largest turn of the fillet's normal from one column to the next, and along an arc, rad.
const LARGEST_TURN: f64 = 0.35;

/// Longest chord on the hub over its radius and the number of blades: where the hub is triangulated
/// longer ones would be bent.
const LONGEST_ON_HUB: f64 = 0.35;

/// Share of the chord tolerance for the curves along the contour and for the arcs each; the rest is
/// for the twist of the quads.
const SHARE_OF_TOLERANCE: f64 = 0.4;

/// Most columns, and most segments of an arc.
const MOST_COLUMNS: usize = 8000;

impl ContactLoop {
    /// Returns balls at the chord fractions of a blade's columns and at as many places between them
    /// as keep facets within `tolerance` mm of the fillet.
    pub(crate) fn new(
        contour: &Contour<'_>,
        fillet: &RootFillet,
        fractions: &[f64],
        tolerance: f64,
    ) -> Result<Self, SpecError> {
        let pair_at = |angle: f64| {
            let suction = ball_at(contour, fillet, angle)?;
            let is_edge = angle <= 0.0 || angle >= PI;
            let pressure = if is_edge { suction } else { ball_at(contour, fillet, TAU - angle)? };
            Ok::<_, SpecError>((angle, [suction, pressure]))
        };
        let share = SHARE_OF_TOLERANCE * tolerance;
        let spec = contour.surface().spec();
        let limits =
            ColumnLimits { off_chord: share, on_hub: LONGEST_ON_HUB * spec.hub_radius() / spec.n_blades() as f64 };
        let too_fine = || SpecError::TooFine { tolerance, most: MOST_COLUMNS };
        let mut columns = vec![pair_at(0.0)?];
        for &fraction in &fractions[1..] {
            let mut ahead = vec![(pair_at(contour_angle(BladeSide::Suction, fraction))?, 0)];
            while let Some((next, depth)) = ahead.pop() {
                let last = columns.last().expect("there is a first column");
                let middle = pair_at(0.5 * (last.0 + next.0))?;
                let keeps = |side: usize| limits.allow(&last.1[side], &middle.1[side], &next.1[side]);
                if keeps(0) && keeps(1) {
                    columns.push(next);
                } else if depth == MOST_HALVINGS {
                    let message = "the fillet turns too sharply, as around an edge without thickness; round the \
                                   edge, or make the radius smaller";
                    return Err(fault(next.0, message.to_owned()));
                } else {
                    ahead.push((next, depth + 1));
                    ahead.push((middle, depth + 1));
                }
                if columns.len() + ahead.len() > MOST_COLUMNS {
                    return Err(too_fine());
                }
            }
        }
        let n_arc = columns.iter().flat_map(|column| &column.1).map(|ball| arc_segments(ball, share)).max();
        let n_arc = n_arc.filter(|n| *n <= MOST_COLUMNS).ok_or_else(too_fine)?;
        let angles = columns.iter().map(|column| column.0).collect();
        let side = |side: usize| columns.iter().map(|column| column.1[side]).collect();
        Ok(Self { angles, suction: side(0), pressure: side(1), n_arc })
    }

    /// Refuses fillets whose strip folds: a facet must face the centres of its balls.
    pub(crate) fn check_folds(&self) -> Result<(), SpecError> {
        let balls = self.around();
        let share = |k: usize| k as f64 / self.n_arc as f64;
        for (i, (angle, a)) in balls.iter().enumerate() {
            let b = &balls[(i + 1) % balls.len()].1;
            let centre = nalgebra::center(&a.centre, &b.centre);
            for k in 0..self.n_arc {
                // From the hub to the blade the quad is wound outward.
                let [low, high] = [share(k + 1), share(k)];
                let quad = [a.on_arc(low), b.on_arc(low), b.on_arc(high), a.on_arc(high)];
                let faces = |[p, q, r]: [Point3<f64>; 3]| (q - p).cross(&(r - p)).dot(&(centre - p)) > 0.0;
                if !split_quad(quad).iter().all(|facet| faces(facet.map(|corner| quad[corner]))) {
                    let message = format!(
                        "the fillet folds with a ball of {:.4} mm, as where an edge leans over the hub; make the \
                         radius smaller here, as RootFillet::fitted does, or let it vary less steeply",
                        a.radius
                    );
                    return Err(fault(*angle, message));
                }
            }
        }
        Ok(())
    }

    /// Returns contour angles and balls once around: from the leading edge along the suction side
    /// and back along the pressure side.
    pub(crate) fn around(&self) -> Vec<(f64, FilletContact)> {
        let last = self.angles.len() - 1;
        let out = self.angles.iter().copied().zip(self.suction.iter().copied());
        let back = (1..last).rev().map(|k| (TAU - self.angles[k], self.pressure[k]));
        out.chain(back).collect()
    }
}

/// How far one column may be from the next, mm.
struct ColumnLimits {
    /// Distance of contacts and of the arc's middle from chords.
    off_chord: f64,
    /// Length of chords on the hub.
    on_hub: f64,
}

impl ColumnLimits {
    /// Whether a ball may follow another, with that between them known.
    fn allow(&self, a: &FilletContact, middle: &FilletContact, b: &FilletContact) -> bool {
        let curves: [fn(&FilletContact) -> Point3<f64>; 3] =
            [|ball| ball.on_blade, |ball| ball.on_hub, |ball| ball.on_arc(0.5)];
        (a.on_blade - a.centre).angle(&(b.on_blade - b.centre)) <= LARGEST_TURN
            && (b.on_hub - a.on_hub).norm() <= self.on_hub
            && curves.iter().all(|curve| off_chord(&curve(a), &curve(middle), &curve(b)) <= self.off_chord)
    }
}

/// Distance of a point from the segment between two others.
fn off_chord(a: &Point3<f64>, p: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let along = b - a;
    let length_sq = along.norm_squared();
    let share = if length_sq > 0.0 { (along.dot(&(p - a)) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + along * share)).norm()
}

/// Segments whose chords stay within a tolerance of a ball's arc, and turn no more than columns
/// may.
fn arc_segments(ball: &FilletContact, tolerance: f64) -> usize {
    // sagitta = r·(1 − cos(step/2)) = 2·r·sin²(step/4)
    let step = 4.0 * (tolerance / (2.0 * ball.radius)).sqrt().min(1.0).asin();
    (ball.arc_angle() / step.min(LARGEST_TURN)).ceil() as usize
}
