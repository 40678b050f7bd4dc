//! Tests of poses.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, Weak};
use std::thread::Builder;

use facemill::cl_data::ClPoint;
use facemill::cutter_location::{Hints, Infeasible, PoseTest as Test, Workcell};
use facemill::job::setup::cell::z_map;
use facemill::{Failure, Scene, Setup};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::poses;
use crate::failure::{raised, wrong};
use crate::interrupt::awaited;
use crate::jobs::GivenJob;

/// Reason of an infeasible pose, in words; `None` of a feasible one.
type Why = Option<(i8, String)>;

/// Poses to test, whether their verdicts are still wanted, and the place for them.
type Request = (Vec<ClPoint>, Weak<()>, Sender<Vec<Why>>);

/// Test of tool poses in a job's setup. A thread of its own holds meshes and trees, which refer to
/// each other; it ends with this.
#[pyclass(frozen, module = "facemill")]
pub struct PoseTest {
    requests: Mutex<Sender<Request>>,
}

#[pymethods]
impl PoseTest {
    #[new]
    fn new(py: Python<'_>, job: GivenJob, setup: usize, operation: Option<String>) -> PyResult<Self> {
        let (requests, received) = channel::<Request>();
        let (ready, is_ready) = channel::<Result<(), Failure>>();
        let serve = move || {
            if let Err(failure) = served(&job, setup, operation.as_deref(), &ready, &received) {
                // The caller waits for it.
                let _ = ready.send(Err(failure));
            }
        };
        Builder::new().stack_size(8 << 20).spawn(serve)?;
        match awaited(py, is_ready)? {
            Some(Ok(())) => Ok(Self { requests: Mutex::new(requests) }),
            Some(Err(failure)) => Err(raised(py, &failure)),
            None => Err(wrong("the thread of the test ended")),
        }
    }

    fn codes<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'py, f64>,
        axes: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<i8>>> {
        let verdicts = self.tested(py, poses(&positions, &axes)?)?;
        let codes: Vec<i8> = verdicts.into_iter().map(|why| why.map_or(0, |(code, _)| code)).collect();
        Ok(codes.into_pyarray(py))
    }

    fn reasons<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'py, f64>,
        axes: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Vec<Option<String>>> {
        let verdicts = self.tested(py, poses(&positions, &axes)?)?;
        Ok(verdicts.into_iter().map(|why| why.map(|(_, text)| text)).collect())
    }
}

impl PoseTest {
    fn tested(&self, py: Python<'_>, poses: Vec<ClPoint>) -> PyResult<Vec<Why>> {
        let (sender, receiver) = channel();
        let wanted = Arc::new(());
        let request = (poses, Arc::downgrade(&wanted), sender);
        let ended = || wrong("the thread of the test ended");
        self.requests.lock().map_err(|_| ended())?.send(request).map_err(|_| ended())?;
        // Interrupted, it drops what the other thread looks for at each pose.
        awaited(py, receiver)?.ok_or_else(ended)
    }
}

/// Reads the setup, reports that it is ready, and answers requests until the last caller is gone.
fn served(
    job: &GivenJob,
    setup: usize,
    operation: Option<&str>,
    ready: &Sender<Result<(), Failure>>,
    requests: &Receiver<Request>,
) -> Result<(), Failure> {
    let job = job.read()?;
    let n = job.file.setups.len();
    if setup >= n {
        return Err(job.wrong(format!("setup: has {n} setups, the first of index 0, and none of index {setup}")));
    }
    if job.second.is_some() {
        return Err(job.wrong("second_tool: poses are tested for machines with one head alone"));
    }
    let job = job.for_setup(setup);
    let read = Setup::read(&job, setup)?;
    let scene = Scene::new(&job, &read, setup)?;
    let found = job.operations_of(read.file).map(|(_, o)| o).find(|o| operation.is_none_or(|name| o.name == name));
    let operation = found.ok_or_else(|| {
        let name = operation.unwrap_or_default();
        job.wrong(format!("operations: setup \"{}\" has none named \"{name}\"", read.file.name))
    })?;
    let map = z_map(&read)?;
    let cell = scene.workcell(operation, &map);
    let test = Test::new(&cell);
    // The other side waits for it.
    let _ = ready.send(Ok(()));
    while let Ok((poses, wanted, answer)) = requests.recv() {
        let mut hints = Hints::default();
        let verdicts = poses.iter().take_while(|_| wanted.strong_count() > 0).map(|pose| {
            let why = blocked(&test, &cell, pose, &mut hints)?;
            Some((code(&why), test.describe(&why)))
        });
        // The caller may be gone.
        let _ = answer.send(verdicts.collect());
    }
    Ok(())
}

/// Returns the reason why a pose is infeasible in every configuration of the machine: the first
/// one, in the order cone, limits, cutter, other bodies.
fn blocked(test: &Test<'_>, cell: &Workcell<'_>, pose: &ClPoint, hints: &mut Hints) -> Option<Infeasible> {
    if let Err(why) = test.within_cone(pose) {
        return Some(why);
    }
    let on_table = pose.transformed(&cell.table_from_work);
    let solutions = match cell.machine.inverse(&on_table, cell.tool.gauge_length()) {
        Ok(solutions) => solutions,
        Err(why) => return Some(Infeasible::Unreachable(why)),
    };
    if let Some((obstacle, place)) = test.gouge(pose, hints) {
        return Some(Infeasible::Gouge { obstacle, place });
    }
    let mut first = None;
    for solution in solutions.iter() {
        let why = test.collision(&solution.values, hints)?;
        first = first.or(Some(why));
    }
    first
}

/// Returns the number of a reason in Python's `Verdict`.
fn code(why: &Infeasible) -> i8 {
    match why {
        Infeasible::Gouge { .. } => 1,
        Infeasible::Collision { .. } => 2,
        Infeasible::Unreachable(_) => 3,
        Infeasible::OutsideCone { .. } => 4,
        _ => 5,
    }
}
