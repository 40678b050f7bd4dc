use super::*;
use crate::format::result_file::TaskFigures;
use crate::report::html::html;
use crate::report::table::{cells, csv, headings};

fn task_row(number: usize, axes: &[(&str, &str)], state: TaskState, machine_s: f64) -> TaskRow {
    TaskRow {
        number,
        key: format!("{number:064}"),
        job: "job.json".to_owned(),
        setup: 1,
        program: None,
        axes: axes.iter().map(|(axis, label)| ((*axis).to_owned(), (*label).to_owned())).collect(),
        state,
        exit_code: Some(i32::from(state != TaskState::Done)),
        failure: None,
        cause: (state != TaskState::Done).then(|| "<b>, \"why\"".to_owned()),
        figures: TaskFigures { machine_s: Some(machine_s), ..TaskFigures::default() },
        wall_s: None,
        peak_mib: None,
        files: vec![format!("tasks/{number}/program.nc")],
    }
}

fn report(best_of: Option<&str>) -> BatchReport {
    let rows = vec![
        task_row(1, &[("a", "1"), ("b", "x")], TaskState::Done, 30.0),
        task_row(2, &[("a", "1"), ("b", "y")], TaskState::Done, 20.0),
        task_row(3, &[("a", "2"), ("b", "x")], TaskState::Done, 25.0),
        task_row(4, &[("a", "2"), ("b", "y")], TaskState::NotMet, 5.0),
    ];
    let axes = vec!["a".to_owned(), "b".to_owned()];
    let best = best_rows(&rows, &axes, best_of, Measure::Time);
    BatchReport {
        format: BATCH_REPORT_FORMAT,
        axes,
        best_of: best_of.map(str::to_owned),
        measure: Measure::Time,
        counts: counts(&rows),
        tasks: rows,
        best,
    }
}

/// By hand from the four rows; a program that does not meet its job is never the best.
#[test]
fn groups_differ_on_the_open_axis_alone_and_the_least_of_each_is_its_best() {
    let best = |open: Option<&str>| {
        let rows = report(open).best.into_iter();
        rows.map(|b| (b.group, b.tasks, b.number, b.label, b.value, b.worst_over_best)).collect::<Vec<_>>()
    };
    let row = |group: &str, tasks, number, label: &str, value, over| {
        (group.to_owned(), tasks, number, label.to_owned(), value, over)
    };
    assert_eq!(
        best(Some("b")),
        [row("job.json, a 1", 2, 2, "y", 20.0, 1.5), row("job.json, a 2", 2, 3, "x", 25.0, 1.0)]
    );
    assert_eq!(
        best(Some("a")),
        [row("job.json, b x", 2, 3, "2", 25.0, 1.2), row("job.json, b y", 2, 2, "1", 20.0, 1.0)]
    );
    assert_eq!(best(None), [row("job.json", 4, 2, "2", 20.0, 1.5)]);
    let counts = report(None).counts;
    assert_eq!((counts.tasks, counts.done, counts.not_met), (4, 3, 1));
}

#[test]
fn tables_have_a_cell_for_each_heading_and_quote_what_needs_it() {
    let report = report(None);
    let n = headings(&report).len();
    assert!(report.tasks.iter().all(|row| cells(&report, row).len() == n));
    let text = csv(&report);
    assert_eq!(text.lines().count(), 5);
    assert!(text.starts_with("task,job,setup,a,b,state,"));
    assert!(text.contains("\"<b>, \"\"why\"\"\""), "{text}");
    let mut row = report.tasks[0].clone();
    for (cause, cell) in
        [("=1+1", "'=1+1"), ("\t=1", "'\t=1"), ("\r=1", "\"'\r=1\""), ("\n=1", "\"'\n=1\""), ("-1", "-1")]
    {
        row.cause = Some(cause.to_owned());
        let text = csv(&BatchReport { tasks: vec![row.clone()], ..report.clone() });
        assert!(text.ends_with(&format!(",{cell}\r\n")), "{text:?}");
    }
    let page = html(&report, "a & b");
    assert!(page.contains("<title>a &amp; b</title>") && page.contains("&lt;b&gt;, &quot;why&quot;"), "{page}");
    assert!(!page.contains("<script") && !page.contains("http"), "nothing from elsewhere");
    assert_eq!(page.matches("class=\"done best\"").count(), 1);
}
