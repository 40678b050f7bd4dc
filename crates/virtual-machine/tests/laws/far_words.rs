//! Words that send axes far: beyond their limits, or round and round. What they cost is the
//! machine's, not the text's.

use crate::kit::stock::cut_stock;
use crate::kit::{HEAD, Shop, Text};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::{FindingKind, Measure, Verification, VerifySettings};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

/// Positions that no program of a few blocks needs on this machine: its travel is 5 m, its cutter's
/// step 0.5 mm.
const MANY: usize = 40_000;

fn start(shop: &Shop) -> Text<'_> {
    Text::new(shop).line("G0 X0. Y0. Z1000. B0. C0.")
}

fn kinds(v: &Verification) -> Vec<(FindingKind, u32, u32)> {
    v.findings.iter().map(|f| (f.kind, f.first_line - HEAD, f.last_line - HEAD)).collect()
}

#[test]
fn a_move_beyond_the_limits_is_found_and_not_followed() {
    let shop = Shop::new();
    let far = |word: &str| start(&shop).line(&format!("G1 {word} F1000.")).line("Y10.").line("G0 X0. Y0. B0. Z1000.");
    for word in ["X1000000.", "X-99999999.", "Z12345678.", "B9999999."] {
        let v = far(word).verify();
        // From the word to the block that leads back.
        assert_eq!(kinds(&v), [(FindingKind::AxisLimit, 2, 4)], "{word}: {:?}", v.findings);
        assert_eq!(v.findings[0].worst_line, HEAD + 2);
        assert!(v.n_positions < MANY, "{word}: {} positions", v.n_positions);
        assert!(v.findings[0].note.contains("not run"), "{:?}", v.findings);
    }
    // Motions within the limits are followed again.
    let again = far("X1000000.").rapid([-300.0, 0.0, 300.0]).rapid([-300.0, 0.0, -40.0]).rapid([300.0, 0.0, -40.0]);
    assert!(again.verify().findings.iter().any(|f| f.kind == FindingKind::RapidCollision));
}

#[test]
fn increments_by_mistake_cost_no_more_than_the_travel() {
    let shop = Shop::new();
    let mut text = start(&shop).line("G91");
    for k in 0..200 {
        text = text.line(&format!("G1 X{}. Y{}. F1000.", 100 + k, 90 - k));
    }
    let v = text.verify();
    assert!(v.n_positions < MANY, "{} positions", v.n_positions);
    let limit = v.findings.iter().find(|f| f.kind == FindingKind::AxisLimit).unwrap();
    assert!(matches!(limit.measure, Some(Measure::ExcessMm(e)) if e > 1e4), "{limit:?}");
    assert_eq!(limit.last_line, HEAD + 202);
}

#[test]
fn turns_without_end_take_the_positions_of_one() {
    let shop = Shop::new();
    for form in ["G0 C{}", "G1 C{} F3000."] {
        let turned = |deg: &str| start(&shop).line(&form.replace("{}", deg)).verify();
        let (one, many) = (turned("360."), turned("999720."));
        assert!(many.n_positions <= one.n_positions + 2, "{} for {}", many.n_positions, one.n_positions);
        let found = |v: &Verification| v.findings.iter().map(|f| f.kind).collect::<Vec<_>>();
        assert_eq!(found(&one), found(&many), "{form}");
        let (short, long) = (one.cutting_length_mm, many.cutting_length_mm);
        assert!((long - 2777.0 * short).abs() <= 1e-3 * long, "{long} for {short}");
    }
    // Beside another motion there is no such turn, and a limit to what is followed.
    let v = start(&shop).line("G1 X10. C999720. F3000.").line("G0 X0.").verify();
    assert!(v.findings.iter().any(|f| f.kind == FindingKind::UnknownBlock), "{:?}", v.findings);
    assert!(v.n_positions < MANY, "{}", v.n_positions);
}

#[test]
fn a_table_that_has_wound_sixty_turns_goes_home_beside_the_stock() {
    let shop = Shop::new();
    let mut stock = DexelMap::of_box(&Isometry3::identity(), [-200.0, -200.0, 0.0], [200.0, 200.0, 20.0], 4.0).unwrap();
    for home in ["G91 G28 C0.", "G0 X500. Y300. C0.", "G91 G28 X0. Y0. C0."] {
        let text = start(&shop).line("G1 C10800. F3000.").line("C21600.").line(home).text;
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let run = cut_stock(&program, &shop.setup(), &VerifySettings::default(), &mut stock, 0.01);
        assert!(run.findings.is_empty(), "{home}: {:?}", run.findings);
        assert_eq!(run.removed_mm3, 0.0);
    }
}

/// A groove by one turn of the table, and the same one by sixty.
#[test]
fn turns_on_the_same_circle_cut_what_one_turn_cuts() {
    let shop = Shop::new();
    let cut = |deg: &str| {
        let mut stock =
            DexelMap::of_box(&Isometry3::identity(), [-200.0, -200.0, 0.0], [200.0, 200.0, 20.0], 4.0).unwrap();
        let text = Text::new(&shop).rapid([120.0, 0.0, 200.0]).cut([120.0, 0.0, 15.0]);
        let text = text.line(&format!("G91 G1 C{deg} F3000.")).line("G90").text;
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        cut_stock(&program, &shop.setup(), &VerifySettings::default(), &mut stock, 0.05).removed_mm3
    };
    let (one, sixty) = (cut("360."), cut("21600."));
    assert!(one > 1e4 && (sixty - one).abs() < 1e-6 * one, "{sixty} for {one}");
}
