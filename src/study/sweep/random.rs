//! Randomness as a pure function of seed, stream and index, so that workers need not share a generator.

/// 64 random bits: SplitMix64's finaliser (Steele, Lea & Flood 2014) over seed, stream and index in turn.
pub(super) fn bits(seed: u64, stream: u64, index: u64) -> u64 {
    [stream, index].into_iter().fold(mixed(seed), |state, part| mixed(state ^ mixed(part)))
}

/// A number in (0, 1), evenly distributed.
pub(super) fn share(seed: u64, stream: u64, index: u64) -> f64 {
    ((bits(seed, stream, index) >> 12) as f64 + 0.5) / (1u64 << 52) as f64
}

fn mixed(bits: u64) -> u64 {
    let mut z = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Rounds of the Feistel network.
const ROUNDS: u64 = 6;

/// The place of `index` in a random permutation of `0..count`: a Feistel network on the smallest even number of bits that holds
/// `count`, walked until it lands below it. Neither needs memory.
pub(super) fn permuted(seed: u64, stream: u64, index: u64, count: u64) -> u64 {
    let half_bits = (u64::BITS - count.saturating_sub(1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1u64 << half_bits) - 1;
    let mut place = index;
    loop {
        let [mut left, mut right] = [place >> half_bits, place & mask];
        for round in 0..ROUNDS {
            let key = bits(seed, stream.wrapping_mul(ROUNDS).wrapping_add(round), right);
            [left, right] = [right, left ^ (key & mask)];
        }
        place = left << half_bits | right;
        if place < count {
            return place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_permutation_meets_every_place_once() {
        for count in [1, 2, 3, 5, 64, 100, 1000, 4097] {
            let mut places: Vec<u64> = (0..count).map(|index| permuted(7, 3, index, count)).collect();
            assert!(count < 10 || places.windows(2).any(|pair| pair[1] != pair[0] + 1), "{count}: shuffled");
            places.sort_unstable();
            assert_eq!(places, (0..count).collect::<Vec<_>>(), "{count}");
        }
    }

    #[test]
    fn prop_shares_are_even_and_streams_differ() {
        let shares: Vec<f64> = (0..100_000).map(|index| share(1, 2, index)).collect();
        let mean = shares.iter().sum::<f64>() / 1e5;
        let square = shares.iter().map(|share| share * share).sum::<f64>() / 1e5;
        // Five standard deviations.
        assert!((mean - 0.5).abs() < 5.0 * 0.289 / 316.0 && (square - 1.0 / 3.0).abs() < 5.0 * 0.298 / 316.0);
        let other: Vec<f64> = (0..100_000).map(|index| share(1, 3, index)).collect();
        let product = shares.iter().zip(&other).map(|(a, b)| (a - 0.5) * (b - 0.5)).sum::<f64>() / 1e5;
        assert!(product.abs() < 5.0 / 12.0 / 316.0, "{product}");
    }
}
