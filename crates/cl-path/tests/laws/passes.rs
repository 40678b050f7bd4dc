//! Passes of cuts on a plate.

use facemill_cl_file::read_apt;
use facemill_cl_path::*;
use facemill_surface_model::Surface;
use facemill_test_kit::Random;
use facemill_tool_model::{Cutter, cl_from_cc};
use nalgebra::{Point3, Vector3};

use crate::plate;

const STEP: f64 = 4.0;

/// A face mill.
fn mill() -> Cutter {
    Cutter::new(20.0, 1.5, 8.0).expect("a cutter")
}

fn laid(plate: &Surface, text: &str, kind: ContactKind, allowance: f64) -> Result<ClPasses, String> {
    let cutter = mill();
    let settings = CutSettings { cutter: &cutter, tool: None, chord: 0.01, max_points: 10_000 };
    let cuts = read_cuts(&read_apt(text).expect("an APT file"), &settings).map_err(|e| e.to_string())?;
    let settings = LaySettings { kind, max_distance: 0.05, allowance, max_step: STEP, max_points: 10_000 };
    lay_cuts(plate, &cutter, &cuts, &settings).map_err(|e| e.to_string())
}

/// Two cuts across a plate of 200 mm with the bottom flat on it, joined at feed beside it.
fn facing(height: f64) -> String {
    format!(
        "UNITS/MM\nRAPID\nGOTO/-160,-15,{height}\nFEDRAT/900\nGOTO/160,-15,{height}\nGOTO/160,15,{height}\nGOTO/-160,15,{height}\n\
         RAPID\nGOTO/-160,15,50\nFINI\n"
    )
}

/// The flat bottom ends 18.5 mm from the axis, and touches from where this is over the plate.
#[test]
fn a_face_mill_touches_a_plate_from_border_to_border() {
    let plate = plate([-100.0, -30.0], [100.0, 30.0]);
    for kind in [ContactKind::OfTool, ContactKind::OfSurface] {
        let laid = laid(&plate, &facing(0.0), kind, 0.0).unwrap();
        assert_eq!((laid.passes.len(), laid.off_surface, laid.first_off), (2, 4, Some(3)), "{kind:?}");
        assert!(laid.above.mm <= 0.05 && laid.below.mm == 0.0);
        let tips: Vec<[f64; 2]> = [&laid.passes[0], &laid.passes[1]]
            .map(|pass| [pass.points[0].cl.tip.x, pass.points[pass.points.len() - 1].cl.tip.x])
            .to_vec();
        let ends = match kind {
            // The corner comes near a little before.
            ContactKind::OfTool => [[-118.9, 118.9], [118.9, -118.9]],
            // Places on the plate end at its border, when the leading rim is there.
            _ => [[-118.9, 84.0], [118.9, -84.0]],
        };
        for (tip, end) in tips.iter().zip(ends) {
            assert!((tip[0] - end[0]).abs() < 0.5, "{kind:?} {tips:?}");
            assert!((tip[1] - end[1]).abs() < STEP, "{kind:?} {tips:?}");
        }
        let steps = laid.passes.iter().flat_map(|pass| pass.points.windows(2));
        assert!(steps.clone().all(|w| (w[1].cl.tip - w[0].cl.tip).norm() < STEP + 1e-9));
        if kind == ContactKind::OfSurface {
            assert!(laid.passes.iter().flat_map(|p| &p.points).all(|p| p.cc.position.x.abs() <= 100.0 + 1e-9));
        }
    }
}

