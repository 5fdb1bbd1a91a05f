//! Why a scene's start cannot be computed, as far as the scene shows it.

use crate::scene::{Drive, End, Link, LinkName, ModelKind, Scene};

/// Why no static equilibrium was found.
pub(super) fn no_equilibrium(scene: &Scene) -> String {
    let sprung = scene.chain().is_some_and(|chain| chain.base.torsion_spring_nm_per_rad > 0.0);
    let usual = match scene.drive {
        Drive::Torque { .. } if sprung => {
            "the start angle may be many turns from where the base spring balances the loads, or a link too soft for them"
        }
        Drive::Torque { .. } | Drive::Motion(_) => {
            "a link may be too soft for its weight and the constant loads. Check youngs_modulus_pa, length_m and section of each \
             link, then the loads: gravity, slider.resistance_n, tip.mass_kg"
        }
    };
    let why = soft_link(scene).unwrap_or_else(|| usual.to_owned());
    format!("no static equilibrium was found: {why}")
}

/// Why the start has no finite accelerations.
pub(super) fn no_accelerations(scene: &Scene) -> String {
    let usual = || "the position is singular, or constant loads bend a link too far".to_owned();
    format!("its start has no finite accelerations: {}", massless(scene).or_else(|| soft_link(scene)).unwrap_or_else(usual))
}

/// The part of a chain that nothing with mass holds, and the keys to look at.
fn massless(scene: &Scene) -> Option<String> {
    let chain = scene.chain()?;
    let has_mass = |link: &Link| link.mass_kg > 0.0;
    match &chain.end {
        End::Slider(slider) => {
            let is_massless = slider.mass_kg == 0.0 && !chain.links.iter().any(has_mass);
            is_massless.then(|| "neither the links nor the slider have mass: give one of them mass_kg".to_owned())
        }
        End::Free { tip_mass_kg } => {
            let link = chain.links.last().filter(|link| *tip_mass_kg == 0.0 && !has_mass(link))?.name.as_str();
            Some(format!("the {link} has no mass, nor has its tip: give {link}.mass_kg or tip.mass_kg"))
        }
    }
}

/// The softest link that static equilibrium would bend, and its keys to look at, if its weight alone bends it beyond its length.
///
/// Clamped at one end, it sags by the part `q L³/(8 E J)` of its length under the load `q = ρ A g`, as far as that is little.
fn soft_link(scene: &Scene) -> Option<String> {
    let chain = scene.chain().filter(|chain| chain.start.static_equilibrium && scene.solver.model != ModelKind::Rigid)?;
    let [x, y] = chain.gravity_m_per_s2;
    let sag = |link: &Link| -> Option<(LinkName, f64)> {
        let bar = link.bar.filter(|_| !link.rigid)?;
        let load_n_per_m = bar.mass_per_length_kg_per_m() * x.hypot(y);
        Some((link.name, load_n_per_m * link.length_m.powi(3) / (8.0 * bar.bending_stiffness_nm2())))
    };
    let (name, sag) = chain.links.iter().filter_map(sag).max_by(|one, other| one.1.total_cmp(&other.1))?;
    let link = name.as_str();
    let why = || {
        format!(
            "the {link} is too soft. Clamped at one end, it would sag by {sag:.1e} times its length under its own weight. Check \
             {link}.youngs_modulus_pa, {link}.length_m and its section"
        )
    };
    (sag > 1.0).then(why)
}
