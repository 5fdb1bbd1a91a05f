//! Natural frequencies and buckling loads against theory.

use std::f64::consts::PI;

use crate::assembled::{bent_equilibrium_m, squared_frequencies};
use crate::bench::{FINITE, MODAL, look, scene, simulation};

/// A bar so slender that its stretch does not show: `E J`, N·m², and mass per length, kg/m.
const EJ_NM2: f64 = 2.1e11 * 8.333e-12;
const KG_PER_M: f64 = 7700.0 * 1e-4;
const BAR: &str = "area_m2 = 1e-4\nsecond_moment_m4 = 8.333e-12\ndensity_kg_per_m3 = 7700.0\nyoungs_modulus_pa = 2.1e11\n";

/// A rod between a pin that is held and a massless slider.
fn pinned() -> String {
    format!(
        "[crank]\nlength_m = 0.5\nrigid = true\nmass_kg = 0.0\n[rod]\nlength_m = 1.5\n{BAR}[slider]\nmass_kg = 0.0\n\
         [drive]\nspeed_rad_per_s = 0.0\n"
    )
}

/// A beam whose root is held.
fn clamped() -> String {
    format!("[beam]\nlength_m = 0.5\n{BAR}[drive]\nspeed_rad_per_s = 0.0\n")
}

#[test]
fn val_natural_frequencies_of_beams() {
    // k L of the first two modes; sines need many modes at a clamp.
    let cases = [
        ("pinned-pinned", pinned(), 1.5, [PI, 2.0 * PI], "rod.modes=2", "rod.elements=16"),
        ("clamped-free", clamped(), 0.5, [1.875_104_068_711_961, 4.694_091_132_974_175], "beam.modes=12", "beam.elements=16"),
    ];
    for (name, text, length, wave_numbers, modes, elements) in cases {
        for (model, detail) in [(MODAL, modes), (FINITE, elements)] {
            let squares = squared_frequencies(&scene(&text, &[model, detail]));
            for (square, number) in squares.iter().zip(wave_numbers) {
                let theory = (number / length).powi(2) * (EJ_NM2 / KG_PER_M).sqrt();
                let error = square.sqrt() / theory - 1.0;
                assert!(error.abs() < 1e-4, "{name}, {model}: {error:e} at {theory} rad/s");
            }
        }
    }
}

/// Lateral stiffness falls to nothing at the buckling load: the smallest `ω²`, linear in the load, is extrapolated to zero.
#[test]
fn val_a_rod_buckles_at_eulers_load() {
    let euler = PI * PI * EJ_NM2 / 1.5_f64.powi(2);
    for (model, detail, bound) in [(MODAL, "rod.modes=2", 1e-2), (FINITE, "rod.elements=16", 1e-3)] {
        let square = |share: f64| {
            let force = format!("slider.resistance_n={}", share * euler);
            squared_frequencies(&scene(&pinned(), &[model, detail, &force, "start.static_equilibrium=true"]))[0]
        };
        let (before, near) = (square(0.98), square(0.99));
        let critical = 0.99 + 0.01 * near / (before - near);
        assert!((critical - 1.0).abs() < bound, "{model}: {critical} of Euler's load");
        assert!(near < 0.02 * square(0.0), "{model}: the rod has gone soft");
    }
}

/// Complete elliptic integral of the first kind, by the arithmetic-geometric mean.
fn elliptic(k: f64) -> f64 {
    let (mut a, mut b) = (1.0_f64, (1.0 - k * k).sqrt());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    PI / (2.0 * a)
}

/// Just above Euler's load the rod comes to rest bent as the elastica, `P/P_E = (2K(k)/π)²`, `w/L = k/K(k)`: what is beyond the
/// second order in the slope, the chord's `−⅛ ∫ w'⁴` and the exact curvature, decides how far.
#[test]
fn val_a_buckled_rod_follows_the_elastica() {
    let k = 0.0314_f64;
    let euler = PI * PI * EJ_NM2 / 1.5_f64.powi(2);
    let (force_n, bow_m) = (euler * (2.0 * elliptic(k) / PI).powi(2), 1.5 * k / elliptic(k));
    for model in [MODAL, FINITE] {
        let force = format!("slider.resistance_n={force_n}");
        let found = bent_equilibrium_m(&scene(&pinned(), &[model, &force, "rod.modes=2", "rod.elements=32"]), bow_m);
        assert!((found / bow_m - 1.0).abs() < 5e-3, "{model}: {found} m for {bow_m} m");
    }
}

/// A cantilever that turns about its root: flapping frequencies `φ` at speed `γ`, both over `√(EJ/m)/L²`, by Wright, Smith,
/// Thresher & Wang (J. Appl. Mech. 49, 1982), no hub; in the plane of rotation `ω² = φ² − γ²`. The speed rises by 1 % and
/// leaves the beam swinging. Steps are short: at a 500th of a period time errs by −2.5e-4 at the higher speed, and a coarser element's
/// error of 2.1e-4 would make up for it.
#[test]
fn val_spinning_stiffens_a_beam() {
    let unit = (EJ_NM2 / KG_PER_M).sqrt() / 0.25;
    for (speed, flapping) in [(2.0_f64, 4.1373_f64), (8.0, 9.2568)] {
        let theory = (flapping * flapping - speed * speed).sqrt() * unit;
        let (period, speed) = (2.0 * PI / theory, speed * unit);
        for (model, detail) in [(MODAL, "beam.modes=12"), (FINITE, "beam.elements=8")] {
            let ramp = format!("drive={{ ramp = {{ to_rad_per_s = {speed}, over_s = {period} }} }}");
            let (rate, step) = (format!("start.rate_rad_per_s={}", 0.99 * speed), format!("solver.step_s={}", period / 2000.0));
            let mut run = simulation(&clamped(), &[model, detail, &ramp, &rate, &step]);
            let mut signal = Vec::new();
            for step in 0..82_000 {
                run.step().unwrap();
                if step >= 2000 && step % 40 == 0 {
                    let root = speed * run.time_s() - 0.005 * speed * period;
                    signal.push((run.time_s() - period, look(&mut run).links[0].chord_rad - root));
                }
            }
            let error = strongest(&signal, theory) / theory - 1.0;
            println!("{model} at {speed} rad/s: {error:e}");
            assert!(error.abs() < 1e-4, "{model} at {speed} rad/s: {error:e} of {theory} rad/s");
        }
    }
}

/// The frequency near `guess` at which a signal `(time, value)` from time 0 on is strongest, through Hann's window.
fn strongest(signal: &[(f64, f64)], guess: f64) -> f64 {
    let end = signal.last().unwrap().0;
    let power = |w: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (t, x) in signal {
            let windowed = (PI * t / end).sin().powi(2) * x;
            re += windowed * (w * t).cos();
            im += windowed * (w * t).sin();
        }
        re * re + im * im
    };
    let (mut low, mut high) = (0.98 * guess, 1.02 * guess);
    while high - low > 1e-7 * guess {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if power(a) < power(b) { low = a } else { high = b }
    }
    0.5 * (low + high)
}
