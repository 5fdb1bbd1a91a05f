//! Changes of a running scene: everything may change but the geometry and the kind of the drive.

use super::document::is_within;
use super::types::{Chain, Drive, End, ModelKind, Motion, Scene, System};
use super::{SceneError, SceneSource};

/// The reason of most refusals.
const GEOMETRY: &str = "a running scene keeps its geometry: start another run";
/// The reason where torque would replace a prescribed motion, or the reverse.
const KIND_OF_DRIVE: &str = "a running scene keeps its kind of drive: start another run";
/// The reason where a ramp or a table would become another motion.
const CONSTANT_SPEED_ONLY: &str = "of a prescribed motion, a running scene changes a constant speed only";

impl SceneSource {
    /// This scene with `KEY=VALUE` changes, for a run that goes on with it.
    ///
    /// # Errors
    /// [`SceneError`] if a change is refused as [`parse`](SceneSource::parse) would, or needs another run.
    pub fn changed(&self, changes: &[String]) -> Result<SceneSource, SceneError> {
        let changed = self.with(changes).map_err(|refused| self.other_kind_of_drive(changes).unwrap_or(refused))?;
        self.kept_by(changed, changes)
    }

    /// The refusal of a change that gives a chain the other kind of drive, or a ramp or table another motion; `None` if none
    /// does. Beside the drive that the chain has, it breaks other rules, too, and to heed their refusals does not help.
    fn other_kind_of_drive(&self, changes: &[String]) -> Option<SceneError> {
        self.scene.chain()?;
        let tables: &[(&str, &str)] = match self.scene.drive {
            Drive::Torque { .. } => &[("drive", KIND_OF_DRIVE)],
            Drive::Motion(Motion::Speed(_)) => &[("torque", KIND_OF_DRIVE), ("pulse", KIND_OF_DRIVE)],
            Drive::Motion(_) => &[("torque", KIND_OF_DRIVE), ("pulse", KIND_OF_DRIVE), ("drive", CONSTANT_SPEED_ONLY)],
        };
        let table_of = |change: &str| {
            let (key, value) = change.split_once('=')?;
            // A list without pulses gives no torque.
            tables.iter().copied().find(|(table, _)| is_within(key.trim(), table) && value.trim() != "[]")
        };
        let (given, (table, problem)) = changes.iter().rev().find_map(|change| Some((change, table_of(change)?)))?;
        Some(SceneError { key: table.to_owned(), ..SceneError::whole(format!("--set {given}"), problem) })
    }

    /// `changed` if a run of this scene can go on with it, or the refusal of one of the changes.
    pub(super) fn kept_by(&self, changed: SceneSource, changes: &[String]) -> Result<SceneSource, SceneError> {
        match needs_another_run(&self.scene, &changed.scene) {
            None => Ok(changed),
            Some((key, problem)) => {
                // `drive.speed_rad_per_s` changes the kind of `drive`, and `crank={…}` changes `crank.length_m`.
                let is_of_key = |change: &&String| {
                    let given = change.split('=').next().unwrap_or_default().trim();
                    is_within(given, &key) || is_within(&key, given)
                };
                let given = changes.iter().rev().find(is_of_key);
                let refusal = changed.refusal(&key, problem.to_owned());
                Err(SceneError { place: given.map_or(refusal.place, |given| format!("--set {given}")), ..refusal })
            }
        }
    }
}

/// A key that a running scene cannot change, with the reason; `None` if it can go on as `after`.
fn needs_another_run(before: &Scene, after: &Scene) -> Option<(String, &'static str)> {
    if before.levels != after.levels {
        return Some(("level".to_owned(), "a running scene keeps its levels: start another run"));
    }
    let system = match (&before.system, &after.system) {
        (System::Chain(before), System::Chain(after)) => other_geometry(before, after),
        (System::Oscillator(before), System::Oscillator(after)) => {
            (before.masses_kg.len() != after.masses_kg.len()).then(|| "oscillator.masses_kg".to_owned())
        }
        _ => Some("oscillator".to_owned()),
    };
    let other = system.map(|key| (key, GEOMETRY));
    other.or_else(|| other_drive(before, after)).or_else(|| other_method(before, after))
}

