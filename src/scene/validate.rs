//! Validation: raw structs become the typed scene. Every range and every rule between keys is checked here.

use super::table::ascending;
use super::{SceneError, check::Checker, document::SceneText, keys, level, link, oscillator, raw, types::*};
use keys::{INTEGRATORS, MODELS, SHAPES};

pub(super) fn validate(raw: &raw::Scene, text: &SceneText) -> Result<Scene, SceneError> {
    let check = Checker::new(text);
    check.conclude(scene(&check, raw))
}

/// Checks every table, and the rules between keys. A refused value is replaced by one that breaks no rule.
fn scene(check: &Checker, raw: &raw::Scene) -> Result<Scene, SceneError> {
    let alone = oscillator::alone(check, raw);
    let solver = solver(check, raw, alone.is_ok());
    let drive = check.noted(drive(check, raw)).unwrap_or(Drive::Torque { constant_nm: 0.0, pulses: Vec::new() });
    let levels = check.noted(level::levels(check, &raw.level)).unwrap_or_default();
    let commands = commands(check, &raw.commands);
    alone?;
    let system = match &raw.oscillator {
        Some(oscillator) => System::Oscillator(oscillator::oscillator(check, oscillator)?),
        None => System::Chain(chain(check, raw, solver.model)),
    };
    Ok(Scene { system, drive, commands, solver, levels })
}

fn chain(check: &Checker, raw: &raw::Scene, model: ModelKind) -> Chain {
    let given = check.noted(links(check, raw)).unwrap_or_default();
    let links: Vec<Link> = given.into_iter().map(|(name, link)| link::link(check, name, link, model)).collect();
    let end = check.noted(end(check, raw, links.len())).unwrap_or(End::Free { tip_mass_kg: 0.0 });
    let chain = Chain {
        links,
        end,
        base: Base {
            torsion_spring_nm_per_rad: check.number_or(&keys::BASE_SPRING, "base", raw.base.torsion_spring_nm_per_rad),
            damper_nm_s_per_rad: check.number_or(&keys::BASE_DAMPER, "base", raw.base.damper_nm_s_per_rad),
        },
        gravity_m_per_s2: [
            check.number_or(&keys::GRAVITY_X, "gravity", raw.gravity.x_m_per_s2),
            check.number_or(&keys::GRAVITY_Y, "gravity", raw.gravity.y_m_per_s2),
        ],
        start: Start {
            angle_rad: check.number_or(&keys::START_ANGLE, "start", raw.start.angle_rad),
            rate_rad_per_s: check.number_or(&keys::START_RATE, "start", raw.start.rate_rad_per_s),
            static_equilibrium: raw.start.static_equilibrium.unwrap_or(keys::STATIC_EQUILIBRIUM.default),
        },
    };
    if let Some((key, problem)) = short_rod(check, &chain) {
        check.note(|| check.refuse(key, problem));
    }
    if let Some(problem) = bad_equilibrium(raw, &chain, model) {
        check.note(|| check.refuse("start.static_equilibrium", problem));
    }
    chain
}

/// The links of a chain.
///
/// # Errors
/// The refusal of tables that make no chain.
fn links<'a>(check: &Checker, raw: &'a raw::Scene) -> Result<Vec<(LinkName, &'a raw::Link)>, SceneError> {
    match (&raw.crank, &raw.rod, &raw.beam) {
        (Some(crank), Some(rod), None) => Ok(vec![(LinkName::Crank, crank), (LinkName::Rod, rod)]),
        (None, None, Some(beam)) => Ok(vec![(LinkName::Beam, beam)]),
        (None, Some(_), None) => Err(check.refuse("rod", "a [rod] needs a [crank]")),
        (Some(_), None, None) => Err(check.refuse("crank", "a [crank] needs a [rod]; a single link is a [beam]")),
        (None, None, None) => Err(check.refuse("", "no links: give [crank] and [rod], or one [beam]")),
        _ => {
            let problem = "a [beam] stands alone: give [crank] and [rod], or one [beam]";
            Err(check.refuse_one_table_of("beam", &["crank", "rod"], problem))
        }
    }
}

