//! The law for every scheme: on a mass with spring and damper, `|R(z)| ≤ 1` wherever the mass itself does not grow, `Re z ≤ 0`.

use nalgebra::Complex;

use super::schemes::{Oscillator, Scheme};
use crate::integrate::{RungeKutta, StepError};
use crate::study::Table;

/// An eigenvalue times the step, in the upper left quarter of the complex plane; the oscillator has it with its conjugate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// |z|.
    pub magnitude: f64,
    /// From the positive real axis: 90 is the imaginary axis, an oscillator without damping; 180 the negative real one, where a second
    /// eigenvalue lies half method to the origin, as one that is there twice is not to be computed well.
    pub angle_deg: f64,
}

/// Rounding: a radius is above 1 when it is so by more.
pub const ROUNDING: f64 = 1e-11;

impl Point {
    /// |z| from 1e-3 to 1e6, so many a decade, and angles from 90° to 180°, so many degrees apart; ends included.
    pub fn grid(per_decade: u32, degrees: u32) -> Vec<Point> {
        let magnitudes = (0..=9 * per_decade).map(|n| 10.0_f64.powf(f64::from(n) / f64::from(per_decade) - 3.0));
        let angles = || (90..=180).step_by(degrees.max(1) as usize).map(f64::from);
        magnitudes.flat_map(|magnitude| angles().map(move |angle_deg| Point { magnitude, angle_deg })).collect()
    }

    /// The same |z|, on the imaginary and the negative real axis only: a pole makes a step grow only within a part in a hundred of it.
    pub fn axes(per_decade: u32) -> Vec<Point> {
        Self::grid(per_decade, 90)
    }

    fn eigenvalues(self) -> [Complex<f64>; 2] {
        let r = self.magnitude;
        if self.angle_deg == 180.0 {
            return [Complex::new(-r, 0.0), Complex::new(-0.5 * r, 0.0)];
        }
        // The cosine of 90° is not 0 in floating point.
        let angle = self.angle_deg.to_radians();
        let re = if self.angle_deg == 90.0 { 0.0 } else { r * angle.cos() };
        [Complex::new(re, r * angle.sin()), Complex::new(re, -r * angle.sin())]
    }

    /// `k = z₁ z₂`, `d = −(z₁ + z₂)`.
    fn oscillator(self) -> Oscillator {
        let [one, other] = self.eigenvalues();
        Oscillator { stiffness: (one * other).re, damper: -(one + other).re, fastest: self.magnitude }
    }
}

impl Scheme {
    /// Whether theory has it stable at every step; Runge–Kutta is up to a limit, see [`Scheme::is_within`].
    pub fn is_stable_everywhere(self) -> bool {
        match self {
            Scheme::TwoPoint(weight) => weight >= 0.5,
            Scheme::GeneralizedAlpha(_) | Scheme::Esdirk => true,
            Scheme::RungeKutta => false,
        }
    }

    /// Whether a point is where the scheme is said to be stable: anywhere, within the limit of Runge–Kutta, or nowhere.
    pub fn is_within(self, point: Point) -> bool {
        match self {
            Scheme::RungeKutta => point.magnitude <= RungeKutta::stable_to(point.angle_deg.to_radians()),
            _ => self.is_stable_everywhere(),
        }
    }

    /// Spectral radius at a point: in theory, and of the running integrator.
    ///
    /// # Errors
    /// [`StepError`] when a step cannot be taken.
    pub fn radii_at(self, point: Point) -> Result<[f64; 2], StepError> {
        let oscillator = point.oscillator();
        Ok([self.radius_of(oscillator, &point.eigenvalues()), self.radius_run_on(oscillator)?])
    }
}

/// One row for every scheme and every point: the parameter (where it has one), the point, theory, as run, and their difference.
///
/// # Errors
/// [`StepError`] when a step cannot be taken.
pub fn left_half_plane_table(schemes: &[Scheme], points: &[Point]) -> Result<Table, StepError> {
    let pairs: Vec<(Scheme, Point)> = schemes.iter().flat_map(|&scheme| points.iter().map(move |&at| (scheme, at))).collect();
    let radii = pairs.iter().map(|(scheme, at)| scheme.radii_at(*at)).collect::<Result<Vec<_>, _>>()?;
    let mut table = Table::default();
    if schemes.iter().any(|scheme| scheme.parameter().is_some()) {
        table.push("parameter", pairs.iter().map(|(scheme, _)| scheme.parameter().unwrap_or(f64::NAN)).collect());
    }
    table.push("magnitude", pairs.iter().map(|(_, at)| at.magnitude).collect());
    table.push("angle_deg", pairs.iter().map(|(_, at)| at.angle_deg).collect());
    table.push("difference", radii.iter().map(|[theory, run]| run - theory).collect());
    table.push("radius_in_theory", radii.iter().map(|[theory, _]| *theory).collect());
    table.push("radius_as_run", radii.iter().map(|[_, run]| *run).collect());
    Ok(table)
}
