//! Differences of dialects, their refusals, and their files.

use facemill_cl_data::{CuttingLaw, MotionLaw, RapidLaw};
use facemill_nc_program::dialect::{Decimals, DialectFile, Orientation, PostFile, Template};
use facemill_nc_program::*;

use crate::dialects::{home, law, on_machine, write};
use crate::kit::{AXES, Random, random_blocks, spec, words};

#[test]
fn dialect_files_say_what_the_types_say_and_nothing_else() {
    for dialect in Dialect::ALL {
        let file = dialect.file();
        assert!(file.check().is_ok(), "{dialect:?}");
        let again: DialectFile =
            facemill_file_format::from_json(facemill_file_format::to_json(&file).as_bytes()).unwrap();
        assert_eq!(file, again);
        let name = facemill_file_format::to_json(&dialect);
        assert_eq!(name.trim(), format!("\"{}\"", dialect.name()));
    }
    let error = |text: &str| facemill_file_format::from_json::<DialectFile>(text.as_bytes()).unwrap_err().to_string();
    let source = Dialect::Fanuc.source();
    assert!(error(&source.replace("\"rapid\":", "\"rapit\":")).contains("did you mean `rapid`?"));
    let check = |from: &str, to: &str| {
        assert!(source.contains(from), "{from}");
        let file: DialectFile = facemill_file_format::from_json(source.replace(from, to).as_bytes()).unwrap();
        file.check().unwrap_err().to_string()
    };
    let message = check("T{number} M6", "T{nmber} M6");
    assert_eq!(message, "dialect file, words.tool_change: `T{nmber} M6` holds {nmber}; known there: {number}");
    assert!(check("\"end\": \"H{register}\"", "\"end\": \"H{length}\"").contains("holds {length}"));
    assert!(check("facemill-dialect/1", "facemill-dialect/2").contains("format"));
    assert!(check("\"max_length\": 500", "\"max_length\": 5").contains("lines.max_length"));
    // Corners on the lines need a distance, and the limit of acceleration.
    let corners = |to: &str| check("\"corners\": \"spline\"", to);
    let message = corners("\"corners\": \"junction_deviation\"");
    assert!(
        message.starts_with("dialect file, control_motion.junction_deviation_um: is 0: it must be from 1"),
        "{message}"
    );
    let message = corners("\"corners\": \"spline\", \"junction_deviation_um\": 10");
    assert!(message.starts_with("dialect file, control_motion.junction_deviation_um: is 10: it must be"), "{message}");
    let message = corners("\"corners\": \"junction_deviation\", \"junction_deviation_um\": 10");
    assert!(message.starts_with("dialect file, control_motion.limited_by: is modelled as"), "{message}");
    let message = corners("\"corners\": \"spline\", \"small_segments_mm\": 1");
    assert!(message.starts_with("dialect file, control_motion.small_segments_mm: is 1: it must be"), "{message}");
    let message = corners("\"corners\": \"junction_deviation\", \"junction_deviation_um\": 10, \"cycle_us\": 5");
    assert!(message.starts_with("dialect file, control_motion.cycle_us: is 5: it must be 0"), "{message}");
    let message = check(
        "\"look_ahead_blocks\": 200,\n    \"rotary_blocks\": \"looked_ahead\",\n    \"corners\": \"spline\"",
        "\"look_ahead_blocks\": 10001, \"rotary_blocks\": \"looked_ahead\", \"corners\": \"junction_deviation\", \
         \"junction_deviation_um\": 10",
    );
    assert!(message.starts_with("dialect file, control_motion.look_ahead_blocks: is 10001: it must be"), "{message}");
}

#[test]
fn a_control_that_does_not_move_as_the_machine_says_is_refused() {
    let post = PostFile { dialect: Dialect::Haas, feed_mode: FeedMode::Rtcp, ..PostFile::default() };
    let turned = MotionLaw { cutting: CuttingLaw::TipLinearVectorTurned, ..law(0.0) };
    let error = post.settings(None).unwrap().on_machine(turned, home()).unwrap_err().to_string();
    assert!(error.contains("motion.cutting: tip_linear_vector_turned") && error.contains("Haas"), "{error}");
    // Without RTCP the axes go linearly whatever the machine says of RTCP.
    let joints = PostFile { feed_mode: FeedMode::G93, ..post.clone() }.settings(None).unwrap();
    assert_eq!(joints.on_machine(turned, home()).unwrap().cutting_law(), CuttingLaw::AxesLinear);
    assert_eq!(on_machine(&post).cutting_law(), CuttingLaw::TipAndRotariesLinear);
    let vectors = PostFile { orientation: Orientation::Vectors, ..post.clone() };
    assert!(vectors.settings(None).unwrap_err().to_string().starts_with("orientation: Haas has no tool vectors"));
    let look_ahead = PostFile { look_ahead: true, ..post };
    assert!(look_ahead.settings(None).unwrap_err().to_string().starts_with("look_ahead: Haas has no switch"));
}

