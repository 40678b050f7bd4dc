use facemill_job::format::job_report::CuspsAtEnd;
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

use super::*;

fn place(x: f64, stock: f64) -> SurfacePlace {
    SurfacePlace { position: Point3::new(x, 0.0, 0.0), normal: Vector3::z_axis(), stock }
}

/// Two places of half of a region each, one of them never cut.
fn region(cusps: Option<OpenCusps>) -> OpenRegion {
    let open = |x, is_never_cut| OpenPlace { on: place(x, 2.0), weight: 5.0, is_never_cut };
    OpenRegion {
        operation: "rough".to_owned(),
        limit: 0.1,
        allowed: FinishFile { max_above_fraction: 0.5, max_never_cut_fraction: 0.0 },
        all: 10.0,
        uncertain: 0.0,
        above_before: 1.0,
        is_exceeded: true,
        places: vec![open(1.0, false), open(2.0, true)],
        cusps,
        lowered_by: Vec::new(),
    }
}

/// Cuts everything with x above `from` down to `height`.
fn cut(from: f64, height: f64) -> impl Fn(&[SurfacePlace]) -> Result<Vec<LeftHeight>, ()> {
    move |on| {
        let left = |on: &SurfacePlace| match on.position.x > from && on.stock > height {
            true => LeftHeight { height, cut_by: Some(7) },
            false => LeftHeight { height: on.stock, cut_by: None },
        };
        Ok(on.iter().map(left).collect())
    }
}

#[test]
fn programs_behind_lower_what_is_left_and_nothing_else_does() {
    let mut open = region(None);
    let before = open.at_end("a");
    assert!(!before.is_kept() && before.above_at_end == 1.0 && before.never_cut_at_end == 0.5, "{before:?}");
    open.lower("b", None, cut(5.0, 0.0)).unwrap();
    assert_eq!(open.at_end("a"), before, "a program beside the region");
    open.lower("c", None, cut(1.5, 1.0)).unwrap();
    let half = open.at_end("a");
    assert_eq!((half.above_at_end, half.never_cut_at_end, half.is_kept()), (1.0, 0.0, false));
    assert_eq!(half.lowered_by, ["c"]);
    open.lower("d", None, cut(1.5, 0.1)).unwrap();
    let end = open.at_end("a");
    assert_eq!((end.above_at_end, end.highest_at_end.unwrap().height_mm, end.is_kept()), (0.5, 2.0, true));
    assert_eq!((end.lowered_by, end.above_fraction), (vec!["c".to_owned(), "d".to_owned()], 1.0));
}

#[test]
fn another_workpiece_frame_moves_the_places() {
    // Half a turn about z takes the places to the other side, where the program does not cut.
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let motion = |shift| Isometry3::from_parts(Translation3::new(shift, 0.0, 0.0), turned);
    let mut open = region(None);
    open.lower("b", Some(motion(0.0)), cut(0.0, 0.0)).unwrap();
    assert!(open.at_end("a").lowered_by.is_empty());
    open.lower("b", Some(motion(3.5)), cut(2.0, 0.0)).unwrap();
    let end = open.at_end("a");
    assert_eq!((end.above_at_end, end.never_cut_at_end), (0.5, 0.5), "the first place alone, at 2.5");
}

#[test]
fn what_is_not_measured_stays_open() {
    let unmeasured = OpenRegion { all: 0.0, places: Vec::new(), ..region(None) };
    assert!(unmeasured.at_end("a").exceeded_at_end);
    // An area without places is left, of all of both.
    let mut uncertain = OpenRegion { uncertain: 15.0, ..region(None) };
    assert_eq!(uncertain.at_end("a").above_at_end, 1.0);
    uncertain.lower("b", None, cut(0.0, 0.0)).unwrap();
    let end = uncertain.at_end("a");
    assert!(end.exceeded_at_end && end.above_at_end == 0.6, "{end:?}");
    let alone = OpenRegion { all: 0.0, uncertain: 5.0, places: Vec::new(), ..region(None) }.at_end("a");
    assert!(alone.exceeded_at_end && alone.above_at_end == 1.0, "{alone:?}");
}

#[test]
fn predicted_cusps_are_kept_where_later_programs_make_all_places_beside_them_low() {
    let kept = |cusps: OpenCusps, from: f64, height: f64| {
        let mut open = OpenRegion { is_exceeded: false, places: Vec::new(), ..region(Some(cusps)) };
        open.lower("b", None, cut(from, height)).unwrap();
        let end = open.at_end("a");
        let cusps = end.cusps.expect("cusps");
        assert!(!end.exceeded_at_end && cusps.points == 3);
        // The highest of what `cut` leaves of the places beside them, if these show all.
        let measured = open.cusps.as_ref().filter(|cusps| cusps.is_known);
        let all = measured.and_then(|cusps| cusps.on.iter().map(|on| on.stock).reduce(f64::max));
        assert_eq!(cusps.highest_at_end.map(|highest| highest.height_mm), all);
        end.is_kept()
    };
    let on = || vec![place(1.0, 0.05), place(2.0, 0.2), place(3.0, 0.3)];
    let beside = || OpenCusps::beside(3, 0.1, on(), true);
    assert!(kept(beside(), 1.5, 0.1) && !kept(beside(), 2.5, 0.1) && !kept(beside(), 1.5, 0.11));
    // Neither without a place nor where places do not show all.
    assert!(!kept(OpenCusps::beside(3, 0.1, Vec::new(), true), 0.0, 0.0));
    assert!(!kept(OpenCusps::beside(3, 0.1, on(), false), 1.5, 0.1));
    // Nor by the own program alone, however low it leaves them.
    let low = || OpenCusps::beside(3, 0.1, vec![place(1.0, 0.0)], true);
    assert!(!low().are_kept() && !kept(low(), 0.0, 0.0));
}

#[test]
fn many_predicted_cusps_are_kept_where_later_programs_cut_all_of_the_region() {
    let on = |x: f64| LeftPlace {
        position: Point3::new(x, 0.0, 0.0),
        normal: Vector3::z_axis(),
        weight: 1.0,
        height: 0.0,
        is_cut: true,
        is_never_cut: false,
        left: place(x, 0.0),
    };
    let end = |from: f64, height: f64, cusp: f64| {
        let all = OpenCusps::all_over(5000, cusp, &[on(1.0), on(2.0)], true);
        let mut open = OpenRegion { is_exceeded: false, places: Vec::new(), ..region(Some(all)) };
        open.lower("b", None, cut(from, height)).unwrap();
        open.at_end("a").cusps
    };
    let is = |kept| Some(CuspsAtEnd { points: 5000, kept, limit_mm: 0.1, highest_at_end: None });
    assert_eq!(end(0.0, 0.001, 0.1), is(true));
    // The own program leaves nothing at the first place, but a later one has to cut it.
    assert_eq!(end(1.5, 0.001, 0.1), is(false));
    assert!(end(0.0, 0.001, 0.0005).is_some_and(|cusps| !cusps.kept), "a cusp below the accuracy of heights");
}
