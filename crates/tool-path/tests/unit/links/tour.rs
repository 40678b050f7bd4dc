use crate::links::tour::*;
use facemill_test_kit::Random;

/// Returns asymmetric costs that follow no distance; every other set has many equal ones.
fn random_costs(random: &mut Random, n: usize) -> TourCosts {
    let is_coarse = random.unit() < 0.5;
    let mut all = |n: usize| -> Vec<f64> {
        let cost = |u: f64| if is_coarse { (4.0 * u).floor() } else { 10.0 * u };
        (0..n).map(|_| cost(random.unit())).collect()
    };
    TourCosts::new(all(n * n), all(n), all(n)).unwrap()
}

/// Enumerates all orders in which no pass comes before one that has to be cut first.
fn least_of_all(costs: &TourCosts, order: &mut Vec<usize>, k: usize) -> f64 {
    if k == order.len() {
        let is_late = |(at, pass): (usize, &usize)| order[..at].iter().any(|p| costs.before[pass * costs.n + p]);
        let is_wrong = !costs.before.is_empty() && order.iter().enumerate().any(is_late);
        return if is_wrong { f64::INFINITY } else { costs.of(order) };
    }
    let mut least = f64::INFINITY;
    for j in k..order.len() {
        order.swap(k, j);
        least = least.min(least_of_all(costs, order, k + 1));
        order.swap(k, j);
    }
    least
}

fn is_permutation(order: &[usize], n: usize) -> bool {
    let mut sorted = order.to_vec();
    sorted.sort_unstable();
    sorted == (0..n).collect::<Vec<_>>()
}

#[test]
fn few_passes_are_in_the_best_of_all_orders_and_bounds_are_below_it() {
    let mut rng = Random(3);
    for n in 0..=7 {
        for _ in 0..20 {
            let costs = random_costs(&mut rng, n);
            let tour = shortest_tour(&costs);
            let least = if n == 0 { 0.0 } else { least_of_all(&costs, &mut (0..n).collect(), 0) };
            assert!(is_permutation(&tour.order, n) && tour.is_exact);
            assert!((tour.cost - least).abs() < 1e-9, "{n}: {} {least}", tour.cost);
            assert!(n == 0 || lower_bound(&costs) <= least + 1e-9, "{n}: {} {least}", lower_bound(&costs));
            // The result for many passes is an order, too, and no better than the best.
            let other = improved(&costs, (0..n).collect::<Vec<_>>());
            assert!(n == 0 || is_permutation(&other, n) && costs.of(&other) >= least - 1e-9);
        }
    }
}

#[test]
fn passes_that_have_to_be_cut_first_are_and_few_are_in_the_best_order_of_those() {
    let mut rng = Random(13);
    for n in 2..=7 {
        for _ in 0..20 {
            let share = rng.unit();
            let pairs: Vec<(usize, usize)> =
                (0..n).flat_map(|b| (0..b).map(move |a| (a, b))).filter(|_| rng.unit() < share).collect();
            let costs = random_costs(&mut rng, n).keeping(pairs.clone()).unwrap();
            let least = least_of_all(&costs, &mut (0..n).collect(), 0);
            let tour = shortest_tour(&costs);
            assert!(is_permutation(&tour.order, n) && tour.is_exact && costs.allow(&tour.order));
            assert!((tour.cost - least).abs() < 1e-9, "{n} {pairs:?}: {} {least}", tour.cost);
            let nearest = (0..n).filter_map(|first| nearest_next(&costs, first));
            for order in nearest.chain([(0..n).collect()]) {
                let other = improved(&costs, order);
                assert!(is_permutation(&other, n) && costs.allow(&other) && costs.of(&other) >= least - 1e-9);
            }
        }
    }
    for n in [13, 40] {
        let pairs = (0..n).flat_map(|b| (0..b).map(move |a| (a, b))).filter(|(a, b)| (a + b) % 3 == 0);
        let costs = random_costs(&mut rng, n).keeping(pairs).unwrap();
        let tour = shortest_tour(&costs);
        assert!(is_permutation(&tour.order, n) && costs.allow(&tour.order) && tour.lower_bound <= tour.cost);
        let as_is: Vec<usize> = (0..n).collect();
        assert!(tour.cost < costs.of(&as_is) && costs.allow(&as_is));
        let turned: Vec<usize> = (0..n).rev().collect();
        assert!(!costs.allow(&turned));
    }
    let three = || random_costs(&mut Random(1), 3);
    assert_eq!(three().keeping([(2, 1)]), Err(TourError::Order { first: 2, second: 1 }));
    assert_eq!(three().keeping([(0, 3)]), Err(TourError::Order { first: 0, second: 3 }));
}

#[test]
fn many_passes_cost_no_more_than_as_they_are_and_no_less_than_the_bound() {
    let mut rng = Random(5);
    for n in [13, 20, 60] {
        let costs = random_costs(&mut rng, n);
        let tour = shortest_tour(&costs);
        assert!(is_permutation(&tour.order, n) && !tour.is_exact);
        assert!((tour.cost - costs.of(&tour.order)).abs() < 1e-9);
        assert!(tour.cost <= costs.of(&(0..n).collect::<Vec<_>>()) && tour.lower_bound <= tour.cost);
    }
}

#[test]
fn passes_on_a_line_are_driven_along_it() {
    let mut rng = Random(8);
    let mut places: Vec<f64> = (0..40).map(|_| 100.0 * rng.unit()).collect();
    let links = places.iter().flat_map(|a| places.iter().map(move |b| (b - a).abs())).collect();
    let costs = TourCosts::new(links, places.clone(), vec![0.0; 40]).unwrap();
    let tour = shortest_tour(&costs);
    places.sort_by(f64::total_cmp);
    // From 0 to the farthest one, past all others.
    assert!((tour.cost - places[39]).abs() < 1e-9, "{} {}", tour.cost, places[39]);
}

