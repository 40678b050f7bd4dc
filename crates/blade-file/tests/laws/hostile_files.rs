//! Files that describe no blade: each fault names file, line and remedy, in bounded time.

use std::time::Instant;

use facemill_blade_file::{BladeInfo, MAX_POINTS, MAX_SECTION_POINTS, read_blade};
use facemill_test_kit::Random;

use crate::read_blades::{inf, profile, read, section};

/// Two sections of ten points.
fn two_sections() -> [Vec<[f64; 3]>; 2] {
    [0.0, 2.0].map(|height| section(&mut Random(5), height, 10))
}

/// Two sections with a change of the second.
fn changed(change: impl Fn(&mut Vec<[f64; 3]>)) -> String {
    let mut sections = two_sections();
    change(&mut sections[1]);
    profile(&sections, |_| "")
}

#[test]
fn faults_of_profiles_name_file_line_and_remedy() {
    let good = changed(|_| ());
    read(&inf("MM"), &good).unwrap();
    let second_header = 15;
    let cases = [
        ("nan", good.replacen("\n", "\n# 1\nnan 1 2\n", 1), 3, "not finite"),
        ("inf", good.replacen("\n", "\n# 1\n1 -inf 2\n", 1), 3, "not finite"),
        ("far", good.replacen("\n", "\n# 1\n1 1e300 2\n", 1), 3, "not finite"),
        ("overflow", good.replacen("\n", "\n# 1\n1 1e999 2\n", 1), 3, "not finite"),
        ("two numbers", good.replacen("\n", "\n1 2\n", 1), 2, "no point"),
        ("four numbers", good.replacen("\n", "\n1 2 3 4\n", 1), 2, "no point"),
        ("six words", good.replacen("\n", "\n1 2 3 le te x\n", 1), 2, "no point"),
        ("no number", good.replacen("\n", "\n1 2 three\n", 1), 2, "no point"),
        ("empty section", good.replacen("# Profile 2", "# empty\n\n# Profile 2", 1), second_header, "at least 8"),
        ("one point less", changed(|s| s.truncate(9)), second_header + 1, "same number"),
        ("twice the same point", changed(|s| s[4] = s[3]), second_header + 5, "remove one"),
        ("a touch", changed(|s| s[7] = s[3]), second_header + 3, "touches itself"),
        ("a crossing", changed(|s| s.swap(2, 3)), second_header + 2, "crosses"),
        ("the other way round", changed(|s| s.reverse()), second_header + 1, "other way round"),
        ("behind", profile(&[0.0, 2.0, 1.0].map(|h| section(&mut Random(5), h, 10)), |_| ""), 29, "from hub to shroud"),
        ("on a line", changed(|s| s.iter_mut().for_each(|p| p[0] = 0.0)), second_header + 1, "one line"),
        (
            "marks twice",
            profile(&two_sections(), |k| ["le", "le"].get(k).copied().unwrap_or("")),
            2,
            "correct the marks",
        ),
    ];
    for (name, text, line, remedy) in cases {
        let why = read(&inf("MM"), &text).expect_err(name);
        assert!(why.starts_with(&format!("p.crv, line {line}: ")) && why.contains(remedy), "{name}: {why}");
    }
    let open = good.lines().filter(|line| !line.is_empty()).collect::<Vec<_>>();
    let why = read(&inf("MM"), &open[..open.len() - 1].join("\n")).expect_err("the last point is missing");
    assert!(why.contains("closed or open"), "{why}");
    for (text, remedy) in [("", "at least 2"), ("# nothing\n", "at least 8"), ("! nothing\n", "at least 2")] {
        assert!(read(&inf("MM"), text).expect_err(text).contains(remedy));
    }
}

#[test]
fn faults_of_inf_files_name_the_line() {
    let good = inf("MM");
    let cases = [
        (good.replace("MM", "parsecs"), "b.inf, line 4: ", "MM, CM, M, IN, FT"),
        (good.replace("Geometry Units: MM\n", ""), "b.inf: ", "Geometry Units"),
        (good.replace("Profile Data File: p.crv\n", ""), "b.inf: ", "Profile Data File"),
        (good.replace(": Z", ": W"), "b.inf, line 2: ", "X, Y, Z"),
        (good.replace(": 7", ": 999999999"), "b.inf, line 3: ", "from 1 to 1000"),
        (good.replace(": 7", ": 0"), "b.inf, line 3: ", "from 1 to 1000"),
        (good.replace("Axis", "Geometry Units: IN\nAxis"), "b.inf, line 5: ", "keep one"),
        (good.replace("Axis", "Coordinate System: cylindrical\nAxis"), "b.inf, line 2: ", "Cartesian"),
        (good.replace("Axis", "Blade 0 TE: Blunt\nAxis"), "b.inf, line 2: ", "EllipseEnd, CutOffEnd"),
        (good.replace("Axis", "Number of Blades Per Set: many\nAxis"), "b.inf, line 2: ", "whole number"),
        (good.replace("p.crv", "q.crv"), "b.inf, line 5: ", "is not there"),
        (good.replace("Axis", "Hub Data File: h.crv\nAxis"), "b.inf, line 2: ", "is not there"),
    ];
    let profile = changed(|_| ());
    for (text, start, remedy) in cases {
        let why = read(&text, &profile).expect_err(remedy);
        assert!(why.starts_with(start) && why.contains(remedy), "{why}");
    }
    assert!(BladeInfo::read("b.inf", &[0xff, 0xfe, 0]).unwrap_err().to_string().contains("UTF-8"));
}

