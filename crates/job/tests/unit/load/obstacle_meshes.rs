use crate::load::obstacle_meshes::matches_pattern;

#[test]
fn star_matches_any_run() {
    assert!(matches_pattern("blade-*/suction", "blade-12/suction"));
    assert!(matches_pattern("*", ""));
    assert!(matches_pattern("a*b*", "axxbyy"));
    assert!(!matches_pattern("blade-*", "hub"));
    assert!(!matches_pattern("blade", "blade-1"));
}
