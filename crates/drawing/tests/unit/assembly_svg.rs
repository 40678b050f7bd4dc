use crate::assembly_svg::*;
use facemill_test_kit::{Random, texts_outside};
use facemill_tool_model::{AssumedMeasure, FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile};

fn tool(radius: f64, corner: f64, lengths: [f64; 3], holder: f64, n: usize) -> ToolAssembly {
    let [flute, stick_out, gauge] = lengths;
    let stack = |length: f64, diameter: f64| {
        let section = |k: usize| Section {
            length_mm: length / n as f64,
            diameter_low_mm: diameter,
            diameter_high_mm: diameter * (1.0 + 0.3 * (k % 2) as f64),
        };
        Stack { clearance_mm: 1.0, sections: (0..n).map(section).collect() }
    };
    let file = ToolFile {
        format: FormatTag::V1,
        name: "a shop's <very> long & odd name of a mill ".repeat(3),
        number: 99_999_999,
        length_register: Some(1),
        radius_mm: radius,
        corner_radius_mm: corner,
        n_inserts: 4,
        flute_length_mm: flute,
        dead_core_radius_mm: 0.5 * radius,
        max_ramp_angle_deg: 2.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: stick_out,
        gauge_length_mm: gauge,
        body: stack(stick_out - flute + 1e-6, 1.4 * radius),
        holder: stack(gauge - stick_out + 1e-6, holder),
        assumed: vec![AssumedMeasure { key: "dead_core_radius_mm".to_owned(), reason: "none".to_owned() }],
    };
    ToolAssembly::new(file).expect("a tool")
}

/// Numbers of all positions in paths.
fn positions(svg: &str) -> Vec<[f64; 2]> {
    let paths = svg.split(" d=\"").skip(1).map(|rest| rest.split('"').next().expect("a path"));
    let word = |word: &str| -> Option<[f64; 2]> {
        let (x, y) = word.trim_start_matches(['M', 'L']).split_once(',').filter(|_| !word.starts_with('A'))?;
        Some([x.parse().expect("a number"), y.parse().expect("a number")])
    };
    paths.flat_map(|path| path.split(' ').filter_map(word).collect::<Vec<_>>()).collect()
}

#[test]
fn texts_and_lines_are_in_the_picture() {
    let mut random = Random(6);
    for _ in 0..60 {
        let radius = 10f64.powf(random.between(-1.5, 3.5));
        let corner = [0.0, 0.3 * radius, radius][random.below(3)];
        let flute = corner.max(radius * random.between(0.02, 3.0)).max(0.02);
        let stick_out = (flute + radius * random.between(1e-3, 5.0)).min(4e3);
        let gauge = stick_out.max(flute) + radius * random.between(1e-3, 6.0);
        let holder = radius * random.between(0.1, 5.0);
        let tool = tool(
            radius,
            corner,
            [flute.min(stick_out), stick_out, gauge.min(9e3)],
            holder.min(8e3),
            1 + random.below(20),
        );
        let svg = assembly_svg(&tool);
        assert_eq!(texts_outside(&svg), Vec::<String>::new());
        let height: f64 =
            svg.split(" height=\"").nth(1).and_then(|s| s.split('"').next()).expect("it").parse().expect("it");
        for [x, y] in positions(&svg) {
            assert!((0.0..=WIDTH).contains(&x) && (0.0..=height).contains(&y), "{x} {y} of {height}\n{svg}");
        }
        assert_eq!(svg, assembly_svg(&tool));
    }
}

#[test]
fn dimensions_are_those_of_the_tool() {
    let svg = assembly_svg(&tool(25.0, 6.0, [8.0, 60.5, 180.0], 63.0, 1));
    for text in
        [">Ø 50<", ">Ø 63<", ">r 6<", ">flute length 8<", ">stick-out 60.5<", ">gauge length 180<", ">gauge line<"]
    {
        assert!(svg.contains(text), "{text}");
    }
    assert!(svg.contains("does not cut within Ø 25 (red)") && svg.contains("Assumed: dead_core_radius_mm."), "{svg}");
    assert!(svg.contains("a shop's &lt;very&gt; long &amp; odd"));
    // To scale: the cutter's sides are 50 mm apart where the gauge length is 180 mm high.
    let cutter = svg.lines().find(|line| line.contains(CUTTER)).expect("a cutter");
    let at = positions(cutter);
    let width = at.iter().map(|p| p[0]).fold(0.0, f64::max) - at.iter().map(|p| p[0]).fold(f64::MAX, f64::min);
    let line = svg.lines().find(|line| line.contains("stroke-dasharray=\"8 4\"")).expect("a gauge line");
    let high = at.iter().map(|p| p[1]).fold(0.0, f64::max) - positions(line)[0][1];
    assert!((width / high - 50.0 / 180.0).abs() < 1e-3, "{width} {high}");
}
