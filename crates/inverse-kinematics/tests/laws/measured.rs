//! Machines from measurements: they move as their presets, and as plain rotation matrices.

use crate::common::*;
use facemill_inverse_kinematics::machine_file::AssumedValue;
use facemill_inverse_kinematics::measured::*;
use facemill_inverse_kinematics::*;
use nalgebra::{Matrix3, Vector3};

fn about_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

fn about_y(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// Turn about a line at 45° between +y and z or −z: z goes to the line, turns there, and goes back.
fn about_oblique(lean: MeasuredLean, angle: f64) -> Matrix3<f64> {
    let to_line = about_x(if lean == MeasuredLean::PlusY { -1.0 } else { -3.0 } * std::f64::consts::FRAC_PI_4);
    to_line * about_z(angle) * to_line.transpose()
}

/// Tip and tool axis in the table frame, by hand for each family: `q` has the readings of X, Y, Z,
/// the tilting axis and C, `signs` −1 for those that count against ISO 841.
pub(crate) fn by_hand(
    family: MeasuredFamily,
    m: &PlaceMeasurements,
    q: [f64; 5],
    signs: [f64; 5],
    length: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    // The nose is on the table's origin where the readings are those of `table_at`.
    let at = m.table_at.unwrap();
    let nose = Vector3::from([0, 1, 2].map(|k| signs[k] * (q[k] - at[k])));
    let [tilt, c] = [3, 4].map(|k| signs[k] * q[k]);
    let up = Vector3::z();
    let tilted = match (m.lean, family.tilting_axis()) {
        (Some(lean), _) => about_oblique(lean, tilt),
        (None, "A") => about_x(tilt),
        (None, _) => about_y(tilt),
    };
    let on_trunnion = |point: [f64; 3]| {
        let point = Vector3::from(point);
        let tip = nose - up * length;
        (about_z(c) * (tilted * (tip - point) + point), about_z(c) * tilted * up)
    };
    // From the nose to the tilting axis, and from there to the tip.
    let beside = if family.tilting_axis() == "A" { Vector3::y() } else { Vector3::x() };
    let to_pivot = || up * m.pivot_length.unwrap() + beside * m.pivot_offset.unwrap();
    let from_pivot = || tilted * (-to_pivot() - up * length);
    let in_fork = || {
        let [cx, cy] = m.c_offset.unwrap();
        let to_c = Vector3::new(cx, cy, 0.0);
        (nose + to_c + about_z(c) * (to_pivot() - to_c + from_pivot()), about_z(c) * tilted * up)
    };
    match family {
        MeasuredFamily::TableTableBc | MeasuredFamily::TableTableAc | MeasuredFamily::TableTableNutatingBc => {
            on_trunnion(m.table_tilt.unwrap())
        }
        MeasuredFamily::HeadTableBc | MeasuredFamily::HeadTableAc | MeasuredFamily::HeadNutatingTableBc => {
            (about_z(c) * (nose + to_pivot() + from_pivot()), about_z(c) * tilted * up)
        }
        MeasuredFamily::HeadHeadCa | MeasuredFamily::HeadHeadCb => in_fork(),
        other => panic!("no formula for {other}"),
    }
}

pub(crate) fn random_places(r: &mut Random, family: MeasuredFamily) -> PlaceMeasurements {
    let mut near = |size: f64| if r.below(4) == 0 { 0.0 } else { r.between(-size, size) };
    let on_table = family.name().starts_with("table-table");
    let leans = family.name().contains("nutating");
    let is_fork = matches!(family, MeasuredFamily::HeadHeadCa | MeasuredFamily::HeadHeadCb);
    PlaceMeasurements {
        table_at: Some([near(900.0), near(900.0), near(1500.0)]),
        table_tilt: on_table.then(|| [near(40.0), near(40.0), near(200.0)]),
        pivot_length: (!on_table).then(|| 250.0 + near(100.0)),
        pivot_offset: (!on_table).then(|| near(30.0)),
        c_offset: is_fork.then(|| [near(50.0), near(50.0)]),
        lean: leans.then(|| if near(1.0) < 0.0 { MeasuredLean::MinusY } else { MeasuredLean::PlusY }),
    }
}

pub(crate) fn built(family: MeasuredFamily, measured: &Measurements) -> Machine {
    let made = machine_from_measurements(family, measured).unwrap_or_else(|e| panic!("{family} {measured:?}: {e}"));
    let json = facemill_file_format::to_json(&made.file);
    Machine::from_json(json.as_bytes()).unwrap_or_else(|e| panic!("{family}: {e}"))
}

#[test]
fn a_machine_without_measurements_moves_as_its_preset() {
    let mut r = Random(4101);
    for family in MeasuredFamily::ALL {
        let preset = Machine::from_json(preset(family.preset_name()).unwrap().as_bytes()).unwrap();
        let machine = built(family, &Measurements::default());
        assert_eq!(machine.family(), preset.family());
        for (a, b) in machine.axes().iter().zip(preset.axes()) {
            assert_eq!((a.letter, a.endless, a.carried_by), (b.letter, b.endless, b.carried_by), "{family}");
            assert_eq!((a.min, a.max), (b.min, b.max), "{family} {}", a.letter);
        }
        assert_eq!(machine.home(), preset.home(), "{family}");
        for _ in 0..500 {
            let q = random_values(&mut r, &preset);
            let (a, b) = (machine.forward(&q, 123.0), preset.forward(&q, 123.0));
            let shift = (a.translation.vector - b.translation.vector).norm();
            let turn = (a.rotation.to_rotation_matrix().matrix() - b.rotation.to_rotation_matrix().matrix()).norm();
            assert!(shift < 1e-9 && turn < 1e-9, "{family}: {shift:e} mm, {turn:e} at {q:?}");
        }
    }
}

#[test]
fn measured_machines_move_as_rotation_matrices_say() {
    let mut r = Random(4102);
    for family in MeasuredFamily::ALL {
        for round in 0..100 {
            let places = random_places(&mut r, family);
            let tilting = family.tilting_axis();
            let senses = ["X", "Y", "Z", tilting, "C"].map(|axis| (axis, r.below(4) == 0));
            let signs = senses.map(|(_, reversed)| if reversed { -1.0 } else { 1.0 });
            let reversed = senses.into_iter().filter(|(_, reversed)| *reversed);
            let axes = reversed.map(|(axis, _)| counting(axis, MeasuredSense::Reversed)).collect();
            let machine = built(family, &Measurements { places: places.clone(), axes });
            for _ in 0..20 {
                let q = random_values(&mut r, &machine);
                let values = senses.map(|(axis, _)| q[machine.axis_index(axis).unwrap()]);
                let length = r.between(0.0, 400.0);
                let (tip, axis) = by_hand(family, &places, values, signs, length);
                let cl = machine.cl_point(&q, length);
                let (shift, turn) = ((cl.tip.coords - tip).norm(), (*cl.axis - axis).norm());
                assert!(
                    shift < 1e-9 && turn < 1e-12,
                    "{family} round {round}: {shift:e} mm, {turn:e}; {places:?} {q:?}"
                );
            }
        }
    }
}

pub(crate) fn counting(axis: &str, sense: MeasuredSense) -> AxisMeasurement {
    AxisMeasurement { axis: axis.to_owned(), sense: Some(sense), ..Default::default() }
}

/// Readings of reversed axes are those of the preset with their signs turned: same poses, same
/// travel, same places.
#[test]
fn a_reversed_axis_reads_the_other_way_and_changes_nothing_else() {
    let mut r = Random(4103);
    for family in MeasuredFamily::ALL {
        let preset = built(family, &Measurements::default());
        for axis in ["X", "Y", "Z", family.tilting_axis(), "C"] {
            let axes = vec![counting(axis, MeasuredSense::Reversed)];
            let machine = built(family, &Measurements { axes, ..Default::default() });
            let index = machine.axis_index(axis).unwrap();
            let (a, b) = (&machine.axes()[index], &preset.axes()[index]);
            assert!(a.endless || (a.min, a.max) == (-b.max, -b.min), "{family} {axis}: {} to {}", a.min, a.max);
            assert_eq!(machine.home()[index], -preset.home()[index], "{family} {axis}");
            for _ in 0..20 {
                let q = random_values(&mut r, &preset);
                let mut turned = q;
                turned[index] = -q[index];
                let (a, b) = (machine.forward(&turned, 80.0), preset.forward(&q, 80.0));
                let shift = (a.translation.vector - b.translation.vector).norm();
                assert!(shift < 1e-9 && a.rotation.angle_to(&b.rotation) < 1e-7, "{family} {axis}: {shift:e} mm");
            }
        }
    }
}

/// `table_at` has the readings with the nose on the table's origin, whichever way axes count.
#[test]
fn the_nose_is_on_the_origin_of_the_table_at_the_readings_of_table_at() {
    let at = [100.0, -37.5, -612.25];
    for family in MeasuredFamily::ALL {
        for reversed in 0..8 {
            let mut measured = Measurements::default();
            measured.places.table_at = Some(at);
            let linear = ["X", "Y", "Z"].into_iter().enumerate().filter(|(k, _)| reversed >> k & 1 == 1);
            measured.axes = linear.map(|(_, axis)| counting(axis, MeasuredSense::Reversed)).collect();
            let machine = built(family, &measured);
            let mut q = AxisValues::zeros(machine.axes().len());
            for (axis, reading) in ["X", "Y", "Z"].into_iter().zip(at) {
                q[machine.axis_index(axis).unwrap()] = reading;
            }
            let far = machine.forward(&q, 0.0).translation.vector.norm();
            assert!(far < 1e-9, "{family}, reversed {reversed:03b}: {far} mm");
        }
    }
}

/// A rotary axis whose sense nobody stated counts as ISO 841 has it, and the file says so.
#[test]
fn senses_of_rotary_axes_are_assumed_until_they_are_stated() {
    for family in MeasuredFamily::ALL {
        let tilting = family.tilting_axis();
        let senses = |axes: Vec<AxisMeasurement>| {
            let made = machine_from_measurements(family, &Measurements { axes, ..Default::default() }).unwrap();
            let assumed = [tilting, "C"].map(|axis| made.file.is_assumed(AssumedValue::Sense, axis));
            let values = made.values.iter().filter(|value| value.key == "sense");
            let values: Vec<_> = values.map(|value| (value.text.clone(), value.is_measured)).collect();
            assert!(!made.file.is_assumed(AssumedValue::Sense, "X"), "{family}");
            (assumed, values, made.file.tool_chains, made.file.workpiece_chain)
        };
        let text = |axis: &str, sense: &str, is_measured| (format!("{axis}={sense}"), is_measured);
        let none = senses(Vec::new());
        assert_eq!(none.0, [true, true], "{family}");
        assert_eq!(none.1, [text(tilting, "iso", false), text("C", "iso", false)], "{family}");
        let iso = senses(vec![counting(tilting, MeasuredSense::Iso)]);
        assert_eq!(iso.0, [false, true], "{family}");
        assert_eq!(iso.1, [text(tilting, "iso", true), text("C", "iso", false)], "{family}");
        assert_eq!((&iso.2, &iso.3), (&none.2, &none.3), "{family}");
        let reversed = senses(vec![counting("C", MeasuredSense::Reversed), counting("Y", MeasuredSense::Iso)]);
        assert_eq!(reversed.0, [true, false], "{family}");
        let expected = [text("Y", "iso", true), text(tilting, "iso", false), text("C", "reversed", true)];
        assert_eq!(reversed.1, expected, "{family}");
    }
}

/// ISO 841: +B turns right-handed about +Y, so that the tool axis tilts from +z toward +x. About a
/// line at 45° its x is sin 45°·sin B, whichever way the line leans.
#[test]
fn plus_b_tilts_the_tool_toward_plus_x_for_either_lean() {
    let b = 10_f64.to_radians();
    for family in [MeasuredFamily::HeadNutatingTableBc, MeasuredFamily::TableTableNutatingBc] {
        for lean in [MeasuredLean::PlusY, MeasuredLean::MinusY] {
            for (sense, sign) in [(MeasuredSense::Iso, 1.0), (MeasuredSense::Reversed, -1.0)] {
                let places = PlaceMeasurements { lean: Some(lean), ..PlaceMeasurements::default() };
                let machine = built(family, &Measurements { places, axes: vec![counting("B", sense)] });
                let axis = machine.forward(&AxisValues::from([0.0, 0.0, 0.0, b, 0.0]), 0.0).rotation * Vector3::z();
                assert!(
                    (axis.x - sign * 0.5_f64.sqrt() * b.sin()).abs() < 1e-12,
                    "{family} {lean:?} {sense:?}: {axis}"
                );
                assert!((axis.z - 0.5 * (1.0 + b.cos())).abs() < 1e-12, "{family} {lean:?}: {axis}");
            }
        }
    }
}

/// The same tool axis needs B with the opposite sign, and C half a turn off; the preset leans
/// toward +y.
#[test]
fn the_other_lean_has_minus_b_and_c_by_half_a_turn() {
    let mut r = Random(4107);
    for family in [MeasuredFamily::HeadNutatingTableBc, MeasuredFamily::TableTableNutatingBc] {
        let leaning = |lean| {
            let places = PlaceMeasurements { lean, ..PlaceMeasurements::default() };
            let wide = AxisMeasurement { limits: Some(AxisLimits::Between(-9e3, 9e3)), ..AxisMeasurement::default() };
            let mut axes = ["X", "Y", "Z", "B"].map(|axis| AxisMeasurement { axis: axis.to_owned(), ..wide.clone() });
            axes[3].limits = Some(AxisLimits::Between(-180.0, 180.0));
            built(family, &Measurements { places, axes: axes.into() })
        };
        let [plus, minus] = [MeasuredLean::PlusY, MeasuredLean::MinusY].map(|lean| leaning(Some(lean)));
        assert_eq!(leaning(None).to_file().tool_chains, plus.to_file().tool_chains);
        assert!(plus.family().to_string().contains("nutating, 45° toward +y"), "{}", plus.family());
        assert!(minus.family().to_string().contains("nutating, 45° toward -y"), "{}", minus.family());
        for _ in 0..200 {
            let cl = plus.cl_point(&random_values(&mut r, &plus), 80.0);
            let [of_plus, of_minus] = [&plus, &minus].map(|machine| machine.inverse(&cl, 80.0).unwrap());
            assert_eq!(of_plus.len(), of_minus.len());
            for one in of_plus.iter() {
                let [b, c] = [-one.values[3], one.values[4] + std::f64::consts::PI];
                let apart = |other: AxisValues| (other[3] - b).abs().max(2.0 * (0.5 * (other[4] - c)).sin().abs());
                let off = of_minus.iter().map(|other| apart(other.values)).fold(f64::INFINITY, f64::min);
                assert!(off < 1e-9, "{family}: {off:e} rad at {cl:?}");
            }
        }
    }
    let places = PlaceMeasurements { lean: Some(MeasuredLean::PlusY), ..PlaceMeasurements::default() };
    let error = machine_from_measurements(MeasuredFamily::HeadTableBc, &Measurements { places, axes: Vec::new() });
    assert_eq!(
        error.unwrap_err().to_string(),
        "lean is no value of head-table-bc, which has table_at, pivot_length, pivot_offset"
    );
}

/// Puts a reported value back as a measured one.
fn put_back(measured: &mut Measurements, value: &ReportedValue) {
    let numbers = |text: &str| text.split(',').map(|v| v.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let places = &mut measured.places;
    match value.key {
        "table_at" => places.table_at = Some(numbers(&value.text).try_into().unwrap()),
        "table_tilt" => places.table_tilt = Some(numbers(&value.text).try_into().unwrap()),
        "pivot_length" => places.pivot_length = Some(numbers(&value.text)[0]),
        "pivot_offset" => places.pivot_offset = Some(numbers(&value.text)[0]),
        "lean" if value.text == "+y" => places.lean = Some(MeasuredLean::PlusY),
        "c_offset" => places.c_offset = Some(numbers(&value.text).try_into().unwrap()),
        key => {
            let (axis, text) = value.text.split_once('=').unwrap();
            let entry = match measured.axes.iter().position(|entry| entry.axis == axis) {
                Some(k) => &mut measured.axes[k],
                None => {
                    measured.axes.push(AxisMeasurement { axis: axis.to_owned(), ..Default::default() });
                    measured.axes.last_mut().unwrap()
                }
            };
            let number = text.parse::<f64>().ok();
            let is_reversed = text == "reversed";
            match key {
                "limits" => {
                    let between =
                        |(min, max): (&str, &str)| AxisLimits::Between(min.parse().unwrap(), max.parse().unwrap());
                    entry.limits = Some(text.split_once(':').map_or(AxisLimits::Endless, between));
                }
                "home" => entry.home = number,
                "rapid" => entry.max_velocity = number,
                "acceleration" => entry.max_acceleration = number,
                "jerk" => entry.max_jerk = number,
                "sense" => entry.sense = Some(if is_reversed { MeasuredSense::Reversed } else { MeasuredSense::Iso }),
                other => panic!("{other}"),
            }
        }
    }
}

#[test]
fn reported_values_given_back_make_the_same_machine_with_nothing_assumed() {
    for family in MeasuredFamily::ALL {
        let by_preset = machine_from_measurements(family, &Measurements::default()).unwrap();
        assert!(by_preset.values.iter().all(|value| !value.is_measured));
        assert!(by_preset.file.joints().all(|joint| by_preset.file.is_assumed(AssumedValue::Limits, joint.axis())));
        let mut measured = Measurements::default();
        by_preset.values.iter().for_each(|value| put_back(&mut measured, value));
        let again = machine_from_measurements(family, &measured).unwrap();
        assert!(again.values.iter().all(|value| value.is_measured), "{family}: {:?}", again.values);
        assert_eq!(again.file.workpiece_chain, by_preset.file.workpiece_chain, "{family}");
        assert_eq!(again.file.tool_chains, by_preset.file.tool_chains, "{family}");
        let assumed: Vec<AssumedValue> = again.file.assumed.iter().map(|a| a.value).collect();
        assert_eq!(assumed, [AssumedValue::Motion, AssumedValue::Feed], "{family}");
    }
}

/// Every measured value leaves the list of assumed ones, for its own axes alone.
#[test]
fn assumed_values_are_those_that_nobody_measured() {
    let family = MeasuredFamily::HeadHeadCa;
    let mut measured = Measurements::default();
    measured.places.pivot_length = Some(170.0);
    measured.places.pivot_offset = Some(0.0);
    measured.axes.push(AxisMeasurement {
        axis: "Z".to_owned(),
        limits: Some(AxisLimits::Between(-900.0, -100.0)),
        max_velocity: Some(40_000.0),
        ..Default::default()
    });
    let file = machine_from_measurements(family, &measured).unwrap().file;
    let is = |value, axis| file.is_assumed(value, axis);
    assert!(!is(AssumedValue::Dimensions, "A") && is(AssumedValue::Dimensions, "C"));
    assert!(is(AssumedValue::Dimensions, "X") && is(AssumedValue::Dimensions, "Z"));
    assert!(!is(AssumedValue::Limits, "Z") && is(AssumedValue::Limits, "X"));
    assert!(!is(AssumedValue::MaxVelocity, "Z") && is(AssumedValue::MaxVelocity, "C"));
    // The preset's home 0 is above these limits.
    assert!(is(AssumedValue::Home, "Z"));
    let machine = Machine::from_file(file).unwrap();
    assert_eq!(machine.home()[machine.axis_index("Z").unwrap()], -100.0);
}

#[test]
fn values_that_make_no_machine_are_named() {
    let with = |change: fn(&mut Measurements)| {
        let mut measured = Measurements::default();
        change(&mut measured);
        measured
    };
    let axis = |axis: &str| AxisMeasurement { axis: axis.to_owned(), ..Default::default() };
    let of = |entry: AxisMeasurement| Measurements { axes: vec![entry], ..Default::default() };
    let tables = MeasuredFamily::TableTableBc;
    let error = |family, measured: &Measurements| machine_from_measurements(family, measured).unwrap_err();

    let found = error(tables, &with(|m| m.places.pivot_length = Some(1.0)));
    assert!(found.key() == Some("pivot_length") && found.to_string().contains("table_tilt"), "{found}");
    let found = error(MeasuredFamily::HeadTableBc, &with(|m| m.places.c_offset = Some([0.0; 2])));
    assert_eq!(found.key(), Some("c_offset"));
    let found = error(MeasuredFamily::HeadHeadCa, &with(|m| m.places.table_tilt = Some([0.0; 3])));
    assert_eq!(found.key(), Some("table_tilt"));
    for wrong in [f64::NAN, f64::INFINITY, -2e6] {
        let mut measured = Measurements::default();
        measured.places.table_at = Some([0.0, wrong, 0.0]);
        assert!(matches!(error(tables, &measured), MeasureError::Length { key: "table_at", .. }));
    }
    for wrong in [0.0, -165.0] {
        let mut measured = Measurements::default();
        measured.places.pivot_length = Some(wrong);
        let found = error(MeasuredFamily::HeadHeadCb, &measured);
        assert_eq!((found.key(), &found), (Some("pivot_length"), &MeasureError::PivotLength { value: wrong }));
        assert!(found.to_string().contains("turn its sign"), "{found}");
    }
    assert!(matches!(error(tables, &of(axis("A"))), MeasureError::NoSuchAxis { .. }));
    let twice = Measurements { axes: vec![axis("B"), axis("B")], ..Default::default() };
    assert!(matches!(error(tables, &twice), MeasureError::AxisTwice { .. }));
    for (min, max) in [(1.0, -1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
        let limits = Some(AxisLimits::Between(min, max));
        assert!(matches!(error(tables, &of(AxisMeasurement { limits, ..axis("X") })), MeasureError::Limits { .. }));
    }
    let endless = AxisMeasurement { limits: Some(AxisLimits::Endless), ..axis("Y") };
    assert!(matches!(error(tables, &of(endless)), MeasureError::EndlessLinear { .. }));
    let home = AxisMeasurement { home: Some(121.0), ..axis("B") };
    assert!(matches!(error(tables, &of(home)), MeasureError::HomeOutside { .. }));
    let slow = AxisMeasurement { max_velocity: Some(0.0), ..axis("B") };
    let found = error(tables, &of(slow)).to_string();
    assert!(found.contains("max_velocity_deg_min (axis B)"), "{found}");
}
