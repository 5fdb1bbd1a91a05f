//! Validation: raw structs become the typed scene. Every range and every rule between keys is checked here.

use super::table::{ascending, shown_row};
use super::{SceneError, check::Checker, document::SceneText, keys, level, link, oscillator, raw, types::*};
use keys::{INTEGRATORS, MODELS, SHAPES};

pub(super) fn validate(raw: &raw::Scene, text: &SceneText) -> Result<Scene, SceneError> {
    let check = Checker::new(text);
    let scene = check.conclude(tables(&check, raw))?;
    rules(&check, &scene)?;
    Ok(scene)
}

/// Checks every table by itself.
fn tables(check: &Checker, raw: &raw::Scene) -> Result<Scene, SceneError> {
    let solver = solver(check, &raw.solver, raw.oscillator.is_some());
    let drive = check.noted(drive(check, raw)).unwrap_or(Drive::Torque { constant_nm: 0.0, pulses: Vec::new() });
    let levels = check.noted(level::levels(check, &raw.level)).unwrap_or_default();
    let commands = commands(check, &raw.commands);
    if raw.oscillator.is_some() {
        oscillator::alone(check, raw)?;
    }
    let solver = solver?;
    let system = match &raw.oscillator {
        Some(oscillator) => System::Oscillator(oscillator::oscillator(check, oscillator)?),
        None => System::Chain(chain(check, raw, solver.model)?),
    };
    Ok(Scene { system, drive, commands, solver, levels })
}

fn chain(check: &Checker, raw: &raw::Scene, model: ModelKind) -> Result<Chain, SceneError> {
    let links = match (&raw.crank, &raw.rod, &raw.beam) {
        (Some(crank), Some(rod), None) => vec![(LinkName::Crank, crank), (LinkName::Rod, rod)],
        (None, None, Some(beam)) => vec![(LinkName::Beam, beam)],
        (None, Some(_), None) => return Err(check.refuse("rod", "a [rod] needs a [crank]")),
        (Some(_), None, None) => return Err(check.refuse("crank", "a [crank] needs a [rod]; a single link is a [beam]")),
        (None, None, None) => return Err(check.refuse("", "no links: give [crank] and [rod], or one [beam]")),
        _ => {
            let problem = "a [beam] stands alone: give [crank] and [rod], or one [beam]";
            return Err(check.refuse_one_table_of("beam", &["crank", "rod"], problem));
        }
    };
    let links = links.into_iter().filter_map(|(name, link)| check.noted(link::link(check, name, link, model))).collect();
    let end = check.noted(end(check, raw)).unwrap_or(End::Free { tip_mass_kg: 0.0 });
    Ok(Chain {
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
    })
}

