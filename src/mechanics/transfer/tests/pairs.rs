//! Quantities that every transfer keeps.

use proptest::prelude::*;

use super::Kind::{Elements, Modal as Modes, Rigid};
use super::*;
use crate::mechanics::Oscillator;

const BEAM: &[&str] = &["pulse=[]", "start.rate_rad_per_s=9", "base.torsion_spring_nm_per_rad=0", "start.angle_rad=0.4"];
/// Chains of every kind, in motion.
const SCENES: [(&str, &[&str]); 12] = [
    ("crank-slider", &[]),
    ("crank-slider", &["crank.axial=false", "rod.axial=false", "gravity.y_m_per_s2=-9.81"]),
    ("crank-slider", &["crank.rigid=true"]),
    ("crank-slider", &["rod.rigid=true"]),
    ("crank-slider", &["pulse=[]", "drive.speed_rad_per_s=8"]),
    ("ref-r5", &["beam.second_moment_m4=1e-7", "beam.area_m2=1e-3", "pulse.0.torque_nm=40"]),
    ("thesis-beam-tip", &["solver.model=\"modal\"", "beam.second_moment_m4=1e-7", "beam.area_m2=1e-3", "pulse.0.torque_nm=40"]),
    ("two free links", &[]),
    ("two free links", &["crank.rigid=true"]),
    ("two free links", &["rod.rigid=true"]),
    ("two free links", &["pulse=[]", "drive.speed_rad_per_s=6"]),
    ("lumped rod", &[]),
];
/// A rigid rod given by its mass.
const LUMPED_ROD: &str = r#"
[crank]
length_m = 0.5
section = { shape = "rectangle", width_m = 0.01, height_m = 0.01 }
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e11
[rod]
length_m = 1.2
rigid = true
mass_kg = 0.9
centre_of_mass_m = 0.35
inertia_kg_m2 = 0.07
[slider]
mass_kg = 0.3
[[pulse]]
start_s = 0.0
torque_nm = 20.0
duration_s = 0.1
"#;
const TWO_FREE_LINKS: &str = r#"
[crank]
length_m = 0.5
section = { shape = "rectangle", width_m = 0.01, height_m = 0.01 }
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e11
axial = true
[rod]
length_m = 0.8
section = { shape = "rectangle", width_m = 0.01, height_m = 0.005 }
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e11
[tip]
mass_kg = 0.1
[gravity]
y_m_per_s2 = -9.81
[[pulse]]
start_s = 0.0
torque_nm = 15.0
duration_s = 0.1
"#;

/// A scene of these, or a built-in one.
pub(super) fn of(name: &str, overrides: &[&str]) -> Result<Scene, Box<dyn std::error::Error>> {
    let text = match name {
        "two free links" => TWO_FREE_LINKS,
        "lumped rod" => LUMPED_ROD,
        _ => return scene(name, overrides),
    };
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    Ok(SceneSource::parse(name, text, &overrides)?.scene)
}

#[test]
fn prop_momenta_chords_and_pins_are_kept_between_all_models() -> Tested {
    for (name, overrides) in SCENES {
        let scene = of(name, overrides)?;
        let fixed = overrides.iter().any(|given| given.starts_with("drive"));
        for from in ALL {
            let mut old = Moving::after(100, &scene, from)?;
            let (momenta, chords) = (old.momenta(), old.chords());
            let turns = if name == "two free links" { 2 } else { 1 };
            assert_eq!(momenta.len(), turns - usize::from(fixed));
            for to in ALL {
                let mut new = old.to(to)?;
                let case = format!("{name} {overrides:?} {from:?} -> {to:?}");
                for (old, new) in momenta.iter().zip(new.momenta()) {
                    assert!((new / old - 1.0).abs() < 1e-12, "{case}: {new} for {old}");
                }
                assert!(new.gap_m() <= 1e-15, "{case}: {:e}", new.gap_m());
                // A rod's angle follows from the length of the crank's chord; a rigid crank stands as prescribed.
                let moved = usize::from(fixed && to == Rigid);
                for (old, new) in chords.iter().zip(new.chords()).take(turns).skip(moved) {
                    assert!((new - old).abs() <= 2e-15, "{case}: {:e}", new - old);
                }
            }
        }
    }
    Ok(())
}

