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
    let unknown = ProgramTimes::constant([60.0, 30.0], vec!["line 7: an arc".to_owned()]).summary_lines();
    assert_eq!(unknown[0], "  cutting time      0:01:00 at constant speed");
    assert_eq!(unknown[2], "  least times       line 7: an arc");
}
