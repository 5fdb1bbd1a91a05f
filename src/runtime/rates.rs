//! Publishing rates by topic: which steps are published on which topics.

use std::str::FromStr;

use super::rate::PublishRate;

/// Number of telemetry topics with a rate: displacements, angles, loads, energies.
pub const TELEMETRY: usize = 4;

/// Publishing rates of the telemetry topics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishRates {
    /// Rate of `displacements`.
    pub displacements: PublishRate,
    /// Rate of `angles`.
    pub angles: PublishRate,
    /// Rate of `loads`; its torque is the mean since the previous message.
    pub loads: PublishRate,
    /// Rate of `energies`.
    pub energies: PublishRate,
}

/// The topics that a step is published on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DueTopics {
    /// Published on `displacements`.
    pub displacements: bool,
    /// Published on `angles`.
    pub angles: bool,
    /// Published on `loads`.
    pub loads: bool,
    /// Published on `energies`.
    pub energies: bool,
}

impl DueTopics {
    /// Published on every topic.
    pub const ALL: DueTopics = DueTopics { displacements: true, angles: true, loads: true, energies: true };

    /// The flags in the order of the fields.
    pub fn by_topic(self) -> [bool; TELEMETRY] {
        [self.displacements, self.angles, self.loads, self.energies]
    }

    /// Whether the step is published at all.
    pub fn any(self) -> bool {
        self.by_topic().contains(&true)
    }

    /// The topics of this that `other` lacks.
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
    /// Rates for a scene that has no angles and loads: the mean torque follows `displacements`.
    pub fn without_angles_and_loads(self) -> Self {
        PublishRates { energies: self.energies, ..self.displacements.into() }
    }

    /// Formats the rate of every topic by name, even if all are equal.
    pub fn by_topic(&self) -> String {
        let PublishRates { displacements, angles, loads, energies } = self;
        format!("displacements={displacements},angles={angles},loads={loads},energies={energies}")
    }

    /// Returns the topics that step `step` of size `step_s` is published on.
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

/// The text is not a list of publishing rates.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a rate ({rate}), or rates of topics: 100,angles=all,loads=20; the topics are displacements, angles, loads and energies", rate = super::BadRate)]
pub struct BadRates;

impl FromStr for PublishRates {
    type Err = BadRates;

    /// Parses one rate for all topics, rates by topic, or both: `100,angles=all`. Energies have the rate of loads unless named.
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
    fn val_rates_are_parsed_and_formatted() {
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
    fn prop_a_step_is_published_on_every_topic_whose_rate_is_due() {
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
