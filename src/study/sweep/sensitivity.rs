//! Sensitivity indices of Sobol: the parts of a scalar's variance that a key causes, alone and with others.

use std::path::Path;

use super::SweepError;
use super::campaign::Campaign;
use super::merge::each_row;
use super::run::Column;
use super::spec::Method;
use crate::nearest::did_you_mean;
use crate::study::Table;

/// The indices of one scalar for one key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Index {
    /// First order: the part of the variance that the key causes by itself.
    pub first: f64,
    /// Standard error of the first order, as of independent samples.
    pub first_error: f64,
    /// Total: the part that the key causes by itself and together with others.
    pub total: f64,
    /// Standard error of the total, as of independent samples.
    pub total_error: f64,
}

/// The indices of one scalar.
#[derive(Debug, Clone, PartialEq)]
pub struct Indices {
    /// The scalar.
    pub column: String,
    /// One entry for each key, in the order of the specification.
    pub keys: Vec<Index>,
    /// Samples that they rest on.
    pub samples: u64,
    /// Samples left out: one of their runs is missing, did not run to its end, is not to be trusted, or does not know the scalar.
    pub left_out: u64,
}

/// There are no indices.
#[derive(Debug, thiserror::Error)]
pub enum NoIndices {
    /// The samples are not of Saltelli's design.
    #[error("indices need method = \"sobol\" in the specification")]
    Method,
    /// There is no such scalar.
    #[error("{name}: no scalar of this campaign{hint}\n  {names}")]
    Column {
        /// The name asked for.
        name: String,
        /// The nearest name, as a question.
        hint: String,
        /// All names.
        names: String,
    },
    /// The rows could not be read.
    #[error(transparent)]
    Sweep(#[from] SweepError),
}

/// Standard deviation up to which a scalar differs by rounding alone, relative to the largest number of its unit: a coordinate that
/// should be zero is rounded as the others are, while its own size says nothing.
const ROUNDING: f64 = 1e-12;

/// Units as the names of scalars end with them; one that ends in another comes first.
const UNITS: [&str; 9] = ["_rad_per_s", "_m_per_s", "_rad", "_nm", "_pa", "_m", "_n", "_j", "_s"];

/// The unit that ends the name of a scalar; the name itself if there is none.
fn unit_of(name: &str) -> &str {
    UNITS.into_iter().find(|unit| name.ends_with(*unit)).unwrap_or(name)
}

/// Outputs of the design's runs, sample by sample: `A, AB₁ … ABₖ, B`.
#[derive(Debug, Clone, Default)]
struct Outputs {
    values: Vec<f64>,
    left_out: u64,
}

/// The indices of `wanted` scalars, or of all; those that are the same in all runs, but for rounding, are left out.
///
/// # Errors
/// [`NoIndices`] if the design has none, a scalar is unknown, or the rows cannot be read.
pub fn sensitivity(campaign: &Campaign, folder: &Path, wanted: &[String]) -> Result<Vec<Indices>, NoIndices> {
    if campaign.spec().method != Method::Sobol {
        return Err(NoIndices::Method);
    }
    let places = places(campaign.columns(), wanted)?;
    let runs = campaign.spec().axes.len() + 2;
    let mut outputs = vec![Outputs::default(); places.len()];
    let mut sample: Vec<Option<Vec<Option<f64>>>> = Vec::with_capacity(runs);
    let mut largest = vec![0.0_f64; campaign.columns().len()];
    each_row(campaign, folder, |_, row| {
        let well = row.filter(|row| row.outcome.ended_well());
        let numbers = well.iter().flat_map(|row| &row.outcome.numbers);
        for (largest, number) in largest.iter_mut().zip(numbers) {
            *largest = number.filter(|number| number.is_finite()).map_or(*largest, |number| largest.max(number.abs()));
        }
        sample.push(well.map(|row| places.iter().map(|place| row.outcome.numbers.get(*place).copied().flatten()).collect()));
        if sample.len() == runs {
            outputs.iter_mut().enumerate().for_each(|(place, outputs)| outputs.add(&sample, place));
            sample.clear();
        }
        Ok(())
    })?;
    let named = places.iter().map(|place| campaign.columns()[*place].name.clone());
    let indices = |(column, outputs): (String, Outputs)| {
        let same_unit = campaign.columns().iter().zip(&largest).filter(|(other, _)| unit_of(&other.name) == unit_of(&column));
        let scale = same_unit.map(|(_, largest)| *largest).fold(0.0, f64::max);
        outputs.indices(column, runs, scale)
    };
    Ok(named.zip(outputs).filter_map(indices).collect())
}

/// The places of the wanted columns; of all if none is wanted.
pub(super) fn places(columns: &[Column], wanted: &[String]) -> Result<Vec<usize>, NoIndices> {
    if wanted.is_empty() {
        return Ok((0..columns.len()).collect());
    }
    let names = || columns.iter().map(|column| column.name.as_str());
    let place = |name: &String| {
        names().position(|known| known == name).ok_or_else(|| NoIndices::Column {
            name: name.clone(),
            hint: did_you_mean(name, names()),
            names: names().collect::<Vec<_>>().join(", "),
        })
    };
    wanted.iter().map(place).collect()
}

impl Outputs {
    fn add(&mut self, sample: &[Option<Vec<Option<f64>>>], place: usize) {
        let values: Option<Vec<f64>> = sample.iter().map(|row| row.as_ref()?.get(place).copied()?).collect();
        match values {
            Some(values) => self.values.extend(values),
            None => self.left_out += 1,
        }
    }

