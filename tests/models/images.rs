//! A scene's image moves as the image of its motion: mirrored at the x axis, or scaled in length, mass and time.

use flexcrank::mechanics::Observation;
use flexcrank::scene::{Drive, End, Motion, Resistance, Scene, System};

use crate::bench::{FINITE, MODAL, RIGID, look, run_to, scene, start};
use crate::chains::{Kind, Shape};

/// Factors from a scene to its image: along x and along y, of angles, of time and of mass.
#[derive(Debug, Clone, Copy)]
struct Image {
    x: f64,
    y: f64,
    angle: f64,
    time: f64,
    mass: f64,
}

const MIRROR: Image = Image { x: 1.0, y: -1.0, angle: -1.0, time: 1.0, mass: 1.0 };
const LARGER: Image = Image { x: 3.7, y: 3.7, angle: 1.0, time: 1.9, mass: 0.21 };

impl Image {
    fn force(&self) -> f64 {
        self.mass * self.x / (self.time * self.time)
    }

    fn moment(&self) -> f64 {
        self.force() * self.y
    }

    /// The image of a scene.
    fn of(&self, scene: &Scene) -> Scene {
        let mut image = scene.clone();
        let System::Chain(chain) = &mut image.system else { unreachable!("these scenes are chains") };
        for link in &mut chain.links {
            link.length_m *= self.x;
            link.mass_kg *= self.mass;
            link.centre_of_mass_m *= self.x;
            link.inertia_kg_m2 *= self.mass * self.x * self.x;
            link.damping_s *= self.time;
            if let Some(bar) = &mut link.bar {
                bar.area_m2 *= self.x.powi(2);
                bar.second_moment_m4 *= self.x.powi(4);
                bar.density_kg_per_m3 *= self.mass / self.x.powi(3);
                bar.youngs_modulus_pa *= self.force() / self.x.powi(2);
            }
        }
        chain.gravity_m_per_s2[0] *= self.x / self.time.powi(2);
        chain.gravity_m_per_s2[1] *= self.y / self.time.powi(2);
        chain.base.torsion_spring_nm_per_rad *= self.force() * self.x;
        chain.base.damper_nm_s_per_rad *= self.force() * self.x * self.time;
        chain.start.angle_rad *= self.angle;
        chain.start.rate_rad_per_s *= self.angle / self.time;
        match &mut chain.end {
            End::Free { tip_mass_kg } => *tip_mass_kg *= self.mass,
            End::Slider(slider) => {
                slider.mass_kg *= self.mass;
                slider.friction_n_s_per_m *= self.mass / self.time;
                match &mut slider.resistance {
                    Resistance::Constant(force) => *force *= self.force(),
                    Resistance::Table(rows) => rows.iter_mut().for_each(|[_, force]| *force *= self.force()),
                }
            }
        }
        match &mut image.drive {
            Drive::Torque { pulses, .. } => {
                for pulse in pulses {
                    pulse.torque_nm *= self.moment();
                    pulse.duration_s *= self.time;
                }
            }
            Drive::Motion(Motion::Ramp { to_rad_per_s, over_s }) => {
                *to_rad_per_s *= self.angle / self.time;
                *over_s *= self.time;
            }
            Drive::Motion(_) => unreachable!("these scenes prescribe ramps"),
        }
        image.solver.step_s *= self.time;
        image
    }

