//! Files as they are meant: every point, mark and unit arrives.

use std::path::Path;

use facemill_blade_file::{BladeFile, BladeInfo, EdgeEnd, RotationAxis, read_blade};
use facemill_test_kit::Random;
use nalgebra::{Point3, Vector3};

const UNITS: [(&str, f64); 6] = [("MM", 1.0), ("cm", 10.0), ("M", 1000.0), ("Inch", 25.4), ("IN", 25.4), ("FT", 304.8)];

/// Lens of random size with its points at random places, counter-clockwise seen from +y.
pub(crate) fn section(random: &mut Random, height: f64, n: usize) -> Vec<[f64; 3]> {
    let (chord, thickness) = (random.between(2.0, 5.0), random.between(0.2, 0.9));
    let angle =
        |k: usize, random: &mut Random| (k as f64 + random.between(-0.3, 0.3)) * std::f64::consts::TAU / n as f64;
    (0..n).map(|k| angle(k, random)).map(|a| [thickness * a.sin(), height, -chord * a.cos()]).collect()
}

pub(crate) fn profile(sections: &[Vec<[f64; 3]>], mark: impl Fn(usize) -> &'static str) -> String {
    let mut text = String::from("! a comment\n");
    for (k, points) in sections.iter().enumerate() {
        text += &format!("# Profile {} at {}%\n", k + 1, 10 * k);
        for (j, [x, y, z]) in points.iter().chain(&points[..1]).enumerate() {
            text += &format!("  {x:.17e}\t{y:.17e}, {z:.17e} {}\n", mark(j % points.len()));
        }
        text += "\n";
    }
    text
}

pub(crate) fn inf(unit: &str) -> String {
    format!(
        "!== CFX-BladeGen ==\r\nAxis of Rotation: Z\nNumber of Blade Sets: 7\nGeometry Units: {unit}\nProfile Data File: p.crv\n"
    )
}

pub(crate) fn read(inf: &str, profile: &str) -> Result<BladeFile, String> {
    let open =
        |name: &str| if name == "p.crv" { Ok(profile.as_bytes().to_vec()) } else { Err("is not there".to_owned()) };
    read_blade("b.inf", inf.as_bytes(), open).map_err(|e| e.to_string())
}

#[test]
fn points_marks_and_units_of_random_blades_arrive() {
    let mut random = Random(4201);
    for round in 0..60 {
        let (unit, mm) = UNITS[round % UNITS.len()];
        let n = 8 + random.below(60);
        let sections: Vec<_> = (0..2 + random.below(6)).map(|k| section(&mut random, k as f64, n)).collect();
        let half = n / 2;
        let mark = |j| {
            if j == 0 {
                "LE"
            } else if j == half {
                "te"
            } else {
                ""
            }
        };
        let blade = read(&inf(unit), &profile(&sections, mark)).unwrap();
        assert_eq!((blade.axis, blade.n_blades), (RotationAxis::Z, Some(7)));
        assert_eq!(blade.blades[0].sections.len(), sections.len());
        for (given, read) in sections.iter().zip(&blade.blades[0].sections) {
            let expected: Vec<_> = given.iter().map(|p| Point3::from(*p) * mm).collect();
            assert_eq!(read.points, expected);
            assert!(read.is_closed && read.leading == Some([0; 2]) && read.trailing == Some([half; 2]));
        }
        assert_eq!(blade.blades[0].sections[0].lines[0], 3);
    }
}

#[test]
fn marks_at_the_corners_of_cut_off_ends_are_pairs_in_their_order() {
    let points = section(&mut Random(7), 0.0, 20);
    let moved = points.iter().map(|[x, y, z]| [*x, y + 1.0, *z]).collect();
    let mark = |j| ["le2", "", "te1", "te2"].get(j).copied().unwrap_or(if j == 19 { "LE1" } else { "" });
    let blade = read(&inf("MM"), &profile(&[points, moved], mark)).unwrap();
    assert_eq!(
        (blade.blades[0].sections[1].leading, blade.blades[0].sections[1].trailing),
        (Some([19, 0]), Some([2, 3]))
    );
}