#[test]
fn val_straight_links_move_on_as_they_did_whole_turns_counted() -> Tested {
    for (name, overrides) in [("crank-slider", &[][..]), ("ref-r5", BEAM), ("two free links", &[])] {
        let scene = of(name, overrides)?;
        let mut rigid = Moving::new(scene.chain().ok_or("no chain")?, Rigid, false);
        rigid.q.fill(40.5);
        rigid.v.fill(-7.0);
        if let [_, second] = &mut rigid.q[..] {
            *second = -33.25;
        }
        let places: Vec<Place> = (0..rigid.chain.links.len())
            .flat_map(|link| (0..=10).map(move |k| Place { link, xi: f64::from(k) / 10.0 }))
            .collect();
        let (expected, chords) = (rigid.points(&places), rigid.chords());
        for from in ALL {
            let mut old = rigid.to(from)?;
            for to in ALL {
                let mut new = old.to(to)?;
                let case = format!("{name} {from:?} -> {to:?}");
                for (new, old) in new.chords().iter().zip(&chords) {
                    assert!((new - old).abs() < 1e-14, "{case}: {new} for {old}");
                }
                for (new, old) in new.points(&places).iter().zip(&expected) {
                    for k in 0..2 {
                        assert!((new.position_m[k] - old.position_m[k]).abs() < 1e-13, "{case}: {new:?} for {old:?}");
                        assert!((new.velocity_m_per_s[k] - old.velocity_m_per_s[k]).abs() < 1e-12, "{case}: {new:?} for {old:?}");
                    }
                }
                assert!(new.energies()[1] < 1e-18, "{case}: {:?}", new.energies());
            }
        }
    }
    Ok(())
}

#[test]
fn prop_there_and_back_changes_little() -> Tested {
    let mut old = Moving::after(150, &of("crank-slider", &[])?, Elements(32))?;
    let (chords, energies) = (old.chords(), old.energies());
    let mut new = old.to(Modes(4))?.to(Elements(32))?;
    let [crank, rod] = [0, 1].map(|i| (new.chords()[i] - chords[i]).abs());
    let [kinetic, strain] = [0, 1].map(|i| (new.energies()[i] - energies[i]).abs());
    assert!(crank <= 1e-15 && rod < 1e-9, "{crank:e} {rod:e}");
    assert!(kinetic + strain < 1e-4 * (energies[0] + energies[1]), "{kinetic:e} {strain:e}");
    Ok(())
}

/// A rod that is made rigid, and flexible again, in every model.
#[test]
fn prop_a_link_made_rigid_keeps_momentum_and_pins() -> Tested {
    let (flexible, rigid) = (of("crank-slider", &[])?, of("crank-slider", &["rod.rigid=true"])?);
    for (scene, other) in [(&flexible, &rigid), (&rigid, &flexible)] {
        for from in [Modes(2), Elements(3)] {
            let mut old = Moving::after(100, scene, from)?;
            for to in [Modes(2), Modes(4), Elements(3), Elements(8)] {
                let mut new = old.hand_to(Moving::new(other.chain().ok_or("no chain")?, to, false))?;
                let [old_p, new_p] = [old.momenta()[0], new.momenta()[0]];
                assert!((new_p / old_p - 1.0).abs() < 1e-12 && new.gap_m() < 1e-15, "{from:?} -> {to:?}: {new_p} for {old_p}");
                assert!((old.chords()[0] - new.chords()[0]).abs() < 1e-15, "{from:?} -> {to:?}");
            }
        }
    }
    Ok(())
}

/// Velocities of the crank-slider after 100 steps, taken over by a scene with other keys to go on in steps of `h_s`.
fn taken_over(from: Kind, to: (Kind, &[&str]), h_s: f64) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    let mut old = Moving::after(100, &of("crank-slider", &[])?, from)?;
    let scene = of("crank-slider", to.1)?;
    Ok(old.hand_in_steps_of(h_s, Moving::new(scene.chain().ok_or("no chain")?, to.0, false))?.v)
}

/// Nodes of two meshes have the same names in other places: what they differ by was taken for a blow.
#[test]
fn regress_the_step_matters_only_where_a_link_keeps_its_coordinates() -> Tested {
    let pairs = [(Elements(4), Elements(8)), (Elements(8), Elements(3)), (Modes(2), Modes(4)), (Modes(4), Elements(8))];
    for (from, to) in pairs {
        assert_eq!(taken_over(from, (to, &[]), 0.0)?, taken_over(from, (to, &[]), 1e-2)?, "{from:?} -> {to:?}");
    }
    for kind in [Modes(4), Elements(4)] {
        let rigid = |h_s: f64| taken_over(kind, (kind, &["rod.rigid=true"]), h_s);
        assert_ne!(rigid(0.0)?, rigid(1e-2)?, "{kind:?}");
    }
    Ok(())
}

