//! Parts from files of users: propellers by their tables, and meshes as 3MF; propellers with their
//! castings.

use std::io::{Cursor, Write as _};

use facemill::new_job::{NewJob, Series, new_job};
use facemill::sample_parts::{PropellerSeries, TableSections, TableThickness};
use facemill::surface_model::TriMesh;
use facemill::{Failure, Job, describe_setup};
use facemill_tests::jobs::JobFolder;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::{tiny_patch, write_patch};
use nalgebra::Vector3;
use serde_json::json;

/// The table of a series as CSV.
fn csv_of(series: PropellerSeries, name: &str, hand: &str) -> String {
    let table = series.table().expect("a series with a table");
    let TableSections::Naca66A08 { thickness, camber } = &table.sections else { panic!("NACA sections") };
    let (thickness_name, thickness) = match thickness {
        TableThickness::OfChord(values) => ("t_c", values),
        TableThickness::OfDiameter(values) => ("t_D", values),
    };
    let mut text = format!(
        "# name: {name}\n# diameter_mm: 600\n# blades: {}\n# hand: {hand}\n# hub_ratio: {}\n# section: naca66_a08\n\
         r_R,c_D,P_D,{thickness_name},f_c,skew_rad,rake_D\n",
        table.n_blades, table.hub_ratio
    );
    for (k, radius) in table.radii.iter().enumerate() {
        let row = [*radius, table.chord[k], table.pitch[k], thickness[k], camber[k], table.skew[k], table.rake[k]];
        text += &(row.map(|value| value.to_string()).join(",") + "\n");
    }
    text
}

fn folder_with(name: &str, text: &str) -> JobFolder {
    JobFolder::of(&[(name.to_owned(), text.as_bytes().to_vec())])
}

fn own(folder: &JobFolder, name: &str, diameter_mm: Option<f64>) -> Result<Vec<(String, Vec<u8>)>, String> {
    new_job(&NewJob::OwnPropeller { table: folder.path(name), diameter_mm })
}

/// Mesh, tool, machine and job: all bytes.
#[test]
fn the_job_of_a_series_by_its_table_is_that_of_the_series() {
    let series = [
        (PropellerSeries::Dtmb4119, Series::Dtmb4119, "DTMB 4119"),
        (PropellerSeries::Dtmb4382, Series::Dtmb4382, "DTMB 4382"),
        (PropellerSeries::Vp1304, Series::Vp1304, "VP1304"),
    ];
    for (table, series, name) in series {
        let folder = folder_with("own.csv", &csv_of(table, name, "right"));
        for diameter_mm in [600.0, 900.0] {
            let given = Some(diameter_mm).filter(|d| *d != 600.0);
            let files = own(&folder, "own.csv", given).unwrap();
            assert!(files == new_job(&NewJob::Propeller { series, diameter_mm }).unwrap(), "{name}, {diameter_mm} mm");
        }
    }
}

#[test]
fn a_left_handed_propeller_is_a_job_that_checks() {
    let folder = folder_with("mine.csv", &csv_of(PropellerSeries::Dtmb4119, "", "left").replace("# name: \n", ""));
    let job = JobFolder::of(&own(&folder, "mine.csv", None).unwrap());
    let read = Job::read(&job.job()).unwrap();
    assert!(read.file.name.starts_with("mine, D 600 mm"), "{}", read.file.name);
    let described = describe_setup(&read, 0).unwrap().join("\n");
    assert!(described.contains("4 components, closed"), "{described}");
}

/// The command says hand, skew and rake back: a wrong sign is a propeller for another boat.
#[test]
fn the_command_says_how_it_understands_a_table() {
    let right = csv_of(PropellerSeries::Vp1304, "mine", "right");
    let mirrored = right.replace("hand: right", "hand: left");
    // Skew with the rotation, rake ahead: the signs of the last two columns turned.
    let turned: String = right
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let minus = |cell: &str| cell.parse().map_or_else(|_| cell.to_owned(), |v: f64| (-v).to_string());
            let last = cells.len() - 1;
            if last < 6 || line.starts_with('r') {
                return line.to_owned() + "\n";
            }
            format!("{},{},{}\n", cells[..5].join(","), minus(cells[5]), minus(cells[6]))
        })
        .collect();
    // Of VP1304 at 600 mm the tip's rake is -2.5 mm of 250 mm.
    for (text, words) in [
        (&right, ["mine: 5 blades, D 600 mm, right-handed", "deg against the rotation", "rake 6 mm aft"]),
        (&mirrored, ["left-handed", "deg against the rotation", "rake 6 mm aft"]),
        (&turned, ["right-handed", "deg with the rotation", "rake 6 mm ahead"]),
    ] {
        let folder = folder_with("own.csv", text);
        let (job, table) = (folder.path("job"), folder.path("own.csv"));
        let output = run(&["new".into(), "propeller".into(), job.into_os_string(), "--table".into(), table.into()]);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    }
}

