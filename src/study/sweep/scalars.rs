//! The scalars of a run: what is read at every step, and the statistics that are kept.

use crate::mechanics::{ElementForces, LinkObservation, Observation};
use crate::scene::{Bar, Chain, End, Link, Scene, System};

/// The scalar that is the largest slope of a link from its chord, rad, where that is too large for the model; else 0.
pub(super) const OUT_OF_RANGE: &str = "peak_out_of_range";

/// Numbers of one instant, where the model knows them.
pub(super) struct Instant<'a> {
    pub seen: &'a Observation,
    /// Mean torque over the step that ends there, N·m.
    pub torque_nm: f64,
}

/// Where an instant lies in the part of a run whose scalars are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Before it.
    Before,
    /// At the run's start: not the end of a step.
    Start,
    /// At the end of one of its steps.
    After,
}

/// A statistic over the instants of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Statistic {
    /// Largest magnitude.
    Peak,
    /// Mean over the ends of all steps.
    Mean,
    Least,
    Greatest,
    /// The last value.
    Final,
}

use Statistic::{Final, Greatest, Least, Mean, Peak};

impl Statistic {
    fn word(self) -> &'static str {
        match self {
            Peak => "peak",
            Mean => "mean",
            Least => "least",
            Greatest => "greatest",
            Final => "final",
        }
    }
}

type Read = Box<dyn Fn(&Instant) -> Option<f64>>;

/// A quantity with its statistics so far.
struct Quantity {
    of: String,
    name: &'static str,
    statistics: &'static [Statistic],
    read: Read,
    tally: Tally,
    /// Whether it counts before the time from which scalars are taken, too.
    of_whole_run: bool,
}

/// Everything that any statistic needs. A quantity that is unknown at one instant is unknown.
#[derive(Debug, Clone, Copy)]
struct Tally {
    known: bool,
    count: u64,
    sum: f64,
    least: f64,
    greatest: f64,
    last: f64,
}

impl Tally {
    const EMPTY: Tally =
        Tally { known: true, count: 0, sum: 0.0, least: f64::INFINITY, greatest: f64::NEG_INFINITY, last: f64::NAN };

    fn add(&mut self, value: Option<f64>, is_start: bool) {
        let Some(value) = value else {
            self.known = false;
            return;
        };
        if !is_start {
            self.count += 1;
            self.sum += value;
        }
        (self.least, self.greatest, self.last) = (self.least.min(value), self.greatest.max(value), value);
    }

    fn value(&self, statistic: Statistic) -> Option<f64> {
        let value = match statistic {
            Peak => self.greatest.max(-self.least),
            Mean => self.sum / self.count as f64,
            Least => self.least,
            Greatest => self.greatest,
            Final => self.last,
        };
        (self.known && value.is_finite()).then_some(value)
    }
}

/// The scalars of one run.
pub(super) struct Scalars(Vec<Quantity>);

impl Scalars {
    /// Those of a scene, nothing read yet.
    pub fn new(scene: &Scene) -> Self {
        let mut all = Scalars(Vec::new());
        match &scene.system {
            System::Chain(chain) => {
                (0..).zip(&chain.links).for_each(|(place, link)| all.link(place, link));
                all.end(if matches!(chain.end, End::Slider(_)) { "slider" } else { "tip" });
                all.joints(chain);
            }
            System::Oscillator(oscillator) => (0..oscillator.masses_kg.len()).for_each(|place| all.mass(place)),
        }
        all.push("", "kinetic_j", &[Peak], |now| Some(now.seen.energy.kinetic_j));
        all.push("", "strain_j", &[Peak], |now| now.seen.energy.strain_j);
        all.push("", "out_of_range", &[Peak], |now| Some(now.seen.out_of_range.unwrap_or(0.0)));
        // What the model did not cover before is not made good later.
        all.0.iter_mut().filter(|quantity| quantity.name == "out_of_range").for_each(|quantity| quantity.of_whole_run = true);
        all
    }

    /// Names with units, such as `rod_peak_moment_nm`.
    pub fn names(&self) -> Vec<String> {
        let name = |quantity: &Quantity, statistic: &Statistic| {
            let parts = [quantity.of.as_str(), statistic.word(), quantity.name];
            parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("_")
        };
        self.0.iter().flat_map(|quantity| quantity.statistics.iter().map(move |statistic| name(quantity, statistic))).collect()
    }

    /// Reads an instant.
    pub fn read(&mut self, now: &Instant, place: Place) {
        let counts = |quantity: &&mut Quantity| place != Place::Before || quantity.of_whole_run;
        for quantity in self.0.iter_mut().filter(counts) {
            quantity.tally.add((quantity.read)(now), place != Place::After);
        }
    }

    /// The statistics, in the order of the names.
    pub fn values(&self) -> impl Iterator<Item = Option<f64>> {
        self.0.iter().flat_map(|quantity| quantity.statistics.iter().map(|statistic| quantity.tally.value(*statistic)))
    }

    fn push(
        &mut self,
        of: &str,
        name: &'static str,
        statistics: &'static [Statistic],
        read: impl Fn(&Instant) -> Option<f64> + 'static,
    ) {
        self.0.push(Quantity {
            of: of.to_owned(),
            name,
            statistics,
            read: Box::new(read),
            tally: Tally::EMPTY,
            of_whole_run: false,
        });
    }