/// With damping, of the first order.
#[test]
fn order_the_blow_of_a_link_made_rigid_is_whole_as_steps_become_short() -> Tested {
    for kind in [Modes(4), Elements(4)] {
        let rigid = |h_s: f64| taken_over(kind, (kind, &["rod.rigid=true"]), h_s);
        let whole = rigid(0.0)?;
        let apart = |h_s: f64| -> Result<f64, Box<dyn std::error::Error>> {
            Ok(rigid(h_s)?.iter().zip(&whole).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt())
        };
        let [long, short] = [apart(1e-8)?, apart(1e-9)?];
        assert!((long / short / 10.0 - 1.0).abs() < 0.05 && short > 0.0, "{kind:?}: {long:e}, {short:e}");
    }
    Ok(())
}

#[test]
fn prop_a_model_takes_its_own_state_to_the_bit() -> Tested {
    for kind in ALL {
        let mut old = Moving::after(50, &of("crank-slider", &[])?, kind)?;
        let new = old.to(kind)?;
        assert!(new.q == old.q && new.v == old.v, "{kind:?}");
        assert!(Transfer::new(&old.chain, &*old.mechanism, &new.chain, &*new.mechanism)?.is_copy());
    }
    Ok(())
}

/// Were the membrane strained by the fit, its energy would be a multiple of what there is.
#[test]
fn regress_a_fit_strains_no_membrane() -> Tested {
    for overrides in [&["crank.axial=false", "rod.axial=false"][..], &[]] {
        let mut old = Moving::after(150, &of("crank-slider", overrides)?, Modes(4))?;
        let [kinetic, strain] = old.energies();
        for (to, tolerance) in
            [(Elements(2), 1e-2), (Elements(4), 1e-3), (Elements(8), 1e-4), (Elements(16), 3e-5), (Modes(8), 1e-7)]
        {
            let [new_kinetic, new_strain] = old.to(to)?.energies();
            assert!((new_strain - strain).abs() < tolerance * strain, "{to:?}: {strain} J to {new_strain} J");
            assert!((new_kinetic - kinetic).abs() < 0.125 * tolerance * kinetic, "{to:?}: {kinetic} J to {new_kinetic} J");
        }
    }
    // Two modes place points along the rod by two sines; taken as they are, they would strain it by half its energy.
    let given = &["crank.axial=false", "rod.axial=false", "pulse.0.torque_nm=60"];
    let mut old = Moving::after(75, &of("crank-slider", given)?, Modes(2))?;
    let [strain, new_strain] = [old.energies()[1], old.to(Elements(16))?.energies()[1]];
    assert!((new_strain - strain).abs() < 1e-3 * strain, "{strain} J to {new_strain} J");
    Ok(())
}

/// The second model's simulation, taken over from the first model after 75 steps, goes on for 100 more.
fn goes_on(scene: &Scene, from: Kind, to: Kind) -> Tested {
    let mut old = Moving::after(75, scene, from)?;
    let mut new = old.to(to)?;
    let mut transfer = Transfer::new(&old.chain, &*old.mechanism, &new.chain, &*new.mechanism)?;
    let present = Present { input: &new.input, q: &new.q, v: &new.v };
    let mut a = vec![0.0; new.q.len()];
    transfer.accelerations(&mut *new.mechanism, &present, scene.solver.step_s, &mut a)?;
    let mut simulation = Simulation::new(&with(scene, to))?;
    for _ in 0..75 {
        simulation.step()?;
    }
    let plain = simulation.checkpoint();
    let mut taken = plain.clone();
    taken.state = [&new.q[..], &new.v, &a, &a, &vec![0.0; a.len()]].concat();
    assert!(simulation.restore(&taken));
    for _ in 0..100 {
        simulation.step()?;
    }
    Ok(())
}

/// Where the first predictor follows the accelerations of the equation of motion, 1e5 times those of the motion, steps fail.
#[test]
fn regress_finite_elements_go_on_from_any_model() -> Tested {
    for torque in ["pulse.0.torque_nm=20", "pulse.0.torque_nm=40"] {
        let scene = of("crank-slider", &[torque])?;
        for from in [Rigid, Modes(1), Modes(2), Modes(4), Elements(2), Elements(4), Elements(32)] {
            for to in [Elements(8), Elements(16), Elements(32), Modes(3)] {
                goes_on(&scene, from, to).map_err(|error| format!("{torque} {from:?} -> {to:?}: {error}"))?;
            }
        }
    }
    Ok(())
}

