//! Encodes samples as telemetry messages.

use std::f64::consts::TAU;
use std::time::SystemTime;

use super::topic::{Message, Topic};
use super::{AdvanceReply, Angles, Displacements, ElementForce, Energies, JointForce, LinkAngle, Loads, NodeState};
use crate::mechanics::LinkObservation;
use crate::simulation::{EnergyLedger, Sample, SampleContext, Stamp};

/// A time in protobuf.
pub fn timestamp(time: SystemTime) -> prost_types::Timestamp {
    time.into()
}

/// A stamp in protobuf.
pub fn stamp(stamp: &Stamp) -> super::Stamp {
    super::Stamp { step: stamp.step, sim_time_s: stamp.sim_time_s, wall_time: Some(timestamp(stamp.wall)), epoch: stamp.epoch }
}

impl SampleContext {
    /// Whether the mechanism has a telemetry topic: an oscillator has neither angles nor loads.
    pub fn has(&self, topic: Topic) -> bool {
        self.turns || !matches!(topic, Topic::Angles | Topic::Loads)
    }

    fn links<'a>(&'a self, sample: &'a Sample) -> impl Iterator<Item = (&'static str, &'a LinkObservation, &'a LinkObservation)> {
        let pairs = sample.observation.links.iter().zip(&self.start.links);
        self.names.iter().zip(pairs).map(|(name, (now, start))| (*name, now, start))
    }

    /// Encodes a sample for a telemetry topic; `None` for any other topic.
    pub fn message(&self, topic: Topic, sample: &Sample) -> Option<Message> {
        Some(match topic {
            Topic::Displacements => Message::Displacements(Box::new(self.displacements(sample))),
            Topic::Angles => Message::Angles(Box::new(self.angles(sample))),
            Topic::Loads => Message::Loads(Box::new(self.loads(sample))),
            Topic::Energies => Message::Energies(Box::new(self.energies(sample))),
            _ => return None,
        })
    }

    /// The answer to an advance, without its reply: `sample` is the state after its steps.
    pub fn state_after(&self, sample: &Sample) -> AdvanceReply {
        AdvanceReply {
            reply: None,
            angles: self.turns.then(|| self.angles(sample)),
            loads: self.turns.then(|| self.loads(sample)),
            energies: Some(self.energies(sample)),
            displacements: (!self.turns).then(|| self.displacements(sample)),
        }
    }

    /// State of every node of every link.
    pub fn displacements(&self, sample: &Sample) -> Displacements {
        let mut nodes = Vec::new();
        for (link, now, start) in self.links(sample) {
            for (index, (node, was)) in (0..).zip(now.nodes.iter().zip(&start.nodes)) {
                let ([x_m, y_m], [vx, vy]) = (node.position_m, node.velocity_m_per_s);
                nodes.push(NodeState {
                    link: link.to_owned(),
                    index,
                    x_m,
                    y_m,
                    dx_m: x_m - was.position_m[0],
                    dy_m: y_m - was.position_m[1],
                    vx_m_per_s: vx,
                    vy_m_per_s: vy,
                    rotation_rad: node.rotation_rad,
                    deflection_m: node.deflection_m,
                    exact_x_m: now.exact_x_m.get(index as usize).copied().filter(|exact_m| !exact_m.is_nan()),
                });
            }
        }
        Displacements { stamp: Some(stamp(&sample.stamp)), nodes }
    }

    /// Angle of every link.
    pub fn angles(&self, sample: &Sample) -> Angles {
        let angle = |(link, now, start): (&str, &LinkObservation, &LinkObservation)| LinkAngle {
            link: link.to_owned(),
            chord_rad: now.chord_rad,
            rate_rad_per_s: now.rate_rad_per_s,
            acceleration_rad_per_s2: now.acceleration_rad_per_s2,
            start_rotation_rad: now.nodes.first().and_then(|node| node.rotation_rad),
            end_rotation_rad: now.nodes.last().and_then(|node| node.rotation_rad),
            revolutions: ((now.chord_rad - start.chord_rad) / TAU).trunc() as i64,
        };
        Angles {
            stamp: Some(stamp(&sample.stamp)),
            links: self.links(sample).map(angle).collect(),
            level: self.level.as_ref().map_or(String::new(), |level| level.name.clone()),
            level_error_rad: self.level.as_ref().and_then(|level| level.error_rad),
        }
    }

    /// Loads, joint forces and internal forces.
    pub fn loads(&self, sample: &Sample) -> Loads {
        let seen = &sample.observation;
        let joints = [("pivot", seen.pivot_n), ("crank-pin", seen.crank_pin_n), ("slider-pin", seen.slider_pin_n)];
        let joint = |(joint, force): (&str, Option<[f64; 2]>)| {
            force.map(|[fx_n, fy_n]| JointForce { joint: joint.to_owned(), fx_n, fy_n })
        };
        let mut elements = Vec::new();
        for (link, now, _) in self.links(sample) {
            for (index, forces) in (0..).zip(&now.elements) {
                elements.push(ElementForce {
                    link: link.to_owned(),
                    index,
                    axial_n: forces.axial_n,
                    shear_n: forces.shear_n,
                    moment_start_nm: forces.moment_start_nm,
                    moment_end_nm: forces.moment_end_nm,
                });
            }
        }
        Loads {
            stamp: Some(stamp(&sample.stamp)),
            driving_torque_nm: sample.driving_torque_nm,
            resistance_n: seen.resistance_n,
            guide_force_n: seen.guide_n,
            joints: joints.into_iter().filter_map(joint).collect(),
            elements,
        }
    }

    /// Energies, works, and their balance.
    pub fn energies(&self, sample: &Sample) -> Energies {
        let EnergyLedger { energy, work_in_j, dissipated_j, changed_j, balance_error_j, in_play_j, .. } = sample.ledger;
        Energies {
            stamp: Some(stamp(&sample.stamp)),
            kinetic_j: Some(energy.kinetic_j),
            strain_j: energy.strain_j,
            potential_j: energy.potential_j,
            work_in_j: Some(work_in_j),
            dissipated_j: Some(dissipated_j),
            balance_error_j: Some(balance_error_j),
            energy_in_play_j: Some(in_play_j),
            changed_j: (changed_j != 0.0).then_some(changed_j),
        }
    }
}
