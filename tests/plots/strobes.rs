//! The mechanism at several instants in one picture.

use flexcrank::plot::{MechanismPicture, Named};
use flexcrank::study::Table;

use super::animations::turning;

/// Samples in the second that is recorded.
const SAMPLES: u32 = 200;

/// The caption of a beam's positions, without its bending.
fn caption(file: &[Named]) -> String {
    let caption = MechanismPicture::strobe("turning", file).unwrap().caption();
    caption.strip_suffix(", bending from the chord drawn 10 times as large").unwrap().to_owned()
}

#[test]
fn regress_positions_are_samples_of_one_turn_at_the_spacing_that_the_caption_states() {
    for (samples_in_a_turn, expected) in [
        // The ninth sample is where the first was.
        (8.0, "8 positions in one turn, from 0 s (pale) to 0.035 s (dark), 0.005 s apart"),
        // The sixth sample is beyond the turn.
        (4.14, "5 positions in one turn, from 0 s (pale) to 0.02 s (dark), 0.005 s apart"),
        // Every sample would be too many, and twelfths of the turn lie between samples.
        (20.0, "10 positions in one turn, from 0 s (pale) to 0.09 s (dark), 0.01 s apart"),
        (120.0, "12 positions in one turn, from 0 s (pale) to 0.55 s (dark), 0.05 s apart"),
        (1000.0, "11 positions in the recorded time, from 0 s (pale) to 1 s (dark), 0.1 s apart"),
    ] {
        let file = turning(|time_s| time_s * f64::from(SAMPLES) / samples_in_a_turn, 1.0, SAMPLES);
        assert_eq!(caption(&file), expected, "{samples_in_a_turn}");
    }
    assert_eq!(caption(&turning(|time_s| time_s, 0.0, 0)), "the only recorded position");
}

#[test]
fn regress_the_caption_of_uneven_samples_states_the_range_of_their_spacing() {
    let [whole] = turning(|time_s| 25.0 * time_s, 1.0, SAMPLES);
    let mut table = Table::default();
    for (name, values) in whole.table.columns() {
        table.push(name, [&values[..3], &values[4..]].concat());
    }
    let lossy = [Named { table, ..whole }];
    let expected = "7 positions in one turn, from 0 s (pale) to 0.035 s (dark), 0.005 to 0.01 s apart";
    assert_eq!(caption(&lossy), expected, "the fourth sample was lost");
}
