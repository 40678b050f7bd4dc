use super::*;
use facemill_cl_data::{RoundFrustum, Solid};

const TOOL: &str = r#"{
        "format": "facemill-tool/1", "name": "D40 R5", "number": 7,
        "radius_mm": 20, "corner_radius_mm": 5, "n_inserts": 4, "flute_length_mm": 7,
        "max_ramp_angle_deg": 1.5, "spindle_rotation": "clockwise", "stick_out_mm": 67, "gauge_length_mm": 183,
        "body": {"clearance_mm": 0.5, "sections": [
            {"length_mm": 10, "diameter_low_mm": 36, "diameter_high_mm": 30},
            {"length_mm": 50, "diameter_low_mm": 30, "diameter_high_mm": 30}]},
        "holder": {"clearance_mm": 2, "sections": [
            {"length_mm": 20, "diameter_low_mm": 40, "diameter_high_mm": 60},
            {"length_mm": 96, "diameter_low_mm": 90, "diameter_high_mm": 90}]}
    }"#;

fn tool() -> ToolAssembly {
    ToolAssembly::from_json(TOOL.as_bytes()).unwrap()
}

fn frusta(tool: &ToolAssembly) -> Vec<RoundFrustum> {
    let turned = |solid| if let Solid::Frustum(f) = solid { f } else { panic!() };
    tool.collision_bodies().into_iter().map(|b| turned(b.solid)).collect()
}

#[test]
fn own_lengths_build_the_same_tool() {
    for open in [OpenAssembly::open(&tool()), OpenAssembly::with_rigid_holder(&tool(), 0.0)] {
        let mut lengths = open.lengths();
        assert_eq!(lengths, [7.0, 67.0, 87.0, 183.0]);
        open.rest(&mut lengths);
        assert_eq!(lengths, open.lengths());
        assert_eq!(open.built(&lengths).unwrap().tool, tool());
    }
}

/// At any requested lengths, bodies join each other from L1 to L4, and each begins at the length it
/// rides on.
#[test]
fn bodies_begin_at_the_lengths_that_they_ride_on_and_leave_no_gap() {
    let mut n_bodies = std::collections::BTreeSet::new();
    for k in 0..400_u32 {
        let part = |n: u32| f64::from(k / n % 5);
        let mut lengths = [3.0 + 4.0 * part(1), 5.0 + 23.0 * part(5), 20.0 * part(25), 40.0 * part(80)];
        let open = OpenAssembly::open(&tool());
        open.rest(&mut lengths);
        let built = open.built(&lengths).unwrap();
        let bodies = frusta(&built.tool);
        assert_eq!(bodies.len(), built.rides.len());
        n_bodies.insert(bodies.len());
        let mut end = lengths[0];
        for body in &bodies {
            assert!((body.z_low - end).abs() < 1e-9, "{lengths:?}: {bodies:?}");
            end = body.z_high;
        }
        assert!((end - lengths[3]).abs() < 1e-9);
        for (length, at) in AssemblyLength::ALL.into_iter().zip(lengths) {
            let first = built.rides.iter().position(|r| *r == Some(length));
            assert!(first.is_none_or(|k| (bodies[k].z_low - at).abs() < 1e-9), "{lengths:?}: {bodies:?}");
        }
        // Below its top no section of the holder or body is wider or narrower than in the file.
        let at = bodies.iter().find(|b| b.z_low == lengths[0]);
        assert!(at.is_none_or(|b| b.radius_low == 18.0 || lengths[1] == lengths[0]));
    }
    assert!(n_bodies.len() > 2, "{n_bodies:?}");
}

#[test]
fn a_cone_is_cut_on_its_slope_and_goes_on_as_a_cylinder() {
    let open = OpenAssembly::open(&tool());
    let cut = open.built(&[7.0, 67.0, 77.0, 183.0]).unwrap();
    assert_eq!((frusta(&cut.tool)[2].radius_high, cut.rides.len()), (25.0, 4));
    let long = open.built(&[7.0, 67.0, 100.0, 196.0]).unwrap();
    let bodies = frusta(&long.tool);
    assert_eq!((bodies[3].radius_low, bodies[3].radius_high, bodies[3].z_high), (30.0, 30.0, 100.0));
    assert_eq!(long.rides[2..], [1, 1, 2].map(|k| Some(AssemblyLength::ALL[k])));
}

#[test]
fn a_rigid_holder_goes_up_whole() {
    let open = OpenAssembly::with_rigid_holder(&tool(), 0.0);
    let mut lengths = [0.0, 100.0, 0.0, 0.0];
    open.rest(&mut lengths);
    assert_eq!(lengths, [7.0, 100.0, 120.0, 216.0]);
    let built = open.built(&lengths).unwrap();
    assert_eq!(built.tool, tool().longer_by(33.0).unwrap());
    assert_eq!(built.rides, [None, None, Some(AssemblyLength::StickOut), Some(AssemblyLength::StickOut)]);
    lengths[1] = 0.0;
    open.rest(&mut lengths);
    assert_eq!(lengths[1], 17.0, "the lower section of the body is all there");
}
