//! `modes --periodic`: what grows or fades in a turn of the crank.

use std::io::Write as _;
use std::sync::Mutex;

use super::aligned_table::{figure, print};
use super::failure::{CommandResult, Failure};
use super::folders::{make_folder, must_be_targets};
use super::formatting::counted;
use super::modes::Args;
use super::output::{output, print_json};
use super::periodic_refusals::conclude;
use super::progress::bar;
use super::signals::Interruption;
use super::small_motion_args::Chosen;
use super::unstable_ranges::ranges;
use super::written::{draw, write_table};
use crate::plot;
use crate::scene::{SceneError, SceneSource};
use crate::small_motion::floquet::Accuracy;
use crate::small_motion::scheme::Scheme;
use crate::small_motion::{NoModes, PeriodicMode, PeriodicModes, Subject};
use crate::study::Table;
use crate::study::trade::INTERRUPTED;

/// Multipliers to a millionth, with at most a thousand steps a turn, unless those resolve none.
const ACCURACY: Accuracy = Accuracy { tolerance: 1e-6, fewest_steps: 64, most_steps: 1024, most_gone: usize::MAX };

/// One scene over the speeds.
struct Row {
    /// Value of the key that is swept, if one is.
    value: Option<f64>,
    subject: Subject,
    scheme: (Scheme, f64),
}

/// A motion that was asked for; `None` if it was not reached.
pub(super) type Found = Option<Result<PeriodicModes, NoModes>>;

/// All that was found, row by row of the key, speed by speed.
struct Chart<'a> {
    args: &'a Args,
    integrator: &'static str,
    speeds: Vec<f64>,
    rows: Vec<Row>,
    found: Vec<Vec<Found>>,
}

pub(super) fn periodic(args: &Args) -> CommandResult {
    let interruption = Interruption::watch()?;
    must_be_targets(&args.subject.target, &[("--csv", args.csv.as_deref())])?;
    let chosen = args.subject.choose()?;
    chosen.check(args.angle.is_some(), true)?;
    let speeds = args.speed.as_ref().map(|speeds| speeds.0.clone()).unwrap_or_default();
    let angle_deg = match args.angle.as_ref().map(|angles| angles.0.as_slice()) {
        None => None,
        Some([one]) => Some(*one),
        Some(_) => return Err(Failure::Usage("the angle at which a turn begins is one number".to_owned())),
    };
    args.plot.as_deref().map_or(Ok(()), make_folder)?;
    let rows = rows(args, &chosen)?;
    let found = find(args, &rows, &speeds, chosen.angle_rad(angle_deg)?, &interruption);
    let chart = Chart { args, integrator: chosen.source.scene.solver.integrator.as_str(), speeds, rows, found };
    let table = chart.table();
    let shown = match (args.json, chart.speeds.len() * chart.rows.len()) {
        (true, _) => table.rows_as_json().iter().try_for_each(print_json).map_err(Failure::from),
        (false, 1) => chart.show_one(),
        (false, _) => chart.show(),
    };
    // Files are written although nothing can be printed.
    let written = shown.and(args.csv.as_deref().map_or(Ok(()), |path| write_table(path, &table, !args.json)));
    let drawn = args.plot.as_deref().map_or(Ok(()), |folder| chart.draw(folder));
    written.and(drawn).and_then(|()| conclude(&chart.speeds, &chart.found, &interruption))
}

/// The scene with every value of the key.
fn rows(args: &Args, chosen: &Chosen) -> CommandResult<Vec<Row>> {
    let row = |source: &SceneSource, value| -> CommandResult<Row> {
        let subject = Subject::new(&source.scene, args.subject.crank)?;
        let solver = &source.scene.solver;
        Ok(Row { value, subject, scheme: (Scheme::of(solver), solver.step_s) })
    };
    let Some(over) = &args.over else { return Ok(vec![row(&chosen.source, None)?]) };
    let with = |value: &f64| {
        let mut overrides = args.subject.overrides.clone();
        overrides.push(format!("{}={value:?}", over.key));
        let source = SceneSource::open(&args.subject.target, &overrides).map_err(|refused| blamed_on_over(refused, &over.key))?;
        row(&source, Some(*value))
    };
    over.values.iter().map(with).collect()
}

/// A refusal of a value that `--over` gave, which names that option.
fn blamed_on_over(mut refused: SceneError, key: &str) -> SceneError {
    if refused.place.starts_with(&format!("--set {key}=")) {
        refused.place = refused.place.replacen("--set", "--over", 1);
    }
    refused
}

