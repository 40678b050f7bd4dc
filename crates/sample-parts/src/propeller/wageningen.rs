//! Wageningen B series: radial laws and sections.

use crate::propeller::blade_section::Profile;
use crate::propeller::blade_surface::{chord_spline, table_spline};
use crate::propeller::wageningen_tables::{DIMS, Dims, RAKE_DEG, TIP_THICKNESS, V_RADII, V_STATIONS, V1, V2};
use crate::spline::CubicSpline;
use crate::spline::SplineEnd::NotAKnot;

/// Section functions of the series, over r/R.
#[derive(Clone, Debug)]
pub(crate) struct WageningenB {
    face: Vec<CubicSpline>,
    thickness: Vec<CubicSpline>,
    thickest: CubicSpline,
}

/// Radial laws, lengths over D.
pub(crate) struct WageningenLaws {
    pub(crate) chord: CubicSpline,
    pub(crate) pitch: CubicSpline,
    pub(crate) skew: CubicSpline,
    pub(crate) rake: CubicSpline,
    pub(crate) thickness: CubicSpline,
}

/// Which of the two columns a number of blades uses. The tables begin at three blades; two use the
/// same.
fn column(n_blades: usize) -> usize {
    usize::from(n_blades > 3)
}

/// A spline over r/R for each column of a section function.
fn station_splines(table: &[[f64; 20]; 13]) -> Vec<CubicSpline> {
    (0..V_STATIONS.len())
        .map(|k| table_spline(V_RADII.into_iter().zip(table).map(|(radius, row)| (radius, row[k]))))
        .collect()
}

impl WageningenB {
    pub(crate) fn new(n_blades: usize) -> Self {
        let thickest = DIMS.iter().map(|d| (d.radius, d.thickest[column(n_blades)]));
        Self {
            face: station_splines(&V1),
            thickness: station_splines(&V2),
            // At the tip the section function is a parabola about the middle of the chord.
            thickest: table_spline(thickest.chain([(1.0, 0.5)])),
        }
    }

    /// V1 and V2 over the chord fraction at a radius ratio.
    pub(crate) fn profile(&self, radius_ratio: f64) -> Profile<'static> {
        let thickest = self.thickest.value(radius_ratio);
        let fraction = |station: f64| {
            if station > 0.0 { thickest * (1.0 - station) } else { thickest - (1.0 - thickest) * station }
        };
        let along_chord = |functions: &[CubicSpline]| {
            let points = V_STATIONS.into_iter().zip(functions).rev();
            CubicSpline::new(points.map(|(p, f)| (fraction(p), f.value(radius_ratio))), NotAKnot, NotAKnot)
        };
        Profile::WageningenB { face: along_chord(&self.face), thickness: along_chord(&self.thickness) }
    }

    pub(crate) fn laws(n_blades: usize, area_ratio: f64, pitch_ratio: f64) -> WageningenLaws {
        let column = column(n_blades);
        #[expect(clippy::cast_precision_loss, reason = "at most 7")]
        let z = n_blades as f64;
        let unit = area_ratio / z;
        let pitch = |d: &Dims| if n_blades == 4 { pitch_ratio * d.four_blade_pitch } else { pitch_ratio };
        let chord = DIMS.iter().map(|d| (d.radius, unit * d.chord[column])).chain([(1.0, 0.0)]);
        let thickness = DIMS.iter().map(|d| (d.radius, d.thickness[0] - z * d.thickness[1]));
        // The tip lies where the outer four radii lead: there both lengths that make the tabulated
        // ratio are zero.
        let offset = |d: &Dims| unit * d.chord[column] * (0.5 - d.leading[column]);
        let outer: Vec<_> = DIMS[4..].iter().map(|d| (d.radius, offset(d))).collect();
        let tip_offset = polynomial_through(&outer, 1.0);
        // Offsets are along the helix over D; the angle is that of their share around the axis.
        let angle = |radius: f64, offset: f64, pitch: f64| {
            offset * pitch.atan2(std::f64::consts::PI * radius).cos() / (0.5 * radius)
        };
        let skew = DIMS.iter().map(|d| (d.radius, angle(d.radius, offset(d), pitch(d))));
        let rake = [0.0, 0.4, 0.7, 1.0].map(|r| (r, -0.5 * r * RAKE_DEG.to_radians().tan()));
        WageningenLaws {
            chord: chord_spline(chord.collect::<Vec<_>>().into_iter()),
            pitch: table_spline(DIMS.iter().map(|d| (d.radius, pitch(d))).chain([(1.0, pitch_ratio)])),
            skew: table_spline(skew.chain([(1.0, angle(1.0, tip_offset, pitch_ratio))])),
            rake: table_spline(rake.into_iter()),
            thickness: table_spline(thickness.chain([(1.0, TIP_THICKNESS)])),
        }
    }
}

/// The polynomial through points, at `x` (Lagrange).
fn polynomial_through(points: &[(f64, f64)], x: f64) -> f64 {
    let weight = |i: usize| {
        let others = points.iter().enumerate().filter(|&(j, _)| j != i);
        others.map(|(_, &(xj, _))| (x - xj) / (points[i].0 - xj)).product::<f64>()
    };
    points.iter().enumerate().map(|(i, &(_, y))| weight(i) * y).sum()
}
