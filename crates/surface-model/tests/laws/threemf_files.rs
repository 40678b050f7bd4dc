//! 3MF packages: units, placed objects, and packages that are none.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use facemill_surface_model::{
    ImportSettings, Imported, LengthUnit, MeshFormat, NamedNode, TriMesh, import_mesh, no_external_files,
    write_stl_binary,
};
use facemill_test_kit::{Random, ball_mesh, box_mesh};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="t" Target="/Metadata/thumbnail.png" Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>
<Relationship Id="r" Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>"#;

const CORE: &str = "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"";

fn package_of(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (k, (name, bytes)) in files.iter().enumerate() {
        let method = if k % 2 == 0 { CompressionMethod::Deflated } else { CompressionMethod::Stored };
        // What is large is large for its compression.
        let method = if bytes.len() > 100_000 { CompressionMethod::Deflated } else { method };
        writer.start_file(*name, SimpleFileOptions::default().compression_method(method)).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn package(model: &str) -> Vec<u8> {
    package_of(&[("_rels/.rels", RELATIONS.as_bytes()), ("3D/3dmodel.model", model.as_bytes())])
}

fn model(unit: &str, resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{unit}\" xml:lang=\"en-US\" {CORE}>\n\
         <metadata name=\"Title\">A &lt;part&gt;</metadata>\n<resources>{resources}</resources>\n\
         <build>{build}</build></model>\n"
    )
}

fn mesh_xml(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> String {
    let mut text = "<mesh><vertices>\n".to_owned();
    for p in vertices {
        let _ = writeln!(text, "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", p.x, p.y, p.z);
    }
    text += "</vertices><triangles>\n";
    for [a, b, c] in triangles {
        let _ = writeln!(text, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\" pid=\"9\" p1=\"0\"></triangle>");
    }
    text + "</triangles></mesh>"
}

fn cube() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    box_mesh([-1.0, -2.0, -3.0], [2.0, 3.0, 5.0])
}

fn import(bytes: &[u8]) -> Result<Imported, String> {
    let settings = ImportSettings::default_for(MeshFormat::ThreeMf);
    import_mesh("part.3mf", bytes, MeshFormat::ThreeMf, &settings, &no_external_files).map_err(|e| e.to_string())
}

fn refused(bytes: &[u8]) -> String {
    match import(bytes) {
        Ok(imported) => panic!("accepted: {} triangles", imported.mesh.triangles().len()),
        Err(why) => why,
    }
}

/// Twelve numbers of a matrix and a shift, as rows that are multiplied from the left.
fn transform(linear: &Matrix3<f64>, shift: &Vector3<f64>) -> String {
    let columns = linear.iter().chain(shift.iter());
    columns.map(f64::to_string).collect::<Vec<_>>().join(" ")
}

fn corners(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    (0..mesh.triangles().len()).map(|t| mesh.corners(t)).collect()
}

/// The law of components and build items: a cube in inches, within an object, within another, in
/// two places, is its triangles taken through the matrices by hand.
#[test]
fn objects_are_in_their_places_in_the_unit_of_the_file() {
    let mut random = Random(51);
    let units = [
        ("inch", 25.4),
        ("millimeter", 1.0),
        ("micron", 0.001),
        ("centimeter", 10.0),
        ("foot", 304.8),
        ("meter", 1000.0),
    ];
    let (vertices, triangles) = cube();
    for (round, (unit, mm)) in units.into_iter().cycle().take(24).enumerate() {
        let matrix = |random: &mut Random| {
            let turn = random.motion(20.0);
            // Stretched, and every third time mirrored.
            let stretch = Vector3::new(random.between(0.5, 2.0), random.between(0.5, 2.0), random.between(0.5, 2.0));
            let mirror = if round % 3 == 0 { -1.0 } else { 1.0 };
            let linear = turn.rotation.to_rotation_matrix().into_inner()
                * Matrix3::from_diagonal(&(stretch.component_mul(&Vector3::new(mirror, 1.0, 1.0))));
            (linear, turn.translation.vector)
        };
        let [inner, outer, item, second] = [0; 4].map(|_| matrix(&mut random));
        let text = model(
            unit,
            &format!(
                "<object id=\"1\" name=\"cube\">{}</object><object id=\"2\"><components>\
                 <component objectid=\"1\" transform=\"{}\"/></components></object><object id=\"3\"><components>\
                 <component objectid=\"2\" transform=\"{}\"/></components></object>",
                mesh_xml(&vertices, &triangles),
                transform(&inner.0, &inner.1),
                transform(&outer.0, &outer.1)
            ),
            &format!(
                "<item objectid=\"3\" transform=\"{}\"/><item objectid=\"2\" transform=\"{}\"/>",
                transform(&item.0, &item.1),
                transform(&second.0, &second.1)
            ),
        );
        let mesh = import(&package(&text)).unwrap().mesh;
        let through = |p: &Point3<f64>, steps: &[&(Matrix3<f64>, Vector3<f64>)]| {
            steps.iter().fold(p.coords, |v, (linear, shift)| linear * v + shift) * mm
        };
        let expected: Vec<[Vector3<f64>; 3]> = [vec![&inner, &outer, &item], vec![&inner, &second]]
            .iter()
            .flat_map(|steps| {
                let mirrors = steps.iter().map(|(linear, _)| linear.determinant()).product::<f64>() < 0.0;
                triangles
                    .iter()
                    .map(move |[a, b, c]| if mirrors { [*a, *c, *b] } else { [*a, *b, *c] })
                    .map(|t| t.map(|v| through(&vertices[v as usize], steps)))
            })
            .collect();
        let found = corners(&mesh);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            for (p, q) in found.iter().zip(expected) {
                assert!((p.coords - q).norm() < 1e-9 * (1.0 + q.norm()), "{unit}: {p} against {q}");
            }
        }
        assert_eq!(mesh.groups().len(), 1, "both are called cube, and follow each other");
    }
}

