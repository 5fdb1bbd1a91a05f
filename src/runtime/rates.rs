//! Which steps are published, topic by topic.

use std::str::FromStr;

use super::rate::PublishRate;

/// How often the topics of telemetry are published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishRates {
    /// Of `displacements`.
    pub displacements: PublishRate,
    /// Of `angles`.
    pub angles: PublishRate,
    /// Of `loads`, whose mean torque is over the time between two of them.
    pub loads: PublishRate,
}

/// Which topics a step is published on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Due {
    /// On `displacements`.
    pub displacements: bool,
    /// On `angles`.
    pub angles: bool,
    /// On `loads`.
    pub loads: bool,
}

impl Due {
    /// On all of them.
    pub const ALL: Due = Due { displacements: true, angles: true, loads: true };

    /// On any of them.
    pub fn any(self) -> bool {
        self.displacements || self.angles || self.loads
    }

    /// On those that `other` is not.
    pub fn without(self, other: Due) -> Due {
        Due {
            displacements: self.displacements && !other.displacements,
            angles: self.angles && !other.angles,
            loads: self.loads && !other.loads,
        }
    }
}

impl From<PublishRate> for PublishRates {
    fn from(rate: PublishRate) -> Self {
        PublishRates { displacements: rate, angles: rate, loads: rate }
    }
}

impl PublishRates {
    /// Of a scene of which only displacements are published.
    pub fn of_displacements_only(self) -> Self {
        self.displacements.into()
    }

    /// What step `step` of size `step_s` is published on.
    pub fn takes(&self, step: u64, step_s: f64) -> Due {
        Due {
            displacements: self.displacements.takes(step, step_s),
            angles: self.angles.takes(step, step_s),
            loads: self.loads.takes(step, step_s),
        }
    }
}

impl std::fmt::Display for PublishRates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let PublishRates { displacements, angles, loads } = self;
        if displacements == angles && angles == loads {
            return displacements.fmt(f);
        }
        write!(f, "displacements={displacements},angles={angles},loads={loads}")
    }
}

/// Not rates.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a rate ({rate}), or rates of topics: 100,angles=all,loads=20; the topics are displacements, angles and loads", rate = super::BadRate)]
pub struct BadRates;

impl FromStr for PublishRates {
    type Err = BadRates;

    /// A rate for all topics, rates for single ones, or both: `100,angles=all`.
    fn from_str(text: &str) -> Result<Self, BadRates> {
        let mut rates: Option<PublishRates> = None;
        let mut named = Vec::new();
        for part in text.split(',') {
            match part.split_once('=') {
                Some((topic, rate)) => named.push((topic, rate.parse::<PublishRate>().map_err(|_| BadRates)?)),
                None if rates.is_none() => rates = Some(part.parse::<PublishRate>().map_err(|_| BadRates)?.into()),
                None => return Err(BadRates),
            }
        }
        let mut rates = rates.unwrap_or_else(|| PublishRate::USUAL.into());
        for (topic, rate) in named {
            match topic {
                "displacements" => rates.displacements = rate,
                "angles" => rates.angles = rate,
                "loads" => rates.loads = rate,
                _ => return Err(BadRates),
            }
        }
        Ok(rates)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_rates_are_read_and_written() {
        let rates =
            PublishRates { displacements: PublishRate::Hz(20.0), angles: PublishRate::All, loads: PublishRate::Hz(100.0) };
        for text in ["100,angles=all,displacements=20", "displacements=20,angles=all,loads=100", &rates.to_string()] {
            assert_eq!(text.parse(), Ok(rates), "{text}");
        }
        assert_eq!("37".parse(), Ok(PublishRates::from(PublishRate::Hz(37.0))));
        assert_eq!(PublishRates::from(PublishRate::All).to_string(), "all");
        for text in ["", "0", "status=1", "angles", "1,2", "angles=all=1", "angles=-1"] {
            assert_eq!(text.parse::<PublishRates>(), Err(BadRates), "{text}");
        }
    }

    #[test]
    fn prop_a_step_is_published_where_its_rate_takes_it() {
        let rates: PublishRates = "angles=500,loads=100,displacements=10".parse().unwrap_or(PublishRate::All.into());
        let due = |step| rates.takes(step, 1e-3);
        assert!(!due(1).any());
        assert_eq!(due(2), Due { angles: true, ..Due::default() });
        assert_eq!(due(10), Due { angles: true, loads: true, ..Due::default() });
        assert_eq!((due(100), Due::ALL.without(due(10))), (Due::ALL, Due { displacements: true, ..Due::default() }));
    }
}
