//! Answers of a person in place of options.

use clap::Parser;

use facemill::inverse_kinematics::measured::AxisLimits;

use super::*;

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    arguments: NewMachineArguments,
}

fn given(options: &str) -> NewMachineArguments {
    Command::try_parse_from(std::iter::once("new").chain(options.split_whitespace())).expect("options").arguments
}

/// Asks with these lines as answers; returns the arguments and what was written to the terminal.
fn asked(options: &str, answers: &str) -> (Result<NewMachineArguments, String>, String) {
    let mut output = Vec::new();
    let asked = ask_missing(given(options), &mut answers.as_bytes(), &mut output);
    (asked.map_err(|e| e.to_string()), String::from_utf8(output).expect("text"))
}

/// Questions that end in their default.
fn defaults(written: &str) -> Vec<(String, String)> {
    let question = |part: &str| {
        let (question, default) = part.rsplit_once('[')?;
        Some((question.rsplit('\n').next()?.trim().to_owned(), default.to_owned()))
    };
    written.split("]: ").filter_map(question).collect()
}

#[test]
fn empty_answers_keep_all_defaults() {
    for family in MeasuredFamily::ALL {
        let (arguments, written) =
            asked(&format!("--family {} --name mill -o no/such.json", family.name()), &"\n".repeat(99));
        let arguments = arguments.expect("answers");
        let made = measured_machine(&arguments, family).expect("a machine");
        assert!(made.values.iter().all(|value| !value.is_measured), "{family}");
        assert_eq!(defaults(&written).len(), made.values.len(), "{family}: {written}");
        assert!(written.contains(family.preset_name()), "{written}");
    }
}

/// The default that a question shows is an answer to it: with all of them nothing is assumed, and
/// the machine has the values of the preset.
#[test]
fn defaults_are_answers_to_their_questions() {
    for family in MeasuredFamily::ALL {
        let options = format!("--family {} --name mill -o no/such.json", family.name());
        let (unmeasured, written) = asked(&options, &"\n".repeat(99));
        let answers: String = defaults(&written).into_iter().map(|(_, default)| default + "\n").collect();
        let (measured, again) = asked(&options, &answers);
        let [unmeasured, measured] = [unmeasured, measured.map_err(|e| format!("{family}: {e}\n{again}"))]
            .map(|arguments| measured_machine(&arguments.expect("answers"), family).expect("a machine").values);
        assert!(measured.iter().all(|value| value.is_measured), "{family}: {measured:?}");
        let texts = |values: &[facemill::inverse_kinematics::measured::ReportedValue]| -> Vec<String> {
            values.iter().map(|value| value.text.clone()).collect()
        };
        assert_eq!(texts(&unmeasured), texts(&measured), "{family}");
    }
}

#[test]
fn what_options_give_is_not_asked_and_each_question_has_its_unit() {
    let options = "--family head-table-bc --pivot-length 250 --limits X=-1:1 --reversed C --name mill -o no/such.json";
    let (arguments, written) = asked(options, &"\n".repeat(99));
    assert_eq!(arguments.expect("answers").pivot_length, Some(250.0));
    let questions: Vec<String> = defaults(&written).into_iter().map(|(question, _)| question).collect();
    let has = |start: &str, unit: &str| questions.iter().any(|q| q.starts_with(start) && q.ends_with(unit));
    for (start, unit) in [
        ("B: sense compared", "iso or reversed"),
        ("readings of X, Y, Z", "X,Y,Z in mm"),
        ("tilting axis beside", "mm"),
        ("Y: limits", "MIN:MAX or endless in mm"),
        ("B: limits", "MIN:MAX or endless in deg"),
        ("X: home", "mm"),
        ("C: home", "deg"),
        ("Z: rapid", "mm/min"),
        ("B: rapid", "deg/min"),
        ("Y: largest acceleration", "mm/s²"),
        ("C: largest jerk", "deg/s³"),
    ] {
        assert!(has(start, unit), "{start} … {unit} in {questions:#?}");
    }
    for absent in ["C: sense", "from the spindle nose up", "X: limits", "a point on the tilting axis", "name of"] {
        assert!(!questions.iter().any(|q| q.starts_with(absent)), "{absent}: {questions:?}");
    }
}

#[test]
fn bad_answers_are_refused_with_a_reason_and_asked_again() {
    let options = "--sense B=iso --sense C=iso --table-at 0,0,-500";
    // Family, a point, then limits, home and rapid of X; the rest as it is.
    let answers = [
        "trunnion",
        "9",
        "0",
        "1",
        "1,2",
        "a,b,c",
        "1,2,1e9",
        " 0,0,62.5 ",
        "10:-10",
        "-5",
        "-10:10",
        "",
        "",
        "",
        "",
        "99",
        "7",
        "",
        "",
        "",
        "",
        "fast",
        "-3",
        "12000",
    ];
    let end = "\n".repeat(99);
    let (arguments, written) = asked(options, &(answers.join("\n") + "\n" + &end));
    let arguments = arguments.unwrap_or_else(|e| panic!("{e}\n{written}"));
    assert_eq!(arguments.family, Some(MeasuredFamily::TableTableBc));
    assert_eq!(arguments.table_tilt, Some([0.0, 0.0, 62.5]));
    assert_eq!(arguments.limits, [("X".to_owned(), AxisLimits::Between(-10.0, 10.0))]);
    assert_eq!(arguments.home, [("X".to_owned(), 7.0)]);
    assert_eq!(arguments.rapid, [("X".to_owned(), 12000.0)]);
    assert_eq!(arguments.out, Some(PathBuf::from(DEFAULT_OUT)));
    let said = |what: &str| written.contains(what);
    assert!(said("\"trunnion\" is none of them") && said("\"fast\" is no number"), "{written}");
    assert!(said("must be 3 numbers in mm") && said("is the unit right") && said("outside its limits"), "{written}");
    // Each is asked for as often as it is answered.
    for (question, times) in [("family, by", 4), ("a point on", 4), ("X: limits", 3), ("X: home", 2), ("X: rapid", 3)] {
        assert_eq!(written.matches(question).count(), times, "{question}: {written}");
    }
}

#[test]
fn an_end_of_the_answers_is_an_error() {
    for n in [0, 1, 5, 20] {
        let (arguments, _) = asked("-o no/such.json", &("1\n".to_owned() + &"\n".repeat(n)));
        let why = arguments.map(drop).expect_err("the answers end");
        assert!(why.contains("standard input") && why.contains("nothing is written"), "{why}");
    }
}

#[test]
fn an_output_file_that_exists_is_asked_for_again() {
    let folder = std::env::temp_dir().join(format!("facemill-machine-prompts-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let (there, new) = (folder.join("there.json"), folder.join("new.json"));
    std::fs::write(&there, "{}").expect("a file");
    let answers = |n: usize| "\n".repeat(n) + &format!("{}\n{}\n", there.display(), new.display());
    let options = "--family table-table-ac --name mill";
    let (_, written) = asked(options, &"\n".repeat(99));
    let n = defaults(&written).len() - 1;
    let (arguments, written) = asked(options, &answers(n));
    let forced = asked(&format!("{options} --force"), &answers(n)).0;
    std::fs::remove_dir_all(&folder).expect("removed");
    assert_eq!(arguments.unwrap_or_else(|e| panic!("{e}\n{written}")).out, Some(new));
    assert!(written.contains("exists; name another file"), "{written}");
    assert_eq!(forced.expect("answers").out, Some(there));
}
