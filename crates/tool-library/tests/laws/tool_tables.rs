//! Tool tables read back by readers of their own.

use facemill_test_kit::Random;
use facemill_tool_library::{
    G10Control, TableError, TableUnit, g10_tool_lengths, heidenhain_tool_table, linuxcnc_table, siemens_tool_data,
};
use facemill_tool_model::{AssumedMeasure, ToolAssembly, ToolFile};

use crate::kit::{imported, inch_tool};

fn tool(change: impl Fn(&mut ToolFile)) -> ToolAssembly {
    let mut file = imported(&inch_tool()).file;
    file.length_register = None;
    change(&mut file);
    ToolAssembly::new(file).expect("a tool")
}

fn random_tools(random: &mut Random, n: u32) -> Vec<ToolAssembly> {
    let tools = (0..n).map(|k| {
        let (radius, share) = (random.between(2.0, 6.0), random.below(3) as f64 / 2.0);
        tool(|file| {
            file.number = n - k;
            file.name = format!("mill \"{k}\"; (r) ü");
            file.radius_mm = radius;
            file.corner_radius_mm = share * radius;
            file.dead_core_radius_mm = 0.0;
        })
    });
    tools.collect()
}

/// A row of LinuxCNC's table: T, P, Z, D.
fn row(line: &str) -> [f64; 4] {
    let (words, comment) = line.split_once(';').expect("a comment");
    assert!(comment.is_ascii() && comment.len() <= 39 && !comment.contains(';'), "{comment}");
    let word = |letter: char| {
        let word = words.split_whitespace().find_map(|word| word.strip_prefix(letter));
        word.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{letter} in {line}"))
    };
    ['T', 'P', 'Z', 'D'].map(word)
}

#[test]
fn rows_of_linuxcnc_are_the_tools_by_number() {
    let mut random = Random(3);
    let mut tools = random_tools(&mut random, 20);
    for (unit, mm) in [(TableUnit::Millimetre, 1.0), (TableUnit::Inch, 25.4)] {
        let text = linuxcnc_table(&tools, unit).expect("a table");
        tools.sort_by_key(ToolAssembly::number);
        assert_eq!(text.lines().count(), tools.len());
        for (line, tool) in text.lines().zip(&tools) {
            let [number, pocket, length, diameter] = row(line);
            assert_eq!((number, pocket), (f64::from(tool.number()), f64::from(tool.number())));
            assert!((length * mm - tool.gauge_length()).abs() < 1e-4, "{line}");
            assert!((diameter * mm - 2.0 * tool.cutter().radius()).abs() < 1e-4, "{line}");
            // A row that is copied into another table says in which unit it is.
            let unit = if mm == 1.0 { ";mm, " } else { ";inch, " };
            assert!(line.contains(unit), "{line}");
        }
        // The table does not depend on the order of the arguments.
        tools.reverse();
        assert_eq!(linuxcnc_table(&tools, unit).expect("a table"), text);
    }
}

#[test]
fn a_length_register_has_a_row_of_its_own() {
    let one = tool(|file| file.length_register = Some(17));
    let text = linuxcnc_table(std::slice::from_ref(&one), TableUnit::Millimetre).expect("a table");
    assert_eq!(
        text,
        "T7 P7 Z146.2000 D12.7000 ;mm, 1/2 r1/16 long reach\nT17 P17 Z146.2000 D12.7000 ;mm, length of T7\n"
    );
    let other = tool(|file| file.number = 17);
    let why = linuxcnc_table(&[one, other], TableUnit::Millimetre).expect_err("one row for two");
    assert!(matches!(why, TableError::Register { number: 7, register: 17, .. }), "{why}");
}