/// Every row is taken by one thread, from speed to speed: a motion found helps to find the next. One row alone is divided.
fn find(args: &Args, rows: &[Row], speeds: &[f64], angle_rad: f64, interruption: &Interruption) -> Vec<Vec<Found>> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.jobs.map_or(cores, |jobs| usize::try_from(jobs).unwrap_or(cores));
    let part = if rows.len() > 1 { speeds.len() } else { speeds.len().div_ceil(threads) }.max(1);
    let bar = bar((rows.len() * speeds.len()) as u64, "{wide_bar} {pos}/{len} motions{left}");
    interruption.keeps(rows.len() * speeds.len() > 1);
    let mut found: Vec<Vec<Found>> = rows.iter().map(|_| vec![None; speeds.len()]).collect();
    let tasks = rows.iter().zip(&mut found).flat_map(|(row, found)| {
        speeds.chunks(part).zip(found.chunks_mut(part)).map(move |(speeds, found)| (row, speeds, found))
    });
    let tasks = Mutex::new(tasks);
    let work = || {
        loop {
            // The lock is held only to take the next task.
            let task = tasks.lock().ok().and_then(|mut tasks| tasks.next());
            let Some((row, speeds, found)) = task else { break };
            let mut near = None;
            for (speed, found) in speeds.iter().zip(found) {
                if interruption.is_asked() {
                    return;
                }
                let scheme = Some(row.scheme);
                let try_from = |near| row.subject.periodic_modes(angle_rad, *speed, &ACCURACY, scheme, near);
                let modes = try_from(near.as_ref()).or_else(|refusal| if near.is_some() { try_from(None) } else { Err(refusal) });
                near = modes.as_ref().ok().map(|modes| modes.orbit.clone()).or(near);
                *found = Some(modes);
                bar.inc(1);
            }
        }
    };
    std::thread::scope(|scope| (0..threads).for_each(|_| _ = scope.spawn(work)));
    bar.finish_and_clear();

    found
}

