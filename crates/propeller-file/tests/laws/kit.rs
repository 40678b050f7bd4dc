//! Tables of the tests, and what they mean by definition.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use facemill_propeller_file::{PropellerFile, read_propeller};
use facemill_surface_model::TriMesh;
use facemill_test_kit::Random;
use nalgebra::Point3;

/// Particulars of most tests.
pub(crate) const HEADER: &str = "# diameter_mm: 1000\n# blades: 4\n# hand: right\n# hub_ratio: 0.2\n";

/// DTMB 4119 as published, typed anew.
pub(crate) const DTMB_4119: &str = "# diameter_mm: 304.8\n# blades: 3\n# hand: right\n# hub_ratio: 0.2\n\
    # section: naca66_a08\n\
    r_R,c_D,P_D,t_c,f_c,skew_deg,rake_D\n\
    0.2,0.32,1.105,0.2055,0.01429,0,0\n0.3,0.3625,1.102,0.1553,0.02318,0,0\n0.4,0.4048,1.098,0.118,0.02303,0,0\n\
    0.5,0.4392,1.093,0.09016,0.02182,0,0\n0.6,0.461,1.088,0.0696,0.02072,0,0\n0.7,0.4622,1.084,0.05418,0.02003,0,0\n\
    0.8,0.4347,1.081,0.04206,0.01967,0,0\n0.9,0.3613,1.079,0.03321,0.01817,0,0\n0.95,0.2775,1.077,0.03228,0.01631,0,0\n\
    1.0,0,1.075,0.0316,0.01175,0,0\n";

/// DTMB 4382 as published, in inches, tabs, and columns in another order.
pub(crate) const DTMB_4382: &str = "# diameter_in: 12\n# blades: 5\n# hand: right\n# hub_ratio: 0.2\n\
    # section: naca66_a08\n\
    skew_deg\tP/D\tr/R\tf/c\tc/D\tt/c\n\
    0\t1.455\t0.2\t0.043\t0.174\t0.2494\n2.328\t1.444\t0.25\t0.0395\t0.202\t0.196\n4.655\t1.433\t0.3\t0.037\t0.229\t0.1562\n\
    9.363\t1.412\t0.4\t0.0344\t0.275\t0.1068\n13.948\t1.361\t0.5\t0.0305\t0.312\t0.0768\n18.378\t1.285\t0.6\t0.0247\t0.337\t0.0566\n\
    22.747\t1.2\t0.7\t0.0199\t0.347\t0.0421\n27.145\t1.112\t0.8\t0.0161\t0.334\t0.0314\n31.575\t1.027\t0.9\t0.0134\t0.28\t0.0239\n\
    33.788\t0.985\t0.95\t0.014\t0.21\t0.0229\n36.0\t0.942\t1.0\t0.0134\t0.01\t0.016\n";

/// VP1304 as published, in mm.
pub(crate) const VP1304: &str = "# diameter_mm: 250\n# blades: 5\n# hand: right\n# hub_diameter_mm: 75\n\
    # section: naca66_a08\n\
    r_mm;chord_mm;pitch_mm;dist_lead_edge_mm;max_camber_mm;max_thick_mm;rake_mm\n\
    37.5;45.0;350.0;18.25;0.675;13.525;0.0\n43.75;56.25;363.75;29.625;1.125;12.05;-0.5\n\
    50.0;65.4166;376.25;38.7916;1.57;10.6875;-1.25\n62.5;81.25;394.5;52.125;2.35584;8.1375;-3.35\n\
    75.0;94.1666;405.0;59.8334;2.8375;6.05;-5.875\n87.5;104.167;408.75;61.6666;3.09334;4.425;-7.5\n\
    100.0;107.083;403.5;56.2916;3.05166;3.25;-7.375\n106.25;106.542;395.5;50.9334;2.9675;2.775;-6.625\n\
    112.5;104.167;382.75;42.8334;2.67166;2.375;-5.45\n118.75;94.1666;364.5;29.3334;2.19416;2.0125;-4.03334\n\
    121.875;78.6666;352.75;17.0;1.715;1.825;-3.3\n125.0;25.0;338.75;-14.5834;0.5;1.6375;-2.5\n";

pub(crate) fn read(text: &str) -> Result<PropellerFile, String> {
    read_propeller("own.csv", text.as_bytes()).map_err(|e| e.to_string())
}

/// Why a file describes no propeller.
pub(crate) fn refused(text: &str) -> String {
    match read(text).and_then(|file| file.spec(None).map_err(|e| e.to_string())) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(why) => why,
    }
}

/// Bits of a mesh: equal for equal meshes alone.
pub(crate) fn bits(mesh: &TriMesh) -> (Vec<u64>, Vec<[u32; 3]>, Vec<String>) {
    let vertices = mesh.vertices().iter().flat_map(|p| p.iter().map(|x| x.to_bits()).collect::<Vec<_>>()).collect();
    let groups = mesh.groups().iter().map(|g| format!("{} {:?}", g.name, g.triangles)).collect();
    (vertices, mesh.triangles().to_vec(), groups)
}

/// A row of a radial table: r/R, c/D, P/D, t/c, f/c, skew in degrees, rake/D.
pub(crate) type RadialValues = [f64; 7];

/// A smooth blade with some noise in its rows.
pub(crate) fn random_rows(random: &mut Random, hub: f64, n: usize) -> Vec<RadialValues> {
    let twist = random.between(0.6, 1.4);
    let skew = random.between(0.0, 40.0);
    (0..n)
        .map(|k| {
            let share = k as f64 / (n - 1) as f64;
            let radius = hub + (1.0 - hub) * share;
            let chord = random.between(0.9, 1.1) * (0.2 + 0.25 * (std::f64::consts::PI * share).sin());
            [
                radius,
                chord,
                twist + random.between(-0.02, 0.02),
                0.2 - 0.15 * share + random.between(0.0, 0.004),
                0.02 + random.between(0.0, 0.005),
                skew * share * share,
                -0.1 * share,
            ]
        })
        .collect()
}

pub(crate) fn radial_csv(rows: &[RadialValues]) -> String {
    let mut text = "r_R,c_D,P_D,t_c,f_c,skew_deg,rake_D\n".to_owned();
    for row in rows {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

/// Where a point of a section is by the definition of the table: `n` above the helix, `x` of the
/// chord from the leading edge.
pub(crate) fn placed(
    diameter: f64,
    [ratio, chord, pitch, _, _, skew, rake]: RadialValues,
    x: f64,
    n: f64,
) -> Point3<f64> {
    let radius = 0.5 * ratio * diameter;
    let angle = (pitch * diameter / (TAU * radius)).atan();
    let along = chord * diameter * (0.5 - x) - radius * skew.to_radians() / angle.cos();
    let around = (along * angle.cos() - n * angle.sin()) / radius;
    let z = rake * diameter + along * angle.sin() + n * angle.cos();
    Point3::new(radius * around.cos(), radius * around.sin(), z)
}

/// A file of the shared data, or `None` with the reason printed when it is not there.
pub(crate) fn shared(file: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("FACEMILL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = folder.join(file);
    if path.is_file() {
        return Some(path);
    }
    println!("skipped: {} is not there (set FACEMILL_SHARED to the folder of shared data)", path.display());
    None
}
