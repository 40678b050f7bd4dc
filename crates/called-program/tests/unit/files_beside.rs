//! Files beside a program that calls may mean.

use super::*;

fn beside(names: &[&str]) -> FilesBeside {
    let mut files = FilesBeside::default();
    for name in names {
        files.0.entry(name.to_ascii_lowercase()).or_default().push((*name).to_owned());
    }
    files
}

#[test]
fn the_case_that_is_called_comes_first() {
    let names = ["pass_1.ngc".to_owned()];
    let both = beside(&["PASS_1.NGC", "pass_1.ngc"]);
    assert_eq!(both.named(&names, true), Some("pass_1.ngc"));
    assert_eq!(both.named(&names, false), Some("pass_1.ngc"));
    // LinuxCNC opens the name as it is.
    let other = beside(&["PASS_1.NGC"]);
    assert_eq!(other.named(&names, true), None);
    assert_eq!(other.named(&names, false), Some("PASS_1.NGC"));
    // Two files that a control without cases cannot tell apart.
    assert_eq!(beside(&["PASS_1.NGC", "Pass_1.ngc"]).named(&names, false), None);
    // The first name of the control has precedence, whatever its case.
    let names = ["SLOT.spf".to_owned(), "SLOT.mpf".to_owned()];
    assert_eq!(beside(&["SLOT.mpf", "slot.SPF"]).named(&names, false), Some("slot.SPF"));
}

#[cfg(unix)]
#[test]
fn links_and_folders_are_no_files_beside() {
    let folder = std::env::temp_dir().join(format!("facemill-called-files-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("O0003.nc")).expect("a folder");
    std::fs::write(folder.join("O0002.nc"), "M99\n").expect("a file");
    let link = folder.join("O0004.nc");
    std::fs::remove_file(&link).ok();
    std::os::unix::fs::symlink("/etc/hostname", &link).expect("a link");
    let files = FilesBeside::of(&folder);
    std::fs::remove_dir_all(&folder).expect("removed");
    let named = |name: &str| files.named(&[name.to_owned()], false).map(str::to_owned);
    assert_eq!([named("O0002.nc"), named("O0003.nc"), named("O0004.nc")], [Some("O0002.nc".to_owned()), None, None]);
}
