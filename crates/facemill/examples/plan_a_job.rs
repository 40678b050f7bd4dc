//! A whole job planned without a file on disk: values in, program and report out.
//!
//! `cargo run -p facemill --example plan_a_job`

use std::error::Error;

use facemill::cl_data::CcPoint;
use facemill::file_format::from_json;
use facemill::inverse_kinematics::machine_file::MachineFile;
use facemill::job_file::{FixedPostureFile, JobFile, PostureModeFile};
use facemill::nc_program::Dialect;
use facemill::new_job::{NewJob, new_job};
use facemill::{CutRequest, Job, JobFiles, PlanSettings, Scene, Setup, SilentStages, UseScene, plan_setup};
use nalgebra::{Point3, Vector3};

fn main() -> Result<(), Box<dyn Error>> {
    // 1. Values of a job: here those of an example, a wavy patch of 60 mm; job.json is the job, the
    //    others are the files that it names.
    let mut files = JobFiles::default();
    let (mut job, mut machine) = (None, None);
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 60.0 })? {
        match name.as_str() {
            "job.json" => job = Some(from_json::<JobFile>(&bytes)?),
            "machine.json" => machine = Some(from_json::<MachineFile>(&bytes)?),
            _ => files = files.with(&name, bytes),
        }
    }
    let (mut job, mut machine) = job.zip(machine).ok_or("an example has a job and a machine")?;

    // 2. Changed as a program likes: slower rapids, another control, coarser passes, one posture
    //    for all points (by default postures are searched, which takes longer).
    machine.feed.rapid_mm_min = machine.feed.rapid_mm_min.map(|rapid| 0.5 * rapid);
    files = files.with_machine("machine.json", &machine);
    job.post.dialect = Dialect::Heidenhain;
    let operation = &mut job.operations[0];
    operation.search.mode = PostureModeFile::Fixed(FixedPostureFile { lead_deg: 8.0, lean_deg: 0.0 });
    let tolerances = &mut operation.tolerances;
    (tolerances.cusp_mm, tolerances.max_step_over_mm, tolerances.max_step_mm) = (0.2, 6.0, 2.0);

    // 3. Checked as a job that is read, planned, and its text verified on the virtual machine.
    let job = Job::of_values(&job, files)?;
    let planned = plan_setup(&job, 0, PlanSettings { verify: true, certificates: false }, &SilentStages)?;
    println!("{}", facemill::summary(&planned.report));
    for (name, bytes) in &planned.files {
        println!("  {name}: {} bytes", bytes.len());
    }
    assert!(planned.is_clean(), "{:?}", planned.report.findings);
    let (_, program) = planned.files.iter().find(|(name, _)| name.ends_with(".h")).ok_or("no program")?;
    assert!(program.starts_with(b"BEGIN PGM") || program.starts_with(b"0 BEGIN PGM"));

    // 4. The same setup as a scene: its program runs on the virtual machine again and cuts the
    //    stock, and a posture is searched at one point, 5 mm above the middle of the patch.
    let setup = Setup::read(&job, 0)?;
    let scene = Scene::new(&job, &setup, 0)?;
    let cut = scene.cut(program, Dialect::Heidenhain, CutRequest::on_lines(1.0, 0.05), &SilentStages)?;
    let stock = cut.file.stock.as_ref().ok_or("the stock is cut")?;
    println!("{} findings, {:.0} mm³ removed", cut.file.verification.findings.len(), stock.removed_mm3);
    let above = CcPoint { position: Point3::new(0.0, 0.0, 5.0), normal: Vector3::z_axis(), feed: Vector3::x_axis() };
    let name = &job.file.operations[0].name;
    match &scene.search(name, &[above], true)?[..] {
        [Ok(found)] => println!("{:?}", found.pose.posture),
        other => return Err(format!("a point in the air has a posture: {other:?}").into()),
    }

    // 5. Bad values get the error that a file would: the field, and what is wrong with it.
    let mut wrong = job.file.clone();
    wrong.operations[0].tolerances.gouge_mm = -1.0;
    let why = Job::of_values(&wrong, job.files.clone()).err().ok_or("a negative tolerance is refused")?;
    println!("{why}");
    assert!(why.to_string().contains("gouge_mm"));
    Ok(())
}