/// The key of a length or part that differs.
fn other_geometry(before: &Chain, after: &Chain) -> Option<String> {
    let names = |chain: &Chain| chain.links.iter().map(|link| link.name).collect::<Vec<_>>();
    if names(before) != names(after) {
        return after.links.first().map(|link| link.name.as_str().to_owned());
    }
    let longer = before.links.iter().zip(&after.links).find(|(before, after)| before.length_m != after.length_m);
    match (&before.end, &after.end) {
        (End::Free { .. }, End::Slider(_)) | (End::Slider(_), End::Free { .. }) => Some("slider".to_owned()),
        _ => longer.map(|(link, _)| format!("{}.length_m", link.name.as_str())),
    }
}

/// The key of the drive that differs in more than its constant speed or torque.
fn other_drive(before: &Scene, after: &Scene) -> Option<(String, &'static str)> {
    let start = |scene: &Scene| scene.chain().map(|chain| chain.start);
    match (&before.drive, &after.drive) {
        (Drive::Torque { .. }, Drive::Torque { .. }) => None,
        (Drive::Motion(Motion::Speed(_)), Drive::Motion(Motion::Speed(_))) => None,
        (Drive::Motion(before), Drive::Motion(after)) if before != after => Some(("drive".to_owned(), CONSTANT_SPEED_ONLY)),
        (Drive::Motion(_), Drive::Motion(_)) if start(before) != start(after) => {
            Some(("start".to_owned(), "the prescribed motion goes on from its start: start another run"))
        }
        (Drive::Motion(_), Drive::Motion(_)) => None,
        _ => Some(("drive".to_owned(), KIND_OF_DRIVE)),
    }
}

