//! `stability`: the schemes on one mass, and a crank-slider at the extremes.

use std::io::Write;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap_complete::engine::ArgValueCompleter;

use super::aligned_table::figure;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::make_folder;
use super::output::output;
use super::progress::bar;
use super::signals::Interruption;
use super::trial_run::stands_still_s;
use super::values::count;
use super::written::draw;
use crate::plot;
use crate::scene::{IntegratorKind, ModelKind, Scene, SceneSource};
use crate::simulation::Simulation;
use crate::study::Table;
use crate::study::stability::{
    BOUND, BaseScene, Category, Extent, Label, MapPlan, Outcome, Point, ROUNDING, Scheme, Swept, causes, counts, fails_finer,
    fails_finer_table, labels, left_half_plane_table, order_table, radius_table, refusals, sweep, table, write_ends,
};

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank stability                                  spectral radius and order of every scheme, theory beside measured
  flexcrank stability crank-slider --quick             a thousand cells of the sweep, short runs
  flexcrank stability crank-slider --csv maps --plot maps   all of it: thousands of cells, some minutes
  flexcrank stability mine.toml --only stiffness --set rod.length_m=1.2

Each cell of a map is a run of the scene: . stable, w stable but wrong, D diverged, r refused. Wrong and diverged cells have \
    another letter where the scheme is not to blame: m and M, the mechanism itself makes small differences a thousand times as \
    large, as in a parametric resonance, so that no scheme stays right for long; l and L, the same model fails alike at fine \
    steps, by its mesh, its modes or its range; u and U, undecided. Wrong: a pin or the middle \
    of the rod is once too far from the same mechanism at another step by another scheme. Maps of damping, modes and mesh run \
    the scene as it stands against the same model; too far is 1 % of the method gone by then. The others run two elements a link \
    against 8 finite elements (rigid against rigid); too far is 1 % of crank and rod together. Where no reference reaches, 1 % \
    of the energy put in is too much for the energy balance; and a run is wrong when the model says that the links bend too \
    much for it. Scenes that run at one step and fail at the next finer one are listed. CSV files number the categories from 0 \
    in that order; cells.csv tells of every cell its label and growth, what was said and how to reach it again, finer-fails.csv holds that list.

Exit codes: 0 every cell ended cleanly, 1 some did not (a panic, a hang, a number that is not finite), 2 usage or bad scene, \
    130 interrupted: cells that were not run are blank, and number 7 in CSV; maps without a run are left out.";

/// Time limit of a cell, which only one that hangs exceeds.
const LIMIT: Duration = Duration::from_secs(600);
/// Values of ωh shown in the terminal; the CSV has all.
const SHOWN: [f64; 5] = [0.1, 1.0, 2.0, 3.0, 100.0];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A crank-slider (built-in scene or TOML file) to take to its extremes; both links have a section and a modulus. Default: the
    /// schemes on one mass.
    #[arg(add = ArgValueCompleter::new(completions::scenes))]
    pub scene: Option<String>,
    /// Also run the schemes on one mass.
    #[arg(long)]
    pub schemes: bool,
    /// A few values on each axis, and short runs.
    #[arg(long, requires = "scene")]
    pub quick: bool,
    /// Only maps whose names contain this.
    #[arg(long, value_name = "PART", requires = "scene")]
    pub only: Option<String>,
    /// Write every table to this folder. Tables of the same names are replaced.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Draw every map into this folder, as SVG and PNG.
    #[arg(long, value_name = "DIR")]
    pub plot: Option<PathBuf>,
    /// Number of cells to run at a time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = count)]
    pub jobs: Option<u64>,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scene")]
    pub overrides: Vec<String>,
}

pub(super) fn stability(args: &Args) -> CommandResult {
    // From here on, so that no signal leaves an empty folder.
    let interruption = Interruption::watch()?;
    let extent = if args.quick { Extent::Quick } else { Extent::Whole };
    let plan = args.scene.as_ref().map(|scene| plan(scene, args, extent)).transpose()?;
    interruption.keeps(plan.is_some());
    [&args.csv, &args.plot].into_iter().flatten().try_for_each(|folder| make_folder(folder))?;
    if args.schemes || plan.is_none() {
        schemes(args)?;
    }
    plan.map_or(Ok(ExitStatus::Success), |(base, plan)| extremes(&base, plan, args, &interruption))
}

