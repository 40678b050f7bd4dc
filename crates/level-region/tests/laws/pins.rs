//! Room, reach, pieces and contours beside a post.

use facemill_interference::MeshTree;
use facemill_level_region::{
    ContourSettings, Level, LevelPlane, PieceSettings, Standing, contour_passes, fitting_pieces,
};
use facemill_surface_model::TriMesh;
use facemill_test_kit::Random;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::posts::{ALLOWANCE, CUTTER, PRISM, Post, STOCK, axes};

/// Radius of the flat bottom, mm.
const RIM: f64 = CUTTER[0] - CUTTER[1];

#[test]
fn the_cutter_fits_where_it_is_farther_from_a_post_than_its_radius_and_the_allowance() {
    for axis in axes() {
        let post = Post::along(axis, 6.0);
        let level = post.level();
        let room = level.room(post.standing());
        let mut random = Random(11);
        for _ in 0..500 {
            let [x, y] = [0, 1].map(|_| random.between(-30.0, 30.0));
            let tip = post.plane.at(x, y);
            let from_border = x.hypot(y) - post.free_from();
            if from_border.abs() > PRISM {
                assert_eq!(room.fits(&tip), from_border > 0.0, "at {x}, {y}");
            }
        }
    }
}

#[test]
fn swept_cells_are_those_that_the_flat_bottom_reaches_but_for_a_border_of_a_cell() {
    for axis in axes() {
        let post = Post::along(axis, 6.0);
        let level = post.level();
        let cell = level.reach().cell();
        let reached_from = post.free_from() - RIM;
        let mut n = [0, 0];
        for (middle, is_swept) in level.reach().middles() {
            let at = post.off_axis(&middle);
            n[usize::from(is_swept)] += 1;
            assert!(!is_swept || at > reached_from - PRISM, "a cell at {at} mm of {reached_from} counts as swept");
            assert!(is_swept || at < reached_from + 2.0 * cell, "a cell at {at} mm of {reached_from} does not");
        }
        assert!(n[0] > 100 && n[1] > 1000, "{n:?}");
        let swept = level.reach().swept_mesh();
        assert_eq!(swept.triangles().len(), 2 * n[1]);
        assert!((0..swept.triangles().len()).all(|t| swept.scaled_normal(t).dot(&axis) > 0.0), "faces up");
    }
}

#[test]
fn what_may_be_swept_ends_less_than_a_fifth_of_a_cell_beyond_what_can_be() {
    for axis in axes() {
        let post = Post::along(axis, 6.0);
        let level = post.level();
        let may_be_swept = level.reach().may_be_swept(&level.room(post.standing()));
        let reached_from = post.free_from() - RIM;
        let mut n = [0, 0];
        for ((middle, is_swept), may) in level.reach().middles().zip(may_be_swept) {
            let at = post.off_axis(&middle);
            n[usize::from(may)] += 1;
            assert!(may || !is_swept && at < reached_from + PRISM, "a cell at {at} mm of {reached_from} can be swept");
            let border = reached_from - 0.2 * level.reach().cell() - PRISM;
            assert!(!may || at > border, "a cell at {at} mm of {reached_from} cannot be swept");
        }
        assert!(n[0] > 100 && n[1] > 1000, "{n:?}");
    }
}

#[test]
fn a_lane_that_misses_the_nodes_is_not_taken_for_the_part() {
    // Two rows of posts: the cutter fits between them on a line at y = 0.2 mm, beside all nodes.
    let post = Post::along(Vector3::z_axis(), 6.0);
    let places = (-15..=15).flat_map(|k| [1.0, -1.0].map(|side| (2.0 * f64::from(k), side)));
    let shifted = |(x, side): (f64, f64)| {
        let y = 0.2 + side * (post.free_from() + 0.08);
        post.post.0.transformed(&Isometry3::translation(x, y, 0.0))
    };
    let rows: Vec<(TriMesh, MeshTree)> = places.map(shifted).map(|mesh| (mesh.clone(), MeshTree::new(&mesh))).collect();
    let standing = || rows.iter().map(|(mesh, tree)| Standing { mesh, tree, allowance: ALLOWANCE }).collect();
    let level = Level::new(post.plane, &crate::posts::cutter(), standing(), &post.stock.0);
    let room = level.room(standing());
    assert!((-20..20).all(|x| room.fits(&post.plane.at(f64::from(x), 0.2))));
    let may_be_swept = level.reach().may_be_swept(&room);
    let in_lane = |p: &Point3<f64>| p.x.abs() < 20.0 && (p.y - 0.2).abs() < RIM;
    let cells = level.reach().middles().zip(may_be_swept);
    let in_lane: Vec<_> = cells.filter(|((middle, _), _)| in_lane(middle)).collect();
    assert!(in_lane.len() > 500 && in_lane.iter().all(|((_, is_swept), may)| !is_swept && *may));
}

