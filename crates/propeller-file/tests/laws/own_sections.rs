//! Sections by their own ordinates.

use std::fmt::Write as _;

use facemill_sample_parts::{BladeResolution, BladeSide, BladeSurface, PropellerSpec, blade};
use facemill_test_kit::Random;

use crate::kit::{DTMB_4119, HEADER, bits, placed, random_rows, read};

/// Radii of DTMB 4119.
const RADII: [f64; 10] = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0];

/// Text of a propeller with the radial table of DTMB 4119 and sections by ordinates: at each radius
/// and station the suction and pressure side over the chord.
fn with_sections(stations: &[f64], sides: impl Fn(usize, f64) -> [f64; 2]) -> String {
    let mut text = String::new();
    for line in DTMB_4119.lines().filter(|line| !line.starts_with("# section")) {
        let cells: Vec<&str> = line.split(',').collect();
        // Without thickness and camber.
        let kept = if cells.len() == 7 { [&cells[..3], &cells[5..]].concat().join(",") } else { line.to_owned() };
        let _ = writeln!(text, "{kept}");
    }
    text += "r_R,x_c,upper_c,lower_c\n";
    for (k, radius) in RADII.iter().enumerate() {
        for x in stations {
            let [upper, lower] = sides(k, *x);
            let _ = writeln!(text, "{radius},{x},{upper},{lower}");
        }
    }
    text
}

/// t/c and f/c of DTMB 4119.
const SIZES: [[f64; 2]; 10] = [
    [0.2055, 0.01429],
    [0.1553, 0.02318],
    [0.118, 0.02303],
    [0.09016, 0.02182],
    [0.0696, 0.02072],
    [0.05418, 0.02003],
    [0.04206, 0.01967],
    [0.03321, 0.01817],
    [0.03228, 0.01631],
    [0.0316, 0.01175],
];

/// Largest distance of two surfaces at points of both sides, mm.
fn apart(a: &PropellerSpec, b: &PropellerSpec, fractions: impl Iterator<Item = f64> + Clone) -> f64 {
    let surfaces = [a, b].map(BladeSurface::new);
    let mut largest: f64 = 0.0;
    for k in 0..60 {
        let radius = 0.5 * a.diameter() * (0.2 + 0.79 * f64::from(k) / 59.0);
        let [a, b] = [0, 1].map(|s: usize| surfaces[s].section(radius));
        for x in fractions.clone() {
            for side in [BladeSide::Suction, BladeSide::Pressure] {
                largest = largest.max((a.point(side, x) - b.point(side, x)).norm());
            }
        }
    }
    largest
}

/// The form of the built-in sections: half the thickness and the mean line of unit size at a
/// station, taken from a built-in section whose edges are not rounded here.
fn form(x: f64) -> [f64; 2] {
    let spec = read(DTMB_4119).unwrap().spec(Some(1000.0)).unwrap();
    let surface = BladeSurface::new(&spec);
    let section = surface.section(350.0);
    let (chord, [t, f]) = (section.chord(), SIZES[5]);
    // The trailing edge of the table, which is rounded on the last half of its thickness.
    let half = if x == 1.0 { 0.5 * 0.0666 } else { section.half_thickness(x) / (t * chord) };
    [half, section.mean_height(x) / (f * chord)]
}

/// Ordinates that are the built-in's own at many stations give its surface, and the error falls
/// with the fourth power of their spacing, as that of cubic splines does.
#[test]
fn ordinates_of_the_built_in_sections_give_their_surface_within_the_error_of_splines() {
    let built_in = read(DTMB_4119).unwrap().spec(Some(1000.0)).unwrap();
    // Evenly spaced in the root of x/c, but for the rounding of the trailing edge.
    let error = |n: usize| {
        let stations: Vec<f64> = (0..=n).map(|k| (k as f64 / n as f64).powi(2)).collect();
        let forms: Vec<[f64; 2]> = stations.iter().map(|x| form(*x)).collect();
        let text = with_sections(&stations, |k, x| {
            let [half, mean] = forms[stations.iter().position(|s| *s == x).unwrap()];
            let [t, f] = SIZES[k];
            [f * mean + t * half, f * mean - t * half]
        });
        let own = read(&text).unwrap().spec(Some(1000.0)).unwrap();
        apart(&built_in, &own, (1..90).map(|k| 0.0108 * f64::from(k)))
    };
    let [coarse, fine] = [error(25), error(100)];
    println!("{coarse} mm with 26 stations, {fine} mm with 101");
    // The third derivative of the built-in form jumps at the stations of its own table, so one
    // power is lost there.
    assert!(fine < coarse / 32.0 && fine < 2e-3, "{coarse} {fine}");
}

