//! Which steps are published, topic by topic.

use std::str::FromStr;

use super::rate::PublishRate;

/// Topics of telemetry that have a rate each: displacements, angles, loads, energies.
pub const TELEMETRY: usize = 4;

/// How often the topics of telemetry are published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishRates {
    /// Of `displacements`.
    pub displacements: PublishRate,
    /// Of `angles`.
    pub angles: PublishRate,
    /// Of `loads`, whose mean torque is over the time between two of them.
    pub loads: PublishRate,
    /// Of `energies`.
    pub energies: PublishRate,
}

/// Which topics a step is published on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DueTopics {
    /// On `displacements`.
    pub displacements: bool,
    /// On `angles`.
    pub angles: bool,
    /// On `loads`.
    pub loads: bool,
    /// On `energies`.
    pub energies: bool,
}

impl DueTopics {
    /// On all of them.
    pub const ALL: DueTopics = DueTopics { displacements: true, angles: true, loads: true, energies: true };

    /// Topic by topic, in the order of the fields.
    pub fn by_topic(self) -> [bool; TELEMETRY] {
        [self.displacements, self.angles, self.loads, self.energies]
    }

    /// On any of them.
    pub fn any(self) -> bool {
        self.by_topic().contains(&true)
    }

    /// On those that `other` is not.
    pub fn without(self, other: DueTopics) -> DueTopics {
        DueTopics {
            displacements: self.displacements && !other.displacements,
            angles: self.angles && !other.angles,
            loads: self.loads && !other.loads,
            energies: self.energies && !other.energies,
        }
    }
}

impl From<PublishRate> for PublishRates {
    fn from(rate: PublishRate) -> Self {
        PublishRates { displacements: rate, angles: rate, loads: rate, energies: rate }
    }
}

impl PublishRates {
    /// Of a scene without angles and loads: the mean torque is taken with displacements.
    pub fn without_angles_and_loads(self) -> Self {
        PublishRates { energies: self.energies, ..self.displacements.into() }
    }

    /// The rate of every topic under its name.
    pub fn by_topic(&self) -> String {
        let PublishRates { displacements, angles, loads, energies } = self;
        format!("displacements={displacements},angles={angles},loads={loads},energies={energies}")
    }

    /// What step `step` of size `step_s` is published on.
    pub fn due_topics(&self, step: u64, step_s: f64) -> DueTopics {
        DueTopics {
            displacements: self.displacements.is_due(step, step_s),
            angles: self.angles.is_due(step, step_s),
            loads: self.loads.is_due(step, step_s),
            energies: self.energies.is_due(step, step_s),
        }
    }
}

impl std::fmt::Display for PublishRates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if PublishRates::from(self.displacements) == *self {
            return self.displacements.fmt(f);
        }
        f.write_str(&self.by_topic())
    }
}

/// Not rates.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a rate ({rate}), or rates of topics: 100,angles=all,loads=20; the topics are displacements, angles, loads and energies", rate = super::BadRate)]
pub struct BadRates;

impl FromStr for PublishRates {
    type Err = BadRates;

    /// A rate for all topics, rates for single ones, or both: `100,angles=all`. Energies have the rate of loads unless they are
    /// named themselves.
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
        let mut rates = rates.unwrap_or_else(|| PublishRate::DEFAULT.into());
        let mut energies = None;
        for (topic, rate) in named {
            match topic {
                "displacements" => rates.displacements = rate,
                "angles" => rates.angles = rate,
                "loads" => rates.loads = rate,
                "energies" => energies = Some(rate),
                _ => return Err(BadRates),
            }
        }
        Ok(PublishRates { energies: energies.unwrap_or(rates.loads), ..rates })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_rates_are_read_and_written() {
        let [displacements, loads] = [20.0, 100.0].map(PublishRate::Hz);
        let rates = PublishRates { displacements, angles: PublishRate::All, loads, energies: loads };
        for text in ["100,angles=all,displacements=20", "displacements=20,angles=all,loads=100", &rates.to_string()] {
            assert_eq!(text.parse(), Ok(rates), "{text}");
        }
        let energies = PublishRate::Hz(5.0);
        let slower = PublishRates { energies, ..rates };
        for text in ["energies=5,100,angles=all,displacements=20", &slower.to_string(), &slower.by_topic()] {
            assert_eq!(text.parse(), Ok(slower), "{text}");
        }
        assert_eq!("energies=5".parse(), Ok(PublishRates { energies, ..PublishRate::DEFAULT.into() }));
        assert_eq!(slower.without_angles_and_loads(), PublishRates { energies, ..displacements.into() });
        assert_eq!("37".parse(), Ok(PublishRates::from(PublishRate::Hz(37.0))));
        assert_eq!(PublishRates::from(PublishRate::All).to_string(), "all");
        for text in ["", "0", "status=1", "angles", "1,2", "angles=all=1", "angles=-1"] {
            assert_eq!(text.parse::<PublishRates>(), Err(BadRates), "{text}");
        }
    }

    #[test]
    fn prop_a_step_is_published_where_its_rate_takes_it() {
        let rates: PublishRates = "angles=500,loads=100,displacements=10,energies=50".parse().unwrap_or(PublishRate::All.into());
        let due = |step| rates.due_topics(step, 1e-3);
        assert!(!due(1).any());
        assert_eq!(due(2), DueTopics { angles: true, ..DueTopics::default() });
        assert_eq!(due(10), DueTopics { angles: true, loads: true, ..DueTopics::default() });
        assert_eq!(due(20), DueTopics { displacements: false, ..DueTopics::ALL });
        assert_eq!(
            (due(100), DueTopics::ALL.without(due(20))),
            (DueTopics::ALL, DueTopics { displacements: true, ..DueTopics::default() })
        );
    }
}
