use crate::surface::tree::*;
use crate::test_kit::Random;

fn random_boxes(n: usize, rng: &mut Random) -> Vec<Aabb> {
    (0..n)
        .map(|i| {
            let p = rng.point(10.0);
            let q = if i % 5 == 0 { p } else { p + rng.vector(1.0) };
            Aabb::of_points([&p, &q])
        })
        .collect()
}

#[test]
fn overlapping_items_are_those_of_a_plain_loop() {
    let mut rng = Random(1);
    for n in [0, 1, 3, 5, 17, 400] {
        let boxes = random_boxes(n, &mut rng);
        let tree = Tree::build(&boxes);
        tree.check_invariants().unwrap();
        for query in random_boxes(60, &mut rng) {
            let mut found = Vec::new();
            tree.visit_boxes(|b| b.intersects(&query), |i| found.push(i));
            found.sort_unstable();
            let plain: Vec<u32> = (0..n as u32).filter(|&i| boxes[i as usize].intersects(&query)).collect();
            assert_eq!(found, plain);
        }
    }
}

#[test]
fn nearest_takes_the_lowest_number_of_equal_values() {
    let mut rng = Random(2);
    let mut boxes = random_boxes(100, &mut rng);
    boxes.extend(boxes.clone());
    let tree = Tree::build(&boxes);
    for _ in 0..100 {
        let p = rng.point(12.0);
        let d = |i: usize| boxes[i].distance_sq(&p);
        let (item, value) = tree.nearest(f64::INFINITY, |b| b.distance_sq(&p), |i, _| Some(d(i as usize))).unwrap();
        let plain = (0..200).min_by(|&a, &b| d(a).total_cmp(&d(b))).unwrap();
        assert_eq!((item as usize, value), (plain, d(plain)));
        let at_limit = tree.nearest(value, |b| b.distance_sq(&p), |i, _| Some(d(i as usize)));
        assert_eq!(at_limit, Some((item, value)), "the limit itself is still found");
        let below = tree.nearest(value.next_down(), |b| b.distance_sq(&p), |i, _| Some(d(i as usize)));
        assert_eq!(below, None);
    }
}

#[test]
fn any_boxes_give_a_tree_that_is_not_too_deep() {
    let point = |x: f64| Aabb::of_points([&nalgebra::Point3::new(x, 0.0, 0.0)]);
    // Distances that shrink geometrically make the heuristic peel off one item after the other.
    let mut boxes: Vec<Aabb> = (0..900).map(|k| point(2f64.powi(500 - k))).collect();
    boxes.extend(std::iter::repeat_n(point(1.0), 500));
    boxes.extend([Aabb::EMPTY, point(f64::NAN), point(f64::INFINITY)]);
    let tree = Tree::build(&boxes);
    tree.check_invariants().unwrap();
    let mut n = 0;
    tree.visit_boxes(|_| true, |_| n += 1);
    assert_eq!(n, 1400);
}
