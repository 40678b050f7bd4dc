//! Geometry tables in the form that OpenProp 3 writes (`Geometry.m`, the part "Make
//! OpenProp_Geometry.txt"), typed by hand.

use facemill_propeller_file::read_propeller;
use facemill_sample_parts::{BladeResolution, BladeSide, BladeSurface, Hand, blade};

use crate::kit::placed;

/// Rows of a small propeller: r/R, c/D, t0/c, f0/c, P/D, skew, rake/D (positive aft).
const ROWS: [[f64; 7]; 7] = [
    [0.25, 0.2, 0.16, 0.03, 0.9, 0.0, 0.0],
    [0.4, 0.25, 0.11, 0.028, 0.95, 2.0, 0.005],
    [0.55, 0.29, 0.08, 0.026, 0.97, 5.0, 0.01],
    [0.7, 0.3, 0.06, 0.024, 0.96, 9.0, 0.015],
    [0.85, 0.26, 0.045, 0.02, 0.92, 13.0, 0.02],
    [0.95, 0.17, 0.04, 0.018, 0.88, 16.0, 0.025],
    [1.0, 0.0, 0.0, 0.015, 0.85, 18.0, 0.03],
];

fn table(tip_thickness: &str) -> String {
    let mut text = "\t\t Own_Geometry.txt \n\n\t\t Propeller Geometry Table\n\nDate and time: 01-Jan-2020\n\n\
                    Propeller Diameter \t = 0.4000 m\nNumber of Blades   \t = 4\nPropeller Speed \t = 900 RPM\n\
                    Propeller Hub Diameter \t = 0.1000 m\nMeanline  Type: NACA a=0.8\n\
                    Thickness Type: NACA 66 (DTRC modified)\nLifting Surface Geometry Corrections: none\n \n \n\
                    \x20r/R\t  c/D\t  t0/c\t   f0/c\t P/D\t pitch\t skew \t rake/D\n\
                    \x20   \t     \t      \t       \t    \t (deg)\t (deg)\t       \n"
        .to_owned();
    for row in ROWS {
        let pitch = (row[4] / (std::f64::consts::PI * row[0])).atan().to_degrees();
        let thickness = if row[1] == 0.0 { tip_thickness.to_owned() } else { format!("{:.4}", row[2]) };
        text += &format!(
            "{:.4}  {:.4}  {thickness}  {:.4}  {:.4}  {pitch:7.4}  {:.4}  {:.4}\n",
            row[0], row[1], row[3], row[4], row[5], row[6]
        );
    }
    text + " \n\nr/R  \t [ ], radial position / propeller radius \nc/D  \t [ ], chord length    / propeller diameter \n"
}

fn refused(text: &str) -> String {
    read_propeller("own.txt", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn a_table_of_openprop_is_the_blade_that_it_describes() {
    let file = read_propeller("own.txt", table("18082461421851.7383").as_bytes()).unwrap();
    assert_eq!((file.diameter_mm, file.table.n_blades, file.table.hub_ratio), (400.0, 4, 0.25));
    assert_eq!(file.table.hand, Hand::Right);
    let spec = file.spec(None).unwrap();
    let surface = BladeSurface::new(&spec);
    for row in &ROWS[..6] {
        let section = surface.section(200.0 * row[0]);
        // Where the thickness of the section form is largest, at 0.45 c.
        for (side, sign) in [(BladeSide::Suction, 0.5), (BladeSide::Pressure, -0.5)] {
            let n = 400.0 * row[1] * (row[3] * 0.06709 / 0.0679 + sign * row[2]);
            let values = [row[0], row[1], row[4], 0.0, 0.0, row[5], -row[6]];
            let apart = (section.point(side, 0.45) - placed(400.0, values, 0.45, n)).norm();
            assert!(apart < 1e-6, "r/R {}: {apart}", row[0]);
        }
    }
}

/// At the tip OpenProp divides by no chord: what it writes there changes nothing.
#[test]
fn the_thickness_over_no_chord_is_not_read() {
    let mesh = |tip: &str| {
        let file = read_propeller("own.txt", table(tip).as_bytes()).unwrap();
        blade(&file.spec(None).unwrap(), BladeResolution::new(10, 10).unwrap())
    };
    let first = mesh("18082461421851.7383");
    for tip in ["Inf", "NaN", "0.0000"] {
        assert_eq!(mesh(tip).vertices(), first.vertices());
    }
}

#[test]
fn faults_name_line_and_column() {
    let good = table("Inf");
    let cases = [
        (good.replace("NACA 66 (DTRC modified)", "NACA 65A010"), "own.txt, line 12: ", "as CSV"),
        (good.replace("NACA a=0.8", "parabolic"), "own.txt, line 11: ", "as CSV"),
        (good.replace("0.4000 m\n", "0.4000 ft\n"), "own.txt, line 7: ", "no number"),
        (good.replace("Blades   \t = 4", "Blades   \t = 40"), "own.txt, line 8: ", "2 to 12"),
        (good.replace("Propeller Hub Diameter", "Hub"), "own.txt: ", "Propeller Hub Diameter"),
        (good.replace("0.2500  0.2000", "0.2500  thick"), "own.txt, line 18, column \"c/D\": ", "no number"),
        (good.replace("0.4000  0.2500  ", "0.4000  "), "own.txt, line 19: ", "7 values for 8"),
        (good.replace(" rake/D", " Xs/D"), "own.txt, line 16: ", "as CSV"),
    ];
    for (text, start, remedy) in cases {
        let why = refused(&text);
        assert!(why.starts_with(start) && why.contains(remedy), "{why}");
    }
    // A pitch angle that is not that of the pitch.
    let why = refused(&good.replace("0.9500  37.", "0.9500  47."));
    assert!(why.starts_with("own.txt, line 19, column \"phi_deg\": disagrees"), "{why}");
}
