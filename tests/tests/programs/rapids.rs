//! Links of programs: shorter ones are free by the kit's own kinematics and distances, end where
//! they did, and leave every other byte as it is.

use facemill::nc_program::Dialect;
use facemill::rapids::{Rapids, RapidsFile, RapidsRequest, RetractStrategy, faster_rapids};
use facemill::{CutRequest, Failure, Job, SilentStages};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::variants::{tiny_patch, variant};
use serde_json::json;

mod controls;
mod heidenhain;
mod lengths;
mod planned;
mod rapids_command;

fn faster(job: &JobFolder, dialect: Dialect, text: &str) -> Result<Rapids, Failure> {
    let path = job.path("program.nc");
    let cut = CutRequest::on_lines(1.0, 0.05);
    let request = RapidsRequest { program: &path, dialect, setup: 0, gouge_limit: None, cut, clearance: None };
    faster_rapids(&Job::read(&job.job()).unwrap(), text.as_bytes(), &request, &SilentStages)
}

/// Z word that links go to, mm: 140 mm above the workpiece's zero.
const FAR: f64 = 440.0;

/// Lines of each run of rapids between two cuts, by the kit's interpreter, and the axes at its end.
fn links(text: &str) -> Vec<(Vec<usize>, interpreter::Axes)> {
    let motions = interpreter::run(text);
    let runs: Vec<&[interpreter::Motion]> = motions.chunk_by(|a, b| a.rapid == b.rapid).collect();
    let inner = runs.iter().enumerate().filter(|(k, run)| run[0].rapid && *k > 0 && *k + 1 < runs.len());
    inner.map(|(_, run)| (run.iter().map(|m| m.line).collect(), run[run.len() - 1].to)).collect()
}

/// The program with links that go straight up, over, and straight down; a switched coolant in the
/// first one, and a comment in the second.
fn with_far_links(text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (k, (own, end)) in links(text).iter().enumerate().rev() {
        let interpreter::Axes { x, y, z, b, c } = end;
        let mut new = vec![format!("G0 Z{FAR}"), format!("X{x} Y{y} B{b} C{c}"), format!("N77 Z{z}")];
        match k {
            0 => new[1].push_str(" M8"),
            1 => new.insert(1, "(ACROSS)".to_owned()),
            _ => {}
        }
        // All numbers have a decimal point on this control.
        let word = |w: &str| {
            if w.contains('.') || w.starts_with(['G', 'N', 'M', '(']) { w.to_owned() } else { format!("{w}.") }
        };
        let new = new.iter().map(|l| l.split(' ').map(word).collect::<Vec<_>>().join(" "));
        lines.splice(own[0] - 1..own[own.len() - 1], new);
    }
    lines.join("\r\n") + "\r\n"
}

/// The text without these ranges of lines, comments aside.
fn without(text: &str, ranges: impl Iterator<Item = [u32; 2]>) -> String {
    let ranges: Vec<[u32; 2]> = ranges.collect();
    let is_in = |line: u32| ranges.iter().any(|[first, last]| (*first..=*last).contains(&line));
    let numbered = text.split_inclusive('\n').zip(1..);
    numbered.filter(|(l, n)| l.starts_with('(') || !is_in(*n)).map(|(l, _)| l).collect()
}

