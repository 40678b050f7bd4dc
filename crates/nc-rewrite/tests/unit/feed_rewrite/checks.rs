use std::f64::consts::PI;

use facemill_inverse_kinematics::Machine;
use facemill_nc_program::dialect::RtcpRapids;

use crate::feed_rewrite::checks::*;
use crate::feed_rewrite::{FeedRewriteSettings, TipFeed, rewrite_feed_lines, rewrite_feeds};

fn settings(machine: &Machine, dialect: Dialect) -> FeedRewriteSettings<'_> {
    FeedRewriteSettings {
        machine,
        tool_length: 100.0,
        tip_feed: TipFeed::Programmed,
        work_offset: Vec::new(),
        dialect,
        dialect_file: None,
        time_law: None,
    }
}

/// Program that is made as it is read, and asserts that all its lines but so many have been
/// written.
struct Stream<'a> {
    made: std::collections::VecDeque<u8>,
    line: u32,
    read: usize,
    written: &'a std::cell::Cell<usize>,
    most_held: usize,
}

impl std::io::Read for Stream<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        while self.made.len() < into.len() && self.line < 20_000 {
            let k = f64::from(self.line);
            let text = format!("G1 X{:.3} Y{:.3} B{:.3} F500.\n", 0.01 * k, (0.01 * k).sin(), (0.001 * k).sin());
            let head = "G90 G94\nG0 X0. Y0. Z100. B0. C0.\n";
            self.made.extend(if self.line == 0 { head.bytes() } else { text.bytes() });
            self.line += 1;
        }
        let held = self.read.saturating_sub(self.written.get());
        assert!(held <= self.most_held, "{held} lines are held at line {}", self.line);
        let n = self.made.read(into)?;
        self.read += lines(&into[..n]);
        Ok(n)
    }
}

fn lines(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte == b'\n').count()
}

struct Sink<'a>(&'a std::cell::Cell<usize>, Vec<u8>);

impl std::io::Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.set(self.0.get() + lines(bytes));
        self.1.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// For a program of any length; and the output is that of the whole text.
#[test]
fn a_program_without_a_law_of_motion_is_held_for_a_window_alone() {
    const WINDOW: usize = 4096;
    let machine = Machine::head_b_table_c().unwrap();
    let settings = FeedRewriteSettings { tip_feed: TipFeed::Given(500.0), ..settings(&machine, Dialect::Fanuc) };
    let (free, written) = (std::cell::Cell::new(usize::MAX), std::cell::Cell::new(0));
    let source = |written, most_held| {
        let made = std::collections::VecDeque::new();
        let stream = Stream { made, line: 0, read: 0, written, most_held };
        std::io::BufReader::with_capacity(WINDOW, stream)
    };
    let mut sink = Sink(&written, Vec::new());
    let by_line = rewrite_feed_lines(|| Ok(source(&written, WINDOW / 16)), &settings, &mut sink).unwrap();
    let mut text = Vec::new();
    std::io::Read::read_to_end(&mut source(&free, usize::MAX), &mut text).unwrap();
    let whole = rewrite_feeds(&text, &settings).unwrap();
    assert_eq!(by_line.blocks, 19_999);
    assert_eq!((by_line, &sink.1), (whole.summary, &whole.text));
    assert!(text.len() > 100 * WINDOW);
}

/// Speeds in a frame that is not followed are unknown; words that switch one off change nothing.
#[test]
fn frames_are_refused_with_their_line_and_their_end_is_not() {
    let machine = Machine::head_b_table_c().unwrap();
    let words = ("G90 G94\nG0 X0. Y0. Z100. B0. C0.", "G1 X10. F500.");
    let klartext = ("M129\nL X+0 Y+0 Z+100 B+0 C+0 R0 FMAX", "L X+10 R0 F500");
    for (dialect, (head, cut), on, off) in [
        (Dialect::Fanuc, words, "G52 X5.", "G52 X0."),
        (Dialect::Fanuc, words, "G68 X0. Y0. R30.", "G69"),
        (Dialect::Fanuc, words, "G51 X0. Y0. P2.", "G50"),
        (Dialect::LinuxCnc, words, "G92 X5", "G92.1"),
        (Dialect::Siemens840d, words, "ATRANS X5", "TRANS"),
        (Dialect::Siemens840d, words, "SCALE X2", "SCALE"),
        (Dialect::Heidenhain, klartext, "CYCL DEF 7.1 X+5", "CYCL DEF 7.1 X+0"),
        (Dialect::Heidenhain, klartext, "CYCL DEF 8.1 X", "CYCL DEF 8.1"),
        (Dialect::Heidenhain, klartext, "CYCL DEF 26.1 X2", "CYCL DEF 26.1 X1"),
    ] {
        let settings = settings(&machine, dialect);
        let run = |line: &str| rewrite_feeds(format!("{head}\n{line}\n{cut}\n").as_bytes(), &settings);
        let reported = run(on).unwrap_err();
        assert!(reported.contains("line 3"), "{on}: {reported}");
        if let Err(why) = run(off) {
            panic!("{off}: {why}");
        }
    }
}

