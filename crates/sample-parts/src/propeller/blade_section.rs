use nalgebra::Point3;

use crate::propeller::anti_singing::SectionChamfer;
use crate::propeller::tables::{A08_LARGEST, NACA66_A08};
use crate::spline::{CubicSpline, SplineEnd};

/// A side of a blade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BladeSide {
    /// The back, facing +Z (ahead): here the pressure is low.
    Suction,
    /// The face, facing −Z (astern).
    Pressure,
}

/// The cylindrical section of a blade at one radius; lengths in mm.
///
/// In the unrolled cylinder the helix of the pitch rises at φ = atan(P/2πr). With `s` along the
/// helix toward the leading edge, from where the generator line goes through it, `n` normal to it
/// toward the suction side, and chord fraction x from the leading edge,
///
/// `s = −r·θs/cos φ + c·(½ − x)`, `n = mean(x) ± half(x)`,
/// `θ = (s·cos φ − n·sin φ)/r`, `z = rake + s·sin φ + n·cos φ`, point `(r·cos θ, r·sin θ, z)`.
///
/// So skew θs moves the middle of the chord against the rotation along the helix (it brings its own
/// rake −r·θs·tan φ), and thickness is laid off normal to the chord. Of a left-handed propeller y
/// has the other sign.
#[derive(Clone, Debug)]
pub struct BladeSection<'a> {
    pub(crate) radius: f64,
    pub(crate) chord: f64,
    pub(crate) pitch: f64,
    pub(crate) skew: f64,
    pub(crate) rake: f64,
    pub(crate) thickness: f64,
    pub(crate) tip_rounding: f64,
    /// Whether points are mirrored in the plane y = 0.
    pub(crate) is_left_handed: bool,
    pub(crate) profile: Profile<'a>,
    /// Chamfer of the suction side at the trailing edge.
    pub(crate) chamfer: Option<SectionChamfer>,
}

/// Shape of a section along its chord.
#[derive(Clone, Debug)]
pub(crate) enum Profile<'a> {
    /// NACA 66 (DTMB modified) thickness about an a = 0.8 mean line of largest ordinate `camber`
    /// mm.
    Naca66 { form: &'a Naca66, camber: f64 },
    /// Wageningen: V1 and V2 over the chord fraction.
    WageningenB { face: CubicSpline, thickness: CubicSpline },
    /// Mean height and half the thickness, over the root of the chord fraction, times `length` mm.
    Offsets { mean: CubicSpline, half: CubicSpline, length: f64 },
}

/// Thickness of both edges of a Wageningen section over its largest thickness.
///
/// The series' table of edge thicknesses is not at hand; this is near the trailing edge of the NACA
/// 66 form (0.0666). Larger makes clumsy edges, much smaller cannot be cast.
const WAGENINGEN_EDGE: f64 = 0.05;

