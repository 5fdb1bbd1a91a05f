//! All numbers that a service publishes, under short names, with their recent past.
//!
//! Names are those of `export` without the name of the list: `crank.chord_rad`, `rod.2.deflection_m`, `pivot.fx_n`,
//! `driving_torque_nm`; `slider.x_m` for the last node of a chain with a slider; and `shadow.angle_rad` for the differences of a shadow,
//! which are those at `shadow.sim_time_s`.

use std::collections::BTreeMap;

use super::strip::Strip;
use crate::wire::{Angles, Displacements, Energies, Loads, Message, NodeState, Shadow, Stamp, Status, Topic};

/// All signals by name.
#[derive(Debug, Default)]
pub(super) struct Signals {
    strips: BTreeMap<String, Strip>,
    /// Whether the chain ends in a slider, according to its loads.
    pub has_slider: bool,
    /// Whether energies arrive on their own topic; services of earlier versions publish them in `status` only.
    has_energies: bool,
}

impl Signals {
    /// Adds the values of a message.
    pub(super) fn add(&mut self, message: &Message) {
        match message {
            Message::Displacements(displacements) => self.displacements(displacements),
            Message::Angles(angles) => self.angles(angles),
            Message::Loads(loads) => self.loads(loads),
            Message::Energies(energies) => self.energies(energies),
            Message::Shadow(shadow) => self.shadow(shadow),
            Message::Status(status) => self.status(status),
            _ => {}
        }
    }

    pub(super) fn angles(&mut self, angles: &Angles) {
        let time_s = seconds(angles.stamp.as_ref());
        for link in &angles.links {
            self.put(time_s, &link.link, "chord_rad", Some(link.chord_rad));
            self.put(time_s, &link.link, "rate_rad_per_s", Some(link.rate_rad_per_s));
            self.put(time_s, &link.link, "acceleration_rad_per_s2", link.acceleration_rad_per_s2);
        }
    }

    pub(super) fn displacements(&mut self, all: &Displacements) {
        let time_s = seconds(all.stamp.as_ref());
        for node in &all.nodes {
            let name = format!("{}.{}", node.link, node.index);
            self.put(time_s, &name, "x_m", Some(node.x_m));
            self.put(time_s, &name, "y_m", Some(node.y_m));
            self.put(time_s, &name, "deflection_m", node.deflection_m);
            self.put(time_s, &name, "exact_x_m", node.exact_x_m);
        }
        if let Some(end) = all.nodes.last().filter(|_| self.has_slider) {
            self.slider(time_s, end);
        }
    }

    /// Adds the values of the slider, which is the last node.
    pub(super) fn slider(&mut self, time_s: f64, end: &NodeState) {
        self.put(time_s, "slider", "x_m", Some(end.x_m));
        self.put(time_s, "slider", "vx_m_per_s", Some(end.vx_m_per_s));
    }

    pub(super) fn loads(&mut self, loads: &Loads) {
        let time_s = seconds(loads.stamp.as_ref());
        self.has_slider = loads.resistance_n.is_some();
        self.put(time_s, "", "driving_torque_nm", Some(loads.driving_torque_nm));
        self.put(time_s, "", "resistance_n", loads.resistance_n);
        self.put(time_s, "", "guide_force_n", loads.guide_force_n);
        for joint in &loads.joints {
            self.put(time_s, &joint.joint, "fx_n", Some(joint.fx_n));
            self.put(time_s, &joint.joint, "fy_n", Some(joint.fy_n));
        }
        for element in &loads.elements {
            let name = format!("{}.{}", element.link, element.index);
            self.put(time_s, &name, "axial_n", Some(element.axial_n));
            self.put(time_s, &name, "shear_n", Some(element.shear_n));
            self.put(time_s, &name, "moment_start_nm", Some(element.moment_start_nm));
        }
    }

    pub(super) fn energies(&mut self, energies: &Energies) {
        let time_s = seconds(energies.stamp.as_ref());
        self.has_energies = true;
        self.put(time_s, "", "kinetic_j", energies.kinetic_j);
        self.put(time_s, "", "strain_j", energies.strain_j);
        self.put(time_s, "", "potential_j", energies.potential_j);
        self.put(time_s, "", "work_in_j", energies.work_in_j);
        self.put(time_s, "", "dissipated_j", energies.dissipated_j);
        self.put(time_s, "", "balance_error_j", energies.balance_error_j);
        self.put(time_s, "", "energy_in_play_j", energies.energy_in_play_j);
    }