/// The tip rests on the table while it turns by half a turn: X goes straight through the center by
/// the machine's rapids, but on a circle at a steady pace where rapids keep the tip.
#[test]
fn rapids_under_rtcp_are_those_of_the_dialect_file() {
    const RADIUS: f64 = 700.0;
    let machine = Machine::head_b_table_c().unwrap();
    let time = |rapids: Option<RtcpRapids>, turn: &str| {
        let dialect_file = rapids.map(|rapids| {
            let mut file = Dialect::Fanuc.file();
            file.motion.rtcp.as_mut().unwrap().rapids = rapids;
            file
        });
        let settings = FeedRewriteSettings { dialect_file, ..settings(&machine, Dialect::Fanuc) };
        let head = format!("G21 G90 G94 G54\nG43.4 H1\nG0 X{RADIUS:.1} Y0. Z150. B0. C0.\n");
        let text = format!("{head}{turn}G1 Z140. F500.\nM30\n");
        rewrite_feeds(text.as_bytes(), &settings).unwrap().summary.rapid_time_s
    };
    let of_turn = |rapids| time(rapids, "G0 C180.\n") - time(rapids, "");
    let speed = |name: &str| machine.axes()[machine.axis_index(name).unwrap()].max_velocity;
    let turn = PI / speed("C");
    let (straight, circle) = (2.0 * RADIUS / speed("X"), PI * RADIUS / speed("X").min(speed("Y")));
    assert!(circle > 1.2 * turn, "{circle} {turn}");
    assert!((of_turn(Some(RtcpRapids::BySetting)) / straight.max(turn) - 1.0).abs() < 1e-9);
    let kept = of_turn(Some(RtcpRapids::TipLinear));
    assert!((kept / circle - 1.0).abs() < 3e-3, "{kept} {circle}");
    // FANUC's own file leaves it to a setting.
    assert_eq!(of_turn(None), of_turn(Some(RtcpRapids::BySetting)));
}

/// F has the decimals that the dialect file permits.
#[test]
fn feeds_have_the_decimals_of_the_dialect_file() {
    let machine = Machine::head_b_table_c().unwrap();
    let mut file = Dialect::Fanuc.file();
    file.numbers.max_decimals.feed = 0;
    for (dialect_file, expected) in [(None, " F500.5\n"), (Some(file), " F500.\n")] {
        let settings =
            FeedRewriteSettings { dialect_file, tip_feed: TipFeed::Given(500.5), ..settings(&machine, Dialect::Fanuc) };
        let text = b"G21 G90 G94 G54\nG43 H1\nG0 X0. Y0. Z150. B0. C0.\nG1 X10. F900.\nM30\n";
        let new = String::from_utf8(rewrite_feeds(text, &settings).unwrap().text).unwrap();
        assert!(new.contains(expected), "{new}");
    }
}

