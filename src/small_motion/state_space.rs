//! Small motion as a system of first order with inputs and outputs, as programs for control have it.

use nalgebra::{Complex, DMatrix, linalg::balancing::balance_parlett_reinsch};

use super::NoModes;
use super::inputs::{InputColumn, beside, inputs, slider_row};
use super::linearised::{Linearised, rotation};
use super::mode::Mode;
use super::outputs::{Outputs, Rows};
use super::point::Point;
use super::rounding::part_by;
use super::subject::Subject;

/// Small motion about a point, with deviations of the states x, inputs u and outputs y from their values there:
///
/// ```text
/// ẋ = A x + B u      y = C x + D u      x = (δq, δq̇)
///
/// A = [0, 1; −M⁻¹K, −M⁻¹D]      B = [0; M⁻¹b]
/// ```
///
/// or with a step, `x[k+1] = A x[k] + B u[k]`. A and B follow from [`Linearised`] without differences. So do the outputs of the first
/// link's angle and of the slider at rest; the rows of all others are central differences of sixth order of what the model shows, the
/// accelerations being those of the equations of motion, which is why D is not nil.
///
/// In a steady rotation states, and the axes of forces, turn along.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// A.
    pub a: DMatrix<f64>,
    /// B.
    pub b: DMatrix<f64>,
    /// C.
    pub c: DMatrix<f64>,
    /// D.
    pub d: DMatrix<f64>,
    /// Names of the states, with units.
    pub states: Vec<String>,
    /// Names of the inputs, with units.
    pub inputs: Vec<String>,
    /// Names of the outputs, with units.
    pub outputs: Vec<String>,
    /// Values of the outputs at the point.
    pub at: Vec<f64>,
    /// Sampling interval, s; `None` in continuous time.
    pub step_s: Option<f64>,
    pub(super) equations: Equations,
}

/// The equations of second order that A and B are made of.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Equations {
    pub(super) system: Linearised,
    /// Forces of the inputs, one column each.
    pub(super) force: DMatrix<f64>,
}

impl StateSpace {
    /// Computes the matrices of a subject about a point.
    ///
    /// # Errors
    /// [`NoModes`] where nothing can move, or the position is singular.
    pub fn new(subject: &Subject, point: &Point) -> Result<Self, NoModes> {
        let n = point.q.len();
        if n == 0 {
            return Err(NoModes::NothingMoves);
        }
        let mut mechanism = subject.mechanism();
        let system = Linearised::new(mechanism.as_mut(), point);
        if !system.is_finite() {
            return Err(NoModes::Singular);
        }
        let mut outputs = Outputs::new(subject, mechanism.as_mut(), point);
        let columns = inputs(subject, point, &system, &mut outputs);
        let rows = outputs.rows(mechanism.as_mut(), point);
        let rows = exact_rows(subject, point, &outputs.names, rows);
        let rows =
            if point.speed_rad_per_s == 0.0 { rows } else { rows.turning_along(&rotation(mechanism.as_mut(), point).dense()) };
        let names: Vec<String> = mechanism.coordinates().into_iter().map(|coordinate| coordinate.name).collect();
        let rates = names.iter().map(|name| format!("{name}_per_s"));
        let torque = system.torque.clone();
        let mut space = first_order(system, &rows, &columns)?;
        space.states = names.iter().cloned().chain(rates).collect();
        space.at = outputs.values(mechanism.as_mut(), point).as_slice().to_vec();
        space.outputs = outputs.names;
        if !subject.is_held() && !subject.is_oscillator() {
            space.put_tangent_first(subject, point, &torque);
        }
        let finite = [&space.a, &space.b, &space.c, &space.d].iter().all(|matrix| matrix.iter().all(|entry| entry.is_finite()));
        if finite { Ok(space) } else { Err(NoModes::Singular) }
    }

    /// Adds angle and speed of the first link's tangent at the pivot, `bᵀq` and `bᵀq̇`, before the other outputs.
    fn put_tangent_first(&mut self, subject: &Subject, point: &Point, row: &[f64]) {
        let first = subject.chain().and_then(|chain| chain.links.first()).map_or("crank", |link| link.name.as_str());
        let n = row.len();
        let along = |x: &[f64]| -> f64 { row.iter().zip(x).map(|(b, x)| b * x).sum() };
        self.c = std::mem::take(&mut self.c).insert_rows(0, 2, 0.0);
        self.d = std::mem::take(&mut self.d).insert_rows(0, 2, 0.0);
        for (k, b) in row.iter().enumerate() {
            self.c[(0, k)] = *b;
            self.c[(1, n + k)] = *b;
        }
        self.outputs.splice(0..0, [format!("{first}_angle_rad"), format!("{first}_speed_rad_per_s")]);
        self.at.splice(0..0, [along(&point.q), along(&point.v)]);
    }