    fn link(&mut self, place: usize, link: &Link) {
        let name = link.name.as_str();
        self.push(name, "rate_rad_per_s", &[Peak, Mean], move |now| Some(at(now, place)?.rate_rad_per_s));
        self.push(name, "angle_rad", &[Final], move |now| Some(at(now, place)?.chord_rad));
        self.push(name, "deflection_m", &[Peak], move |now| largest(at(now, place)?.nodes.iter().map(|node| node.deflection_m)));
        self.force(name, "axial_n", place, |element| element.axial_n.abs());
        self.force(name, "shear_n", place, |element| element.shear_n.abs());
        self.force(name, "moment_nm", place, bending);
        let bar = link.bar;
        self.push(name, "stress_pa", &[Peak], move |now| {
            let bar = bar?;
            largest(at(now, place)?.elements.iter().map(|element| stress_pa(element, &bar)))
        });
    }

    fn force(&mut self, of: &str, name: &'static str, place: usize, force: fn(&ElementForces) -> f64) {
        self.push(of, name, &[Peak], move |now| largest(at(now, place)?.elements.iter().map(|element| Some(force(element)))));
    }

    fn end(&mut self, name: &str) {
        let last = |now: &Instant| now.seen.links.last().and_then(|link| link.nodes.last()).copied();
        self.push(name, "x_m", &[Least, Greatest], move |now| Some(last(now)?.position_m[0]));
        self.push(name, "y_m", &[Least, Greatest], move |now| Some(last(now)?.position_m[1]));
        self.push(name, "speed_m_per_s", &[Peak], move |now| {
            let [u, v] = last(now)?.velocity_m_per_s;
            Some(u.hypot(v))
        });
    }

    /// The joints that the chain has.
    fn joints(&mut self, chain: &Chain) {
        let size = |force: Option<[f64; 2]>| force.map(|[x, y]| x.hypot(y));
        self.push("pivot", "force_n", &[Peak, Mean], move |now| size(now.seen.pivot_n));
        if chain.links.len() > 1 {
            self.push("crank_pin", "force_n", &[Peak, Mean], move |now| size(now.seen.crank_pin_n));
        }
        if matches!(chain.end, End::Slider(_)) {
            self.push("slider_pin", "force_n", &[Peak, Mean], move |now| size(now.seen.slider_pin_n));
            self.push("guide", "force_n", &[Peak, Mean], move |now| now.seen.guide_n.map(f64::abs));
        }
        self.push("driving", "torque_nm", &[Peak, Mean], move |now| Some(now.seen.motion_torque_nm.unwrap_or(now.torque_nm)));
    }

    fn mass(&mut self, place: usize) {
        let node = move |now: &Instant| at(now, 0)?.nodes.get(place).copied();
        let name = format!("mass{}", place + 1);
        self.push(&name, "x_m", &[Least, Greatest, Mean, Final], move |now| Some(node(now)?.position_m[0]));
        self.push(&name, "speed_m_per_s", &[Peak], move |now| Some(node(now)?.velocity_m_per_s[0]));
    }
}

fn at<'a>(now: &Instant<'a>, place: usize) -> Option<&'a LinkObservation> {
    now.seen.links.get(place)
}

/// The largest magnitude; `None` if there are no values, or one is unknown.
fn largest(mut values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let first = values.next()??.abs();
    values.try_fold(first, |largest, value| Some(largest.max(value?.abs())))
}

/// Largest bending moment at the ends of an element, N·m.
fn bending(element: &ElementForces) -> f64 {
    element.moment_start_nm.abs().max(element.moment_end_nm.abs())
}

/// Largest normal stress `|N|/A + |M| c/J` of an element, c the distance of the outermost fibre; `None` without the section's shape.
fn stress_pa(element: &ElementForces, bar: &Bar) -> Option<f64> {
    let fibre_m = bar.extreme_fibre_m?;
    Some(element.axial_n.abs() / bar.area_m2 + bending(element) * fibre_m / bar.second_moment_m4)
}

#[cfg(test)]
mod tests {
    use super::Scalars;
    use crate::scene::SceneSource;

    /// A beam had empty columns of a crank pin, a slider pin and a guide.
    #[test]
    fn regress_a_chain_has_scalars_of_its_own_joints_alone() {
        let link = "length_m = 0.3\nmass_kg = 1.0\n";
        let hanging = format!("[crank]\n{link}[rod]\n{link}[solver]\nmodel = \"rigid\"\n");
        let hanging = SceneSource::parse("hanging.toml", &hanging, &[]).unwrap();
        let built_in = |name: &str| SceneSource::open(name, &[]).unwrap();
        for (source, expected) in [
            (built_in("crank-slider"), &["pivot", "crank_pin", "slider_pin", "guide"][..]),
            (hanging, &["pivot", "crank_pin"]),
            (built_in("thesis-beam"), &["pivot"]),
        ] {
            let names = Scalars::new(&source.scene).names();
            let joints: Vec<&str> = names.iter().filter_map(|name| name.strip_suffix("_peak_force_n")).collect();
            assert_eq!(joints, expected, "{}", source.origin);
        }
    }
}
