//! Links of Heidenhain programs, whose lines count on.

use facemill::Job;
use facemill::nc_program::Dialect;
use facemill::rapids::{Rapids, RetractStrategy};
use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::text_of;
use facemill_tests::variants::blink_patch;
use serde_json::json;

use super::controls::block;

fn faster(job: &Job, text: &str) -> Rapids {
    super::controls::faster(job, Dialect::Heidenhain, text)
}

/// Two ways above the patch at feed, and these lines for their link; `head` behind the tool's call.
/// No line has its number.
fn two_ways(head: &str, across: &str) -> String {
    format!(
        "BEGIN PGM TWO MM\n; TWO WAYS\nCYCL DEF 247 DATUM SETTING ~\n  Q339=+1 ;DATUM NUMBER\nPLANE RESET STAY\n\
         TOOL CALL 1 Z S6000\nM3\n{head}L X-30 Y+0 Z+440 B+0 C+0 R0 FMAX\nL Z+330 R0 FMAX\nL X+30 R0 F1000\n{across}\
         L X+30 R0\n* - HOME\nL Z+440 R0 FMAX\nFUNCTION RESET TCPM\nM30\nEND PGM TWO MM\n"
    )
}

/// With numbers from 0 on all lines but one that goes on with the line before, and line ends as on
/// DOS.
fn numbered(text: &str) -> String {
    let mut out = String::new();
    let (mut number, mut goes_on) = (0, false);
    for line in text.lines() {
        if goes_on {
            out += &format!("{line}\r\n");
        } else {
            out += &format!("{number} {line}\r\n");
            number += 1;
        }
        goes_on = line.ends_with('~');
    }
    out
}

const DIRECT: &str = "L X-30 Y+5 B+2.5 C-12 R0 FMAX\n";

#[test]
fn a_link_with_nothing_in_the_way_is_one_line_and_the_lines_behind_count_on() {
    let folder = block();
    let job = Job::read(&folder.job()).unwrap();
    let far = "L Z+440 FMAX\nL  X-30 Y5,0 B+2,5 C-12 R0 FMAX\nl z+330 r0 fmax\n";
    for text in [numbered, str::to_owned] {
        let old = text(&two_ways("", far));
        let made = faster(&job, &old);
        let direct = text(&two_ways("", DIRECT));
        assert_eq!(String::from_utf8(made.text).unwrap(), direct);
        let [link] = &made.file.links[..] else { panic!("{:?}", made.file.links) };
        assert!(link.way == RetractStrategy::Direct && link.time_after_s < link.time_before_s, "{link:?}");
        assert_eq!((link.lines, link.new_lines, made.file.findings), ([11, 13], [11, 11], [0, 0]));
        let again = faster(&job, &direct);
        assert!(again.text == direct.as_bytes() && again.file.changed == 0);
        assert_eq!(again.file.time_before_s, link.time_after_s);
    }

    // A comment on the link stays, with the number that it then has.
    let old = numbered(&two_ways("", &far.replacen('\n', "\n; ACROSS\n", 1)));
    let direct = numbered(&two_ways("", &format!("{DIRECT}; ACROSS\n")));
    assert_eq!(String::from_utf8(faster(&job, &old).text).unwrap(), direct);

    // With words of the tip, which FMAX keeps on a line.
    folder.set("machine.json", &[("/motion/cutting", json!("tip_and_rotaries_linear"))]);
    let job = Job::read(&folder.job()).unwrap();
    let tcpm = "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\n";
    let made = faster(&job, &numbered(&two_ways(tcpm, far)));
    assert_eq!(String::from_utf8(made.text).unwrap(), numbered(&two_ways(tcpm, DIRECT)));
}

/// A direct way would turn by 200 deg, which M126 takes for 160 deg the other way around; exactly
/// half a turn goes either way.
#[test]
fn no_block_turns_by_half_a_turn_under_m126() {
    let folder = block();
    let job = Job::read(&folder.job()).unwrap();
    // Behind the first positions, which the shorter way leads nowhere known.
    let with = |function: &str, across: &str, end: &str| {
        let text = two_ways("", &across.replace("+200", end));
        numbered(&text.replacen("L Z+330 R0 FMAX\n", &format!("L Z+330 R0 FMAX\n{function}\n"), 1))
    };
    let (far, direct) =
        ("L Z+440 R0 FMAX\nL C+100 R0 FMAX\nL X-30 Y+5 C+200 R0 FMAX\nL Z+330 R0 FMAX\n", "L X-30 Y+5 C+200 R0 FMAX\n");
    for end in ["+200", "+180"] {
        let old = with("M126", far, end);
        let made = faster(&job, &old);
        let [link] = &made.file.links[..] else { panic!("{:?}", made.file.links) };
        let why = link.kept_because.as_ref().unwrap();
        assert!(made.text == old.as_bytes() && why.contains("C would turn") && why.contains("M126"), "{why}");
    }
    // Less is the shorter way, and without M126 half a turn goes as it is written.
    for (function, end) in [("M126", "+179.999"), ("M127", "+180")] {
        let made = faster(&job, &with(function, far, end));
        assert_eq!(String::from_utf8(made.text).unwrap(), with(function, direct, end));
    }
}

