use facemill_test_kit::texts_outside;

use crate::solution_svg::*;

#[test]
fn every_text_is_in_the_picture_in_a_wide_font() {
    let plot = Plot { tilt: [0.0, 0.26], rotate: [0.0, -1.48] };
    let [start, end] = [(0.03, 0.0), (0.26, -1.48)].map(|(tilt, rotate)| Posture { tilt, rotate });
    let curve = SearchCurve::new(start, end, facemill_cutter_location::SearchOrder::TiltFirst, 1.0).unwrap();
    let all = Kind::ALL.map(|(kind, ..)| kind);
    let notes = [
        "proven at 0.250° or coarser: 83.1 % feasible, 15.2 % blocked",
        "paler: not proven (1.7 %), verdict in the middle",
    ];
    for title in ["suction side, pass 11, point 194".to_owned(), "an operation with a very long name & more ".repeat(9)]
    {
        for kinds in [&all[..], &all[..1], &[]] {
            let svg = picture(&title, &plot, &curve, None, kinds, &notes, |_| {});
            assert_eq!(texts_outside(&svg), Vec::<String>::new(), "{svg}");
        }
    }
}
