//! The `post` section of a job file.

use facemill_file_format::{from_json, schema, to_json};
use facemill_nc_program::dialect::{Decimals, PostFile};
use facemill_nc_program::*;

#[test]
fn a_dialect_is_enough() {
    let post: PostFile = from_json(br#"{"dialect": "fanuc"}"#).unwrap();
    assert_eq!(post, PostFile::default());
    assert_eq!((post.feed_mode, post.program_number, post.template.as_deref()), (FeedMode::G94, 1001, None));
    assert_eq!(post.decimals, Decimals { linear: 3, rotary: 3, feed: 1, inverse_time: 3 });
    assert_eq!(from_json::<PostFile>(to_json(&post).as_bytes()).unwrap(), post);
    let bound = post.settings(None).unwrap().rounding_bound();
    assert!((bound.linear - 0.0005).abs() < 1e-18 && (bound.rotary - 0.0005_f64.to_radians()).abs() < 1e-18);
}

#[test]
fn everything_can_be_said() {
    let text = r#"{"dialect": "fanuc", "feed_mode": "rtcp", "template": "my.j2", "program_number": 7, "program_name": "A",
        "block_numbers": null, "decimals": {"linear": 4}, "trailing_zeros": true, "max_line_length": 60}"#;
    let post: PostFile = from_json(text.as_bytes()).unwrap();
    assert_eq!((post.decimals.linear, post.decimals.rotary, post.block_numbers), (4, 3, None));
    assert_eq!(from_json::<PostFile>(to_json(&post).as_bytes()).unwrap(), post);
    assert!(schema::<PostFile>().contains("\"additionalProperties\": false"));
}

#[test]
fn wrong_keys_and_values_are_named() {
    let error = |text: &str| from_json::<PostFile>(text.as_bytes()).unwrap_err().to_string();
    assert!(error(r#"{"dialect": "fanuc", "feed_mod": "g94"}"#).contains("did you mean `feed_mode`?"));
    assert!(error(r#"{"dialect": "fanus"}"#).contains("did you mean `fanuc`?"));
    assert!(error(r#"{"dialect": "fanuc", "decimals": {"liner": 4}}"#).contains("did you mean `linear`?"));
    let refused = |text: &str| from_json::<PostFile>(text.as_bytes()).unwrap().settings(None).unwrap_err().to_string();
    let post = |rest: &str| format!(r#"{{"dialect": "fanuc", {rest}}}"#);
    assert_eq!(refused(&post(r#""program_number": 0"#)), "program_number is 0: it must be from 1 to 99999999");
    assert_eq!(refused(&post(r#""decimals": {"rotary": 7}"#)), "decimals.rotary is 7: it must be from 0 to 6");
    assert!(refused(&post(r#""block_numbers": {"start": 1, "step": 0}"#)).starts_with("block_numbers.step is 0"));
    assert!(refused(&post(r#""max_line_length": 10"#)).starts_with("max_line_length is 10"));
}