/// The end of a chain of this number of links, which is 0 if they were refused.
fn end(check: &Checker, raw: &raw::Scene, links: usize) -> Result<End, SceneError> {
    match (&raw.slider, &raw.tip) {
        (Some(_), Some(_)) => {
            Err(check.refuse_one_table_of("tip", &["slider"], "the chain ends in a [slider] or in a [tip], not both"))
        }
        (Some(_), None) if links == 1 => Err(check.refuse("slider", "a [slider] needs a [crank] and a [rod]")),
        (Some(slider), None) => Ok(End::Slider(Slider {
            mass_kg: check.number_or(&keys::SLIDER_MASS, "slider", slider.mass_kg),
            friction_n_s_per_m: check.number_or(&keys::FRICTION, "slider", slider.friction_n_s_per_m),
            resistance: check.noted(resistance(check, slider)).unwrap_or(Resistance::Constant(f64::NAN)),
        })),
        (None, Some(tip)) => Ok(End::Free { tip_mass_kg: check.number_or(&keys::TIP_MASS, "tip", tip.mass_kg) }),
        (None, None) => Ok(End::Free { tip_mass_kg: 0.0 }),
    }
}

fn resistance(check: &Checker, slider: &raw::Slider) -> Result<Resistance, SceneError> {
    let Some(table) = &slider.resistance_table else {
        return Ok(Resistance::Constant(check.number_or(&keys::RESISTANCE, "slider", slider.resistance_n)));
    };
    let key = "slider.resistance_table";
    if slider.resistance_n.is_some() {
        return Err(check.refuse_one_of(key, &["slider.resistance_n"], "give resistance_n or resistance_table, not both"));
    }
    let problem_of = |[angle, force]: [f64; 2]| {
        let is_allowed = (0.0..std::f64::consts::TAU).contains(&angle) && keys::RESISTANCE.allows(force);
        let range = keys::RESISTANCE.range();
        (!is_allowed).then(|| format!("angles must be in radians, from 0 to below 2π (6.2831…), and forces from {range} N"))
    };
    Ok(Resistance::Table(ascending(check, key, table, problem_of)?))
}

fn drive(check: &Checker, raw: &raw::Scene) -> Result<Drive, SceneError> {
    let Some(drive) = &raw.drive else { return Ok(torque(check, raw)) };
    // A constant torque of 0 is none.
    let has_torque = raw.torque.as_ref().is_some_and(|torque| torque.constant_nm != Some(0.0));
    if !raw.pulse.is_empty() || has_torque {
        let changes = [("pulse", !raw.pulse.is_empty(), "pulse=[]"), ("torque", has_torque, "torque.constant_nm=0")];
        let given = changes.into_iter().filter(|(_, is_given, _)| *is_given);
        let (tables, changes): (Vec<&str>, Vec<&str>) = given.map(|(table, _, change)| (table, change)).unzip();
        let is_way = check.is_added("drive") && tables.into_iter().all(|table| check.is_of_scene(table));
        let way = format!("; to drop the torque, set {} as well", changes.join(" and "));
        let way = if is_way { way } else { String::new() };
        let problem = format!("prescribed motion leaves no room for torque: drop [drive], or [[pulse]] and [torque]{way}");
        check.note(|| check.refuse_one_of("drive", &["torque", "pulse"], &problem));
        torque(check, raw);
    }
    let motion = match (&drive.speed_rad_per_s, &drive.ramp, &drive.table) {
        (Some(speed), None, None) => {
            if raw.start.rate_rad_per_s.is_some_and(|rate| rate != *speed) {
                let problem = format!(
                    "contradicts drive.speed_rad_per_s = {speed:?}, which prescribes the rate: leave it out, or give the same rate"
                );
                check.note(|| check.refuse("start.rate_rad_per_s", problem));
            }
            Motion::Speed(check.number(&keys::DRIVE_SPEED, "drive", *speed))
        }
        (None, Some(ramp), None) => Motion::Ramp {
            to_rad_per_s: check.number_or(&keys::RAMP_TO, "drive.ramp", ramp.to_rad_per_s),
            over_s: check.number_or(&keys::RAMP_OVER, "drive.ramp", ramp.over_s),
        },
        (None, None, Some(table)) => {
            let given = [("start.angle_rad", raw.start.angle_rad), ("start.rate_rad_per_s", raw.start.rate_rad_per_s)];
            for (key, _) in given.into_iter().filter(|(_, value)| value.is_some()) {
                let is_way = check.is_to_blame("drive", key);
                let way = if is_way { "; to leave out all of [start], set start={} as well" } else { "" };
                let problem = format!("drive.table prescribes angle and rate from the start on: leave it out{way}");
                check.note(|| check.refuse(key, problem));
            }
            Motion::Table(ascending(check, "drive.table", table, |_| None)?)
        }
        _ => {
            let motions = ["drive.speed_rad_per_s", "drive.ramp", "drive.table"];
            let is_added = !check.is_added("drive") && motions.iter().any(|motion| check.is_added(motion));
            let way = if is_added { "; to replace the motion that the scene has, set drive={…}" } else { "" };
            let problem = format!("give exactly one of speed_rad_per_s, ramp, table{way}");
            return Err(check.refuse_one_of("drive", &motions, &problem));
        }
    };
    Ok(Drive::Motion(motion))
}

