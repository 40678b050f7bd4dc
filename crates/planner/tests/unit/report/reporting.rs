use crate::report::reporting::*;

#[test]
fn a_search_proof_has_the_requested_width_until_a_point_needs_more() {
    let reported = |widened| search_proof(0.002, widened);
    let kept = reported(None);
    assert_eq!((kept.asked_u_width, kept.largest_u_width, kept.wider_points), (0.002, 0.002, 0));
    let wider = reported(Some(Widened { points: 3, largest: 0.008 }));
    assert_eq!((wider.asked_u_width, wider.largest_u_width, wider.wider_points), (0.002, 0.008, 3));
}
