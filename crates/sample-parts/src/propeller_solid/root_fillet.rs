//! Radius of a root fillet around the blade.

use std::f64::consts::{PI, TAU};

use crate::propeller::blade_section::BladeSide;
use crate::spec_error::{SpecError, in_range, is_not_above};

/// Fillet between blade and hub: radius of the ball that rolls along both, mm.
///
/// The radius is a function of the place where the ball touches the blade: of the chord fraction x
/// and the side. In between its stations it is a monotone cubic over the contour angle β,
/// x = sin²(β/2), with one continuous derivative all around the section, so that the fillet has no
/// crease (F. N. Fritsch, J. Butland: A method for constructing local monotone piecewise cubic
/// interpolants, SIAM J. Sci. Stat. Comput. 5 (1984), for steps of any width).
///
/// ```
/// use facemill_sample_parts::{BladeSide, FilletStation, RootFillet, SpecError};
///
/// let station = |chord_fraction, suction, pressure| FilletStation { chord_fraction, suction, pressure };
/// let fillet = RootFillet::varying(&[
///     station(0.0, 8.0, 8.0),
///     station(0.3, 30.0, 20.0),
///     station(0.7, 30.0, 20.0),
///     station(1.0, 6.0, 6.0),
/// ])?;
/// assert!((fillet.radius(BladeSide::Pressure, 0.3) - 20.0).abs() < 1e-9);
/// # Ok::<(), SpecError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RootFillet {
    /// Contour angles and radii, once around, with growing angles from 0 to 2π; the last radius is
    /// the first.
    knots: Vec<(f64, f64)>,
    /// Change of the radius over the contour angle at each knot.
    slopes: Vec<f64>,
}

/// Radii of a [`RootFillet`] at a chord fraction, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilletStation {
    /// Chord fraction from the leading edge, 0 to 1.
    pub chord_fraction: f64,
    /// Radius on the suction side.
    pub suction: f64,
    /// Radius on the pressure side; at the edges that of the suction side.
    pub pressure: f64,
}

/// Most stations of a fillet.
const MOST_STATIONS: usize = 1000;

/// Largest radius of any fillet, mm: that of the largest propeller.
const MOST_RADIUS: f64 = 10_000.0;

impl RootFillet {
    /// Returns a fillet of the same radius all around, mm.
    ///
    /// # Errors
    /// When the radius is not above 0 and up to 10,000 mm; [`crate::propeller_solid`] has closer
    /// limits.
    pub fn constant(radius: f64) -> Result<Self, SpecError> {
        let at = |chord_fraction| FilletStation { chord_fraction, suction: radius, pressure: radius };
        Self::varying(&[at(0.0), at(1.0)])
    }

    /// Returns a fillet with these radii at stations from the leading to the trailing edge.
    ///
    /// # Errors
    /// When there are fewer than two stations or more than 1,000, the chord fractions do not grow
    /// from 0 to 1, a radius is not above 0 and up to 10,000 mm, or both radii at an edge differ.
    pub fn varying(stations: &[FilletStation]) -> Result<Self, SpecError> {
        in_range("number of fillet stations", stations.len() as f64, 2.0, MOST_STATIONS as f64)?;
        let last = stations.len() - 1;
        in_range("chord fraction of the first fillet station", stations[0].chord_fraction, 0.0, 0.0)?;
        in_range("chord fraction of the last fillet station", stations[last].chord_fraction, 1.0, 1.0)?;
        for station in stations {
            for radius in [station.suction, station.pressure] {
                in_range("fillet radius", radius, f64::MIN_POSITIVE, MOST_RADIUS)?;
            }
        }
        for pair in stations.windows(2) {
            let least = pair[0].chord_fraction + 1e-6;
            if is_not_above(pair[1].chord_fraction, least) {
                in_range("chord fraction of a fillet station", pair[1].chord_fraction, least, 1.0)?;
            }
        }
        for edge in [stations[0], stations[last]] {
            in_range("fillet radius of the pressure side at an edge", edge.pressure, edge.suction, edge.suction)?;
        }
        let suction = stations.iter().map(|s| (contour_angle(BladeSide::Suction, s.chord_fraction), s.suction));
        let pressure = stations[1..last].iter().rev();
        let pressure = pressure.map(|s| (contour_angle(BladeSide::Pressure, s.chord_fraction), s.pressure));
        let knots: Vec<_> = suction.chain(pressure).chain([(TAU, stations[0].suction)]).collect();
        let slopes = monotone_slopes(&knots);
        Ok(Self { knots, slopes })
    }

    /// Returns the radius where the ball touches a side at a chord fraction from 0 to 1, mm;
    /// fractions beyond are taken as these.
    pub fn radius(&self, side: BladeSide, chord_fraction: f64) -> f64 {
        self.at(contour_angle(side, chord_fraction.clamp(0.0, 1.0)))
    }

    /// Returns the radius at a contour angle, mm.
    pub(crate) fn at(&self, angle: f64) -> f64 {
        let angle = angle.rem_euclid(TAU);
        let piece = self.knots.partition_point(|knot| knot.0 <= angle).clamp(1, self.knots.len() - 1) - 1;
        let [(a, from), (b, to)] = [self.knots[piece], self.knots[piece + 1]];
        let (width, t) = (b - a, (angle - a) / (b - a));
        let [m0, m1] = [self.slopes[piece] * width, self.slopes[piece + 1] * width];
        // The cubic of Hermite, written from the straight line.
        let (rise, left) = (to - from, 1.0 - t);
        from + t * (rise + left * (left * (m0 - rise) - t * (m1 - rise)))
    }

    /// Returns the least and the largest radius, mm: those of stations, as the radius is monotone
    /// between them.
    pub(crate) fn extremes(&self) -> [f64; 2] {
        let radii = || self.knots.iter().map(|knot| knot.1);
        [radii().fold(f64::INFINITY, f64::min), radii().fold(0.0, f64::max)]
    }
}

/// Returns the contour angle of a chord fraction: 0 at the leading edge, π at the trailing edge, on
/// along the pressure side to 2π.
pub(crate) fn contour_angle(side: BladeSide, chord_fraction: f64) -> f64 {
    let angle = 2.0 * chord_fraction.sqrt().atan2((1.0 - chord_fraction).sqrt());
    match side {
        BladeSide::Suction => angle,
        BladeSide::Pressure => TAU - angle,
    }
}

/// Returns the side and the chord fraction of a contour angle from −2π to 4π.
pub(crate) fn place_of(angle: f64) -> (BladeSide, f64) {
    let sine = (0.5 * angle).sin();
    let side = if angle.rem_euclid(TAU) <= PI { BladeSide::Suction } else { BladeSide::Pressure };
    (side, sine * sine)
}

/// Slopes of a monotone cubic over one turn: the weighted harmonic mean of both neighbours' slopes,
/// or 0 at an extreme.
fn monotone_slopes(knots: &[(f64, f64)]) -> Vec<f64> {
    let pieces: Vec<_> = knots.windows(2).map(|k| (k[1].0 - k[0].0, (k[1].1 - k[0].1) / (k[1].0 - k[0].0))).collect();
    let n = pieces.len();
    let slope = |knot: usize| {
        let [(width_before, before), (width_after, after)] = [pieces[(knot + n - 1) % n], pieces[knot % n]];
        if before * after <= 0.0 {
            return 0.0;
        }
        let weights = [2.0 * width_after + width_before, width_after + 2.0 * width_before];
        (weights[0] + weights[1]) / (weights[0] / before + weights[1] / after)
    };
    (0..=n).map(slope).collect()
}
