//! Stacks that enclose others.

use facemill_test_kit::Random;

use super::*;

fn random_stack(random: &mut Random, length: f64) -> Vec<Section> {
    let mut stack: Vec<Section> = (0..random.below(6))
        .map(|_| Section {
            length_mm: random.between(1e-3, 12.0),
            diameter_low_mm: random.between(1.0, 30.0),
            diameter_high_mm: random.between(1.0, 30.0),
        })
        .collect();
    stack.push(cylinder(length, random.between(1.0, 30.0)));
    stack
}

/// Largest diameter of a stack at a height, of both sections where two meet.
fn diameter_at(stack: &[Section], height: f64) -> f64 {
    let (mut z, mut widest) = (0.0, 0.0f64);
    for section in stack {
        let share = (height - z) / section.length_mm;
        if (-1e-9..=1.0 + 1e-9).contains(&share) {
            widest = widest.max(section.diameter_low_mm + share * (section.diameter_high_mm - section.diameter_low_mm));
        }
        z += section.length_mm;
    }
    widest
}

#[test]
fn an_enclosing_stack_is_nowhere_narrower() {
    let mut random = Random(11);
    for _ in 0..500 {
        let length = random.between(0.1, 40.0);
        let stacks: Vec<Vec<Section>> = (0..1 + random.below(3)).map(|_| random_stack(&mut random, length)).collect();
        let around = enclosing(&stacks, length);
        let total: f64 = around.iter().map(|section| section.length_mm).sum();
        assert!((total - length).abs() < 1e-6, "{total} of {length}");
        for _ in 0..30 {
            let height = random.between(0.0, length);
            let widest = stacks.iter().map(|stack| diameter_at(stack, height)).fold(0.0, f64::max);
            assert!(diameter_at(&around, height) >= widest - 1e-6, "{stacks:?} at {height}");
        }
    }
}

#[test]
fn one_stack_is_its_own_enclosure_up_to_the_length() {
    let stack = vec![
        Section { length_mm: 3.0, diameter_low_mm: 4.0, diameter_high_mm: 6.0 },
        Section { length_mm: 4.0, diameter_low_mm: 8.0, diameter_high_mm: 10.0 },
    ];
    let cut = enclosing(std::slice::from_ref(&stack), 5.0);
    assert_eq!(cut, [stack[0], Section { length_mm: 2.0, diameter_low_mm: 8.0, diameter_high_mm: 9.0 }]);
    assert!(enclosing(&[stack], 0.0).is_empty());
}
