//! Descriptions of solids that cannot be made: each is refused with its reason.

use facemill_sample_parts::{
    BladeResolution, BladeSide, Bore, FilletStation, Hand, OffsetUnit, PropellerSeries, PropellerSpec, PropellerTable,
    RootFillet, SectionOffsets, SolidForm, SpecError, TableSections, TableThickness, fillet_contact, propeller_solid,
};

use crate::solid_laws::{constant, propeller, resolution, varying};

fn refusal(spec: &PropellerSpec, fillet: RootFillet, bore: Option<Bore>, tolerance: f64) -> SpecError {
    let form = SolidForm { fillet, bore };
    propeller_solid(spec, &form, resolution(10, 20), tolerance).expect_err("no solid")
}

fn edges(middle: f64, edge: f64) -> RootFillet {
    let at = |chord_fraction, radius| FilletStation { chord_fraction, suction: radius, pressure: radius };
    RootFillet::varying(&[at(0.0, edge), at(0.3, middle), at(0.7, middle), at(1.0, edge)]).expect("radii")
}

#[test]
fn numbers_of_fillets_and_bores_have_ranges() {
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e5] {
        assert!(matches!(RootFillet::constant(radius), Err(SpecError::OutOfRange { field: "fillet radius", .. })));
        assert!(radius > 1e4 && radius.is_finite() || Bore::cylinder(radius).is_err(), "{radius}");
    }
    let at = |chord_fraction, suction, pressure| FilletStation { chord_fraction, suction, pressure };
    for stations in [
        vec![],
        vec![at(0.0, 1.0, 1.0)],
        vec![at(0.0, 1.0, 1.0), at(0.9, 1.0, 1.0)],
        vec![at(0.1, 1.0, 1.0), at(1.0, 1.0, 1.0)],
        vec![at(0.0, 1.0, 1.0), at(0.6, 1.0, 1.0), at(0.5, 1.0, 1.0), at(1.0, 1.0, 1.0)],
        vec![at(0.0, 1.0, 1.0), at(0.5, 1.0, 1.0), at(0.5, 2.0, 1.0), at(1.0, 1.0, 1.0)],
        vec![at(0.0, 1.0, 1.0), at(f64::NAN, 1.0, 1.0), at(1.0, 1.0, 1.0)],
        vec![at(0.0, 1.0, 2.0), at(1.0, 1.0, 1.0)],
        vec![at(0.0, 1.0, 1.0), at(1.0, 1.0, 2.0)],
        vec![at(0.0, 1.0, 1.0), at(0.5, 1.0, -2.0), at(1.0, 1.0, 1.0)],
        (0..=1000).map(|k| at(f64::from(k) / 1000.0, 1.0, 1.0)).collect(),
    ] {
        assert!(RootFillet::varying(&stations).is_err(), "{stations:?}");
    }
}

#[test]
fn solids_have_ranges() {
    let spec = propeller(PropellerSeries::Dtmb4119, 1000.0);
    for tolerance in [0.0, -1.0, 1e-9, 20.0, f64::NAN] {
        assert!(matches!(refusal(&spec, constant(10.0), None, tolerance), SpecError::OutOfRange { .. }));
    }
    for radius in [0.05, 205.0, 5000.0] {
        let found = refusal(&spec, constant(radius), None, 0.5);
        assert!(matches!(found, SpecError::OutOfRange { field: "fillet radius", .. }), "{found}");
        assert!(fillet_contact(&spec, &constant(radius), BladeSide::Suction, 0.5).is_err());
    }
    let form = SolidForm { fillet: constant(10.0), bore: None };
    let found = propeller_solid(&spec, &form, resolution(2000, 2000), 0.5).expect_err("too large");
    assert!(matches!(found, SpecError::OutOfRange { field: "number of vertices of a solid's blades", .. }), "{found}");
    for (aft, ahead) in [(71.0, 30.0), (30.0, 71.0), (1.0, 30.0), (100.0, 100.0)] {
        let bore = Bore::taper(aft, ahead).expect("radii");
        assert!(matches!(refusal(&spec, constant(10.0), Some(bore), 0.5), SpecError::OutOfRange { .. }));
    }
}

