//! Tables of published series give the same meshes as the built-in series.

use facemill_propeller_file::{PropellerJson, read_propeller};
use facemill_sample_parts::{
    BladeResolution, BladeSide, BladeSurface, PropellerSeries, PropellerSpec, blade, chord_error, hub,
};

use crate::kit::{DTMB_4119, DTMB_4382, VP1304, bits, read, shared};

const SERIES: [(&str, PropellerSeries); 3] =
    [(DTMB_4119, PropellerSeries::Dtmb4119), (DTMB_4382, PropellerSeries::Dtmb4382), (VP1304, PropellerSeries::Vp1304)];

fn same_meshes(read: &PropellerSpec, built_in: &PropellerSpec) {
    let resolution = BladeResolution::new(30, 24).unwrap();
    assert_eq!(bits(&blade(read, resolution)), bits(&blade(built_in, resolution)));
    let tolerance = 1e-3 * built_in.hub_radius();
    assert_eq!(bits(&hub(read, tolerance).unwrap()), bits(&hub(built_in, tolerance).unwrap()));
    assert_eq!(chord_error(read, resolution), chord_error(built_in, resolution));
    assert_eq!(read.n_blades(), built_in.n_blades());
}

#[test]
fn tables_of_the_series_give_the_bytes_of_their_meshes() {
    for (csv, series) in SERIES {
        let file = read(csv).unwrap();
        assert_eq!(file.spec(None).unwrap().diameter(), file.diameter_mm);
        for diameter in [file.diameter_mm, 3048.0, 777.7] {
            let spec = file.spec(Some(diameter)).unwrap();
            same_meshes(&spec, &PropellerSpec::new(series, diameter).unwrap());
        }
    }
}

/// The same row in another file form.
fn json_of(csv: &str) -> PropellerJson {
    let value = |key: &str| csv.lines().find_map(|l| l.strip_prefix(&format!("# {key}: "))).map(str::to_owned);
    let lines: Vec<&str> = csv.lines().filter(|l| !l.starts_with('#')).collect();
    let separator = if lines[0].contains(';') { ';' } else { ',' };
    let key = |name: &str| match name {
        "dist_lead_edge_mm" => "leading_edge_mm".to_owned(),
        name => name.replace("max_camber", "camber").replace("max_thick", "thickness"),
    };
    let names: Vec<String> = lines[0].split(separator).map(key).collect();
    let rows: Vec<String> = lines[1..]
        .iter()
        .map(|line| {
            let cells = line.split(separator).zip(&names).map(|(cell, name)| format!("\"{name}\": {cell}"));
            format!("{{{}}}", cells.collect::<Vec<_>>().join(", "))
        })
        .collect();
    let diameter = value("diameter_mm").unwrap();
    let hub = value("hub_diameter_mm").unwrap_or_else(|| (0.2 * diameter.parse::<f64>().unwrap()).to_string());
    let text = format!(
        "{{\"format\": \"facemill-propeller/1\", \"diameter_mm\": {diameter}, \"blades\": {}, \"hand\": \"right\",\n\
         \"hub_diameter_mm\": {hub}, \"section\": \"naca66_a08\", \"rows\": [\n{}\n]}}\n",
        value("blades").unwrap(),
        rows.join(",\n")
    );
    facemill_file_format::from_json(text.as_bytes()).unwrap()
}

#[test]
fn json_and_csv_of_a_table_are_the_same_propeller() {
    for (csv, series) in [SERIES[0], SERIES[2]] {
        let json = facemill_file_format::to_json(&json_of(csv));
        let file = read_propeller("own.json", json.as_bytes()).unwrap();
        same_meshes(&file.spec(Some(1000.0)).unwrap(), &PropellerSpec::new(series, 1000.0).unwrap());
    }
}

/// The tables as they lie in the shared data, with a few lines above them.
#[test]
fn shared_tables_are_read_as_they_are() {
    let tables = [
        ("dtmb4119_radial.csv", "# diameter_m: 0.3048\n# blades: 3\n# hub_ratio: 0.2\n", PropellerSeries::Dtmb4119),
        ("dtmb4382_radial.csv", "# diameter_m: 0.3048\n# blades: 5\n# hub_ratio: 0.2\n", PropellerSeries::Dtmb4382),
        ("pptc_vp1304_radial.csv", "# diameter_mm: 250\n# blades: 5\n# hub_diameter_mm: 75\n", PropellerSeries::Vp1304),
    ];
    for (name, lines, series) in tables {
        let Some(path) = shared(&format!("data/tables/{name}")) else { continue };
        let table = std::fs::read_to_string(path).unwrap();
        let file = read(&format!("{lines}# hand: right\n# section: naca66_a08\n{table}")).unwrap();
        same_meshes(&file.spec(Some(1000.0)).unwrap(), &PropellerSpec::new(series, 1000.0).unwrap());
    }
}

/// Wageningen B has formulas for its columns: a table of their values at the radii of the series is
/// the same blade up to the rounding of the splines.
#[test]
fn a_table_of_a_wageningen_screw_is_that_screw() {
    for n_blades in [3, 4, 6] {
        let series = PropellerSeries::WageningenB { n_blades, area_ratio: 0.55, pitch_ratio: 0.9 };
        let built_in = PropellerSpec::new(series, 1000.0).unwrap();
        let surface = BladeSurface::new(&built_in);
        let hub_ratio = 2.0 * built_in.hub_radius() / 1000.0;
        let mut text = format!(
            "# diameter_mm: 1000\n# blades: {n_blades}\n# hand: right\n# hub_ratio: {hub_ratio}\n# section: wageningen_b\n\
             r_R,c_D,P_D,t_D,skew_rad,rake_D\n"
        );
        // Below the innermost radius of the series the laws are straight lines.
        for ratio in [0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
            let section = surface.section(500.0 * ratio);
            let z = n_blades as f64;
            let thickness = match ratio {
                1.0 => 0.003,
                r => (0.0526 - 0.062 * (r - 0.2)) - z * (0.004 - 0.005 * (r - 0.2)),
            };
            let chord = if ratio == 1.0 { 0.0 } else { section.chord() / 1000.0 };
            if ratio == 0.15 {
                continue;
            }
            let cells = [ratio, chord, section.pitch() / 1000.0, thickness, section.skew(), section.rake() / 1000.0];
            text += &format!("{}\n", cells.map(|c| c.to_string()).join(","));
        }
        let text = text.replace(&format!("# hub_ratio: {hub_ratio}"), "# hub_ratio: 0.2");
        let read = read(&text).unwrap().spec(None).unwrap();
        let of_table = BladeSurface::new(&read);
        for k in 0..40 {
            let radius = 500.0 * (0.2 + 0.79 * f64::from(k) / 39.0);
            let [a, b] = [&surface, &of_table].map(|s| s.section(radius));
            for x in [0.01, 0.2, 0.5, 0.9] {
                for side in [BladeSide::Suction, BladeSide::Pressure] {
                    let apart = (a.point(side, x) - b.point(side, x)).norm();
                    assert!(apart < 1e-6, "B{n_blades}, r {radius}, x {x}: {apart}");
                }
            }
        }
    }
}
