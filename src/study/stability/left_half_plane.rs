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
    /// Angle from the positive real axis: 90 is the imaginary axis, an oscillator without damping; 180 the negative real one,
    /// where a second eigenvalue lies half way to the origin, because a double eigenvalue cannot be computed well.
    pub angle_deg: f64,
}

/// Rounding: a radius counts as above 1 if it exceeds 1 by more than this.
pub const ROUNDING: f64 = 1e-11;

impl Point {
    /// |z| from 1e-3 to 1e6 at `per_decade` values a decade, and angles from 90° to 180° in steps of `degrees`; ends included.
    pub fn grid(per_decade: u32, degrees: u32) -> Vec<Point> {
        let magnitudes = (0..=9 * per_decade).map(|n| 10.0_f64.powf(f64::from(n) / f64::from(per_decade) - 3.0));
        let angles = || (90..=180).step_by(degrees.max(1) as usize).map(f64::from);
        magnitudes.flat_map(|magnitude| angles().map(move |angle_deg| Point { magnitude, angle_deg })).collect()
    }

    /// The same |z|, on the imaginary and the negative real axis only: a pole makes a step grow only within one percent of it.
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
    /// Whether the scheme is stable at every step in theory; Runge–Kutta has a limit, see [`Scheme::is_within`].
    pub fn is_stable_everywhere(self) -> bool {
        match self {
            Scheme::TwoPoint(weight) => weight >= 0.5,
            Scheme::GeneralizedAlpha(_) | Scheme::Esdirk => true,
            Scheme::RungeKutta => false,
        }
    }

    /// Whether the scheme is stable at a point in theory: everywhere, within the limit of Runge–Kutta, or nowhere.
    pub fn is_within(self, point: Point) -> bool {
        match self {
            Scheme::RungeKutta => point.magnitude <= RungeKutta::stable_to(point.angle_deg.to_radians()),
            _ => self.is_stable_everywhere(),
        }
    }

    /// Spectral radius at a point: in theory, and of the running integrator.
    ///
    /// # Errors
    /// [`StepError`] if a step cannot be taken.
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
