//! Validation: raw structs become the typed scene. Every range and every rule between keys is checked here.

use super::{SceneError, check::Checker, document::SceneText, link, oscillator, raw, types::*};

/// The words for models in scene files.
pub const MODELS: [(&str, ModelKind); 5] = [
    ("rigid", ModelKind::Rigid),
    ("incremental", ModelKind::Incremental),
    ("modal", ModelKind::Modal),
    ("finite-element", ModelKind::FiniteElement),
    ("mass-spring", ModelKind::MassSpring),
];

/// The words for integrators in scene files.
pub const INTEGRATORS: [(&str, IntegratorKind); 4] = [
    ("two-point", IntegratorKind::TwoPoint),
    ("generalized-alpha", IntegratorKind::GeneralizedAlpha),
    ("runge-kutta", IntegratorKind::RungeKutta),
    ("esdirk", IntegratorKind::Esdirk),
];

/// The words for pulse shapes in scene files.
pub const SHAPES: [(&str, PulseShape); 2] =
    [("rectangular", PulseShape::Rectangular), ("raised-cosine", PulseShape::RaisedCosine)];

pub(super) fn validate(raw: &raw::Scene, text: &SceneText) -> Result<Scene, SceneError> {
    let check = Checker { text };
    let solver = solver(&check, &raw.solver, raw.oscillator.is_some())?;
    let system = match &raw.oscillator {
        Some(oscillator) => System::Oscillator(oscillator::oscillator(&check, raw, oscillator)?),
        None => System::Chain(chain(&check, raw, solver.model)?),
    };
    let scene = Scene { system, drive: drive(&check, raw)?, commands: commands(&check, &raw.commands)?, solver };
    rules(&check, &scene)?;
    Ok(scene)
}

fn chain(check: &Checker, raw: &raw::Scene, model: ModelKind) -> Result<Chain, SceneError> {
    let links = match (&raw.crank, &raw.rod, &raw.beam) {
        (Some(crank), Some(rod), None) => {
            vec![link::link(check, LinkName::Crank, crank, model)?, link::link(check, LinkName::Rod, rod, model)?]
        }
        (None, None, Some(beam)) => vec![link::link(check, LinkName::Beam, beam, model)?],
        (None, Some(_), None) => return Err(check.refuse("rod", "a [rod] needs a [crank]")),
        (Some(_), None, None) => return Err(check.refuse("crank", "a [crank] needs a [rod]; a single link is a [beam]")),
        (None, None, None) => return Err(check.refuse("", "no links: give [crank] and [rod], or one [beam]")),
        _ => return Err(check.refuse("beam", "a [beam] stands alone: give [crank] and [rod], or one [beam]")),
    };
    let end = end(check, raw)?;
    let range = 1e9;
    Ok(Chain {
        links,
        end,
        base: Base {
            torsion_spring_nm_per_rad: check.number_or(
                "base.torsion_spring_nm_per_rad",
                raw.base.torsion_spring_nm_per_rad,
                0.0,
                0.0,
                1e12,
            )?,
            damper_nm_s_per_rad: check.number_or("base.damper_nm_s_per_rad", raw.base.damper_nm_s_per_rad, 0.0, 0.0, 1e12)?,
        },
        gravity_m_per_s2: [
            check.number_or("gravity.x_m_per_s2", raw.gravity.x_m_per_s2, 0.0, -range, range)?,
            check.number_or("gravity.y_m_per_s2", raw.gravity.y_m_per_s2, 0.0, -range, range)?,
        ],
        start: Start {
            angle_rad: check.number_or("start.angle_rad", raw.start.angle_rad, 0.0, -1e6, 1e6)?,
            rate_rad_per_s: check.number_or("start.rate_rad_per_s", raw.start.rate_rad_per_s, 0.0, -1e6, 1e6)?,
            static_equilibrium: raw.start.static_equilibrium.unwrap_or(false),
        },
    })
}

fn end(check: &Checker, raw: &raw::Scene) -> Result<End, SceneError> {
    match (&raw.slider, &raw.tip) {
        (Some(_), Some(_)) => Err(check.refuse("tip", "the chain ends in a [slider] or in a [tip], not both")),
        (Some(_), None) if raw.beam.is_some() => Err(check.refuse("slider", "a [slider] needs a [crank] and a [rod]")),
        (Some(slider), None) => Ok(End::Slider(Slider {
            mass_kg: check.number_or("slider.mass_kg", slider.mass_kg, 0.0, 0.0, 1e9)?,
            friction_n_s_per_m: check.number_or("slider.friction_n_s_per_m", slider.friction_n_s_per_m, 0.0, 0.0, 1e12)?,
            resistance: resistance(check, slider)?,
        })),
        (None, Some(tip)) => Ok(End::Free { tip_mass_kg: check.number("tip.mass_kg", tip.mass_kg, 0.0, 1e9)? }),
        (None, None) => Ok(End::Free { tip_mass_kg: 0.0 }),
    }
}

fn resistance(check: &Checker, slider: &raw::Slider) -> Result<Resistance, SceneError> {
    const LIMIT_N: f64 = 1e12;
    let Some(table) = &slider.resistance_table else {
        return Ok(Resistance::Constant(check.number_or("slider.resistance_n", slider.resistance_n, 0.0, -LIMIT_N, LIMIT_N)?));
    };
    let key = "slider.resistance_table";
    if slider.resistance_n.is_some() {
        return Err(check.refuse(key, "give resistance_n or resistance_table, not both"));
    }
    ascending(check, key, table)?;
    let turn = std::f64::consts::TAU;
    if table.iter().any(|[angle, force]| !(0.0..turn).contains(angle) || force.abs() > LIMIT_N) {
        return Err(check.refuse(key, "angles must be from 0 to below 2π (6.2831…) and forces within ±1e12 N"));
    }
    Ok(Resistance::Table(table.clone()))
}