#[test]
fn data_of_siemens_are_the_tools_in_edge_one() {
    let mut random = Random(4);
    let tools = random_tools(&mut random, 12);
    let text = siemens_tool_data(&tools, TableUnit::Millimetre).expect("a program");
    assert!(text.is_ascii() && text.ends_with("\nM17\n"));
    let statement = |text: &str| text.lines().find(|line| !line.starts_with(';')).map(str::to_owned);
    assert_eq!(statement(&text).as_deref(), Some("G710"), "{text}");
    let inches = siemens_tool_data(&tools, TableUnit::Inch).expect("a program");
    assert_eq!(statement(&inches).as_deref(), Some("G700"), "{inches}");
    let value = |variable: String| {
        let of = |line: &str| Some(line.strip_prefix(&variable)?.strip_prefix('=')?.to_owned());
        text.lines().find_map(of).unwrap_or_else(|| panic!("{variable} in\n{text}"))
    };
    for tool in &tools {
        let (t, cutter) = (tool.number(), tool.cutter());
        let number = |parameter: u32| -> f64 { value(format!("$TC_DP{parameter}[{t},1]")).parse().expect("a number") };
        let (radius, corner) = (cutter.radius(), cutter.corner_radius());
        let kind = if corner == radius {
            110.0
        } else if corner > 0.0 {
            121.0
        } else {
            120.0
        };
        assert_eq!(number(1), kind);
        for (parameter, mm) in [(3, tool.gauge_length()), (6, radius), (7, corner)] {
            assert!((number(parameter) - mm).abs() < 1e-4);
        }
        // Programs call tools by number, so the number is the name.
        assert_eq!(value(format!("$TC_TP2[{t}]")), format!("\"{t}\""));
        assert_eq!(value(format!("$TC_TP1[{t}]")), "1");
        assert_eq!((number(4), number(5)), (0.0, 0.0));
        assert!(text.lines().any(|line| line.starts_with(&format!("; T{t} mill _"))), "{text}");
    }
}

#[test]
fn tools_of_one_name_are_no_replacements_of_each_other() {
    let twins = [3, 9].map(|number| tool(|file| file.number = number));
    let text = siemens_tool_data(&twins, TableUnit::Inch).expect("a program");
    for line in ["$TC_TP1[3]=1", "$TC_TP2[3]=\"3\"", "$TC_TP1[9]=1", "$TC_TP2[9]=\"9\""] {
        assert!(text.lines().any(|own| own == line), "{line}:\n{text}");
    }
    assert!(text.contains("LENGTHS IN INCH") && text.contains("$TC_DP6[3,1]=0.250000\n"), "{text}");
}

/// A program stops where the control has another length than the plan: a table with the plan's own
/// guess would never stop it.
#[test]
fn lengths_that_nobody_measured_are_in_no_table() {
    for (key, is_refused) in [
        ("gauge_length_mm", true),
        ("holder.sections", true),
        ("holder.sections[1].length_mm", true),
        ("holder.clearance_mm", false),
        ("dead_core_radius_mm", false),
    ] {
        let one = tool(|file| {
            file.assumed.push(AssumedMeasure { key: key.to_owned(), reason: "a guess".to_owned() });
        });
        let g10 = |tools: &[ToolAssembly], unit: TableUnit| g10_tool_lengths(tools, unit, G10Control::Fanuc, 1);
        for table in [linuxcnc_table, siemens_tool_data, heidenhain_tool_table, g10] {
            let Err(why) = table(std::slice::from_ref(&one), TableUnit::Millimetre) else {
                assert!(!is_refused, "{key}");
                continue;
            };
            assert!(is_refused && matches!(why, TableError::AssumedLength { number: 7, .. }), "{why}");
            assert_eq!(why.number(), Some(7));
            let text = why.to_string();
            assert!(text.contains("tool 7 \"1/2 r1/16") && text.contains(&format!("\"{key}\"")), "{text}");
        }
    }
}

#[test]
fn tools_that_a_control_cannot_have_are_refused() {
    let large = [tool(|file| (file.number, file.length_register) = (100_000, Some(1)))];
    let text = |why: TableError| why.to_string();
    assert!(linuxcnc_table(&large, TableUnit::Millimetre).is_err_and(|why| text(why).contains("up to 99999")));
    assert!(siemens_tool_data(&large, TableUnit::Millimetre).is_err_and(|why| text(why).contains("up to 32000")));
    let twice = [tool(|_| ()), tool(|file| file.name = "other".to_owned())];
    assert!(linuxcnc_table(&twice, TableUnit::Millimetre).is_err_and(|why| text(why).contains("both have number 7")));
    assert_eq!(siemens_tool_data(&[], TableUnit::Millimetre), Err(TableError::Empty));
}

