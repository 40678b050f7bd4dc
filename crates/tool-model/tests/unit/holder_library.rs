use super::*;

const HOLDERS: &str = r#"{ "format": "facemill-holders/1", "holders": [
        { "name": "slim", "bore_mm": 12, "stick_out_mm": [30, 60], "projection_mm": 80, "clearance_mm": 2, "sections": [
            { "length_mm": 50, "diameter_low_mm": 20, "diameter_high_mm": 26 },
            { "length_mm": 30, "diameter_low_mm": 50, "diameter_high_mm": 50 } ] },
        { "name": "stout", "bore_mm": 12, "stick_out_mm": [34, 70], "projection_mm": 60, "clearance_mm": 2, "sections": [
            { "length_mm": 60, "diameter_low_mm": 40, "diameter_high_mm": 50 } ] } ] }"#;

#[test]
fn faults_name_the_holder_and_its_field() {
    assert_eq!(HolderLibrary::from_json(HOLDERS.as_bytes()).unwrap().holders().len(), 2);
    for (key, to, reported) in [
        ("\"stout\"", "\"slim\"", "holders[1].name"),
        ("\"bore_mm\": 12", "\"bore_mm\": 0", "holders[0].bore_mm"),
        ("[34, 70]", "[34, 30]", "holders[1].stick_out_mm[1]"),
        ("\"projection_mm\": 80", "\"projection_mm\": 81", "holders[0].sections: reach to 80"),
        ("\"clearance_mm\": 2", "\"clearance_mm\": -1", "holders[0].clearance_mm"),
        ("\"length_mm\": 50", "\"length_mm\": 0", "holders[0].sections[].length_mm"),
        ("holders/1", "holders/2", "format"),
        ("\"bore_mm\"", "\"bore\"", "did you mean"),
    ] {
        assert!(HOLDERS.contains(key));
        let why = HolderLibrary::from_json(HOLDERS.replacen(key, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(why.contains(reported), "{why}");
    }
    let none = r#"{ "format": "facemill-holders/1", "holders": [] }"#;
    assert_eq!(HolderLibrary::from_json(none.as_bytes()), Err(HolderError::Empty));
}

#[test]
fn a_tool_goes_into_holders_of_its_shank_at_their_shortest() {
    let tool = r#"{ "format": "facemill-tool/1", "name": "12", "number": 1, "radius_mm": 6, "corner_radius_mm": 1,
            "n_inserts": 4, "flute_length_mm": 20, "max_ramp_angle_deg": 1, "spindle_rotation": "clockwise",
            "stick_out_mm": 50, "gauge_length_mm": 100,
            "body": { "clearance_mm": 0.5, "sections": [ { "length_mm": 30, "diameter_low_mm": 12, "diameter_high_mm": 12 } ] },
            "holder": { "clearance_mm": 1, "sections": [ { "length_mm": 50, "diameter_low_mm": 60, "diameter_high_mm": 60 } ] } }"#;
    let tool = ToolAssembly::from_json(tool.as_bytes()).unwrap();
    let library = HolderLibrary::from_json(HOLDERS.as_bytes()).unwrap();
    for (holder, expected) in library.holders().iter().zip([[30.0, 110.0], [34.0, 94.0]]) {
        let open = holder.with_tool(&tool).unwrap();
        let mut lengths = [0.0; 4];
        open.rest(&mut lengths);
        assert_eq!([lengths[1], lengths[3]], expected);
        let built = open.built(&lengths).unwrap().tool;
        assert_eq!(built.to_file().holder.sections, holder.sections);
        assert_eq!((built.stick_out(), built.gauge_length()), (expected[0], expected[1]));
        assert_eq!(built.to_file().body.sections[0].length_mm, expected[0] - 20.0);
    }
    let mut thick = tool.to_file();
    thick.body.sections[0].diameter_high_mm = 16.0;
    let why = library.holders()[0].with_tool(&ToolAssembly::new(thick).unwrap()).unwrap_err();
    assert_eq!(why, HolderError::OtherShank { bore_mm: 12.0, shank_mm: 16.0 });
}
