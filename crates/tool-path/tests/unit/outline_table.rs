use crate::outline_table::*;
use facemill_cl_data::Posture;
use facemill_tool_model::Cutter;

#[test]
fn heights_are_those_of_the_outline() {
    for (radius, corner) in [(80.0, 6.0), (25.0, 0.0), (10.0, 10.0), (40.0, 0.5)] {
        for (tilt, rotate) in [(0.0, 0.0), (0.02, 0.0), (0.1, -0.4), (0.26, 1.2), (0.3, -1.5), (1.0, 0.3)] {
            let cutter = Cutter::new(radius, corner, 30.0).unwrap();
            let outline = Outline::new(&cutter, Posture { tilt, rotate });
            let table = OutlineTable::new(&outline, outline.extent());
            assert!(table.nodes.len() < 1000, "{} nodes", table.nodes.len());
            let (from, to) = outline.extent();
            for k in 1..2000 {
                let y = from + (to - from) * f64::from(k) / 2000.0;
                let (exact, found) = (outline.height_at(y).unwrap(), table.height_at(y).unwrap());
                let rise = (outline.height_at((y + 1e-7 * (to - from)).min(to)).unwrap() - exact).abs();
                let allowed = 1e-4 + 1e3 * rise;
                assert!((exact - found).abs() <= allowed, "{cutter:?} {tilt} {rotate} {y}: {found} for {exact}");
            }
            assert_eq!(table.height_at(from - 1e-9), None);
            assert_eq!(table.height_at(to + 1e-9), None);
        }
    }
}
