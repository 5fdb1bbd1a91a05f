//! Two counterweights that hold the centre of mass still (thesis 4.12), and what they cost.

use super::machine::CycleInstant;
use super::setup::Setup;
use super::units::QuantityKind;
use super::{CycleError, Options};
use crate::scene::{Chain, Link, SceneSource};
use crate::shown::figure;
use crate::study::Table;

/// Positions of the counterweights, which are point masses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arms {
    /// Distance of `m₄` from O, on the crank's extension opposite A, m.
    pub r4_m: f64,
    /// Distance of `m₅` from A, on the rod's extension behind A, m.
    pub r5_m: f64,
}

/// The counterweights, kg.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counterweights {
    m4: f64,
    m5: f64,
}

/// Counterweights, and the machine before and after, one row a ratio.
///
/// Columns: `ratio`, `r4_m`, `r5_m`, `m4_kg`, `m5_kg`, then in pairs `…_before_…` and `…_after_…`: `mass`,
/// `crank_inertia_about_o`, `rod_inertia_about_a`, `largest_inertia_at_crank` (`2 T/θ̇²`, what a drive has to turn),
/// `peak_driving_torque`, `peak_shaking_force` (magnitudes, on the grid of angles) and `centre_of_mass_travel` (largest distance
/// from where it was at first).
///
/// # Errors
/// [`CycleError`] when the scene is no crank-slider, the options don't suit it, or no counterweight does.
pub fn balance(source: &SceneSource, options: &Options, arms: Arms) -> Result<Table, CycleError> {
    let mut names = ["ratio", "r4_m", "r5_m", "m4_kg", "m5_kg"].map(str::to_owned).to_vec();
    for (stem, kind) in FIGURES {
        names.extend(["before", "after"].map(|when| kind.column(&format!("{stem}_{when}"), false)));
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    for mut setup in Setup::all(source, options)? {
        let weights = Counterweights::of(&setup, arms)?;
        let before = figures(&setup, options.points);
        weights.attach(&mut setup.chain, arms);
        let after = figures(&setup, options.points);
        let pairs = before.into_iter().zip(after).flat_map(|(before, after)| [before, after]);
        let row = [setup.ratio, arms.r4_m, arms.r5_m, weights.m4, weights.m5].into_iter().chain(pairs);
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
    }
    let mut table = Table::default();
    names.into_iter().zip(columns).for_each(|(name, values)| table.push(name, values));
    Ok(table)
}

impl Counterweights {
    /// `m₅ = (m₂ r₂ + m₃ l₂)/r₅` puts the centre of rod, slider and itself on A; `m₄ = (m₁ r₁ + (m₂ + m₃ + m₅) l₁)/r₄` then
    /// puts that of everything on O. The thesis prints two expressions in θ, which reduce to these constants.
    fn of(setup: &Setup, arms: Arms) -> Result<Self, CycleError> {
        for (name, arm) in [("r4", arms.r4_m), ("r5", arms.r5_m)] {
            if !(arm > 0.0 && arm.is_finite()) {
                return Err(CycleError::Counterweight(format!("{name} must be a positive length, not {arm} m")));
            }
        }
        let [crank, rod] = setup.chain.links.as_slice() else { return Ok(Counterweights { m4: 0.0, m5: 0.0 }) };
        let m5 = (rod.mass_kg * rod.centre_of_mass_m + setup.slider_kg * rod.length_m) / arms.r5_m;
        let carried = rod.mass_kg + setup.slider_kg + m5;
        let m4 = (crank.mass_kg * crank.centre_of_mass_m + carried * crank.length_m) / arms.r4_m;
        for (name, kg, link) in [("m5", m5, "rod"), ("m4", m4, "crank")] {
            if kg < 0.0 || !kg.is_finite() {
                let problem = format!("{name} would be {} kg, the {link}'s own centre of mass being so far back", figure(kg));
                return Err(CycleError::Counterweight(problem));
            }
        }
        Ok(Counterweights { m4, m5 })
    }

    fn attach(self, chain: &mut Chain, arms: Arms) {
        for (link, (kg, at_m)) in chain.links.iter_mut().zip([(self.m4, -arms.r4_m), (self.m5, -arms.r5_m)]) {
            add_point(link, kg, at_m);
        }
    }
}

/// Adds a point mass at `at_m` along the link: the centre moves, the inertia grows by `m r²` (Steiner).
fn add_point(link: &mut Link, kg: f64, at_m: f64) {
    let mass_kg = link.mass_kg + kg;
    if mass_kg == 0.0 {
        return;
    }
    let about_pin = inertia_about_pin(link) + kg * at_m * at_m;
    let centre_m = (link.mass_kg * link.centre_of_mass_m + kg * at_m) / mass_kg;
    (link.mass_kg, link.centre_of_mass_m) = (mass_kg, centre_m);
    link.inertia_kg_m2 = about_pin - mass_kg * centre_m * centre_m;
}

/// Moment of inertia about the link's first pin.
fn inertia_about_pin(link: &Link) -> f64 {
    link.inertia_kg_m2 + link.mass_kg * link.centre_of_mass_m.powi(2)
}

/// The compared quantities.
const FIGURES: [(&str, QuantityKind); 7] = [
    ("mass", QuantityKind::Mass),
    ("crank_inertia_about_o", QuantityKind::Inertia),
    ("rod_inertia_about_a", QuantityKind::Inertia),
    ("largest_inertia_at_crank", QuantityKind::Inertia),
    ("peak_driving_torque", QuantityKind::Torque),
    ("peak_shaking_force", QuantityKind::Force),
    ("centre_of_mass_travel", QuantityKind::Length),
];

fn figures(setup: &Setup, points: usize) -> [f64; FIGURES.len()] {
    let turn: Vec<CycleInstant> = setup.turn(points).collect();
    let largest = |of: &dyn Fn(&CycleInstant) -> f64| turn.iter().map(of).fold(0.0, f64::max);
    let links = &setup.chain.links;
    let about_pin = |index: usize| links.get(index).map(inertia_about_pin).unwrap_or_default();
    let first = turn.first().map(|now| now.centre[0]).unwrap_or_default();
    [
        setup.slider_kg + links.iter().map(|link| link.mass_kg).sum::<f64>(),
        about_pin(0),
        about_pin(1),
        largest(&|now| now.inertia),
        largest(&|now| now.torque.abs()),
        largest(&|now| now.shaking_force()),
        largest(&|now| (now.centre[0][0] - first[0]).hypot(now.centre[0][1] - first[1])),
    ]
}
