use crate::format::program_times::*;

#[test]
fn times_unknown_within_acceleration_are_given_at_constant_speed_with_the_reason() {
    let known = ProgramTimes::by_law([60.0, 30.0], [75.0, 40.0]).summary_lines();
    assert_eq!(
        known,
        [
            "  cutting time      0:01:15 (at constant speed 0:01:00)",
            "  rapid time        0:00:40 (at constant speed 0:00:30)"
        ]
    );
    let why = NoLawReason::Text("not requested".to_owned());
    let unknown = ProgramTimes::constant([60.0, 30.0], vec![why]).summary_lines();
    assert_eq!(unknown[0], "  cutting time      0:01:00 at constant speed");
    assert_eq!(unknown[2], "  least times       not requested");
}

#[test]
fn a_line_without_a_time_is_named_with_its_file_where_there_are_several() {
    let mut why = NoLawReason::Line { file: None, line: 9, why: ": an arc".to_owned() };
    assert_eq!(why.to_string(), "unknown within acceleration: line 9: an arc");
    why.place(|line| ("O7.nc".to_owned(), line - 6));
    assert_eq!(serde_json::to_value(&why).unwrap(), "unknown within acceleration: O7.nc: line 3: an arc");
    let mut text = NoLawReason::Text("line 9".to_owned());
    text.place(|_| unreachable!("no line"));
    assert_eq!(text.to_string(), "line 9");
}
