use facemill_cl_data::Posture;

use crate::search::bezier::SearchCurve;

/// The most postures of a lattice.
const MOST: usize = 96;

/// Finest distance of neighbours, as a turn of the tool axis, rad.
const FINEST: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Postures spread evenly over the ranges of a search curve, rotate counted as an amount: rows of equal tilt.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Tilt and amount of rotate.
    pub(crate) postures: Vec<Posture>,
    /// Distance of neighbours as a turn of the tool axis, at most, rad.
    pub(crate) spacing: f64,
}

impl Lattice {
    /// The lattice over a curve's ranges, corners included, as fine as [`MOST`] and [`FINEST`] allow.
    pub(crate) fn new(curve: &SearchCurve) -> Self {
        Self::within(curve, FINEST, MOST)
    }

    /// A lattice several times as fine, for points at which little is feasible.
    pub(crate) fn fine(curve: &SearchCurve) -> Self {
        Self::within(curve, FINEST / 4.0, 8 * MOST)
    }

    fn within(curve: &SearchCurve, finest: f64, most: usize) -> Self {
        let mut spacing = finest;
        loop {
            let postures = postures(curve, spacing);
            if postures.len() <= most {
                return Self { postures, spacing };
            }
            spacing *= 1.1;
        }
    }
}

fn postures(curve: &SearchCurve, spacing: f64) -> Vec<Posture> {
    let tilts = [curve.start().tilt, curve.end().tilt];
    let rotates = [curve.start().rotate.abs(), curve.end().rotate.abs()];
    evenly(tilts, tilts[1] - tilts[0], spacing)
        .flat_map(|tilt| {
            let turn = (rotates[1] - rotates[0]) * tilt.sin();
            evenly(rotates, turn, spacing).map(move |rotate| Posture { tilt, rotate })
        })
        .collect()
}

/// Values from one end to the other, both included, so many that neighbours are `spacing` of the `extent` apart at most.
fn evenly(ends: [f64; 2], extent: f64, spacing: f64) -> impl Iterator<Item = f64> {
    let steps = (extent / spacing - 1e-9).ceil().max(if ends[1] > ends[0] { 1.0 } else { 0.0 }) as usize;
    (0..=steps).map(move |k| if k == 0 { ends[0] } else { ends[0] + (ends[1] - ends[0]) * k as f64 / steps as f64 })
}

#[cfg(test)]
mod tests {
    use crate::search::bezier::SearchOrder;
    use crate::search::lattice::*;

    fn lattice(tilt: [f64; 2], rotate: [f64; 2]) -> Lattice {
        let posture = |k: usize| Posture { tilt: tilt[k].to_radians(), rotate: rotate[k].to_radians() };
        Lattice::new(&SearchCurve::new(posture(0), posture(1), SearchOrder::TiltFirst, 1.0).unwrap())
    }

    #[test]
    fn every_posture_of_the_ranges_is_near_one_of_the_lattice() {
        for (tilt, rotate) in [([2.0, 15.0], [0.0, -85.0]), ([0.0, 60.0], [0.0, 180.0]), ([5.0, 5.0], [30.0, 30.0])] {
            let lattice = lattice(tilt, rotate);
            assert!(!lattice.postures.is_empty() && lattice.postures.len() <= MOST);
            let axis = |p: Posture| {
                let (sin, cos) = p.tilt.sin_cos();
                nalgebra::Vector3::new(sin * p.rotate.cos(), sin * p.rotate.sin(), cos)
            };
            for i in 0..=20 {
                for j in 0..=20 {
                    let within = |ends: [f64; 2], k: i32| (ends[0] + (ends[1] - ends[0]) * f64::from(k) / 20.0).abs();
                    let p = Posture { tilt: within(tilt, i).to_radians(), rotate: within(rotate, j).to_radians() };
                    let nearest =
                        lattice.postures.iter().map(|q| axis(*q).angle(&axis(p))).fold(f64::INFINITY, f64::min);
                    assert!(nearest <= lattice.spacing, "{p:?}: {nearest} {}", lattice.spacing);
                }
            }
        }
        assert_eq!(lattice([5.0, 5.0], [30.0, 30.0]).postures.len(), 1);
    }
}
