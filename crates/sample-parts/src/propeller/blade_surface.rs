use crate::propeller::blade_section::{BladeSection, Naca66, Profile, rounding};
use crate::propeller::spec::{PropellerSeries, PropellerSpec};
use crate::propeller::tables::{DTMB_4119, DTMB_4382, VP1304, VP1304_DIAMETER};
use crate::propeller::wageningen::WageningenB;
use crate::spline::CubicSpline;
use crate::spline::SplineEnd::NotAKnot;

/// The smooth blade that [`crate::blade`] meshes: the radial tables of a series as functions of the
/// radius.
///
/// Pitch, skew, rake, thickness and camber are cubic splines (two continuous derivatives) over r/R
/// through the tables. The chord is one over √(1 + 0.001 − r/R), as planforms end round; where a
/// table gives chord 0 at the tip, it reaches 0 at 1.001 R, so that the blade ends at R with a
/// rounded edge of a few percent of D (4.2 % for DTMB 4119) in place of a point. Below the
/// innermost table radius, inside the hub, all go on along straight lines.
#[derive(Clone, Debug)]
pub struct BladeSurface {
    spec: PropellerSpec,
    /// c/D over [`chord_variable`].
    chord: CubicSpline,
    /// P/D over r/R.
    pitch: CubicSpline,
    /// Skew over r/R, rad.
    skew: CubicSpline,
    /// Rake over D, negative aft.
    rake: CubicSpline,
    thickness: ThicknessLaw,
    form: Form,
}

/// Largest thickness of the sections, in the ratio that is smooth up to the tip.
#[derive(Clone, Debug)]
enum ThicknessLaw {
    /// t/c over r/R.
    OfChord(CubicSpline),
    /// t/D over r/R.
    OfDiameter(CubicSpline),
}

/// Section form.
#[derive(Clone, Debug)]
enum Form {
    /// With f/c over r/R.
    Naca66 {
        form: Naca66,
        camber: CubicSpline,
    },
    WageningenB(WageningenB),
}

/// How far beyond the tip a table's chord 0 is put, over R.
///
/// Larger blunts the tip's outline; smaller shears the mesh there (rows of constant radius meet the
/// outline at a flatter angle).
pub(crate) const TIP_SHIFT: f64 = 1e-3;

/// The variable in which chords are smooth up to the tip.
pub(crate) fn chord_variable(radius_ratio: f64) -> f64 {
    (1.0 + TIP_SHIFT - radius_ratio).max(0.0).sqrt()
}

/// Radius ratio of a [`chord_variable`].
pub(crate) fn radius_ratio(chord_variable: f64) -> f64 {
    1.0 + TIP_SHIFT - chord_variable * chord_variable
}

/// A spline of chords over [`chord_variable`]; points from hub to tip, and what is 0 at the tip is
/// 0 beyond it.
pub(crate) fn chord_spline(points: impl DoubleEndedIterator<Item = (f64, f64)>) -> CubicSpline {
    let points = points.rev().map(|(radius, chord)| (if chord > 0.0 { chord_variable(radius) } else { 0.0 }, chord));
    CubicSpline::new(points, NotAKnot, NotAKnot)
}

/// A spline through table rows as they are.
pub(crate) fn table_spline(points: impl Iterator<Item = (f64, f64)>) -> CubicSpline {
    CubicSpline::new(points, NotAKnot, NotAKnot)
}

/// Zero at any radius.
fn none() -> CubicSpline {
    table_spline([0.0, 0.4, 0.7, 1.0].into_iter().map(|r| (r, 0.0)))
}

impl BladeSurface {
    /// The blade of a propeller.
    pub fn new(spec: &PropellerSpec) -> Self {
        match spec.series() {
            PropellerSeries::Dtmb4119 => Self::dtmb_4119(*spec),
            PropellerSeries::Dtmb4382 => Self::dtmb_4382(*spec),
            PropellerSeries::Vp1304 => Self::vp1304(*spec),
            PropellerSeries::WageningenB { n_blades, area_ratio, pitch_ratio } => {
                Self::wageningen_b(*spec, n_blades, area_ratio, pitch_ratio)
            }
        }
    }