#[test]
fn fillets_that_fold_are_refused_at_their_place() {
    // The edges of both lean over the hub.
    for (series, diameter, radius) in [(PropellerSeries::Vp1304, 250.0, 8.0), (PropellerSeries::Dtmb4119, 1000.0, 80.0)]
    {
        match refusal(&propeller(series, diameter), constant(radius), None, 0.1) {
            SpecError::Fillet { chord_fraction, message, .. } => {
                assert!(!(0.02..=0.98).contains(&chord_fraction), "{chord_fraction}");
                assert!(message.contains("folds"), "{message}");
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn fillets_have_room_between_blades() {
    let narrow = PropellerSeries::WageningenB { n_blades: 7, area_ratio: 0.85, pitch_ratio: 0.7 };
    let found = refusal(&propeller(narrow, 1000.0), edges(40.0, 2.0), None, 0.2);
    assert!(matches!(&found, SpecError::Fillet { message, .. } if message.contains("next blade")), "{found}");
    let words = found.to_string();
    assert!(words.contains("root fillet at x/c") && words.contains("smaller"), "{words}");
}

/// A table that gives the hub's length: fillets that go beyond it are refused, with the length that
/// they need, and that length is enough.
#[test]
fn fillets_stay_on_a_hub_of_given_length() {
    let of = |hub_length_ratio: f64| {
        let table = PropellerSeries::Dtmb4119.table().expect("a table");
        let table = PropellerTable { hub_length_ratio: Some(hub_length_ratio), ..table };
        PropellerSpec::from_table(table, 1000.0).expect("a propeller")
    };
    let bare = of(0.335);
    let needed = match refusal(&bare, edges(30.0, 8.0), None, 0.2) {
        SpecError::OutOfRange { field: "hub length with root fillets", value, least, .. } => {
            assert!((value - 335.0).abs() < 1e-9);
            least
        }
        other => panic!("{other}"),
    };
    let form = SolidForm { fillet: edges(30.0, 8.0), bore: None };
    let mesh = propeller_solid(&of(needed * 1.000_001 / 1000.0), &form, resolution(10, 20), 0.2).expect("a solid");
    let ends = mesh.groups().iter().find(|group| group.name == "hub/ends").expect("ends").triangles.clone();
    let z: Vec<f64> = ends.flat_map(|t| mesh.corners(t)).map(|p| p.z).collect();
    let length = z.iter().copied().fold(f64::MIN, f64::max) - z.iter().copied().fold(f64::MAX, f64::min);
    assert!((length / needed - 1.0).abs() < 1e-5, "{length} of {needed}");
    assert!(propeller_solid(&of(2.0), &form, resolution(10, 20), 0.2).is_ok(), "a long hub has room");
}

/// Sections that end in an edge without thickness: no ball rolls around it.
#[test]
fn sharp_edges_are_refused() {
    let stations = vec![0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0];
    let half: Vec<f64> = vec![0.0, 0.03, 0.05, 0.055, 0.04, 0.015, 0.0];
    let radii = vec![0.2, 0.4, 0.6, 0.8, 1.0];
    let rows = |sign: f64| vec![half.iter().map(|h| sign * h).collect::<Vec<f64>>(); radii.len()];
    let table = PropellerTable {
        sections: TableSections::Offsets(SectionOffsets {
            radii: radii.clone(),
            stations,
            suction: rows(1.0),
            pressure: rows(-1.0),
            unit: OffsetUnit::Chord,
        }),
        radii,
        chord: vec![0.3, 0.35, 0.38, 0.35, 0.2],
        pitch: vec![1.0; 5],
        skew: vec![0.0; 5],
        rake: vec![0.0; 5],
        ..PropellerSeries::Dtmb4119.table().expect("a table")
    };
    let spec = PropellerSpec::from_table(table, 1000.0).expect("a propeller");
    let found = refusal(&spec, varying(10.0), None, 0.2);
    match &found {
        SpecError::Fillet { chord_fraction, message, .. } => {
            assert!(*chord_fraction > 0.99 && message.contains("sharp"), "{found}");
        }
        other => panic!("{other}"),
    }
}

/// A table of numbers at random, with sections of all kinds.
fn any_table(random: &mut facemill_test_kit::Random) -> PropellerTable {
    let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
    let hub_ratio = between(0.05, 0.5);
    let radii: Vec<f64> = (0..6).map(|k| hub_ratio + (1.0 - hub_ratio) * f64::from(k) / 5.0).collect();
    let chord = between(0.05, 1.2);
    let thickness = between(0.02, 0.3);
    let [skew, rake] = [between(-1.0, 1.0), between(-0.2, 0.2)];
    let sections = match between(0.0, 3.0) as u32 {
        0 => TableSections::WageningenB {
            thickness: TableThickness::OfDiameter(radii.iter().map(|r| 0.05 - 0.045 * r).collect()),
        },
        1 => TableSections::Naca66A08 {
            thickness: TableThickness::OfChord(radii.iter().map(|r| thickness * (1.1 - r)).collect()),
            camber: vec![between(-0.05, 0.05); 6],
        },
        _ => {
            let edge = between(0.002, 0.02);
            let half = [edge, 0.03, 0.05, 0.055, 0.04, 0.02, edge];
            let rows = |sign: f64| vec![half.map(|h| sign * h).to_vec(); 6];
            TableSections::Offsets(SectionOffsets {
                radii: radii.clone(),
                stations: vec![0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0],
                suction: rows(1.0),
                pressure: rows(-1.0),
                unit: OffsetUnit::Chord,
            })
        }
    };
    PropellerTable {
        n_blades: between(2.0, 12.99) as usize,
        hand: if between(0.0, 1.0) < 0.5 { Hand::Left } else { Hand::Right },
        hub_ratio,
        hub_length_ratio: None,
        chord: radii.iter().map(|r| chord * (1.2 - r) * (0.5 + r)).collect(),
        pitch: radii.iter().map(|_| between(0.3, 2.0)).collect(),
        skew: radii.iter().map(|r| skew * (r - hub_ratio)).collect(),
        rake: radii.iter().map(|r| rake * r).collect(),
        radii,
        sections,
    }
}

/// Numbers at random: a closed solid or a fault, and no panic.
#[test]
fn any_numbers_give_a_solid_or_a_fault() {
    let mut random = facemill_test_kit::Random(21);
    let (mut n_solids, mut n_faults, mut n_tables) = (0, 0, 0);
    for k in 0..120 {
        let spec = if k % 2 == 0 {
            let series = PropellerSeries::WageningenB {
                n_blades: 2 + (6.0 * random.unit()) as usize,
                area_ratio: 0.3 + 0.75 * random.unit(),
                pitch_ratio: 0.5 + 0.9 * random.unit(),
            };
            propeller(series, 1000.0)
        } else {
            let Ok(spec) = PropellerSpec::from_table(any_table(&mut random), 1000.0) else { continue };
            spec
        };
        let middle = 0.05 + 60.0 * random.unit().powi(2);
        let form = SolidForm { fillet: edges(middle, middle * (0.02 + 0.4 * random.unit())), bore: None };
        let resolution = BladeResolution::new(8 + (8.0 * random.unit()) as usize, 8).expect("in range");
        let tolerance = spec.hub_radius() * (1e-3 + 0.03 * random.unit());
        match propeller_solid(&spec, &form, resolution, tolerance) {
            Ok(mesh) => {
                assert!(crate::kit::is_closed(&mesh), "{spec:?} {form:?} {resolution:?} {tolerance}");
                assert!(crate::kit::volume(&mesh) > 0.0, "{spec:?} {form:?} {resolution:?} {tolerance}");
                n_solids += 1;
                n_tables += k % 2;
            }
            Err(fault) => {
                println!("{fault}");
                assert!(!fault.to_string().contains("NaN"), "{fault}");
                n_faults += 1;
            }
        }
    }
    println!("{n_solids} solids, {n_tables} of them of tables, {n_faults} faults");
    assert!(n_solids > 20 && n_faults > 10 && n_tables > 5, "{n_solids} solids, {n_tables}, {n_faults} faults");
}
