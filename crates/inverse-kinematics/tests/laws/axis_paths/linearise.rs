//! Laws of linearised ways: every block holds by dense sampling, no pose is lost, few positions,
//! typed errors.

use crate::common::*;
use crate::meant::*;
use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::motion::{Deviation, Linearisation, MotionTolerance, deviation_bound, linearise};
use facemill_inverse_kinematics::*;
use nalgebra::{Point3, Unit, Vector3};

const TOOL: f64 = 140.0;
const RADIUS: f64 = 40.0;

fn settings(law: impl Into<BlockLaw>, tip: f64, axis: f64, rim: f64) -> Linearisation {
    Linearisation::new(law, TOOL, MotionTolerance { tip, axis, rim, radius: RADIUS })
}

/// Returns poses from one position to the next, each a part `size` of the axes' ranges away; and
/// the first position.
fn wandering(machine: &Machine, r: &mut Random, n: usize, size: f64) -> (AxisValues, Vec<ClPoint>) {
    let start = random_values(r, machine);
    let mut q = start;
    let mut poses = vec![cl_by_matrices(machine, &q, TOOL)];
    for _ in 1..n {
        q = q.lerp(&random_values(r, machine), size);
        poses.push(cl_by_matrices(machine, &q, TOOL));
    }
    (start, poses)
}

#[test]
fn every_block_holds_the_tolerances_by_dense_sampling() {
    let mut r = Random(41);
    let (mut n_ways, mut n_between) = (0, 0);
    for machine in families() {
        for (k, law) in [CuttingLaw::AxesLinear, CuttingLaw::TipAndRotariesLinear].into_iter().enumerate() {
            for size in [1e-3, 0.02, 0.1] {
                let (start, poses) = wandering(&machine, &mut r, 5, size);
                // Each of the three tolerances is the narrowest one somewhere.
                let settings = match (n_ways + k) % 3 {
                    0 => settings(law, 0.01, 1.0, 1.0),
                    1 => settings(law, 1.0, 1e-4, 1.0),
                    _ => settings(law, 0.5, 0.1, 0.02),
                };
                let Ok(way) = linearise(&machine, &poses, &start, &settings) else {
                    continue;
                };
                check_places(&machine, TOOL, &poses, &way);
                let tolerance = settings.tolerance;
                for pair in way.positions.windows(2) {
                    let [mut tip, axis, mut rim] = sampled(&machine, TOOL, RADIUS, [&pair[0], &pair[1]], 60);
                    if law == CuttingLaw::TipAndRotariesLinear {
                        (tip, rim) = (0.0, RADIUS * axis);
                    }
                    assert!(
                        tip <= tolerance.tip + 1e-9 && axis <= tolerance.axis + 1e-10 && rim <= tolerance.rim + 1e-8
                    );
                    assert!(tip <= way.bound.tip + 1e-9 && axis <= way.bound.axis + 1e-10 && rim <= way.rim + 1e-8);
                }
                n_ways += 1;
                n_between += way.positions.len() - poses.len();
            }
        }
    }
    assert!(n_ways > 90 && n_between > 1000, "{n_ways} ways, {n_between} positions between poses");
}

/// Returns the fewest blocks from one pose to the next that hold, with ends on a fine grid of the
/// way: dynamic programming over all pairs of the grid.
fn fewest_blocks(machine: &Machine, grid: &[AxisValues], holds: impl Fn(usize, usize) -> bool) -> usize {
    let mut fewest = vec![0];
    for j in 1..grid.len() {
        let least = (0..j).filter(|&i| holds(i, j)).map(|i| fewest[i] + 1).min();
        fewest.push(least.unwrap_or_else(|| panic!("the grid is too coarse for {}", machine.name())));
    }
    fewest[grid.len() - 1]
}

#[test]
fn there_are_at_most_a_tenth_more_blocks_than_the_optimum() {
    const GRID: usize = 100;
    let mut r = Random(42);
    let (mut n_cases, mut found, mut optimum) = (0, 0, 0);
    for machine in families() {
        for _ in 0..5 {
            let (start, poses) = wandering(&machine, &mut r, 2, 0.03);
            let settings =
                settings(CuttingLaw::AxesLinear, 0.02 * 10f64.powf(r.between(0.0, 1.5)), 0.01, f64::INFINITY);
            let Ok(way) = linearise(&machine, &poses, &start, &settings) else { continue };
            let n = way.positions.len() - 1;
            if !(2..=12).contains(&n) {
                continue;
            }
            let mut near = way.positions[0];
            let grid = (0..=GRID).map(|k| {
                let cl = meant(&poses[0], &poses[1], k as f64 / GRID as f64);
                near = machine.nearest_inverse(&cl, TOOL, Some(&near), BranchPreference::Nearest).ok()?;
                Some(near)
            });
            // Where the way leaves the reach between its ends by less than the tolerance there is
            // no grid.
            let Some(grid) = grid.collect::<Option<Vec<AxisValues>>>() else { continue };
            let cls: Vec<ClPoint> = grid.iter().map(|q| machine.cl_point(q, TOOL)).collect();
            // By sampling, the middle first, which settles most blocks that are too long; and by
            // the bound.
            let sampled = |i: usize, j: usize| {
                [0.5, 0.4, 0.6, 0.45, 0.55, 0.3, 0.7, 0.2, 0.8].into_iter().all(|t| {
                    let cl = machine.cl_point(&grid[i].lerp(&grid[j], t), TOOL);
                    settings.tolerance.used_by(&apart(&cl, &meant(&cls[i], &cls[j], t))) <= 1.0
                })
            };
            let proven = |i: usize, j: usize| {
                let bound = deviation_bound(&machine, CuttingLaw::AxesLinear, &grid[i], &grid[j], TOOL);
                sampled(i, j) && settings.tolerance.used_by(&bound) <= 1.0
            };
            let provable = fewest_blocks(&machine, &grid, proven);
            assert!(n as f64 <= 1.1 * provable as f64, "{n} blocks, {provable} would do");
            n_cases += 1;
            found += n;
            optimum += fewest_blocks(&machine, &grid, sampled);
        }
    }
    assert!(n_cases > 50, "{n_cases}");
    // The optimum really holds, proven or not; its grid is finite too.
    assert!(100 * found <= 102 * optimum, "{found} blocks in all, {optimum} would do");
}

