//! Small scenes whose distances are plain: what must not be certified, and twins that are.

use crate::kit::{HEAD, Shop, Text, box_mesh};
use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyFile, ShapeFile};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::{
    Certificate, Certificates, FindingKind, ObstacleKind, VerifySettings, VirtualObstacle, VirtualSetup, certify,
};
use nalgebra::Point3;

fn certificates(text: &Text<'_>, setup: &VirtualSetup<'_>, limit: f64) -> Certificates {
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    certify(&program, setup, &VerifySettings { gouge_limit: limit, ..VerifySettings::default() }, &Silent).unwrap()
}

/// The certificate of the last block.
fn last(text: &Text<'_>, setup: &VirtualSetup<'_>) -> Certificate {
    certificates(text, setup, 0.1).certificates.pop().unwrap()
}

fn between(c: &Certificate) -> [&str; 2] {
    let pair = c.uncertified_between.as_ref().unwrap_or_else(|| panic!("{c:?}"));
    assert!(!c.certified && c.reason.as_ref().is_some_and(|r| r.contains(&pair[1])), "{c:?}");
    pair.each_ref().map(String::as_str)
}

/// The preset with this control tolerance, mm and deg, and bodies on its bed.
fn shop(path_mm: f64, orientation_deg: f64, bed_bodies: Vec<BodyFile>) -> Shop {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    (file.motion.control_tolerance.path_mm, file.motion.control_tolerance.orientation_deg) = (path_mm, orientation_deg);
    file.bed_bodies = bed_bodies;
    Shop::with_machine(Machine::from_file(file).unwrap())
}

/// The same with a post of 60 mm radius on its bed, 180 mm beside the middle of the plate and up to
/// `top` above it, that keeps 5 mm.
fn shop_with_post(path_mm: f64, top: f64) -> Shop {
    let foot = Shop::new().table_from_work * Point3::new(0.0, 180.0, 0.0);
    let post = BodyFile {
        name: "post".to_owned(),
        shape: ShapeFile::Cylinder { radius_mm: 60.0, height_mm: 600.0 },
        position_mm: [foot.x, foot.y, foot.z + top - 600.0],
        rotation_xyz_deg: [0.0; 3],
        clearance_mm: 5.0,
    };
    shop(path_mm, 0.0, vec![post])
}

fn with<'a>(shop: &'a Shop, mesh: &'a MeshTree, kind: ObstacleKind, allowance: f64, stock: f64) -> VirtualSetup<'a> {
    let obstacle = VirtualObstacle { name: "block".into(), mesh, kind, allowance, stock };
    VirtualSetup { obstacles: vec![obstacle], ..shop.setup() }
}

fn bare(shop: &Shop) -> VirtualSetup<'_> {
    VirtualSetup { obstacles: Vec::new(), ..shop.setup() }
}

#[test]
fn the_head_over_a_clamp_is_not_certified_and_over_a_lower_one_is() {
    // The head's lower side is 370 mm above the tip and keeps 10 mm; the clamp is out of the
    // holder's way.
    let shop = shop(0.0, 0.0, Vec::new());
    let over = |top: f64| {
        let mesh = MeshTree::new(&box_mesh([-30.0, 110.0, -80.0], [30.0, 130.0, top]));
        let text = Text::new(&shop).rapid([-400.0, 0.0, 100.0]).cut([-400.0, 0.0, 0.0]).cut([400.0, 0.0, 0.0]);
        last(&text, &with(&shop, &mesh, ObstacleKind::Fixture, 0.0, 0.0))
    };
    assert_eq!(between(&over(365.0)), ["head", "block"]);
    let clear = over(350.0);
    let distance = clear.clearance_mm.unwrap();
    assert!(clear.certified && (9.9..=20.0).contains(&distance), "{clear:?}");
}

#[test]
fn the_head_and_the_cutter_at_a_post_on_the_bed_are_not_certified() {
    let past = |top: f64| {
        let shop = shop_with_post(0.0, top);
        last(&Text::new(&shop).rapid([-400.0, 0.0, 300.0]).cut([400.0, 0.0, 300.0]), &bare(&shop))
    };
    assert_eq!(between(&past(700.0)), ["head", "post"]);
    // The head keeps 10 mm and the post 5.
    assert_eq!(between(&past(656.0)), ["head", "post"]);
    let clear = past(600.0);
    assert!(clear.certified && (14.9..=70.0).contains(&clear.clearance_mm.unwrap()), "{clear:?}");
    // The cutter alone: the body of the tool above it keeps 1 mm and is 12 mm higher.
    let shop = shop_with_post(0.0, 300.0);
    let over = |z: f64| last(&Text::new(&shop).rapid([-300.0, 180.0, z]).cut([300.0, 180.0, z]), &bare(&shop));
    assert_eq!(between(&over(299.0)), ["cutter", "post"]);
    assert_eq!(between(&over(304.0)), ["cutter", "post"]);
    assert!(over(305.5).certified, "{:?}", over(305.5));
}

