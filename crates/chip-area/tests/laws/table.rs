//! Tables of cases.

use facemill_chip_area::pass::table::{TableError, chips_of_table, table_with_areas};
use facemill_chip_area::{
    Beside, CutterEnd, Engagement, NeighbourAxis, Orientation, PassSection, SectionSurface, chip_of_pass,
};

const HEADER: &str = "radius_mm,corner_radius_mm,surface,surface_radius_mm,depth_of_cut_mm,left,left_mm,right,right_mm,lead_deg,lean_deg";

fn error(lines: &[&str]) -> TableError {
    chips_of_table(&lines.join("\n")).unwrap_err()
}

#[test]
fn a_line_is_the_section_it_says() {
    let text = "# a face mill\r\n\r\nlean_deg, name,radius_mm,corner_radius_mm,surface,surface_radius_mm,depth_of_cut_mm,\
                right,right_mm,left,left_mm\r\n-5,\"last, \"\"wide\"\" pass\", 40 ,6,concave,2000,2.5,cut,30,border,12.5\r\n";
    let rows = chips_of_table(&format!("\u{feff}{text}")).unwrap();
    let section = PassSection {
        cutter: CutterEnd { radius: 40.0, corner_radius: 6.0 },
        surface: SectionSurface::Concave { radius: 2000.0 },
        engagement: Engagement {
            depth_of_cut: 2.5,
            left: Beside::Border { distance: 12.5 },
            right: Beside::Cut { step_over: 30.0 },
        },
        orientation: Orientation { lead: 0.0, lean: -5f64.to_radians() },
        neighbour_axis: NeighbourAxis::Parallel,
    };
    assert_eq!(rows.len(), 1);
    assert_eq!((rows[0].line, rows[0].section), (4, section));
    assert_eq!(rows[0].chip, chip_of_pass(&section).unwrap());
}

#[test]
fn the_table_comes_back_with_its_areas() {
    let text = format!("# two cases\n{HEADER}\n6,6,plane,,2,stock,,cut,1,,\n\n6,0,plane,,2,cut,1,stock,,0,\n");
    let out = table_with_areas(&text).unwrap();
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines[0], "# two cases");
    assert_eq!(lines[1], format!("{HEADER},area_mm2,error_bound_mm2,method"));
    assert_eq!(lines[3], "");
    let rows = chips_of_table(&text).unwrap();
    for (line, row) in [(lines[2], rows[0]), (lines[4], rows[1])] {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), HEADER.split(',').count() + 3);
        // Numbers come back to the last bit.
        assert_eq!(cells[11].parse(), Ok(row.chip.area));
        assert_eq!(cells[12].parse(), Ok(row.chip.error_bound));
        assert_eq!(cells[13], "closed-form");
    }
    // A disc upright on a plane takes depth times step.
    assert!((rows[1].chip.area - 2.0).abs() < 1e-12);
}

#[test]
fn chips_table_of_the_paper_gives_its_areas() {
    // CHIP's cases on a plane, table 2 and 3, with their printed areas.
    let text = "radius_mm,corner_radius_mm,surface,depth_of_cut_mm,left,left_mm,right\n6,0,plane,2,cut,1,stock\n\
                6,6,plane,2,cut,1,stock\n";
    let areas: Vec<f64> = chips_of_table(text).unwrap().iter().map(|row| row.chip.area).collect();
    assert!((areas[0] - 2.0).abs() < 1e-12 && (areas[1] - 1.993).abs() < 1e-4, "{areas:?}");
}

#[test]
fn the_neighbours_axis_is_a_column() {
    let header = "radius_mm,corner_radius_mm,surface,surface_radius_mm,depth_of_cut_mm,left,left_mm,right,lean_deg,neighbour_axis";
    let line = |axis: &str| format!("6,1,convex,20,2,cut,1.5,stock,20,{axis}");
    let text = [header, &line(""), &line("parallel"), &line("turned")].join("\n");
    let rows = chips_of_table(&text).unwrap();
    assert_eq!(rows[0].chip, rows[1].chip);
    assert_eq!(rows[2].section.neighbour_axis, NeighbourAxis::Turned);
    assert!((rows[2].chip.area - rows[1].chip.area).abs() > 0.1, "{rows:?}");
    let out = table_with_areas(&text).unwrap();
    let methods: Vec<&str> = out.lines().skip(1).filter_map(|line| line.rsplit(',').next()).collect();
    assert_eq!(methods, ["closed-form", "closed-form", "quadrature"]);
    let known = "parallel, turned";
    assert_eq!(
        error(&[header, &line("fixed")]),
        TableError::UnknownWord { line: 2, column: "neighbour_axis", text: "fixed".to_owned(), known }
    );
}

#[test]
fn headers_at_fault_are_named() {
    assert!(matches!(error(&["# nothing", ""]), TableError::NoHeader { .. }));
    assert!(matches!(
        error(&["radius_mm,corner_radius_mm,surfac"]),
        TableError::UnknownColumn { line: 1, column, .. } if column == "surfac"
    ));
    assert_eq!(error(&["name,radius_mm,radius_mm"]), TableError::RepeatedColumn { line: 1, column: "radius_mm" });
    assert_eq!(
        error(&["", "radius_mm,corner_radius_mm,surface,left,right"]),
        TableError::MissingColumn { line: 2, column: "depth_of_cut_mm" }
    );
    // Semicolons make one column of all.
    assert!(matches!(error(&["radius_mm;corner_radius_mm"]), TableError::UnknownColumn { .. }));
}