/// Raised by its allowance, each CC point leads back to the file's pose, also where the cut bends.
#[test]
fn kept_postures_lead_back_to_the_poses_of_the_file() {
    let plate = plate([-100.0, -100.0], [100.0, 100.0]);
    let bent = "UNITS/MM\nMULTAX/ON\nRAPID\nGOTO/-60,0,0.2,0,0,1\nFEDRAT/900\nGOTO/0,0,0.2\nGOTO/0,50,0.2\nGOTO/40,50,0.2\n\
                RAPID\nGOTO/0,0,50\nRAPID\nGOTO/-50,-40,0.80702,-0.030,0.01,0.9995\nGOTO/30,-40,0.80702\nFINI\n";
    for allowance in [0.0, 0.2] {
        let height = 0.2 - allowance;
        let text =
            bent.replace(",0.2", &format!(",{}", 0.2 - height)).replace("0.80702", &format!("{}", 0.6062 + allowance));
        let laid = laid(&plate, &text, ContactKind::OfTool, allowance).unwrap();
        assert_eq!(laid.passes.len(), 2, "{allowance}");
        for point in laid.passes.iter().flat_map(|pass| &pass.points) {
            let mut cc = point.cc;
            cc.position += cc.normal.into_inner() * allowance;
            let cl = cl_from_cc(&mill(), &cc, point.posture);
            assert!((cl.tip - point.cl.tip).norm() < 1e-9, "{allowance}: {point:?}");
            assert!((cl.axis.into_inner() - point.cl.axis.into_inner()).norm() < 1e-9);
        }
    }
}

#[test]
fn entries_and_exits_above_the_surface_are_left_out_and_counted() {
    let plate = plate([-100.0, -100.0], [100.0, 100.0]);
    let text = "UNITS/MM\nRAPID\nGOTO/-60,0,30\nFEDRAT/900\nGOTO/-50,0,5\nGOTO/-40,0,0\nGOTO/40,0,0\nGOTO/50,0,5\nRAPID\nGOTO/50,0,30\nFINI\n";
    let laid = laid(&plate, text, ContactKind::OfTool, 0.0).unwrap();
    assert_eq!((laid.passes.len(), laid.off_surface, laid.first_off), (1, 3, Some(3)));
    let points = &laid.passes[0].points;
    assert!((points[0].cl.tip.x + 40.0).abs() < 0.5 && (points[points.len() - 1].cl.tip.x - 40.0).abs() < 0.5);
    assert!(laid.above.mm <= 0.05 && laid.above.line > 0);
}

#[test]
fn a_cut_that_turns_back_is_two_passes() {
    let plate = plate([-100.0, -100.0], [100.0, 100.0]);
    let text = "UNITS/MM\nRAPID\nGOTO/-50,0,0\nFEDRAT/900\nGOTO/50,0,0\nGOTO/-50,0,0\nRAPID\nGOTO/50,0,30\nFINI\n";
    let laid = laid(&plate, text, ContactKind::OfTool, 0.0).unwrap();
    let feeds: Vec<f64> = laid.passes.iter().map(|pass| pass.points[0].cc.feed.x).collect();
    assert_eq!(feeds, [1.0, -1.0]);
}

#[test]
fn files_of_another_place_or_side_are_refused_with_line_and_figures() {
    let plate = plate([-100.0, -30.0], [100.0, 30.0]);
    let refused = |text: &str, words: &[&str]| {
        let why = laid(&plate, text, ContactKind::OfSurface, 0.0).unwrap_err();
        assert!(words.iter().all(|word| why.contains(word)), "{why}");
    };
    refused(&facing(-0.3), &["line 5", "0.300 mm deep", "max_distance_mm"]);
    refused(&facing(7.0), &["7.000 mm from it", "workpiece frame", "line 5"]);
    refused(
        &facing(0.0).replace("UNITS/MM", "UNITS/MM\nMULTAX/ON\nTLAXIS/0,0,-1"),
        &["points into the material", "other side"],
    );
    // A slip of a thousand kilometres is refused before its points are made.
    refused(&facing(0.0).replace("GOTO/160,-15", "GOTO/990000,-15"), &["more than 10000 points", "line 5"]);
}

