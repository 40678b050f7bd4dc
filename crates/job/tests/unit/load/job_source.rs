use crate::load::job_source::*;

#[test]
fn every_format_that_is_no_job_is_called_by_its_name() {
    let reported = |name: &str, text: &str| other_format(Path::new(name), text.as_bytes());
    let json = |kind: &str| reported("a.json", &format!("{{\"format\": \"facemill-{kind}/1\"}}"));
    for (kind, name) in
        [("machine", "machine file"), ("tool", "tool file"), ("path", "path file"), ("report", "report")]
    {
        let said = json(kind).expect(kind);
        assert!(said.starts_with("this is") && said.contains(name) && said.contains("not a job; "), "{said}");
    }
    assert!(json("something").is_some_and(|said| said.contains("another format")));
    assert_eq!((json("job"), reported("a.json", "{}"), reported("a.json", "{")), (None, None, None));
    assert!(reported("a.stl", "solid a").is_some_and(|said| said.contains("a mesh")));
    assert!(reported("a.nc", "%\nO1").is_some_and(|said| said.contains("facemill verify")));
    // A job that another version wrote is refused by its format, and one with a byte order mark is
    // a job.
    assert_eq!(reported("a.json", "{\"format\": \"facemill-job/9\"}"), None);
    assert_eq!(reported("a.json", "\u{feff}{\"format\": \"facemill-job/1\"}"), None);
}