#[test]
fn forms_of_edges_are_read_and_are_those_of_the_marks() {
    let points = section(&mut Random(8), 0.0, 20);
    let moved = points.iter().map(|[x, y, z]| [*x, y + 1.0, *z]).collect();
    let sections = [points, moved];
    let with = |keys: &str| format!("{}{keys}", inf("MM"));
    let one = |j| if j == 0 { "te" } else { "" };
    let two = |j| ["te1", "te2"].get(j).copied().unwrap_or("");
    let ends = |keys: &str, mark: &dyn Fn(usize) -> &'static str| {
        read(&with(keys), &profile(&sections, mark)).map(|blade| blade.blades[0].ends)
    };
    assert_eq!(ends("", &one), Ok([None, None]));
    let both = "Blade 0 LE: EllipseEnd\nBlade 0  te : cutoffend\n";
    let read = Ok([Some(EdgeEnd::Ellipse), Some(EdgeEnd::CutOff)]);
    assert_eq!(ends(both, &one), read);
    assert_eq!(ends(both, &two), read);
    let why = ends("Blade 0 TE: EllipseEnd\n", &two).expect_err("two marks of a rounded edge");
    assert!(why.starts_with("p.crv, line 3: ") && why.contains("CutOffEnd"), "{why}");
}

#[test]
fn keys_are_read_in_any_case_and_comments_are_not() {
    let text = "axis OF  rotation: x ! the shaft\nGEOMETRY UNITS: m\nBlade 0 LE: EllipseEnd\n\
                Profile Data File: sub\\p.crv\n!Number of Blade Sets: 0\n";
    let info = BladeInfo::read("b.inf", text.as_bytes()).unwrap();
    assert_eq!(info.axis.direction(), Vector3::x());
    assert_eq!((info.n_blades, info.mm_per_unit), (None, 1000.0));
    assert_eq!((info.ends_of(0), info.ends_of(1)), ([Some(EdgeEnd::Ellipse), None], [None; 2]));
    assert_eq!(info.profile_files, [("sub/p.crv".to_owned(), 4)]);
}

/// Sections of a main blade and of splitters beside it with other numbers of points, farther
/// downstream.
fn set(random: &mut Random, n_splitters: usize) -> Vec<Vec<Vec<[f64; 3]>>> {
    (0..=n_splitters)
        .map(|k| {
            let (n, shift) = (8 + 3 * k + random.below(20), 9.0 * k as f64);
            let one = |height: usize, random: &mut Random| {
                let moved = |[x, y, z]: [f64; 3]| [x + shift, y, 0.5 * z + 0.4 * shift];
                section(random, height as f64, n).into_iter().map(moved).collect::<Vec<_>>()
            };
            (0..2 + random.below(3)).map(|height| one(height, random)).collect()
        })
        .collect()
}

/// Text of a profile file with these headers before the blades after the first; numbers of profiles
/// go on through the file, or begin anew.
fn text_of_set(blades: &[Vec<Vec<[f64; 3]>>], header: impl Fn(usize) -> String, goes_on: bool) -> String {
    let (mut text, mut number) = (String::new(), 0);
    for (k, sections) in blades.iter().enumerate() {
        let mut own = profile(sections, |_| "").replace("! a comment\n", "");
        for j in (1..=sections.len()).rev().filter(|_| goes_on) {
            own = own.replace(&format!("# Profile {j} "), &format!("# Profile {} ", number + j));
        }
        number += sections.len();
        text += &(header(k) + &own);
    }
    text
}

#[test]
fn every_blade_of_a_set_arrives_with_its_own_sections() {
    let mut random = Random(77);
    for round in 0..40 {
        let blades = set(&mut random, 1 + round % 3);
        let header = |k: usize| match (round % 5, k) {
            // As a generator of TurboGrid files writes them.
            (0, 0) => "##\tMain\tblade\n".to_owned(),
            (0, _) => "##\tSplitter\tblade\n".to_owned(),
            (1, 0) => "## Main Blade\n\n".to_owned(),
            (1, _) => format!("\n## Splitter Blade {k}\n\n"),
            (2, 1) => "# Splitter\n".to_owned(),
            (2, k) => format!("## Blade {k}\n"),
            _ => String::new(),
        };
        // Without headers the numbers begin anew.
        let goes_on = round % 5 < 3 && round % 2 == 0;
        let text = text_of_set(&blades, header, goes_on);
        for line in [String::new(), format!("Number of Blades Per Set: {}\n", blades.len())] {
            let read = read(&inf("MM").replace("Axis", &format!("{line}Axis")), &text).unwrap();
            assert_eq!(read.blades.len(), blades.len(), "round {round}");
            for (given, read) in blades.iter().zip(&read.blades) {
                let points = |sections: &[Vec<[f64; 3]>]| -> Vec<Vec<Point3<f64>>> {
                    sections.iter().map(|section| section.iter().map(|p| Point3::from(*p)).collect()).collect()
                };
                let there: Vec<_> = read.sections.iter().map(|section| section.points.clone()).collect();
                assert_eq!(there, points(given), "round {round}");
                assert!(read.sections.iter().all(|section| section.name.starts_with("Profile")), "round {round}");
            }
        }
    }
}