#[test]
fn the_same_part_as_stl_and_as_3mf_is_the_same_triangles() {
    let ball = ball_mesh(17.25, [12, 16]);
    // Coordinates that STL has, too.
    let vertices: Vec<Point3<f64>> = ball.0.iter().map(|p| p.map(|x| f64::from(x as f32))).collect();
    let mesh = TriMesh::new(vertices.clone(), ball.1.clone()).unwrap();
    let node = NamedNode { name: "ball", mesh: 0, transform: Isometry3::identity() };
    let stl = write_stl_binary(&[&mesh], &[node]).unwrap();
    let settings = ImportSettings::default_for(MeshFormat::Stl);
    let of_stl = import_mesh("ball.stl", &stl, MeshFormat::Stl, &settings, &no_external_files).unwrap();
    let text = model(
        "millimeter",
        &format!("<object id=\"7\">{}</object>", mesh_xml(&vertices, &ball.1)),
        "<item objectid=\"7\"/>",
    );
    let of_3mf = import(&package(&text)).unwrap();
    assert_eq!(corners(&of_3mf.mesh), corners(&of_stl.mesh));
    assert_eq!(of_3mf.report.n_closed, 1);
}

/// Groups by name of object, of the nearest named object around it, of the item, and by id.
#[test]
fn groups_have_the_names_of_the_file() {
    let (vertices, triangles) = cube();
    let mesh = mesh_xml(&vertices, &triangles);
    let shift = |x: f64| format!("transform=\"1 0 0 0 1 0 0 0 1 {x} 0 0\"");
    let text = model(
        "millimeter",
        &format!(
            "<object id=\"1\" name=\" blade &amp; hub \">{mesh}</object><object id=\"2\">{mesh}</object>\
             <object id=\"3\" name=\"rotor\"><components><component objectid=\"1\"/><component objectid=\"2\" {}/>\
             </components></object><object id=\"4\" type=\"support\">{mesh}</object>\
             <object id=\"5\"><components><component objectid=\"4\"/></components></object>",
            shift(10.0)
        ),
        &format!(
            "<item objectid=\"3\" {}/><item objectid=\"2\" {} partnumber=\"P-7\"/><item objectid=\"2\" {}/>\
             <item objectid=\"4\"/><item objectid=\"5\"/>",
            shift(0.0),
            shift(20.0),
            shift(30.0)
        ),
    );
    let mesh = import(&package(&text)).unwrap().mesh;
    let groups: Vec<(&str, usize)> = mesh.groups().iter().map(|g| (g.name.as_str(), g.triangles.len())).collect();
    assert_eq!(groups, [("blade & hub", 12), ("rotor", 12), ("P-7", 12), ("object 2", 12)]);
}

