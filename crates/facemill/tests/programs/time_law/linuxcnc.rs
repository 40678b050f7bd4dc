//! Runs programs on the simulator of LinuxCNC, without a display and without hardware.

use std::fmt::Write as _;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Returns why the simulator cannot be run here; `None` if it can.
pub(crate) fn missing() -> Option<&'static str> {
    let is_there = |path: &str| Path::new(path).exists();
    let runs =
        |program: &str| Command::new("pidof").arg(program).stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    if !["/usr/bin/halcmd", "/usr/bin/milltask", REALTIME].iter().all(|path| is_there(path)) {
        return Some("LinuxCNC is not installed");
    }
    let python = Command::new(PYTHON).args(["-c", "import linuxcnc"]).stderr(Stdio::null()).status();
    if !python.is_ok_and(|status| status.success()) {
        return Some("LinuxCNC has no module for Python here");
    }
    // It may be moving a machine.
    ["rtapi_app", "milltask", SERVER].into_iter().any(runs).then_some("LinuxCNC is running already")
}

const SERVER: &str = "linuxcncsvr";
const REALTIME: &str = "/usr/lib/linuxcnc/realtime";
const PYTHON: &str = "/usr/bin/python3";

/// Velocity and acceleration of X, Y, Z, B and C: mm, deg, s.
pub(crate) type Limits = [[f64; 2]; 5];

/// Words before an error of the interpreter in what the driver prints.
const REFUSED: &str = "the control says";

/// Times for which the axes move in each program, s; each starts where all axes are at 0.
///
/// # Errors
///
/// Why the simulator did not run at all, three times.
///
/// # Panics
///
/// If it refuses a program.
pub(crate) fn times(programs: &[String], limits: &Limits) -> Result<Vec<f64>, String> {
    let once = || times_of_one_start(programs, limits);
    once().or_else(|_| once()).or_else(|_| once())
}

fn times_of_one_start(programs: &[String], limits: &Limits) -> Result<Vec<f64>, String> {
    let folder = tempfile::tempdir().unwrap();
    // The other user makes its socket in there.
    std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(0o777)).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("sim.ini", &configuration(limits));
    write("sim.hal", &signals());
    write("sim.tbl", "");
    write("drive.py", DRIVE);
    write("zero.ngc", "G21 G90 G94\nG64 P0.5\nG0 X0 Y0 Z0 B0 C0\nM2\n");
    for (k, program) in programs.iter().enumerate() {
        write(&format!("{k}.ngc"), program);
    }
    let simulator = Simulator::start(folder.path());
    let mut drive = simulator.command(PYTHON, &["drive.py", &programs.len().to_string()]);
    let out = drive.stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap();
    drop(simulator);
    let printed = String::from_utf8_lossy(&out.stdout).into_owned();
    let times: Vec<f64> = printed.lines().filter_map(|line| line.strip_prefix("time ")?.parse().ok()).collect();
    let errors = String::from_utf8_lossy(&out.stderr);
    assert!(!errors.contains(REFUSED), "{errors}");
    if times.len() < programs.len() {
        return Err(format!("{printed}{}", errors.trim()));
    }
    Ok(times)
}

/// The processes of a simulator, ended when it is dropped.
struct Simulator<'a> {
    folder: &'a Path,
    task: Child,
}

impl<'a> Simulator<'a> {
    fn start(folder: &'a Path) -> Self {
        let run = |program: &str, arguments: &[&str]| command(folder, program, arguments).status().unwrap();
        // Goes into the background by itself.
        run(SERVER, &["-ini", "sim.ini"]);
        run(REALTIME, &["start"]);
        run("halcmd", &["loadusr", "-Wn", "iocontrol", "io", "-ini", "sim.ini"]);
        for module in ["tpmod", "homemod"] {
            run("halcmd", &["loadrt", module]);
        }
        run("halcmd", &["-i", "sim.ini", "-f", "sim.hal"]);
        run("halcmd", &["start"]);
        let task = command(folder, "milltask", &["-ini", "sim.ini"]).spawn().unwrap();
        Self { folder, task }
    }

    fn command(&self, program: &str, arguments: &[&str]) -> Command {
        command(self.folder, program, arguments)
    }
}

impl Drop for Simulator<'_> {
    fn drop(&mut self) {
        end(&mut self.task);
        for arguments in [["stop", ""], ["unload", "all"]] {
            let arguments: Vec<&str> = arguments.into_iter().filter(|a| !a.is_empty()).collect();
            let _ = self.command("halcmd", &arguments).status();
        }
        let _ = self.command(REALTIME, &["stop"]).status();
        // None ran before.
        let servers = Command::new("pidof").arg(SERVER).output().unwrap();
        for id in String::from_utf8_lossy(&servers.stdout).split_whitespace() {
            let _ = Command::new("kill").arg(id).status();
        }
    }
}

