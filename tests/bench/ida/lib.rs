//! The equations of a scene as residual, Jacobian and preconditioner for SUNDIALS IDA, and the same scene solved by flexcrank.
//!
//! y holds the coordinates q and the velocities v of a model. F(t, y, y') = (q' − v, M(q) v' + g(q, v) − p(t)) = 0. The models of
//! flexcrank compute everything, so both programs solve the same equations with the same code and compiler options.

#![allow(clippy::missing_safety_doc, reason = "only tests/bench/ida.py calls it, with the pointers that it got from here")]

use std::f64::consts::TAU;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::slice::{from_raw_parts, from_raw_parts_mut};

use flexcrank::mechanics::{FiniteElement, Input, Mechanism, Modal, Observation, Weights};
use flexcrank::scene::{Drive, ModelKind, Pulse, PulseShape, Scene, SceneSource};
use flexcrank::simulation::Simulation;
use rustix::time::{ClockId, clock_gettime};

/// An N_Vector or SUNMatrix of SUNDIALS.
type Handle = *mut c_void;
/// A function of SUNDIALS that returns the numbers of one.
type Data = unsafe extern "C" fn(Handle) -> *mut f64;

/// Difference of a coordinate for derivatives of the residual.
const SMALL: f64 = 1e-7;

/// The equations of a scene.
pub struct Equations {
    pulses: Vec<Pulse>,
    mechanism: Box<dyn Mechanism>,
    n: usize,
    vector: Data,
    matrix: Data,
    observation: Observation,
    /// Processor time spent on Jacobians, s.
    jacobians_s: f64,
    /// Load at the state for which the preconditioner was set up.
    prepared: Input,
    /// A state and two residuals.
    room: [Vec<f64>; 5],
}

impl Equations {
    fn new(scene: &Scene, [vector, matrix]: [Data; 2]) -> Option<Self> {
        let (chain, Drive::Torque { pulses, .. }) = (scene.chain()?, &scene.drive) else { return None };
        let mechanism: Box<dyn Mechanism> = match scene.solver.model {
            ModelKind::Modal => Box::new(Modal::new(chain, false)),
            ModelKind::FiniteElement => Box::new(FiniteElement::new(chain, false)),
            _ => return None,
        };
        let n = mechanism.degrees_of_freedom();
        let observation = Simulation::new(scene).ok()?.start().clone();
        let room = [(); 5].map(|()| vec![0.0; n]);
        Some(Equations {
            pulses: pulses.clone(),
            mechanism,
            n,
            vector,
            matrix,
            observation,
            jacobians_s: 0.0,
            prepared: Input::default(),
            room,
        })
    }

    fn input(&self, t_s: f64) -> Input {
        let torque_nm = self.pulses.iter().map(|pulse| {
            let part = (t_s - pulse.start_s) / pulse.duration_s;
            match pulse.shape {
                _ if !(0.0..1.0).contains(&part) => 0.0,
                PulseShape::Rectangular => pulse.torque_nm,
                PulseShape::RaisedCosine => pulse.torque_nm * (1.0 - (TAU * part).cos()),
            }
        });
        Input { time_s: t_s, torque_nm: torque_nm.sum(), motion: None }
    }

