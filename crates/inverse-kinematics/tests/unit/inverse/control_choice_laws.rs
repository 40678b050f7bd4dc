use facemill_cl_data::ClPoint;
use facemill_test_kit::Random;
use nalgebra::{Point3, Unit, Vector3};

use super::{POLE_CONE, UnclearChoice, smallest_angle};
use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;

const LENGTH: f64 = 260.0;

/// A head that turns about Y on a table that turns about Z.
fn machine() -> Machine {
    Machine::head_b_table_c().unwrap()
}

fn at(machine: &Machine, b: f64, c: f64) -> AxisValues {
    let mut q = machine.home();
    q[machine.axis_index("B").unwrap()] = b.to_radians();
    q[machine.axis_index("C").unwrap()] = c.to_radians();
    q
}

fn turns(machine: &Machine, from: &AxisValues, to: &AxisValues) -> [f64; 2] {
    ["B", "C"].map(|letter| {
        let k = machine.axis_index(letter).unwrap();
        (to[k] - from[k]).abs()
    })
}

#[test]
fn a_short_way_away_from_the_pole_is_taken_as_it_is_on_both_branches() {
    let machine = machine();
    let mut random = Random(7);
    for n in 0..400 {
        let side = if n % 2 == 0 { 1.0 } else { -1.0 };
        // The reach of the head ends at its limits.
        let b = side * random.between(8.0, 80.0);
        // The table turns without end.
        let c = random.between(-900.0, 900.0);
        let from = at(&machine, b, c);
        let meant = at(&machine, b + random.between(-4.0, 4.0), c + random.between(-20.0, 20.0));
        let chosen = machine.control_choice(&from, &machine.cl_point(&meant, LENGTH), LENGTH).unwrap();
        for k in 0..meant.len() {
            assert!((chosen[k] - meant[k]).abs() < 1e-8, "{n}: {chosen:?} for {meant:?}");
        }
    }
}