/// Files of slicers and CAD have more: other prefixes, colour groups, models beside the main one.
#[test]
fn extensions_that_change_no_triangle_are_passed_over() {
    let (vertices, triangles) = cube();
    let mesh = mesh_xml(&vertices, &triangles);
    let colours = "<m:colorgroup id=\"9\"><m:color color=\"#FF0000\"/></m:colorgroup><basematerials id=\"8\">\
                   <base name=\"steel\" displaycolor=\"#808080\"/></basematerials>\
                   <m:object id=\"1\"><mesh><vertices><vertex x=\"nan\"/></vertices></mesh></m:object>";
    let head = |body: &str| {
        format!(
            "<model unit=\"inch\" {CORE} xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\" \
             xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" requiredextensions=\"p m\">{body}\
             </model>"
        )
    };
    let main = head(&format!(
        "<resources>{colours}<object id=\"1\" p:UUID=\"x\"><components><component p:path=\"/3D/Objects/a%20b.model\" \
         objectid=\"1\"/></components></object></resources><build p:UUID=\"y\"><item objectid=\"1\"/></build>"
    ));
    let beside = head(&format!("<resources><object id=\"1\" name=\"inner\">{mesh}</object></resources><build/>"));
    let files = [
        ("_RELS/.rels", RELATIONS.as_bytes()),
        ("3d/3Dmodel.model", main.as_bytes()),
        ("3D/Objects/a b.model", beside.as_bytes()),
        ("../../outside.model", b"x"),
    ];
    let imported = import(&package_of(&files)).unwrap();
    assert_eq!(imported.mesh.groups()[0].name, "inner");
    let size = imported.mesh.vertices().iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    assert!((size - 2.0 * 25.4).abs() < 1e-12);
    // The same with a prefix for the core.
    let prefixed = format!(
        "<c:model xmlns:c=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><c:resources><c:object id=\"1\">{}\
         </c:object></c:resources><c:build><c:item objectid=\"1\"/></c:build></c:model>",
        mesh.replace("</", "\u{1}").replace('<', "<c:").replace('\u{1}', "</c:")
    );
    assert_eq!(import(&package(&prefixed)).unwrap().mesh.triangles().len(), 12);
    let other = files.map(|(name, bytes)| {
        let text = String::from_utf8_lossy(bytes);
        (name, if name.contains("a b") { text.replace("\"inch\"", "\"foot\"") } else { text.into_owned() })
    });
    let why = refused(&package_of(&other.each_ref().map(|(name, text)| (*name, text.as_bytes()))));
    assert!(why.contains("its unit is foot") && why.contains("write one unit"), "{why}");
}

#[test]
fn a_unit_beside_that_of_the_file_is_refused() {
    let (vertices, triangles) = cube();
    let text = model(
        "inch",
        &format!("<object id=\"1\">{}</object>", mesh_xml(&vertices, &triangles)),
        "<item objectid=\"1\"/>",
    );
    let settings = ImportSettings { unit: LengthUnit::Inch, ..ImportSettings::default_for(MeshFormat::ThreeMf) };
    let why = import_mesh("part.3mf", &package(&text), MeshFormat::ThreeMf, &settings, &no_external_files);
    assert!(why.unwrap_err().to_string().contains("leave the unit out"));
}

/// A cube with a change of the text of its model.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let (vertices, triangles) = cube();
    let mesh = mesh_xml(&vertices, &triangles);
    let text = model(
        "millimeter",
        &format!(
            "<object id=\"1\">{mesh}</object><object id=\"2\"><components><component objectid=\"1\" \
             transform=\"1 0 0 0 1 0 0 0 1 0 0 0\"/></components></object>"
        ),
        "<item objectid=\"2\"/>",
    );
    import(&package(&text)).unwrap();
    assert!(text.contains(from), "{from}");
    package(&text.replacen(from, to, 1))
}