#[test]
fn links_far_above_a_sculptured_surface_come_down_to_its_stock() {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = variant(&[(&format!("{planes}/from_mm"), json!(-2.2)), (&format!("{planes}/to_mm"), json!(2.2))]);
    let planned = job.plan();
    let name = planned.files.iter().find(|(n, _)| n.ends_with(".nc")).unwrap().0.clone();
    let old = with_far_links(&text_of(&planned, &name));
    let made = faster(&job, Dialect::Fanuc, &old).unwrap_or_else(|e| panic!("{e}"));
    let (file, new) = (&made.file, String::from_utf8(made.text.clone()).unwrap());
    println!("{}", file.table());
    let schema = serde_json::from_str(&facemill::file_format::schema::<RapidsFile>()).unwrap();
    let reports = serde_json::from_str(&facemill::file_format::to_json(file)).unwrap();
    assert!(jsonschema::validator_for(&schema).unwrap().is_valid(&reports));
    assert_eq!(file.findings, [0, 0], "{:?}", made.verification.verification.findings);

    // Every link is there; the first one says more than places.
    let (before, after) = (links(&old), links(&new));
    assert!(before.len() > 2);
    assert!(file.links.len() == before.len() && before.len() == after.len() && file.changed == before.len() - 1);
    let held = file.links[0].kept_text().unwrap();
    assert!(held.starts_with(&format!("line {}: says", file.links[0].lines[0] + 1)), "{held}");
    for (k, link) in file.links.iter().enumerate() {
        assert_eq!(link.way == RetractStrategy::Original, k == 0);
        assert!(link.lower_bound_s <= link.time_after_s + 1e-9 && link.time_after_s <= link.time_before_s, "{link:?}");
        assert_eq!(link.lines.map(|l| l as usize), [before[k].0[0], *before[k].0.last().unwrap()]);
        assert_eq!(before[k].1, after[k].1, "where it ends");
    }
    let sum = |time: fn(&facemill::rapids::LinkReport) -> f64| file.links.iter().map(time).sum::<f64>();
    assert_eq!([sum(|l| l.time_before_s), sum(|l| l.time_after_s)], [file.time_before_s, file.time_after_s]);

    // Nothing else is another byte.
    let kept =
        [without(&old, file.links.iter().map(|l| l.lines)), without(&new, file.links.iter().map(|l| l.new_lines))];
    assert_eq!(kept[0], kept[1]);
    assert!(new.lines().count() == new.matches("\r\n").count() && new.contains("(ACROSS)"));

    // The tip stays well below the old height. Cutter and bodies keep from the part what they keep
    // from stock, that is as thick as it was or cut: a third of 5 mm for every 10 mm that they are
    // away from both ends.
    let kit = ReadBack::of(&job, 0);
    let thickness = kit.grounds.iter().map(|g| g.thickness).fold(0.0, f64::max);
    let motions = interpreter::run(&new);
    let ends = interpreter::run(&old);
    let highest = ends.iter().filter(|m| m.rapid && m.to.z == FAR).map(|m| kit.end(m).0.z);
    let old_height = highest.fold(f64::INFINITY, f64::min);
    for (lines, _) in &after[1..] {
        let own = motions.iter().filter(|m| lines.contains(&m.line));
        let places: Vec<_> = own.flat_map(|m| kit.places(m, 2.0)).collect();
        let (first, last) = (places[0].0, places[places.len() - 1].0);
        for place in &places {
            assert!(place.0.z < 0.6 * old_height, "{place:?}");
            assert_eq!(kit.depth(place), 0.0);
            let away = (place.0 - first).norm().min((place.0 - last).norm());
            let kept = 5.0 / 3.0 * (away / 10.0).floor().min(3.0);
            assert!(kit.distance(place, 6.0) > kept - thickness, "{place:?}");
        }
    }
}

/// Two ways above the patch at feed, and a link high above them.
fn two_ways(head: &str, across: &str) -> String {
    format!(
        "%\nO1\n{head}\nT1 M6\nS6000 M3\nG0 G43 X-30. Y0. Z440. B0. C0. H1\nG0 Z330.\nG1 X30. F1000.\n{across}G1 X30.\nG0 Z440.\n\
         M30\n%\n"
    )
}