fn plan(scene: &str, args: &Args, extent: Extent) -> CommandResult<(BaseScene, MapPlan)> {
    let source = SceneSource::open(scene, &args.overrides)?;
    let base = BaseScene::new(&source)?;
    let mut plan = MapPlan::extremes(&base, extent);
    plan.only(args.only.as_deref().unwrap_or_default())?;
    let still_s = still_until_s(&source.scene, extent.time_s());
    if still_s > 0.0 && plan.maps.iter().any(|map| !map.brings_motion()) {
        say!(
            "warning: nothing moves in {} before {} s: a run that ends before that is stable whatever its step. Most runs of a map cover \
             {} s, less with short steps, many modes or many elements, more with long steps. Maps of pulses, speeds and revolutions bring \
             a motion of their own; for the others, give it a pulse, a torque, a start rate or a [drive] that is there from the start",
            base.origin,
            figure(still_s),
            extent.time_s(),
        );
    }
    Ok((base, plan))
}

/// Time until which nothing moves in a scene, s, at most `until_s`. The thesis's method does not tell; its scene moves as with `modal`.
fn still_until_s(scene: &Scene, until_s: f64) -> f64 {
    let mut scene = scene.clone();
    if scene.solver.model == ModelKind::Incremental {
        (scene.solver.model, scene.solver.integrator) = (ModelKind::Modal, IntegratorKind::GeneralizedAlpha);
    }
    Simulation::new(&scene).map_or(0.0, |mut run| stands_still_s(&mut run, until_s)).min(until_s)
}

fn write(folder: Option<&Path>, name: &str, table: &Table) -> CommandResult<()> {
    Ok(folder.map_or(Ok(()), |folder| table.write_csv(&folder.join(format!("{name}.csv"))))?)
}

fn schemes(args: &Args) -> CommandResult<()> {
    let folder = args.csv.as_deref();
    let tenths = || (0..=10).map(|n| f64::from(n) / 10.0);
    let weights: Vec<Scheme> = tenths().chain([0.55]).map(Scheme::TwoPoint).collect();
    let rhos: Vec<Scheme> = tenths().map(Scheme::GeneralizedAlpha).collect();
    for (name, title, parameter, schemes) in [
        ("two-point", "two-point", "weight", weights),
        ("generalized-alpha", "generalized-alpha", "rho_infinity", rhos),
        ("runge-kutta", "runge-kutta", "", vec![Scheme::RungeKutta]),
        ("esdirk", "esdirk", "", vec![Scheme::Esdirk]),
    ] {
        let radii = radius_table(&schemes, &omegas_h())?;
        let orders = order_table(&schemes)?;
        let plane = left_half_plane_table(&schemes, &[Point::axes(100), Point::grid(10, 5)].concat())?;
        show_scheme(title, parameter, &schemes, &radii, &orders)?;
        show_left_half_plane(parameter, &schemes, &plane)?;
        write(folder, &format!("left-half-plane-{name}"), &plane)?;
        write(folder, &format!("spectral-radius-{name}"), &radii)?;
        write(folder, &format!("order-{name}"), &orders)?;
        let plane = plot::stability::left_half_plane(name, &plane);
        for (file, picture) in plot::stability::scheme(name, &radii, &orders).into_iter().chain([plane]) {
            args.plot.as_deref().map_or(Ok(()), |folder| draw(folder, &file, &*picture, false))?;
        }
    }
    Ok(())
}

/// From 0.01 to 100, with those shown in the terminal.
fn omegas_h() -> Vec<f64> {
    let mut omegas: Vec<f64> = (-20..=20).map(|n| 10.0_f64.powf(f64::from(n) / 10.0)).chain(SHOWN).collect();
    omegas.sort_by(f64::total_cmp);
    omegas.dedup_by(|one, other| (*one / *other - 1.0).abs() < 1e-9);
    omegas
}

/// Prints theory and measurement side by side at a few ωh, and the orders.
fn show_scheme(title: &str, parameter: &str, schemes: &[Scheme], radii: &Table, orders: &Table) -> CommandResult<()> {
    let mut out = output();
    let difference = radii.column("difference").unwrap_or_default().iter().fold(0.0, |most: f64, d| most.max(d.abs()));
    writeln!(out, "{title}: spectral radius as run (at most {difference:.1e} from theory), order")?;
    write!(out, "{parameter:>13}")?;
    for omega_h in SHOWN {
        write!(out, "  {:>8}", format!("ωh {omega_h}"))?;
    }
    writeln!(out, "  {:>13}", "order: theory")?;
    let [as_run_radii, omegas_h] = ["radius_as_run", "omega_h"].map(|name| radii.column(name).unwrap_or_default());
    let [in_theory, as_run] = ["order_in_theory", "order_as_run"].map(|name| orders.column(name).unwrap_or_default());
    let count = radii.rows() / schemes.len().max(1);
    for (n, scheme) in schemes.iter().enumerate() {
        write!(out, "{:>13}", scheme.parameter().map(|value| value.to_string()).unwrap_or_default())?;
        for shown in SHOWN {
            let row = (n * count..(n + 1) * count).find(|row| (omegas_h[*row] / shown - 1.0).abs() < 1e-9);
            let Some(row) = row else { continue };
            write!(out, "  {:>8}", short(as_run_radii[row]))?;
        }
        writeln!(out, "  {:>5.3} {:>7.1}", as_run[n], in_theory[n])?;
    }
    Ok(writeln!(out)?)
}

