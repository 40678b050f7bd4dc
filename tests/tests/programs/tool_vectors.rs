//! Programs that name the tool's axis, and the surface's normal, as vectors; and a shop's own
//! dialect file.

use facemill::feeds::{FeedLaw, FeedRewriteSettings, TipFeed};
use facemill::inverse_kinematics::{AxisValues, Machine};
use facemill::nc_program::Dialect;
use facemill::surface_model::{Surface, SurfaceSettings};
use facemill::virtual_machine::FindingKind;
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_setup, rewrite_feeds, summary};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::variants::{CUTTING, variant, write_patch};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde_json::{Value, json};

const OFFSET: [f64; 3] = [41.5, -27.0, 260.0];

/// A shop's own file for a dialect, with rapids under RTCP that go as the machine file says, and
/// further changes.
fn own_dialect(job: &JobFolder, dialect: &str, changes: &[(&str, Value)]) {
    let file = format!("crates/nc-program/dialects/{dialect}.json");
    let file = std::fs::read(facemill_tests::shared::workspace().join(file)).unwrap();
    job.write("shop.json", &file).set("shop.json", &[("/motion/rtcp/rapids", json!("by_setting"))]);
    job.set("shop.json", changes);
}

/// A small job under an offset that is neither the table's frame nor the workpiece's, with vectors.
fn with_vectors(dialect: &str, cutting: &str) -> JobFolder {
    let post = json!({
        "dialect": dialect, "dialect_file": "shop.json", "feed_mode": "rtcp", "orientation": "vectors"
    });
    let offset = json!({ "linear_mm": { "X": OFFSET[0], "Y": OFFSET[1], "Z": OFFSET[2] } });
    let job = variant(&[("/post", post), ("/setups/0/work_offset", offset), ("/feeds_within", json!("velocity"))]);
    let tolerance = json!({ "path_mm": 0.005, "orientation_deg": 0.001 });
    let motion = json!({ "cutting": cutting, "rapid": "linear", "control_tolerance": tolerance });
    job.set("machine.json", &[("/motion", motion)]);
    own_dialect(&job, dialect, &[]);
    job
}

