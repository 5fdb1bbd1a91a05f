//! Publishing rates as text: `100,angles=all`.

use std::fmt;
use std::str::FromStr;

use crate::simulation::{BadRate, PerTelemetry, PublishRate, PublishRates};

impl fmt::Display for PublishRates {
    /// Names every topic, even if all rates are equal.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rates = self.by_topic().map(|(topic, rate)| format!("{}={rate}", topic.chunk()));
        f.write_str(&rates.join(","))
    }
}

/// The text is not a list of publishing rates.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a rate ({rate}), or rates of topics: 100,angles=all,loads=20; the topics, each once, are displacements, angles, loads and energies", rate = BadRate)]
pub struct BadRates;

impl FromStr for PublishRates {
    type Err = BadRates;

    /// Parses one rate for all topics, rates by topic, or both: `100,angles=all`. Energies have the rate of loads unless named.
    fn from_str(text: &str) -> Result<Self, BadRates> {
        let (mut general, mut named) = (None, PerTelemetry::default().by_topic());
        for part in text.split(',') {
            let (place, rate) = match part.split_once('=') {
                Some((topic, rate)) => (named.iter_mut().find(|(known, _)| known.chunk() == topic).map(|(_, place)| place), rate),
                None => (Some(&mut general), part),
            };
            // A topic that is named twice is a slip.
            *place.filter(|place| place.is_none()).ok_or(BadRates)? = Some(rate.parse().map_err(|_| BadRates)?);
        }
        let [displacements, angles, loads, energies] = named.map(|(_, rate)| rate);
        let named = PerTelemetry { displacements, angles, loads, energies: energies.or(loads) };
        Ok(named.map(|rate: Option<PublishRate>| rate.or(general).unwrap_or(PublishRate::DEFAULT)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_rates_are_parsed_and_formatted() {
        let [displacements, loads] = [20.0, 100.0].map(PublishRate::Hz);
        let rates = PublishRates { displacements, angles: PublishRate::All, loads, energies: loads };
        for text in ["100,angles=all,displacements=20", "displacements=20,angles=all,loads=100", &rates.to_string()] {
            assert_eq!(text.parse(), Ok(rates), "{text}");
        }
        let energies = PublishRate::Hz(5.0);
        let slower = PublishRates { energies, ..rates };
        for text in ["energies=5,100,angles=all,displacements=20", &slower.to_string()] {
            assert_eq!(text.parse(), Ok(slower), "{text}");
        }
        assert_eq!(slower.to_string(), "displacements=20,angles=all,loads=100,energies=5");
        assert_eq!("energies=5".parse(), Ok(PublishRates { energies, ..PublishRate::DEFAULT.into() }));
        assert_eq!("37".parse(), Ok(PublishRates::from(PublishRate::Hz(37.0))));
        for text in ["", "0", "status=1", "angles", "1,2", "angles=all=1", "angles=-1", "angles=1,angles=2"] {
            assert_eq!(text.parse::<PublishRates>(), Err(BadRates), "{text}");
        }
    }

    #[test]
    fn prop_a_step_is_published_on_every_topic_whose_rate_is_due() {
        let rates: PublishRates = "angles=500,loads=100,displacements=10,energies=50".parse().unwrap_or(PublishRate::All.into());
        let due =
            |step| rates.map(|rate| rate.is_due(step, &crate::simulation::StepGrid::new(1e-3))).by_topic().map(|(_, due)| due);
        let expected =
            [[false; 4], [false, true, false, false], [false, true, true, false], [false, true, true, true], [true; 4]];
        assert_eq!([1, 2, 10, 20, 100].map(due), expected);
    }
}