    /// The start, and accelerations that satisfy the equations there.
    fn start(&mut self, y: &mut [f64], yp: &mut [f64]) -> Option<()> {
        let (input, n) = (self.input(0.0), self.n);
        let ((q, v), a) = (y.split_at_mut(n), vec![0.0; n]);
        self.mechanism.start(&input, q, v).ok()?;
        let mut r = vec![0.0; n];
        self.mechanism.residual(&input, q, v, &a, &mut r);
        self.mechanism.factor(&input, q, v, &a, Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 }).ok()?;
        self.mechanism.solve(&mut r);
        yp[..n].copy_from_slice(v);
        r.iter().zip(&mut yp[n..]).for_each(|(r, a)| *a = -r);
        Some(())
    }

    fn residual(&mut self, t_s: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let (input, n) = (self.input(t_s), self.n);
        for i in 0..n {
            out[i] = yp[i] - y[n + i];
        }
        self.mechanism.residual(&input, &y[..n], &y[n..], &yp[n..], &mut out[n..]);
    }

    /// ∂F/∂y + c ∂F/∂y', by columns. The lower half is the difference of two residuals.
    fn jacobian(&mut self, t_s: f64, y: &[f64], yp: &[f64], c: f64, out: &mut [f64]) {
        let (input, n) = (self.input(t_s), self.n);
        let [q, v, a, above, below] = &mut self.room;
        out.fill(0.0);
        for j in 0..n {
            (out[j * 2 * n + j], out[(n + j) * 2 * n + j]) = (c, -1.0);
        }
        for j in 0..2 * n {
            for (r, by) in [(&mut *above, SMALL), (&mut *below, -SMALL)] {
                q.copy_from_slice(&y[..n]);
                v.copy_from_slice(&y[n..]);
                a.copy_from_slice(&yp[n..]);
                if j < n {
                    q[j] += by;
                } else {
                    v[j - n] += by;
                    a[j - n] += c * by;
                }
                self.mechanism.residual(&input, q, v, a, r);
            }
            for i in 0..n {
                out[j * 2 * n + n + i] = (above[i] - below[i]) / (2.0 * SMALL);
            }
        }
    }

    /// Factors c M + C + K/c, from which the whole system is solved, and keeps the state.
    fn set_up(&mut self, t_s: f64, y: &[f64], yp: &[f64], c: f64) -> Option<()> {
        let (input, n) = (self.input(t_s), self.n);
        let [q, v, a, r, _] = &mut self.room;
        q.copy_from_slice(&y[..n]);
        v.copy_from_slice(&y[n..]);
        a.copy_from_slice(&yp[n..]);
        self.mechanism.residual(&input, q, v, a, r);
        self.prepared = input;
        self.mechanism.factor(&input, q, v, a, Weights { acceleration: c, velocity: 1.0, position: 1.0 / c }).ok()
    }

    /// Solves for z: S z_v = r_v − K r_q / c and c z_q = r_q + z_v. The product with K is a difference of two residuals.
    fn precondition(&mut self, r: &[f64], c: f64, z: &mut [f64]) {
        let n = self.n;
        let [q, v, a, before, moved] = &mut self.room;
        z[n..].copy_from_slice(&r[n..]);
        let largest = r[..n].iter().fold(0.0_f64, |largest, r| largest.max(r.abs()));
        if largest > 0.0 {
            let by = SMALL / largest;
            q.iter_mut().zip(r).for_each(|(q, r)| *q += by * r);
            self.mechanism.residual(&self.prepared, q, v, a, moved);
            q.iter_mut().zip(r).for_each(|(q, r)| *q -= by * r);
            for i in 0..n {
                z[n + i] -= (moved[i] - before[i]) / (by * c);
            }
        }
        self.mechanism.solve(&mut z[n..]);
        for i in 0..n {
            z[i] = (r[i] + z[n + i]) / c;
        }
    }

    /// Angle of the first link's chord, rad.
    fn angle(&mut self, t_s: f64, y: &[f64], yp: &[f64]) -> f64 {
        let (input, n) = (self.input(t_s), self.n);
        self.mechanism.observe(&input, &y[..n], &y[n..], &yp[n..], &mut self.observation);
        self.observation.links[0].chord_rad
    }
}

/// A scene with overrides, separated by spaces.
unsafe fn scene(words: *const c_char) -> Option<Scene> {
    let words = unsafe { CStr::from_ptr(words) }.to_str().ok()?;
    let (name, overrides) = words.split_once(' ').unwrap_or((words, ""));
    let overrides: Vec<String> = overrides.split_whitespace().map(str::to_owned).collect();
    Some(SceneSource::open(name, &overrides).ok()?.scene)
}

fn boxed<T>(made: Option<T>) -> *mut T {
    made.map_or(std::ptr::null_mut(), |made| Box::into_raw(Box::new(made)))
}