fn torque(check: &Checker, raw: &raw::Scene) -> Drive {
    let pulse = |(index, pulse): (usize, &raw::Pulse)| {
        let table = format!("pulse.{index}");
        Pulse {
            start_s: check.number_or(&keys::PULSE_START, &table, pulse.start_s),
            torque_nm: check.number_or(&keys::PULSE_TORQUE, &table, pulse.torque_nm),
            duration_s: check.number_or(&keys::PULSE_DURATION, &table, pulse.duration_s),
            shape: check.word_or(&format!("{table}.shape"), pulse.shape.as_deref(), &SHAPES, SHAPES[0].1),
        }
    };
    let constant = |torque: &raw::Torque| check.number_or(&keys::CONSTANT_TORQUE, "torque", torque.constant_nm);
    let pulses = raw.pulse.iter().enumerate().map(pulse).collect();
    Drive::Torque { constant_nm: raw.torque.as_ref().map_or(0.0, constant), pulses }
}

fn commands(check: &Checker, raw: &raw::Commands) -> Commands {
    Commands {
        torque_limit_nm: check.number_or(&keys::TORQUE_LIMIT, "commands", raw.torque_limit_nm),
        pending_limit: check.count_or(&keys::PENDING_LIMIT, "commands", raw.pending_limit),
    }
}

/// The refusal of a model that does not exist.
pub(super) fn unknown_model(text: &SceneText, raw: &raw::Scene) -> Option<SceneError> {
    named_model(&Checker::new(text), &raw.solver).err()
}

fn named_model(check: &Checker, raw: &raw::Solver) -> Result<Option<ModelKind>, SceneError> {
    raw.model.as_deref().map(|word| check.word("solver.model", word, &MODELS)).transpose()
}

/// The model that the scene names, or the usual one; `None` if it is refused, or does not suit the mechanism. It may suit any
/// mechanism that is not known.
fn model(check: &Checker, raw: &raw::Scene, is_known: bool) -> Option<ModelKind> {
    let oscillator = raw.oscillator.is_some();
    let usual = if oscillator { ModelKind::MassSpring } else { ModelKind::Modal };
    let model = check.noted(named_model(check, &raw.solver))?.unwrap_or(usual);
    let suits = oscillator == (model == ModelKind::MassSpring);
    if is_known && !suits {
        check.note(|| check.refuse("solver.model", "mass-spring goes with an [oscillator], and nothing else does"));
    }
    suits.then_some(model)
}

/// The integrator given, or the usual one of the model, which also stands in for one that does not suit the model.
fn integrator(check: &Checker, given: Option<IntegratorKind>, model: ModelKind) -> IntegratorKind {
    let usual = model.usual_integrator();
    let integrator = given.unwrap_or(usual);
    if model.integrators().contains(&integrator) {
        return integrator;
    }
    let suits: Vec<&str> = model.integrators().iter().map(|kind| kind.as_str()).collect();
    check.note(|| check.refuse("solver.integrator", format!("{} goes with {} only", model.as_str(), suits.join(", "))));
    usual
}

