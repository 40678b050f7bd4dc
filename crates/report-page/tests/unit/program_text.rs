use super::*;

#[test]
fn comments_of_all_controls_say_where_operations_and_passes_begin() {
    let fanuc = "%\nO1 (JOB - SUCTION SIDE)\n(SUCTION SIDE)\n(PASS 1 PLACE 1)\nN1 G0 X0.\n(PASS 2 PLACE 1)\n";
    let siemens = "; suction side\n; PASS 1 PLACE 1\nN10 G0 X0\n; PASS 2 PLACE 1\n";
    let heidenhain = "0 BEGIN PGM A MM\nN1 ; SUCTION SIDE\n; PASS 1 PLACE 1\n; PASS 2 PLACE 1\n";
    for (text, first) in [(fanuc, 3), (siemens, 1), (heidenhain, 2)] {
        let operations = operation_lines(text, ["suction side", "root"].into_iter());
        assert_eq!(operations, [OperationLines { operation: "suction side".to_owned(), first_line: first }]);
        let passes = pass_lines(text);
        assert_eq!(passes.iter().map(|p| (p.pass, p.place)).collect::<Vec<_>>(), [(1, 1), (2, 1)], "{text}");
    }
}

#[test]
fn words_and_other_comments_are_no_passes() {
    let text = "G1 X1. (PASS 1 PLACE 1)\n(PASS A PLACE 1)\n(PASS 1)\n(SUCTION SIDE IS NEXT)\n()\n";
    assert!(pass_lines(text).is_empty());
    assert!(operation_lines(text, ["suction side", ""].into_iter()).is_empty());
}
