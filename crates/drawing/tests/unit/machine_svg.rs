use std::collections::BTreeMap;

use crate::machine_svg::*;
use facemill_inverse_kinematics::measured::*;
use facemill_inverse_kinematics::{Machine, preset, preset_names};
use facemill_test_kit::{Random, texts_outside};

/// Centres of circles with a class, in pixels, in the order of the views.
fn marks(svg: &str) -> BTreeMap<String, Vec<[f64; 2]>> {
    let mut all: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    for tag in svg.split("<circle class=\"").skip(1) {
        let value = |key: &str| -> f64 {
            let rest = tag.split(&format!("{key}=\"")).nth(1).expect("an attribute");
            rest.split('"').next().unwrap().parse().expect("a number")
        };
        let class = tag.split('"').next().unwrap().to_owned();
        all.entry(class).or_default().push([value(" cx"), value(" cy")]);
    }
    all
}

/// Pixels per mm by the drawn scale.
fn scale(svg: &str) -> f64 {
    let tag = svg.split("class=\"scale\"").nth(1).expect("a scale");
    let from: f64 = tag.split(" d=\"M").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    let to: f64 = tag.split(" H").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let text = tag.split('>').nth(2).unwrap().split(" mm").next().unwrap();
    (to - from) / text.parse::<f64>().expect("a length")
}

/// Asserts that a mark is where these coordinates are in each view, seen from the table's origin.
fn assert_at(svg: &str, mark: &str, [x, y, z]: [f64; 3]) {
    let (marks, scale) = (marks(svg), scale(svg));
    for (view, [right, up]) in [[x, z], [y, z], [x, y]].into_iter().enumerate() {
        let [a, b] = [&marks[mark][view], &marks["table"][view]];
        let off = [a[0] - b[0] - scale * right, b[1] - a[1] - scale * up];
        assert!(off[0].abs() < 0.02 && off[1].abs() < 0.02, "{mark} in view {view}: {off:?} at {scale} pixels per mm");
    }
}

fn drawn(family: MeasuredFamily, places: PlaceMeasurements) -> String {
    let made = machine_from_measurements(family, &Measurements { places, axes: Vec::new() }).unwrap();
    machine_svg(&[Machine::from_file(made.file).unwrap()])
}

/// Nose and pivots are drawn to scale where the measured values say.
#[test]
fn pivots_are_to_scale_where_they_were_measured() {
    let mut r = Random(31);
    for round in 0..40 {
        let size = 10_f64.powf(r.between(-0.5, 3.2));
        let mut near = || [0, 1, 2].map(|_| r.between(-size, size));
        let (at, tilt, offset) = (near(), near(), near());
        let nose = at.map(|v| -v);
        let tables = PlaceMeasurements { table_at: Some(at), table_tilt: Some(tilt), ..Default::default() };
        let svg = drawn(MeasuredFamily::TableTableAc, tables.clone());
        assert_at(&svg, "nose", nose);
        // The coordinate along the axis has no effect: it is drawn next to the table's z.
        assert_at(&svg, "pivot-A", [0.0, tilt[1], tilt[2]]);
        assert_at(&svg, "pivot-C", [0.0; 3]);
        assert_at(&drawn(MeasuredFamily::TableTableBc, tables), "pivot-B", [tilt[0], 0.0, tilt[2]]);
        let length = size + 1.0;
        let fork = PlaceMeasurements {
            table_at: Some(at),
            pivot_length: Some(length),
            pivot_offset: Some(offset[0]),
            c_offset: Some([offset[1], offset[2]]),
            ..Default::default()
        };
        let svg = drawn(MeasuredFamily::HeadHeadCb, fork);
        assert_at(&svg, "pivot-B", [nose[0] + offset[0], nose[1], nose[2] + length]);
        assert_at(&svg, "pivot-C", [nose[0] + offset[1], nose[1] + offset[2], nose[2]]);
        assert_eq!(texts_outside(&svg), Vec::<String>::new(), "round {round}");
    }
}

/// A turn drawn about an axis that points to the eye goes counter-clockwise, away from it
/// clockwise.
#[test]
fn turns_are_drawn_in_their_sense() {
    for (sense, sign) in [(MeasuredSense::Iso, 1.0), (MeasuredSense::Reversed, -1.0)] {
        for family in [MeasuredFamily::TableTableBc, MeasuredFamily::HeadHeadCa, MeasuredFamily::HeadTableBc] {
            for (axis, toward) in [("C", 1.0), ("B", -1.0), ("A", 1.0)] {
                let axes = vec![AxisMeasurement { axis: axis.to_owned(), sense: Some(sense), ..Default::default() }];
                let Ok(made) = machine_from_measurements(family, &Measurements { axes, ..Default::default() }) else {
                    continue;
                };
                let svg = machine_svg(&[Machine::from_file(made.file).unwrap()]);
                // B points to the back of the front view, A to the eye of that from the right.
                let tag = svg.split(&format!("class=\"turn-{axis}\" points=\"")).nth(1).expect("a turn");
                let points: Vec<[f64; 2]> = tag
                    .split('"')
                    .next()
                    .unwrap()
                    .split(' ')
                    .map(|p| {
                        let (x, y) = p.split_once(',').unwrap();
                        [x.parse().unwrap(), y.parse().unwrap()]
                    })
                    .collect();
                let [a, b, c] = [points[0], points[5], points[10]];
                // y grows downward: a positive product is clockwise.
                let turn: f64 = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
                assert!(turn * sign * toward < 0.0, "{family} {axis} {sense:?}: {turn}");
            }
        }
    }
}

#[test]
fn every_preset_is_drawn_with_its_axes_and_what_is_assumed() {
    for name in preset_names() {
        let heads = Machine::heads_from_json(preset(name).unwrap().as_bytes()).unwrap();
        let svg = machine_svg(&heads);
        assert_eq!(texts_outside(&svg), Vec::<String>::new(), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        for axis in heads.iter().flat_map(Machine::axes) {
            assert!(svg.contains(&format!(">{}, ", axis.letter)), "{name} {}", axis.letter);
        }
        let file = heads[0].to_file();
        assert!(!file.is_assumed(AssumedValue::Dimensions, "X") || svg.contains(" *"), "{name}");
        assert_eq!(svg, machine_svg(&heads), "{name}");
    }
}

/// Offsets of zero are listed, and machines of which all points are one have a drawing.
#[test]
fn a_machine_without_offsets_is_drawn() {
    let places = PlaceMeasurements { table_at: Some([0.0; 3]), table_tilt: Some([0.0; 3]), ..Default::default() };
    let svg = drawn(MeasuredFamily::TableTableBc, places);
    assert!(svg.contains("nose: X 0, Y 0, Z 0<") && !svg.contains("class=\"dimension\""), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}