/// The equations of a scene; null if there are none. The functions are N_VGetArrayPointer and SUNDenseMatrix_Data.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn equations_open(words: *const c_char, vector: Data, matrix: Data) -> *mut Equations {
    boxed(unsafe { scene(words) }.and_then(|scene| Equations::new(&scene, [vector, matrix])))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn equations_count(equations: *const Equations) -> usize {
    unsafe { &*equations }.n
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn equations_start(equations: *mut Equations, y: *mut f64, yp: *mut f64) -> c_int {
    let equations = unsafe { &mut *equations };
    let n = 2 * equations.n;
    let started = unsafe { equations.start(from_raw_parts_mut(y, n), from_raw_parts_mut(yp, n)) };
    c_int::from(started.is_none())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn equations_angle(equations: *mut Equations, t_s: f64, y: *const f64, yp: *const f64) -> f64 {
    let equations = unsafe { &mut *equations };
    let n = 2 * equations.n;
    unsafe { equations.angle(t_s, from_raw_parts(y, n), from_raw_parts(yp, n)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn equations_jacobians_s(equations: *const Equations) -> f64 {
    unsafe { &*equations }.jacobians_s
}

/// Processor time of this thread, s.
fn thread_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// IDAResFn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ida_residual(t_s: f64, y: Handle, yp: Handle, r: Handle, user: *mut Equations) -> c_int {
    let equations = unsafe { &mut *user };
    let (n, data) = (2 * equations.n, equations.vector);
    unsafe { equations.residual(t_s, from_raw_parts(data(y), n), from_raw_parts(data(yp), n), from_raw_parts_mut(data(r), n)) };
    0
}

/// IDALsJacFn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ida_jacobian(
    t_s: f64,
    c: f64,
    y: Handle,
    yp: Handle,
    _r: Handle,
    matrix: Handle,
    user: *mut Equations,
    _: Handle,
    _: Handle,
    _: Handle,
) -> c_int {
    let equations = unsafe { &mut *user };
    let (n, data) = (2 * equations.n, equations.vector);
    let columns = unsafe { from_raw_parts_mut((equations.matrix)(matrix), n * n) };
    let begun_s = thread_s();
    unsafe { equations.jacobian(t_s, from_raw_parts(data(y), n), from_raw_parts(data(yp), n), c, columns) };
    equations.jacobians_s += thread_s() - begun_s;
    0
}

/// IDALsPrecSetupFn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ida_set_up(t_s: f64, y: Handle, yp: Handle, _r: Handle, c: f64, user: *mut Equations) -> c_int {
    let equations = unsafe { &mut *user };
    let (n, data) = (2 * equations.n, equations.vector);
    let done = unsafe { equations.set_up(t_s, from_raw_parts(data(y), n), from_raw_parts(data(yp), n), c) };
    c_int::from(done.is_none())
}

/// IDALsPrecSolveFn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ida_precondition(
    _t_s: f64,
    _y: Handle,
    _yp: Handle,
    _rr: Handle,
    r: Handle,
    z: Handle,
    c: f64,
    _delta: f64,
    user: *mut Equations,
) -> c_int {
    let equations = unsafe { &mut *user };
    let (n, data) = (2 * equations.n, equations.vector);
    unsafe { equations.precondition(from_raw_parts(data(r), n), c, from_raw_parts_mut(data(z), n)) };
    0
}

/// A simulation of a scene; null if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_open(words: *const c_char) -> *mut Simulation {
    boxed(unsafe { scene(words) }.and_then(|scene| Simulation::new(&scene).ok()))
}

/// Takes `steps` steps between one angle and the next; returns whether all were taken.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_run(simulation: *mut Simulation, steps: usize, angles: *mut f64, count: usize) -> c_int {
    let simulation = unsafe { &mut *simulation };
    for angle in unsafe { from_raw_parts_mut(angles, count) } {
        if (0..steps).any(|_| simulation.step().is_err()) {
            return 1;
        }
        let Ok(observation) = simulation.observe() else { return 1 };
        *angle = observation.links[0].chord_rad;
    }
    0
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn equations_close(equations: *mut Equations) {
    drop(unsafe { Box::from_raw(equations) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_close(simulation: *mut Simulation) {
    drop(unsafe { Box::from_raw(simulation) });
}
