use super::*;
use crate::dialect::Dialect;
use crate::read::read_program;

/// Returns the first and last line and the called tools of each part.
fn parts(text: &str, dialect: Dialect) -> Vec<(u32, u32, Vec<u32>)> {
    let program = read_program(text, dialect).unwrap();
    let part = |section: &ReadProgram| {
        let tools = section.blocks.iter().flat_map(|b| &b.commands);
        let tools = tools.filter_map(|c| if let ReadCommand::Tool(n) = c { Some(*n) } else { None }).collect();
        (section.blocks.first().unwrap().line, section.blocks.last().unwrap().line, tools)
    };
    let sections = program.tool_sections();
    let blocks: Vec<u32> = sections.iter().flat_map(|s| s.blocks.iter().map(|b| b.line)).collect();
    assert_eq!(blocks, program.blocks.iter().map(|b| b.line).collect::<Vec<_>>(), "every block is in one part");
    let n = sections.len();
    assert!(sections.iter().enumerate().all(|(k, s)| s.goes_on == (k + 1 < n)));
    sections.iter().map(part).collect()
}

const TWO: &str = "%\nO1\n(TOOL LENGTH 100.000)\nG21 G90\nT1 M6\nG0 X0. Y0.\nG1 X5. F100.\nG91 G28 Z0.\n\
                   (TOOL LENGTH 120.000)\nG90\nT2 M6\nG0 X1.\nG1 X6.\nM30\n%\n";

#[test]
fn a_part_begins_at_the_change_to_another_tool() {
    assert_eq!(parts(TWO, Dialect::Fanuc), [(2, 10, vec![1]), (11, 14, vec![2])]);
    // One tool, one part; called again it is no change.
    let again = TWO.replace("T2 M6", "T1 M6");
    assert_eq!(parts(&again, Dialect::Fanuc), [(2, 14, vec![1, 1])]);
    let none = TWO.replace("T1 M6\n", "").replace("T2 M6\n", "");
    assert_eq!(parts(&none, Dialect::Fanuc).len(), 1);
}

#[test]
fn a_tool_that_is_made_ready_is_called_at_its_change() {
    let staged = TWO.replace("G1 X5. F100.", "T2\nG1 X5. F100.").replace("T2 M6", "M6");
    assert_eq!(parts(&staged, Dialect::Fanuc), [(2, 11, vec![1]), (12, 15, vec![2])]);
    // The next one is staged behind each change, the first one behind the last.
    let ring = TWO.replace("T1 M6", "T1 M6\nT2").replace("T2 M6", "M6\nT1");
    assert_eq!(parts(&ring, Dialect::Fanuc), [(2, 11, vec![1]), (12, 16, vec![2, 1])]);
}

#[test]
fn lengths_in_comments_belong_to_the_tool_behind_them() {
    let lengths = |text: &str| -> Vec<Vec<f64>> {
        let program = read_program(text, Dialect::Fanuc).unwrap();
        program.tool_sections().iter().map(|s| s.tool_lengths.iter().map(|n| n.length).collect()).collect()
    };
    assert_eq!(lengths(TWO), [[100.0], [120.0]]);
    // Behind the change and before a cut it is that of the tool that was changed.
    let behind = TWO.replace("(TOOL LENGTH 120.000)\n", "").replace("T2 M6", "T2 M6\n(TOOL LENGTH 130.000)");
    assert_eq!(lengths(&behind), [[100.0], [130.0]]);
    // A check belongs to the part it is in, whatever length it compares with.
    let check = "T2 M6\nIF [ABS[#11002+#10002-100.000] LE 0.01] GOTO 9002\n#3000=1(LENGTH)\nN9002";
    assert_eq!(lengths(&TWO.replace("T2 M6", check)), [vec![100.0], vec![100.0, 120.0]]);
}

#[test]
fn a_call_in_klartext_is_a_change_and_a_new_speed_none() {
    let text = "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nL X+0 Y+0 R0 FMAX\nL X+5 F100\nTOOL CALL 1 Z S2000\nL X+9\n\
                TOOL CALL 2 Z S1000\nL X+0 FMAX\nM30\nEND PGM A MM\n";
    assert_eq!(parts(text, Dialect::Heidenhain), [(1, 6, vec![1, 1]), (7, 10, vec![2])]);
}