    fn dtmb_4119(spec: PropellerSpec) -> Self {
        let column = |k: usize| DTMB_4119.into_iter().map(move |row| (row[0], row[k]));
        Self {
            spec,
            chord: chord_spline(column(1)),
            pitch: table_spline(column(2)),
            skew: none(),
            rake: none(),
            thickness: ThicknessLaw::OfChord(table_spline(column(3))),
            form: Form::Naca66 { form: Naca66::new(), camber: table_spline(column(4)) },
        }
    }

    fn dtmb_4382(spec: PropellerSpec) -> Self {
        let column = |k: usize| DTMB_4382.into_iter().map(move |row| (row[0], row[k]));
        Self {
            spec,
            chord: chord_spline(column(1)),
            pitch: table_spline(column(2)),
            skew: table_spline(column(5).map(|(r, degrees)| (r, degrees.to_radians()))),
            rake: none(),
            thickness: ThicknessLaw::OfChord(table_spline(column(3))),
            form: Form::Naca66 { form: Naca66::new(), camber: table_spline(column(4)) },
        }
    }

    fn vp1304(spec: PropellerSpec) -> Self {
        let rows = || VP1304.into_iter();
        let over_d = |k: usize| rows().map(move |row| (2.0 * row[0] / VP1304_DIAMETER, row[k] / VP1304_DIAMETER));
        let skew = rows().map(|[r, chord, pitch, leading, ..]| {
            let pitch_angle = pitch.atan2(std::f64::consts::TAU * r);
            (2.0 * r / VP1304_DIAMETER, (0.5 * chord - leading) * pitch_angle.cos() / r)
        });
        let camber = rows().map(|row| (2.0 * row[0] / VP1304_DIAMETER, row[4] / row[1]));
        Self {
            spec,
            chord: chord_spline(over_d(1).collect::<Vec<_>>().into_iter()),
            pitch: table_spline(over_d(2)),
            skew: table_spline(skew),
            rake: table_spline(over_d(6)),
            thickness: ThicknessLaw::OfDiameter(table_spline(over_d(5))),
            form: Form::Naca66 { form: Naca66::new(), camber: table_spline(camber) },
        }
    }

    fn wageningen_b(spec: PropellerSpec, n_blades: usize, area_ratio: f64, pitch_ratio: f64) -> Self {
        let laws = WageningenB::laws(n_blades, area_ratio, pitch_ratio);
        Self {
            spec,
            chord: laws.chord,
            pitch: laws.pitch,
            skew: laws.skew,
            rake: laws.rake,
            thickness: ThicknessLaw::OfDiameter(laws.thickness),
            form: Form::WageningenB(WageningenB::new(n_blades)),
        }
    }

    /// The propeller it belongs to.
    pub fn spec(&self) -> &PropellerSpec {
        &self.spec
    }

    /// The section at a radius in mm, from 0.8 hub radii to the tip; radii outside are taken as the
    /// nearest of these.
    pub fn section(&self, radius: f64) -> BladeSection<'_> {
        let diameter = self.spec.diameter();
        let radius = radius.clamp(0.8 * self.spec.hub_radius(), 0.5 * diameter);
        let ratio = 2.0 * radius / diameter;
        let chord = diameter * self.chord.value(chord_variable(ratio));
        let profile = match &self.form {
            Form::Naca66 { form, camber } => Profile::Naca66 { form, camber: chord * camber.value(ratio) },
            Form::WageningenB(series) => series.profile(ratio),
        };
        BladeSection {
            radius,
            chord,
            pitch: diameter * self.pitch.value(ratio),
            skew: self.skew.value(ratio),
            rake: diameter * self.rake.value(ratio),
            thickness: diameter * self.thickness_ratio(ratio),
            tip_rounding: rounding(1.0 - ratio, self.tip_rounding_ratio()),
            profile,
        }
    }

    /// Length over R on which the tip is rounded: half the thickness it would have.
    pub(crate) fn tip_rounding_ratio(&self) -> f64 {
        self.thickness_ratio(1.0)
    }

    /// t/D.
    fn thickness_ratio(&self, ratio: f64) -> f64 {
        match &self.thickness {
            ThicknessLaw::OfChord(of_chord) => of_chord.value(ratio) * self.chord.value(chord_variable(ratio)),
            ThicknessLaw::OfDiameter(of_diameter) => of_diameter.value(ratio),
        }
    }
}