    /// Eigenvalues of the map of a step. Of A as it stands, in which positions and accelerations are of very different sizes, they would
    /// lose digits, all of them in a mechanism of millimetres.
    pub fn multipliers(&self) -> Vec<Complex<f64>> {
        let mut map = self.a.clone();
        balance_parlett_reinsch(&mut map);
        map.complex_eigenvalues().iter().copied().collect()
    }

    /// The part of a mode's λ that rounding of `M⁻¹K` in A may change, by what it is of the mode's stiffness. With `φᴴ M φ = 1`,
    ///
    /// ```text
    /// ε Σᵢⱼ |Mφ|ᵢ |M⁻¹K|ᵢⱼ |φ|ⱼ
    /// ```
    ///
    /// Infinite of free motion, and meaningless with a step.
    pub fn rounding_of(&self, mode: &Mode) -> f64 {
        let part = |part: fn(&Complex<f64>) -> f64| mode.shape.iter().map(part).collect::<Vec<f64>>();
        let [re, im] = [part(|x| x.re), part(|x| x.im)].map(|x| self.equations.system.mass.times(&x));
        let momentum: Vec<f64> = re.iter().zip(im).map(|(re, im)| re.hypot(im)).collect();
        let n = momentum.len();
        let of_row = |i: usize| -> f64 { (0..n).map(|j| self.a[(n + i, j)].abs() * mode.shape[j].norm()).sum() };
        let terms: f64 = momentum.iter().enumerate().map(|(i, momentum)| momentum * of_row(i)).sum();
        part_by(&self.equations.system, mode.eigenvalue, &mode.shape, f64::EPSILON * terms)
    }

    /// Eigenvalues of A in order of magnitude.
    pub fn eigenvalues(&self) -> Vec<Complex<f64>> {
        let mut found = self.multipliers();
        found.sort_by(|one, other| one.norm().total_cmp(&other.norm()));
        found
    }
}

/// Puts the slider's exact rows in the place of differences.
fn exact_rows(subject: &Subject, point: &Point, names: &[String], mut rows: Rows) -> Rows {
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    let (Some(slider), Some(position), Some(speed)) =
        (slider_row(subject, point), place("slider_m"), place("slider_speed_m_per_s"))
    else {
        return rows;
    };
    rows.position.row_mut(position).copy_from(&slider.transpose());
    rows.velocity.row_mut(speed).copy_from(&slider.transpose());
    rows
}

impl Rows {
    /// In coordinates that turn along by V: `δq = y`, `δq̇ = ẏ + V y`, `δq̈ = ÿ + 2 V ẏ + V² y`.
    fn turning_along(self, rotation: &DMatrix<f64>) -> Self {
        let twice = &self.acceleration * rotation;
        Rows {
            position: self.position + &self.velocity * rotation + &twice * rotation,
            velocity: self.velocity + twice * 2.0,
            acceleration: self.acceleration,
        }
    }
}

/// The matrices, with the accelerations replaced by `M⁻¹ (b u − D δq̇ − K δq)`.
fn first_order(system: Linearised, rows: &Rows, inputs: &[InputColumn]) -> Result<StateSpace, NoModes> {
    let n = system.mass.rows();
    let mass = system.mass.factor().map_err(|_| NoModes::Singular)?;
    let solved = |mut matrix: DMatrix<f64>| {
        for column in matrix.as_mut_slice().chunks_exact_mut(n) {
            mass.solve(column);
        }
        matrix
    };
    let stiffness = -solved(system.stiffness.dense());
    let damping = -solved(system.damping.dense());
    let force = beside(inputs, |input| &input.force, n);
    let equations = Equations { system, force };
    let force = solved(equations.force.clone());
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    a.view_mut((0, n), (n, n)).fill_with_identity();
    a.view_mut((n, 0), (n, n)).copy_from(&stiffness);
    a.view_mut((n, n), (n, n)).copy_from(&damping);
    let mut b = DMatrix::zeros(2 * n, inputs.len());
    b.view_mut((n, 0), (n, inputs.len())).copy_from(&force);
    let count = rows.position.nrows();
    let mut c = DMatrix::zeros(count, 2 * n);
    c.view_mut((0, 0), (count, n)).copy_from(&(&rows.position + &rows.acceleration * stiffness));
    c.view_mut((0, n), (count, n)).copy_from(&(&rows.velocity + &rows.acceleration * damping));
    let d = &rows.acceleration * force + beside(inputs, |input| &input.direct, count);
    let inputs = inputs.iter().map(|input| input.name.clone()).collect();
    Ok(StateSpace { a, b, c, d, states: Vec::new(), inputs, outputs: Vec::new(), at: Vec::new(), step_s: None, equations })
}
