//! The compared quantities: channels sampled at common instants, grouped into the outputs that a user names.

use crate::mechanics::{LinkObservation, Observation};
use crate::scene::{Chain, End};

/// A kind of result that a tolerance can bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OutputGroup {
    /// Crank angle (its chord's), rad.
    Angle,
    /// Position of the chain's end, over its stroke: the slider's, or the free end's.
    Slider,
    /// Deflection of each link's middle from its chord, over its peak.
    Deflection,
    /// Joint forces, over the peak at each joint.
    Forces,
    /// Balance of energy, over the largest kinetic and strain energy; known from a run alone, without a reference.
    Energy,
}

impl OutputGroup {
    /// All of them.
    pub const ALL: [OutputGroup; 5] =
        [OutputGroup::Angle, OutputGroup::Slider, OutputGroup::Deflection, OutputGroup::Forces, OutputGroup::Energy];
    /// The outputs that are compared with a reference.
    pub const COMPARED: [OutputGroup; 4] =
        [OutputGroup::Angle, OutputGroup::Slider, OutputGroup::Deflection, OutputGroup::Forces];
    /// The outputs that count unless others are named.
    pub const DEFAULT: [OutputGroup; 3] = [OutputGroup::Angle, OutputGroup::Slider, OutputGroup::Deflection];

    /// The word on the command line; see also [`Study::word`](super::Study::word).
    pub fn as_str(self) -> &'static str {
        match self {
            OutputGroup::Angle => "angle",
            OutputGroup::Slider => "slider",
            OutputGroup::Deflection => "deflection",
            OutputGroup::Forces => "forces",
            OutputGroup::Energy => "energy",
        }
    }
}

/// One quantity of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Channel {
    /// Its name in tables, with its unit.
    pub name: &'static str,
    /// The output it belongs to.
    pub output: OutputGroup,
}

const fn channel(name: &'static str, output: OutputGroup) -> Channel {
    Channel { name, output }
}

/// Everything that may be sampled, in the order of a sample.
pub const CHANNELS: [Channel; 7] = [
    channel("crank_angle_rad", OutputGroup::Angle),
    channel("end_position_m", OutputGroup::Slider),
    channel("first_link_deflection_m", OutputGroup::Deflection),
    channel("second_link_deflection_m", OutputGroup::Deflection),
    channel("pivot_force_n", OutputGroup::Forces),
    channel("crank_pin_force_n", OutputGroup::Forces),
    channel("slider_pin_force_n", OutputGroup::Forces),
];

/// One number or vector a channel; NaN where the model does not know it.
pub type Sample = [[f64; 2]; CHANNELS.len()];

/// A link with deflections below this fraction of its length counts as straight; its errors are relative to its length.
pub(crate) const STRAIGHT: f64 = 1e-6;

/// Reads samples off a chain's observations.
#[derive(Debug, Clone)]
pub(super) struct Probe<'a> {
    chain: &'a Chain,
}

impl<'a> Probe<'a> {
    pub(super) fn new(chain: &'a Chain) -> Self {
        Probe { chain }
    }

    pub(super) fn sample(&self, seen: &Observation) -> Sample {
        let unknown = [f64::NAN; 2];
        let end = seen.links.last().and_then(|link| link.nodes.last()).map_or(unknown, |node| node.position_m);
        let bow = |i: usize| match seen.links.get(i) {
            Some(link) => [self.middle_m(i, link), 0.0],
            None => [0.0; 2],
        };
        let angle = seen.links.first().map_or(f64::NAN, |link| link.chord_rad);
        let (has_pin, slides) = (self.chain.links.len() > 1, matches!(self.chain.end, End::Slider(_)));
        let force = |exists: bool, force: Option<[f64; 2]>| if exists { force.unwrap_or(unknown) } else { [0.0; 2] };
        [
            [angle, 0.0],
            end,
            bow(0),
            bow(1),
            force(true, seen.pivot_n),
            force(has_pin, seen.crank_pin_n),
            force(slides, seen.slider_pin_n),
        ]
    }

    /// Deflection of a link's middle, m: its middle node's, or, of a single element, its cubic's from the moments at its ends,
    /// `w(L/2) = −L² (M₁ + M₂) / (16 E J)`. A rigid link's is zero.
    fn middle_m(&self, i: usize, seen: &LinkObservation) -> f64 {
        let link = &self.chain.links[i];
        match (seen.nodes.len(), &link.bar, seen.elements.first()) {
            (2, Some(bar), Some(element)) if !link.rigid => {
                let moments_nm = element.moment_start_nm + element.moment_end_nm;
                -link.length_m.powi(2) * moments_nm / (16.0 * bar.bending_stiffness_nm2())
            }
            (nodes, ..) => seen.nodes.get(nodes / 2).and_then(|node| node.deflection_m).unwrap_or(0.0),
        }
    }
}

/// The scale that errors are divided by in each channel: 1 rad; stroke or reach; peak deflection; peak force.
pub(super) fn scales(chain: &Chain, reference: &[Sample]) -> [f64; CHANNELS.len()] {
    let lengths_m: Vec<f64> = chain.links.iter().map(|link| link.length_m).collect();
    let travel_m = match chain.end {
        End::Slider(_) => 2.0 * lengths_m[0],
        End::Free { .. } => lengths_m.iter().sum(),
    };
    let peak = |k: usize| reference.iter().map(|sample| sample[k][0].hypot(sample[k][1])).fold(0.0, f64::max);
    let bow = |i: usize| {
        let (peak_m, length_m) = (peak(2 + i), lengths_m.get(i).copied().unwrap_or(1.0));
        if peak_m < STRAIGHT * length_m { length_m } else { peak_m }
    };
    let force = |k: usize| if peak(k) > 0.0 { peak(k) } else { 1.0 };
    [1.0, travel_m, bow(0), bow(1), force(4), force(5), force(6)]
}

#[cfg(test)]
mod tests {
    use super::{CHANNELS, STRAIGHT, Sample, scales};
    use crate::scene::SceneSource;

    /// A deflection of a millionth of the length is noise: an error of the same size is no error of 100 %.
    #[test]
    fn regress_errors_of_a_straight_link_are_relative_to_its_length() {
        let source = SceneSource::open("ref-r2s", &[]).unwrap();
        let chain = source.scene.chain().unwrap();
        let lengths_m: Vec<f64> = chain.links.iter().map(|link| link.length_m).collect();
        let scaled = |parts: [f64; 2]| {
            let mut sample: Sample = [[0.0; 2]; CHANNELS.len()];
            (sample[2][0], sample[3][0]) = (parts[0] * lengths_m[0], parts[1] * lengths_m[1]);
            let scales = scales(chain, &[sample]);
            [scales[2] / lengths_m[0], scales[3] / lengths_m[1]]
        };
        assert_eq!(scaled([0.9 * STRAIGHT, 0.0]), [1.0, 1.0]);
        let bent = scaled([1e-3, 2.0 * STRAIGHT]);
        assert!((bent[0] / 1e-3 - 1.0).abs() < 1e-12 && (bent[1] / (2.0 * STRAIGHT) - 1.0).abs() < 1e-12, "{bent:?}");
    }
}
