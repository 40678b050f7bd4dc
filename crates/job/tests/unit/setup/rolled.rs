use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::Joint;

use crate::setup::rolled::*;

fn mill(rollover: Rollover) -> Machine {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(joint)) = &mut row.joint {
            joint.rollover = Some(rollover);
        }
    }
    Machine::from_file(file).unwrap()
}

/// Words follow the planned motion when a control with the same rollover reads them.
#[test]
fn rolled_words_lead_where_was_planned() {
    let mut seed = facemill_test_kit::Random(7);
    let mut random = || seed.unit();
    for (rollover, largest) in [(Rollover::Shortest, 179.0), (Rollover::SignDirected, 359.0)] {
        let machine = mill(rollover);
        let c = &machine.axes()[machine.axis_index("C").unwrap()];
        let letter: AxisLetter = "C".parse().unwrap();
        let mut planned = 0.0;
        // Reaches zero from both sides, and programs a position twice.
        let mut all = vec![20.0, 0.0, 0.0, -20.0, 0.0, 350.0, 370.0, 360.0, 100.0];
        for _ in 0..300 {
            planned += largest * (2.0 * random() - 1.0);
            all.push((planned * 1000.0).round() / 1000.0);
        }
        all.retain(|v: &f64| v.is_finite());
        let block = |v: &f64| Block::Rapid { words: AxisWords::from_words([(letter, *v)]).unwrap() };
        let far = |pair: &[f64]| (pair[1] - pair[0]).abs() > largest;
        let steps: Vec<f64> = all
            .iter()
            .scan(0.0, |at, v| {
                let next = if far(&[*at, *v]) { 0.5 * (*at + *v) } else { *v };
                *at = next;
                Some(next)
            })
            .collect();
        let mut program = NcProgram { blocks: steps.iter().map(block).collect() };
        roll(&mut program, machine.axes());
        let mut at = 0.0;
        for (block, planned) in program.blocks.iter().zip(&steps) {
            let Block::Rapid { words } = block else { panic!() };
            let word = words.get(letter).unwrap();
            assert!((-360.0..=360.0).contains(&word) && (word >= 0.0 || rollover == Rollover::SignDirected));
            at = c.led_to(at, 0.0, word.to_radians());
            assert!(
                (at.to_degrees() - planned).abs() < 1e-6,
                "{rollover:?}: {word} leads to {}, {planned}",
                at.to_degrees()
            );
        }
    }
}