fn plan(job: &JobFolder, certificates: bool) -> Planned {
    let job = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    plan_setup(&job, 0, PlanSettings { verify: true, certificates }, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

/// Text of the file with this ending.
fn text_with(planned: &Planned, ending: &str) -> String {
    let mut names = planned.files.iter().map(|(name, _)| name);
    text_of(planned, names.find(|name| name.ends_with(ending)).unwrap())
}

/// A pose of the plan in the frame of the words, from the APT file.
fn planned_poses(job: &JobFolder, planned: &Planned) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let words_from_work = words_from_work(job);
    // A statement goes on behind `$`.
    let text = text_with(planned, ".apt").replace("$\n", "");
    let all = text.lines().filter_map(|l| l.strip_prefix("GOTO/"));
    all.map(|line| {
        let n: Vec<f64> = line.split(',').map(|n| n.trim().parse().unwrap()).collect();
        (words_from_work * Point3::new(n[0], n[1], n[2]), words_from_work * Vector3::new(n[3], n[4], n[5]))
    })
    .collect()
}

/// From where the axes are at the work offset, and where the job puts the workpiece.
fn words_from_work(job: &JobFolder) -> Isometry3<f64> {
    let machine = Machine::from_json(&std::fs::read(job.path("machine.json")).unwrap()).unwrap();
    let mut offset = AxisValues::zeros(5);
    for (letter, value) in ["X", "Y", "Z"].into_iter().zip(OFFSET) {
        offset[machine.axis_index(letter).unwrap()] = value;
    }
    let table_from_words = machine.work_coordinates(&offset).unwrap();
    let pose = &job.json("job.json")["setups"][0]["table_from_work"];
    let three = |v: &Value| [0, 1, 2].map(|k| v[k].as_f64().unwrap_or(0.0));
    let axis = Unit::try_new(Vector3::from(three(&pose["rotation_axis"])), 0.0).unwrap_or_else(Vector3::z_axis);
    let angle = pose["rotation_deg"].as_f64().unwrap_or(0.0).to_radians();
    let turn = UnitQuaternion::from_axis_angle(&axis, angle);
    let table_from_work = Isometry3::from_parts(Translation3::from(three(&pose["translation_mm"])), turn);
    table_from_words.inverse() * table_from_work
}

/// Content of a motion line, with remembered words.
#[derive(Clone, Debug, Default)]
struct MotionLine {
    tip: [f64; 3],
    /// `None` where rotary words say it.
    axis: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
    feed: f64,
    is_rapid: bool,
}

/// Motion lines between the first rapid of the body and the end of the coolant, read word by word.
fn motion_lines(text: &str, tool: [&str; 3]) -> Vec<MotionLine> {
    let mut at = MotionLine::default();
    let mut all = Vec::new();
    let is_first = |l: &&str| {
        let has = |w: &str| l.split(' ').any(|x| x.starts_with(w));
        !l.contains(';') && has("X") && has("Y") && has("Z") && (has("B") || has("C"))
    };
    let body = text.lines().skip_while(|l| !is_first(l)).take_while(|l| !l.ends_with(" M9"));
    for line in body.filter(|l| !l.contains(';')) {
        let mut is_motion = false;
        (at.is_rapid, at.normal) = (at.is_rapid && !line.contains("LN "), None);
        for word in line.split(' ') {
            let number = |name: &str| word.strip_prefix(name).and_then(|v| v.parse::<f64>().ok());
            match word {
                "G0" | "FMAX" => at.is_rapid = true,
                "G1" => at.is_rapid = false,
                _ => {}
            }
            for k in 0..3 {
                if let Some(v) = number(["X", "Y", "Z"][k]) {
                    (at.tip[k], is_motion) = (v, true);
                }
                if let Some(v) = number(tool[k]) {
                    at.axis.get_or_insert_default()[k] = v;
                    is_motion = true;
                }
                if let Some(v) = number(["NX", "NY", "NZ"][k]) {
                    at.normal.get_or_insert_default()[k] = v;
                }
            }
            if number("B").or(number("C")).is_some() {
                (at.axis, is_motion) = (None, true);
            }
            if let Some(feed) = number("F") {
                (at.feed, at.is_rapid) = (feed, false);
            }
        }
        if is_motion {
            all.push(at.clone());
        }
    }
    all
}

/// Every line is its pose of the plan: the tip to the decimals of the words, the axis to those of
/// the vector.
fn check_poses(job: &JobFolder, planned: &Planned, lines: &[MotionLine]) {
    let poses = planned_poses(job, planned);
    assert_eq!(lines.len(), poses.len());
    let mut n = 0;
    for (line, (tip, axis)) in lines.iter().zip(&poses) {
        assert!((Point3::from(line.tip) - tip).amax() < 0.6e-3, "{line:?} {tip}");
        // The APT file has its own decimals.
        if let Some(found) = line.axis {
            assert!((Vector3::from(found) - axis).amax() < 2e-6, "{line:?} {axis}");
        }
        assert!(!line.is_rapid || line.axis.is_none(), "{line:?}");
        n += usize::from(line.axis.is_some());
    }
    let cuts = lines.iter().filter(|l| !l.is_rapid).count();
    assert!(n == cuts && n > 300, "{n} vectors in {cuts} feed blocks");
}

#[test]
fn siemens_vectors_are_the_planned_poses_and_are_verified_and_proven() {
    let job = with_vectors("siemens_840d", "tip_linear_vector_turned");
    let planned = plan(&job, true);
    assert!(planned.is_clean() && planned.report.verified, "{:?}", planned.report.findings);
    assert!(planned.report.findings.is_empty(), "{:?}", planned.report.findings);
    let text = text_of(&planned, "program.mpf");
    assert!(text.contains("ORIWKS ORIVECT") && text.contains("FGROUP(X,Y,Z)"));
    check_poses(&job, &planned, &motion_lines(&text, ["A3=", "B3=", "C3="]));
    let certificates: Value = serde_json::from_str(&text_of(&planned, "certificates.json")).unwrap();
    assert!(certificates["blocks"].as_u64().unwrap() > 300);
    assert_eq!(certificates["blocks"], certificates["certified"]);
}

#[test]
fn heidenhain_says_the_planned_poses_with_the_normals_of_the_surface() {
    let job = with_vectors("heidenhain", "tip_and_rotaries_linear");
    let planned = plan(&job, false);
    // Among others no normal that is not the surface's.
    assert!(planned.is_clean() && planned.report.verified, "{:?}", planned.report.findings);
    let lines = motion_lines(&text_with(&planned, ".h"), ["TX", "TY", "TZ"]);
    check_poses(&job, &planned, &lines);
    // A tip, its axis and the normal lead to a point of the surface that has this normal.
    let mesh = facemill::read_mesh(&job.path("patch.obj"), None, None).unwrap().mesh;
    let surface = Surface::new(mesh, SurfaceSettings::default());
    let tool = job.json("tool.json");
    let [radius, corner] = ["radius_mm", "corner_radius_mm"].map(|key| tool[key].as_f64().unwrap());
    let work_from_words = words_from_work(&job).inverse();
    let mut n = 0;
    for line in lines.iter().filter(|l| l.feed == CUTTING && l.axis.is_some() && !l.is_rapid) {
        let axis = Vector3::from(line.axis.unwrap());
        let normal = Vector3::from(line.normal.unwrap());
        assert!((axis.norm() - 1.0).abs() < 1e-6 && (normal.norm() - 1.0).abs() < 1e-6);
        let across = (axis * axis.dot(&normal) - normal).normalize();
        let contact = Point3::from(line.tip) + axis * corner + across * (radius - corner) - normal * corner;
        let found = surface.closest_point(&(work_from_words * contact), 10.0).unwrap();
        assert!(found.distance < 0.05, "{line:?}: {} mm off", found.distance);
        n += 1;
    }
    assert!(n > 100, "{n}");
}

/// A job for FANUC with a dialect file of its own.
fn with_shop_file(changes: &[(&str, Value)]) -> JobFolder {
    let job = variant(&[("/post/dialect", json!("fanuc")), ("/post/dialect_file", json!("shop.json"))]);
    own_dialect(&job, "fanuc", changes);
    job
}

#[test]
fn a_shop_changes_what_programs_look_like_in_a_file_of_its_own() {
    let built_in = variant(&[]);
    let own = with_shop_file(&[
        ("/program/extension", json!("eia")),
        ("/words/rapid", json!("G00")),
        ("/words/linear", json!("G01")),
        ("/words/absolute", json!("G90 G17 G40 G64")),
        ("/comments/characters", json!("+-/=.")),
    ]);
    let [built_in, own] = [&built_in, &own].map(|job| plan(job, false));
    assert!(own.is_clean() && own.report.verified && own.report.findings.is_empty(), "{:?}", own.report.findings);
    let [before, after] = [text_of(&built_in, "program.nc"), text_of(&own, "program.eia")];
    let count = |text: &str, word: &str| text.split_whitespace().filter(|w| *w == word).count();
    assert!(count(&before, "G1") > 5 && count(&before, "G01") == 0);
    assert_eq!((count(&after, "G01"), count(&after, "G1")), (count(&before, "G1"), 0));
    let motions = |text: &str| -> Vec<String> {
        let words = text.lines().filter(|l| l.contains('X') && !l.contains('(')).flat_map(str::split_whitespace);
        words.filter(|w| !w.starts_with(['G', 'N'])).map(str::to_owned).collect()
    };
    assert_eq!(motions(&before), motions(&after));
}

#[test]
fn a_dialect_file_that_is_not_read_as_it_is_meant_is_refused_before_planning() {
    for (changes, wanted) in [
        (
            ("/words/linear", json!("G0")),
            &["post.dialect_file: shop.json", "should be a feed move with F432.5 of g94"][..],
        ),
        (("/words/linear", json!("G1 &")), &["post.dialect_file: shop.json", "line"]),
        (("/words/rapid", json!("G1")), &["should be a rapid"]),
        (("/words/coolant/flood", json!("M52")), &["should be the coolant's word"]),
        (("/words/spindle_on", json!(["S{rpm} M4"])), &["should be the start of the spindle"]),
        (("/words/absolute", json!("G91")), &["should be"]),
        (("/words/rapidd", json!("G0")), &["shop.json", "rapidd", "rapid"]),
        (("/program/extension", json!("apt")), &["shop.json", "program.extension"]),
        (("/lines/max_length", json!(7)), &["shop.json", "lines.max_length"]),
        (("/feeds/g94", Value::Null), &["post.feed_mode", "g94"]),
        // Additions of a key to every block, and to the first alone.
        (
            ("/words/linear_end", json!("S100")),
            &["shop.json, words.linear_end: `S100`", "S100 F432.5`", "post.template"],
        ),
        (("/words/linear_end", json!("M0")), &["shop.json, words.linear_end: `M0`"]),
        (("/words/coolant/flood", json!("M8 S100")), &["shop.json, words.coolant.flood: `M8 S100`", "a switch"]),
        (("/words/spindle_on", json!(["S{rpm} {code} M8"])), &["shop.json, words.spindle_on", "a switch"]),
        (("/words/linear_end", json!("M9")), &["shop.json, words.linear_end: `M9`"]),
        (("/words/linear_end", json!("D1")), &["shop.json, words.linear_end: `D1`"]),
        (("/words/linear_end", json!("G9")), &["shop.json, words.linear_end: `G9`"]),
        (("/words/rapid", json!("G0 M5")), &["shop.json, words.rapid: `G0 M5`"]),
        (("/words/absolute", json!("G90 M9")), &["shop.json, words.absolute: `G90 M9`"]),
        (("/words/absolute", json!("G90 G49")), &["shop.json, words.absolute: `G90 G49`"]),
        (("/lines/max_length", json!(80)), &["post.max_line_length is 120", "lines.max_length of shop.json"]),
        // A key cannot change words of the template.
        (("/words/length/code", json!("G43.1")), &["shop.json, words.length: is `G43.1", "post.template"]),
        (("/words/end", json!(["M2"])), &["shop.json, words.end: is `M2`", "post.template"]),
    ] {
        let job = with_shop_file(std::slice::from_ref(&changes));
        // No pass is laid on it.
        write_patch(&job, 8);
        let reported = job.try_plan().err().unwrap_or_else(|| panic!("{changes:?}")).to_string();
        assert!(wanted.iter().all(|w| reported.contains(w)), "{changes:?}: {reported}");
    }
    // The same words in the files of other controls; for two keys that add one word the message
    // names the first.
    for (dialect, changes, wanted) in [
        ("heidenhain", &[("/words/rapid_end", json!("R0 FMAX M9"))][..], "words.rapid_end: `R0 FMAX M9`"),
        (
            "siemens_840d",
            &[("/words/rapid_end", json!("D1")), ("/words/linear_end", json!("D1"))],
            "words.rapid_end: `D1`",
        ),
    ] {
        let job = with_vectors(dialect, "tip_linear_vector_turned");
        job.set("shop.json", changes);
        let reported = job.try_plan().err().unwrap_or_else(|| panic!("{dialect}")).to_string();
        assert!(reported.contains(wanted), "{dialect}: {reported}");
    }
    // Neither the file of another control nor another word for RTCP is passed in silence.
    let foreign = variant(&[("/post/dialect_file", json!("shop.json"))]);
    own_dialect(&foreign, "siemens_840d", &[("/name", json!("our fanuc"))]);
    let reported = foreign.try_plan().err().unwrap().to_string();
    assert!(reported.contains("shop.json") && reported.contains("set post.dialect to siemens_840d"), "{reported}");
    let rtcp = with_shop_file(&[("/motion/rtcp/on/code", json!("G43"))]);
    rtcp.set("job.json", &[("/post/feed_mode", json!("rtcp"))]);
    let motion = json!({ "cutting": "tip_and_rotaries_linear", "rapid": "linear" });
    rtcp.set("machine.json", &[("/motion", motion)]);
    let reported = rtcp.try_plan().err().unwrap().to_string();
    assert!(reported.contains("motion.rtcp.on: is `G43 H{register}` in place of `G43.4"), "{reported}");
    let missing = variant(&[("/post/dialect_file", json!("none.json"))]).try_plan().err().unwrap().to_string();
    assert!(missing.contains("none.json"), "{missing}");
}

/// The control's motion with rounded vectors is the same where they are written and where they are
/// read: feeds that a plan has lowered to the speeds that the axes reach are not lowered again,
/// even where few decimals make a staircase of the vectors.
#[test]
fn feeds_of_a_plan_with_vectors_are_those_that_its_own_text_reaches() {
    let job = with_vectors("siemens_840d", "tip_linear_vector_turned");
    own_dialect(&job, "siemens_840d", &[("/numbers/vector_decimals", json!(3))]);
    job.set("job.json", &[("/feeds_within", json!("acceleration"))]);
    let tolerance = json!({ "path_mm": 0.01, "orientation_deg": 0.05 });
    job.set("machine.json", &[("/motion/control_tolerance", tolerance)]);
    let read = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    let planned = plan_unverified(&job);
    let law = planned.report.time_law.as_ref().unwrap();
    assert!(law.lowered_blocks > 20 && !law.stops_at_corners, "{law:?}");
    let text = text_with(&planned, ".mpf");
    let offset = ["X", "Y", "Z"].into_iter().zip(OFFSET);
    let settings = FeedRewriteSettings {
        machine: &read.machine,
        tool_length: read.tool.gauge_length(),
        tip_feed: TipFeed::Keep,
        work_offset: offset.map(|(axis, value)| (axis.to_owned(), value)).collect(),
        dialect: Dialect::Siemens840d,
        dialect_file: None,
        time_law: Some(FeedLaw::default()),
    };
    let rewritten = rewrite_feeds(text.as_bytes(), &settings).unwrap_or_else(|e| panic!("{e}"));
    let after = String::from_utf8(rewritten.text).unwrap();
    let [before, after] = [&text, &after].map(|text| motion_lines(text, ["A3=", "B3=", "C3="]));
    assert_eq!(before.len(), after.len());
    let pairs = before.iter().zip(&after).filter(|(line, _)| !line.is_rapid);
    let lowered: Vec<_> = pairs.filter(|(a, b)| (b.feed / a.feed - 1.0).abs() > 0.01).collect();
    assert!(lowered.is_empty(), "{} of {}, {:?}", lowered.len(), before.len(), lowered[0]);

    // The report gives the cost of the decimals: about as much as rotary words, which turn the axes
    // evenly, save.
    let reported = law.tool_vectors.unwrap();
    assert!(reported.decimals == 3 && (reported.turn_deg - 0.0496).abs() < 1e-4, "{reported:?}");
    assert!(summary(&planned.report).contains("tool vectors      of 3 decimals"), "{}", summary(&planned.report));
    job.set("job.json", &[("/post/orientation", json!("rotary"))]);
    let by_words = plan_unverified(&job).report.time_law.unwrap();
    assert_eq!(by_words.tool_vectors, None);
    let [cuts, by_words] = [law, &by_words].map(|law| law.passes_time_s + law.approach_time_s);
    let saved = cuts - by_words;
    assert!((saved - reported.added_time_s).abs() < 0.1 * saved, "{reported:?}, {cuts} s and {by_words} s");
}

fn plan_unverified(job: &JobFolder) -> Planned {
    let job = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    let settings = PlanSettings { verify: false, certificates: false };
    plan_setup(&job, 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

/// A template that forgets to switch RTCP off on the way home, and to end.
#[test]
fn a_template_that_leaves_rtcp_on_and_does_not_end_is_reported() {
    let template = Dialect::Fanuc.template().text;
    let (head, end) = template.rsplit_once("{% endif %}\nG49\n").unwrap();
    let own = format!("{head}{{% endif %}}\n{}", end.replace("M30\n", ""));
    let job = variant(&[("/post/feed_mode", json!("rtcp")), ("/post/template", json!("shop.j2"))]);
    job.write("shop.j2", own.as_bytes());
    let motion = json!({ "cutting": "tip_and_rotaries_linear", "rapid": "linear" });
    job.set("machine.json", &[("/motion", motion)]);
    let planned = plan(&job, false);
    let kinds: Vec<FindingKind> = planned.report.findings.iter().map(|f| f.kind).collect();
    assert_eq!(kinds, [FindingKind::RtcpLeftOn, FindingKind::RtcpLeftOn, FindingKind::NoEnd]);
    assert!(!planned.is_clean());
}

/// Under the machine's law the tool vector turns in a plane; a dialect that wants vectors in all
/// blocks cannot say what is near the pole.
#[test]
fn near_the_pole_rotary_words_stand_between_vectors_or_the_plan_is_refused() {
    // So slow that no axis races beside the pole: else the plan goes round it.
    let upright = [
        ("/operations/0/search/tilt_deg", json!([0.0, 20.0])),
        ("/operations/0/search/mode", json!("smallest")),
        ("/operations/0/feeds/cutting_mm_min", json!(20.0)),
    ];
    let job = with_vectors("siemens_840d", "tip_linear_vector_turned");
    job.set("job.json", &upright);
    let planned = plan(&job, false);
    // A choice that the planner takes for clear is so for the virtual machine, too.
    let open = planned.report.findings.iter().filter(|f| f.kind == FindingKind::UnknownPosition);
    assert_eq!(open.count(), 0, "{:?}", planned.report.findings);
    let text = text_with(&planned, ".mpf");
    let lines = motion_lines(&text, ["A3=", "B3=", "C3="]);
    let feeds: Vec<&MotionLine> = lines.iter().filter(|l| !l.is_rapid).collect();
    let with_words = feeds.iter().filter(|l| l.axis.is_none()).count();
    assert!(with_words > 0, "{} blocks", feeds.len());
    let nearest = feeds.iter().filter_map(|l| l.axis).map(|[x, y, _]| x.hypot(y)).fold(f64::INFINITY, f64::min);
    assert!(nearest >= facemill::inverse_kinematics::POLE_CONE.sin() - 1e-6, "{nearest}");
    job.set("shop.json", &[("/motion/rtcp/vectors/between_rotary_words", json!(false))]);
    let reported = job.try_plan().err().unwrap().to_string();
    assert!(
        reported.contains("operation \"") && reported.contains("at (") && reported.contains("post.orientation"),
        "{reported}"
    );
}
