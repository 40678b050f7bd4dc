//! Tables of keys in `docs/formats.md` against the schemas that they are generated from.

use facemill_tests::shared::workspace;
use facemill_tests::tables::key_tables::KeyTables;

#[test]
fn tables_of_the_formats_page_are_those_of_the_schemas() {
    let docs = workspace().join("docs");
    let page = std::fs::read_to_string(docs.join("formats.md")).unwrap();
    let rewritten = KeyTables::new(&docs, &page).and_then(|tables| tables.rewritten(&page)).unwrap();
    let differs = page.lines().zip(rewritten.lines()).enumerate().find(|(_, (is, must))| is != must);
    assert!(
        page == rewritten,
        "docs/formats.md differs from docs/schemas; write its tables anew: cargo run -p facemill-tests --bin \
         formats-tables\nfirst line that differs: {differs:?}"
    );
}

#[test]
fn every_file_that_users_write_and_every_report_of_a_plan_or_verification_has_its_table() {
    let page = std::fs::read_to_string(workspace().join("docs/formats.md")).unwrap();
    let input = ["job", "tool", "holders", "machine", "path", "dialect", "batch", "propeller"];
    let output = ["report", "summary", "job-report", "certificates", "verification", "solution-space"];
    for schema in input.into_iter().chain(output) {
        assert!(page.contains(&format!("\n<!-- table {schema} -->\n")), "{schema}");
    }
}

/// A page that is not what the schemas say is found: otherwise the test above could not fail.
#[test]
fn a_changed_cell_a_missing_row_and_a_dead_link_are_found() {
    let docs = workspace().join("docs");
    let page = "## Path\n<!-- table path -->\n| `passes` |\n<!-- end of table -->\n";
    let tables = KeyTables::new(&docs, page).unwrap();
    let whole = tables.rewritten(page).unwrap();
    assert_eq!(whole, tables.rewritten(&whole).unwrap());
    let rows: Vec<&str> = whole.lines().filter(|l| l.starts_with("| `")).collect();
    // The order is the page's, and keys that it lacks come behind.
    assert!(rows[0].starts_with("| `passes[]` | list of objects, at least 1 | required | "), "{whole}");
    assert!(rows.iter().any(|r| r.starts_with("| `frame` | `work`, `mesh` | required | ")), "{whole}");
    for (from, to) in [("required", "none"), (rows[1], "| |")] {
        let wrong = whole.replacen(from, to, 1);
        assert_ne!(tables.rewritten(&wrong).unwrap(), wrong);
    }
    assert!(tables.rewritten("<!-- table path PathFil -->\n<!-- end of table -->\n").is_err());
    assert!(tables.rewritten("<!-- table path -->\n| a |\n\ntext\n").is_err());
    assert!(tables.cell("as docs/method.md#search says").unwrap().contains("[method](method.md#search)"));
    assert!(tables.cell("as docs/method.md#no-such-heading says").is_err());
    assert!(tables.cell("as [`Foo`](crate::foo) says").is_err());
}
