use super::*;
use facemill_test_kit::Random;
use nalgebra::Matrix3;

fn leaning(tilt_deg: f64) -> Posture {
    Posture { tilt: tilt_deg.to_radians(), rotate: 0.0 }
}

#[test]
fn strip_of_a_ball_on_plane_and_sphere_is_the_closed_form() {
    let (r, cusp) = (5.0, 0.05);
    let ball = Cutter::new(r, r, 10.0).unwrap();
    let plane = strip_width(&ball, leaning(10.0), &FeedCurvature::default(), cusp, 100.0);
    assert!((plane - 2.0 * (2.0 * r * cusp - cusp * cusp).sqrt()).abs() < 1e-5, "{plane}");
    // Sphere of radius R: centres on R + r, ridge on R + h, sides of a triangle with the third r.
    for radius in [2.5f64, 40.0, -60.0] {
        let (far, near) = ((radius + r).abs(), (radius + cusp).abs());
        let half = ((far * far + near * near - r * r) / (2.0 * far * near)).acos();
        let round = FeedCurvature { along: 1.0 / radius, twist: 0.0, across: 1.0 / radius };
        let found = strip_width(&ball, leaning(10.0), &round, cusp, 100.0);
        let exact = 2.0 * half * radius.abs();
        assert!((found - exact).abs() < 1e-5, "{radius}: {found} {exact}");
    }
}

#[test]
fn strip_of_a_leaning_disc_is_that_of_its_ellipse() {
    let disc = Cutter::new(80.0, 0.0, 10.0).unwrap();
    for (tilt, cusp) in [(2.0f64, 0.1f64), (5.0, 0.1), (15.0, 0.02)] {
        let found = strip_width(&disc, leaning(tilt), &FeedCurvature::default(), cusp, 160.0);
        let cos = 1.0 - cusp / (80.0 * tilt.to_radians().sin());
        let exact = 160.0 * (1.0 - cos * cos).sqrt();
        assert!((found / exact - 1.0).abs() < 1e-6, "{tilt}: {found} {exact}");
    }
}

#[test]
fn the_strip_leaves_the_cusp_and_no_other_direction_is_wider() {
    let mut random = Random(19);
    for _ in 0..300 {
        let radius = random.between(2.0, 80.0);
        let corner = radius * random.unit();
        let cutter = Cutter::new(radius, corner, corner.max(10.0)).unwrap();
        let posture = Posture { tilt: random.between(0.01, 0.6), rotate: random.between(-1.4, 1.4) };
        let (cusp, largest) = (random.between(0.005, 0.2), random.between(0.2, 1.5) * radius);
        let across = random.between(-0.2, 0.5) / radius;
        let width = strip_width(&cutter, posture, &FeedCurvature::straight(across), cusp, largest);
        let outline = Outline::new(&cutter, posture);
        let left = cusp_height_between(&outline, &outline, width, &FeedCurvature::straight(across));
        let Cusp::Height(height) = left else { panic!("{left:?}") };
        assert!(
            height <= cusp * (1.0 + 1e-5) && (width == largest || height >= cusp * (1.0 - 1e-5)),
            "{height} {cusp}"
        );
        // Tensor of principal curvatures `across` and more, cut in all directions.
        let normal = Vector3::z_axis();
        let tensor = Matrix3::from_diagonal(&Vector3::new(across + random.between(0.0, 0.3) / radius, across, 0.0));
        let turn = random.between(0.0, std::f64::consts::PI);
        let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::new(turn.cos(), turn.sin(), 0.0)).unwrap();
        let curvature = CurvatureTensor { normal, tensor };
        let widths = StripWidths::at(&cutter, &CutPoint { cc, posture }, Some(&curvature), (cusp, largest));
        assert!(widths.as_cut <= widths.widest * (1.0 + 1e-5), "{widths:?}");
    }
}

#[test]
fn the_nearest_cut_is_that_of_a_search_through_all_segments() {
    let mut random = Random(7);
    let mut point = || {
        let position = Point3::new(random.between(0.0, 50.0), random.between(0.0, 50.0), random.between(0.0, 5.0));
        let up = if random.unit() < 0.3 { -1.0 } else { 1.0 };
        let cc = CcPoint::new(position, Vector3::new(random.unit() - 0.5, 0.2, up), Vector3::x()).unwrap();
        CutPoint { cc, posture: leaning(10.0 * random.unit()) }
    };
    let passes: Vec<Vec<CutPoint>> = (0..12).map(|n| (0..n).map(|_| point()).collect()).collect();
    let nearest = NearestCuts::new(passes.clone());
    for _ in 0..200 {
        let place = point().cc.position;
        let slow = passes
            .iter()
            .flat_map(|pass| pass.windows(2))
            .filter(|w| w.iter().any(|p| p.cc.normal.z > 0.0))
            .map(|w| (foot(&place, [&w[0], &w[1]]).1 - place).norm())
            .fold(f64::INFINITY, f64::min);
        let found = nearest.nearest(&place, &Vector3::z_axis()).unwrap();
        assert!(((found.cc.position - place).norm() - slow).abs() < 1e-12);
    }
    assert!(NearestCuts::new(vec![vec![point()]]).nearest(&Point3::origin(), &Vector3::z_axis()).is_none());
}
