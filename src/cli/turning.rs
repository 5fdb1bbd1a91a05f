//! The turning of the first link from sample to sample of a recording: where it is wide, drawn curves and paths are polygons.

use super::sample_intervals::{Interval, Step, intervals, step};
use super::suggested_rate::suggested_rate;
use crate::study::Table;

/// Turning from sample to sample beyond which a path is seen to be a polygon, rad.
const COARSE_RAD: f64 = 0.3;
/// Turning from sample to sample up to which a path looks smooth, rad.
const SMOOTH_RAD: f64 = 0.1;

/// A sentence about the topic `angles` of a recording if the first link turns far between samples that are drawn, which are
/// `interval_s` apart.
pub(super) fn coarse_turning(angles: &Table, interval_s: f64) -> Option<String> {
    let (column, chords_rad) = first_chord(angles)?;
    let link = column.strip_prefix("links.")?.strip_suffix(".chord_rad")?;
    let step = step(angles)?;
    let speed = |Interval { row, duration_s }: Interval| (chords_rad[row] - chords_rad[row - 1]).abs() / duration_s;
    let speed_rad_per_s = intervals(angles).into_iter().map(speed).max_by(f64::total_cmp)?;
    let turned_rad = speed_rad_per_s * interval_s;
    let sentence = || {
        let advice = advice(speed_rad_per_s, step);
        let so = "so that curves and paths are polygons";
        format!("the {link} turns by up to {turned_rad:.1} rad from sample to sample, {so}; {advice}")
    };
    (turned_rad > COARSE_RAD).then(sentence)
}

/// The column of the topic `angles` with the chord angle of the first link: its name, and its values.
pub(super) fn first_chord(angles: &Table) -> Option<(&str, &[f64])> {
    angles.columns().find(|(name, _)| name.starts_with("links.") && name.ends_with(".chord_rad"))
}

/// The way to smooth curves and paths.
fn advice(speed_rad_per_s: f64, step: Step) -> String {
    let [smooth_s, coarse_s] = [SMOOTH_RAD, COARSE_RAD].map(|turned_rad| turned_rad / speed_rad_per_s);
    let how = suggested_rate(smooth_s, coarse_s, step);
    format!("record with --publish-hz {how} for smooth ones")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::SIMULATED_TIME;

    /// Samples at these steps of 0.1 ms of these epochs; each epoch begins 10 rad further.
    fn samples(speed_rad_per_s: f64, stamps: &[[u32; 2]]) -> Table {
        let column = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            stamps.iter().map(|[epoch, step]| value(f64::from(*epoch), f64::from(*step))).collect()
        };
        let mut table = Table::default();
        table.push("stamp.step", column(&|_, step| step));
        table.push(SIMULATED_TIME, column(&|_, step| 1e-4 * step));
        table.push("stamp.epoch", column(&|epoch, _| epoch));
        table.push("links.crank.chord_rad", column(&|epoch, step| 10.0 * epoch - 1e-4 * speed_rad_per_s * step));
        table.push("links.rod.chord_rad", column(&|_, step| step));
        table
    }

    fn every(steps: u32) -> Vec<[u32; 2]> {
        (0..40).map(|row| [0, steps * row]).collect()
    }

    #[test]
    fn regress_wide_turning_is_named_with_a_rate_that_suffices() {
        let said = |speed: f64, angles: u32, drawn: u32| coarse_turning(&samples(speed, &every(angles)), 1e-4 * f64::from(drawn));
        let so = "so that curves and paths are polygons; record with --publish-hz";
        let wide = format!("the crank turns by up to 0.6 rad from sample to sample, {so}");
        let named = Some(format!("{wide} 1300 for smooth ones"));
        assert_eq!((said(120.0, 50, 50), said(-120.0, 50, 50)), (named.clone(), named.clone()));
        assert_eq!((said(120.0, 8, 50), said(120.0, 50, 8)), (named, None), "the samples that are drawn count");
        assert_eq!((said(1200.0, 5, 5), said(50.0, 50, 50)), (Some(format!("{wide} all for smooth ones")), None));
        let longer = Some(format!("{wide} all and solver.step_s = 0.00001 for smooth ones"));
        assert_eq!(said(6000.0, 1, 1), longer);
        assert_eq!(coarse_turning(&Table::default(), 1.0), None);
    }

    /// A few long steps behind many short ones were taken for gaps, and a rate was named that could not help.
    #[test]
    fn regress_a_step_that_was_made_longer_is_named() {
        let long_s = 0.02;
        let time_s = |row: u32| if row <= 200 { 5e-3 * f64::from(row) } else { 1.0 + long_s * f64::from(row - 200) };
        let step = |row: u32| f64::from(if row <= 200 { 10 * row } else { 1800 + row });
        let mut table = Table::default();
        table.push("stamp.step", (0..208).map(step).collect());
        table.push(SIMULATED_TIME, (0..208).map(time_s).collect());
        table.push("stamp.epoch", vec![0.0; 208]);
        table.push("links.crank.chord_rad", (0..208).map(|row| 90.0 * time_s(row)).collect());
        let interval_s = super::super::sample_intervals::regular_s(&table).unwrap_or_default();
        assert!((interval_s - long_s).abs() < 1e-9, "{interval_s}");
        let said = coarse_turning(&table, interval_s).unwrap_or_default();
        assert!(
            said.starts_with("the crank turns by up to 1.8 rad ")
                && said
                    .contains(" --publish-hz all, and at every level and after every change a solver.step_s of at most 0.001 "),
            "{said}"
        );
    }

    #[test]
    fn regress_gaps_and_resets_are_no_turning() {
        let slow = |stamps: &[[u32; 2]]| coarse_turning(&samples(50.0, stamps), 5e-3);
        let lost: Vec<[u32; 2]> = every(50).into_iter().filter(|[_, step]| !(500..800).contains(step)).collect();
        let reset: Vec<[u32; 2]> = every(50).into_iter().map(|[_, step]| [u32::from(step > 950), step]).collect();
        assert_eq!((slow(&lost), slow(&reset)), (None, None));
    }
}
