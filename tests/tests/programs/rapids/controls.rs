//! Links of programs for Haas, Mazak and LinuxCNC controls, with what their operators write between
//! them.

use facemill::nc_program::Dialect;
use facemill::rapids::{Rapids, RapidsRequest, RetractStrategy, faster_rapids};
use facemill::{CutRequest, Job, SilentStages};
use facemill_tests::jobs::JobFolder;
use facemill_tests::variants::{box_obj, tiny_patch};

use super::two_ways;

/// [`tiny_patch`] with a block for its surface: a few facets, far below both ways.
pub(super) fn block() -> JobFolder {
    let job = tiny_patch();
    job.set("job.json", &[facemill_tests::jobs::unfinished()]);
    job.write("patch.obj", box_obj([-40.0, -40.0, -5.0], [40.0, 40.0, 0.0]).as_bytes());
    job
}

/// The program with faster links; its stock is far below both ways, so that coarse lines do.
pub(super) fn faster(job: &Job, dialect: Dialect, text: &str) -> Rapids {
    let cut = CutRequest::on_lines(4.0, 0.05);
    let program = std::path::Path::new("program.nc");
    let request = RapidsRequest { program, dialect, setup: 0, gouge_limit: None, cut, clearance: None };
    faster_rapids(job, text.as_bytes(), &request, &SilentStages).unwrap_or_else(|e| panic!("{dialect:?}: {e}"))
}

/// A control, what a program of two ways above the patch is with these lines for its link, and a
/// link far above them.
type Program = (Dialect, fn(&str) -> String, &'static str);

/// As an older post wrote it: all zeros, no spaces, lines that end as on DOS.
fn haas(across: &str) -> String {
    let text = two_ways("G21G90G94G49 (SAFE)\nG17 G40 G80", across).replace("G0 Z440.\nM30", "G00Z440.\n(DONE)\n\nM30");
    text.replace('\n', "\r\n")
}

fn mazak(across: &str) -> String {
    two_ways("G21 G90 G94 G49\n(TWO WAYS)", across).replace("M30", "N900 M30 (END)")
}

/// Small letters, comments behind a semicolon, numbers without a point, no percent signs.
fn linuxcnc(across: &str) -> String {
    format!(
        "; two ways\ng21 g90 g94 g49\nT1 M6\nG43 H1\nS6000 M3\nG0 X-30 Y0 Z440 B0 C0\n\tg0 z330 (down)\nG1 X30 F1000\n{across}\
         g1 x30 ; back\n\nG0 Z440\nM2\n"
    )
}

const PROGRAMS: [Program; 3] = [
    (Dialect::Haas, haas, "G00Z440.\nN70X-30.Y5.B2.5C-12.\nG0Z330.\n"),
    (Dialect::Mazak, mazak, "G00 Z440.000\nG00 X-30. Y+5. B2.50 C-12.\nZ330.\n"),
    (Dialect::LinuxCnc, linuxcnc, "g0 z440\nn70 x-30 y5.0 b 2.5 c-12\nz330\n"),
];

#[test]
fn links_for_haas_mazak_and_linuxcnc_become_one_block_among_the_same_bytes() {
    let folder = block();
    let job = Job::read(&folder.job()).unwrap();
    for (dialect, program, across) in PROGRAMS {
        let made = faster(&job, dialect, &program(across));
        let direct = program("G0 X-30. Y5. B2.5 C-12.\n");
        assert_eq!(String::from_utf8(made.text).unwrap(), direct, "{dialect:?}");
        let [link] = &made.file.links[..] else { panic!("{dialect:?}: {:?}", made.file.links) };
        assert!(link.way == RetractStrategy::Direct && link.time_after_s < link.time_before_s, "{dialect:?}: {link:?}");
        assert_eq!((&*made.file.dialect, made.file.findings), (dialect.name(), [0, 0]));
        let again = faster(&job, dialect, &direct);
        assert!(again.text == direct.as_bytes() && again.file.changed == 0, "{dialect:?}");
        assert_eq!(again.file.time_before_s, link.time_after_s, "{dialect:?}");
    }
}

/// Under RTCP a rapid goes by the axes on the first two controls; on LinuxCNC the kinematics keep
/// the tip on a line.
#[test]
fn links_under_rtcp_are_replaced_whatever_rapids_go_by() {
    let folder = block();
    let job = Job::read(&folder.job()).unwrap();
    let across = "G0 Z440.\nX-30. Y5. B2.5 C-12.\nZ330.\n";
    for (dialect, on) in [(Dialect::Haas, "G234 "), (Dialect::Mazak, "G43.4 ")] {
        let program = |across: &str| two_ways("G21 G90 G94 G49", across).replace("G43 ", on);
        let made = faster(&job, dialect, &program(across));
        assert_eq!(String::from_utf8(made.text).unwrap(), program("G0 X-30. Y5. B2.5 C-12.\n"), "{dialect:?}");
    }
    let with_rtcp = |text: String| {
        let on = text.replace("\tg0 z330", "M428\n\tg0 x-30 y0 z330 b0 c0");
        on.replace("M2\n", "M429\nM2\n")
    };
    let old = with_rtcp(linuxcnc(across));
    let made = faster(&job, Dialect::LinuxCnc, &old);
    let direct = with_rtcp(linuxcnc("G0 X-30. Y5. B2.5 C-12.\n"));
    assert_eq!(String::from_utf8(made.text).unwrap(), direct);
}