#[test]
fn costs_that_are_none_are_refused() {
    let new = |links: &[f64], first: &[f64]| TourCosts::new(links.to_vec(), first.to_vec(), vec![0.0; first.len()]);
    assert!(matches!(new(&[0.0; 3], &[0.0; 2]), Err(TourError::Counts { links: 3, first: 2, last: 2 })));
    assert_eq!(new(&[0.0, -1.0, 0.0, 0.0], &[0.0; 2]), Err(TourError::Cost));
    assert_eq!(new(&[0.0; 4], &[0.0, f64::NAN]), Err(TourError::Cost));
    // The entry from a pass to itself is not used.
    assert!(new(&[f64::NAN, 1.0, 1.0, f64::NAN], &[0.0; 2]).is_ok());
}

#[test]
fn costs_learnt_order_by_order_give_the_best_of_all_orders_and_none_is_learnt_twice() {
    use std::sync::Mutex;
    let mut rng = Random(29);
    let (mut learnt, mut all) = (0, 0);
    for n in 0..=7 {
        for _ in 0..20 {
            let costs = random_costs(&mut rng, n);
            let mut share = || 0.3 + 0.7 * rng.unit();
            let links = costs.links.iter().map(|c| share() * c).collect();
            let first = costs.first.iter().map(|c| share() * c).collect();
            let bounds = TourCosts::new(links, first, costs.last.clone()).unwrap();
            let asked = Mutex::new(Vec::new());
            let cost = |(from, to): TourLink| {
                asked.lock().unwrap().push((from, to));
                Ok::<f64, ()>(from.map_or(costs.first[to], |from| costs.link(from, to)))
            };
            let found = shortest_tour_by(bounds, &cost).unwrap();
            let present: Vec<usize> = (0..n).collect();
            let least = if n == 0 { 0.0 } else { least_of_all(&costs, &mut present.clone(), 0) };
            assert!(is_permutation(&found.tour.order, n));
            assert!((found.tour.cost - costs.of(&found.tour.order)).abs() < 1e-9);
            assert!((found.present_cost - costs.of(&present)).abs() < 1e-9);
            assert!(found.tour.lower_bound <= least + 1e-9 && found.tour.cost >= least - 1e-9);
            assert!(found.tour.cost <= found.present_cost);
            // Only where twelve orders were not enough may there be a better one.
            assert!(!found.tour.is_exact || found.tour.cost <= least + 1e-9, "{n}: {} {least}", found.tour.cost);
            let mut asked = asked.into_inner().unwrap();
            let calls = asked.len();
            asked.sort_unstable();
            asked.dedup();
            assert_eq!(asked.len(), calls);
            assert_eq!(asked.iter().filter(|(from, _)| from.is_some()).count(), found.links);
            (learnt, all) = (learnt + calls, all + n * n);
        }
    }
    // Fewer than all are learnt.
    assert!(5 * learnt < 4 * all, "{learnt} of {all}");
}

#[test]
fn an_order_that_was_made_out_to_be_shorter_than_it_is_is_not_taken() {
    // Thirty passes on a line, laid in order; links back look free, and cost most.
    let n = 30;
    let links = (0..n * n).map(|k| if k % n == k / n + 1 { 1.0 } else { 0.5 }).collect();
    let bounds = TourCosts::new(links, vec![0.0; n], vec![0.0; n]).unwrap();
    let cost = |(from, to): TourLink| Ok::<f64, ()>(from.map_or(0.0, |from| if to == from + 1 { 1.0 } else { 9.0 }));
    let found = shortest_tour_by(bounds, &cost).unwrap();
    assert_eq!((found.tour.cost, found.present_cost), (29.0, 29.0));
    assert_eq!(found.tour.order, (0..n).collect::<Vec<_>>());
    let wrong = |_: TourLink| Err("stopped");
    let bounds = TourCosts::new(vec![0.0; 4], vec![0.0; 2], vec![0.0; 2]).unwrap();
    assert_eq!(shortest_tour_by(bounds, &wrong), Err("stopped"));
}

#[test]
fn orders_of_many_passes_by_learnt_costs_are_about_as_good_as_by_all_costs() {
    let mut rng = Random(31);
    let mut worst: f64 = 1.0;
    for n in [13, 20, 40, 60] {
        for _ in 0..5 {
            // Places in a square, and links that take up to half as long again as the straight way.
            let places: Vec<[f64; 2]> = (0..n).map(|_| [10.0 * rng.unit(), 10.0 * rng.unit()]).collect();
            let way = |a: usize, b: usize| (places[a][0] - places[b][0]).hypot(places[a][1] - places[b][1]);
            let links: Vec<f64> = (0..n * n).map(|k| way(k / n, k % n)).collect();
            let ends = vec![0.0; n];
            let bounds = TourCosts::new(links.clone(), ends.clone(), ends.clone()).unwrap();
            let real: Vec<f64> = links.iter().map(|c| c * (1.0 + 0.5 * rng.unit())).collect();
            let costs = TourCosts::new(real, ends.clone(), ends).unwrap();
            let cost = |(from, to): TourLink| Ok::<f64, ()>(from.map_or(0.0, |from| costs.link(from, to)));
            let found = shortest_tour_by(bounds, &cost).unwrap();
            assert!(found.tour.cost <= found.present_cost && found.links <= 13 * n);
            worst = worst.max(found.tour.cost / shortest_tour(&costs).cost);
        }
    }
    assert!(worst < 1.1, "{worst}");
}
