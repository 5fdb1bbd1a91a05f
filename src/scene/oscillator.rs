//! Masses and springs.

use super::key::Number;
use super::{SceneError, check::Checker, keys, raw, types::*};

pub(super) fn oscillator(check: &Checker, raw: &raw::Oscillator) -> Result<Oscillator, SceneError> {
    let missing = || check.refuse("oscillator", "missing key `masses_kg`");
    let masses_kg = raw.masses_kg.as_deref().ok_or_else(missing)?;
    let count = masses_kg.len();
    if count == 0 || count > keys::MASSES || !masses_kg.iter().all(|mass| keys::OSCILLATOR_MASSES.allows(*mass)) {
        return Err(check.refuse(
            "oscillator.masses_kg",
            format!("must be 1 to {} numbers from {}", keys::MASSES, keys::OSCILLATOR_MASSES.range()),
        ));
    }
    let springs: Result<Vec<_>, _> = raw.springs.iter().map(|spring| self::spring(check, spring, count)).collect();
    let forces_n = for_each_mass(check, &keys::OSCILLATOR_FORCES, raw.forces_n.as_ref(), count);
    let start_m = for_each_mass(check, &keys::OSCILLATOR_START, raw.start_m.as_ref(), count);
    Ok(Oscillator {
        masses_kg: masses_kg.to_vec(),
        springs: check.noted(springs).unwrap_or_default(),
        forces_n: check.noted(forces_n).unwrap_or_default(),
        start_m: check.noted(start_m).unwrap_or_default(),
    })
}

fn spring(check: &Checker, given: &[f64], count: usize) -> Result<Spring, SceneError> {
    let end = |end: f64| (0..=count).find(|mass| *mass as f64 == end);
    let spring = |[i, j, stiffness_n_per_m]: [f64; 3]| Some(Spring { ends: [end(i)?, end(j)?], stiffness_n_per_m });
    let allowed = |spring: &Spring| spring.ends[0] != spring.ends[1] && keys::SPRING.allows(spring.stiffness_n_per_m);
    given.try_into().ok().and_then(spring).filter(allowed).ok_or_else(|| {
        let range = keys::SPRING.range();
        let problem = format!(
            "{given:?}: each must be [i, j, n_per_m]: two different masses from 1 to {count}, or 0 for ground, and {range} N/m"
        );
        check.refuse("oscillator.springs", problem)
    })
}

fn for_each_mass(check: &Checker, key: &Number, values: Option<&Vec<f64>>, count: usize) -> Result<Vec<f64>, SceneError> {
    let Some(values) = values else { return Ok(vec![0.0; count]) };
    if values.len() != count || !values.iter().all(|value| key.allows(*value)) {
        let problem = format!("must be {count} numbers from {}, one for each mass", key.range());
        return Err(check.refuse(&format!("oscillator.{}", key.name), problem));
    }
    Ok(values.clone())
}

/// An oscillator has no links, nor anything that acts on them.
pub(super) fn alone(check: &Checker, scene: &raw::Scene) -> Result<(), SceneError> {
    if scene.oscillator.is_none() {
        return Ok(());
    }
    let raw::Scene { base, gravity, start, commands, .. } = scene;
    let given = [
        ("crank", scene.crank.is_some()),
        ("rod", scene.rod.is_some()),
        ("beam", scene.beam.is_some()),
        ("slider", scene.slider.is_some()),
        ("tip", scene.tip.is_some()),
        ("drive", scene.drive.is_some()),
        ("pulse", !scene.pulse.is_empty()),
        ("torque", scene.torque.is_some()),
        ("base", base.torsion_spring_nm_per_rad.or(base.damper_nm_s_per_rad).is_some()),
        ("gravity", gravity.x_m_per_s2.or(gravity.y_m_per_s2).is_some()),
        ("start", start.angle_rad.or(start.rate_rad_per_s).is_some() || start.static_equilibrium.is_some()),
        ("commands", commands.torque_limit_nm.is_some() || commands.pending_limit.is_some()),
    ];
    let problem = "does not go with an [oscillator]";
    match given.into_iter().find(|(_, given)| *given) {
        Some((link @ ("crank" | "rod" | "beam"), _)) => Err(check.refuse_one_table_of(link, &["oscillator"], problem)),
        Some((key, _)) => Err(check.refuse(key, problem)),
        None => Ok(()),
    }
}