#[test]
fn headers_with_the_word_blade_are_no_other_blade() {
    let points = section(&mut Random(12), 0.0, 20);
    let moved = |out: f64| points.iter().map(|[x, y, z]| [*x, y + out, *z]).collect::<Vec<_>>();
    let text = profile(&[0.0, 1.0, 2.0].map(moved), |_| "");
    for header in
        ["# Rotor1 Blade, Profile", "## Main Blade Profile", "##Profile", "# Blade section", "# Splitter Profile"]
    {
        let blade = read(&inf("MM"), &text.replace("# Profile", header)).unwrap();
        assert_eq!((blade.blades.len(), blade.blades[0].sections.len()), (1, 3), "{header}");
    }
}

#[test]
fn blades_of_several_profile_files_are_one_set() {
    let blades = set(&mut Random(5), 2);
    let texts = [profile(&blades[0], |_| ""), text_of_set(&blades[1..], |_| String::new(), false)];
    let open = |name: &str| match name {
        "p.crv" => Ok(texts[0].clone().into_bytes()),
        "s/s.crv" => Ok(texts[1].clone().into_bytes()),
        _ => Err("is not there".to_owned()),
    };
    let lines =
        "Profile Data File: s/s.crv\nNumber of Blades Per Set: 3\nBlade 2 TE: CutOffEnd\nBlade 0 LE: EllipseEnd\n";
    let read = |text: &str| read_blade("b.inf", text.as_bytes(), open).map_err(|e| e.to_string());
    let set = read(&(inf("MM") + lines)).unwrap();
    let n_sections: Vec<_> = set.blades.iter().map(|blade| blade.sections.len()).collect();
    assert_eq!(n_sections, blades.iter().map(Vec::len).collect::<Vec<_>>());
    let ends: Vec<_> = set.blades.iter().map(|blade| blade.ends).collect();
    assert_eq!(ends, [[Some(EdgeEnd::Ellipse), None], [None; 2], [None, Some(EdgeEnd::CutOff)]]);
    let why = read(&(inf("MM") + "Profile Data File: s/s.crv\n")).expect_err("a number is missing");
    assert!(why.starts_with("b.inf, line 6: ") && why.contains("Number of Blades Per Set"), "{why}");
}

#[test]
fn downstream_is_the_length_along_the_hub() {
    let points = section(&mut Random(9), 3.0, 20);
    let moved = points.iter().map(|[x, y, z]| [*x, y + 1.0, *z]).collect();
    let mut blade = read(&inf("MM"), &profile(&[points, moved], |_| "")).unwrap();
    assert_eq!(blade.downstream(&Point3::new(1.0, 2.0, -4.0)), -4.0, "without a hub along the axis");
    // Along the axis, then outward.
    blade.hub = vec![Point3::new(0.0, 2.0, 0.0), Point3::new(2.0, 0.0, 5.0), Point3::new(0.0, 9.0, 5.0)];
    for (point, length) in [([3.0, 0.0, 2.0], 2.0), ([0.0, 4.0, 4.5], 7.0), ([0.0, -20.0, 6.0], 12.0)] {
        assert!((blade.downstream(&Point3::from(point)) - length).abs() < 1e-12, "{point:?}");
    }
}

/// Folder, blades, sections, points of each.
const SAMPLES: [(&str, u32, usize, usize); 2] =
    [("rotor37/BladeGen.inf", 36, 6, 300), ("hannover_rotor1/1_Rotor1_Blade.inf", 23, 7, 120)];

#[test]
fn samples_are_read_as_they_are() {
    let shared = std::env::var("FACEMILL_SHARED")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared").to_owned());
    for (name, n_blades, n_sections, n_points) in SAMPLES {
        let path = Path::new(&shared).join("data/blades").join(name);
        let Ok(bytes) = std::fs::read(&path) else {
            println!("skipped: {} is not there (set FACEMILL_SHARED to the folder of shared data)", path.display());
            continue;
        };
        let folder = path.parent().unwrap();
        let blade =
            read_blade(name, &bytes, |file| std::fs::read(folder.join(file)).map_err(|e| e.to_string())).unwrap();
        assert_eq!((blade.n_blades, blade.blades[0].sections.len()), (Some(n_blades), n_sections));
        assert!(
            blade.blades[0].sections.iter().all(|s| s.points.len() == n_points && s.is_closed && s.leading.is_none())
        );
        assert!(blade.hub.len() > 10 && blade.shroud.len() > 10);
        // The first section is nearer to the hub than the last one, and both are some centimetres
        // out.
        let radius = |p: &Point3<f64>| p.x.hypot(p.y);
        let [root, tip] = [0, n_sections - 1].map(|k| radius(&blade.blades[0].sections[k].points[0]));
        assert!(60.0 < root && root < tip && tip < 300.0);
    }
}