#[test]
fn blocks_between_two_poses_use_up_about_the_same() {
    let mut r = Random(43);
    let mut n_blocks = 0;
    for machine in families() {
        let (start, poses) = wandering(&machine, &mut r, 2, 0.05);
        let settings = settings(CuttingLaw::AxesLinear, 0.01, f64::INFINITY, f64::INFINITY);
        let Ok(way) = linearise(&machine, &poses, &start, &settings) else { continue };
        let tips = way.positions.windows(2).map(|p| sampled(&machine, TOOL, RADIUS, [&p[0], &p[1]], 30)[0]);
        let (least, most) = tips.fold((f64::INFINITY, 0.0_f64), |(a, b), tip| (a.min(tip), b.max(tip)));
        assert!(least > 0.8 * most, "{least} to {most} in {} blocks", way.positions.len() - 1);
        n_blocks += way.positions.len() - 1;
    }
    assert!(n_blocks > 100, "{n_blocks}");
}

#[test]
fn the_reported_bound_is_the_largest_of_all_blocks_and_no_run_differs() {
    let mut r = Random(44);
    let machine = Machine::head_b_table_c().unwrap();
    for law in
        [BlockLaw::from(CuttingLaw::AxesLinear), CuttingLaw::TipAndRotariesLinear.into(), RapidLaw::PerAxis.into()]
    {
        let (start, poses) = wandering(&machine, &mut r, 6, 0.02);
        let settings = settings(law, 0.5, 0.01, 1.0);
        let way = linearise(&machine, &poses, &start, &settings).unwrap();
        assert_eq!(linearise(&machine, &poses, &start, &settings).unwrap(), way);
        let bounds: Vec<Deviation> =
            way.positions.windows(2).map(|p| deviation_bound(&machine, law, &p[0], &p[1], TOOL)).collect();
        assert_eq!(bounds.iter().fold(Deviation::default(), |a, b| a.max(b)), way.bound);
        assert_eq!(bounds.iter().map(|b| b.rim(RADIUS)).fold(0.0, f64::max), way.rim);
        let used = |b: &Deviation| settings.tolerance.used_by(b);
        assert!(bounds.iter().all(|b| used(b) <= used(&bounds[way.at]) && used(b) <= 1.0));
    }
}

#[test]
fn bent_rapids_stay_near_the_straight_way() {
    let mut r = Random(45);
    let mut n_ways = 0;
    for machine in families() {
        let (start, poses) = wandering(&machine, &mut r, 3, 0.03);
        let settings = settings(RapidLaw::PerAxis, 2.0, 0.02, 5.0);
        let Ok(way) = linearise(&machine, &poses, &start, &settings) else { continue };
        n_ways += 1;
        check_places(&machine, TOOL, &poses, &way);
        assert!(way.positions.len() > 3, "{}", way.positions.len());
        for (pair, source) in way.positions.windows(2).zip(&way.source) {
            let ends = [&poses[source.pose], &poses[source.pose + 1]];
            let straight: Vec<ClPoint> = (0..=3000).map(|k| meant(ends[0], ends[1], f64::from(k) / 3000.0)).collect();
            let step = apart(&straight[0], &straight[1]);
            let time = machine.travel_time(&pair[0], &pair[1]);
            for k in 1..10 {
                let q = own_speeds(&machine, &pair[0], &pair[1], time * f64::from(k) / 10.0);
                let cl = cl_by_matrices(&machine, &q, TOOL);
                let near = |d: Deviation| d.tip <= 2.0 + 0.51 * step.tip && d.axis <= 0.02 + 0.51 * step.axis;
                assert!(straight.iter().any(|s| near(apart(s, &cl))), "{source}");
            }
        }
    }
    assert!(n_ways > 12, "{n_ways}");
}

#[test]
fn nothing_is_put_between_where_the_control_turns_the_vector_or_nothing_turns() {
    let machine = Machine::head_b_table_c().unwrap();
    let axis = |k: f64| Unit::new_normalize(Vector3::new(0.2, 0.3 + 0.1 * k, 1.0));
    let pose = |k: f64, axis| ClPoint { tip: Point3::new(100.0 * k, 50.0, 300.0), axis };
    let turning: Vec<ClPoint> = (0..9).map(|k| pose(f64::from(k), axis(f64::from(k)))).collect();
    let flat: Vec<ClPoint> = (0..9).map(|k| pose(f64::from(k), axis(0.0))).collect();
    for (poses, law) in [(turning, CuttingLaw::TipLinearVectorTurned), (flat, CuttingLaw::AxesLinear)] {
        let way = linearise(&machine, &poses, &machine.home(), &settings(law, 1e-6, 1e-9, 1e-6)).unwrap();
        assert_eq!((way.positions.len(), way.bound, way.rim), (9, Deviation::default(), 0.0));
    }
}
