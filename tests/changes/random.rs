//! Random changes of a scene.

/// Numbers that look random (Knuth's linear congruence).
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count
    }

    pub fn of<'a>(&mut self, words: &[&'a str]) -> &'a str {
        words[self.below(words.len())]
    }

    /// Between two numbers, with three digits.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below(1001) as f64 / 1000.0
    }

    /// A change of one key or a few that belong together.
    pub fn change(&mut self) -> Vec<String> {
        let link = self.of(&["crank", "rod"]);
        let one = |key: String, value: String| vec![format!("{key}={value}")];
        match self.below(21) {
            0 => one("slider.mass_kg".into(), self.between(0.05, 0.6).to_string()),
            1 => one(format!("{link}.youngs_modulus_pa"), format!("{:e}", self.between(1.0e11, 3.0e11))),
            2 => one(format!("{link}.density_kg_per_m3"), self.between(5000.0, 9000.0).to_string()),
            3 => one(format!("{link}.damping_s"), format!("{:e}", self.between(0.5e-4, 3e-4))),
            4 => one("slider.friction_n_s_per_m".into(), self.between(0.0, 0.5).to_string()),
            5 => one("slider.resistance_n".into(), self.between(-0.5, 0.5).to_string()),
            6 => one("gravity.y_m_per_s2".into(), self.between(-9.81, 0.0).to_string()),
            7 => one("gravity.x_m_per_s2".into(), self.between(-1.0, 1.0).to_string()),
            8 => one("torque.constant_nm".into(), self.between(-0.3, 0.3).to_string()),
            9 => one("base.damper_nm_s_per_rad".into(), self.between(0.0, 0.02).to_string()),
            10 => one("commands.torque_limit_nm".into(), self.between(5.0, 50.0).to_string()),
            11 => one(format!("{link}.modes"), (1 + self.below(8)).to_string()),
            12 => one(format!("{link}.axial"), self.of(&["true", "false"]).into()),
            13 => one(format!("{link}.elements"), self.of(&["2", "3", "4", "8", "16", "32"]).into()),
            14 => one(format!("{link}.rigid"), self.of(&["true", "false"]).into()),
            15 => one("solver.step_s".into(), self.of(&["5e-4", "1e-3", "2e-3"]).into()),
            16 => one("solver.tolerance".into(), self.of(&["1e-9", "1e-10", "1e-8"]).into()),
            17 => one("start.angle_rad".into(), self.between(0.0, 3.0).to_string()),
            18 => one("solver.balance_tolerance".into(), self.of(&["1e-2", "5e-2"]).into()),
            _ => {
                let [model, integrator] = [
                    ["rigid", "esdirk"],
                    ["rigid", "runge-kutta"],
                    ["modal", "esdirk"],
                    ["finite-element", "esdirk"],
                    ["modal", "esdirk"],
                ][self.below(5)];
                vec![format!("solver.model={model}"), format!("solver.integrator={integrator}")]
            }
        }
    }
}