/// The places of finite elements, and their velocities, approach those of the modes with the fourth power of the element, until
/// what modes neglect of foreshortening is larger.
#[test]
fn order_finite_elements_take_over_modes_with_their_own_order() -> Tested {
    let mut old = Moving::after(150, &of("crank-slider", &["crank.axial=false", "rod.axial=false"])?, Modes(3))?;
    let places: Vec<Place> = (0..=40).map(|k| Place { link: 1, xi: f64::from(k) / 40.0 }).collect();
    let expected = old.points(&places);
    let mut errors = Vec::new();
    for elements in [4, 8, 16] {
        let points = old.to(Elements(elements))?.points(&places);
        let most = |of: fn(&PlacePoint) -> [f64; 2]| -> f64 {
            let apart = points.iter().zip(&expected).map(|(new, old)| (of(new)[1] - of(old)[1]).abs());
            apart.fold(0.0, f64::max)
        };
        errors.push([most(|point| point.position_m), most(|point| point.velocity_m_per_s)]);
    }
    let order = |coarse: usize, i: usize| (errors[coarse][i] / errors[coarse + 1][i]).log2();
    assert!(order(0, 0) > 3.4 && order(0, 1) > 3.4 && order(1, 1) > 3.4, "{errors:?}");
    assert!(errors[2][0] < 2e-7, "{errors:?}");
    Ok(())
}

#[test]
fn regress_other_mechanisms_are_refused() -> Tested {
    let mut slider = Moving::after(10, &of("crank-slider", &[])?, Modes(2))?;
    let beam = Moving::new(of("ref-r5", &[])?.chain().ok_or("no chain")?, Modes(2), false);
    let refused = Transfer::new(&slider.chain, &*slider.mechanism, &beam.chain, &*beam.mechanism);
    assert_eq!(refused.err(), Some(CannotTransfer::OtherGeometry));
    let System::Oscillator(masses) = scene("thesis-two-masses", &[])?.system else { return Err("no oscillator".into()) };
    let mut masses = Oscillator::new(&masses);
    let n = masses.degrees_of_freedom();
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let mut transfer = Transfer::new(&slider.chain, &*slider.mechanism, &slider.chain, &masses)?;
    let present = Present { input: &slider.input, q: &slider.q, v: &slider.v };
    let refused = transfer.apply((&mut *slider.mechanism, &present), (&mut masses, STEP_S), &mut q, &mut v);
    assert_eq!(refused, Err(CannotTransfer::NotAChain));
    let lost = vec![f64::NAN; slider.q.len()];
    slider.q = lost;
    assert!(slider.to(Elements(4)).is_err());
    Ok(())
}

#[test]
fn prop_a_prepared_transfer_does_not_allocate() -> Tested {
    let scene = of("crank-slider", &[])?;
    for (from, to) in [(Rigid, Modes(4)), (Modes(4), Elements(8)), (Elements(8), Modes(3)), (Elements(8), Rigid)] {
        let mut old = Moving::after(50, &scene, from)?;
        let mut new = old.to(to)?;
        let mut transfer = Transfer::new(&old.chain, &*old.mechanism, &new.chain, &*new.mechanism)?;
        let present = Present { input: &old.input, q: &old.q, v: &old.v };
        let allocated = allocation_counter::measure(|| {
            let done = transfer.apply((&mut *old.mechanism, &present), (&mut *new.mechanism, STEP_S), &mut new.q, &mut new.v);
            assert_eq!(done, Ok(()));
        });
        assert_eq!(allocated.count_total, 0, "{from:?} -> {to:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    /// Any shape and motion of the modes: what is kept does not depend on how smooth the motion was.
    #[test]
    fn prop_random_states_of_modes_keep_momentum_and_pins(
        angle in -20.0..20.0_f64,
        rate in -30.0..30.0_f64,
        bent in prop::collection::vec(-1.0..1.0_f64, 20),
        rates in prop::collection::vec(-1.0..1.0_f64, 20),
    ) {
        let scene = of("crank-slider", &["crank.axial=false", "rod.axial=false"]).expect("a scene");
        let mut old = Moving::new(scene.chain().expect("a chain"), Modes(4), false);
        (old.q[0], old.v[0]) = (angle, rate);
        for k in 1..old.q.len() {
            (old.q[k], old.v[k]) = (0.01 * bent[k], 2.0 * rates[k]);
        }
        let (momenta, chords) = (old.momenta(), old.chords());
        let scale = old.mechanism.energy(&old.input, &old.q, &old.v, &old.v.clone()).kinetic_j.sqrt();
        for to in [Rigid, Modes(1), Modes(2), Modes(7), Elements(2), Elements(5), Elements(16)] {
            let mut new = old.to(to).expect("transferred");
            prop_assert!((new.momenta()[0] - momenta[0]).abs() <= 1e-12 * (scale + momenta[0].abs()), "{to:?}");
            prop_assert!(new.gap_m() < 1e-15 && (new.chords()[0] - chords[0]).abs() < 1e-14, "{to:?}: {:e}", new.gap_m());
        }
        let mut finer = old.to(Modes(8)).expect("transferred");
        let (there, here) = (finer.energies(), old.energies());
        // Modes count the strong bending of sines only.
        prop_assert!((there[1] - here[1]).abs() <= 1e-3 * here[1], "{there:?} {here:?}");
    }
}