#[test]
fn faults_name_part_and_object() {
    let cases = [
        ("x=\"-1\"", "x=\"nan\"", "3D/3dmodel.model, object 1, vertex 0 has a coordinate that is not a finite number"),
        ("x=\"-1\"", "x=\"1e999\"", "3D/3dmodel.model, object 1, vertex 0 has a coordinate"),
        ("x=\"-1\"", "x=\"one\"", "3D/3dmodel.model, object 1: vertex 0 has x = \"one\""),
        ("x=\"-1\"", "", "3D/3dmodel.model, object 1: vertex 0 has no x"),
        (
            "v1=\"0\"",
            "v1=\"1000000000\"",
            "3D/3dmodel.model, object 1: triangle 0 uses vertex 1000000000, but there are only 8",
        ),
        ("v1=\"0\"", "v1=\"-1\"", "3D/3dmodel.model, object 1: triangle 0 has v1 = \"-1\""),
        ("v1=\"0\"", "", "3D/3dmodel.model, object 1: triangle 0 has no v1"),
        ("objectid=\"1\"", "objectid=\"5\"", "3D/3dmodel.model, object 2: it places object 5"),
        ("objectid=\"1\"", "objectid=\"2\"", "3D/3dmodel.model, object 2: its components lead back to it"),
        ("objectid=\"1\"", "", "3D/3dmodel.model, object 2: \"component\" has no objectid"),
        ("item objectid=\"2\"", "item objectid=\"9\"", "3D/3dmodel.model, build: it places object 9"),
        ("item objectid=\"2\"", "thing objectid=\"2\"", "3D/3dmodel.model: its build has no item"),
        ("id=\"2\"", "id=\"1\"", "object 1: there are two objects with the id 1"),
        ("id=\"2\"", "id=\"two\"", "id is \"two\""),
        (
            "1 0 0 0 1 0 0 0 1 0 0 0",
            "1 0 0 0 1 0 0 0 1 0 0",
            "object 2: the transform \"1 0 0 0 1 0 0 0 1 0 0\" is not",
        ),
        ("1 0 0 0 1 0 0 0 1 0 0 0", "1 0 0 0 1 0 0 0 1 0 0 inf", "object 2: the transform"),
        ("1 0 0 0 1 0 0 0 1 0 0 0", "1 0 0 0 1 0 0 0 1 0 0 0 0", "object 2: the transform"),
        ("1 0 0 0 1 0 0 0 1 0 0 0", "1e308 0 0 0 1e308 0 0 0 1e308 0 0 0", "not a finite number"),
        ("1 0 0 0 1 0 0 0 1 0 0 0", "0 0 0 0 0 0 0 0 0 0 0 0", "no triangle with an area"),
        ("millimeter", "parsec", "its unit is \"parsec\"; known are micron, millimeter"),
        ("core/2015/02", "core/2099/02", "is not of the namespace"),
        ("<model ", "<mesh ", "3D/3dmodel.model"),
        ("</resources>", "", "the XML is wrong"),
        ("</model>", "", "the XML ends in the middle"),
        ("<resources>", "<!DOCTYPE a [<!ENTITY b \"c\">]><resources>", "document type"),
        ("<metadata", "<metadata name=&b;/><metadata", "an attribute is wrong"),
        ("xml:lang", "requiredextensions=\"b\" xmlns:b=\"urn:beams\" xml:lang", "the extension urn:beams"),
        ("<item objectid=\"2\"", "<item xmlns:p=\"x\" objectid=\"7\"", "places object 7"),
    ];
    for (from, to, message) in cases {
        let why = refused(&changed(from, to));
        assert!(why.starts_with("part.3mf: ") && why.contains(message), "{from} → {to}: {why}");
    }
}

#[test]
fn packages_that_are_none_are_refused() {
    let relation = |target: &str| {
        let relations = RELATIONS.replace("/3D/3dmodel.model", target);
        package_of(&[("_rels/.rels", relations.as_bytes()), ("3D/3dmodel.model", b"<model/>")])
    };
    for (bytes, message) in [
        (b"solid cube".to_vec(), "the 3MF package: it cannot be unpacked"),
        (Vec::new(), "the 3MF package: it cannot be unpacked"),
        (package_of(&[("a", b"b")]), "_rels/.rels: the package has no such file"),
        (package_of(&[("_rels/.rels", b"<Relationships/>")]), "_rels/.rels: it names no 3D model"),
        (package_of(&[("_rels/.rels", b"")]), "_rels/.rels, byte 0: the XML ends in the middle"),
        (relation("/3D/other.model"), "3D/other.model: the package has no such file"),
        (relation("/../3dmodel.model"), "_rels/.rels: the name \"/../3dmodel.model\" leads out of the package"),
        (relation("/3D/%2e%2e/%2E%2E/etc/passwd"), "leads out of the package"),
        (relation("C:\\3dmodel.model"), "leads out of the package"),
        (relation("http://example.invalid/a.model"), "leads out of the package"),
    ] {
        let why = refused(&bytes);
        assert!(why.starts_with("part.3mf: ") && why.contains(message), "{why}");
    }
}