impl Chart<'_> {
    /// Every motion that was found, with its row's value and its speed.
    fn motions(&self) -> impl Iterator<Item = (Option<f64>, f64, &PeriodicModes)> {
        let rows = self.rows.iter().zip(&self.found);
        rows.flat_map(|(row, found)| {
            let found = self.speeds.iter().zip(found);
            found.filter_map(|(speed, found)| Some((row.value, *speed, found.as_ref()?.as_ref().ok()?)))
        })
    }

    /// Every mode of every motion.
    fn table(&self) -> Table {
        let mut names = Vec::new();
        let mut numbers: [Vec<f64>; 9] = Default::default();
        for (value, speed, found) in self.motions() {
            for PeriodicMode { mode, multiplier, by_scheme } in found.modes.iter().take(self.args.modes()) {
                names.push(mode.name());
                let row = [
                    value.unwrap_or(f64::NAN),
                    speed,
                    mode.frequency_hz(),
                    mode.eigenvalue.re,
                    multiplier.value.re,
                    multiplier.value.im,
                    multiplier.error,
                    by_scheme.map_or(f64::NAN, |value| value.re),
                    by_scheme.map_or(f64::NAN, |value| value.im),
                ];
                numbers.iter_mut().zip(row).for_each(|(column, cell)| column.push(cell));
            }
        }
        let mut table = Table::default();
        table.push_words("mode", names);
        let key = self.args.over.as_ref().map_or("", |over| over.key.as_str());
        let columns = [
            key,
            "speed_rad_per_s",
            "frequency_hz",
            "growth_per_s",
            "multiplier_re",
            "multiplier_im",
            "multiplier_error",
            "multiplier_by_scheme_re",
            "multiplier_by_scheme_im",
        ];
        columns.into_iter().zip(numbers).filter(|(name, _)| !name.is_empty()).for_each(|(name, column)| table.push(name, column));
        if self.not_reached() > 0 {
            table.push(INTERRUPTED, vec![1.0; table.rows()]);
        }
        table
    }

    /// Number of motions that an interruption left out.
    fn not_reached(&self) -> usize {
        self.found.iter().flatten().filter(|found| found.is_none()).count()
    }

    /// Prints the modes of one motion.
    fn show_one(&self) -> CommandResult<()> {
        let Some((_, speed, found)) = self.motions().next() else { return Ok(()) };
        let mut out = output();
        let held = self.rows.first().is_some_and(|row| row.subject.is_held());
        let crank = match found.orbit.torque_nm {
            Some(torque_nm) => format!("free under {} N·m", figure(torque_nm)),
            None => if held { "moved" } else { "free" }.to_owned(),
        };
        let turn = figure(1e3 * found.orbit.cycle.period_s);
        writeln!(out, "{}: crank {crank}, {} rad/s, a turn in {turn} ms", self.args.subject.target, figure(speed))?;
        writeln!(out, "  the motion repeats to {:.0e}, with {} steps a turn", found.orbit.residual, found.orbit.cycle.steps)?;
        let mut rows = vec![["mode", "Hz", "growth 1/s", "|ρ| a turn", "±", "|ρ| by"].map(str::to_owned).to_vec()];
        if let Some(last) = rows[0].last_mut() {
            *last = format!("|ρ| by {}", self.integrator);
        }
        let step_s = found.orbit.cycle.step_s();
        let known = || found.modes.iter().filter(|mode| mode.is_resolved() || mode.is_slow(step_s));
        for PeriodicMode { mode, multiplier, by_scheme } in known().take(self.args.modes()) {
            rows.push(vec![
                mode.name(),
                figure(mode.frequency_hz()),
                figure(mode.eigenvalue.re),
                format!("{:.6}", multiplier.value.norm()),
                format!("{:.0e}", multiplier.error),
                by_scheme.map_or("–".to_owned(), |value| format!("{:.6}", value.norm())),
            ]);
        }
        if rows.len() > 1 {
            print(&rows, 1)?;
        }
        if rows.len() > 1 && self.rows.first().is_some_and(|row| !row.subject.turns_steadily()) {
            let own = figure(1.0 / found.orbit.cycle.period_s);
            writeln!(out, "  Hz are known up to whole multiples of {own} Hz, and up to their sign")?;
        }
        let vague: Vec<String> = known().filter(|mode| !mode.is_resolved()).map(|mode| mode.mode.name()).collect();
        if !vague.is_empty() {
            let names = vague.join(", ");
            writeln!(out, "  {names}: known to no better than ± says with these steps, as where forces have corners")?;
        }
        let faster = found.modes.len() - known().count() + found.lost.div_ceil(2);
        if found.is_known() && faster > 0 {
            writeln!(out, "  {} too fast for these steps", are(faster, "more mode"))?;
        }
        if !found.is_known() && vague.is_empty() {
            let has_errors = found.modes.iter().any(|mode| mode.multiplier.error.is_finite());
            let why = match has_errors || found.lost > 0 {
                true => format!("{} too fast for these steps; `flexcrank run` shows whether it fades", are(faster, "mode")),
                false => "the motion was found with these steps alone, so that none has an error".to_owned(),
            };
            writeln!(out, "  no multiplier is known: {why}")?;
        }
        if found.gone > 0 {
            let multipliers = counted(found.gone as u64, "more multiplier");
            writeln!(out, "  {multipliers} below 1e-6: such motion is gone after a turn")?;
        }
        for unstable in found.unstable() {
            let growth = figure(unstable.multiplier.value.norm());
            writeln!(out, "  {} is unstable: it grows {growth} times in a turn", unstable.mode.name())?;
        }
        match &found.scheme {
            Some(Ok(scheme)) => {
                let grows = found.unstable().next().is_some();
                let verdict = match (found.is_known(), found.scheme_adds_growth()) {
                    (false, _) => "is not judged",
                    (true, true) if grows => "adds more than 1 % of growth",
                    (true, true) => "is unstable",
                    (true, false) if found.scheme_is_vague() => "is not judged",
                    (true, false) => "adds less than 1 % of growth",
                };
                let error = match found.scheme_is_vague() {
                    true => format!(" of the crank's own motion, ± {:.0e}; a shorter step is more exact", scheme.own.error),
                    false => String::new(),
                };
                let step = figure(1e3 * scheme.cycle.step_s());
                writeln!(
                    out,
                    "  {} at {step} ms {verdict}: |ρ| up to {:.6}{error}",
                    self.integrator,
                    scheme.largest.value.norm()
                )?;
            }
            Some(Err(refusal)) => writeln!(out, "  {} finds no periodic motion at its step: {refusal}", self.integrator)?,
            None => {}
        }
        Ok(())
    }

    /// Prints the ranges of speed in which a mode is unstable.
    fn show(&self) -> CommandResult<()> {
        let mut out = output();
        let ends = [self.speeds.first(), self.speeds.last()].map(|end| figure(end.copied().unwrap_or_default()));
        let (target, count) = (&self.args.subject.target, self.motions().count());
        let left_out = match self.not_reached() {
            0 => String::new(),
            left => format!("; interrupted: {left} more were not looked at, and what is unstable may go on there"),
        };
        writeln!(out, "{target}: {count} motions from {} to {} rad/s{left_out}", ends[0], ends[1])?;
        let key = self.args.over.as_ref().map_or("", |over| over.key.as_str());
        let mut rows = vec![[key, "unstable", "from rad/s", "to", "largest |ρ|", "at"].map(str::to_owned).to_vec()];
        for (row, found) in self.rows.iter().zip(&self.found) {
            for range in ranges(&self.speeds, found) {
                let value = row.value.map(figure).unwrap_or_default();
                let [from, to, largest, at] = [range.from, range.to, range.largest, range.at].map(figure);
                rows.push(vec![value, range.name, from, to, largest, at]);
            }
        }
        if rows.len() > 1 {
            print(&rows, 2)?
        } else if self.motions().any(|(_, _, found)| found.is_known()) {
            let is_whole = |found: &PeriodicModes| found.lost == 0 && found.modes.iter().all(PeriodicMode::is_resolved);
            let which =
                if self.motions().all(|(_, _, found)| is_whole(found)) { "no mode" } else { "no mode that the steps resolve" };
            writeln!(out, "  {which} is unstable{}", if self.not_reached() > 0 { " among these" } else { "" })?
        }
        let unknown: Vec<f64> = self.motions().filter(|(_, _, found)| !found.is_known()).map(|(_, speed, _)| speed).collect();
        if !unknown.is_empty() {
            let (motions, speeds) = (counted(unknown.len() as u64, "motion"), extent(&unknown));
            writeln!(
                out,
                "  no multiplier of {motions}, {speeds} rad/s, is known: their modes are too fast for the steps, or the steps too few"
            )?;
        }
        let alone = |found: &PeriodicModes| found.scheme_adds_growth() && found.unstable().next().is_none();
        for (is_so, verdict) in
            [(&alone as &dyn Fn(&PeriodicModes) -> bool, "alone is unstable"), (&PeriodicModes::scheme_is_vague, "is not judged")]
        {
            let speeds: Vec<f64> = self.motions().filter(|(_, _, found)| is_so(found)).map(|(_, speed, _)| speed).collect();
            if let (Some(first), Some(last)) = (speeds.first(), speeds.last()) {
                let (count, first, last) = (speeds.len(), figure(*first), figure(*last));
                writeln!(out, "  {} {verdict} at {count} of the speeds, from {first} to {last} rad/s", self.integrator)?;
            }
        }
        Ok(())
    }

    fn draw(&self, folder: &std::path::Path) -> CommandResult<()> {
        let speed = || plot::Axis::new("crank speed", "rad/s");
        let largest =
            |found: &Found| found.as_ref().and_then(|found| found.as_ref().ok()).map_or(f64::NAN, PeriodicModes::largest);
        if let Some(over) = &self.args.over {
            let map = plot::HeatMap {
                title: "Largest multiplier of a turn".to_owned(),
                x: speed(),
                y: plot::Axis::new(&over.key, ""),
                xs: self.speeds.clone(),
                ys: over.values.clone(),
                values: self.found.iter().map(|row| row.iter().map(largest).collect()).collect(),
                key: plot::Key::Quantity(plot::Axis::log("largest |ρ|", "")),
            };
            return draw(folder, "stability-chart", &map, !self.args.json);
        }
        let Some(found) = self.found.first() else { return Ok(()) };
        let physics: Vec<f64> = found.iter().map(largest).collect();
        let scheme = |found: &Found| {
            let scheme = found.as_ref().and_then(|found| found.as_ref().ok()?.scheme.as_ref()?.as_ref().ok());
            scheme.map_or(f64::NAN, |scheme| scheme.largest.value.norm())
        };
        let own: Vec<f64> = found.iter().map(scheme).collect();
        let drawn = plot::Figure::new("Largest multiplier of a turn", speed(), plot::Axis::new("|ρ|", ""))
            .line("the mechanism", &self.speeds, &physics)
            .series(format!("{} at its step", self.integrator), &self.speeds, &own, plot::Mark::Dashes);
        draw(folder, "multipliers", &drawn, !self.args.json)
    }
}

/// `at 3`, `from 3 to 5`.
pub(super) fn extent(speeds: &[f64]) -> String {
    let low = figure(speeds.iter().copied().fold(f64::INFINITY, f64::min));
    let high = figure(speeds.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    if low == high { format!("at {low}") } else { format!("from {low} to {high}") }
}

/// `3 modes are`, `1 mode is`.
fn are(count: usize, noun: &str) -> String {
    format!("{} {}", counted(count as u64, noun), if count == 1 { "is" } else { "are" })
}
