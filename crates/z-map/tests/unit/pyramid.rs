use super::*;

#[test]
fn range_maxima_are_those_of_all_cells_of_the_range() {
    for (nx, ny) in [(1, 1), (1, 7), (5, 3), (8, 8), (13, 6)] {
        // Distinct values in no order.
        let cells: Vec<f64> = (0..nx * ny).map(|k| ((k * 37 + 11) % 101) as f64).collect();
        let pyramid = Pyramid::new(nx, ny, cells.clone());
        assert_eq!(pyramid.check(), Ok(()));
        for i0 in 0..nx {
            for i1 in i0..=nx {
                for j0 in 0..ny {
                    for j1 in j0..=ny {
                        let all = (j0..j1).flat_map(|j| (i0..i1).map(move |i| (i, j)));
                        let brute = all.map(|(i, j)| cells[j * nx + i]).fold(f64::NEG_INFINITY, f64::max);
                        assert_eq!(pyramid.max_over(i0..i1, j0..j1), brute);
                    }
                }
            }
        }
    }
}

#[test]
fn blocks_hold_every_cell_once_on_every_level() {
    let (nx, ny) = (13, 6);
    let pyramid = Pyramid::new(nx, ny, vec![0.0; nx * ny]);
    let mut blocks = vec![pyramid.top()];
    for _ in 0..pyramid.levels.len() {
        let mut seen = vec![0; nx * ny];
        for &block in &blocks {
            let [i, j] = pyramid.cells(block);
            for j in j {
                for i in i.clone() {
                    seen[j * nx + i] += 1;
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        blocks = blocks.iter().flat_map(|&b| pyramid.children(b)).collect();
    }
    assert!(blocks.is_empty());
}