/// The geometry of a register is the length of its tool and its wear 0, whatever the numbers are.
#[test]
fn registers_of_g10_have_the_lengths_of_their_tools() {
    let mut random = Random(7);
    let mut tools = random_tools(&mut random, 9);
    tools.push(tool(|file| (file.number, file.length_register) = (50, Some(90))));
    for (control, digits) in [(G10Control::Fanuc, 4), (G10Control::Haas, 5), (G10Control::Mazak, 4)] {
        for (unit, mm, code) in [(TableUnit::Millimetre, 1.0, "G21 G90"), (TableUnit::Inch, 25.4, "G20 G90")] {
            let text = g10_tool_lengths(&tools, unit, control, 12).expect("a program");
            let lines: Vec<&str> = text.lines().collect();
            assert!(lines[1].starts_with(&format!("O{:0digits$} (", 12)) && lines[2] == code, "{text}");
            assert_eq!((lines[0], &lines[lines.len() - 2..]), ("%", &["M30", "%"][..]));
            let value = |offset: u32, register: u32| -> f64 {
                let begin = format!("G10 L{offset} P{register} R");
                let found = lines.iter().find_map(|line| line.strip_prefix(&begin));
                found.unwrap_or_else(|| panic!("{begin} in\n{text}")).parse().expect("a number")
            };
            for tool in &tools {
                let register = tool.length_register();
                assert!((value(10, register) * mm - tool.gauge_length()).abs() < 2e-3, "{text}");
                assert_eq!(value(11, register), 0.0);
            }
            assert_eq!(lines.iter().filter(|line| line.starts_with("G10 ")).count(), 2 * tools.len());
            // Comments are in parentheses that are not nested.
            for line in lines.iter().filter(|line| line.starts_with('(')) {
                assert!(line.ends_with(')') && line.matches(['(', ')']).count() == 2 && line.is_ascii(), "{line}");
            }
        }
    }
}

/// Cells are below the heads of their columns.
#[test]
fn rows_of_heidenhain_are_below_their_columns() {
    let mut random = Random(8);
    let mut tools = random_tools(&mut random, 12);
    let text = heidenhain_tool_table(&tools, TableUnit::Millimetre).expect("a table");
    tools.sort_by_key(ToolAssembly::number);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((lines[0], lines[lines.len() - 1], lines.len()), ("BEGIN TOOL.T MM", "[END]", tools.len() + 3));
    let cell = |line: &str, column: &str| -> String {
        let head = format!(" {}", lines[1]);
        let at = head.find(&format!(" {column} ")).unwrap_or_else(|| panic!("{column} in {head}"));
        line[at..].split(' ').next().expect("a cell").to_owned()
    };
    for (line, tool) in lines[2..].iter().zip(&tools) {
        let number =
            |column: &str| -> f64 { cell(line, column).parse().unwrap_or_else(|_| panic!("{column}: {line}")) };
        assert_eq!(number("T"), f64::from(tool.number()));
        assert!((number("L") - tool.gauge_length()).abs() < 1e-4, "{line}");
        assert!((number("R") - tool.cutter().radius()).abs() < 1e-4, "{line}");
        assert!((number("R2") - tool.cutter().corner_radius()).abs() < 1e-4, "{line}");
        assert_eq!((number("DL"), number("DR")), (0.0, 0.0));
        let name = cell(line, "NAME");
        assert!((1..=16).contains(&name.len()) && name.starts_with("MILL_"), "{line}");
    }
}

#[test]
fn registers_that_a_control_cannot_have_are_refused() {
    let of = |register| tool(|file| (file.number, file.length_register) = (register, Some(register)));
    let g10 = |tools: &[ToolAssembly], control| g10_tool_lengths(tools, TableUnit::Millimetre, control, 1);
    assert!(g10(&[of(200)], G10Control::Haas).is_ok() && g10(&[of(999)], G10Control::Fanuc).is_ok());
    let why = g10(&[of(201)], G10Control::Haas).expect_err("too large");
    assert!(matches!(why, TableError::RegisterNumber { number: 201, register: 201, most: 200, .. }), "{why}");
    let twins = [5, 6].map(|number| tool(|file| (file.number, file.length_register) = (number, Some(5))));
    let why = g10(&twins, G10Control::Mazak).expect_err("one register for two");
    assert!(matches!(why, TableError::Register { number: 6, register: 5, control: "Mazak", .. }), "{why}");
}