#[test]
fn cells_at_fault_are_named_with_line_and_column() {
    let good = "6,6,plane,,2,stock,,cut,1,0,0";
    let at = |bad: &str| error(&["# cases", HEADER, good, bad]);
    let line = 4;
    for (bad, expected) in [
        ("6,6,plane", TableError::CellCount { line, expected: 11, found: 3 }),
        ("6,5,6,plane,,2,stock,,cut,1,0,0", TableError::CellCount { line, expected: 11, found: 12 }),
        ("6,6,plane,,2,stock,,\"cut,1,0,0", TableError::Quotes { line }),
        ("6,6,plane,,2,stock,,\"cut\"s,1,0,0", TableError::Quotes { line }),
        (
            "6,x,plane,,2,stock,,cut,1,0,0",
            TableError::NotANumber { line, column: "corner_radius_mm", text: "x".to_owned() },
        ),
        (
            "6,6,sphere,,2,stock,,cut,1,0,0",
            TableError::UnknownWord {
                line,
                column: "surface",
                text: "sphere".to_owned(),
                known: "plane, convex, concave",
            },
        ),
        (
            "6,6,plane,,2,stock,,cuts,1,0,0",
            TableError::UnknownWord { line, column: "right", text: "cuts".to_owned(), known: "stock, cut, border" },
        ),
        (
            "6,6,convex,,2,stock,,cut,1,0,0",
            TableError::Empty { line, column: "surface_radius_mm", reason: "a curved surface has a radius" },
        ),
        (
            "6,6,plane,,2,stock,,cut,,0,0",
            TableError::Empty { line, column: "right_mm", reason: "the pass there has a step-over" },
        ),
        (
            "6,6,plane,20,2,stock,,cut,1,0,0",
            TableError::NotUsed {
                line,
                column: "surface_radius_mm",
                text: "20".to_owned(),
                reason: "a plane has no radius",
            },
        ),
        (
            "6,6,plane,,2,stock,3,cut,1,0,0",
            TableError::NotUsed { line, column: "left_mm", text: "3".to_owned(), reason: "stock has no end there" },
        ),
    ] {
        let found = at(bad);
        assert_eq!(found, expected);
        assert!(found.to_string().contains("line 4"), "{found}");
    }
}

#[test]
fn cases_without_area_are_named_with_line_and_column() {
    for (bad, expected) in [
        ("-6,0,plane,,2,stock,,cut,1,0,0", Some("radius_mm")),
        ("6,7,plane,,2,stock,,cut,1,0,0", Some("corner_radius_mm")),
        ("6,6,concave,6,2,stock,,cut,1,0,0", Some("corner_radius_mm")),
        ("6,6,convex,0,2,stock,,cut,1,0,0", Some("surface_radius_mm")),
        ("6,6,concave,20,20,stock,,cut,1,0,0", Some("depth_of_cut_mm")),
        ("6,6,plane,,nan,stock,,cut,1,0,0", Some("depth_of_cut_mm")),
        ("6,6,plane,,2,cut,13,stock,,0,0", Some("left_mm")),
        ("6,6,convex,20,2,stock,,border,35,0,0", Some("right_mm")),
        ("6,6,plane,,2,stock,,cut,1,90,0", Some("lead_deg")),
        ("6,6,plane,,2,stock,,cut,1,0,-95", Some("lean_deg")),
        ("6,0,concave,20,2,stock,,cut,1,0,0", None),
    ] {
        match error(&[HEADER, bad]) {
            TableError::Section { line: 2, column, source } => {
                assert_eq!(column, expected, "{bad}: {source}");
            }
            other => panic!("{bad}: {other}"),
        }
    }
    let message = error(&[HEADER, "6,7,plane,,2,stock,,cut,1,0,0"]).to_string();
    assert!(message.starts_with("line 2, column corner_radius_mm: cutter.corner_radius is 7 mm"), "{message}");
}

#[test]
fn a_table_without_cases_is_refused() {
    for text in ["radius_mm,corner_radius_mm,surface,depth_of_cut_mm,left,right\n", &format!("# none\n{HEADER}\n\n#\n")]
    {
        let why = chips_of_table(text).unwrap_err();
        assert!(matches!(why, TableError::NoCase { line } if line == text.matches('#').count().min(1) + 1), "{why}");
        assert!(why.to_string().contains("no case") && table_with_areas(text).is_err());
    }
}

#[test]
fn a_problem_has_neither_line_nor_column_and_no_rows_of_zeros() {
    let header = "radius_mm,corner_radius_mm,surface,depth_of_cut_mm,left,right";
    for (case, column, reported) in [
        ("1e300,0,plane,1,stock,stock", Some("radius_mm"), "cutter.radius is 1e300 mm"),
        ("1e-300,0,plane,1,stock,stock", Some("radius_mm"), "cutter.radius is 1e-300 mm"),
        ("40,0,cone,1,stock,stock", Some("surface"), "\"cone\" is none of"),
        ("40,0,plane,,stock,stock", Some("depth_of_cut_mm"), "empty, but"),
        ("40,0,plane,thin,stock,stock", Some("depth_of_cut_mm"), "\"thin\" is no number"),
    ] {
        let why = error(&[header, case]);
        assert_eq!(why.column(), column, "{why}");
        assert!(why.to_string().starts_with("line 2, column "), "{why}");
        assert!(why.problem().starts_with(reported) && why.problem().len() < 150, "{}", why.problem());
    }
}
