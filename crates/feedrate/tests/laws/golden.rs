//! FEED tables 2 and 4 as printed.

use std::path::Path;

use facemill_feedrate::{FeedBlock, FeedLimit, g94_length, plan_feeds};
use facemill_inverse_kinematics::{AxisValues, Machine};

/// FEED's machine: 253 mm from the B axis to the tip, 100 mm of it tool. NC words are joint values,
/// Z less the tool.
fn feed_machine() -> Machine {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    let rows = &mut file.tool_chains[0].rows;
    (rows[2].d_mm, rows[4].d_mm) = (153.0, -153.0);
    Machine::from_file(file).unwrap()
}

fn table(name: &str) -> Vec<Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/golden").join(name);
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().filter(|l| l.starts_with(['-', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']));
    lines.map(|l| l.split(',').map(|w| w.parse().unwrap_or(f64::NAN)).collect()).collect()
}

#[test]
fn printed_distances_and_feeds_are_reproduced() {
    let machine = feed_machine();
    for name in ["feedrate_table2.csv", "feedrate_table4.csv"] {
        let rows = table(name);
        assert_eq!(rows.len(), 5);
        let positions: Vec<AxisValues> = rows
            .iter()
            .map(|r| AxisValues::from([r[0], r[1], r[2] + 100.0, r[3].to_radians(), r[4].to_radians()]))
            .collect();
        let blocks: Vec<_> = positions[1..].iter().map(|&end| FeedBlock { end, tip_feed: 1000.0 }).collect();
        let feeds = plan_feeds(&machine, 100.0, &positions[0], &blocks).unwrap();
        for (k, (feed, row)) in feeds.iter().zip(&rows[1..]).enumerate() {
            let [axis_distance, cl_distance, new_feed] = row[8..] else { panic!("{row:?}") };
            let length = g94_length(machine.axes(), &positions[k], &positions[k + 1]);
            assert!((length - axis_distance).abs() < 0.0015, "{name} row {k}: L {length}");
            assert!((feed.tip_feed * feed.time / 60.0 - cl_distance).abs() < 0.0015, "{name} row {k}: {feed:?}");
            assert!((feed.f_word - new_feed).abs() < 0.2, "{name} row {k}: {feed:?}");
            assert_eq!(feed.limit, FeedLimit::TipFeed);
        }
    }
}
