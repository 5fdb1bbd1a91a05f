//! Deflections of links and places of masses, with their rates, as they were recorded.

use std::collections::BTreeSet;

use crate::study::Table;
use crate::study::trade::STRAIGHT;

/// The name of an oscillator's masses in topics, where those of links are.
pub(super) const MASSES: &str = "mass";

/// The links that have nodes.
pub(super) fn links(displacements: &Table) -> BTreeSet<String> {
    let link = |name: &str| Some(name.strip_prefix("nodes.")?.strip_suffix(".0.x_m")?.to_owned());
    displacements.columns().filter_map(|(name, _)| link(name)).collect()
}

/// The deflection of a link at the node that bends most, or the place of a mass.
pub(super) struct Deflection<'a> {
    pub(super) deflections_m: &'a [f64],
    pub(super) rates_m_per_s: Vec<f64>,
    /// From the least to the greatest; that of a straight link is a millionth of its length, that of a resting mass of its place, or of what another
    /// moves.
    pub(super) range_m: f64,
}

impl<'a> Deflection<'a> {
    /// That of a link, or those of an oscillator's masses, each with its name and that in topics, as `mass.0`.
    pub(super) fn all_of(displacements: &'a Table, link: &str) -> Vec<([String; 2], Self)> {
        if link != MASSES {
            return Self::of(displacements, link)
                .map(|of_link| ([format!("the {link}"), link.to_owned()], of_link))
                .into_iter()
                .collect();
        }
        let of_mass = |mass: usize| {
            let names = [format!("mass {}", mass + 1), format!("{MASSES}.{mass}")];
            Some((names, Self::of_mass(displacements, mass)?))
        };
        let mut all: Vec<([String; 2], Self)> = (0..).map_while(of_mass).collect();
        let largest_m = all.iter().map(|(_, mass)| mass.range_m).fold(0.0, f64::max);
        all.iter_mut().for_each(|(_, mass)| mass.range_m = mass.range_m.max(STRAIGHT * largest_m));
        all
    }

    /// `None` if there is no such mass.
    fn of_mass(displacements: &'a Table, mass: usize) -> Option<Self> {
        let column = |field: &str| displacements.column(&format!("nodes.{MASSES}.{mass}.{field}"));
        let (places_m, rates_m_per_s) = (column("x_m")?, column("vx_m_per_s")?.to_vec());
        let ends_m = |ends: [f64; 2], place_m: &f64| [ends[0].min(*place_m), ends[1].max(*place_m)];
        let [least_m, most_m] = places_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends_m);
        let range_m = (most_m - least_m).max(STRAIGHT * least_m.abs().max(most_m.abs()));
        Some(Deflection { deflections_m: places_m, rates_m_per_s, range_m })
    }

    /// `None` for links without nodes between their pins.
    fn of(displacements: &'a Table, link: &str) -> Option<Self> {
        let column = |node: usize, field: &str| displacements.column(&format!("nodes.{link}.{node}.{field}"));
        let last = (1..).take_while(|node| column(*node, "x_m").is_some()).last()?;
        let inner = (1..last).filter_map(|node| Some((node, column(node, "deflection_m")?)));
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let (node, deflections_m) = inner.max_by(|one, other| largest(one.1).total_cmp(&largest(other.1)))?;
        let motion = |node: usize| {
            let [x, y] = ["x_m", "y_m"].map(|field| column(node, field));
            let [u, v] = ["vx_m_per_s", "vy_m_per_s"].map(|field| column(node, field));
            Some([x?, y?, u?, v?])
        };
        let [first, inner, last] = [motion(0)?, motion(node)?, motion(last)?];
        let from_first = |node: [&[f64]; 4], row: usize| -> [f64; 4] { std::array::from_fn(|k| node[k][row] - first[k][row]) };
        let rate = |row: usize| deflection_rate(from_first(inner, row), from_first(last, row));
        let rows = 0..deflections_m.len();
        let [least_m, most_m] = deflections_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], deflection_m| {
            [least.min(*deflection_m), most.max(*deflection_m)]
        });
        let length = |[x, y, ..]: [f64; 4]| x.hypot(y);
        let length_m = rows.clone().map(|row| length(from_first(last, row))).fold(0.0, f64::max);
        let range_m = (most_m - least_m).max(STRAIGHT * length_m);
        Some(Deflection { deflections_m, rates_m_per_s: rows.map(rate).collect(), range_m })
    }
}

/// Rate of a deflection `w = a × p/|a|` from the chord `a`, m/s, with `ẇ = (a × ṗ − β̇ a·p)/|a|` and `β̇ = a × ȧ/|a|²`. Both vectors
/// begin at the link's first pin: `p` ends at the node and `a` at the last pin. They come with their rates.
fn deflection_rate([px, py, pu, pv]: [f64; 4], [ax, ay, au, av]: [f64; 4]) -> f64 {
    let length_m = ax.hypot(ay);
    let turning_rad_per_s = (ax * av - ay * au) / length_m.powi(2);
    (ax * pv - ay * pu - turning_rad_per_s * (ax * px + ay * py)) / length_m
}