/// For any motion of the tip: a repeated vector turns nothing, whatever position the first one led
/// to.
#[test]
fn the_same_vector_keeps_the_rotary_axes_to_the_last_bit() {
    let machines = ["head-b-table-c", "head-b-nutating-table-c", "head-head-c-a", "table-table-b-c"];
    let mut random = Random(19);
    let mut clear = 0;
    for name in machines {
        let file = format!("{}/../../assets/machines/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let machine = Machine::from_json(&std::fs::read(file).unwrap()).unwrap();
        let rotary = |q: &AxisValues| -> Vec<u64> {
            let turning = |k: &usize| machine.axes()[*k].kind == AxisKind::Rotary;
            (0..q.len()).filter(turning).map(|k| q[k].to_bits()).collect()
        };
        for _ in 0..60 {
            let vector = Vector3::from_fn(|_, _| (random.between(-1.0, 1.0) * 1e4).round() / 1e4);
            let axis = Unit::new_normalize(vector);
            let mut tip = || Point3::from(Vector3::from_fn(|_, _| random.between(-200.0, 200.0)));
            let mut cl = ClPoint { tip: tip(), axis };
            let Ok(all) = machine.all_solutions(&cl, LENGTH) else { continue };
            for solution in &all {
                // A little beside it, so the first choice turns.
                let from = AxisValues::from_fn(solution.values.len(), |k| solution.values[k] + 1e-3);
                let Ok(first) = machine.control_choice(&from, &cl, LENGTH) else { continue };
                assert_ne!(rotary(&first), rotary(&from));
                let mut at = first;
                for _ in 0..5 {
                    cl.tip = tip();
                    at = machine.control_choice(&at, &cl, LENGTH).unwrap();
                    assert_eq!(rotary(&at), rotary(&first), "{name}");
                    assert!((machine.cl_point(&at, LENGTH).tip - cl.tip).norm() < 1e-9, "{name}");
                    clear += 1;
                }
            }
        }
    }
    assert!(clear > 300, "{clear}");
}

/// Against all solutions at all windings: a control that adds ways up, and one that takes the
/// largest, take the chosen one.
#[test]
fn what_is_chosen_is_the_nearest_by_the_largest_turn_and_by_the_sum() {
    let machine = machine();
    let c_axis = machine.axis_index("C").unwrap();
    let mut random = Random(11);
    let (mut clear, mut open) = (0, 0);
    for _ in 0..2000 {
        let [from, meant] = [(); 2].map(|()| at(&machine, random.between(-85.0, 85.0), random.between(-200.0, 200.0)));
        let cl = machine.cl_point(&meant, LENGTH);
        let Ok(chosen) = machine.control_choice(&from, &cl, LENGTH) else {
            open += 1;
            continue;
        };
        clear += 1;
        let reached = machine.cl_point(&chosen, LENGTH);
        assert!((reached.tip - cl.tip).norm() < 1e-9 && (*reached.axis - *cl.axis).norm() < 1e-12);
        let [own_b, own_c] = turns(&machine, &from, &chosen);
        for solution in machine.all_solutions(&cl, LENGTH).unwrap() {
            for turn in -3..=3 {
                let mut other = solution.values;
                other[c_axis] += std::f64::consts::TAU * f64::from(turn);
                let [b, c] = turns(&machine, &from, &other);
                assert!(own_b.max(own_c) <= b.max(c) + 1e-9 && own_b + own_c <= b + c + 1e-9, "{from:?} {chosen:?}");
            }
        }
    }
    assert!(clear > 300 && open > 300, "{clear} {open}");
}

#[test]
fn solutions_nearly_as_near_are_reported() {
    let machine = machine();
    let from = at(&machine, 30.0, 0.0);
    // The same direction at B -30 with the table at C -85, on the other side.
    let cl = machine.cl_point(&at(&machine, 30.0, 95.0), LENGTH);
    let found = machine.control_choice(&from, &cl, LENGTH).unwrap_err();
    let UnclearChoice::TwoWays { near, far } = found else { panic!("{found:?}") };
    assert!((near.to_degrees() - 85.0).abs() < 1e-6 && (far.to_degrees() - 95.0).abs() < 1e-6, "{near} {far}");
    assert!(machine.control_choice(&from, &machine.cl_point(&at(&machine, 30.0, 55.0), LENGTH), LENGTH).is_ok());
}

#[test]
fn the_pole_is_reported_at_the_end_and_on_the_way() {
    let machine = machine();
    let cone = POLE_CONE.to_degrees();
    let choice =
        |from: &AxisValues, to: &AxisValues| machine.control_choice(from, &machine.cl_point(to, LENGTH), LENGTH);
    let is_pole = |found: Result<AxisValues, UnclearChoice>, angle: f64| match found {
        Err(UnclearChoice::Pole { angle: found, .. }) => (found.to_degrees() - angle).abs() < 1e-6,
        _ => false,
    };
    assert!(is_pole(choice(&at(&machine, 10.0, 0.0), &at(&machine, 0.9 * cone, 0.0)), 0.9 * cone));
    assert!(choice(&at(&machine, 10.0, 0.0), &at(&machine, 1.1 * cone, 0.0)).is_ok());
    assert!(is_pole(choice(&at(&machine, 0.5 * cone, 0.0), &at(&machine, 10.0, 0.0)), 0.5 * cone));
    // Over the pole from one side to the other, and past it at a distance: half a turn's chord at 5
    // deg.
    assert!(is_pole(choice(&at(&machine, 10.0, 0.0), &at(&machine, -10.0, 0.0)), 0.0));
    let (b, c) = (5.0_f64.to_radians(), 80.0_f64.to_radians());
    let on_the_way = (b.tan() * c.cos()).atan().to_degrees();
    assert!(on_the_way < cone);
    assert!(is_pole(choice(&at(&machine, 5.0, -80.0), &at(&machine, 5.0, 80.0)), on_the_way));
}

#[test]
fn the_nearest_position_beyond_a_limit_is_reported() {
    let machine = machine();
    let b = machine.axis_index("B").unwrap();
    let limit = machine.axes()[b].max.to_degrees();
    let found = {
        let beyond = at(&machine, limit + 1.0, 0.0);
        machine.control_choice(&at(&machine, limit - 1.0, 0.0), &machine.cl_point(&beyond, LENGTH), LENGTH)
    };
    assert!(matches!(found, Err(UnclearChoice::BeyondLimit { axis, .. }) if axis == "B"), "{found:?}");
}

#[test]
fn the_smallest_angle_of_a_turn_is_that_of_its_samples() {
    let mut random = Random(3);
    let vector = |random: &mut Random| Vector3::from_fn(|_, _| random.between(-1.0, 1.0));
    for _ in 0..300 {
        let [a, b] = [(); 2].map(|()| Unit::new_normalize(vector(&mut random)));
        let line = vector(&mut random).normalize();
        let cl = |axis| ClPoint { tip: nalgebra::Point3::origin(), axis };
        let sampled = (0..=4000)
            .map(|n| crate::motion::turned_axis(&cl(a).axis, &cl(b).axis, f64::from(n) / 4000.0))
            .map(|v| line.cross(&v).norm().atan2(line.dot(&v).abs()))
            .fold(f64::INFINITY, f64::min);
        let reported = smallest_angle(&a, &b, &line);
        assert!(reported <= sampled + 1e-12 && reported > sampled - 1e-3, "{reported} and {sampled}");
    }
}
