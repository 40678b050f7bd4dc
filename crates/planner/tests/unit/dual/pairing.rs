use super::*;
use facemill_test_kit::Random;
use nalgebra::{Point3, Vector3};

fn pass(random: &mut Random, n: usize, z: f64) -> Vec<CcPoint> {
    let mut x = 0.0;
    (0..n)
        .map(|_| {
            x += 0.5 + random.unit();
            CcPoint::new(Point3::new(x, random.unit(), z), Vector3::z(), Vector3::x()).unwrap()
        })
        .collect()
}

/// Every point of both passes is at a station, in its order, and stations in between are on the
/// line of their neighbours.
#[test]
fn stations_pass_all_points_of_both() {
    let mut random = Random(3);
    for (n, m) in [(30, 30), (30, 47), (12, 40), (2, 2), (9, 3), (100, 61)] {
        let passes = [pass(&mut random, n, 0.0), pass(&mut random, m, -10.0)];
        let found = stations([&passes[0], &passes[1]], [20.0, 20.0]);
        for h in 0..2 {
            let whole: Vec<usize> = found.iter().filter(|s| s.at[h].fract() == 0.0).map(|s| s.at[h] as usize).collect();
            assert_eq!(whole, (0..passes[h].len()).collect::<Vec<_>>(), "{n} {m}");
            for s in &found {
                let k = s.at[h].floor() as usize;
                let (a, b) = (passes[h][k].position, passes[h][(k + 1).min(passes[h].len() - 1)].position);
                let on_line = a + (b - a) * s.at[h].fract();
                assert!((s.pair.cc[h].position - on_line).norm() < 1e-9);
            }
            let way: f64 = found.iter().map(|s| s.pair.way[h]).sum();
            let length: f64 = passes[h].windows(2).map(|w| (w[1].position - w[0].position).norm()).sum();
            assert!((way - length).abs() < 1e-9 * length.max(1.0));
        }
    }
}

/// A pass that is many times shorter is stretched over the longer one only as far as points may
/// wait.
#[test]
fn passes_that_do_not_go_together_have_no_stations() {
    let mut random = Random(4);
    let passes = [pass(&mut random, 40, 0.0), pass(&mut random, 3, 0.0)];
    assert!(stations([&passes[0], &passes[1]], [20.0, 20.0]).is_empty());
}

/// Total score of the best pairing, all of them tried.
fn best(scores: &[Vec<f64>], i: usize, j: usize) -> f64 {
    if i == scores.len() || j == scores[0].len() {
        return 0.0;
    }
    let skip = best(scores, i + 1, j).max(best(scores, i, j + 1));
    skip.max(scores[i][j] + best(scores, i + 1, j + 1))
}

#[test]
fn the_best_pairs_in_order_are_found() {
    let mut random = Random(9);
    for _ in 0..100 {
        let scores: Vec<Vec<f64>> = (0..5).map(|_| (0..4).map(|_| random.unit() - 0.2).collect()).collect();
        let found = in_order(5, 4, |i, j| scores[i][j]);
        let sum: f64 = found.iter().map(|&[i, j]| scores[i][j]).sum();
        assert!((sum - best(&scores, 0, 0)).abs() < 1e-12);
        assert!(found.windows(2).all(|w| w[0][0] < w[1][0] && w[0][1] < w[1][1]));
    }
}