    /// Maps an observation of the image back: positions and angles, velocities, forces, moments, energies.
    fn back(&self, seen: &Observation) -> [Vec<f64>; 5] {
        let [mut places, mut rates, mut forces, mut moments] = [const { Vec::new() }; 4];
        for link in &seen.links {
            places.push(link.chord_rad / self.angle);
            rates.push(link.rate_rad_per_s / self.angle * self.time);
            for node in &link.nodes {
                let [x, y] = node.position_m;
                let [dx, dy] = node.velocity_m_per_s;
                places.extend([x / self.x, y / self.y, node.rotation_rad.unwrap() / self.angle]);
                places.extend(node.deflection_m.map(|w| w / self.y));
                rates.extend([dx / self.x * self.time, dy / self.y * self.time]);
            }
            for element in &link.elements {
                let across = self.force() * self.angle;
                forces.extend([element.axial_n / self.force(), element.shear_n / across]);
                moments.extend([element.moment_start_nm, element.moment_end_nm].map(|m| m / self.moment()));
            }
        }
        let across = self.mass * self.y / (self.time * self.time);
        let joints = [seen.pivot_n, seen.crank_pin_n, seen.slider_pin_n];
        forces.extend(joints.iter().flatten().flat_map(|[x, y]| [x / self.force(), y / across]));
        forces.extend(seen.guide_n.map(|force| force / across));
        forces.extend(seen.resistance_n.map(|force| force / self.force()));
        moments.extend(seen.motion_torque_nm.map(|torque| torque / self.moment()));
        let energy = &seen.energy;
        let energies = [Some(energy.kinetic_j), energy.strain_j, energy.potential_j];
        let energies = energies.iter().flatten().map(|energy| energy / (self.force() * self.x)).collect();
        [places, rates, forces, moments, energies]
    }
}

/// Largest difference between the motion of the image and the image of the motion, of each kind of quantity, relative to the
/// largest of its kind (or to 1 rad, m).
fn difference(scene: &Scene, image: Image) -> [f64; 5] {
    let itself = Image { x: 1.0, y: 1.0, angle: 1.0, time: 1.0, mass: 1.0 };
    let (mut original, mut other) = (start(scene), start(&image.of(scene)));
    let mut worst = [0.0_f64; 5];
    for time_s in [0.0, 0.02, 0.07, 0.15, 0.3] {
        run_to(&mut original, time_s);
        run_to(&mut other, time_s * image.time);
        assert_eq!(original.step_count(), other.step_count());
        let (expected, found) = (itself.back(look(&mut original)), image.back(look(&mut other)));
        for (kind, worst) in worst.iter_mut().enumerate() {
            let (expected, found) = (&expected[kind], &found[kind]);
            assert_eq!(expected.len(), found.len());
            let size = expected.iter().fold(1.0_f64, |most, x| most.max(x.abs()));
            for (a, b) in expected.iter().zip(found) {
                assert!(a.is_finite() && b.is_finite());
                *worst = worst.max((a - b).abs() / size);
            }
        }
    }
    worst
}

/// Every kind of chain by every model.
fn every_scene() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    for shape in [Shape::Slider, Shape::Free, Shape::Beam] {
        for (driven, rigid) in [(false, [false; 2]), (true, [false; 2]), (false, [true, false]), (false, [false, true])] {
            let text = Kind { driven, rigid, damped: true, axial: true, ..Kind::plain(shape) }.toml();
            for model in [RIGID, MODAL, FINITE] {
                let mut schemes = vec!["solver.integrator=esdirk"];
                schemes.push(if model == RIGID {
                    "solver.integrator=runge-kutta"
                } else {
                    "solver.integrator=generalized-alpha"
                });
                for scheme in schemes {
                    let scene = scene(&text, &[model, scheme, "solver.step_s=2e-4"]);
                    scenes.push((format!("{shape:?} {rigid:?}, driven {driven}, {model}, {scheme}"), scene));
                }
            }
        }
    }
    scenes
}

#[test]
fn prop_the_mirror_image_moves_as_the_image() {
    for (name, scene) in every_scene() {
        let worst = difference(&scene, MIRROR);
        assert!(worst.iter().all(|worst| *worst <= 1e-12), "{name}: {worst:?}");
    }
}

#[test]
fn prop_a_scaled_scene_moves_alike() {
    for (name, scene) in every_scene() {
        let worst = difference(&scene, LARGER);
        assert!(worst.iter().all(|worst| *worst <= 1e-9), "{name}: {worst:?}");
    }
}