/// The key of a model whose state no other model can take.
fn other_method(before: &Scene, after: &Scene) -> Option<(String, &'static str)> {
    let alone = |scene: &Scene| scene.solver.model == ModelKind::Incremental;
    (alone(before) != alone(after))
        .then(|| ("solver.model".to_owned(), "the incremental method carries its own state: start another run"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(scene: &str, changes: &[&str]) -> Result<String, SceneError> {
        let source = SceneSource::open(scene, &[])?;
        let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
        Ok(source.changed(&changes).map_or_else(|error| error.to_string(), |changed| format!("accepted: {}", changed.text)))
    }

    #[test]
    fn prop_masses_models_and_steps_change() -> Result<(), SceneError> {
        for change in [
            "slider.mass_kg=0.3",
            "rod.damping_s=2e-4",
            "rod.youngs_modulus_pa=7e10",
            "rod.density_kg_per_m3=2700",
            "rod.section.height_m=0.02",
            "rod.rigid=true",
            "rod.elements=8",
            "rod.modes=4",
            "rod.axial=true",
            "gravity.y_m_per_s2=-9.81",
            "base.damper_nm_s_per_rad=0.1",
            "torque.constant_nm=0.5",
            "start.angle_rad=1.0",
            "commands.torque_limit_nm=3.0",
            "solver.model=finite-element",
            "solver.model=rigid",
            "solver.integrator=generalized-alpha",
            "solver.step_s=1e-3",
            "slider.friction_n_s_per_m=3",
        ] {
            let answer = refused("crank-slider", &[change])?;
            assert!(answer.starts_with("accepted"), "{change}: {answer}");
        }
        Ok(())
    }

    /// An override stands before the tables, so that all lines of the text in force are others.
    #[test]
    fn regress_a_refused_change_names_a_line_only_if_the_key_was_read_from_it() -> Result<(), SceneError> {
        const BOOM: &str = "[beam]\nlength_m = 1.0\narea_m2 = 1e-4\nsecond_moment_m4 = 1e-9\ndensity_kg_per_m3 = 7800.0\n\
                            youngs_modulus_pa = 2.1e11\nelements = 4\n[start]\nangle_rad = 0.1\n\
                            [[pulse]]\nstart_s = 0.0\ntorque_nm = 1.0\nduration_s = 0.1\n";
        let owned = |changes: &[&str]| changes.iter().map(|&change| change.to_owned()).collect::<Vec<String>>();
        let boom = |changes: &[&str]| SceneSource::parse("boom.toml", BOOM, &owned(changes));
        let free = boom(&["pulse=[]"])?;
        let finer = free.changed(&owned(&["beam.elements=2"]))?;
        let driven = boom(&["pulse=[]", "drive.ramp={ to_rad_per_s = 3, over_s = 1 }"])?;
        for (scene, change, said) in [
            (&free, "solver.model=incremental", "boom.toml:7: beam.elements = 4: the incremental model is"),
            (&finer, "solver.model=incremental", "boom.toml: beam.elements = 2: the incremental model is"),
            (&free, "drive.speed_rad_per_s=3", "--set drive.speed_rad_per_s=3: drive: a running scene keeps its kind of drive"),
            (&driven, "start.angle_rad=1", "--set start.angle_rad=1: start: the prescribed motion goes on from its start"),
        ] {
            let refused = scene.changed(&owned(&[change])).err().map(|refused| refused.to_string()).unwrap_or_default();
            assert!(refused.starts_with(said), "{change}: {refused}");
        }
        Ok(())
    }

    /// A speed beside a ramp was refused with "give exactly one of `speed_rad_per_s`, …", which no change can.
    #[test]
    fn regress_a_speed_for_a_ramp_is_refused_for_the_ramp() -> Result<(), SceneError> {
        let ramp = ["drive={ ramp={ to_rad_per_s=3, over_s=1 } }".to_owned()];
        let running = SceneSource::open("thesis-compressor", &ramp)?;
        for change in ["drive.speed_rad_per_s=3", "drive={ speed_rad_per_s=3 }"] {
            let refused = running.changed(&[change.to_owned()]).err().map(|refused| refused.to_string()).unwrap_or_default();
            let is_of_drive = refused.starts_with(&format!("--set {change}: drive"));
            assert!(is_of_drive && refused.ends_with(CONSTANT_SPEED_ONLY), "{refused}");
        }
        Ok(())
    }

    /// Those beside a torque or a motion were refused for that, and for the kind of drive once it was dropped.
    #[test]
    fn regress_a_change_of_the_kind_of_drive_is_refused_as_that_at_once() -> Result<(), SceneError> {
        for (scene, change, table) in [
            ("crank-slider", "drive.speed_rad_per_s=3", "drive"),
            ("thesis-compressor", "torque.constant_nm=2", "torque"),
            ("thesis-compressor", "pulse=[{start_s=1, torque_nm=2, duration_s=1}]", "pulse"),
        ] {
            let expected = format!("--set {change}: {table}: {KIND_OF_DRIVE}");
            assert_eq!(refused(scene, &["slider.mass_kg=0.3", change])?, expected);
        }
        for (scene, changes, said) in [
            ("thesis-compressor", ["pulse=[]", "slider.mass_kg=-1"], "slider.mass_kg = -1: "),
            ("thesis-oscillator", ["solver.step_s=0.2", "drive.speed_rad_per_s=3"], "drive: does not go with an [oscillator]"),
        ] {
            let answer = refused(scene, &changes)?;
            assert!(answer.contains(said), "{answer}");
        }
        Ok(())
    }

    #[test]
    fn prop_geometry_and_kind_of_drive_stay() -> Result<(), SceneError> {
        for (scene, change, reason) in [
            (
                "crank-slider",
                "rod.length_m=2.0",
                "--set rod.length_m=2.0: rod.length_m = 2.0: a running scene keeps its geometry",
            ),
            ("thesis-crank-slider", "solver.model=modal", "carries its own state"),
            ("crank-slider", "rod.lenght_m=1", "did you mean `length_m`?"),
            ("crank-slider", "slider.mass_kg=-1", "0"),
        ] {
            let changes: Vec<&str> = change.split(' ').collect();
            let answer = refused(scene, &changes)?;
            assert!(answer.contains(reason), "{change}: {answer}");
        }
        Ok(())
    }
}
