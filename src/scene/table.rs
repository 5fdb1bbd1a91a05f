//! Tables of two columns whose first ascends.

use super::{SceneError, check::Checker};

/// The rows of a table; each has two finite numbers, the first above that of the row before. `problem_of` says what else is wrong with
/// a row.
///
/// # Errors
/// Names the first row that is not so.
pub(super) fn ascending(
    check: &Checker,
    key: &str,
    given: &[Vec<f64>],
    problem_of: impl Fn([f64; 2]) -> Option<String>,
) -> Result<Vec<[f64; 2]>, SceneError> {
    if given.len() < 2 {
        return Err(check.refuse(key, "must have at least two rows"));
    }
    let mut rows: Vec<[f64; 2]> = Vec::new();
    for (number, row) in given.iter().enumerate() {
        let refuse = |problem: &str| check.refuse(key, format!("row {} is {row:?}: {problem}", number + 1));
        let pair: [f64; 2] = row.as_slice().try_into().map_err(|_| refuse("must be two numbers"))?;
        if !pair.iter().all(|value| value.is_finite()) {
            return Err(refuse("must be finite numbers"));
        }
        if let Some(problem) = problem_of(pair) {
            return Err(refuse(&problem));
        }
        if rows.last().is_some_and(|before| before[0] >= pair[0]) {
            return Err(refuse("its first number must be greater than that of the row before"));
        }
        rows.push(pair);
    }
    Ok(rows)
}
