use super::*;

fn point(position: [f64; 3], normal: Vector3<f64>, strip_use: Option<f64>) -> DrawnPoint {
    DrawnPoint { position: position.into(), normal: Unit::new_normalize(normal), strip_use }
}

fn coordinates(svg: &str) -> Vec<[f64; 2]> {
    let lists = svg.split("points=\"").skip(1).map(|rest| rest.split('"').next().unwrap());
    let pair = |p: &str| {
        let (x, y) = p.split_once(',').unwrap();
        [x.parse().unwrap(), y.parse().unwrap()]
    };
    lists.flat_map(|list| list.split(' ').map(pair).collect::<Vec<_>>()).collect()
}

#[test]
fn a_flat_region_is_drawn_once_in_scale_with_shares_of_length() {
    let pass = |y: f64, share: Option<f64>| {
        (0..=10).map(|k| point([0.0, y, 20.0 * f64::from(k)], Vector3::x(), share)).collect::<Vec<_>>()
    };
    let passes = [pass(0.0, None), pass(10.0, Some(0.95)), pass(20.0, Some(0.95)), pass(30.0, Some(1.4))];
    let svg = passes_svg("A & B", "figures", &passes);
    assert!(svg.contains("A &amp; B") && !svg.contains("from behind"));
    for text in ["to 100 % (50.0 %)", "wider than allowed (25.0 %)", "no pass beside (25.0 %)", ">50 mm<"] {
        assert!(svg.contains(text), "{text}: {svg}");
    }
    let at = coordinates(&svg);
    let extent = |k: usize| {
        let all = at.iter().map(|p| p[k]);
        all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
    };
    // The longer side lies across; both have one scale.
    assert!((extent(0) - WIDTH).abs() < 0.2 && (extent(1) - WIDTH * 30.0 / 200.0).abs() < 0.2, "{at:?}");
}

#[test]
fn the_far_side_of_a_closed_surface_gets_a_view_of_its_own() {
    let ring = |z: f64| {
        let at = |k: u32| f64::from(k) * std::f64::consts::TAU / 40.0;
        let on = |a: f64| point([30.0 * a.cos(), 30.0 * a.sin(), z], Vector3::new(a.cos(), a.sin(), 0.0), Some(0.3));
        (0..=40).map(|k| on(at(k))).collect::<Vec<_>>()
    };
    let passes: Vec<_> = (0..40).map(|k| ring(5.0 * f64::from(k))).collect();
    let svg = passes_svg("ring", "", &passes);
    assert!(svg.contains("from behind") && svg.contains("below 50 % (100.0 %)"));
    assert!(coordinates(&svg).iter().flatten().all(|c| c.is_finite()));
    assert!(passes_svg("nothing", "", &[]).ends_with("</svg>\n"));
}

#[test]
fn classes_cover_every_share() {
    for (share, class) in [(0.0, 0), (0.5, 0), (0.71, 2), (1.0, 4), (1.01, 5), (f64::INFINITY, 5), (f64::NAN, 0)] {
        assert_eq!(class_of(Some(share)), class, "{share}");
    }
    assert_eq!(style(class_of(None)), NONE_BESIDE);
}