/// Checks the solver of a mechanism, which is not known if its tables do not go together.
fn solver(check: &Checker, scene: &raw::Scene, is_known: bool) -> Solver {
    let raw = &scene.solver;
    // Stands in for a refused model: it needs fewer keys of links than any other, so that no refusal follows from it.
    let least = if scene.oscillator.is_some() { ModelKind::MassSpring } else { ModelKind::Rigid };
    let named = model(check, scene, is_known);
    let model = named.unwrap_or(least);
    let word = raw.integrator.as_deref().map(|word| check.word("solver.integrator", word, &INTEGRATORS));
    let given = check.noted(word.transpose());
    let solver = Solver {
        model,
        integrator: integrator(check, given.flatten(), model),
        step_s: check.number_or(&keys::STEP, "solver", raw.step_s),
        weight: check.number_or(&keys::WEIGHT, "solver", raw.weight),
        rho_infinity: check.number_or(&keys::RHO_INFINITY, "solver", raw.rho_infinity),
        tolerance: check.number_or(&keys::TOLERANCE, "solver", raw.tolerance),
        balance_tolerance: check.number_or(&keys::BALANCE_TOLERANCE, "solver", raw.balance_tolerance),
        max_iterations: check.count_or(&keys::MAX_ITERATIONS, "solver", raw.max_iterations),
        corrections: raw.corrections.and_then(|count| check.count(&keys::CORRECTIONS, "solver", count)),
    };
    // Whether steps are solved by iteration is known of a known model and integrator alone.
    if let (Some(_), Some(_), Some(problem)) = (named, given, bad_corrections(&solver)) {
        check.note(|| check.refuse("solver.corrections", problem));
    }
    solver
}

/// The problem of a rod that is too short for its crank, and the key to blame.
fn short_rod(check: &Checker, chain: &Chain) -> Option<(&'static str, String)> {
    let (End::Slider(_), [crank, rod]) = (&chain.end, chain.links.as_slice()) else { return None };
    let keys = ["crank.length_m", "rod.length_m"];
    let refused = || match check.is_to_blame(keys[0], keys[1]) {
        true => (keys[0], format!("must be shorter than rod.length_m = {:?}, or the crank cannot turn", rod.length_m)),
        false => (keys[1], format!("must be longer than crank.length_m = {:?}, or the crank cannot turn", crank.length_m)),
    };
    (rod.length_m <= crank.length_m).then(refused)
}

/// The problem of a chain that is asked to start in static equilibrium, and cannot.
fn bad_equilibrium(raw: &raw::Scene, chain: &Chain, model: ModelKind) -> Option<&'static str> {
    let is_open = raw.slider.is_none() && chain.links.len() > 1;
    let problem = if is_open {
        "the second link of an open chain swings: static equilibrium is for a beam or a crank-slider"
    } else if model == ModelKind::Incremental {
        "the incremental model starts with straight links: use modal, finite-element or rigid"
    } else {
        return None;
    };
    chain.start.static_equilibrium.then_some(problem)
}

