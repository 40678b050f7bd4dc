//! Poses that touch one point, from rotation matrices: a right file agrees, and the sign that was
//! swapped in a wrong one is found.

use crate::common::Random;
use crate::measured::{built, by_hand, counting, random_places};
use facemill_inverse_kinematics::measured::*;
use facemill_inverse_kinematics::*;
use nalgebra::{Matrix3, Vector3};

/// A machine of a family, by its numbers alone.
struct Truth {
    family: MeasuredFamily,
    places: PlaceMeasurements,
    reversed: [bool; 5],
}

impl Truth {
    fn random(r: &mut Random, family: MeasuredFamily) -> Self {
        let reversed = [0, 1, 2, 3, 4].map(|k| k > 2 && r.below(3) == 0);
        let mut places = random_places(r, family);
        // An axis that leans is measured where it crosses the plane of C.
        if let (Some(tilt), Some(_)) = (&mut places.table_tilt, places.lean) {
            tilt[1] = 0.0;
        }
        Self { family, places, reversed }
    }

    fn letters(&self) -> [&'static str; 5] {
        ["X", "Y", "Z", self.family.tilting_axis(), "C"]
    }

    fn file(
        &self,
        places: PlaceMeasurements,
        reversed: [bool; 5],
    ) -> facemill_inverse_kinematics::machine_file::MachineFile {
        let of = self.letters().into_iter().zip(reversed).filter(|(_, reversed)| *reversed);
        let axes = of.map(|(axis, _)| counting(axis, MeasuredSense::Reversed)).collect();
        machine_from_measurements(self.family, &Measurements { places, axes }).unwrap().file
    }

    /// Readings of X, Y, Z that bring the tip to a point of the table, for these of the rotary
    /// axes.
    fn pose(&self, point: &Vector3<f64>, [tilt, c]: [f64; 2], length: f64) -> Readings {
        let signs = self.reversed.map(|reversed| if reversed { -1.0 } else { 1.0 });
        let tip =
            |xyz: Vector3<f64>| by_hand(self.family, &self.places, [xyz.x, xyz.y, xyz.z, tilt, c], signs, length).0;
        let at_zero = tip(Vector3::zeros());
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|unit| tip(unit) - at_zero);
        let xyz = Matrix3::from_columns(&columns).try_inverse().unwrap() * (point - at_zero);
        let values = [xyz.x, xyz.y, xyz.z, tilt.to_degrees(), c.to_degrees()];
        self.letters().map(str::to_owned).into_iter().zip(values).collect()
    }

    fn touches(&self, r: &mut Random, n: usize, known: bool) -> Touches {
        let point = Vector3::new(r.between(40.0, 200.0), r.between(-200.0, -40.0), r.between(10.0, 120.0));
        let length = r.between(50.0, 250.0);
        let poses = (0..n).map(|k| {
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            self.pose(&point, [side * r.between(0.3, 1.4), side * r.between(0.4, 1.2)], length)
        });
        let poses = poses.collect();
        Touches { poses, tool_length: length, point: known.then(|| point.into()), tolerance: 0.01 }
    }
}

#[test]
fn poses_of_the_machine_agree_with_its_file() {
    let mut r = Random(4201);
    for family in MeasuredFamily::ALL {
        for round in 0..40 {
            let truth = Truth::random(&mut r, family);
            let touches = truth.touches(&mut r, 2 + round % 2, round % 3 == 0);
            let check = check_touches(&truth.file(truth.places.clone(), truth.reversed), &touches).unwrap();
            assert!(check.agrees && check.apart < 1e-8 && check.fault().is_none(), "{family}: {check:?}");
            assert!(check.faults.is_empty(), "{family}: {check:?}");
        }
    }
}

/// Places with one sign turned, and what that is called.
fn with_other_signs(truth: &Truth) -> Vec<(PlaceMeasurements, SwappedSign)> {
    let mut all = Vec::new();
    let tilting = truth.family.tilting_axis().to_owned();
    let mut plant = |value: f64, sign: SwappedSign, change: &dyn Fn(&mut PlaceMeasurements)| {
        if value.abs() > 2.0 {
            let mut places = truth.places.clone();
            change(&mut places);
            all.push((places, sign));
        }
    };
    let place = |axis: &str, on_table, coordinate| SwappedSign::Place { axis: axis.to_owned(), on_table, coordinate };
    for (k, coordinate) in ['X', 'Y', 'Z'].into_iter().enumerate() {
        let at = truth.places.table_at.unwrap();
        plant(at[k], SwappedSign::TableAt { coordinate }, &|p| p.table_at.as_mut().unwrap()[k] *= -1.0);
        // The coordinate along an axis has no effect.
        let is_along = coordinate == if tilting == "A" { 'X' } else { 'Y' };
        if let Some(tilt) = truth.places.table_tilt.filter(|_| !is_along) {
            plant(tilt[k], place(&tilting, true, coordinate), &|p| p.table_tilt.as_mut().unwrap()[k] *= -1.0);
        }
    }
    let beside = if tilting == "A" { 'Y' } else { 'X' };
    if let Some(offset) = truth.places.pivot_offset {
        plant(offset, place(&tilting, false, beside), &|p| *p.pivot_offset.as_mut().unwrap() *= -1.0);
    }
    if let Some(offset) = truth.places.c_offset {
        plant(offset[0], place("C", false, 'X'), &|p| p.c_offset.as_mut().unwrap()[0] *= -1.0);
    }
    all
}