#[test]
fn the_cutter_keeps_off_stock_that_is_too_thick_and_cuts_right_up_to_it() {
    let post = Post::along(Vector3::z_axis(), 6.0);
    let level = post.level();
    let reach = level.reach();
    let kept_off = |is_tall: &dyn Fn(&Point3<f64>) -> bool, error: f64| {
        let is_tall: Vec<bool> = reach.middles().map(|(p, _)| is_tall(&p)).collect();
        level.room(post.standing()).keeping_off(reach.kept_off(&is_tall, error, CUTTER[0]))
    };
    // Nothing is cut on one side.
    let from = -16.0;
    let room = kept_off(&|p| p.x < from, 1.0);
    let mut random = Random(5);
    for _ in 0..2000 {
        let [x, y] = [0, 1].map(|_| random.between(-25.0, 25.0));
        let tip = post.plane.at(x, y);
        assert!(!room.fits(&tip) || x - CUTTER[0] > from, "cuts the thick stock from {x}, {y}");
        let far = from + CUTTER[0] + 1.0 + 4.0 * reach.cell();
        let is_clear = (x.hypot(y) - post.free_from()).abs() > PRISM && x > far;
        assert!(!is_clear || room.fits(&tip) == (x.hypot(y) > post.free_from()), "{x}, {y}");
    }
    let stock = level.room(post.stock());
    let is_open = |tip: &Point3<f64>| stock.fits(tip);
    let settings = ContourSettings {
        tolerance: 0.01,
        max_step: 5.0,
        max_run_in: 100.0,
        is_left: true,
        is_reversible: true,
        is_needed: &|_| true,
        is_open: &is_open,
    };
    let passes = contour_passes(&room, reach, &settings);
    let tips = || passes.iter().flat_map(|pass| &pass.points).map(|p| p.position - p.feed.into_inner() * RIM);
    assert!(tips().count() > 10 && tips().all(|tip| tip.x - CUTTER[0] > from - 0.01), "the contour keeps off it");
    // A strip beside the post, as a bound of stock has it, is none.
    let reached_from = post.free_from() - RIM;
    let strip = |p: &Point3<f64>| post.off_axis(p) < reached_from + 1.0;
    assert!(kept_off(&strip, 1.0).fits(&post.plane.at(post.free_from() + PRISM, 0.0)));
}

#[test]
fn nothing_fits_under_an_overhang_nor_where_a_post_is_open_below() {
    let post = Post::along(Vector3::z_axis(), 20.0);
    // The level is below the post.
    let plane = LevelPlane::new(Vector3::z_axis(), -10.0);
    let level = Level::new(plane, &crate::posts::cutter(), post.standing(), &post.stock.0);
    let room = level.room(post.standing());
    assert!(!room.fits(&Point3::new(0.0, 0.0, -10.0)));
    assert!(room.fits(&Point3::new(29.0, 0.0, -10.0)));
}