/// Prints the largest measured radius of every scheme on the left half-plane, and the conclusion.
fn show_left_half_plane(parameter: &str, schemes: &[Scheme], plane: &Table) -> CommandResult<()> {
    let mut out = output();
    writeln!(out, "{parameter:>13}  largest radius as run on the left half-plane, |z| from 1e-3 to 1e6")?;
    let [magnitudes, angles, radii] =
        ["magnitude", "angle_deg", "radius_as_run"].map(|name| plane.column(name).unwrap_or_default());
    let count = plane.rows() / schemes.len().max(1);
    for (n, scheme) in schemes.iter().enumerate() {
        let rows =
            || (n * count..(n + 1) * count).map(|row| (Point { magnitude: magnitudes[row], angle_deg: angles[row] }, radii[row]));
        let largest = |rows: &mut dyn Iterator<Item = (Point, f64)>| rows.map(|(_, radius)| radius).fold(0.0, f64::max);
        let all = largest(&mut rows());
        let within = largest(&mut rows().filter(|(at, _)| scheme.is_within(*at)));
        let from =
            rows().filter(|(_, radius)| *radius > 1.0 + ROUNDING).map(|(at, _)| at.magnitude).fold(f64::INFINITY, f64::min);
        let verdict = match (scheme, all <= 1.0 + ROUNDING) {
            (_, true) => "stable".to_owned(),
            (Scheme::RungeKutta, false) => {
                format!("stable within its region ({}), which |z| leaves from {} on", short(within), short(from))
            }
            (_, false) => "unstable".to_owned(),
        };
        writeln!(
            out,
            "{:>13}  {:>9}  {verdict}",
            scheme.parameter().map(|value| value.to_string()).unwrap_or_default(),
            short(all)
        )?;
    }
    Ok(writeln!(out)?)
}

fn short(value: f64) -> String {
    if value < 1000.0 { format!("{value:.4}") } else { format!("{value:.2e}") }
}

