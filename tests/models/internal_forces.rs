//! Internal forces of rigid links, by three models that compute them in their own ways.

use crate::bench::simulation;

const RIGID: &[&str] = &["solver.model=rigid", "solver.integrator=runge-kutta"];
const FINITE: &[&str] = &["solver.model=finite-element", "solver.integrator=two-point", "crank.rigid=true", "rod.rigid=true"];
const MODAL: &[&str] = &["solver.model=modal", "solver.integrator=two-point", "crank.rigid=true", "rod.rigid=true"];

#[test]
fn val_internal_forces_of_rigid_links_agree_and_vanish_at_pins() {
    let common = [
        "gravity.y_m_per_s2=-9.81",
        "slider.resistance_n=3.0",
        "solver.step_s=1e-5",
        "torque.constant_nm=2.0",
        "pulse.0.shape=rectangular",
    ];
    let mut all = [RIGID, FINITE, MODAL].map(|model| {
        let overrides: Vec<&str> = model.iter().chain(&common).copied().collect();
        simulation("crank-slider", &overrides)
    });
    for _ in 0..4_321 {
        all.iter_mut().for_each(|simulation| simulation.step().unwrap());
    }
    let torque_nm = 22.0;
    let [rigid, finite, modal] = all.map(|mut simulation| simulation.observe().unwrap().clone());
    for (name, other) in [("finite-element", &finite), ("modal", &modal)] {
        for (one, two) in rigid.links.iter().zip(&other.links) {
            assert_eq!((one.elements.len(), two.elements.len()), (4, 4));
            for (a, b) in one.elements.iter().zip(&two.elements) {
                let pairs = [
                    (a.axial_n, b.axial_n),
                    (a.shear_n, b.shear_n),
                    (a.moment_start_nm, b.moment_start_nm),
                    (a.moment_end_nm, b.moment_end_nm),
                ];
                assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 1e-4 * (1.0 + a.abs())), "{name}: {pairs:?}");
            }
            assert!(two.nodes.iter().all(|node| node.deflection_m.is_none()), "a rigid link has no deflection to tell");
        }
    }
    for link in &rigid.links {
        assert!(link.elements[3].moment_end_nm.abs() < 1e-9, "no moment at a pin");
    }
    assert!((rigid.links[0].elements[0].moment_start_nm + torque_nm).abs() < 1e-9, "the torque enters at the root");
    assert!(rigid.links[1].elements[0].moment_start_nm.abs() < 1e-9);
}