#[test]
fn links_with_more_than_positions_stay_and_are_reported() {
    let folder = block();
    let job = Job::read(&folder.job()).unwrap();
    for (across, why) in [
        ("L Z+440 R0 FMAX M8\nL X-30 R0 FMAX\n", "line 13: says something besides"),
        ("L Z+440 R0 FMAX\nL IX-60 R0 FMAX\n", "line 14: `IX-60 R0` is not understood"),
        ("L Z+440 R0 FMAX\nL X-30 R0 FMAX M126\n", "line 14: `M126` is no absolute place"),
        ("L Z+440 R0 FMAX\nLP PR+30 PA+180 R0 FMAX\n", "line 14: `LP PR+30 PA+180 R0 FMAX` is not understood"),
        (
            "L Z+440 R0 FMAX\n/L X-30 R0 FMAX\n",
            "line 14: the positions of the axes are unknown: block that may be skipped",
        ),
        ("L Z+440 R0 FMAX\nL X-30 R0 F MAX\n", "line 14: `F MAX` is not understood"),
        ("L Z+440 R0 FMAX\nL X+Q1 R0 FMAX\n", "line 14: `X+Q1 R0` is not understood"),
        (
            "L Z+440 R0 FMAX\nPLANE SPATIAL SPA+0 SPB+5 SPC+0 STAY\nL X-30 R0 FMAX\n",
            "line 14: the positions of the axes are unknown",
        ),
        ("L Z+0 R0 FMAX M91\nL X-30 R0 FMAX\n", "line 13: `Z+0` is no absolute place"),
        ("L Z+440 R0 FMAX\nCC X+0 Y+0\nL X-30 R0 FMAX\n", "line 14: says something else"),
    ] {
        let across = format!("{across}L X-30 Y+0 Z+330 B+0 C+0 R0 FMAX\n");
        let old = numbered(&two_ways("CC X+0 Y+0\nQ1 = -30\n", &across));
        let made = faster(&job, &old);
        assert!(made.text == old.as_bytes() && made.file.changed == 0, "{across}");
        let output = made.file.links.iter().find_map(|link| link.kept_text());
        assert!(output.is_some_and(|output| output.contains(why)), "{across}{:?}", made.file.links);
    }
}

/// The text with numbers is the same as without them, line by line, but for these lines.
fn without(text: &str, ranges: impl Iterator<Item = [u32; 2]>) -> Vec<String> {
    let ranges: Vec<[u32; 2]> = ranges.collect();
    let is_in = |line: u32| ranges.iter().any(|[first, last]| (*first..=*last).contains(&line));
    let words = |line: &str| line.trim_start_matches(|c: char| c.is_ascii_digit()).to_owned();
    text.lines().zip(1..).filter(|(l, n)| l.contains(';') || !is_in(*n)).map(|(l, _)| words(l)).collect()
}

/// A plan's own program, whose links go over the clearance surface.
#[test]
fn a_plan_for_heidenhain_gets_faster_links_on_the_command_line() {
    let folder = blink_patch();
    folder.set("job.json", &[("/post/dialect", json!("heidenhain")), ("/setups/0/links/shorten", json!(false))]);
    let planned = folder.plan();
    let old = text_of(&planned, "program.h");
    folder.write("old.nc", old.as_bytes());
    let output = facemill_in(&folder, "rapids old.nc --job job.json --stock-cell-mm 2 -o new.nc --report links.json");
    assert_eq!(output.code, 0, "{}{}", output.errors, output.printed);
    let (new, report) = (std::fs::read_to_string(folder.path("new.nc")).unwrap(), folder.json("links.json"));
    assert!(report["changed"].as_u64() > Some(0) && report["findings"] == json!([0, 0]), "{report}");
    // All lines but continued ones count from 0.
    let is_block =
        |(k, line): &(usize, &str)| *k == 0 || !new.lines().nth(k - 1).unwrap().ends_with('~') || line.is_empty();
    for (number, (_, line)) in new.lines().enumerate().filter(is_block).enumerate() {
        assert!(line.starts_with(&format!("{number} ")), "{number}: {line}");
    }
    let links = report["links"].as_array().unwrap();
    let lines =
        |key: &str| links.iter().map(|link| [0, 1].map(|k| link[key][k].as_u64().unwrap() as u32)).collect::<Vec<_>>();
    assert_eq!(without(&old, lines("lines").into_iter()), without(&new, lines("new_lines").into_iter()));
    let output = facemill_in(&folder, "verify new.nc --job job.json --certificates --out found.json");
    assert_eq!((output.code, &folder.json("found.json")["findings"]), (0, &json!([])), "{}", output.printed);
}