/// Asks a process to end, and waits for it.
fn end(child: &mut Child) {
    let _ = Command::new("kill").arg(child.id().to_string()).status();
    let start = Instant::now();
    while matches!(child.try_wait(), Ok(None)) {
        if start.elapsed() > Duration::from_secs(5) {
            let _ = child.kill();
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn command(folder: &Path, program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.env("INI_FILE_NAME", folder.join("sim.ini")).env("HAL_RTMOD_DIR", "/usr/lib/linuxcnc/modules");
    // It refuses to run as root without another user to fall back to.
    command.env("RTAPI_UID", "65534").env("RTAPI_FIFO_PATH", folder.join("fifo"));
    command
}

fn configuration(limits: &Limits) -> String {
    let mut ini = CONFIGURATION.to_owned();
    for (k, ([velocity, acceleration], letter)) in limits.iter().zip("XYZBC".chars()).enumerate() {
        let kind = if letter < 'D' { "ANGULAR" } else { "LINEAR" };
        let range = "MIN_LIMIT = -100000\nMAX_LIMIT = 100000\n";
        let _ = write!(
            ini,
            "[AXIS_{letter}]\nMAX_VELOCITY = {velocity}\nMAX_ACCELERATION = {acceleration}\n{range}\
             [JOINT_{k}]\nTYPE = {kind}\nMAX_VELOCITY = {}\nMAX_ACCELERATION = {}\n{range}FERROR = 100\nMIN_FERROR = 100\n\
             HOME_SEQUENCE = 0\n",
            2.0 * velocity,
            4.0 * acceleration
        );
    }
    ini
}

/// Joints that are where they are sent, and a clock that runs while anything moves.
fn signals() -> String {
    let mut hal = SIGNALS.to_owned();
    for k in 0..5 {
        let _ = writeln!(hal, "net at{k} joint.{k}.motor-pos-cmd => joint.{k}.motor-pos-fb");
    }
    hal
}

const CONFIGURATION: &str = "\
[EMC]
VERSION = 1.1
[DISPLAY]
DISPLAY = none
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = sim.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = 1000000
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.1
TOOL_TABLE = sim.tbl
[TRAJ]
COORDINATES = XYZBC
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
NO_FORCE_HOMING = 1
MAX_LINEAR_VELOCITY = 1000
MAX_LINEAR_ACCELERATION = 100000
[KINS]
KINEMATICS = trivkins coordinates=XYZBC
JOINTS = 5
";

const SIGNALS: &str = "\
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt integ count=1
loadrt comp count=1
loadrt conv_bit_float count=1
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf comp.0 servo-thread
addf conv-bit-float.0 servo-thread
addf integ.0 servo-thread
setp comp.0.in0 0.000001
net speed motion.current-vel => comp.0.in1
net moves comp.0.out => conv-bit-float.0.in
net one conv-bit-float.0.out => integ.0.in
net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net prepared iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net changed iocontrol.0.tool-change => iocontrol.0.tool-changed
";

/// Runs each program from 0 and prints its time. A machine with other work to do may take seconds
/// to hear a command, so nothing counts as done by the clock on the wall: a program has run where
/// the axes have moved and stopped. They are held by an override of 0 until the queue of blocks is
/// as long as it gets, or the planner would wait for blocks.
const DRIVE: &str = "\
import linuxcnc, os, subprocess, sys, time

PATIENCE = 60

def clock():
    return float(subprocess.check_output(['halcmd', 'getp', 'integ.0.out']))

def fail(why):
    report = errors.poll() if errors else None
    sys.exit(f'{why}; the control says {report[1]}' if report else why)

def repeat(send, done, why):
    deadline = time.time() + PATIENCE
    while time.time() < deadline:
        send()
        again = time.time() + 2
        while time.time() < again:
            status.poll()
            if done():
                return
            time.sleep(0.02)
    fail(why)

def at_rest():
    idle = status.interp_state == linuxcnc.INTERP_IDLE and status.exec_state == linuxcnc.EXEC_DONE
    return idle and status.queue == 0 and status.inpos

def at_zero():
    return max(abs(status.position[k]) for k in (0, 1, 2, 4, 5)) < 1e-6

def override(factor):
    repeat(lambda: command.feedrate(factor), lambda: status.feedrate == factor, f'no override of {factor}')

def run(name, has_moved):
    repeat(lambda: command.mode(linuxcnc.MODE_AUTO), lambda: status.task_mode == linuxcnc.MODE_AUTO, 'no mode for programs')
    path = os.path.abspath(name)
    repeat(lambda: command.program_open(path), lambda: status.file == path, f'{name} is not opened')
    begun = lambda: has_moved() or status.interp_state != linuxcnc.INTERP_IDLE
    override(0)
    repeat(lambda: begun() or command.auto(linuxcnc.AUTO_RUN, 1), begun, f'{name} does not start')
    queue, since = 0, time.time()
    while time.time() < since + 1:
        status.poll()
        if status.queue != queue:
            queue, since = status.queue, time.time()
        time.sleep(0.02)
    override(1)
    moved, deadline = clock(), time.time() + PATIENCE
    while not (has_moved() and at_rest()):
        if clock() > moved:
            moved, deadline = clock(), time.time() + PATIENCE
        if time.time() > deadline:
            fail(f'{name} does not go on')
        time.sleep(0.02)
        status.poll()

errors, deadline = None, time.time() + PATIENCE
while True:
    try:
        command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
        status.poll()
        break
    except linuxcnc.error as error:
        if time.time() > deadline:
            fail(f'no connection: {error}')
        time.sleep(0.1)
for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
    repeat(lambda: command.state(state), lambda: status.task_state == state, f'state {state} is not reached')
for k in range(int(sys.argv[1])):
    status.poll()
    if not at_zero():
        run('zero.ngc', at_zero)
    start = clock()
    run(f'{k}.ngc', lambda: clock() > start)
    print('time', clock() - start, flush=True)
";