fn end(check: &Checker, raw: &raw::Scene) -> Result<End, SceneError> {
    match (&raw.slider, &raw.tip) {
        (Some(_), Some(_)) => {
            Err(check.refuse_one_table_of("tip", &["slider"], "the chain ends in a [slider] or in a [tip], not both"))
        }
        (Some(_), None) if raw.beam.is_some() => Err(check.refuse("slider", "a [slider] needs a [crank] and a [rod]")),
        (Some(slider), None) => Ok(End::Slider(Slider {
            mass_kg: check.number_or(&keys::SLIDER_MASS, "slider", slider.mass_kg),
            friction_n_s_per_m: check.number_or(&keys::FRICTION, "slider", slider.friction_n_s_per_m),
            resistance: resistance(check, slider)?,
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
    let table = ascending(check, key, table)?;
    let turn = std::f64::consts::TAU;
    let is_refused = |[angle, force]: &[f64; 2]| !(0.0..turn).contains(angle) || !keys::RESISTANCE.allows(*force);
    if let Some(row) = table.iter().position(is_refused) {
        let range = keys::RESISTANCE.range();
        let problem =
            format!("{}: angles must be from 0 to below 2π (6.2831…) and forces from {range} N", shown_row(&table[row], row));
        return Err(check.refuse(key, problem));
    }
    Ok(Resistance::Table(table))
}

fn drive(check: &Checker, raw: &raw::Scene) -> Result<Drive, SceneError> {
    let Some(drive) = &raw.drive else { return Ok(torque(check, raw)) };
    if !raw.pulse.is_empty() || raw.torque.is_some() {
        let problem = "prescribed motion leaves no room for torque: drop [drive], or [[pulse]] and [torque]";
        check.noted::<Drive>(Err(check.refuse_one_of("drive", &["torque", "pulse"], problem)));
        torque(check, raw);
    }
    let motion = match (&drive.speed_rad_per_s, &drive.ramp, &drive.table) {
        (Some(speed), None, None) => {
            if raw.start.rate_rad_per_s.is_some_and(|rate| rate != *speed) {
                let problem = format!("contradicts drive.speed_rad_per_s = {speed:?}, which prescribes the rate: leave it out");
                check.noted::<Drive>(Err(check.refuse("start.rate_rad_per_s", problem)));
            }
            Motion::Speed(check.number(&keys::DRIVE_SPEED, "drive", *speed))
        }
        (None, Some(ramp), None) => Motion::Ramp {
            to_rad_per_s: check.number_or(&keys::RAMP_TO, "drive.ramp", ramp.to_rad_per_s),
            over_s: check.number_or(&keys::RAMP_OVER, "drive.ramp", ramp.over_s),
        },
        (None, None, Some(table)) => {
            let table = ascending(check, "drive.table", table)?;
            let given = [("start.angle_rad", raw.start.angle_rad), ("start.rate_rad_per_s", raw.start.rate_rad_per_s)];
            if let Some((key, _)) = given.iter().find(|(_, value)| value.is_some()) {
                return Err(check.refuse(key, "drive.table prescribes angle and rate from the start on: leave it out"));
            }
            Motion::Table(table)
        }
        _ => {
            let motions = ["drive.speed_rad_per_s", "drive.ramp", "drive.table"];
            return Err(check.refuse_one_of("drive", &motions, "give exactly one of speed_rad_per_s, ramp, table"));
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

fn solver(check: &Checker, raw: &raw::Solver, oscillator: bool) -> Result<Solver, SceneError> {
    // `least` stands in for an unknown model: it needs fewer keys of links than any other, so that no refusal follows from it.
    let (usual, least) = match oscillator {
        true => (ModelKind::MassSpring, ModelKind::MassSpring),
        false => (ModelKind::Modal, ModelKind::Rigid),
    };
    let model = check.noted(named_model(check, raw)).map_or(least, |named| named.unwrap_or(usual));
    if oscillator != (model == ModelKind::MassSpring) {
        return Err(check.refuse("solver.model", "mass-spring goes with an [oscillator], and nothing else does"));
    }
    let (given, usual) = (raw.integrator.as_deref(), model.usual_integrator());
    Ok(Solver {
        model,
        integrator: check.word_or("solver.integrator", given, &INTEGRATORS, usual),
        step_s: check.number_or(&keys::STEP, "solver", raw.step_s),
        weight: check.number_or(&keys::WEIGHT, "solver", raw.weight),
        rho_infinity: check.number_or(&keys::RHO_INFINITY, "solver", raw.rho_infinity),
        tolerance: check.number_or(&keys::TOLERANCE, "solver", raw.tolerance),
        balance_tolerance: check.number_or(&keys::BALANCE_TOLERANCE, "solver", raw.balance_tolerance),
        max_iterations: check.count_or(&keys::MAX_ITERATIONS, "solver", raw.max_iterations),
        corrections: raw.corrections.map(|count| check.count(&keys::CORRECTIONS, "solver", count)),
    })
}

/// Rules between keys of different tables.
fn rules(check: &Checker, scene: &Scene) -> Result<(), SceneError> {
    let Solver { model, integrator, .. } = scene.solver;
    if !model.integrators().contains(&integrator) {
        let suits: Vec<&str> = model.integrators().iter().map(|kind| kind.as_str()).collect();
        return Err(check.refuse("solver.integrator", format!("{} goes with {} only", model.as_str(), suits.join(", "))));
    }
    if let Some(problem) = bad_corrections(&scene.solver) {
        return Err(check.refuse("solver.corrections", problem));
    }
    let Some(chain) = scene.chain() else { return Ok(()) };
    if let (End::Slider(_), [crank, rod]) = (&chain.end, chain.links.as_slice())
        && rod.length_m <= crank.length_m
    {
        let problem = format!("must be longer than crank.length_m = {:?}, or the crank cannot turn", crank.length_m);
        return Err(check.refuse("rod.length_m", problem));
    }
    if let (true, End::Free { .. }, [_, _]) = (chain.start.static_equilibrium, &chain.end, chain.links.as_slice()) {
        let problem = "the second link of an open chain swings: static equilibrium is for a beam or a crank-slider";
        return Err(check.refuse("start.static_equilibrium", problem));
    }
    if model == ModelKind::Incremental && chain.start.static_equilibrium {
        let problem = "the incremental model starts with straight links: use modal, finite-element or rigid";
        return Err(check.refuse("start.static_equilibrium", problem));
    }
    if model == ModelKind::Incremental
        && let Some(link) = chain.links.iter().find(|link| link.elements != 1 || link.rigid)
    {
        let key = format!("{}.{}", link.name.as_str(), if link.rigid { "rigid" } else { "elements" });
        return Err(check.refuse(&key, "the incremental model is the thesis's: flexible links, one element each"));
    }
    Ok(())
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