    pub(super) fn shadow(&mut self, shadow: &Shadow) {
        let time_s = seconds(shadow.stamp.as_ref());
        self.put(time_s, "shadow", "sim_time_s", shadow.stamp.map(|stamp| stamp.sim_time_s));
        self.put(time_s, "shadow", "angle_rad", Some(shadow.angle_rad));
        self.put(time_s, "shadow", "end_x_m", Some(shadow.end_x_m));
        self.put(time_s, "shadow", "joint_force_n", shadow.joint_force_n);
    }

    pub(super) fn status(&mut self, status: &Status) {
        let time_s = seconds(status.stamp.as_ref());
        self.put(time_s, "", "lateness_p99_s", status.lateness_p99_s);
        self.put(time_s, "", "sample_age_p99_s", status.sample_age_p99_s);
        if !self.has_energies {
            self.put(time_s, "", "kinetic_j", status.kinetic_j);
            self.put(time_s, "", "strain_j", status.strain_j);
            self.put(time_s, "", "potential_j", status.potential_j);
            self.put(time_s, "", "work_in_j", status.work_in_j);
            self.put(time_s, "", "dissipated_j", status.dissipated_j);
            self.put(time_s, "", "balance_error_j", status.balance_error_j);
        }
    }

    fn put(&mut self, time_s: f64, of: &str, what: &str, value: Option<f64>) {
        let Some(value) = value else { return };
        let name = if of.is_empty() { what.to_owned() } else { format!("{of}.{what}") };
        self.strips.entry(name).or_default().push(time_s, value);
    }

    /// All names, sorted.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.strips.keys().map(String::as_str)
    }

    /// Finds a signal by its short name, or by its name in `export`: `links.crank.chord_rad`.
    pub(super) fn find(&self, name: &str) -> Option<&Strip> {
        let known = |name: &str| self.strips.get(name);
        known(name).or_else(|| known(name.split_once('.')?.1))
    }

    /// The default signals: rate, end, torque, and the largest bending, as far as they exist.
    pub(super) fn defaults(&self) -> Vec<String> {
        let ending = |end: &str| self.names().find(|name| name.ends_with(end)).map(str::to_owned);
        let last = self.names().filter(|name| name.ends_with(".x_m")).last().map(str::to_owned);
        let end = if self.has_slider { Some("slider.x_m".to_owned()) } else { last };
        let usual = [ending(".rate_rad_per_s"), end, ending("driving_torque_nm"), self.most_bent(), ending("kinetic_j")];
        usual.into_iter().flatten().collect()
    }

    fn most_bent(&self) -> Option<String> {
        let size = |strip: &Strip| strip.last(f64::INFINITY).fold(0.0, |most: f64, entry| most.max(entry.high.abs()));
        let deflections = self.strips.iter().filter(|(name, _)| name.ends_with(".deflection_m"));
        let sizes = deflections.map(|(name, strip)| (name, size(strip)));
        sizes.max_by(|one, other| one.1.total_cmp(&other.1)).map(|(name, _)| name.clone())
    }
}

/// The topic whose messages show whether there is a signal of this name, by the last part of the name; `None` if no telemetry has it.
pub(super) fn topic_of_signal(name: &str) -> Option<Topic> {
    let (of, what) = name.rsplit_once('.').unwrap_or(("", name));
    match what {
        "driving_torque_nm" | "resistance_n" | "guide_force_n" => Some(Topic::Loads),
        "kinetic_j" | "strain_j" | "potential_j" | "work_in_j" | "dissipated_j" | "balance_error_j" | "energy_in_play_j" => {
            Some(Topic::Energies)
        }
        // All others are signals of a link, a node, a joint or an element.
        _ if of.is_empty() => None,
        "chord_rad" | "rate_rad_per_s" | "acceleration_rad_per_s2" => Some(Topic::Angles),
        // Loads show whether there is a slider.
        "x_m" | "vx_m_per_s" if of == "slider" => Some(Topic::Loads),
        "x_m" | "y_m" | "deflection_m" | "exact_x_m" => Some(Topic::Displacements),
        "fx_n" | "fy_n" | "axial_n" | "shear_n" | "moment_start_nm" => Some(Topic::Loads),
        _ => None,
    }
}

fn seconds(stamp: Option<&Stamp>) -> f64 {
    stamp.map_or(f64::NAN, |stamp| stamp.sim_time_s)
}