impl BladeSection<'_> {
    /// Radius r of the cylinder.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Chord length c along the helix.
    pub fn chord(&self) -> f64 {
        self.chord
    }

    /// Pitch P.
    pub fn pitch(&self) -> f64 {
        self.pitch
    }

    /// Pitch angle φ, rad.
    pub fn pitch_angle(&self) -> f64 {
        self.pitch.atan2(std::f64::consts::TAU * self.radius)
    }

    /// Skew angle θs of the middle of the chord against the generator line, rad, positive against
    /// the rotation.
    pub fn skew(&self) -> f64 {
        self.skew
    }

    /// Rake: z of the generator line, without what skew brings; negative aft.
    pub fn rake(&self) -> f64 {
        self.rake
    }

    /// Height of the mean line above the pitch helix at a chord fraction from the leading edge, 0
    /// to 1.
    pub fn mean_height(&self, chord_fraction: f64) -> f64 {
        match &self.profile {
            Profile::Naca66 { form, camber } => camber * form.mean.value(chord_fraction.max(0.0).sqrt()),
            Profile::WageningenB { face, thickness } => {
                let t = self.thickness * (1.0 - WAGENINGEN_EDGE);
                let edge = self.thickness * WAGENINGEN_EDGE;
                t * face.value(chord_fraction) + 0.5 * (t * thickness.value(chord_fraction) + edge)
            }
            Profile::Offsets { mean, length, .. } => length * mean.value(chord_fraction.max(0.0).sqrt()),
        }
    }

    /// Half the thickness at a chord fraction, zero at both ends.
    ///
    /// Edges that are blunt in the series' form are rounded by a half ellipse as long as half their
    /// thickness, inside the chord; likewise the blade's tip over the last half thickness of the
    /// radius.
    pub fn half_thickness(&self, chord_fraction: f64) -> f64 {
        let half = 0.5 * self.thickness;
        let from_trailing = self.chord * (1.0 - chord_fraction);
        let flat = match &self.profile {
            Profile::Naca66 { form, .. } => {
                let trailing = half * form.thickness.value(1.0);
                half * form.thickness.value(chord_fraction.max(0.0).sqrt()) * rounding(from_trailing, trailing)
            }
            Profile::WageningenB { thickness, .. } => {
                let edge = half * WAGENINGEN_EDGE;
                let form = (half - edge) * thickness.value(chord_fraction).max(0.0) + edge;
                form * rounding(from_trailing, edge) * rounding(self.chord * chord_fraction, edge)
            }
            Profile::Offsets { half, length, .. } => {
                let [leading, trailing] = [0.0, 1.0].map(|edge| length * half.value(edge));
                let form = length * half.value(chord_fraction.max(0.0).sqrt()).max(0.0);
                form * rounding(from_trailing, trailing) * nose_rounding(self.chord * chord_fraction, leading)
            }
        };
        flat * self.tip_rounding
    }

    /// Returns the chord fraction of the mesh's column on a side that is at `fraction` elsewhere.
    pub(crate) fn column(&self, side: BladeSide, fraction: f64) -> f64 {
        match (side, &self.chamfer) {
            (BladeSide::Suction, Some(chamfer)) => chamfer.column(fraction),
            _ => fraction,
        }
    }

    /// The point of a side at a chord fraction from the leading edge, 0 to 1.
    ///
    /// An anti-singing edge ([`crate::AntiSingingEdge`]) cuts the suction side below mean height
    /// and half the thickness.
    pub fn point(&self, side: BladeSide, chord_fraction: f64) -> Point3<f64> {
        let (mean, half) = (self.mean_height(chord_fraction), self.half_thickness(chord_fraction));
        let n = match (side, &self.chamfer) {
            (BladeSide::Pressure, _) => mean - half,
            (BladeSide::Suction, None) => mean + half,
            (BladeSide::Suction, Some(chamfer)) => chamfer.cut(chord_fraction, mean + half),
        };
        let (sin, cos) = self.pitch_angle().sin_cos();
        let s = self.chord * (0.5 - chord_fraction) - self.radius * self.skew / cos;
        let (sin_theta, cos_theta) = ((s * cos - n * sin) / self.radius).sin_cos();
        let y = self.radius * sin_theta;
        let y = if self.is_left_handed { -y } else { y };
        Point3::new(self.radius * cos_theta, y, self.rake + s * sin + n * cos)
    }
}

/// Height of a quarter ellipse that is 0 at the end and reaches 1, level, after `length`.
pub(crate) fn rounding(from_end: f64, length: f64) -> f64 {
    let part = from_end / length;
    if part >= 1.0 {
        1.0
    } else if part > 0.0 {
        (part * (2.0 - part)).sqrt()
    } else {
        0.0
    }
}

/// As [`rounding`], and 1 where the edge has no thickness to round.
fn nose_rounding(from_end: f64, length: f64) -> f64 {
    if length > 0.0 { rounding(from_end, length) } else { 1.0 }
}

/// NACA 66 (DTMB modified) thickness and a = 0.8 mean line, each of largest ordinate 1, over the
/// root of the chord fraction.
///
/// In that variable the thickness is odd and the mean line even, so splines through the tables make
/// a round nose with finite curvature. The closed form of the mean line has an infinite slope
/// there.
#[derive(Clone, Debug)]
pub(crate) struct Naca66 {
    thickness: CubicSpline,
    mean: CubicSpline,
}

impl Naca66 {
    pub(crate) fn new() -> Self {
        let thickness = NACA66_A08.map(|[x, t, _]| (x.sqrt(), t));
        let mean = NACA66_A08.map(|[x, _, f]| (x.sqrt(), f / A08_LARGEST));
        Self {
            thickness: CubicSpline::new(thickness, SplineEnd::Natural, SplineEnd::NotAKnot),
            mean: CubicSpline::new(mean, SplineEnd::Slope(0.0), SplineEnd::NotAKnot),
        }
    }
}