#[test]
fn allowance_and_stock_are_part_of_what_may_not_be_entered() {
    let shop = shop(0.0, 0.0, Vec::new());
    let plate = MeshTree::new(&box_mesh([-200.0, -200.0, -80.0], [200.0, 200.0, 0.0]));
    let text = |z: f64| Text::new(&shop).rapid([-100.0, 0.0, 50.0]).cut([-100.0, 0.0, z]).cut([100.0, 0.0, z]);
    // 0.5 mm are to stay; the tip is 0.3 mm above the plate.
    let cut = |limit| {
        let all = certificates(&text(0.3), &with(&shop, &plate, ObstacleKind::Part, 0.5, 0.5), limit);
        all.certificates.last().unwrap().clone()
    };
    assert_eq!(between(&cut(0.1)), ["cutter", "block"]);
    let depth = cut(0.3).depth_mm.unwrap();
    assert!((0.2..0.205).contains(&depth), "{depth}");
    let rapid = |z: f64, limit: f64| {
        let text = Text::new(&shop).rapid([-100.0, 0.0, 50.0]).rapid([-100.0, 0.0, z]).rapid([100.0, 0.0, z]);
        let all = certificates(&text, &with(&shop, &plate, ObstacleKind::Part, 0.0, 2.0), limit);
        all.certificates.last().unwrap().clone()
    };
    for z in [1.0, 1.99] {
        // No limit in cutting permits a depth in rapid.
        assert_eq!(between(&rapid(z, 0.5)), ["cutter", "block"]);
    }
    assert!(rapid(2.01, 0.1).certified, "{:?}", rapid(2.01, 0.1));
    assert_eq!(rapid(2.01, 0.1).depth_with_control_mm, Some(0.0));
    // Past a wall with 4 mm of stock: the holder, 40 mm wide, keeps 2 mm from that.
    let wall = MeshTree::new(&box_mesh([40.0, -200.0, -80.0], [60.0, 200.0, 100.0]));
    let past = |x: f64| {
        let text = Text::new(&shop).rapid([x, -100.0, 20.0]).cut([x, 100.0, 20.0]);
        last(&text, &with(&shop, &wall, ObstacleKind::Part, 0.0, 4.0))
    };
    assert_eq!(between(&past(-5.0)), ["holder section 1", "block"]);
    assert!(past(-6.5).certified, "{:?}", past(-6.5));
}

#[test]
fn rapids_keep_out_of_the_stock_with_the_tolerance_of_the_control() {
    let plate = MeshTree::new(&box_mesh([-200.0, -200.0, -80.0], [200.0, 200.0, 0.0]));
    let rapid = |path: f64, degrees: f64, z: f64| {
        let shop = shop(path, degrees, Vec::new());
        let text = Text::new(&shop).rapid([-50.0, 0.0, 50.0]).rapid([-50.0, 0.0, z]).rapid([50.0, 0.0, z]);
        last(&text, &with(&shop, &plate, ObstacleKind::Part, 0.0, 2.0))
    };
    assert!(rapid(0.0, 0.0, 2.3).certified);
    assert_eq!(between(&rapid(0.4, 0.0, 2.3)), ["cutter", "block"]);
    assert!(rapid(0.25, 0.0, 2.3).certified);
    // A tilt by one degree takes the rim 25·sin 1° = 0.44 mm down.
    assert_eq!(between(&rapid(0.0, 1.0, 2.4)), ["cutter", "block"]);
    // No point of the cutter is farther than √(25² + 12²) = 27.7 mm from the tip.
    assert!(rapid(0.0, 1.0, 2.9).certified, "{:?}", rapid(0.0, 1.0, 2.9));
}

#[test]
fn bodies_keep_their_distance_with_the_tolerance_of_the_control() {
    let wall = MeshTree::new(&box_mesh([40.0, -200.0, -80.0], [60.0, 200.0, 120.0]));
    // 5 mm between wall and holder, which keeps 2 mm, up to 100 mm above the tip.
    let past = |path: f64, degrees: f64| {
        let shop = shop(path, degrees, Vec::new());
        let text = Text::new(&shop).rapid([-5.0, -100.0, 20.0]).cut([-5.0, 100.0, 20.0]);
        last(&text, &with(&shop, &wall, ObstacleKind::Part, 0.0, 0.0))
    };
    for (path, degrees) in [(0.0, 0.0), (1.0, 0.0), (2.9, 0.0), (0.0, 0.5), (1.0, 0.5)] {
        let c = past(path, degrees);
        // Turned by that, the holder is so much nearer to the wall's upper edge.
        let upper = 100.0 * f64::to_radians(degrees).sin();
        let distance = c.clearance_mm.unwrap_or_else(|| panic!("{c:?}"));
        assert!(c.certified && distance <= 5.0 - path - upper, "{path} mm, {degrees} deg: {c:?}");
    }
    assert_eq!(between(&past(3.2, 0.0)), ["holder section 1", "block"]);
    assert_eq!(between(&past(0.0, 2.5)), ["holder section 1", "block"]);
    assert_eq!(between(&past(1.0, 1.5)), ["holder section 1", "block"]);
    // A post on the bed: 15 mm are to be kept, the head passes 20 mm above it.
    let over = |path: f64| {
        let shop = shop_with_post(path, 650.0);
        last(&Text::new(&shop).rapid([-400.0, 0.0, 300.0]).cut([400.0, 0.0, 300.0]), &bare(&shop))
    };
    assert!(over(0.0).certified && over(1.0).certified);
    assert_eq!(between(&over(5.2)), ["head", "post"]);
}

