//! Chains of every kind with everything on them, as scenes.

/// The end of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Crank, rod and slider.
    Slider,
    /// Two links, the second free with a tip mass.
    Free,
    /// One link, free with a tip mass.
    Beam,
}

/// A kind of chain.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Its end.
    pub shape: Shape,
    /// Rigid links; each has its centre of mass off the middle.
    pub rigid: [bool; 2],
    /// Whether the pivot's motion is prescribed.
    pub driven: bool,
    /// Material damping of the flexible links.
    pub damped: bool,
    /// Whether `modal` lets its links stretch.
    pub axial: bool,
    /// Resistance by a table over the crank's angle.
    pub table: bool,
    /// Elements a link.
    pub elements: usize,
}

impl Kind {
    /// Flexible, undamped, of 4 elements a link.
    pub fn plain(shape: Shape) -> Self {
        Kind { shape, rigid: [false; 2], driven: false, damped: false, axial: false, table: false, elements: 4 }
    }

    /// The scene: gravity askew, spring and damper at the base, friction and resistance or a tip mass at the end.
    pub fn toml(&self) -> String {
        let mut text = String::new();
        let links: &[(&str, f64)] = if self.shape == Shape::Beam { &[("beam", 0.5)] } else { &[("crank", 0.5), ("rod", 1.5)] };
        for ((name, length), rigid) in links.iter().zip(self.rigid) {
            text += &format!("[{name}]\nlength_m = {length}\nelements = {}\n", self.elements);
            text += &if rigid { self.body(*length) } else { self.bar() };
        }
        text += match (self.shape, self.table) {
            (Shape::Slider, false) => "[slider]\nmass_kg = 0.7\nfriction_n_s_per_m = 3.0\nresistance_n = 11.0\n",
            (Shape::Slider, true) => {
                "[slider]\nmass_kg = 0.7\nfriction_n_s_per_m = 3.0\nresistance_table = [[0.0, 20.0], [1.0, 50.0], [4.0, -30.0]]\n"
            }
            _ => "[tip]\nmass_kg = 0.3\n",
        };
        text += "[base]\ntorsion_spring_nm_per_rad = 12.0\ndamper_nm_s_per_rad = 0.7\n";
        text += "[gravity]\nx_m_per_s2 = 0.5\ny_m_per_s2 = -9.81\n[start]\nangle_rad = 0.6\nrate_rad_per_s = 2.0\n";
        text += if self.driven {
            "[drive]\nramp = { to_rad_per_s = 9.0, over_s = 0.2 }\n"
        } else {
            "[[pulse]]\nstart_s = 0.0\ntorque_nm = 8.0\nduration_s = 0.1\nshape = \"raised-cosine\"\n"
        };
        text
    }

    fn body(&self, length_m: f64) -> String {
        let (mass, centre, inertia) = (0.8 * length_m, 0.4 * length_m, 0.1 * length_m.powi(3));
        format!("rigid = true\nmass_kg = {mass}\ncentre_of_mass_m = {centre}\ninertia_kg_m2 = {inertia}\n")
    }

    fn bar(&self) -> String {
        let damping_s = if self.damped { 1e-3 } else { 0.0 };
        format!(
            "area_m2 = 1e-4\nsecond_moment_m4 = 8.333e-9\ndensity_kg_per_m3 = 7700.0\nyoungs_modulus_pa = 2.1e9\n\
             axial = {}\ndamping_s = {damping_s}\n",
            self.axial
        )
    }
}