/// Haas and Mazak are a file and a template each: what they say otherwise than FANUC.
#[test]
fn haas_and_mazak_are_fanuc_with_other_words() {
    let spec = spec(random_blocks(&mut Random(37), 10));
    let text = |dialect, feed_mode, look_ahead| {
        let post = PostFile { dialect, feed_mode, look_ahead, ..PostFile::default() };
        write(&spec, &post).text
    };
    let haas = text(Dialect::Haas, FeedMode::Rtcp, false);
    assert!(haas.starts_with("%\nO01001 ("), "{haas}");
    for line in ["G0 G90 G234 X11. Y12. Z13. H7\n", "IF [ABS[#2007+#2207-420.000] LE 0.01] GOTO 9001\n"] {
        assert!(haas.contains(line), "{line} in\n{haas}");
    }
    // The machine file's tolerance, rounded down.
    assert!(haas.contains("G187 E0.0100\n") && haas.contains("G187\n"), "{haas}");
    let mazak = text(Dialect::Mazak, FeedMode::Rtcp, true);
    for line in ["G61.1\n", "G5 P2\n", "G5 P0\n", "G64\n", "G0 G90 G43.4 X11. Y12. Z13. H7\n"] {
        assert!(mazak.contains(line), "{line} in\n{mazak}");
    }
    let body = |text: &str| {
        let body = text.split_once("G90 G94 G0").unwrap().1.split_once(" M9\n").unwrap().0.to_owned();
        let code = |l: &str| l.split_once(' ').filter(|(n, _)| n.starts_with('N')).map_or(l, |(_, c)| c).to_owned();
        body.lines().map(code).filter(|l| !l.starts_with("G187")).take(9).collect::<Vec<_>>()
    };
    let fanuc = text(Dialect::Fanuc, FeedMode::G94, false);
    for dialect in [Dialect::Haas, Dialect::Mazak] {
        assert_eq!(body(&text(dialect, FeedMode::G94, false)), body(&fanuc));
    }
    assert!(text(Dialect::Fanuc, FeedMode::G94, true).contains("G5.1 Q1\n"));
}

#[test]
fn what_a_control_has_no_word_for_is_refused_by_its_name() {
    let post = PostFile { dialect: Dialect::Haas, ..PostFile::default() };
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let refused = |change: &dyn Fn(&mut ProgramSpec)| {
        let mut spec = spec(vec![first.clone()]);
        change(&mut spec);
        write_program(&spec, &on_machine(&post)).unwrap_err().to_string()
    };
    let mist = refused(&|s| s.coolant = Coolant::Mist);
    assert_eq!(mist, "coolant: Haas has no word for this: mist coolant");
    let offset = refused(&|s| s.work_offset = WorkOffset::new(106).unwrap());
    assert_eq!(offset, "work_offset: Haas has no word for this: work offset 106");
    let far = ProgramSpec { work_offset: WorkOffset::new(105).unwrap(), ..spec(vec![first.clone()]) };
    assert!(write(&far, &post).text.contains(" G154 P99\n"));
    let block = refused(&|s| s.program.blocks.push(Block::Coolant(Coolant::Mist)));
    assert!(block.starts_with("block 1: Haas has no word"), "{block}");
    let second = "X2".parse().unwrap();
    let axis = AxisSpec { letter: second, min: 0.0, max: 1.0, along_spindle: false, work_offset: 0.0 };
    assert!(refused(&|s| s.axes.push(axis)).starts_with("axis X2: Haas has no word"));
    let number = PostFile { program_number: 100_000, ..post.clone() };
    assert_eq!(number.settings(None).unwrap_err().to_string(), "program_number is 100000: it must be from 1 to 99999");
    let decimals = PostFile { decimals: Decimals { linear: 5, ..Decimals::default() }, ..post.clone() };
    assert!(decimals.settings(None).unwrap_err().to_string().starts_with("decimals.linear is 5"));
}