/// Passes move with part and file.
#[test]
fn a_shifted_file_on_a_shifted_plate_has_the_same_passes() {
    let first = laid(&plate([-100.0, -30.0], [100.0, 30.0]), &facing(0.0), ContactKind::OfSurface, 0.0).unwrap();
    let csys = "UNITS/MM\nCSYS/1,0,0,12,0,1,0,-7,0,0,1,0";
    let text = facing(0.0).replace("UNITS/MM", csys);
    let second = laid(&plate([-88.0, -37.0], [112.0, 23.0]), &text, ContactKind::OfSurface, 0.0).unwrap();
    let positions = |laid: &ClPasses, by: Vector3<f64>| -> Vec<Point3<f64>> {
        laid.passes.iter().flat_map(|pass| &pass.points).map(|p| p.cc.position + by).collect()
    };
    let (a, b) = (positions(&first, Vector3::new(12.0, -7.0, 0.0)), positions(&second, Vector3::zeros()));
    assert_eq!(a.len(), b.len());
    assert!(a.iter().zip(&b).all(|(p, q)| (p - q).norm() < 1e-6));
}

/// The last cut of a face goes beside the plate, and the leading rim on a step has nothing below
/// it:
/// each place of contact is below the bottom of the cutter all the same.
#[test]
fn contacts_of_a_flat_bottom_are_below_it_beside_a_border_and_over_a_step() {
    let border = plate([-100.0, -30.0], [100.0, 30.0]);
    let beside = facing(0.0).replace(",-15,", ",-42,").replace(",15,", ",42,");
    let corners = |x0: f64, x1: f64, z: f64| {
        [[x0, -30.0], [x1, -30.0], [x1, 30.0], [x0, 30.0]].map(|[x, y]| Point3::new(x, y, z))
    };
    let vertices = [corners(-100.0, 0.0, 0.0), corners(0.0, 100.0, -4.0)].concat();
    let step = crate::surface((vertices, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]));
    for (name, surface, text) in [("border", &border, beside), ("step", &step, facing(0.0))] {
        let laid = laid(surface, &text, ContactKind::OfSurface, 0.0).unwrap();
        assert!(laid.passes.len() == 2, "{name}");
        for point in laid.passes.iter().flat_map(|pass| &pass.points) {
            let from_tip = point.cc.position - point.cl.tip;
            assert!(from_tip.z.abs() < 0.05 && from_tip.norm() < 20.0, "{name}: {point:?}");
        }
    }
}

/// Nine decimals of an axis, and a frame, make the axis another than the normal in its last bits.
#[test]
fn kept_postures_of_a_flat_bottom_lead_back_on_plates_that_lean() {
    let mut random = Random(43);
    for round in 0..60 {
        let motion = random.motion(100.0);
        let corners = [[-100.0, -100.0], [100.0, -100.0], [100.0, 100.0], [-100.0, 100.0]];
        let corners = corners.map(|[x, y]| motion * Point3::new(x, y, 0.0));
        let leaning = crate::surface((corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]));
        let at = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let way = [at(-50.0, -40.0), at(20.0, -40.0), at(50.0, 30.0), at(-40.0, 31.0)];
        // In a frame, or in that of the part.
        let (head, [from, to @ ..]) = if round % 2 == 0 {
            let m = motion.to_homogeneous();
            // A row for each axis of the frame; the origin has a coordinate in each.
            let number = |k: usize| if k % 4 < 3 { m[(k % 4, k / 4)] } else { m[(k / 4, 3)] };
            let rows: Vec<String> = (0..12).map(|k| format!("{:.12}", number(k))).collect();
            (format!("CSYS/{}", rows.join(",")), way.map(|p| (p, Vector3::z())))
        } else {
            (String::from("PPRINT/NONE"), way.map(|p| (motion * p, motion.rotation * Vector3::z())))
        };
        let goto = |(p, a): &(Point3<f64>, Vector3<f64>)| {
            format!("GOTO/{:.9},{:.9},{:.9},{:.9},{:.9},{:.9}\n", p.x, p.y, p.z, a.x, a.y, a.z)
        };
        let cuts: String = to.iter().map(goto).collect();
        let text = format!("UNITS/MM\nMULTAX/ON\n{head}\nRAPID\n{}FEDRAT/900\n{cuts}FINI\n", goto(&from));
        let laid = laid(&leaning, &text, ContactKind::OfTool, 0.0).unwrap();
        assert_eq!((laid.passes.len(), laid.off_surface), (1, 0), "{round}");
        for point in &laid.passes[0].points {
            let cl = cl_from_cc(&mill(), &point.cc, point.posture);
            assert!((cl.tip - point.cl.tip).norm() < 1e-9, "{round}: {:?} {point:?}", cl.tip);
            assert!((cl.axis.into_inner() - point.cl.axis.into_inner()).norm() < 1e-9, "{round}");
        }
    }
}

