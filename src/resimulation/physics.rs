//! Checks that need no re-simulation: finite numbers, closed joints.

use super::finding::Finding;
use crate::scene::{End, Scene};
use crate::wire::{Angles, Displacements, Energies, Loads, Message, NodeState, Status};

/// Tolerance for closed joints, relative to the largest coordinate.
const ROUNDING: f64 = 1e-12;

/// Checks messages, and keeps the largest joint gap.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PhysicsCheck {
    slides: bool,
    /// Largest distance between two link ends at a joint, or of the slider from its line, m.
    pub joint_gap_m: f64,
}

impl PhysicsCheck {
    pub(super) fn new(scene: &Scene) -> Self {
        let slides = scene.chain().is_some_and(|chain| matches!(chain.end, End::Slider(_)));
        PhysicsCheck { slides, ..PhysicsCheck::default() }
    }

    /// Returns what is wrong with a message, if anything.
    pub(super) fn judge(&mut self, event: &Message) -> Option<Finding> {
        let stamp = event.stamp()?;
        let what = match event {
            Message::Displacements(message) => self.displacements(message),
            Message::Angles(message) => not_finite(angles_are_finite(message)),
            Message::Loads(message) => not_finite(loads_are_finite(message)),
            Message::Energies(message) => not_finite(energies_are_finite(message)),
            Message::Status(message) => not_finite(status_is_finite(message)),
            _ => None,
        }?;
        Some(Finding::Physics { topic: event.topic().chunk(), epoch: stamp.epoch, step: stamp.step, what })
    }

    fn displacements(&mut self, message: &Displacements) -> Option<String> {
        let finite = message.nodes.iter().all(|node| {
            let optional = [node.rotation_rad, node.deflection_m, node.exact_x_m].into_iter().flatten();
            [node.x_m, node.y_m, node.dx_m, node.dy_m, node.vx_m_per_s, node.vy_m_per_s]
                .into_iter()
                .chain(optional)
                .all(f64::is_finite)
        });
        if !finite {
            return not_finite(false);
        }
        let size_m = message.nodes.iter().fold(0.0_f64, |most, node| most.max(node.x_m.abs()).max(node.y_m.abs()));
        let gap_m = self.gap_m(&message.nodes);
        self.joint_gap_m = self.joint_gap_m.max(gap_m);
        (gap_m > ROUNDING * size_m).then(|| format!("a joint is open by {gap_m:e} m"))
    }

    /// Distance between crank and rod, or of the slider from its line, whichever is larger.
    fn gap_m(&self, nodes: &[NodeState]) -> f64 {
        let joint = nodes.windows(2).find(|pair| pair[0].link == "crank" && pair[1].link == "rod");
        let pin = joint.map_or(0.0, |pair| (pair[0].x_m - pair[1].x_m).hypot(pair[0].y_m - pair[1].y_m));
        let slider = nodes.last().filter(|_| self.slides).map_or(0.0, |node| node.y_m.abs());
        pin.max(slider)
    }
}

fn not_finite(finite: bool) -> Option<String> {
    (!finite).then(|| "a number is not finite".to_owned())
}

fn angles_are_finite(message: &Angles) -> bool {
    message.links.iter().all(|link| {
        let optional = [link.acceleration_rad_per_s2, link.start_rotation_rad, link.end_rotation_rad].into_iter().flatten();
        [link.chord_rad, link.rate_rad_per_s].into_iter().chain(optional).all(f64::is_finite)
    })
}

fn energies_are_finite(message: &Energies) -> bool {
    let Energies { kinetic_j, strain_j, potential_j, work_in_j, dissipated_j, balance_error_j, .. } = *message;
    let Energies { energy_in_play_j, changed_j, .. } = *message;
    let works = [work_in_j, dissipated_j, changed_j];
    let energies = [kinetic_j, strain_j, potential_j, balance_error_j, energy_in_play_j].into_iter().chain(works);
    energies.flatten().all(f64::is_finite)
}

fn status_is_finite(message: &Status) -> bool {
    let Status { kinetic_j, strain_j, potential_j, work_in_j, dissipated_j, balance_error_j, .. } = *message;
    let energies = [kinetic_j, strain_j, potential_j, work_in_j, dissipated_j, balance_error_j];
    energies.into_iter().flatten().all(f64::is_finite)
}

fn loads_are_finite(message: &Loads) -> bool {
    let singles = [Some(message.driving_torque_nm), message.resistance_n, message.guide_force_n].into_iter().flatten();
    let joints = message.joints.iter().flat_map(|joint| [joint.fx_n, joint.fy_n]);
    let elements = message.elements.iter().flat_map(|e| [e.axial_n, e.shear_n, e.moment_start_nm, e.moment_end_nm]);
    singles.chain(joints).chain(elements).all(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;
    use crate::wire::Stamp;

    /// No forged file reaches this check alone: its messages also differ from those computed again.
    #[test]
    fn regress_an_open_joint_and_a_slider_off_its_line_are_findings() {
        let node = |link: &str, x_m: f64, y_m: f64| NodeState { link: link.to_owned(), x_m, y_m, ..NodeState::default() };
        let check = |scene: &str, gap_m: f64, off_m: f64| {
            let scene = SceneSource::open(scene, &[]).unwrap().scene;
            let nodes = vec![node("crank", 0.0, 0.0), node("crank", 0.5, 0.0), node("rod", 0.5, gap_m), node("rod", 2.0, off_m)];
            let stamp = Some(Stamp { step: 3, ..Stamp::default() });
            let message = Message::Displacements(Box::new(Displacements { stamp, nodes }));
            let mut physics = PhysicsCheck::new(&scene);
            (physics.judge(&message).map(|finding| finding.to_string()), physics.joint_gap_m)
        };
        for (gap_m, off_m, is_open) in [(0.0, 0.0, false), (1e-12, 0.0, false), (3e-12, 0.0, true), (0.0, -3e-12, true)] {
            let (found, kept_m) = check("crank-slider", gap_m, off_m);
            assert_eq!(found.is_some_and(|found| found.contains("a joint is open by 3e-12 m")), is_open, "{gap_m} {off_m}");
            assert_eq!(kept_m, gap_m.max(off_m.abs()));
        }
    }
}
