use crate::chips_svg::*;
use facemill_test_kit::texts_outside;

#[test]
fn steps_are_round_and_not_below() {
    for (least, step) in [(0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (3.0, 5.0), (7.0, 10.0), (0.03, 0.05)] {
        assert!((nice_step(least) - step).abs() < 1e-12, "{least}");
    }
    assert_eq!([decimals(0.05), decimals(0.5), decimals(1.0), decimals(20.0)], [2, 1, 0, 0]);
}

fn point(k: usize) -> ChartPoint {
    ChartPoint {
        way: k as f64,
        area: if k == 31_007 { 40.0 } else { 10.0 },
        is_known: !k.is_multiple_of(1000),
        removal_rates: None,
    }
}

#[test]
fn every_text_is_in_the_picture_in_a_wide_font() {
    let long = "a shop's very long name of an operation <and> more ".repeat(9);
    for scale in [0.0, 1e-7, 1.0, 1e5, 1e9] {
        let points: Vec<ChartPoint> =
            (0..3000).map(point).map(|p| ChartPoint { area: scale * p.area, way: 1e-3 * scale * p.way, ..p }).collect();
        let of = |name, target| Row { name, points: &points, target };
        let svg = chips_svg(&long, &[of("a < b", None), of(&long, Some(3.0)), of(&long.replace(' ', "-"), Some(1.0))]);
        assert_eq!(texts_outside(&svg), Vec::<String>::new(), "{scale}");
    }
    assert_eq!(texts_outside(&chips_svg("no operation", &[])), Vec::<String>::new());
}

#[test]
fn extremes_stay_visible_among_many_points() {
    let points: Vec<ChartPoint> = (0..100_000).map(point).collect();
    let row = Row { name: "a < b", points: &points, target: None };
    let panel = Panel::new(&row, 0.0, 100.0, 99_999.0, |p| Some([p.area; 2]));
    assert_eq!(panel.most, 40.0);
    assert_eq!(panel.columns.iter().flatten().filter(|c| c[0][1] == 40.0).count(), 1);
    let svg = chips_svg("job", &[row]);
    // The highest of the area's line is the panel's upper edge.
    assert!(svg.contains(&format!(",{TOP:.1} ")), "no extreme");
    assert!(svg.contains("a &lt; b") && svg.len() < 60_000, "{} bytes", svg.len());
}
