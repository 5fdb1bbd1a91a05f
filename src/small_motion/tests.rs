//! Modes beside closed forms, exact solutions of the beam's equations, and another program.

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::*;
use crate::integrate::State;
use crate::scene::{LinkName, SceneSource};
use crate::simulation::Simulation;

mod orders;

type Outcome = Result<(), Box<dyn Error>>;

/// Section, density and modulus of the slender bar of these tests: 0.5 m long, EJ/ρA = 0.227 m⁴/s².
const SLENDER: [&str; 7] = [
    "beam.area_m2=1e-4",
    "beam.second_moment_m4=8.333e-13",
    "solver.integrator=generalized-alpha",
    "pulse=[]",
    "base.torsion_spring_nm_per_rad=0.0",
    "solver.step_s=1e-3",
    "beam.length_m=0.5",
];
const E_PA: f64 = 2.1e11;
const RHO: f64 = 7700.0;
const AREA_M2: f64 = 1e-4;
const LENGTH_M: f64 = 0.5;
const SECOND_MOMENT_M4: f64 = 8.333e-13;

fn subject(scene: &str, overrides: &[&str], crank: Option<Crank>) -> Result<Subject, Box<dyn Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    Ok(Subject::new(&SceneSource::open(scene, &overrides)?.scene, crank)?)
}

/// Frequencies of the vibrations in bending or of the base, rad/s.
fn bending(subject: &Subject, point: &Point, count: usize) -> Result<Vec<f64>, NoModes> {
    let bends = |mode: &Mode| matches!(mode.kind, Kind::Vibration(Part::Bending(_) | Part::Base) | Kind::Swing);
    let found = modes(subject, point, 2 * count)?;
    Ok(found.iter().filter(|mode| bends(mode)).map(|mode| mode.eigenvalue.im).take(count).collect())
}

/// The `count` lowest roots of `f` above 0, by bisection.
fn roots(f: impl Fn(f64) -> f64, step: f64, count: usize) -> Vec<f64> {
    let mut found = Vec::new();
    let mut low = 0.01 * step;
    while found.len() < count {
        let high = low + step;
        if f(low).signum() != f(high).signum() {
            found.push(bisect(&f, low, high));
        }
        low = high;
    }
    found
}