#[test]
fn linuxcnc_keeps_joints_without_rtcp_and_switches_kinematics_with_it() {
    let spec = spec(random_blocks(&mut Random(38), 10));
    let post = PostFile { dialect: Dialect::LinuxCnc, feed_mode: FeedMode::G93, ..PostFile::default() };
    let text = write(&spec, &post).text;
    assert!(!text.contains("M428") && !text.contains("M429") && text.contains("G64 P0.0100 Q0.0001\n"), "{text}");
    assert!(text.contains("G53 G0 Z1500.\n") && text.ends_with("M2\n"), "{text}");
    let exact = post.settings(None).unwrap().on_machine(law(0.0), home()).unwrap();
    let exact = write_program(&spec, &exact).unwrap();
    assert!(exact.contains("G61\n") && !exact.contains("G64"), "{exact}");
    let rtcp = write(&spec, &PostFile { feed_mode: FeedMode::Rtcp, ..post.clone() }).text;
    let mut rest = rtcp.as_str();
    for line in [
        "M429\n",
        "G53 G0 Z1500.\n",
        "G43 H7\n",
        "G0 G90 B14. C15.\n",
        "M428\n",
        "G0 G90 X11. Y12. Z13.\n",
        "M429\n",
        "G53 G0 Z1500.\n",
        "G49\n",
        "G53 G0 X0. Y0.\n",
        "G53 G0 B0. C0.\n",
    ] {
        rest = rest.split_once(line).unwrap_or_else(|| panic!("{line} in\n{rtcp}")).1;
    }
    let g94 = PostFile { feed_mode: FeedMode::G94, ..post.clone() }.settings(None).unwrap_err().to_string();
    assert!(g94.starts_with("feed_mode: LinuxCNC has no g94") && g94.ends_with("take g93"), "{g94}");
    let per_axis = MotionLaw { rapid: RapidLaw::PerAxis, ..law(0.0) };
    let error = post.settings(None).unwrap().on_machine(per_axis, home()).unwrap_err().to_string();
    assert!(error.contains("motion.rapid: per_axis; it does linear"), "{error}");
    // Without the machine nobody knows where home is.
    let error = write_program(&spec, &post.settings(None).unwrap()).unwrap_err().to_string();
    assert!(error.contains("linuxcnc.j2"), "{error}");
    let dwell = ProgramSpec {
        program: NcProgram { blocks: vec![spec.program.blocks[0].clone(), Block::Dwell { seconds: 1.5 }] },
        ..spec
    };
    assert!(write(&dwell, &post).text.contains("G4 P1.500\n"));
}

/// A control of a shop's own: a file and a template, and no line of code.
#[test]
fn a_dialect_of_ones_own_needs_a_file_and_a_template() {
    let source = Dialect::Fanuc.source().replace("\"name\": \"FANUC\"", "\"name\": \"Shop\"");
    let source = source.replace("G43.4", "G43.9").replace("\"M8\"", "\"M88\"").replace("\"G1\"", "\"G01\"");
    let file: DialectFile = facemill_file_format::from_json(source.as_bytes()).unwrap();
    let text = "%\nO{{ program.padded }}\nT{{ tool.number }} M6\n{{ rtcp.before|length }} {{ coolant.code }}\n{{ body }}\nM30\n";
    let template = Template { name: "shop.j2".to_owned(), text: text.to_owned() };
    let post = PostFile { feed_mode: FeedMode::Rtcp, block_numbers: None, ..PostFile::default() };
    let settings = post.settings_of(file.clone(), template.clone()).unwrap();
    let first = Block::Rapid { words: words(&AXES.map(|l| (l, 0.0))) };
    let cut = Block::Linear { words: words(&[(AxisLetter::X, 2.5)]), feed: 100.0 };
    let on = Block::LengthCompensation { register: 4, length: 50.0, words: words(&[(AxisLetter::Z, 9.0)]) };
    let program = write_program(&spec(vec![first, cut, on, Block::Coolant(Coolant::Flood)]), &settings).unwrap();
    let expected = "%\nO1001\nT7 M6\n0 M88\nG90 G94 G0 X0. Y0. Z0. B0. C0.\nG01 X2.5 F100.\n(TOOL LENGTH 50.000)\n\
                    G0 G43.9 Z9. H4\nM88\nM30\n";
    assert_eq!(program, expected);
    let wrong = DialectFile { format: "other/1".to_owned(), ..file };
    assert!(post.settings_of(wrong, template).unwrap_err().to_string().starts_with("dialect file, format: must be"));
}

/// M functions that move, call, jump, or change tool, state, offsets or kinematics on the control,
/// or give a signal to what the shop has wired to it.
const NEVER_HARMLESS: [(Dialect, &[u32]); 6] = [
    (Dialect::Fanuc, &[6, 10, 11, 19, 21, 29, 60, 61, 96, 97, 98, 99, 198]),
    (Dialect::Mazak, &[6, 10, 11, 19, 21, 29, 60, 61, 96, 97, 98, 99, 198]),
    (
        Dialect::Haas,
        &[6, 16, 19, 21, 22, 28, 29, 36, 39, 46, 50, 51, 58, 61, 68, 75, 78, 79, 82, 86, 96, 97, 98, 99, 109, 198],
    ),
    (Dialect::LinuxCnc, &[6, 19, 60, 61, 62, 63, 64, 65, 67, 68, 72, 73, 98, 99, 100, 128, 199, 428, 429]),
    (Dialect::Siemens840d, &[6, 10, 17, 19, 20, 70, 96, 97, 98, 99]),
    (
        Dialect::Heidenhain,
        &[
            6, 19, 89, 90, 91, 92, 94, 97, 98, 99, 101, 103, 107, 109, 112, 114, 116, 118, 120, 124, 126, 128, 129,
            130, 134, 136, 138, 140, 141, 143, 144, 148, 197, 200,
        ],
    ),
];

#[test]
fn no_dialect_file_calls_a_function_harmless_that_moves_calls_or_changes_something() {
    for (dialect, codes) in NEVER_HARMLESS {
        let harmless = dialect.file().harmless_functions;
        let wrong: Vec<_> = codes.iter().filter(|code| harmless.contains(code)).collect();
        assert!(wrong.is_empty(), "{dialect:?}: {wrong:?}");
    }
}
