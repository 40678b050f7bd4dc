use super::*;

fn error_of(passes: &str) -> PathFileError {
    let text = format!(r#"{{"format": "facemill-path/1", "frame": "work", "passes": {passes}}}"#);
    read_path_file(text.as_bytes()).unwrap_err()
}

#[test]
fn a_path_written_is_the_path_read() {
    let file = PathFile {
        format: PathFormat::V1,
        frame: PathFrame::Mesh,
        passes: vec![
            PassFile { points_mm: vec![[0.1, 1.0 / 3.0, -2e-17], [1.0, 2.0, 3.0]], normals: None },
            PassFile {
                points_mm: vec![[0.0; 3], [1.0, 0.0, 0.0]],
                normals: Some(vec![[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]),
            },
        ],
    };
    assert_eq!(read_path_file(write_path_file(&file).as_bytes()), Ok(file));
}

#[test]
fn faults_of_a_file_are_named_by_field() {
    assert_eq!(error_of("[]"), PathFileError::NoPasses);
    let text = error_of(r#"[{"points_mm": [[0,0,0],[1,0,0]]}, {"points_mm": [[0,0,0]]}]"#).to_string();
    assert!(text.starts_with("passes[1].points_mm"), "{text}");
    let text = error_of(r#"[{"points_mm": [[0,0,0],[1,0,0]], "normals": [[0,0,1]]}]"#).to_string();
    assert!(text.starts_with("passes[0].normals") && text.contains("1 normals for 2 points"), "{text}");
    let text = error_of(r#"[{"points_mm": [[0,0,0],[1,0,0]], "normals": [[0,0,1],[0,0,0]]}]"#).to_string();
    assert!(text.starts_with("passes[0].normals[1]"), "{text}");
    let text = error_of(r#"[{"points_mm": [[0,0,0],[1,0]]}]"#).to_string();
    assert!(text.starts_with("passes[0].points_mm[1]"), "{text}");
    let text = error_of(r#"[{"points_mm": [[0,0,0],[1e200,0,0]]}]"#).to_string();
    assert!(text.starts_with("passes[0], point 1"), "{text}");
}

#[test]
fn another_format_a_wrong_key_and_a_missing_frame_are_refused_with_the_right_one() {
    let e = read_path_file(br#"{"format": "facemill-path/2", "frame": "work", "passes": []}"#).unwrap_err();
    assert!(e.to_string().contains("facemill-path/1"), "{e}");
    let e = read_path_file(br#"{"format": "facemill-path/1", "frame": "wrk", "passes": []}"#).unwrap_err();
    assert!(e.to_string().contains("did you mean `work`"), "{e}");
    let e = read_path_file(br#"{"format": "facemill-path/1", "passes": []}"#).unwrap_err();
    assert!(e.to_string().contains("frame"), "{e}");
    let text = br#"{"format": "facemill-path/1", "frame": "work", "passes": [{"point_mm": []}]}"#;
    assert!(read_path_file(text).unwrap_err().to_string().contains("did you mean `points_mm`"));
}

#[test]
fn a_nan_made_in_memory_is_refused() {
    let passes = vec![PassFile { points_mm: vec![[0.0; 3], [0.0, f64::NAN, 0.0]], normals: None }];
    let file = PathFile { format: PathFormat::V1, frame: PathFrame::Work, passes };
    assert_eq!(file.check(), Err(PathFileError::TooLarge { pass: 0, point: 1 }));
}
