//! A worker's share of a campaign.

use std::str::FromStr;

/// Share `index` of `count`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

/// A share is not possible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BadShard(String);

impl FromStr for Shard {
    type Err = BadShard;

    fn from_str(text: &str) -> Result<Self, BadShard> {
        let parts = text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        let shard = parts.map(|(index, count)| Shard { index, count });
        shard
            .filter(|shard| (1..=shard.count).contains(&shard.index))
            .ok_or_else(|| BadShard("a share such as 3/16: I/N with I from 1 to N".to_owned()))
    }
}

impl Shard {
    /// The share that a scheduler's environment names: a Slurm job array, or an indexed job of Kubernetes whose number of completions
    /// is in `JOB_COMPLETIONS`. `None` outside of both.
    ///
    /// # Errors
    /// [`BadShard`] if the variables are incomplete or contradict each other.
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Result<Option<Self>, BadShard> {
        let number = |name: &str| match variable(name) {
            Some(text) => {
                text.trim().parse::<u64>().map(Some).map_err(|_| BadShard(format!("{name}={text}: not a whole number")))
            }
            None => Ok(None),
        };
        let (name, place, count) = match (number("SLURM_ARRAY_TASK_ID")?, number("JOB_COMPLETION_INDEX")?) {
            (Some(id), _) => {
                let (least, step) =
                    (number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0), number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1));
                let place = id.checked_sub(least).map(|place| place / step);
                ("SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT", place, number("SLURM_ARRAY_TASK_COUNT")?)
            }
            (None, Some(index)) => ("JOB_COMPLETION_INDEX and JOB_COMPLETIONS", Some(index), number("JOB_COMPLETIONS")?),
            (None, None) => return Ok(None),
        };
        let shard =
            place.zip(count).filter(|(place, count)| place < count).map(|(place, count)| Shard { index: place + 1, count });
        shard.map(Some).ok_or_else(|| BadShard(format!("{name} do not name a share: set both, or give --shard I/N")))
    }

    /// Whether a chunk belongs to this share.
    pub fn has(self, chunk: u64) -> bool {
        chunk % self.count == self.index - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(variables: &[(&str, &str)]) -> Result<Option<Shard>, BadShard> {
        Shard::of_environment(|name| variables.iter().find(|(other, _)| *other == name).map(|(_, value)| (*value).to_owned()))
    }

    #[test]
    fn val_shares_of_schedulers() {
        assert_eq!(found(&[]), Ok(None));
        let slurm = |id, least, count| {
            found(&[("SLURM_ARRAY_TASK_ID", id), ("SLURM_ARRAY_TASK_MIN", least), ("SLURM_ARRAY_TASK_COUNT", count)])
        };
        assert_eq!(slurm("0", "0", "4"), Ok(Some(Shard { index: 1, count: 4 })));
        assert_eq!(slurm("4", "1", "4"), Ok(Some(Shard { index: 4, count: 4 })));
        let stepped = [("SLURM_ARRAY_TASK_STEP", "10"), ("SLURM_ARRAY_TASK_ID", "30"), ("SLURM_ARRAY_TASK_COUNT", "4")];
        assert_eq!(found(&stepped), Ok(Some(Shard { index: 4, count: 4 })));
        assert_eq!(found(&[("JOB_COMPLETION_INDEX", "0"), ("JOB_COMPLETIONS", "3")]), Ok(Some(Shard { index: 1, count: 3 })));
        for bad in [&[("JOB_COMPLETION_INDEX", "0")][..], &[("SLURM_ARRAY_TASK_ID", "x")], &[("SLURM_ARRAY_TASK_ID", "1")]] {
            assert!(found(bad).is_err(), "{bad:?}");
        }
        assert!(slurm("5", "1", "4").is_err());
    }

    #[test]
    fn prop_every_chunk_belongs_to_one_share() {
        let shares: Vec<Shard> = (1..=5).map(|index| format!("{index}/5").parse().unwrap()).collect();
        assert!((0..100).all(|chunk| shares.iter().filter(|share| share.has(chunk)).count() == 1));
        assert!(["0/5", "6/5", "1", "1/0", "-1/2", "a/b"].iter().all(|text| text.parse::<Shard>().is_err()));
    }
}
