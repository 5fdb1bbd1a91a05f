//! Points of the Sobol sequence.

use std::sync::OnceLock;

use super::sobol_numbers::NUMBERS;

/// Dimensions of the sequence.
pub(super) const DIMENSIONS: usize = NUMBERS.len() + 1;
/// Bits of a coordinate.
const BITS: usize = 32;

type Directions = [u32; BITS];

/// Coordinate `dimension` of point `index`, as a fraction of 2³², in Gray-code order (Antonov & Saleev 1979).
pub(super) fn coordinate(index: u64, dimension: usize) -> u32 {
    static DIRECTIONS: OnceLock<Vec<Directions>> = OnceLock::new();
    let directions = &DIRECTIONS.get_or_init(|| (0..DIMENSIONS).map(directions).collect())[dimension];
    let gray = index ^ (index >> 1);
    let bits = directions.iter().enumerate().filter(|(bit, _)| gray >> bit & 1 == 1);
    bits.fold(0, |point, (_, direction)| point ^ direction)
}

/// Direction numbers `vₖ = mₖ / 2ᵏ`; for a polynomial `x^s + a₁ x^(s−1) + … + 1`, from the recurrence (Bratley & Fox 1988)
///
/// ```text
/// vₖ = a₁ vₖ₋₁ ⊕ a₂ vₖ₋₂ ⊕ … ⊕ vₖ₋ₛ ⊕ vₖ₋ₛ / 2ˢ
/// ```
fn directions(dimension: usize) -> Directions {
    let Some((polynomial, initial)) = dimension.checked_sub(1).and_then(|place| NUMBERS.get(place)) else {
        return std::array::from_fn(|k| 1 << (BITS - 1 - k));
    };
    let degree = initial.len();
    let mut v = [0; BITS];
    for k in 0..BITS {
        v[k] = match initial.get(k) {
            Some(m) => m << (BITS - 1 - k),
            None => {
                let last = v[k - degree] ^ (v[k - degree] >> degree);
                let terms = (1..degree).filter(|j| polynomial >> (degree - j) & 1 == 1);
                terms.fold(last, |sum, j| sum ^ v[k - j])
            }
        };
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of `scipy.stats.qmc.Sobol(d=128, scramble=False)`, scipy 1.17.1: index, then coordinates 0, 1, 2, 9, 39, 63, 127
    /// times 2³⁰.
    const SCIPY: &[(u64, [u32; 7])] = &[
        (0, [0, 0, 0, 0, 0, 0, 0]),
        (1, [536870912, 536870912, 536870912, 536870912, 536870912, 536870912, 536870912]),
        (2, [805306368, 268435456, 268435456, 805306368, 268435456, 805306368, 268435456]),
        (3, [268435456, 805306368, 805306368, 268435456, 805306368, 268435456, 805306368]),
        (7, [134217728, 671088640, 402653184, 939524096, 134217728, 402653184, 402653184]),
        (100, [444596224, 276824064, 830472192, 746586112, 142606336, 696254464, 494927872]),
        (1023, [1048576, 808452096, 657457152, 913309696, 749731840, 42991616, 751828992]),
        (4096, [393216, 505282560, 897449984, 1068105728, 753532928, 478543872, 14811136]),
        (65535, [16384, 1073725440, 605372416, 175980544, 467681280, 318226432, 258162688]),
        (131071, [8192, 536879104, 975183872, 42901504, 1002971136, 490070016, 800481280]),
    ];

    #[test]
    fn val_points_are_scipys() {
        for (index, point) in SCIPY {
            let own = [0, 1, 2, 9, 39, 63, 127].map(|dimension| coordinate(*index, dimension) >> 2);
            assert_eq!(own, *point, "point {index}");
        }
    }

    #[test]
    fn prop_every_dimension_meets_every_interval_once() {
        for dimension in 0..DIMENSIONS {
            let mut met: Vec<u32> = (0..1024).map(|index| coordinate(index, dimension) >> 22).collect();
            met.sort_unstable();
            assert_eq!(met, (0..1024).collect::<Vec<_>>(), "dimension {dimension}");
        }
    }
}
