use super::*;

#[test]
fn posture_of_undoes_tool_axis() {
    let cc = CcPoint::new(Point3::origin(), Vector3::new(0.3, -0.2, 0.9), Vector3::new(1.0, 0.4, 0.1)).unwrap();
    for tilt in [1e-9, 0.02, 0.7, 1.5, 3.0] {
        for rotate in [-3.1, -1.0, 0.0, 0.4, 3.1] {
            let found = cc.posture_of(&cc.tool_axis(Posture { tilt, rotate }));
            assert!((found.tilt - tilt).abs() < 1e-14, "{tilt} {rotate}: {found:?}");
            // The direction of a small tilt is known as well as the axis is.
            assert!((found.rotate - rotate).abs() < 1e-15 / tilt.sin() + 1e-14, "{tilt} {rotate}: {found:?}");
        }
    }
    assert_eq!(cc.posture_of(&cc.normal).rotate, 0.0);
}