/// Splitter blades are never taken for sections of the main blade, and as many are there as the
/// `.inf` file says.
#[test]
fn blades_of_a_set_are_as_many_as_the_files_say() {
    let good = inf("MM");
    let alone = changed(|_| ());
    let with = |line: &str| good.replace("Axis", &format!("{line}\nAxis"));
    assert!(read(&with("Number of Blades Per Set: 1"), &alone).is_ok());
    for (line, remedy) in [
        ("Number of Blades Per Set: 2", "of 1; correct the number"),
        ("Number of Blades Per Set: 11", "from 1 to 10"),
        ("Blade 1 LE: EllipseEnd", "Blade 1 is not there"),
        ("blade 2 te: CutOffEnd", "Blade 2 is not there"),
    ] {
        let why = read(&with(line), &alone).expect_err(line);
        assert!(why.starts_with("b.inf, line 2: ") && why.contains(remedy), "{why}");
    }
    // A second blade behind the first, half as long, beside it, and farther out as well.
    let main = two_sections();
    for (shift, out) in [([9.0, 0.0, 2.0], 0.0), ([30.0, 0.0, 4.0], 0.5), ([90.0, 0.0, 0.0], 40.0)] {
        let other = main.each_ref().map(|points| {
            points.iter().map(|[x, y, z]| [x + shift[0], y + out, 0.5 * z + shift[2]]).collect::<Vec<_>>()
        });
        let text = profile(&[&main[..], &other[..]].concat(), |_| "");
        let numbered = text.replace("Profile 3", "Profile 1").replace("Profile 4", "Profile 2");
        let named = text.replace("# Profile 3", "# Splitter Blade\n# Profile 3");
        for text in [&numbered, &named] {
            assert_eq!(read(&good, text).unwrap().blades.len(), 2);
            let why = read(&with("Number of Blades Per Set: 1"), text).expect_err("a splitter");
            assert!(why.starts_with("b.inf, line 2: ") && why.contains("are of 2"), "{why}");
        }
        // A section that is missing is named with its blade.
        let short = named.split("# Profile 4").next().unwrap_or_default();
        let why = read(&good, short).expect_err("one section");
        assert!(why.starts_with("p.crv: blade 1 has 1; it needs at least 2"), "{why}");
        let why = read(&good, &format!("{alone}## Splitter Blade\n")).expect_err("no section");
        assert!(why.starts_with("p.crv: blade 1 has 0; it needs at least 2"), "{why}");
    }
    // By its place alone: its root lies below the tip of the main blade.
    let other = main.each_ref().map(|points| points.iter().map(|[x, y, z]| [x + 9.0, *y, 0.5 * z]).collect::<Vec<_>>());
    let why = read(&good, &profile(&[&main[..], &other[..]].concat(), |_| "")).expect_err("out of order");
    assert!(why.contains("## Splitter blade"), "{why}");
    let many: String = (0..11).map(|_| alone.as_str()).collect();
    let why = read(&good, &many).expect_err("eleven blades");
    assert!(why.starts_with("p.crv, line ") && why.contains("more than 10 blades"), "{why}");
}

#[test]
fn names_that_lead_out_of_the_folder_are_refused_unopened() {
    for name in [
        "../p.crv",
        "a/../../p.crv",
        "/etc/passwd",
        "\\\\host\\p.crv",
        "C:p.crv",
        "c:\\p.crv",
        "..\\p.crv",
        "",
        ".",
        "a//b",
    ] {
        let text = inf("MM").replace("p.crv", name);
        let refused = read_blade("b.inf", text.as_bytes(), |name| panic!("{name} is opened"));
        let why = refused.expect_err(name).to_string();
        assert!(why.starts_with("b.inf, line 5: ") && why.contains("leads out of the folder"), "{why}");
    }
}

#[test]
fn large_files_are_refused_in_bounded_time() {
    let start = Instant::now();
    let many = |n: usize| section(&mut Random(3), 0.0, n);
    let why = read(&inf("MM"), &profile(&[many(MAX_SECTION_POINTS + 1)], |_| "")).expect_err("a section");
    assert!(why.contains("10000 points in one section"), "{why}");
    let hundred = many(100);
    let why = read(&inf("MM"), &profile(&vec![hundred; MAX_POINTS / 100], |_| "")).expect_err("all");
    assert!(why.contains("200000 points in all curves"), "{why}");
    // A comb whose teeth overlap along the section is the most that the search for crossings
    // compares.
    let comb = |height: f64| -> Vec<[f64; 3]> {
        let n = MAX_SECTION_POINTS / 2 - 2;
        let across = |k: usize, z: f64| [900.0 * k as f64 / n as f64, height, z];
        let there = (0..n).map(|k| across(k, if k % 2 == 0 { 0.0 } else { 900.0 }));
        let back = (0..n).rev().map(|k| across(k, if k % 2 == 0 { 0.1 } else { 900.1 }));
        there.chain(back).collect()
    };
    read(&inf("MM"), &profile(&[comb(0.0), comb(5.0)], |_| "")).unwrap();
    println!("{:?}", start.elapsed());
    assert!(start.elapsed().as_secs() < 60);
}

#[test]
fn random_damage_never_panics() {
    let mut random = Random(77);
    let texts = [inf("MM"), format!("{}## Splitter blade\n{}", changed(|_| ()), changed(|_| ()))];
    for _ in 0..2000 {
        let [info, profile] = [0, 1].map(|k| {
            let mut bytes = texts[k].clone().into_bytes();
            for _ in 0..random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] = b"0123456789.-e \n#!lt:"[random.below(20)];
            }
            String::from_utf8(bytes).unwrap()
        });
        let _ = read(&info, &profile);
    }
}