#[test]
fn tables_that_describe_no_propeller_have_exit_code_2_and_write_nothing() {
    let good = csv_of(PropellerSeries::Dtmb4119, "DTMB 4119", "right");
    let cases = [
        (good.replacen("0.4048", "nan", 1), vec!["own.csv: line 10, column \"c_D\": ", "no number"]),
        (good.replacen("0.4048", "-1", 1), vec!["own.csv: line 10: ", "chord"]),
        (good.replacen("hub_ratio: 0.2", "hub_ratio: 0.1", 1), vec!["own.csv: line 8: ", "add a row at the hub"]),
        ("[".repeat(10_000) + &"]".repeat(10_000), vec!["own.csv: is no table: JSON of a propeller is an object"]),
        ("name of a pipe\n1\n".to_owned(), vec!["own.csv: line 1: is no table of a propeller: "]),
    ];
    for (text, words) in cases {
        let folder = folder_with("own.csv", &text);
        let (job, table) = (folder.path("job"), folder.path("own.csv"));
        let arguments =
            ["new".into(), "propeller".into(), job.clone().into_os_string(), "--table".into(), table.into()];
        let (code, errors) = code_and_errors(&run(&arguments));
        assert!(code == 2 && words.iter().all(|word| errors.contains(word)) && !job.exists(), "{code}: {errors}");
        let file = folder.path("own.csv").display().to_string();
        assert!(errors.starts_with(&format!("facemill: {file}: ")), "{errors}");
    }
    let folder = folder_with("own.csv", "");
    let (job, table) = (folder.path("job"), folder.path("none.csv"));
    let arguments = ["new".into(), "propeller".into(), job.into_os_string(), "--table".into(), table.clone().into()];
    let (code, errors) = code_and_errors(&run(&arguments));
    let expected = format!("facemill: {}: cannot be read: ", table.display());
    assert!(code == 2 && errors.starts_with(&expected), "{code}: {errors}");
}

/// A table without a diameter takes that of the option, as one that has it in its text; a table
/// with one is scaled by it.
#[test]
fn the_diameter_of_the_option_is_enough_for_a_table_and_scales_one_that_has_it() {
    let good = csv_of(PropellerSeries::Vp1304, "VP1304", "right");
    let bare: String =
        good.lines().filter(|line| !line.contains("diameter_")).map(|line| format!("{line}\n")).collect();
    assert!(bare.len() < good.len(), "{good}");
    let of = |text: &str, diameter: Option<&str>| {
        let folder = folder_with("own.csv", text);
        let (job, table) = (folder.path("job"), folder.path("own.csv"));
        let mut arguments: Vec<std::ffi::OsString> =
            vec!["new".into(), "propeller".into(), job.clone().into(), "--table".into(), table.into()];
        arguments.extend(diameter.into_iter().flat_map(|mm| ["--diameter-mm".into(), mm.into()]));
        let (code, errors) = code_and_errors(&run(&arguments));
        (code, errors, std::fs::read(job.join("propeller.glb")).unwrap_or_default())
    };
    let (code, errors, _) = of(&bare, None);
    assert!(
        code == 2 && errors.contains("has no line \"# diameter_mm: …\"; add it, or give --diameter-mm"),
        "{errors}"
    );
    let (code, errors, alone) = of(&bare, Some("600"));
    assert_eq!((code, errors.as_str()), (0, ""));
    let (code, errors, scaled) = of(&good.replace("diameter_mm: 600", "diameter_mm: 300"), Some("600"));
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(!alone.is_empty() && alone == scaled);
}

/// A mesh as a 3MF package, in inches, its object placed by a shift.
fn threemf(mesh: &TriMesh, name: &str) -> Vec<u8> {
    let mut model =
        "<model unit=\"inch\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources>\
                     <object id=\"1\" name=\""
            .to_owned()
            + name
            + "\"><mesh><vertices>";
    for p in mesh.vertices() {
        let [x, y, z] = [p.x - 25.4, p.y, p.z].map(|c| c / 25.4);
        model += &format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>\n");
    }
    model += "</vertices><triangles>";
    for [a, b, c] in mesh.triangles() {
        model += &format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>\n");
    }
    model += "</triangles></mesh></object></resources><build><item objectid=\"1\" \
              transform=\"1 0 0 0 1 0 0 0 1 1 0 0\"/></build></model>";
    let relations = "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship \
                     Id=\"r\" Target=\"/3D/3dmodel.model\" \
                     Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in [("_rels/.rels", relations), ("3D/3dmodel.model", &model)] {
        writer.start_file(name, zip::write::SimpleFileOptions::default()).expect("a file");
        writer.write_all(text.as_bytes()).expect("bytes in memory");
    }
    writer.finish().expect("a package").into_inner()
}

fn mesh_of(job: &JobFolder, name: &str) -> Result<TriMesh, Failure> {
    facemill::read_mesh(&job.path(name), None, None).map(|imported| imported.mesh)
}