fn ascending(check: &Checker, key: &str, table: &[[f64; 2]]) -> Result<(), SceneError> {
    let finite = table.iter().flatten().all(|value| value.is_finite());
    if table.len() < 2 || !finite || table.windows(2).any(|pair| pair[0][0] >= pair[1][0]) {
        return Err(check.refuse(key, "must have at least two rows of finite numbers, the first of each row ascending"));
    }
    Ok(())
}

fn drive(check: &Checker, raw: &raw::Scene) -> Result<Drive, SceneError> {
    let Some(drive) = &raw.drive else { return torque(check, raw) };
    if !raw.pulse.is_empty() || raw.torque.is_some() {
        return Err(check.refuse("drive", "prescribed motion leaves no room for torque: drop [drive], or [[pulse]] and [torque]"));
    }
    let limit = 1e6;
    let motion = match (&drive.speed_rad_per_s, &drive.ramp, &drive.table) {
        (Some(speed), None, None) => Motion::Speed(check.number("drive.speed_rad_per_s", *speed, -limit, limit)?),
        (None, Some(ramp), None) => Motion::Ramp {
            to_rad_per_s: check.number("drive.ramp.to_rad_per_s", ramp.to_rad_per_s, -limit, limit)?,
            over_s: check.number("drive.ramp.over_s", ramp.over_s, 1e-9, 1e9)?,
        },
        (None, None, Some(table)) => {
            ascending(check, "drive.table", table)?;
            Motion::Table(table.clone())
        }
        _ => return Err(check.refuse("drive", "give exactly one of speed_rad_per_s, ramp, table")),
    };
    Ok(Drive::Motion(motion))
}

fn torque(check: &Checker, raw: &raw::Scene) -> Result<Drive, SceneError> {
    let limit = 1e12;
    let pulse = |(index, pulse): (usize, &raw::Pulse)| {
        let key = |name: &str| format!("pulse.{index}.{name}");
        Ok(Pulse {
            start_s: check.number(&key("start_s"), pulse.start_s, 0.0, 1e9)?,
            torque_nm: check.number(&key("torque_nm"), pulse.torque_nm, -limit, limit)?,
            duration_s: check.number(&key("duration_s"), pulse.duration_s, 1e-12, 1e9)?,
            shape: check.word(&key("shape"), pulse.shape.as_deref().unwrap_or("rectangular"), &SHAPES)?,
        })
    };
    Ok(Drive::Torque {
        constant_nm: check.number_or("torque.constant_nm", raw.torque.as_ref().map(|t| t.constant_nm), 0.0, -limit, limit)?,
        pulses: raw.pulse.iter().enumerate().map(pulse).collect::<Result<_, SceneError>>()?,
    })
}

fn commands(check: &Checker, raw: &raw::Commands) -> Result<Commands, SceneError> {
    Ok(Commands {
        torque_limit_nm: check.number_or("commands.torque_limit_nm", raw.torque_limit_nm, 1e4, 0.0, 1e12)?,
        pending_limit: check.count_or("commands.pending_limit", raw.pending_limit, 1024, 0, 1_000_000)?,
    })
}

fn solver(check: &Checker, raw: &raw::Solver, oscillator: bool) -> Result<Solver, SceneError> {
    let usual = if oscillator { ModelKind::MassSpring } else { ModelKind::Modal };
    let model = raw.model.as_deref().map_or(Ok(usual), |word| check.word("solver.model", word, &MODELS))?;
    if oscillator != (model == ModelKind::MassSpring) {
        return Err(check.refuse("solver.model", "mass-spring goes with an [oscillator], and nothing else does"));
    }
    let integrator = raw
        .integrator
        .as_deref()
        .map_or(Ok(model.usual_integrator()), |word| check.word("solver.integrator", word, &INTEGRATORS))?;
    Ok(Solver {
        model,
        integrator,
        step_s: check.number_or("solver.step_s", raw.step_s, 1e-3, 1e-9, 10.0)?,
        weight: check.number_or("solver.weight", raw.weight, 0.5, 0.0, 1.0)?,
        rho_infinity: check.number_or("solver.rho_infinity", raw.rho_infinity, 0.8, 0.0, 1.0)?,
        tolerance: check.number_or("solver.tolerance", raw.tolerance, 1e-9, 1e-15, 1e-2)?,
        balance_tolerance: check.number_or("solver.balance_tolerance", raw.balance_tolerance, 1e-2, 1e-15, 1e9)?,
        max_iterations: check.count_or("solver.max_iterations", raw.max_iterations, 20, 1, 1000)?,
    })
}

/// Rules between keys of different tables.
fn rules(check: &Checker, scene: &Scene) -> Result<(), SceneError> {
    let Solver { model, integrator, .. } = scene.solver;
    if !model.integrators().contains(&integrator) {
        let suits: Vec<&str> = model.integrators().iter().map(|kind| kind.as_str()).collect();
        return Err(check.refuse("solver.integrator", format!("{} goes with {} only", model.as_str(), suits.join(", "))));
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
