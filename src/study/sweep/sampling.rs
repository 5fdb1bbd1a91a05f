//! The values of each run: a pure function of the specification and the run's index.

use super::axis::Value;
use super::spec::{Method, Spec};
use super::{random, sobol};

/// The values of the keys in run `index`, in the order of the specification.
pub(super) fn values(spec: &Spec, index: u64) -> Vec<Value> {
    match spec.method {
        Method::Grid => on_grid(spec, index),
        Method::Random => shares(spec, |key| random::share(spec.seed, key, index)),
        Method::LatinHypercube => shares(spec, |key| in_hypercube(spec, key, index)),
        Method::Sobol => in_saltelli_design(spec, index),
    }
}

fn shares(spec: &Spec, share: impl Fn(u64) -> f64) -> Vec<Value> {
    (0..).zip(&spec.axes).map(|(key, axis)| axis.at(share(key))).collect()
}

/// The last key varies fastest.
fn on_grid(spec: &Spec, index: u64) -> Vec<Value> {
    let mut rest = index;
    let mut values: Vec<Value> = Vec::with_capacity(spec.axes.len());
    for axis in spec.axes.iter().rev() {
        values.push(axis.on_grid(rest % axis.grid_count()));
        rest /= axis.grid_count();
    }
    values.reverse();
    values
}

/// A random place within the interval that a random permutation gives this run.
fn in_hypercube(spec: &Spec, key: u64, index: u64) -> f64 {
    let interval = random::permuted(spec.seed, 2 * key, index, spec.samples);
    (interval as f64 + random::share(spec.seed, 2 * key + 1, index)) / spec.samples as f64
}

/// Saltelli's design (Comput. Phys. Commun. 181, 259–270, 2010): for each sample the run A, then for each key k the run ABₖ, which is A
/// with the value of key k from B, then the run B. A and B are halves of one Sobol point, shifted by the seed.
fn in_saltelli_design(spec: &Spec, index: u64) -> Vec<Value> {
    let keys = spec.axes.len() as u64;
    let (sample, member) = (index / (keys + 2), index % (keys + 2));
    shares(spec, |key| {
        let from_b = member == keys + 1 || member == key + 1;
        let dimension = if from_b { keys + key } else { key };
        let shift = (random::bits(spec.seed, dimension, 0) >> 32) as u32;
        let coordinate = sobol::coordinate(sample, dimension as usize) ^ shift;
        (f64::from(coordinate) + 0.5) / 2.0_f64.powi(32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(method: &str, rest: &str) -> Spec {
        let text = format!("scene = \"x\"\nuntil_s = 1\nmethod = \"{method}\"\n{rest}");
        Spec::parse("test", &text).unwrap()
    }

    const RANGES: &str =
        "samples = 64\n[[vary]]\nkey = \"a\"\nmin = 0\nmax = 1\n[[vary]]\nkey = \"b\"\nmin = 1\nmax = 100\nlog = true\n";

    fn numbers(spec: &Spec) -> Vec<Vec<f64>> {
        (0..spec.runs()).map(|index| values(spec, index).iter().map(|value| value.number().unwrap()).collect()).collect()
    }

    #[test]
    fn val_a_grid_has_every_combination_and_both_bounds() {
        let spec = spec(
            "grid",
            "[[vary]]\nkey = \"a\"\nvalues = [\"x\", 2]\n[[vary]]\nkey = \"b\"\nmin = 1\nmax = 100\nlog = true\ncount = 3",
        );
        let words: Vec<String> =
            (0..spec.runs()).map(|run| values(&spec, run).iter().map(Value::word).collect::<Vec<_>>().join(" ")).collect();
        assert_eq!(words, ["x 1", "x 10", "x 100", "2 1", "2 10", "2 100"]);
    }

    /// The place 15 of 22 was 14.999999999999998.
    #[test]
    fn regress_whole_numbers_of_a_grid_are_whole() {
        for (least, most, count) in [(0, 22, 23), (0, 25, 26), (2, 8, 4), (-3, 35, 39)] {
            let spec = spec("grid", &format!("[[vary]]\nkey = \"a\"\nmin = {least}\nmax = {most}\ncount = {count}\n"));
            let words: Vec<String> = (0..spec.runs()).flat_map(|run| values(&spec, run)).map(|value| value.toml()).collect();
            let step = (most - least) / (count - 1);
            let whole: Vec<String> = (0..count).map(|place| (least + step * place).to_string()).collect();
            assert_eq!(words, whole);
        }
    }

    /// 0.15 was 0.15000000000000002, and 0 was -1.4e-17.
    #[test]
    fn regress_values_of_a_grid_have_no_digits_of_rounding() {
        for (min, max, expected) in [
            (0.1, 0.3, "0.1 0.15 0.2 0.25 0.3"),
            (-0.1, 0.3, "-0.1 0 0.1 0.2 0.3"),
            (-2.0, 0.2, "-2 -1.45 -0.9 -0.35 0.2"),
            (1e-9, 2e-9, "1e-9 1.25e-9 1.5e-9 1.75e-9 2e-9"),
        ] {
            let spec = spec("grid", &format!("[[vary]]\nkey = \"a\"\nmin = {min:?}\nmax = {max:?}\ncount = 5"));
            let words: Vec<String> = (0..spec.runs()).flat_map(|run| values(&spec, run)).map(|value| value.toml()).collect();
            assert_eq!(words.join(" "), expected);
        }
    }

    #[test]
    fn prop_a_latin_hypercube_meets_every_interval_of_every_key_once() {
        let spec = spec("latin-hypercube", RANGES);
        let rows = numbers(&spec);
        for key in 0..2 {
            let interval = |row: &Vec<f64>| if key == 0 { row[0] * 64.0 } else { row[1].ln() / 100.0_f64.ln() * 64.0 };
            let mut met: Vec<u64> = rows.iter().map(|row| interval(row) as u64).collect();
            met.sort_unstable();
            assert_eq!(met, (0..64).collect::<Vec<_>>(), "key {key}");
        }
    }

    #[test]
    fn prop_a_saltelli_design_mixes_two_points() {
        let rows = numbers(&spec("sobol", RANGES));
        assert_eq!(rows.len(), 64 * 4);
        for four in rows.chunks(4) {
            let [a, ab_0, ab_1, b] = four else { panic!("four runs a sample") };
            assert_eq!((ab_0[0], ab_0[1], ab_1[0], ab_1[1]), (b[0], a[1], a[0], b[1]));
        }
    }

    #[test]
    fn prop_samples_stay_when_their_number_grows_and_change_with_the_seed() {
        for method in ["random", "sobol"] {
            let few = numbers(&spec(method, RANGES));
            let more = numbers(&spec(method, &RANGES.replace("64", "128")));
            assert_eq!(few, more[..few.len()], "{method}");
            let other = numbers(&spec(method, &format!("seed = 1\n{RANGES}")));
            assert!(few.iter().zip(&other).all(|(one, other)| one != other), "{method}");
        }
    }
}
