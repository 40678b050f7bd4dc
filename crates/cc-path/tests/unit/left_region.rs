use super::*;
use crate::test_kit::Random;

fn up() -> Unit<Vector3<f64>> {
    Vector3::z_axis()
}

fn on_plane(x: f64, y: f64, height: f64) -> StockHeight {
    let reach = std::f64::consts::SQRT_2;
    StockHeight { position: Point3::new(x, y, 0.0), normal: up(), height, reach, area: 1.0 }
}

/// Heights at the points of a lattice of 1 mm over 40 mm × 30 mm.
fn lattice(height: impl Fn(f64, f64) -> f64) -> Vec<StockHeight> {
    let at = |k: i32| f64::from(k) + 0.37;
    (0..30).flat_map(|j| (0..40).map(move |i| (at(i), at(j)))).map(|(x, y)| on_plane(x, y, height(x, y))).collect()
}

fn random_balls(rng: &mut Random, n: usize) -> Vec<Ball> {
    let ball = |rng: &mut Random| {
        // Some on a lattice, so that distances are equal.
        let p = rng.point(10.0);
        let center = if rng.unit() < 0.5 { p.map(f64::round) } else { p };
        Ball { center, radius: 0.5 + rng.unit(), normal: rng.direction() }
    };
    (0..n).map(|_| ball(rng)).collect()
}

#[test]
fn the_tree_finds_what_a_search_of_all_balls_finds() {
    let mut rng = Random(1);
    for n in [0, 1, 8, 9, 500] {
        let balls = random_balls(&mut rng, n);
        let tree = BallTree::new(balls.clone());
        for _ in 0..200 {
            let (p, facing) = (rng.point(12.0), rng.direction());
            let least = -4.0 * rng.unit();
            let depth = |b: &Ball| b.radius - (p - b.center).norm();
            let facing_balls = balls.iter().filter(|b| b.normal.dot(&facing) > 0.0);
            assert_eq!(tree.deepest(&p, Some(&facing), least), facing_balls.map(depth).fold(least, f64::max));
            assert_eq!(tree.deepest(&p, None, least), balls.iter().map(depth).fold(least, f64::max));
            let mut found = Vec::new();
            tree.visit_within(&p, 3.0, &mut |k| found.push(k));
            found.sort_unstable();
            let near: Vec<usize> = (0..n).filter(|&k| (balls[k].center - p).norm() <= 3.0).collect();
            assert_eq!(found, near);
        }
    }
}

#[test]
fn islands_are_the_components_of_touching_balls() {
    let mut rng = Random(2);
    for overlap in [0.1, 0.6, 2.0] {
        let places: Vec<StockHeight> = random_balls(&mut rng, 300)
            .into_iter()
            .map(|b| StockHeight {
                position: b.center,
                normal: b.normal,
                height: rng.unit(),
                reach: b.radius,
                area: 2.0,
            })
            .collect();
        let touch = |a: &StockHeight, b: &StockHeight| {
            let gap = (a.position - b.position).norm() - a.reach - b.reach;
            gap <= 2.0 * overlap && a.normal.dot(&b.normal) > 0.0
        };
        let mut label: Vec<usize> = (0..places.len()).collect();
        for i in 0..places.len() {
            for j in 0..i {
                if touch(&places[i], &places[j]) {
                    let (a, b) = (label[i].min(label[j]), label[i].max(label[j]));
                    label.iter_mut().filter(|l| **l == b).for_each(|l| *l = a);
                }
            }
        }
        let region = LeftRegion::new(&places, -1.0, overlap);
        let islands = region.islands();
        assert_eq!(islands.iter().map(|i| i.places.len()).sum::<usize>(), places.len());
        for island in &islands {
            let of = label[island.places[0]];
            let members: Vec<usize> = (0..places.len()).filter(|&k| label[k] == of).collect();
            assert_eq!(island.places, members);
            assert_eq!(island.area, 2.0 * members.len() as f64);
            let highest = members.iter().map(|&k| places[k].height).fold(0.0, f64::max);
            assert!(members.iter().any(|&k| places[k].height == highest && places[k].position == island.highest));
        }
    }
}

#[test]
fn a_ridge_between_the_lines_is_found_by_its_sides() {
    let limit = 0.15;
    for k in 0..20 {
        // Between two rows of lines, as high as 0.05 mm above the limit, while the lines beside
        // it may be below.
        let (ridge, slope) = (15.0 + 0.05 * f64::from(k), 0.3);
        let height = |_: f64, y: f64| limit + 0.05 - slope * (y - ridge).abs();
        let region = LeftRegion::new(&lattice(height), limit, 1.0);
        for x in [2.0, 11.3, 30.9] {
            assert!(region.contains(&Point3::new(x, ridge, 0.0), &up()), "ridge at {ridge}");
        }
        let far = region.places().iter().map(|p| (p.position.y - ridge).abs()).fold(0.0, f64::max);
        assert!(far < 1.2, "{far} mm from the ridge at {ridge}");
    }
}

#[test]
fn flat_stock_below_the_limit_is_not_left_and_unknown_stock_is() {
    assert!(LeftRegion::new(&lattice(|_, _| 0.1499), 0.15, 1.0).is_empty());
    assert_eq!(LeftRegion::new(&lattice(|_, _| 0.1501), 0.15, 1.0).places().len(), 1200);
    let unknown = LeftRegion::new(&lattice(|x, _| if x < 3.0 { f64::INFINITY } else { -f64::INFINITY }), 0.15, 1.0);
    assert_eq!(unknown.places().len(), 90);
    assert_eq!(unknown.area(), 90.0);
}

#[test]
fn the_other_side_of_a_thin_wall_is_not_near() {
    let region = LeftRegion::new(&lattice(|_, _| 1.0), 0.15, 5.0);
    let p = Point3::new(20.0, 15.0, -1.0);
    assert!(region.contains(&p, &up()) && !region.contains(&p, &-up()));
    assert!(
        region.is_cut(&Point3::new(-5.0, 15.0, 0.0), &up()) && !region.is_cut(&Point3::new(-7.0, 15.0, 0.0), &up())
    );
}