/// The 26 stations of the built-in form: the same spline through the same values.
#[test]
fn ordinates_at_the_stations_of_the_built_in_table_give_its_surface() {
    let built_in = read(DTMB_4119).unwrap().spec(Some(1000.0)).unwrap();
    let stations = [
        0.0, 0.005, 0.0075, 0.0125, 0.025, 0.05, 0.075, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6,
        0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0,
    ];
    let forms: Vec<[f64; 2]> = stations.iter().map(|x| form(*x)).collect();
    let text = with_sections(&stations, |k, x| {
        let [half, mean] = forms[stations.iter().position(|s| *s == x).unwrap()];
        let [t, f] = SIZES[k];
        [f * mean + t * half, f * mean - t * half]
    });
    let own = read(&text).unwrap().spec(Some(1000.0)).unwrap();
    let distance = apart(&built_in, &own, (0..=200).map(|k| 0.005 * f64::from(k)));
    assert!(distance < 1e-6, "{distance} mm");
}

/// A round-nosed section with a blunt trailing edge, and a random wave.
fn random_sides(random: &mut Random) -> impl Fn(f64) -> [f64; 2] + use<> {
    let [a, b, c] = [random.between(0.05, 0.1), random.between(0.0, 0.05), random.between(0.0, 0.02)];
    move |x: f64| {
        let half = a * x.sqrt() * (1.0 - x) + 0.002 * x + 0.3 * c * (3.0 * x).sin().abs() * x;
        let mean = b * x * (1.0 - x) + c * (6.0 * x).sin() * x * (1.0 - x);
        [mean + half, mean - half]
    }
}

#[test]
fn blades_pass_through_the_ordinates_of_their_sections() {
    let mut random = Random(45);
    let stations = [0.0, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 1.0];
    for round in 0..8 {
        let rows = random_rows(&mut random, 0.2, 7);
        let in_mm = round % 2 == 1;
        let as_sides = round % 4 < 2;
        let mut text = format!("{HEADER}r_R,c_D,P_D,skew_deg,rake_D\n");
        for row in &rows {
            let _ = writeln!(text, "{},{},{},{},{}", row[0], row[1], row[2], row[5], row[6]);
        }
        let unit = if in_mm { "mm" } else { "c" };
        let names = if as_sides { ["suction", "pressure"] } else { ["thickness", "camber"] };
        let _ = writeln!(text, "r_R,x_c,{}_{unit},{}_{unit}", names[0], names[1]);
        let mut given = Vec::new();
        for row in &rows {
            let sides = random_sides(&mut random);
            for x in stations {
                let [high, low] = sides(x).map(|y| if in_mm { 1000.0 * row[1] * y } else { y });
                let cells = if as_sides { [high, low] } else { [high - low, 0.5 * (high + low)] };
                let _ = writeln!(text, "{},{x},{},{}", row[0], cells[0], cells[1]);
                given.push((*row, x, [high, low].map(|y| if in_mm { y } else { 1000.0 * row[1] * y })));
            }
        }
        let spec = read(&text).unwrap().spec(None).unwrap();
        let surface = BladeSurface::new(&spec);
        for (row, x, heights) in given {
            // The trailing edge is rounded on the last half of its thickness, and the tip as well.
            if x == 1.0 || row[0] == 1.0 {
                continue;
            }
            let section = surface.section(500.0 * row[0]);
            for (side, n) in [BladeSide::Suction, BladeSide::Pressure].into_iter().zip(heights) {
                let apart = (section.point(side, x) - placed(1000.0, row, x, n)).norm();
                assert!(apart < 1e-6, "round {round}, r/R {}, x/c {x}: {apart} mm", row[0]);
            }
        }
    }
}

#[test]
fn sections_over_the_chord_and_in_mm_are_the_same_where_they_are_given() {
    let stations: Vec<f64> = (0..=20).map(|k| (0.05 * f64::from(k)).powi(2)).collect();
    let text = with_sections(&stations, |k, x| {
        let half = SIZES[k][0] * x.sqrt() * (1.0 - 0.95 * x);
        [half, -half]
    });
    let spec = read(&text).unwrap().spec(None).unwrap();
    let mesh = blade(&spec, BladeResolution::new(12, 12).unwrap());
    // Upper, back and suction are names of one side.
    for name in [["back_c", "face_c"], ["suction_c", "pressure_c"]] {
        let renamed = text.replace("upper_c", name[0]).replace("lower_c", name[1]);
        let again = read(&renamed).unwrap().spec(None).unwrap();
        assert_eq!(bits(&blade(&again, BladeResolution::new(12, 12).unwrap())), bits(&mesh));
    }
}