/// Objects of two of the one before, 40 levels deep: a trillion cubes in a few kilobytes.
#[test]
fn components_that_repeat_without_end_are_refused_at_once() {
    let (vertices, triangles) = cube();
    for inner in [mesh_xml(&vertices, &triangles), mesh_xml(&vertices, &triangles[..1]), mesh_xml(&vertices, &[])] {
        let mut resources = format!("<object id=\"1\">{inner}</object>");
        for level in 2..=41 {
            let component = format!("<component objectid=\"{}\"/>", level - 1);
            let _ =
                write!(resources, "<object id=\"{level}\"><components>{component}{component}</components></object>");
        }
        let why = refused(&package(&model("millimeter", &resources, "<item objectid=\"41\"/>")));
        let is_empty = inner.contains("<triangles>\n</triangles>");
        let message = if is_empty { "no triangle" } else { "3D/3dmodel.model, object 41: its components repeat" };
        assert!(why.contains(message), "{why}");
    }
    // A chain of objects, each within the next, ends in a cycle or in a cube.
    let chain = |last: usize| {
        let mut resources = format!("<object id=\"1\">{}</object>", mesh_xml(&vertices, &triangles));
        for level in 2..=20_000 {
            let inner = if level == 2 { last } else { level - 1 };
            let _ = write!(
                resources,
                "<object id=\"{level}\"><components><component objectid=\"{inner}\"/></components></object>"
            );
        }
        package(&model("millimeter", &resources, "<item objectid=\"20000\"/>"))
    };
    assert_eq!(import(&chain(1)).unwrap().mesh.triangles().len(), 12);
    assert!(refused(&chain(20_000)).contains("its components lead back to it"));
    // Components that each name a model of their own, none of which is there.
    let mut resources = "<object id=\"1\"><components>".to_owned();
    for k in 0..60_000 {
        let _ = write!(resources, "<component objectid=\"1\" p:path=\"/3D/{k}.model\"/>");
    }
    resources += "</components></object>";
    let text = model("millimeter", &resources, "<item objectid=\"1\"/>");
    let production = "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" xml:lang";
    let why = refused(&package(&text.replace("xml:lang", production)));
    assert!(why.contains(".model: the package has no such file"), "{why}");
}

/// Two objects of different names side by side, doubled level by level.
fn doubled(n_levels: u32) -> Vec<u8> {
    let (vertices, triangles) = cube();
    let mesh = mesh_xml(&vertices, &triangles[..1]);
    let mut resources =
        format!("<object id=\"1\" name=\"a\">{mesh}</object><object id=\"2\" name=\"b\">{mesh}</object>");
    for level in 0..=n_levels {
        let [first, second] = if level == 0 { [1, 2] } else { [level + 2; 2] };
        let _ = write!(
            resources,
            "<object id=\"{}\"><components><component objectid=\"{first}\"/><component objectid=\"{second}\" \
             transform=\"1 0 0 0 1 0 0 0 1 {} 0 0\"/></components></object>",
            level + 3,
            10 * (1_u32 << level)
        );
    }
    package(&model("millimeter", &resources, &format!("<item objectid=\"{}\"/>", n_levels + 3)))
}

/// A group for each of many thousand placed meshes takes the time of a mesh, and there is a most.
#[test]
fn names_in_turn_make_groups_in_bounded_time() {
    let mesh = import(&doubled(14)).unwrap().mesh;
    assert_eq!(mesh.groups().len(), 2 << 14);
    let in_turn = |(k, name): (usize, &str)| name == ["a", "b"][k % 2];
    assert!(mesh.groups().iter().map(|g| g.name.as_str()).enumerate().all(in_turn));
    for n_levels in [16, 18] {
        let why = refused(&doubled(n_levels));
        assert!(why.contains("3D/3dmodel.model, object 1: with it the build has more than 65536 groups"), "{why}");
    }
}

#[test]
fn long_names_are_cut() {
    let (vertices, triangles) = cube();
    let mesh = mesh_xml(&vertices, &triangles);
    let (name, number) = ("ö".repeat(10_000), "7".repeat(10_000));
    let text = model(
        "millimeter",
        &format!("<object id=\"1\" name=\"{name}\">{mesh}</object><object id=\"2\">{mesh}</object>"),
        &format!(
            "<item objectid=\"1\"/><item objectid=\"2\" partnumber=\"{number}\" transform=\"1 0 0 0 1 0 0 0 1 9 0 0\"/>"
        ),
    );
    let mesh = import(&package(&text)).unwrap().mesh;
    let names: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["ö".repeat(200), "7".repeat(200)]);
}