#[test]
fn a_depth_in_cutting_is_reported_with_the_tolerance_of_the_control_at_the_farthest_point() {
    let plate = MeshTree::new(&box_mesh([-200.0, -200.0, -80.0], [200.0, 200.0, 0.0]));
    let shop = shop(0.03, 0.1, Vec::new());
    let text = Text::new(&shop).rapid([-50.0, 0.0, 50.0]).cut([-50.0, 0.0, 0.0]).cut([50.0, 0.0, -0.05]);
    let c = last(&text, &with(&shop, &plate, ObstacleKind::Part, 0.0, 0.0));
    let control = 0.03 + 0.1_f64.to_radians() * 25.0_f64.hypot(12.0);
    let (depth, with_control) = (c.depth_mm.unwrap(), c.depth_with_control_mm.unwrap());
    assert!(c.certified && depth >= 0.05 && (with_control - depth - control).abs() < 1e-12, "{c:?}");
}

/// A text whose fifth block behind the head is this line, and what its first doubted line is.
fn planted(shop: &Shop, line: &str) -> (Certificates, u32) {
    let at = |x: f64, z: f64| [x, 0.0, z];
    let text = Text::new(shop)
        .rapid(at(-100.0, 300.0))
        .rapid(at(-100.0, 5.0))
        .cut(at(-100.0, 0.5))
        .cut(at(0.0, 0.5))
        .line(line)
        .cut(at(50.0, 0.5))
        .rapid(at(50.0, 300.0));
    (certificates(&text, &shop.setup(), 0.1), HEAD + 5)
}

#[test]
fn nothing_is_certified_from_a_motion_on_that_is_not_simulated() {
    let shop = shop(0.0, 0.0, Vec::new());
    let kinds = [
        ("G65 P9000", FindingKind::UnknownBlock),
        ("G2 X10. Y10. I5. J5. F500.", FindingKind::UnknownBlock),
        ("G81 X10. Y10. Z-300. R5. F500.", FindingKind::UnknownBlock),
        ("G10 L2 P1 X5.", FindingKind::UnknownBlock),
        ("G55 G1 X10. F500.", FindingKind::UnknownPosition),
        ("G30 Z0.", FindingKind::UnknownPosition),
        ("G49", FindingKind::UnsafeCancel),
        ("G43 H55", FindingKind::OtherLengthRegister),
        ("/G1 X10. F500.", FindingKind::SkippableBlock),
        ("IF [#1 EQ 0] GOTO 10", FindingKind::Branch),
        ("G1 X10 F500.", FindingKind::NoDecimalPoint),
    ];
    for (line, kind) in kinds {
        let (found, planted) = planted(&shop, line);
        let (before, behind): (Vec<_>, Vec<_>) = found.certificates.iter().partition(|c| c.line < planted);
        assert!(before.iter().all(|c| c.certified) && before.len() == 4, "{line}: {before:?}");
        let first = behind[0];
        assert_eq!((first.line, first.doubted_since_line), (planted, Some(planted)), "{line}");
        assert!(first.reason.as_ref().unwrap().starts_with(&kind.to_string()), "{line}: {first:?}");
        for c in &behind {
            assert!(!c.certified && c.depth_mm.is_none() && c.clearance_mm.is_none(), "{line}: {c:?}");
            assert!(c.reason.is_some() && c.doubted_since_line.is_some(), "{line}: {c:?}");
        }
        assert_eq!((found.largest_depth_mm, found.certified, found.blocks), (None, 4, found.certificates.len()));
        assert_eq!(found.uncertified().count(), behind.len());
        assert!(behind.len() >= 3, "{line}: {behind:?}");
    }
}

#[test]
fn lines_that_move_nothing_leave_the_certificates_as_they_are() {
    let shop = shop(0.0, 0.0, Vec::new());
    for line in ["(A COMMENT)", "M8", "G4 P500", "M5", "M48"] {
        let (found, _) = planted(&shop, line);
        assert_eq!(found.uncertified().count(), 0, "{line}: {found:?}");
        assert!(found.largest_depth_mm.is_some());
    }
    // A function that nobody names as harmless has an unknown effect.
    let (found, _) = planted(&shop, "M123");
    assert!(found.uncertified().count() > 0, "{found:?}");
}