/// The same motions have the same speeds, and F has the program's unit.
#[test]
fn a_program_in_inches_gets_the_feeds_of_the_same_program_in_mm_in_its_unit() {
    let machine = Machine::head_b_table_c().unwrap();
    let run = |dialect, text: &str, tip_feed| {
        let settings = FeedRewriteSettings { tip_feed, ..settings(&machine, dialect) };
        let rewritten = rewrite_feeds(text.as_bytes(), &settings).unwrap_or_else(|why| panic!("{why}\n{text}"));
        let words = String::from_utf8(rewritten.text).unwrap();
        let last = words.split_whitespace().filter_map(|w| w.strip_prefix('F')?.parse::<f64>().ok()).next_back();
        (last.unwrap(), rewritten.summary)
    };
    let given = TipFeed::Given(508.0);
    let lines = |unit: &str, x: &str, f: &str| format!("{unit} G90 G94\nG0 X0. Y0. Z100. B0. C0.\nG1 X{x} F{f}\nM30\n");
    for (dialect, mm, inch) in [
        (Dialect::Fanuc, "G21", "G20"),
        (Dialect::Haas, "G21", "G20"),
        (Dialect::LinuxCnc, "G21", "G20"),
        (Dialect::Siemens840d, "G710", "G700"),
    ] {
        let metric = run(dialect, &lines(mm, "50.8", "254."), given);
        let inches = run(dialect, &lines(inch, "2.", "10."), given);
        assert_eq!((metric.0, inches.0), (508.0, 20.0), "{}", dialect.name());
        assert!((metric.1.time_before_s - 12.0).abs() < 1e-9 && (metric.1.time_after_s - 6.0).abs() < 1e-9);
        assert!((inches.1.time_before_s - 12.0).abs() < 1e-9 && (inches.1.time_after_s - 6.0).abs() < 1e-9);
        // Existing text stays, to the byte.
        let kept = run(dialect, &lines(inch, "2.", "10."), TipFeed::Keep);
        assert_eq!((kept.0, kept.1.changed), (10.0, 0), "{}", dialect.name());
    }
    // F counts 1 deg as 1 inch: 3 inches and 4 deg are 5.
    let turning = "G20 G90 G94\nG0 X0. Y0. Z100. B0. C0.\nG1 X3. C4. F10.\nM30\n";
    let kept = run(Dialect::Fanuc, turning, TipFeed::Keep);
    assert!((kept.1.time_before_s - 30.0).abs() < 1e-9, "{}", kept.1.time_before_s);
    assert!((kept.0 - 10.0).abs() < 0.01);
    // Tenths of an inch on Heidenhain, where turns are refused.
    let klartext = |words: &str| {
        format!("BEGIN PGM A INCH\nL X+0 Y+0 Z+4 B+0 C+0 R0 FMAX\nL {words} R0 F100\nM30\nEND PGM A INCH\n")
    };
    let found = run(Dialect::Heidenhain, &klartext("X+2"), given);
    assert!((found.0 - 200.0).abs() < 1e-9 && (found.1.time_before_s - 12.0).abs() < 1e-9);
    let reported = rewrite_feeds(klartext("X+2 C+4").as_bytes(), &settings(&machine, Dialect::Heidenhain)).unwrap_err();
    assert!(reported.contains("line 3") && reported.contains("inches"), "{reported}");
}

/// Refuses, with their line, feeds, vectors and numbers without a point that mean something else
/// than they seem; not those next to them.
#[test]
fn feeds_vectors_and_numbers_that_mean_something_else_are_refused_with_their_line() {
    let machine = Machine::head_b_table_c().unwrap();
    let run = |dialect: Dialect, line: &str| {
        let head = match dialect {
            Dialect::Heidenhain => "TOOL CALL 1 Z S100\nL X+0 Y+0 Z+100 B+0 C+0 R0 FMAX M128",
            _ => "G90 G94\nG0 X0. Y0. Z100. B0. C0.",
        };
        let end = if dialect == Dialect::Heidenhain { "L X+20 F500" } else { "G1 X20. F500." };
        rewrite_feeds(format!("{head}\n{line}\n{end}\n").as_bytes(), &settings(&machine, dialect)).map(|_| ())
    };
    let vector = |z: f64| format!("LN X+5 Y+0 Z+100 NX+0 NY+0 NZ+1 TX+0 TY+0 TZ+{z} F500");
    for (dialect, line, part) in [
        (Dialect::Heidenhain, "L X+5 F500 M103 F0.5".to_owned(), "M103"),
        (Dialect::Heidenhain, "L X+5 F500 M109".to_owned(), "M109"),
        (Dialect::Heidenhain, "L X+5 F500 M110".to_owned(), "M110"),
        (Dialect::Heidenhain, "L X+5 F500 M116".to_owned(), "M116"),
        (Dialect::Heidenhain, vector(1.01), "length 1"),
        (Dialect::Heidenhain, vector(0.998), "length 1"),
        (Dialect::Fanuc, "G1 X10 F500.".to_owned(), "decimal point"),
        (Dialect::Haas, "G1 X10. F500".to_owned(), "decimal point"),
        (Dialect::Mazak, "G1 X10. B5 F500.".to_owned(), "decimal point"),
    ] {
        let reported = run(dialect, &line).unwrap_err();
        assert!(reported.contains("line 3") && reported.contains(part), "{line}: {reported}");
    }
    // Within the rounding of programs it is refused for its pole alone.
    let reported = run(Dialect::Heidenhain, &vector(1.0005)).unwrap_err();
    assert!(!reported.contains("length 1"), "{reported}");
    for (dialect, line) in [
        (Dialect::Heidenhain, "L X+5 F500 M111".to_owned()),
        (Dialect::Heidenhain, "L X+5 F500 M117".to_owned()),
        (Dialect::Fanuc, "G1 X10. B5. F500.".to_owned()),
        (Dialect::Fanuc, "G4 P500".to_owned()),
        (Dialect::LinuxCnc, "G1 X10 B5 F500".to_owned()),
    ] {
        if let Err(why) = run(dialect, &line) {
            panic!("{line}: {why}");
        }
    }
}

