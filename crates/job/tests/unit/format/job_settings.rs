use crate::format::job_settings::*;
use serde_json::json;

fn set(text: &str) -> Result<Value, String> {
    let mut job = json!({ "name": "a", "operations": [{ "tolerances": { "cusp_mm": 0.1 } }, { "pattern": null }] });
    text.parse::<JobSetting>()?.put_in(&mut job)?;
    Ok(job)
}

#[test]
fn pointer_and_dotted_path_name_the_same_value() {
    for key in
        ["/operations/0/tolerances/cusp_mm", "operations[0].tolerances.cusp_mm", "operations.0.tolerances.cusp_mm"]
    {
        assert_eq!(set(&format!("{key}=0.05")).unwrap()["operations"][0]["tolerances"]["cusp_mm"], json!(0.05));
        assert_eq!(key.replace('/', ".").trim_start_matches('.').len(), key.len() - usize::from(key.starts_with('/')));
        assert_eq!(format!("{key}=1").parse::<JobSetting>().unwrap().key, "operations[0].tolerances.cusp_mm");
    }
}

#[test]
fn what_is_no_json_is_a_string_missing_objects_are_made_and_null_takes_out() {
    assert_eq!(set("name=b c").unwrap()["name"], json!("b c"));
    assert_eq!(set("name=\"4\"").unwrap()["name"], json!("4"));
    assert_eq!(set("operations[1].pattern.copies=3").unwrap()["operations"][1]["pattern"]["copies"], json!(3));
    assert_eq!(set("post.dialect=haas").unwrap()["post"]["dialect"], json!("haas"));
    let without = set("operations[0].tolerances.cusp_mm=null").unwrap();
    assert_eq!(without["operations"][0]["tolerances"], json!({}));
}

#[test]
fn a_key_that_leads_nowhere_is_named() {
    for (text, named) in [
        ("operations[2].name=x", "operations[2]"),
        ("operations.first.name=x", "operations.first"),
        ("name.of=x", "name.of"),
        ("no value", "KEY=VALUE"),
        ("a..b=1", "a..b"),
        ("=1", "not a key"),
    ] {
        let why = set(text).expect_err(text);
        assert!(why.contains(named), "{text}: {why}");
    }
}

#[test]
fn a_message_about_the_value_or_what_holds_it_is_about_the_setting() {
    let setting: JobSetting = "operations[1].tolerances.cusp_mm=-1".parse().unwrap();
    assert!(setting.is_meant_by("operations[1].tolerances.cusp_mm: must be above 0"));
    assert!(setting.is_meant_by("operations[1].tolerances: unknown field"));
    assert!(!setting.is_meant_by("operations[1].tolerances.cusp: x"));
    assert!(!setting.is_meant_by("operations[10]: x"));
    assert!(!setting.is_meant_by("operations[10].tolerances.cusp_mm: x"));
}