    /// The indices of a scalar; `None` if it does not differ by more than the rounding of its unit's largest magnitude, `scale`.
    ///
    /// Estimators (b) and (f) of Saltelli et al. (Comput. Phys. Commun. 181, 259–270, 2010, table 2) on centred and scaled outputs:
    ///
    /// ```text
    /// S = mean(B (ABₖ − A)) / V      T = mean((A − ABₖ)²) / 2V      V = variance of A and B together
    /// ```
    fn indices(mut self, column: String, runs: usize, scale: f64) -> Option<Indices> {
        let (mean, variance) = mean_and_variance(self.values.iter().copied());
        let deviation = variance.sqrt();
        // Scalars that differ by rounding alone have no causes.
        if self.values.is_empty() || deviation <= ROUNDING * scale {
            return None;
        }
        self.values.iter_mut().for_each(|value| *value = (*value - mean) / deviation);
        let samples = || self.values.chunks_exact(runs);
        let (_, variance) = mean_and_variance(samples().flat_map(|sample| [sample[0], sample[runs - 1]]));
        let index = |key: usize| {
            let estimate = |term: &dyn Fn(f64, f64, f64) -> f64| {
                let terms = samples().map(|sample| term(sample[0], sample[1 + key], sample[runs - 1]));
                let (mean, spread) = mean_and_variance(terms);
                (mean / variance, (spread / samples().len() as f64).sqrt() / variance)
            };
            let (first, first_error) = estimate(&|a, ab, b| b * (ab - a));
            let (total, total_error) = estimate(&|a, ab, _| 0.5 * (a - ab) * (a - ab));
            Index { first, first_error, total, total_error }
        };
        let keys: Vec<Index> = if variance > 0.0 { (0..runs - 2).map(index).collect() } else { return None };
        Some(Indices { column, keys, samples: samples().len() as u64, left_out: self.left_out })
    }
}

fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = sum(values.clone()) / count;
    (mean, sum(values.map(|value| (value - mean) * (value - mean))) / count)
}

/// A sum that keeps what each addition rounds off (Neumaier 1974).
fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, lost) = values.fold((0.0_f64, 0.0_f64), |(sum, lost), value| {
        let next = sum + value;
        let rounded = if sum.abs() >= value.abs() { (sum - next) + value } else { (value - next) + sum };
        (next, lost + rounded)
    });
    sum + lost
}