/// More components than any package has, half in each of two models, in an object that is nowhere
/// placed.
#[test]
fn components_are_counted_while_they_are_read() {
    let (vertices, triangles) = cube();
    let components = "<component objectid=\"1\"/>".repeat(500_001);
    let resources = format!(
        "<object id=\"1\">{}</object><object id=\"2\"><components>{components}</components></object>",
        mesh_xml(&vertices, &triangles)
    );
    let production = "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" xml:lang";
    let main = model("millimeter", &resources, "<item objectid=\"1\" p:path=\"/3D/other.model\"/>");
    let main = main.replace("xml:lang", production);
    let mut random = Random(54);
    let picture: Vec<u8> = (0..1_000_000).map(|_| random.below(256) as u8).collect();
    let of = |other: &str| {
        package_of(&[
            ("_rels/.rels", RELATIONS.as_bytes()),
            ("a.png", &picture),
            ("3D/3dmodel.model", main.as_bytes()),
            ("3D/other.model", other.as_bytes()),
        ])
    };
    let small = format!("<object id=\"1\">{}</object>", mesh_xml(&vertices, &triangles));
    assert_eq!(import(&of(&model("millimeter", &small, ""))).unwrap().mesh.triangles().len(), 12);
    let why = refused(&of(&model("millimeter", &resources, "")));
    let message = "3D/other.model, object 2: the package has more than 1000000 objects, components and items";
    assert!(why.contains(message), "{why}");
}

#[test]
fn packages_that_unpack_to_far_more_than_their_size_are_refused() {
    let (vertices, triangles) = cube();
    let object = format!("<object id=\"1\">{}</object>", mesh_xml(&vertices, &triangles));
    let good = model("millimeter", &object, "<item objectid=\"1\"/>");
    let blanks = " ".repeat(30_000_000);
    let mut random = Random(53);
    let picture: Vec<u8> = (0..160_000).flat_map(|_| random.bits().to_le_bytes().into_iter().take(2)).collect();
    let many_attributes: String = (0..100_000).map(|k| format!("a{k}=\"b\" ")).collect();
    let cases = [
        // Blanks between tags, in a tag, and as a comment.
        (good.replace("<build>", &format!("<build>{blanks}")), "longer than"),
        (good.replace("<item ", &format!("<item {blanks}")), "longer than"),
        (good.replace("<build>", &format!("<build><!--{blanks}-->")), "longer than"),
        // Many short tags.
        (
            good.replace("</triangles>", &format!("{}</triangles>", "<a b=\"c\"/>\n".repeat(3_000_000))),
            "far more than its size",
        ),
        (good.replace("<build>", &format!("<build>{}", "<a>".repeat(1000))), "nested deeper than 64"),
        (good.replace("<item ", &format!("<item {many_attributes}")), "more than 64 attributes"),
        (good.replace("<item ", "<item a=\"b\" a=\"c\" "), "\"item\" has a twice"),
    ];
    for (text, message) in cases {
        // With a picture, the package is large enough for 20 MB of anything.
        let files = [("_rels/.rels", RELATIONS.as_bytes()), ("a.png", &picture), ("3D/3dmodel.model", text.as_bytes())];
        let bytes = if message == "longer than" { package_of(&files) } else { package(&text) };
        assert!(bytes.len() < 1_000_000);
        let why = refused(&bytes);
        assert!(why.contains("3D/3dmodel.model") && why.contains(message), "{why}");
    }
    // More files than any package has.
    let mut many = package(&good);
    many.extend(b"PK\x01\x02".repeat(70_000));
    assert!(refused(&many).contains("more than 65535 files"));
}

#[test]
fn damaged_packages_never_panic() {
    let mut random = Random(52);
    let good = changed("Title", "Title");
    for _ in 0..1500 {
        let mut bytes = good.clone();
        for _ in 0..1 + random.below(4) {
            let at = random.below(bytes.len());
            bytes[at] = random.below(256) as u8;
        }
        bytes.truncate(if random.one_in(4.0) { random.below(bytes.len()) } else { bytes.len() });
        let _ = import(&bytes);
    }
    // Unpacked text with damage, packed again.
    let (vertices, triangles) = cube();
    let text = model(
        "inch",
        &format!("<object id=\"1\">{}</object>", mesh_xml(&vertices, &triangles)),
        "<item objectid=\"1\"/>",
    );
    for _ in 0..1500 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..1 + random.below(4) {
            let at = random.below(bytes.len());
            bytes[at] = b"<>/\"= 0123456789-.ex&;!"[random.below(23)];
        }
        let _ = import(&package_of(&[("_rels/.rels", RELATIONS.as_bytes()), ("3D/3dmodel.model", &bytes)]));
    }
}