#[test]
fn pieces_end_where_the_rim_meets_the_allowance_and_begin_outside_of_the_stock() {
    for axis in axes() {
        let post = Post::along(axis, 6.0);
        let level = post.level();
        let [room, stock] = [post.standing(), post.stock()].map(|bodies| level.room(bodies));
        let is_open = |tip: &Point3<f64>| stock.fits(tip);
        let settings =
            |is_reversible| PieceSettings { step: level.reach().cell(), least: 1.0, is_reversible, is_open: &is_open };
        for across in [0.0, 7.0, -12.0, 20.0] {
            let pass = post.pass(across);
            let x = |p: &Point3<f64>| post.plane.seen_from(p).x;
            let half = (post.free_from().powi(2) - across * across).max(0.0).sqrt();
            let (pieces, n_short) = fitting_pieces(&room, &pass, &settings(true));
            assert_eq!(n_short, 0);
            assert_eq!(pieces.len(), if half > 0.0 { 2 } else { 1 });
            if half == 0.0 {
                assert_eq!(pieces[0].len(), pass.len(), "a free pass is as laid");
                continue;
            }
            // Both go toward the post, with the rim ahead of the tip.
            let [first, second] = [&pieces[0], &pieces[1]];
            assert!((x(&first[0].position) + 40.0).abs() < 1e-9 && (x(&second[0].position) - 40.0).abs() < 1e-9);
            for (piece, side) in [(first, -1.0), (second, 1.0)] {
                let end = x(&piece.last().expect("points").position);
                assert!((end - side * (half - RIM)).abs() < 2.0 * PRISM, "{end} at {across}");
                let tip = |p: &facemill_cl_data::CcPoint| p.position - p.feed.into_inner() * RIM;
                assert!(piece.iter().all(|p| room.fits(&tip(p))));
            }
            // In one direction the second one begins behind the post, one rim ahead.
            let (ahead, _) = fitting_pieces(&room, &pass, &settings(false));
            assert!((x(&ahead[1][0].position) - (half + RIM)).abs() < 2.0 * PRISM);
            assert!(ahead[1].windows(2).all(|w| x(&w[1].position) > x(&w[0].position)));
        }
    }
}

#[test]
fn a_contour_keeps_to_the_border_of_the_room_and_comes_from_outside() {
    for axis in axes() {
        let post = Post::along(axis, 6.0);
        let level = post.level();
        let [room, stock] = [post.standing(), post.stock()].map(|bodies| level.room(bodies));
        let is_open = |tip: &Point3<f64>| stock.fits(tip);
        for is_left in [true, false] {
            let settings = ContourSettings {
                tolerance: 0.01,
                max_step: 5.0,
                max_run_in: 100.0,
                is_left,
                is_reversible: false,
                is_needed: &|_| true,
                is_open: &is_open,
            };
            let passes = contour_passes(&room, level.reach(), &settings);
            assert_eq!(passes.len(), 1);
            assert_eq!(passes[0].is_left, is_left);
            let points = &passes[0].points;
            let tips: Vec<Point3<f64>> = points.iter().map(|p| p.position - p.feed.into_inner() * RIM).collect();
            assert!(is_open(&tips[0]), "begins at {} mm of {STOCK}", post.off_axis(&tips[0]));
            // From outside straight on, then all around.
            let on_border = |tip: &&Point3<f64>| (post.off_axis(tip) - post.free_from()).abs() < PRISM;
            let around: Vec<&Point3<f64>> = tips.iter().skip_while(|tip| !on_border(tip)).collect();
            assert!(around.iter().all(on_border) && around.len() > 20);
            let turned: f64 = around
                .windows(2)
                .map(|w| {
                    let [a, b] = [w[0], w[1]].map(|p| post.plane.seen_from(p));
                    (a.x * b.y - a.y * b.x).atan2(a.x * b.x + a.y * b.y)
                })
                .sum();
            let whole = std::f64::consts::TAU * if is_left { 1.0 } else { -1.0 };
            assert!((turned - whole).abs() < 0.02, "{turned} rad around");
        }
        // Where no material is left, there is none.
        let nowhere = ContourSettings {
            tolerance: 0.01,
            max_step: 5.0,
            max_run_in: 100.0,
            is_left: true,
            is_reversible: false,
            is_needed: &|_| false,
            is_open: &is_open,
        };
        assert!(contour_passes(&room, level.reach(), &nowhere).is_empty());
    }
}

#[test]
fn a_level_without_bodies_is_swept_all_over() {
    let post = Post::along(Vector3::z_axis(), 6.0);
    let none: Vec<Standing<'_>> = Vec::new();
    let level = Level::new(post.plane, &crate::posts::cutter(), none, &post.stock.0);
    assert!(level.reach().middles().all(|(_, is_swept)| is_swept));
}
