//! Modes along a sweep: their table, their ranges and crossings, their diagram.

use std::io::Write as _;

use super::aligned_table::{figure, print};
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::mode_figures::{damping, hertz};
use super::output::output;
use super::signals::Interruption;
use crate::plot;
use crate::small_motion::{Branch, Mode, NoModes, OtherKind, crossings, follow, other_kinds};
use crate::study::Table;
use crate::study::trade::INTERRUPTED;

/// Lowest orders of the crank's speed in a Campbell diagram.
const ORDERS: usize = 6;

/// The quantity along a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Along {
    Angle,
    Speed,
}

/// Points and the modes found there.
pub(super) struct Swept {
    pub along: Along,
    /// The other quantity, the same at every point, if it was given: rad/s along angles, degrees along speeds.
    pub other: Option<f64>,
    /// Degrees or rad/s.
    pub values: Vec<f64>,
    /// The modes of each point; empty where there are none, or the point was not reached.
    pub modes: Vec<Vec<Mode>>,
    /// Whether each point was asked for; others lie between, to follow modes by.
    pub asked: Vec<bool>,
    pub refusals: Vec<(f64, NoModes)>,
}

impl Swept {
    fn unit(&self) -> (&'static str, &'static str) {
        match self.along {
            Along::Angle => ("angle_deg", "°"),
            Along::Speed => ("speed_rad_per_s", " rad/s"),
        }
    }

