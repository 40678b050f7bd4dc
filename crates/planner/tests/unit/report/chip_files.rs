use crate::report::chip_files::*;

#[test]
fn every_line_has_the_cells_of_the_head() {
    let mut point = ChipPoint {
        copy: 0,
        pass: 2,
        point: 4,
        way: 12.5,
        area: 3.25,
        thickness: 0.5,
        is_known: false,
        line: None,
        arrival: None,
    };
    let mut csv = String::from(HEAD);
    line(&mut csv, "suction", &point, 2000.0);
    let law = facemill_job::validate::tip_feed::FeedLaw::Given;
    point.arrival = Some(crate::report::chip_points::Arrival {
        before: 1000.0,
        after: 800.0,
        programmed: 800.0,
        law,
        added_time: 0.0,
    });
    point.line = Some(48);
    line(&mut csv, "suction", &point, 2000.0);
    let lines: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert!(lines.iter().all(|l| l.len() == lines[0].len()), "{csv}");
    assert_eq!(lines[1][..7], ["suction", "1", "3", "5", "12.500", "3.2500", "1"]);
    assert_eq!(lines[1][7..], [""; 7]);
    assert_eq!(lines[2][7..], ["1000.0", "800.0", "3.250", "2.600", "0.25000", "0.20000", "48"]);
    assert_eq!(quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
}