/// Never faster, never more decimals than the control accepts, and nearer than its last decimal or
/// its digits; or refused.
#[test]
fn feeds_are_rounded_down_to_what_the_control_takes_or_refused() {
    let mut refused = 0;
    for k in 0..20_000_u32 {
        // Spread evenly over eleven decades.
        let value = 10f64.powf(-6.0 + 11.0 * (f64::from(k) * 0.618_033_988_75).fract());
        let (most, digits) = ((k % 7) as u8, 4 + (k / 7 % 2) as i32);
        let unit = 0.1_f64.powi(most.into());
        match rounded_down(value, most, digits, true) {
            Ok((text, number)) => {
                assert_eq!(text.parse::<f64>().unwrap(), number, "{text}");
                let decimals = text.split_once('.').unwrap().1.len();
                assert!(decimals <= usize::from(most), "{value} with {most} decimals: {text}");
                let lost = value - number;
                assert!(lost >= -1e-11 * value && lost <= 0.01 * value, "{value}: {text}");
                assert!(lost <= unit.max(value * 10f64.powi(1 - digits)) * (1.0 + 1e-9), "{value}: {text}");
            }
            Err(why) => {
                let down = (value / unit).floor() * unit;
                assert!(value - down > 0.009_999 * value, "{value} with {most} decimals: {why}");
                assert!(why.contains(&format!("the {most} decimals")), "{why}");
                refused += 1;
            }
        }
    }
    assert!(refused > 1000, "{refused}");
}

#[test]
fn feeds_of_whole_units_stay_as_they_are() {
    let number = |value, most, point| rounded_down(value, most, 5, point).unwrap().0;
    assert_eq!(number(0.3, 4, true), "0.3");
    assert_eq!([number(120.0, 4, true), number(120.0, 4, false)], ["120.", "120"]);
    assert_eq!([number(120.9, 0, true), number(0.123_456, 3, true)], ["120.", "0.123"]);
    assert_eq!([number(0.123_456_7, 6, true), number(12.345_67, 6, false)], ["0.12345", "12.345"]);
}

/// F of inverse time holds for its block alone: a block without one gets one of inverse time.
#[test]
fn blocks_of_inverse_time_without_a_feed_get_one_of_inverse_time() {
    let machine = Machine::head_b_table_c().unwrap();
    let text = b"G90 G93\nG0 X0. Y0. Z100. B0. C0.\nG1 X10. F5.\nX20.\n";
    let given = FeedRewriteSettings { tip_feed: TipFeed::Given(500.0), ..settings(&machine, Dialect::Fanuc) };
    let new = String::from_utf8(rewrite_feeds(text, &given).unwrap().text).unwrap();
    assert!(new.contains("G1 X10. F50.\nX20. F50.\n"), "{new}");
    let kept = FeedRewriteSettings { tip_feed: TipFeed::Keep, ..settings(&machine, Dialect::Fanuc) };
    let why = rewrite_feeds(text, &kept).err().unwrap();
    assert!(why.to_string().contains("line 4") && why.to_string().contains("no feed"), "{why}");
}