#[test]
fn a_link_with_nothing_in_the_way_is_one_block_and_is_so_again() {
    let job = tiny_patch();
    let head = "G21 G90 G94 G49";
    let old = two_ways(head, "G0 Z440.\nN70 X-30. Y5. B2.5 C-12.\nZ330.\n");
    let made = faster(&job, Dialect::Fanuc, &old).unwrap_or_else(|e| panic!("{e}"));
    let direct = two_ways(head, "G0 X-30. Y5. B2.5 C-12.\n");
    assert_eq!(String::from_utf8(made.text).unwrap(), direct);
    let [link] = &made.file.links[..] else { panic!() };
    assert!(link.way == RetractStrategy::Direct && link.time_after_s >= link.lower_bound_s && link.lines == [9, 11]);
    let again = faster(&job, Dialect::Fanuc, &direct).unwrap_or_else(|e| panic!("{e}"));
    assert!(again.text == direct.as_bytes() && again.file.changed == 0);
    assert_eq!(again.file.time_before_s, link.time_after_s);

    // The same with words of the tip.
    let tip = |across: &str| two_ways(head, across).replace("G43 ", "G43.4 ");
    let made =
        faster(&job, Dialect::Fanuc, &tip("G0 Z440.\nX-30. Y5. B2.5 C-12.\nZ330.\n")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(String::from_utf8(made.text).unwrap(), tip("G0 X-30. Y5. B2.5 C-12.\n"));

    // On another control.
    let siemens = |across: &str| {
        format!(
            "G54 G71 G90 G94\nT1 M6\nS6000 M3\nG0 D1 X-30 Y0 Z440 B0 C0\nG0 Z330\nG1 X30 F1000\n{across}G1 X30\nG0 Z440\nM30\n"
        )
    };
    let old = siemens("G0 Z440\nN70 X=-30 Y5 B2.5 C-12\nZ330\n");
    let made = faster(&job, Dialect::Siemens840d, &old).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(String::from_utf8(made.text).unwrap(), siemens("G0 X-30. Y5. B2.5 C-12.\n"));

    // The same where the control keeps the tip on a line at rapid rate, too.
    job.set("machine.json", &[("/motion/cutting", json!("tip_and_rotaries_linear"))]);
    let tip = |across: &str| siemens(across).replace("G0 D1 X", "TRAORI\nORIAXES\nG0 D1 X");
    let old = tip("G0 Z440\nN70 X=-30 Y5 B2.5 C-12\nZ330\n");
    let made = faster(&job, Dialect::Siemens840d, &old).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(String::from_utf8(made.text).unwrap(), tip("G0 X-30. Y5. B2.5 C-12.\n"));
    let link = &made.file.links[0];
    assert!(link.lower_bound_s <= link.time_after_s + 1e-9 && link.time_after_s < link.time_before_s, "{link:?}");

    // Words that are more than places stay, and are reported.
    for (across, why) in [
        ("G0 Z440.\nG91 X-60. Y5.\nG90 Z330.\n", "line 10: `G91`"),
        ("G0 Z440.\n/X-30. Y5.\nZ330.\n", "line 10: the positions of the axes are unknown: block that may be skipped"),
        ("G0 Z440. F500.\nX-30. Y5.\nZ330.\n", "line 9: `F500.`"),
        ("M98 P7\nG0 X30. Y0. Z440. B0. C0.\nX-30. Y5.\nZ330.\n", "line 9: the positions of the axes are unknown"),
    ] {
        let old = two_ways(head, across);
        let made = faster(&job, Dialect::Fanuc, &old).unwrap_or_else(|e| panic!("{e}"));
        assert!(made.text == old.as_bytes() && made.file.changed == 0);
        let reports = made.file.links[0].kept_text().unwrap();
        assert!(reports.contains(why), "{reports}");
    }
}

#[test]
fn programs_that_are_not_understood_are_refused_with_their_line() {
    let job = tiny_patch();
    let refused = |dialect, text: &str| faster(&job, dialect, text).unwrap_err().to_string();
    assert!(refused(Dialect::Fanuc, "G0 X1.\nG1 X2.5.2\n").contains("line 2"));
    assert!(refused(Dialect::Heidenhain, "0 BEGIN PGM A MM\n1 L X+1 R9 FMAX\n").contains("line 2"));
}