/// Why a step of fixed cost cannot have this many corrections.
fn bad_corrections(solver: &Solver) -> Option<String> {
    let method = if solver.model == ModelKind::Incremental { solver.model.as_str() } else { solver.integrator.as_str() };
    match (solver.corrections?, solver.iterates()) {
        (0, true) => {
            Some(format!("{method} solves its steps by iteration: must be a whole number from 1 to {}", keys::CORRECTIONS.high))
        }
        (1.., false) => Some(format!("{method} does not iterate: must be 0")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::SceneSource;

    /// The lines of a refusal of a scene with overrides.
    fn refusals(scene: &str, overrides: &[&str]) -> Vec<String> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        let refused = SceneSource::open(scene, &overrides).err().map(|refused| refused.in_full()).unwrap_or_default();
        refused.lines().map(|line| line.trim().to_owned()).collect()
    }

    /// `--set` cannot leave a key of the scene out, and 0 contradicts the drive, too.
    #[test]
    fn regress_a_start_that_contradicts_a_drive_that_was_given_names_a_way() {
        assert!(refusals("ref-r4m", &["drive={table=[[0.0,0.5],[1.0,1.0]]}"]).concat().contains("set start={} as well"));
        assert!(refusals("ref-r4m", &["drive={table=[[0.0,0.5],[1.0,1.0]]}", "start={}"]).is_empty());
        assert!(refusals("ref-r4m", &["drive.speed_rad_per_s=25"]).concat().ends_with("leave it out, or give the same rate"));
        assert!(refusals("ref-r4m", &["drive.speed_rad_per_s=25", "start.rate_rad_per_s=25"]).is_empty());
    }

    /// They were refused one by one, and only once every value was in its range.
    #[test]
    fn regress_mistakes_between_keys_are_refused_with_all_others() {
        let given = ["slider.mass_kg=-1", "solver.model=incremental", "solver.corrections=2"];
        let more = ["rod.rigid=true", "start.static_equilibrium=true"];
        let incremental = "the incremental model is the thesis's: flexible links, one element each";
        let straight = "the incremental model starts with straight links: use modal, finite-element or rigid";
        let expected = [
            format!("--set start.static_equilibrium=true: start.static_equilibrium = true: {straight}"),
            format!("crank-slider:9: crank.elements = 4: {incremental}"),
            format!("--set rod.rigid=true: rod.rigid = true: {incremental}"),
            format!("crank-slider:19: rod.elements = 4: {incremental}"),
            "--set slider.mass_kg=-1: slider.mass_kg = -1: must be a number from 0 to 1e9".to_owned(),
            "--set solver.corrections=2: solver.corrections = 2: incremental does not iterate: must be 0".to_owned(),
            "crank-slider:36: solver.integrator = \"esdirk\": incremental goes with two-point only".to_owned(),
        ];
        assert_eq!(refusals("crank-slider", &[&given[..], &more].concat()), expected);
        for (scene, given, mistakes) in [
            ("crank-slider", ["slider.mass_kg=-1", "solver.model=mass-spring"], ["slider.mass_kg = -1", "mass-spring goes"]),
            ("crank-slider", ["base.damper_nm_s_per_rad=-1", "rod.area_m2=1"], ["damper_nm_s_per_rad = -1", "give section, or"]),
            ("crank-slider", ["gravity.x_m_per_s2=inf", "beam.modes=3"], ["x_m_per_s2 = inf", "instead of [beam]"]),
            ("thesis-two-masses", ["oscillator.forces_n=[1]", "oscillator.start_m=[1]"], ["forces_n = [1]", "start_m = [1]"]),
        ] {
            let refused = refusals(scene, &given);
            assert!(refused.len() == 2 && mistakes.iter().all(|mistake| refused.concat().contains(mistake)), "{refused:?}");
        }
    }

    #[test]
    fn regress_a_link_of_nothing_is_refused_with_all_that_it_lacks() {
        let text = "[crank]\nlength_m = 0.5\n[rod]\nlength_m = 0.4\n[slider]\n";
        let refused = SceneSource::parse("scene.toml", text, &[]).err().map(|refused| refused.in_full()).unwrap_or_default();
        let missing = |link: &str| {
            let keys = ["s `area_m2` and `second_moment_m4` (or `section`)", " `density_kg_per_m3`", " `youngs_modulus_pa`"];
            keys.map(|key| format!("scene.toml:{link}: missing key{key}"))
        };
        let short = "scene.toml:4: rod.length_m = 0.4: must be longer than crank.length_m = 0.5, or the crank cannot turn";
        let expected = [&missing("1: crank")[..], &missing("3: rod"), &[short.to_owned()]].concat();
        assert_eq!(refused, expected.join("\n  "));
    }

    /// Words that the program does not know, numbers out of range, and ends in doubt break no rule.
    #[test]
    fn prop_a_refused_value_breaks_no_rule() {
        for given in [
            &["solver.integrator=rungekutta", "solver.corrections=0"][..],
            &["solver.model=rigd", "solver.corrections=0"],
            &["solver.corrections=1000"],
            &["solver.model=mass-spring", "solver.corrections=0"],
            &["crank.length_m=1e9"],
            &["solver.model=incremental", "solver.integrator=two-point", "crank.elements=0", "rod.elements=1"],
            &["slider.resistance_n=1", "slider.resistance_table=[[0, 0], [1, 1]]", "start.static_equilibrium=true"],
            &["tip.mass_kg=1", "start.static_equilibrium=true"],
        ] {
            assert_eq!(refusals("crank-slider", given).len(), 1, "{given:?}: {:?}", refusals("crank-slider", given));
        }
    }
}
