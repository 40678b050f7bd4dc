use crate::propeller::anti_singing::{AntiSingingEdge, SectionChamfer};
use crate::propeller::blade_section::{BladeSection, Naca66, Profile, rounding};
use crate::propeller::offset_form::OffsetForm;
use crate::propeller::spec::{PropellerShape, PropellerSpec};
use crate::propeller::table::{Hand, PropellerTable, TableSections, TableThickness};
use crate::propeller::wageningen::WageningenB;
use crate::spline::CubicSpline;
use crate::spline::SplineEnd::NotAKnot;

/// The smooth blade that [`crate::blade`] meshes: radial tables as functions of the radius.
///
/// Pitch, skew, rake, thickness, camber and ordinates of sections are cubic splines (two continuous
/// derivatives) over r/R through the tables. The chord is one over √(1 + 0.001 − r/R), as planforms
/// end round; where a table gives chord 0 at the tip, it reaches 0 at 1.001 R, so that the blade
/// ends at R with a rounded edge of a few percent of D (4.2 % for DTMB 4119) in place of a point.
/// Below the innermost table radius, inside the hub, all go on along straight lines.
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

/// Sections over the radius.
#[derive(Clone, Debug)]
enum Form {
    /// With f/c over r/R.
    Naca66 {
        form: Naca66,
        thickness: ThicknessLaw,
        camber: CubicSpline,
    },
    WageningenB {
        series: WageningenB,
        thickness: ThicknessLaw,
    },
    Offsets(OffsetForm),
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

impl BladeSurface {
    /// The blade of a propeller.
    pub fn new(spec: &PropellerSpec) -> Self {
        match spec.shape() {
            PropellerShape::Table(table) => Self::of_table(spec.clone(), table),
            PropellerShape::WageningenB { n_blades, area_ratio, pitch_ratio } => {
                Self::wageningen_b(spec.clone(), *n_blades, *area_ratio, *pitch_ratio)
            }
        }
    }

    fn of_table(spec: PropellerSpec, table: &PropellerTable) -> Self {
        let column = |values: &[f64]| table_spline(table.radii.iter().copied().zip(values.iter().copied()));
        let law = |thickness: &TableThickness| match thickness {
            TableThickness::OfChord(of_chord) => ThicknessLaw::OfChord(column(of_chord)),
            TableThickness::OfDiameter(of_diameter) => ThicknessLaw::OfDiameter(column(of_diameter)),
        };
        let form = match &table.sections {
            TableSections::Naca66A08 { thickness, camber } => {
                Form::Naca66 { form: Naca66::new(), thickness: law(thickness), camber: column(camber) }
            }
            TableSections::WageningenB { thickness } => {
                Form::WageningenB { series: WageningenB::new(table.n_blades), thickness: law(thickness) }
            }
            TableSections::Offsets(offsets) => Form::Offsets(OffsetForm::new(offsets)),
        };
        Self {
            spec,
            chord: chord_spline(table.radii.iter().copied().zip(table.chord.iter().copied())),
            pitch: column(&table.pitch),
            skew: column(&table.skew),
            rake: column(&table.rake),
            form,
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
            form: Form::WageningenB {
                series: WageningenB::new(n_blades),
                thickness: ThicknessLaw::OfDiameter(laws.thickness),
            },
        }
    }

    /// The propeller it belongs to.
    pub fn spec(&self) -> &PropellerSpec {
        &self.spec
    }

    /// The section at a radius in mm, from 0.8 hub radii to the tip; radii outside are taken as the
    /// nearest of these.
    pub fn section(&self, radius: f64) -> BladeSection<'_> {
        let section = self.uncut_section(radius);
        let chamfer = self.spec.anti_singing_edge().and_then(|edge| self.chamfer_of(&edge, &section));
        BladeSection { chamfer, ..section }
    }

    /// Returns the chamfer of an uncut section; `None` where neither it nor its columns reach, or
    /// where it does not meet the suction side.
    pub(crate) fn chamfer_of(&self, edge: &AntiSingingEdge, section: &BladeSection<'_>) -> Option<SectionChamfer> {
        let radius = 0.5 * self.spec.diameter();
        let ratio = section.radius / radius;
        let (inside, share) = edge.nearest(ratio)?;
        let length_of = |section: &BladeSection<'_>| {
            let (end, rise) = (section.mean_height(1.0), edge.rise(section.chord));
            AntiSingingEdge::length(|length| {
                let x = 1.0 - length;
                section.mean_height(x) + section.half_thickness(x) - (end + rise * length)
            })
        };
        let length =
            if ratio == inside { length_of(section) } else { length_of(&self.uncut_section(inside * radius)) }?;
        let (end, rise) = (section.mean_height(1.0), edge.rise(section.chord));
        Some(SectionChamfer { length, rise, end, depth: edge.depth(ratio), share })
    }

    /// Returns the section at a radius in mm without the chamfer of an anti-singing edge.
    pub(crate) fn uncut_section(&self, radius: f64) -> BladeSection<'_> {
        let diameter = self.spec.diameter();
        let radius = radius.clamp(0.8 * self.spec.hub_radius(), 0.5 * diameter);
        let ratio = 2.0 * radius / diameter;
        let chord = diameter * self.chord.value(chord_variable(ratio));
        let profile = match &self.form {
            Form::Naca66 { form, camber, .. } => Profile::Naca66 { form, camber: chord * camber.value(ratio) },
            Form::WageningenB { series, .. } => series.profile(ratio),
            Form::Offsets(offsets) => offsets.profile(ratio, chord, diameter),
        };
        BladeSection {
            radius,
            chord,
            pitch: diameter * self.pitch.value(ratio),
            skew: self.skew.value(ratio),
            rake: diameter * self.rake.value(ratio),
            thickness: diameter * self.thickness_ratio(ratio),
            tip_rounding: rounding(1.0 - ratio, self.tip_rounding_ratio()),
            is_left_handed: self.spec.hand() == Hand::Left,
            profile,
            chamfer: None,
        }
    }

    /// Share of the circle at a radius in mm that the chords of all blades cover, seen along the
    /// shaft: from 1 on, they overlap.
    pub fn covered_share(&self, radius: f64) -> f64 {
        let section = self.section(radius);
        #[expect(clippy::cast_precision_loss, reason = "at most 12")]
        let n_blades = self.spec.n_blades() as f64;
        n_blades * section.chord * section.pitch_angle().cos() / (std::f64::consts::TAU * section.radius)
    }

    /// Length over R on which the tip is rounded: half the thickness it would have.
    pub(crate) fn tip_rounding_ratio(&self) -> f64 {
        self.thickness_ratio(1.0)
    }

    /// t/D.
    fn thickness_ratio(&self, ratio: f64) -> f64 {
        let chord = || self.chord.value(chord_variable(ratio));
        match &self.form {
            Form::Offsets(offsets) => offsets.thickness(ratio, chord(), 1.0),
            Form::Naca66 { thickness, .. } | Form::WageningenB { thickness, .. } => match thickness {
                ThicknessLaw::OfChord(of_chord) => of_chord.value(ratio) * chord(),
                ThicknessLaw::OfDiameter(of_diameter) => of_diameter.value(ratio),
            },
        }
    }
}
