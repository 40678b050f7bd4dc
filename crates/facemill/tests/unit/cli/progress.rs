use super::*;

#[test]
fn stages_are_counted_among_those_to_come_and_mending_comes_again() {
    let progress = Progress { show: Show::Nothing, expected: Mutex::default(), next: AtomicUsize::new(0) };
    assert_eq!(progress.title("read"), "read");
    progress.expect(vec!["search", "verify", "search", "verify", "cut"]);
    let reported: Vec<String> = ["search", "verify", "verify", "unforeseen", "search", "cut"]
        .iter()
        .map(|stage| progress.title(stage))
        .collect();
    assert_eq!(
        reported,
        [
            "stage 1 of 5: search",
            "stage 2 of 5: verify",
            "stage 4 of 5: verify",
            "unforeseen",
            "stage 3 of 5: search, again",
            "stage 5 of 5: cut"
        ]
    );
}