#[test]
fn a_mesh_as_3mf_takes_the_place_of_an_obj() {
    let job = tiny_patch();
    write_patch(&job, 12);
    let obj = mesh_of(&job, "patch.obj").unwrap();
    job.write("patch.3mf", &threemf(&obj, "patch"));
    let read = mesh_of(&job, "patch.3mf").unwrap();
    assert_eq!((read.triangles(), read.groups()), (obj.triangles(), obj.groups()));
    for (p, q) in read.vertices().iter().zip(obj.vertices()) {
        assert!((p - q).norm() < 1e-12);
    }
    let mesh = json!([{ "file": "patch.3mf", "groups": ["patch"], "role": "drive" }]);
    job.set("job.json", &[("/setups/0/meshes", mesh)]);
    let described = describe_setup(&Job::read(&job.job()).unwrap(), 0).unwrap().join("\n");
    assert!(described.contains("patch.3mf in millimetres, z up"), "{described}");
}

#[test]
fn a_3mf_that_is_none_is_named_with_its_object() {
    let job = tiny_patch();
    let broken = threemf(&mesh_of(&job, "patch.obj").unwrap(), "patch\" id=\"1");
    job.write("patch.3mf", &broken);
    job.set("job.json", &[("/setups/0/meshes/0", json!({ "file": "patch.3mf", "role": "drive" }))]);
    let why = describe_setup(&Job::read(&job.job()).unwrap(), 0).unwrap_err();
    assert!(why.to_string().contains("patch.3mf") && why.to_string().contains("3D/3dmodel.model"), "{why}");
    let (code, errors) = code_and_errors(&run(&["check".into(), job.job()]));
    assert!(code == 2 && errors.contains("patch.3mf") && errors.contains("3D/3dmodel.model"), "{code}: {errors}");
}

/// A radial blade of thin ellipses with twelve points each, with these lines in its `.inf` file.
fn blade_of_ellipses(lines: &str) -> JobFolder {
    let mut profile = String::new();
    for (k, radius) in [60.0, 80.0, 100.0].into_iter().enumerate() {
        profile += &format!("# Profile {}\n", k + 1);
        for j in 0..=12 {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(j % 12) / 12.0).sin_cos();
            profile += &format!("{} {radius} {}\n", 4.0 * sin, 50.0 * cos);
        }
    }
    let inf = format!("Axis of Rotation: Z\nGeometry Units: MM\n{lines}Profile Data File: p.curve\n");
    JobFolder::of(&[("b.inf".to_owned(), inf.into_bytes()), ("p.curve".to_owned(), profile.into_bytes())])
}

/// Edges that the file says are rounded have no corners.
#[test]
fn the_inf_file_says_whether_an_edge_of_a_blade_is_rounded() {
    // Of both edges, the leading one before the trailing one.
    let has_corners = |lines: &str| {
        let folder = blade_of_ellipses(lines);
        let blade = NewJob::Blade { from: folder.path("b.inf"), scale: 1.0, hub: false };
        let files = new_job(&blade).unwrap_or_else(|e| panic!("{lines}: {e}"));
        let job = JobFolder::of(&files);
        let mesh = mesh_of(&job, "blade.obj").expect("a mesh");
        // Facets on both sides of an edge's middle, where the ellipse faces along the chord.
        [-50.0, 50.0].map(|z: f64| {
            let touches = |t: &usize| mesh.corners(*t).iter().any(|p| (p.z - z).abs() < 1e-6);
            let of_sides = mesh.groups().iter().filter(|group| !["root", "tip"].contains(&group.name.as_str()));
            let at_edge = of_sides.flat_map(|group| group.triangles.clone()).filter(touches);
            let along = Vector3::new(0.0, 0.0, z.signum());
            at_edge.map(|t| mesh.scaled_normal(t).angle(&along)).fold(0.0, f64::max) > 0.7
        })
    };
    assert_eq!(has_corners(""), [true, true]);
    assert_eq!(has_corners("Blade 0 TE: EllipseEnd\n"), [true, false]);
    assert_eq!(has_corners("Blade 0 LE: EllipseEnd\nBlade 0 TE: EllipseEnd\n"), [false, false]);
    for (lines, words) in [
        ("Blade 0 LE: Pointed\n", ["b.inf: line 3: ", "EllipseEnd, CutOffEnd"]),
        ("Blade 0 LE: CutOffEnd\n", ["b.inf: ", "say that the edge is rounded"]),
        ("Number of Blades Per Set: 2\n", ["b.inf: line 3: ", "## Splitter blade"]),
    ] {
        let folder = blade_of_ellipses(lines);
        let (job, from) = (folder.path("job"), folder.path("b.inf"));
        let arguments = ["new".into(), "blade".into(), job.clone().into_os_string(), "--from".into(), from.into()];
        let (code, errors) = code_and_errors(&run(&arguments));
        assert!(code == 2 && words.iter().all(|word| errors.contains(word)) && !job.exists(), "{code}: {errors}");
    }
}