/// In a valley, the contact of an upright tool leaves one side of the rim for the other.
#[test]
fn a_searched_pass_is_divided_where_its_contact_jumps_across_the_rim() {
    let slope = 0.1_f64;
    // Along y: the rim touches the side that rises, and is on both in the middle.
    let row = |y: f64| [-100.0, 0.0, 100.0].map(|x: f64| Point3::new(x, y, slope * x.abs()));
    let vertices = [row(-60.0), row(60.0)].concat();
    let valley = crate::surface((vertices, vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]));
    let touching = |x: f64| {
        // Tip of an upright cutter that touches the nearer side.
        let normal = Vector3::new(-slope, 0.0, 1.0).normalize();
        let cutter = mill();
        let reach = cutter.corner_radius() + cutter.rim_radius() * normal.x.abs();
        (reach - cutter.corner_radius() * normal.z + x.abs() * normal.x.abs()) / normal.z
    };
    let mut text = String::from("UNITS/MM\nRAPID\nGOTO/-60,0,50\nRAPID\n");
    for k in 0..=20 {
        let x = -60.0 + 6.0 * f64::from(k);
        text += &format!("GOTO/{x},0,{:.6}\n", touching(x));
        text += if k == 0 { "FEDRAT/900\n" } else { "" };
    }
    let searched = laid(&valley, &(text.clone() + "FINI\n"), ContactKind::OfSurface, 0.0).unwrap();
    assert_eq!((searched.jumps, searched.first_jump.is_some(), searched.without_direction), (1, true, 0));
    assert_eq!(searched.passes.len(), 2);
    let steps = searched.passes.iter().flat_map(|pass| pass.points.windows(2));
    let longest = steps.map(|w| (w[1].cc.position - w[0].cc.position).norm()).fold(0.0, f64::max);
    assert!(longest < 2.1 * STEP, "{longest}");
    // Both passes come near the jump: together they are nearly all of the way.
    assert!((searched.length - 120.0).abs() < 2.0 && searched.length - searched.length_in_passes < 0.5);
    // With the file's axes the tool follows the file all the way.
    let kept = laid(&valley, &(text + "FINI\n"), ContactKind::OfTool, 0.0).unwrap();
    assert_eq!((kept.jumps, kept.passes.len()), (0, 1));
}

/// One move at feed goes from a plate to another over a gap, where no point of the file is.
#[test]
fn a_way_off_the_surface_counts_without_a_point_of_the_file_on_it() {
    let plates = [[-300.0, -100.0], [100.0, 300.0]]
        .map(|[from, to]| [[from, -50.0], [to, -50.0], [to, 50.0], [from, 50.0]].map(|[x, y]| Point3::new(x, y, 0.0)));
    let both = crate::surface((plates.concat(), vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]));
    let text = "UNITS/MM\nRAPID\nGOTO/-250,0,0\nFEDRAT/900\nGOTO/250,0,0\nRAPID\nGOTO/0,0,50\nFINI\n";
    let laid = laid(&both, text, ContactKind::OfTool, 0.0).unwrap();
    assert_eq!((laid.passes.len(), laid.off_surface), (2, 0));
    // The flat bottom touches until its rim is over the gap, a little longer with its corner.
    let way = 500.0 - 200.0 + 2.0 * mill().rim_radius();
    assert!((laid.length - 500.0).abs() < 1e-9 && (laid.length_in_passes - way).abs() < 2.0, "{laid:?}");
}

