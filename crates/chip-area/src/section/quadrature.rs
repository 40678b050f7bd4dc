/// Nodes of Kronrod's rule of 15 points in [0, 1] and its weights; every other one from the second
/// on is a node of Gauss's of 7 (R. Piessens et al., QUADPACK, 1983, routine QK15).
const NODES: [[f64; 2]; 8] = [
    [0.991_455_371_120_812_6, 0.022_935_322_010_529_224],
    [0.949_107_912_342_758_5, 0.063_092_092_629_978_56],
    [0.864_864_423_359_769_1, 0.104_790_010_322_250_19],
    [0.741_531_185_599_394_4, 0.140_653_259_715_525_92],
    [0.586_087_235_467_691_1, 0.169_004_726_639_267_9],
    [0.405_845_151_377_397_2, 0.190_350_578_064_785_4],
    [0.207_784_955_007_898_47, 0.204_432_940_075_298_9],
    [0.0, 0.209_482_141_084_727_82],
];
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// Number of initial parts of the range between two breaks: features narrower than a part may be
/// missed.
const FIRST_PARTS: u32 = 2;
/// Largest number of halvings of a first part, after which a step of the function is narrow enough.
const MAX_HALVINGS: u32 = 36;
/// Largest number of parts: after it the error reports the rest.
const MAX_PARTS: u32 = 4_000;

/// Returns ∫ f from the first of `breaks` to the last and an estimate of its error: for each part
/// the difference of both rules in its halves and that of the halves from the whole, which a single
/// coincidence cannot make small. Parts are halved until their error is their share of `accuracy`.
/// `breaks` are in order; f may have kinks at them without cost.
pub(crate) fn integral(f: impl Fn(f64) -> f64, breaks: &[f64], accuracy: f64) -> (f64, f64) {
    let part = |from: f64, to: f64, halvings: u32| Subrange { ends: [from, to], halvings, rules: rules(&f, from, to) };
    let parts_of = |ends: &[f64]| {
        let at = |i: u32| ends[0] + (ends[1] - ends[0]) * (f64::from(i) / f64::from(FIRST_PARTS));
        (0..FIRST_PARTS).map(|i| part(at(i), at(i + 1), 0)).collect::<Vec<_>>()
    };
    let mut open: Vec<Subrange> = breaks.windows(2).flat_map(parts_of).collect();
    open.reverse();
    let length: f64 = breaks.last().unwrap_or(&0.0) - breaks.first().unwrap_or(&0.0);
    let (mut sum, mut error, mut parts) = (0.0, 0.0, 0);
    while let Some(Subrange { ends: [from, to], halvings, rules: (whole, _) }) = open.pop() {
        let middle = 0.5 * (from + to);
        let halves = [part(from, middle, halvings + 1), part(middle, to, halvings + 1)];
        let area = halves[0].rules.0 + halves[1].rules.0;
        let off = (area - whole).abs() + halves[0].rules.1 + halves[1].rules.1;
        parts += 1;
        if off <= accuracy * ((to - from) / length) || halvings >= MAX_HALVINGS || parts >= MAX_PARTS {
            sum += area;
            error += off;
        } else {
            let [left, right] = halves;
            open.extend([right, left]);
        }
    }
    (sum, error)
}

/// A part of the range.
struct Subrange {
    ends: [f64; 2],
    halvings: u32,
    rules: (f64, f64),
}

/// Returns the result of Kronrod's rule and its difference from Gauss's.
fn rules(f: &impl Fn(f64) -> f64, from: f64, to: f64) -> (f64, f64) {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let (mut kronrod, mut gauss) = (0.0, 0.0);
    for (i, [node, weight]) in NODES.into_iter().enumerate() {
        let sum = if node == 0.0 { f(middle) } else { f(middle - half * node) + f(middle + half * node) };
        kronrod += weight * sum;
        if i % 2 == 1 {
            gauss += GAUSS[i / 2] * sum;
        }
    }
    (kronrod * half, ((kronrod - gauss) * half).abs())
}

#[cfg(test)]
#[path = "../../tests/unit/section/quadrature.rs"]
mod tests;