#[test]
fn a_swapped_sign_is_found_from_two_poses() {
    let mut r = Random(4202);
    let mut planted = 0;
    let mut alone = 0;
    for family in MeasuredFamily::ALL {
        for round in 0..12 {
            let truth = Truth::random(&mut r, family);
            let touches = truth.touches(&mut r, 2, round % 2 == 0);
            let mut wrong = Vec::new();
            // Linear senses are in question where the point is known.
            for k in if touches.point.is_some() { 0..5 } else { 3..5 } {
                let mut reversed = truth.reversed;
                reversed[k] = !reversed[k];
                let mut places = truth.places.clone();
                // The nose stays where it is at 0.
                if k < 3 {
                    places.table_at.as_mut().unwrap()[k] *= -1.0;
                }
                let sign = SwappedSign::Sense { axis: truth.letters()[k].to_owned() };
                wrong.push((truth.file(places, reversed), sign));
            }
            let of_places = with_other_signs(&truth);
            wrong.extend(of_places.into_iter().map(|(places, sign)| (truth.file(places, truth.reversed), sign)));
            for (file, sign) in wrong {
                let check = check_touches(&file, &touches).unwrap();
                // Poses that happen to hide a sign say so.
                if check.agrees {
                    assert!(check.untested.contains(&sign), "{family} {sign}: {check:?}");
                    continue;
                }
                let found = check.faults.iter().find(|fault| fault.signs == [sign.clone()]);
                let found = found.unwrap_or_else(|| panic!("{family} {sign}: {check:?} {touches:?}"));
                assert!(found.apart < 1e-6, "{family} {sign}: {check:?}");
                assert!(check.fault().unwrap().contains("another sign"), "{:?}", check.fault());
                planted += 1;
                alone += usize::from(check.faults.len() == 1);
            }
        }
    }
    // The signs are found, and nearly always as the only ones.
    assert!(planted > 400 && 10 * alone > 9 * planted, "{alone} of {planted}");
}

/// A wrong length that is no sign is reported as one that no sign explains.
#[test]
fn other_faults_are_not_taken_for_signs() {
    let mut r = Random(4203);
    for family in MeasuredFamily::ALL {
        let truth = Truth::random(&mut r, family);
        let touches = truth.touches(&mut r, 3, false);
        let mut places = truth.places.clone();
        match (&mut places.table_tilt, &mut places.pivot_length) {
            (Some(tilt), _) => tilt[2] += 3.217,
            (_, Some(length)) => *length += 3.217,
            _ => panic!("{family} has neither"),
        }
        let check = check_touches(&truth.file(places, truth.reversed), &touches).unwrap();
        assert!(!check.agrees && check.faults.is_empty(), "{family}: {check:?}");
        assert!(check.fault().unwrap().contains("measure pivots"), "{family}");
    }
}

#[test]
fn poses_that_test_nothing_are_refused() {
    let file = built(MeasuredFamily::TableTableBc, &Measurements::default()).to_file();
    let pose = |values: [f64; 5]| -> Readings {
        ["X", "Y", "Z", "B", "C"].map(str::to_owned).into_iter().zip(values).collect()
    };
    let of = |poses: Vec<Readings>| Touches { poses, tool_length: 100.0, point: None, tolerance: 0.1 };
    let error = |touches: &Touches| check_touches(&file, touches).unwrap_err().to_string();
    let (a, b) = (pose([0.0; 5]), pose([1.0, 0.0, 0.0, 0.0, 0.0]));
    assert!(error(&of(vec![a.clone()])).contains("1 pose(s) test nothing"));
    assert!(error(&of(vec![a.clone(), b.clone()])).contains("the same"));
    let mut short = pose([0.0, 0.0, 0.0, 5.0, 5.0]);
    short.pop();
    assert!(error(&of(vec![a.clone(), short])).contains("pose 2 has no reading of C; give all of X, Y, Z, B, C"));
    let mut twice = a.clone();
    twice.push(("B".to_owned(), 3.0));
    assert!(error(&of(vec![twice, b.clone()])).contains("pose 1 has a reading of B too many"));
    assert!(error(&of(vec![pose([f64::NAN, 0.0, 0.0, 1.0, 0.0]), a.clone()])).contains("X of pose 1 is NaN"));
    let tolerance = Touches { tolerance: 0.0, ..of(vec![a.clone(), b.clone()]) };
    assert!(error(&tolerance).contains("tolerance is 0"));
    let two: machine_file::MachineFile = serde_json::from_str(preset_dual_xyzb()).unwrap();
    assert!(check_touches(&two, &of(vec![a, b])).unwrap_err().to_string().contains("2 heads"));
}