/// A tool that goes down by less than `max_distance` above the surface has no direction in it.
#[test]
fn points_without_a_direction_along_the_surface_are_counted() {
    let plate = plate([-100.0, -100.0], [100.0, 100.0]);
    let text =
        "UNITS/MM\nMULTAX/ON\nRAPID\nGOTO/0,0,0.04,0,0,1\nFEDRAT/900\nGOTO/0,0,0.02\nGOTO/0,0,0\nGOTO/40,0,0\nFINI\n";
    let laid = laid(&plate, text, ContactKind::OfTool, 0.0).unwrap();
    assert!(laid.without_direction >= 1 && laid.first_without.is_some(), "{laid:?}");
}

/// A file whose axis leans by 10° up to x = 0 and by 25° behind it, over a number of points from
/// one to the other; contact of the rim's corner at y = 0.
fn leaning(turn_over_mm: f64) -> String {
    let mut text = String::from("UNITS/MM\nMULTAX/ON\nRAPID\nGOTO/-60,0,30,0,0,1\n");
    for k in 0..=120 {
        let x = -60.0 + f64::from(k);
        let share = (x / turn_over_mm).clamp(0.0, 1.0);
        let tilt = (10.0 + 15.0 * share).to_radians();
        let cc = facemill_cl_data::CcPoint::new(Point3::new(x, 0.0, 0.0), Vector3::z(), Vector3::x()).unwrap();
        let cl = cl_from_cc(&mill(), &cc, facemill_cl_data::Posture { tilt, rotate: 0.0 });
        let (t, a) = (cl.tip, cl.axis);
        text += &format!("GOTO/{:.7},{:.7},{:.7},{:.9},{:.9},{:.9}\n", t.x, t.y, t.z, a.x, a.y, a.z);
        text += if k == 0 { "FEDRAT/900\n" } else { "" };
    }
    text + "RAPID\nGOTO/60,0,30,0,0,1\nFINI\n"
}

/// Line 5 is the first point, 6 the feed: the point at x has line 67 + x.
#[test]
fn jumps_of_the_axis_are_counted_with_their_line_and_steady_turns_are_not() {
    let plate = plate([-100.0, -100.0], [100.0, 100.0]);
    let kept = laid(&plate, &leaning(1.0), ContactKind::OfTool, 0.0).unwrap();
    assert_eq!((kept.turns.jumps, kept.turns.first_jump, kept.turns.line), (1, Some(67), Some(67)), "{:?}", kept.turns);
    assert!((kept.turns.largest.to_degrees() - 15.0).abs() < 1e-6, "{:?}", kept.turns);
    // Half a degree in each of 30 steps.
    let steady = laid(&plate, &leaning(30.0), ContactKind::OfTool, 0.0).unwrap();
    assert_eq!((steady.turns.jumps, steady.turns.first_jump), (0, None));
    assert!((steady.turns.largest.to_degrees() - 0.5).abs() < 1e-6, "{:?}", steady.turns);
    // One long step with the same turn is none, though points are inserted in it.
    let long = "UNITS/MM\nMULTAX/ON\nRAPID\nGOTO/-60,0,0.1,0,0,1\nFEDRAT/900\nGOTO/-50,0,0\nGOTO/40,0,0,0,0.0007,1\nRAPID\nGOTO/0,0,50\nFINI\n";
    let laid = laid(&plate, long, ContactKind::OfTool, 0.0).unwrap();
    assert_eq!((laid.turns.jumps, laid.turns.line), (0, Some(7)));
    assert!((laid.turns.largest - 0.0007).abs() < 1e-8, "{:?}", laid.turns);
}