fn bisect(f: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let sign = f(low).signum();
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if f(middle).signum() == sign { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// First five modes, with 64 elements.
fn within_a_millionth(found: &[f64], exact: &[f64]) {
    assert_eq!(found.len(), exact.len());
    for (found, exact) in found.iter().zip(exact) {
        assert!((found / exact - 1.0).abs() < 1e-6, "{found} for {exact}: {:.1e}", found / exact - 1.0);
    }
}

/// `ω = (βL)² √(EJ/ρA)/L²`.
fn omega(beta_l: f64, length_m: f64) -> f64 {
    (beta_l / length_m).powi(2) * (E_PA * SECOND_MOMENT_M4 / (RHO * AREA_M2)).sqrt()
}

/// Mass at the tip of the clamped bar, as a part of the bar's.
const TIP_RATIO: f64 = 0.5;

/// The override with that mass.
fn tip_mass() -> String {
    format!("tip.mass_kg={}", TIP_RATIO * RHO * AREA_M2 * LENGTH_M)
}

/// Its equation for βL: `1 + cos cosh + μ x (cos sinh − sin cosh) = 0`.
fn tipped(x: f64) -> f64 {
    1.0 / x.cosh() + x.cos() + TIP_RATIO * x * (x.cos() * x.tanh() - x.sin())
}

/// Overrides, crank, and the equation that βL solves.
type Case<'a> = (&'a [&'a str], Crank, &'a dyn Fn(f64) -> f64);

#[test]
fn val_beams_have_the_frequencies_of_their_closed_forms() -> Outcome {
    let fine = [&SLENDER[..], &["solver.model=finite-element", "beam.elements=64"]].concat();
    // Clamped: cos cosh = −1.
    let clamped = |x: f64| x.cos() + 1.0 / x.cosh();
    // Hinged on a spring k, with α = kL/EJ: β(cosh sin − sinh cos)·… = α (1 + cos cosh).
    let spring_nm = 0.3;
    let alpha = spring_nm * LENGTH_M / (E_PA * SECOND_MOMENT_M4);
    let sprung = |x: f64| x * (x.cos() * x.tanh() - x.sin()) + alpha * (x.cos() + 1.0 / x.cosh());
    let tip = tip_mass();
    let spring = format!("base.torsion_spring_nm_per_rad={spring_nm}");
    let cases: [Case<'_>; 3] =
        [(&[], Crank::Held, &clamped), (&[&spring], Crank::Free, &sprung), (&[&tip], Crank::Held, &tipped)];
    for (extra, crank, equation) in cases {
        let subject = subject("thesis-beam", &[&fine[..], extra].concat(), Some(crank))?;
        let beta_l = roots(equation, 0.05, 5);
        let exact: Vec<f64> = beta_l.iter().map(|x| omega(*x, LENGTH_M)).collect();
        within_a_millionth(&bending(&subject, &subject.at_rest(0.0)?, 5)?, &exact);
    }
    Ok(())
}

/// The rod of a crank-slider whose pins are held: by a rigid crank that is held, and a slider of a thousand tonnes.
const PINNED: [&str; 5] =
    ["crank.rigid=true", "slider.mass_kg=1e6", "rod.damping_s=0.0", "rod.length_m=1.5", "solver.integrator=generalized-alpha"];

/// Its first `count` frequencies, rad/s.
fn pinned_rod(count: u32) -> Vec<f64> {
    let stiffness = f64::sqrt(E_PA * (1e-8 / 12.0) / (RHO * 1e-4));
    (1..=count).map(|n| (PI * f64::from(n) / 1.5).powi(2) * stiffness).collect()
}

#[test]
fn val_a_pinned_rod_has_the_frequencies_of_its_closed_form() -> Outcome {
    let exact = pinned_rod(5);
    let fine =
        subject("crank-slider", &[&PINNED[..], &["solver.model=finite-element", "rod.elements=64"]].concat(), Some(Crank::Held))?;
    within_a_millionth(&bending(&fine, &fine.at_rest(0.0)?, 5)?, &exact);
    for count in [1, 3, 5] {
        let own = format!("rod.modes={count}");
        let modal = subject(
            "crank-slider",
            &[&PINNED[..], &["solver.model=modal", "rod.axial=false", &own]].concat(),
            Some(Crank::Held),
        )?;
        let found = bending(&modal, &modal.at_rest(0.0)?, count)?;
        assert_eq!(found.len(), count);
        assert!(found.iter().zip(&exact).all(|(found, exact)| (found / exact - 1.0).abs() < 1e-9), "{found:?} for {exact:?}");
    }
    Ok(())
}

#[test]
fn val_two_masses() -> Outcome {
    let two = ["oscillator.masses_kg=[1.0,2.0]", "oscillator.springs=[[0,1,300.0],[1,2,200.0]]"];
    let subject = subject("thesis-two-masses", &two, None)?;
    let found = modes(&subject, &subject.at_rest(0.0)?, 5)?;
    // det([500 − ω², −200; −200, 200 − 2 ω²]) = 2 ω⁴ − 900·… : 2 ω⁴ − 1200 ω² + 60000
    let root = (1200.0_f64.powi(2) - 8.0 * 60000.0).sqrt();
    let exact = [(1200.0 - root) / 4.0, (1200.0 + root) / 4.0].map(f64::sqrt);
    assert_eq!(found.len(), 2);
    assert!(found.iter().zip(exact).all(|(mode, exact)| (mode.eigenvalue.im / exact - 1.0).abs() < 1e-9));
    Ok(())
}

/// Small motion of a beam that turns steadily and is stretched by that: from `½EA(|r′| − 1)² + ½EJ θ′²` and `½ρA|ṙ|²` in axes that turn,
/// `u = U cos ωt` along and `w = W sin ωt` across the line `x₀ = sin κs/(κ cos κL)`, `κ² = ρAΩ²/EA`, with `λ = x₀′`, `N = EA(λ − 1)`:
///
/// ```text
/// EA U″ = −ρA ((ω² + Ω²) U + 2Ωω W)      M = EJ (W′/λ)′      T = (N W′ − M′)/λ
/// T′ = −ρA ((ω² + Ω²) W + 2Ωω U)         U = W = W′ = 0 at the root, U′ = M = T = 0 at the end
/// ```
///
/// Its determinant at ω, by Runge–Kutta's method.
fn rotating(omega: f64, speed: f64) -> f64 {
    const STEPS: usize = 4000;
    let (ea, ej, m) = (E_PA * AREA_M2, E_PA * SECOND_MOMENT_M4, RHO * AREA_M2);
    let kappa = (m * speed * speed / ea).sqrt();
    let lambda = |s: f64| (kappa * s).cos() / (kappa * LENGTH_M).cos();
    // U, U′, W, φ = W′/λ, M, T.
    let slope = |s: f64, x: &[f64; 6]| {
        let lambda = lambda(s);
        let (own, coriolis) = (omega * omega + speed * speed, 2.0 * speed * omega);
        let tension = ea * (lambda - 1.0);
        [
            x[1],
            -m * (own * x[0] + coriolis * x[2]) / ea,
            lambda * x[3],
            x[4] / ej,
            lambda * (tension * x[3] - x[5]),
            -m * (own * x[2] + coriolis * x[0]),
        ]
    };
    let h = LENGTH_M / STEPS as f64;
    let end = |mut x: [f64; 6]| {
        for step in 0..STEPS {
            let s = h * step as f64;
            let ahead = |k: &[f64; 6], part: f64| std::array::from_fn(|i| x[i] + part * k[i]);
            let k1 = slope(s, &x);
            let k2 = slope(s + 0.5 * h, &ahead(&k1, 0.5 * h));
            let k3 = slope(s + 0.5 * h, &ahead(&k2, 0.5 * h));
            let k4 = slope(s + h, &ahead(&k3, h));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        [x[1], x[4], x[5]]
    };
    let columns = [1, 4, 5].map(|i| end(std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 })));
    nalgebra::Matrix3::from_fn(|i, j| columns[j][i]).determinant()
}

/// Stiffening by rotation, with all the beam's stretching and Coriolis's forces. The error falls faster than with the fourth power of the
/// element's length, also in the layer that tension makes at the hub.
#[test]
fn val_a_rotating_beam_is_stiffened_as_its_equations_say() -> Outcome {
    let beam = |elements: &str| {
        subject("thesis-beam", &[&SLENDER[..], &["solver.model=finite-element", elements]].concat(), Some(Crank::Held))
    };
    let (coarse, fine) = (beam("beam.elements=32")?, beam("beam.elements=64")?);
    let unit = omega(1.0, LENGTH_M);
    // 2.6, 12 and 21 √(EJ/ρA)/L². At the last, beyond the literature's tables, tension makes a thin layer at the hub, and Ω² takes most of
    // the first mode's ω² + Ω² away.
    for speed in [5.0, 12.0 * unit, 40.0] {
        let found = bending(&fine, &fine.turning(0.7, speed)?, 5)?;
        let exact = found.iter().map(|near| bisect(&|omega| rotating(omega, speed), near * 0.9999, near * 1.0001));
        // Of the root of `ω² + Ω²`, to which bending and tension add up.
        let error = |found: f64, exact: f64| (found.hypot(speed) / exact.hypot(speed) - 1.0).abs();
        for ((n, exact), (coarse, fine)) in
            exact.enumerate().zip(bending(&coarse, &coarse.turning(0.7, speed)?, 5)?.iter().zip(&found))
        {
            let own = (fine / exact - 1.0).abs();
            assert!(own < 1e-6, "{speed} rad/s, mode {}: {own:e} of its frequency", n + 1);
            let [coarse, fine] = [*coarse, *fine].map(|found| error(found, exact));
            assert!(fine < 1e-6, "{speed} rad/s, mode {}: {fine:e}", n + 1);
            // The lowest modes of a fine mesh are found to the rounding of its stiffest.
            assert!(fine < coarse / 15.0 + 6e-8, "mode {}: {coarse:e} and {fine:e}", n + 1);
        }
    }
    let subject = fine;
    // Wright, Smith, Thresher & Wang (1982), out of the plane, at 12 √(EJ/ρA)/L²: 13.1702; in the plane Ω² less.
    let found = bending(&subject, &subject.turning(0.0, 12.0 * unit)?, 1)?[0] / unit;
    assert!((found - (13.1702_f64.powi(2) - 144.0).sqrt()).abs() < 3e-4, "{found}");
    Ok(())
}

/// Another program's eigenvalues of the same chain, whose cubic elements with consistent mass err by 2.7e-4 at most, and those of the exact
/// equations.
#[test]
fn val_a_crank_slider_has_the_frequencies_that_exudyn_finds() -> Outcome {
    let chain =
        ["solver.model=finite-element", "crank.damping_s=0.0", "rod.damping_s=0.0", "solver.integrator=generalized-alpha"];
    let same = [&chain[..], &["crank.elements=16", "rod.elements=16"]].concat();
    let fine = [&chain[..], &["crank.elements=64", "rod.elements=64"]].concat();
    let cases = [
        (include_str!("../../tests/data/exudyn-modes.csv"), same, 3e-4),
        (include_str!("../../tests/data/exact-modes.csv"), fine, 1.5e-7),
    ];
    for (table, overrides, bound) in cases {
        let mut largest = 0.0_f64;
        for row in table.lines().skip(1).filter(|row| !row.starts_with('#')) {
            let cells: Vec<&str> = row.split(',').collect();
            let crank = if cells[1] == "held" { Crank::Held } else { Crank::Free };
            let subject = subject("crank-slider", &overrides, Some(crank))?;
            let found = modes(&subject, &subject.at_rest(cells[0].parse::<f64>()?.to_radians())?, 6)?;
            let found: Vec<f64> = found.iter().map(Mode::frequency_hz).filter(|hz| *hz > 0.0).take(5).collect();
            for (found, exact) in found.iter().zip(&cells[2..]) {
                largest = largest.max((found / exact.parse::<f64>()? - 1.0).abs());
            }
            assert_eq!(found.len(), 5, "{row}");
        }
        assert!(largest < bound, "{largest:e}");
    }
    Ok(())
}

#[test]
fn prop_singular_positions_are_said() -> Outcome {
    let refused =
        subject("crank-slider", &["crank.length_m=1.0", "rod.length_m=1.0"], Some(Crank::Held)).err().ok_or("accepted")?;
    assert!(refused.to_string().contains("must be longer"), "{refused}");
    // The rod stands across the guide but for a fifty-thousandth of a turn.
    for model in ["solver.model=modal", "solver.model=finite-element"] {
        let across = [model, "solver.integrator=generalized-alpha", "crank.length_m=1.0", "rod.length_m=1.00000001"];
        let subject = subject("crank-slider", &across, Some(Crank::Free))?;
        match subject.at_rest(FRAC_PI_2).and_then(|point| modes(&subject, &point, 5)) {
            Err(said) => assert!(matches!(said, NoModes::Singular | NoModes::NoEquilibrium { .. }), "{model}: {said}"),
            Ok(found) => assert!(found.iter().all(|mode| mode.eigenvalue.norm().is_finite()), "{model}"),
        }
    }
    for model in ["rigid", "modal"] {
        let rigid = [&format!("solver.model={model}"), "crank.rigid=true", "rod.rigid=true"];
        let held = subject("crank-slider", &rigid, Some(Crank::Held))?;
        assert_eq!(modes(&held, &held.at_rest(0.0)?, 5).err(), Some(NoModes::NothingMoves));
    }
    Ok(())
}

/// Peaks of the spectrum of a run after a small pulse stand at the frequencies of `modes`, to the resolution of the spectrum.
#[test]
fn val_a_spectrum_has_its_peaks_at_the_frequencies_of_the_modes() -> Outcome {
    let pulse = "pulse=[{start_s=0.0,torque_nm=1e-3,duration_s=0.004,shape=\"raised-cosine\"}]";
    let overrides = ["start.angle_rad=1.0", pulse, "solver.step_s=2e-4", "crank.damping_s=1e-6", "rod.damping_s=1e-6"];
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    let scene = SceneSource::open("crank-slider", &overrides)?.scene;
    let subject = Subject::new(&scene, None)?;
    let found = modes(&subject, &subject.at_rest(1.0)?, 5)?;
    let mut simulation = Simulation::new(&scene)?;
    let (seconds, step_s) = (8.0, 2e-4);
    let mut signals = [Vec::new(), Vec::new()];
    for _ in 0..(seconds / step_s) as usize {
        simulation.step()?;
        let links = &simulation.observe()?.links;
        for (signal, link) in signals.iter_mut().zip(links) {
            signal.push(link.nodes[link.nodes.len() / 2].deflection_m.ok_or("no deflection")?);
        }
    }
    let resolution_hz = 1.0 / seconds;
    for mode in found.iter().filter(|mode| mode.eigenvalue.im > 0.0) {
        let signal = &signals[usize::from(mode.kind != Kind::Vibration(Part::Bending(LinkName::Crank)))];
        let near = (-20..=20).map(|k| mode.frequency_hz() + 0.1 * resolution_hz * f64::from(k));
        let power = |hz: &f64| amplitude(signal, step_s, *hz);
        let peak = near.max_by(|one, other| power(one).total_cmp(&power(other))).ok_or("no peak")?;
        assert!((peak - mode.frequency_hz()).abs() <= resolution_hz, "{}: {peak} for {}", mode.name(), mode.frequency_hz());
        let beside = [-3.0, 3.0].map(|lines| power(&(mode.frequency_hz() + lines * resolution_hz)));
        assert!(beside.iter().all(|beside| *beside < 0.3 * power(&peak)), "{} is no peak", mode.name());
    }
    Ok(())
}

/// Fourier's amplitude at a frequency, through Hann's window.
fn amplitude(signal: &[f64], step_s: f64, hz: f64) -> f64 {
    let count = signal.len() as f64;
    let sum: nalgebra::Complex<f64> = signal
        .iter()
        .enumerate()
        .map(|(k, value)| {
            let window = 0.5 - 0.5 * (TAU * k as f64 / count).cos();
            nalgebra::Complex::from_polar(value * window, -TAU * hz * k as f64 * step_s)
        })
        .sum();
    sum.norm()
}

/// Undamped rod of one mode on a rigid crank, moved at a speed: inside its unstable range about twice its frequency (Mathieu's first
/// tongue) a disturbance grows by the multiplier in every turn, outside it does not.
#[test]
fn val_a_rod_grows_inside_its_unstable_range_and_not_outside() -> Outcome {
    let rod = [
        "crank.rigid=true",
        "rod.axial=false",
        "rod.damping_s=0.0",
        "rod.modes=1",
        "slider.mass_kg=0.5",
        "crank.length_m=0.05",
        "rod.section={shape=\"rectangle\",width_m=0.01,height_m=0.03}",
    ];
    let subject = subject("crank-slider", &rod, Some(Crank::Held))?;
    for (speed, grows) in [(390.0, true), (300.0, false)] {
        let found = subject.periodic_modes(0.0, speed, &floquet::Accuracy::default(), None, None)?;
        assert_eq!(found.unstable().count(), usize::from(grows), "{speed}: {:?}", found.modes);
        let largest = found.largest();
        let mut mechanism = subject.mechanism();
        let drive = periodic::CrankDrive::Speed { start_rad: 0.0, speed_rad_per_s: speed };
        let mut system = periodic::DrivenMechanism::new(mechanism.as_mut(), drive);
        let [period_s, turns, steps] = [TAU / speed, 8.0, 1000.0];
        let mut runs = Vec::new();
        for small in [0.0, 1e-9] {
            let q = found.orbit.q.iter().map(|q| q + small).collect();
            let mut state = State::new(q, found.orbit.v.clone());
            let mut integrator = scheme::Scheme::RungeKutta.integrator(found.orbit.q.len(), variation::TIGHT);
            let mut at_turns = vec![state.q[0]];
            for step in 0..(turns * steps) as u32 {
                let h_s = period_s / steps;
                integrator.step(&mut system, f64::from(step) * h_s, h_s, &mut state)?;
                if (step + 1) % steps as u32 == 0 {
                    at_turns.push(state.q[0]);
                }
            }
            runs.push(at_turns);
        }
        let apart: Vec<f64> = runs[0].iter().zip(&runs[1]).map(|(one, other)| (one - other).abs()).collect();
        if grows {
            let rate = (apart[8] / apart[4]).powf(0.25);
            assert!((rate / largest - 1.0).abs() < 0.02, "{rate} for {largest}");
        } else {
            assert!(apart.iter().all(|apart| *apart < 1e-7), "{apart:?}");
        }
    }
    Ok(())
}