fn extremes(base: &BaseScene, plan: MapPlan, args: &Args, interruption: &Interruption) -> CommandResult {
    let bar = bar(plan.len() as u64, "{wide_bar} {pos}/{len} cells{left}");
    let jobs = args.jobs.and_then(|jobs| NonZero::new(usize::try_from(jobs).ok()?));
    let threads = jobs.or(std::thread::available_parallelism().ok()).unwrap_or(NonZero::<usize>::MIN);
    let swept = sweep(base, plan, threads, LIMIT, |done| {
        bar.set_position(done as u64);
        if interruption.is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    interruption.keeps(false);
    bar.finish_and_clear();
    show_legend(&swept)?;
    let begun = |map: &&Swept| map.outcomes.iter().any(|end| end.category != Category::NotRun);
    for map in swept.iter().filter(begun) {
        show_map(map)?;
        write(args.csv.as_deref(), &map.map.name, &table(map))?;
        let picture = plot::stability::swept(map);
        args.plot.as_deref().map_or(Ok(()), |folder| draw(folder, &map.map.name, &picture, false))?;
    }
    if let Some(folder) = &args.csv {
        write_ends(&folder.join("cells.csv"), &swept)?;
        fails_finer_table(&fails_finer(&swept)).write_csv(&folder.join("finer-fails.csv"))?;
    }
    show_fails_finer(&swept)?;
    conclude(&swept)
}

/// Prints the symbols that occur in the maps, with their meaning.
fn show_legend(swept: &[Swept]) -> CommandResult<()> {
    let ends = || swept.iter().flat_map(|map| &map.outcomes);
    let meaning = |end: &Outcome| match end.label {
        None | Some(Label::Scheme) => format!("{} {}", end.symbol(), end.category.as_str()),
        Some(label) => format!("{} {} {}", end.symbol(), end.category.as_str(), blamed(label.as_str())),
    };
    let mut known: Vec<(Category, String)> = ends().map(|end| (end.category, meaning(end))).collect();
    known.sort();
    known.dedup();
    let meanings: Vec<String> = known.into_iter().map(|(_, meaning)| meaning).collect();
    Ok(writeln!(output(), "Each character is a run: {}\n", meanings.join(", "))?)
}

/// Prints a map, one character per category, with the highest y on top, and the first divergence of each row.
fn show_map(swept: &Swept) -> CommandResult<()> {
    let mut out = output();
    let (map, columns) = (&swept.map, swept.map.x.values.len());
    let across: Vec<String> = map.x.values.iter().map(|value| map.x.shown(*value)).collect();
    writeln!(out, "{}: {}", map.name, map.title)?;
    writeln!(out, "  across: {}: {}", map.x.of.labelled(), across.join(", "))?;
    writeln!(out, "  upwards: {}", map.y.of.labelled())?;
    for (row, value) in map.y.values.iter().enumerate().rev() {
        let cells = swept.outcomes.iter().skip(row * columns).take(columns);
        let symbols: Vec<String> = cells.clone().map(|end| end.symbol().to_string()).collect();
        let diverged = cells.clone().find(|end| end.category == Category::Diverged);
        let first = diverged.map(|end| format!("   first diverged in step {}", end.step)).unwrap_or_default();
        writeln!(out, "{:>12}  {}{first}", map.y.shown(*value), symbols.join(" "))?;
    }
    Ok(writeln!(out)?)
}

/// Prints the scenes that run at one step and fail at the next finer one.
fn show_fails_finer(swept: &[Swept]) -> CommandResult<()> {
    let mut out = output();
    for one in fails_finer(swept) {
        let error = one.finer.error.map(|error| format!(", error {}", figure(error))).unwrap_or_default();
        writeln!(
            out,
            "{}: {} = {} runs at step {} s, and is {} at {} s{error}",
            one.map.name,
            one.map.y.of.words,
            figure(one.value),
            figure(one.step_s),
            one.finer.category.as_str(),
            figure(one.finer_step_s),
        )?;
    }
    Ok(())
}

/// A label in words.
fn blamed(label: &str) -> String {
    match label {
        "undecided" => label.to_owned(),
        "model" => "by the model, at fine steps too".to_owned(),
        _ => format!("by the {label}"),
    }
}

/// Prints why cells were refused: the reasons of a tenth of them or more, and how many have another.
fn show_refusals(out: &mut impl Write, refused: usize, swept: &[Swept]) -> CommandResult<()> {
    let mut others = 0;
    for (reason, count) in refusals(swept) {
        if 10 * count < refused {
            others += count;
        } else {
            writeln!(out, "{count:>16}  {reason}")?;
        }
    }
    if others > 0 {
        writeln!(out, "{others:>16}  other reasons: --csv writes each cell's to cells.csv")?;
    }
    Ok(())
}

fn conclude(swept: &[Swept]) -> CommandResult {
    let mut out = output();
    let counts = counts(swept);
    let total: usize = counts.iter().sum();
    writeln!(out, "{total} cells in {} maps (wrong: an error above {BOUND}):", swept.len())?;
    for (category, count) in Category::ALL.iter().zip(counts) {
        writeln!(out, "{count:>8}  {}", category.as_str())?;
        let labels = labels(swept, *category).into_iter().filter(|(_, count)| *count > 0);
        for (label, count) in labels {
            writeln!(out, "{count:>16}  {}", blamed(label))?;
        }
        let causes = causes(swept).into_iter().filter(|(_, count)| *category == Category::Diverged && *count > 0);
        for (cause, count) in causes {
            writeln!(out, "{count:>16}  {cause}")?;
        }
        if *category == Category::Refused {
            show_refusals(&mut out, count, swept)?;
        }
    }
    writeln!(out, "{:>8}  run at one step and fail at the next finer one", fails_finer(swept).len())?;
    let unclean =
        swept.iter().flat_map(|map| map.outcomes.iter().zip(&map.map.cells)).filter(|(end, _)| !end.category.is_clean());
    let mut bad = 0;
    for (end, cell) in unclean {
        bad += 1;
        say!("{}: {} (--set {})", end.category.as_str(), end.message, cell.overrides.join(" --set "));
    }
    if bad == 0 && counts[Category::NotRun.number()] > 0 {
        say_reason!("warning: interrupted: {} of {total} cells were not run", counts[Category::NotRun.number()]);
        return Ok(ExitStatus::Interrupted);
    }
    if bad > 0 { Err(Failure::Failed(format!("{bad} of {total} cells did not end cleanly"))) } else { Ok(ExitStatus::Success) }
}
