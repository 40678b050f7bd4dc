use super::*;
use serde_json::from_value;

fn sweep(json: Value) -> SweepFile {
    from_value(json).unwrap()
}

fn each(name: &str, key: &str, values: &[i64]) -> Value {
    json!({ "name": name, "values": { "each": { "key": key, "values": values } } })
}

#[test]
fn a_grid_has_the_product_of_its_axes_each_combination_once_and_the_last_axis_changes_fastest() {
    let axes = [each("a", "x", &[1, 2, 3]), each("b", "y", &[1, 2]), each("c", "z", &[1, 2, 3, 4])];
    let variants = variants(&sweep(json!({ "job": "job.json", "axes": axes }))).unwrap();
    assert_eq!(variants.len(), 3 * 2 * 4);
    let labels = |k: usize| variants.variant(k).iter().map(|v| v.label.clone()).collect::<Vec<_>>();
    let all: BTreeSet<Vec<String>> = (0..variants.len()).map(labels).collect();
    assert_eq!(all.len(), 24);
    assert_eq!([labels(0), labels(1), labels(4), labels(23)].map(|l| l.concat()), ["111", "112", "121", "324"]);
    assert_eq!(variants.variant(0).iter().map(|v| v.axis.as_str()).collect::<String>(), "abc");
}

#[test]
fn a_list_has_the_values_of_all_axes_side_by_side_and_refuses_unequal_numbers() {
    let of = |b: &[i64]| {
        let axes = [each("a", "x", &[1, 2, 3]), each("b", "y", b)];
        variants(&sweep(json!({ "job": "job.json", "combine": "list", "axes": axes })))
    };
    let three = of(&[7, 8, 9]).unwrap();
    let labels: Vec<String> = (0..3).map(|k| three.variant(k).iter().map(|v| v.label.clone()).collect()).collect();
    assert_eq!((three.len(), labels), (3, vec!["17".to_owned(), "28".to_owned(), "39".to_owned()]));
    assert!(of(&[7, 8]).unwrap_err().contains("axes[1].values: has 2 values and the first axis 3"));
}

#[test]
fn a_range_has_both_ends_and_equal_distances() {
    let range = json!({ "name": "r", "values": { "range": { "key": "x", "from": 0.1, "to": 0.7, "count": 4 } } });
    let variants = variants(&sweep(json!({ "job": "job.json", "axes": [range] }))).unwrap();
    let value = |k: usize| variants.variant(k)[0].settings["x"].as_f64().unwrap();
    assert_eq!((variants.len(), value(0), value(3)), (4, 0.1, 0.7));
    (1..4).for_each(|k| assert!((value(k) - value(k - 1) - 0.2).abs() < 1e-12));
}

fn sample(seed: u64, variants: usize) -> Variants {
    let range = json!({ "name": "r", "values": { "range": { "key": "x", "from": -1.0, "to": 3.0 } } });
    let combine = json!({ "sample": { "variants": variants, "seed": seed } });
    let axes = [range, each("a", "y", &[0, 1, 2, 3])];
    super::variants(&sweep(json!({ "job": "job.json", "combine": combine, "axes": axes }))).unwrap()
}

/// Means of a uniform distribution, within four standard errors.
#[test]
fn a_sample_is_reproducible_begins_alike_and_is_uniform() {
    let n = 4000;
    let (one, more, other) = (sample(1, n), sample(1, 2 * n), sample(2, n));
    assert_eq!(one.len(), n);
    assert!((0..n).all(|k| one.variant(k) == more.variant(k)));
    assert!((0..n).filter(|&k| one.variant(k) == other.variant(k)).count() == 0);
    let mean = |value: &dyn Fn(usize) -> f64| (0..n).map(value).sum::<f64>() / n as f64;
    let x = |k: usize| one.variant(k)[0].settings["x"].as_f64().unwrap();
    let y = |k: usize| one.variant(k)[1].settings["y"].as_f64().unwrap();
    assert!((0..n).all(|k| (-1.0..=3.0).contains(&x(k))));
    assert!((mean(&x) - 1.0).abs() < 4.0 * (4.0 / 12f64.sqrt()) / (n as f64).sqrt(), "{}", mean(&x));
    assert!((mean(&y) - 1.5).abs() < 4.0 * 1.25f64.sqrt() / (n as f64).sqrt(), "{}", mean(&y));
    let both = mean(&|k| (x(k) - 1.0) * (y(k) - 1.5));
    assert!(both.abs() < 4.0 * (4.0 / 12f64.sqrt()) * 1.25f64.sqrt() / (n as f64).sqrt(), "correlated: {both}");
}

/// Of the seed 0 and the first place, three times over what the reference code of SplitMix64 makes
/// of 0 (Vigna, splitmix64.c), so that samples stay what they are from version to version.
#[test]
fn draws_are_those_of_the_published_generator_and_differ_by_place() {
    assert_eq!(draw(0, 0, 0), 0x2382_75bc_38fc_be91);
    assert_ne!(draw(0, 0, 0), draw(0, 0, 1));
    assert_ne!(draw(0, 1, 0), draw(0, 0, 1));
}

#[test]
fn faults_of_axes_name_their_field() {
    let range = |range: Value| json!({ "name": "r", "values": { "range": range } });
    let twice = json!({ "name": "r", "values": { "labelled": [{ "label": "a" }, { "label": "a" }] } });
    for (axes, words) in [
        (json!([]), "axes: there are none"),
        (json!([each("a", "x", &[1]), each("a", "y", &[1])]), "axes[1].name: \"a\""),
        (json!([each("state", "x", &[1])]), "axes[0].name: \"state\" is the heading of another column"),
        (json!([each("task", "x", &[1])]), "axes[0].name: \"task\" is the heading"),
        (json!([each("a", "x", &[])]), "axes[0].values.each: there are no values"),
        (json!([each("a", "x", &[1, 1])]), "the value \"1\" is there twice"),
        (json!([each("a", "x..y", &[1])]), "axes[0].values.each.key"),
        (json!([each("a", "x=y", &[1])]), "has a =, which no key has"),
        (json!([twice]), "the value \"a\" is there twice"),
        (json!([range(json!({ "key": "x", "from": 0, "to": 1 }))]), "values.range.count: is missing"),
        (json!([range(json!({ "key": "x", "from": 1, "to": 0, "count": 2 }))]), "values.range: must go from"),
        (json!([range(json!({ "key": "x", "from": 1, "to": 1, "count": 2 }))]), "from and to are one number"),
    ] {
        let why = variants(&sweep(json!({ "job": "job.json", "axes": axes }))).unwrap_err();
        assert!(why.contains(words), "{why}");
    }
}