/// A row for each scalar and key: `scalar`, `key`, `first`, `first_error`, `total`, `total_error`, `samples`, `left_out`.
pub fn sensitivity_table(campaign: &Campaign, indices: &[Indices]) -> Table {
    let mut table = Table::default();
    let rows = || indices.iter().flat_map(|scalar| scalar.keys.iter().zip(&campaign.spec().axes).map(move |row| (scalar, row)));
    table.push_words("scalar", rows().map(|(scalar, _)| scalar.column.clone()).collect());
    table.push_words("key", rows().map(|(_, (_, axis))| axis.key.clone()).collect());
    let mut push = |name: &str, value: &dyn Fn(&Indices, &Index) -> f64| {
        table.push(name, rows().map(|(scalar, (index, _))| value(scalar, index)).collect());
    };
    push("first", &|_, index| index.first);
    push("first_error", &|_, index| index.first_error);
    push("total", &|_, index| index.total);
    push("total_error", &|_, index| index.total_error);
    push("samples", &|scalar, _| scalar.samples as f64);
    push("left_out", &|scalar, _| scalar.left_out as f64);
    table
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;
    use std::ops::ControlFlow;

    use super::*;
    use crate::study::sweep::sampling::values;
    use crate::study::sweep::{Spec, work};

    /// The Ishigami function `sin x₁ + 7 sin² x₂ + 0.1 x₃⁴ sin x₁` on (−π, π)³, of which the indices are known (Ishigami & Homma 1990).
    #[test]
    fn val_indices_of_ishigamis_function() {
        let axis = |key: &str| format!("[[vary]]\nkey = \"{key}\"\nmin = -3.141592653589793\nmax = 3.141592653589793\n");
        let text =
            format!("scene = \"x\"\nuntil_s = 1\nmethod = \"sobol\"\nsamples = 8192\n{}{}{}", axis("a"), axis("b"), axis("c"));
        let spec = Spec::parse("test", &text).unwrap();
        let ishigami = |run| {
            let x: Vec<f64> = values(&spec, run).iter().map(|value| value.number().unwrap()).collect();
            x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
        };
        let outputs = Outputs { values: (0..spec.runs()).map(ishigami).collect(), left_out: 0 };
        let indices = outputs.indices("y".to_owned(), 5, 17.0).unwrap();
        for (index, (first, total)) in indices.keys.iter().zip([(0.3139, 0.5576), (0.4424, 0.4424), (0.0, 0.2437)]) {
            assert!((index.first - first).abs() < 5e-3 && (index.total - total).abs() < 5e-3, "{index:?}: {first}, {total}");
        }
        assert_eq!(indices.samples, 8192);
    }

    #[test]
    fn prop_a_sample_with_a_failed_run_is_left_out_and_a_constant_has_no_indices() {
        let mut outputs = Outputs::default();
        let row = |value: f64| Some(vec![Some(value)]);
        outputs.add(&[row(1.0), row(2.0), row(3.0)], 0);
        outputs.add(&[row(1.0), None, row(3.0)], 0);
        outputs.add(&[row(1.0), row(2.0), Some(vec![None])], 0);
        assert_eq!((outputs.values.len(), outputs.left_out), (3, 2));
        let constant = Outputs { values: vec![0.1 + 0.2; 30], left_out: 0 };
        assert_eq!(constant.indices("y".to_owned(), 3, 0.3), None);
        let zero = Outputs { values: vec![0.0; 30], left_out: 0 };
        assert_eq!(zero.indices("y".to_owned(), 3, 0.0), None);
        assert_eq!(Outputs::default().indices("y".to_owned(), 3, 1.0), None);
    }

    /// The slider moves along y = 0, which is computed as ±5.6e-17 m. The noise had indices of up to 2.3.
    #[test]
    fn regress_a_coordinate_that_is_zero_but_for_rounding_has_no_indices() -> Result<(), Box<dyn std::error::Error>> {
        let axis = |key: &str, min: f64, max: f64| format!("[[vary]]\nkey = \"{key}\"\nmin = {min:?}\nmax = {max:?}\n");
        let axes = axis("slider.mass_kg", 0.2, 0.4) + &axis("rod.length_m", 0.7, 1.0);
        let text = format!("scene = \"crank-slider\"\nuntil_s = 0.05\nmethod = \"sobol\"\nsamples = 4\n{axes}");
        let (campaign, folder) = (Campaign::new("test", Spec::parse("test", &text)?)?, tempfile::tempdir()?);
        work(&campaign, folder.path(), None, NonZero::<usize>::MIN, &|_| ControlFlow::Continue(()))?;
        let of = |wanted: &[&str]| -> Result<Vec<String>, NoIndices> {
            let wanted: Vec<String> = wanted.iter().map(|name| (*name).to_owned()).collect();
            Ok(sensitivity(&campaign, folder.path(), &wanted)?.into_iter().map(|scalar| scalar.column).collect())
        };
        let ends = ["slider_least_y_m", "slider_greatest_y_m"];
        assert_eq!(of(&ends)?, Vec::<String>::new(), "the scale is that of all lengths, not of those asked for");
        let all = of(&[])?;
        assert!(!all.iter().any(|name| ends.contains(&name.as_str())), "{all:?}");
        // Small, but no noise: a deflection of micrometres, and the error of the energy balance.
        for name in ["slider_least_x_m", "crank_peak_deflection_m", "worst_balance_j", "newton_iterations"] {
            assert!(all.iter().any(|known| known == name), "{name}: {all:?}");
        }
        Ok(())
    }

    #[test]
    fn prop_a_scalar_has_the_unit_that_ends_its_name() {
        for (name, unit) in [
            ("slider_least_y_m", "_m"),
            ("rod_peak_deflection_m", "_m"),
            ("slider_peak_speed_m_per_s", "_m_per_s"),
            ("crank_peak_rate_rad_per_s", "_rad_per_s"),
            ("crank_final_angle_rad", "_rad"),
            ("rod_peak_moment_nm", "_nm"),
            ("pivot_peak_force_n", "_n"),
            ("sim_time_s", "_s"),
            ("newton_iterations", "newton_iterations"),
        ] {
            assert_eq!(unit_of(name), unit);
        }
    }
}