    /// The column of the other quantity.
    fn other_name(&self) -> &'static str {
        match self.along {
            Along::Angle => "speed_rad_per_s",
            Along::Speed => "angle_deg",
        }
    }

    /// The other quantity in words; nothing if it was not given.
    pub(super) fn beside(&self) -> String {
        match (self.other, self.along) {
            (None, _) => String::new(),
            (Some(speed), Along::Angle) => format!(", turning at {} rad/s", figure(speed)),
            (Some(angle), Along::Speed) => format!(", at {}°", figure(angle)),
        }
    }

    /// Follows the modes, at most `count`, and drops the points between.
    pub(super) fn follow(&mut self, count: usize) -> Vec<Branch> {
        let mut branches = follow(&self.modes);
        fn keep<T>(list: &mut Vec<T>, asked: &[bool]) {
            let mut asked = asked.iter();
            list.retain(|_| asked.next().is_none_or(|asked| *asked));
        }
        keep(&mut self.values, &self.asked);
        keep(&mut self.modes, &self.asked);
        branches.iter_mut().for_each(|branch| keep(&mut branch.places, &self.asked));
        branches.retain(|branch| branch.places.iter().any(Option::is_some));
        branches.truncate(count);
        branches
    }

    /// A branch's modes with their points.
    fn along<'a>(&'a self, branch: &'a Branch) -> impl Iterator<Item = (f64, &'a Mode)> {
        let points = branch.places.iter().zip(&self.modes).zip(&self.values);
        points.filter_map(|((place, modes), value)| Some((*value, modes.get((*place)?)?)))
    }

    /// Every branch at every point, by points, with the other quantity in a column of its own if it was given.
    pub(super) fn table(&self, branches: &[Branch]) -> Table {
        let mut words: [Vec<String>; 3] = Default::default();
        let mut numbers: [Vec<f64>; 7] = Default::default();
        for (point, value) in self.values.iter().enumerate() {
            for branch in branches {
                let place = branch.places.get(point).copied().flatten();
                let Some(mode) = place.and_then(|place| self.modes[point].get(place)) else { continue };
                let first = mode.shares.first();
                let row = [branch.name.clone(), mode.name(), first.map(|share| share.part.to_string()).unwrap_or_default()];
                words.iter_mut().zip(row).for_each(|(column, cell)| column.push(cell));
                let row = [
                    *value,
                    mode.frequency_hz(),
                    mode.damping_ratio(),
                    mode.eigenvalue.re,
                    mode.eigenvalue.im,
                    mode.rigid_part,
                    first.map_or(f64::NAN, |share| share.share),
                ];
                numbers.iter_mut().zip(row).for_each(|(column, cell)| column.push(cell));
            }
        }
        let mut table = Table::default();
        for (name, column) in ["mode", "mode_here", "part"].into_iter().zip(words) {
            table.push_words(name, column);
        }
        let names = [
            self.unit().0,
            "frequency_hz",
            "damping_ratio",
            "eigenvalue_re_per_s",
            "eigenvalue_im_per_s",
            "rigid_part",
            "part_share",
        ];
        let other = self.other.map(|other| (self.other_name(), vec![other; numbers[0].len()]));
        let mut columns: Vec<(&str, Vec<f64>)> = names.into_iter().zip(numbers).collect();
        columns.splice(1..1, other);
        columns.into_iter().for_each(|(name, column)| table.push(name, column));
        if self.not_reached() > 0 {
            table.push(INTERRUPTED, vec![1.0; table.rows()]);
        }
        table
    }

    /// Number of points that an interruption left out.
    fn not_reached(&self) -> usize {
        self.modes.iter().filter(|modes| modes.is_empty()).count().saturating_sub(self.refusals.len())
    }

    /// Prints lowest and highest frequency of every branch, and what happens to them on the way.
    pub(super) fn show(&self, target: &str, branches: &[Branch]) -> CommandResult<()> {
        let (_, unit) = self.unit();
        let ends = [self.values.first(), self.values.last()].map(|end| figure(end.copied().unwrap_or_default()));
        let (points, beside) = (self.values.len(), self.beside());
        let left_out = match self.not_reached() {
            0 => String::new(),
            left => format!("; interrupted: {left} of them were not looked at"),
        };
        writeln!(output(), "{target}: {points} points from {}{unit} to {}{unit}{beside}{left_out}", ends[0], ends[1])?;
        let columns = ["mode", "lowest Hz", "at", "highest Hz", "at", "most damping", "at"];
        let mut rows = vec![columns.map(str::to_owned).to_vec()];
        for branch in branches {
            let by_frequency = |one: &(f64, &Mode), other: &(f64, &Mode)| one.1.frequency_hz().total_cmp(&other.1.frequency_hz());
            let (Some(low), Some(high)) = (self.along(branch).min_by(by_frequency), self.along(branch).max_by(by_frequency))
            else {
                continue;
            };
            let at = |value: f64| format!("{}{unit}", figure(value));
            // The ratio of whatever only decays is 1.
            let by_damping = |one: &Mode, other: &Mode| {
                let decay = other.eigenvalue.re.total_cmp(&one.eigenvalue.re);
                one.damping_ratio().total_cmp(&other.damping_ratio()).then(decay)
            };
            let most = self.along(branch).max_by(|one, other| by_damping(one.1, other.1));
            let most = most.filter(|(_, mode)| !mode.grows() && mode.eigenvalue.norm() > 0.0);
            let damped = most.map(|(value, mode)| [damping(&mode.into()), at(value)]);
            let damped = damped.unwrap_or_else(|| ["–", "–"].map(str::to_owned));
            let [lowest, highest] = [low, high].map(|(value, mode)| [hertz(&mode.into()), at(value)]);
            rows.push([vec![branch.name.clone()], lowest.to_vec(), highest.to_vec(), damped.to_vec()].concat());
        }
        print(&rows, 1)?;
        self.show_events(branches)
    }

    /// Prints where a branch grows, and how fast at most.
    fn show_growth(&self, branch: &Branch) -> CommandResult<()> {
        let (_, unit) = self.unit();
        let mode = |point: usize| self.modes[point].get(branch.places.get(point).copied().flatten()?);
        let growing: Vec<usize> = (0..self.modes.len()).filter(|point| mode(*point).is_some_and(Mode::grows)).collect();
        let rate = |point: &usize| mode(*point).map_or(0.0, |mode| mode.eigenvalue.re);
        let Some(fastest) = growing.iter().copied().max_by(|one, other| rate(one).total_cmp(&rate(other))) else {
            return Ok(());
        };
        let stretches: Vec<String> = rows(&growing).into_iter().map(|row| self.stretch(row)).collect();
        let (stretches, rate, at) = (stretches.join(", "), figure(rate(&fastest)), figure(self.values[fastest]));
        Ok(writeln!(output(), "  {} grows {stretches}, at most as e^({rate}t) at {at}{unit}", branch.name)?)
    }

    /// Prints where branches grow, cross, are lost, or are modes of another kind than at their beginning.
    fn show_events(&self, branches: &[Branch]) -> CommandResult<()> {
        let (_, unit) = self.unit();
        branches.iter().try_for_each(|branch| self.show_growth(branch))?;
        for crossing in crossings(&self.modes, branches) {
            let [one, other] = crossing.branches.map(|branch| branches[branch].name.as_str());
            let [from, to] = [0, 1].map(|ahead| figure(self.values[crossing.after + ahead]));
            writeln!(output(), "  {one} crosses {other} between {from}{unit} and {to}{unit}")?;
        }
        for branch in branches {
            for (after, places) in branch.places.windows(2).enumerate() {
                if places[0].is_some() != places[1].is_some()
                    && self.modes[after..after + 2].iter().all(|modes| !modes.is_empty())
                {
                    let [from, to] = [0, 1].map(|ahead| figure(self.values[after + ahead]));
                    let name = &branch.name;
                    writeln!(
                        output(),
                        "  {name} cannot be followed between {from}{unit} and {to}{unit}: take smaller steps, unless a vibration ends there, becomes a growth and a decay, or nothing brings it back"
                    )?;
                }
            }
        }
        for OtherKind { branch, title, runs } in other_kinds(&self.modes, branches) {
            let runs: Vec<String> = runs.iter().map(|run| self.stretch(*run)).collect();
            writeln!(output(), "  the branch that begins as {} is {title} {}", branches[branch].name, runs.join(", "))?;
        }
        Ok(())
    }

    /// The points of a row in words.
    fn stretch(&self, [first, last]: [usize; 2]) -> String {
        let (_, unit) = self.unit();
        let [from, to] = [first, last].map(|point| figure(self.values[point]));
        if first == last { format!("at {from}{unit}") } else { format!("from {from}{unit} to {to}{unit}") }
    }

    /// The frequencies along the sweep; over speed, with the orders of the crank.
    pub(super) fn pictures(&self, branches: &[Branch]) -> Vec<(String, plot::Figure)> {
        let (name, title, x) = match self.along {
            Along::Angle => ("frequencies", "Natural frequencies over the crank's angle", plot::Axis::new("crank angle", "°")),
            Along::Speed => ("campbell", "Campbell diagram", plot::Axis::new("crank speed", "rad/s")),
        };
        let mut drawn = plot::Figure::new(title, x, plot::Axis::new("frequency", "Hz"));
        let mut highest = 0.0_f64;
        let others = other_kinds(&self.modes, branches);
        for (number, branch) in branches.iter().enumerate() {
            // The whole branch has the name of its beginning.
            let elsewhere = others.iter().filter(|other| other.branch == number);
            let elsewhere: String = elsewhere.map(|other| format!(", in places {}", other.title)).collect();
            let (values, hertz): (Vec<f64>, Vec<f64>) =
                self.along(branch).map(|(value, mode)| (value, mode.frequency_hz())).unzip();
            highest = hertz.iter().fold(highest, |most, hz| most.max(*hz));
            drawn = drawn.line(format!("{}{elsewhere}", branch.name), &values, &hertz);
        }
        if self.along == Along::Speed {
            for order in 1..=ORDERS {
                let hertz: Vec<f64> =
                    self.values.iter().map(|speed| order as f64 * speed.abs() / std::f64::consts::TAU).collect();
                let within: Vec<f64> = hertz.iter().map(|hz| if *hz <= highest { *hz } else { f64::NAN }).collect();
                drawn = drawn.series(format!("order {order}"), &self.values, &within, plot::Mark::Dashes);
            }
        }
        vec![(name.to_owned(), drawn)]
    }

    pub(super) fn conclude(&self, interruption: &Interruption) -> CommandResult {
        let done = self.modes.iter().filter(|modes| !modes.is_empty()).count();
        let (_, unit) = self.unit();
        for (value, refusal) in &self.refusals {
            say!("warning: at {}{unit}: {refusal}", figure(*value));
        }
        if interruption.is_asked() && done + self.refusals.len() < self.values.len() {
            say_reason!("warning: interrupted: {done} of {} points were done", self.values.len());
            return Ok(ExitStatus::Interrupted);
        }
        if self.refusals.is_empty() {
            Ok(ExitStatus::Success)
        } else {
            Err(Failure::Failed(format!("no modes were found at {} of {} points", self.refusals.len(), self.values.len())))
        }
    }
}

/// The first and the last of every row of numbers that follow one another.
fn rows(numbers: &[usize]) -> Vec<[usize; 2]> {
    let rows = numbers.chunk_by(|one, next| one + 1 == *next);
    rows.filter_map(|row| Some([*row.first()?, *row.last()?])).collect()
}
