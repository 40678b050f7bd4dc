//! New feeds for a program that exists: the tip of the tool moves as fast as it is to, where the
//! control counts F over all axes.
//!
//! `cargo run -p facemill --example feed_for_a_program`

use std::error::Error;

use facemill::feeds::{FeedLaw, FeedRewriteSettings, TipFeed};
use facemill::inverse_kinematics::{Machine, preset};
use facemill::nc_program::Dialect;
use facemill::rewrite_feeds;

/// A cut with the table turning, as some post-processor wrote it: the same F in every block.
const PROGRAM: &str = "\
G21 G90 G94
G54
G0 G43 X800. Y0. Z600. B0. C0. H1
G1 C2. F1000.
C1.95
C6.
X790. C8. B1.
X700. (table at rest)
G0 Z900.
M30
";

fn main() -> Result<(), Box<dyn Error>> {
    let machine = Machine::from_json(preset("head-b-table-c").ok_or("no such preset")?.as_bytes())?;
    let mut settings = FeedRewriteSettings {
        machine: &machine,
        tool_length: 250.0,
        tip_feed: TipFeed::Programmed,
        work_offset: Vec::new(),
        dialect: Dialect::Fanuc,
        dialect_file: None,
        time_law: None,
    };

    // The F of each block by which the tip moves at 1000 mm/min, within the speeds of the axes.
    let by_speed = rewrite_feeds(PROGRAM.as_bytes(), &settings)?;
    // The same within acceleration and jerk of every axis, corners blended within 0.02 mm.
    settings.time_law = Some(FeedLaw { blend_tolerance: Some(0.02) });
    let by_law = rewrite_feeds(PROGRAM.as_bytes(), &settings)?;

    let texts = [PROGRAM.to_owned(), String::from_utf8(by_speed.text)?, String::from_utf8(by_law.text)?];
    println!("{:36} {:36} within acceleration and jerk", "as it was", "tip at 1000 mm/min");
    let lines = texts[0].lines().zip(texts[1].lines()).zip(texts[2].lines());
    lines.for_each(|((old, new), slow)| println!("{old:36} {new:36} {slow}"));

    let (before, after) = (by_speed.summary.time_before_s, by_speed.summary.time_after_s);
    println!("cutting time {before:.1} s before, {after:.1} s after");
    // 2 degrees at a radius of 800 mm are 28 mm of the tip, but count as 2: F is far below 1000.
    let first = texts[1].lines().nth(3).and_then(|line| line.rsplit_once('F')).ok_or("no F")?.1;
    let first: f64 = first.parse()?;
    assert!((first - 1000.0 * 2.0 / (800.0 * 2.0_f64.to_radians())).abs() < 0.1, "{first}");
    // Where the table stands still, F is the speed of the tip.
    assert!(texts[1].lines().nth(7).is_some_and(|line| line.contains("F1000")));
    assert!(by_law.summary.by_law > 0, "where the table turns back, the axes cannot to reach that speed");
    Ok(())
}
