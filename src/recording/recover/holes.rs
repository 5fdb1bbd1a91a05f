//! Recorded time without messages: around damage, and where the numbers of a topic's messages jump.

use std::collections::VecDeque;

/// Gaps that are kept: of more, the longest of all is forgotten.
const KEPT: usize = 64;

/// A time between two messages, of any topics.
#[derive(Clone, Copy)]
struct Gap {
    /// Log time of the later message, ns.
    end_ns: u64,
    length_ns: u64,
}

/// The holes of a file, from message to message in file order.
#[derive(Default)]
pub(super) struct Holes {
    /// Whether messages are missing just before the next one.
    pub opens: bool,
    /// Time without messages at damaged places, ns.
    pub damaged_ns: u64,
    /// The same where only numbers tell that messages are missing, ns.
    pub taken_out_ns: u64,
    /// Log time of the last message, ns.
    last_ns: Option<u64>,
    /// End of the last hole, ns.
    hole_end_ns: u64,
    /// Gaps since then, each longer than those after it.
    gaps: VecDeque<Gap>,
}

impl Holes {
    /// Takes a message. `jumped_since_ns`: the log time of the last one of its topic, if numbers between them are missing.
    pub fn message(&mut self, log_time: u64, jumped_since_ns: Option<u64>) {
        let length_ns = log_time.saturating_sub(self.last_ns.unwrap_or(log_time));
        self.last_ns = Some(self.last_ns.unwrap_or(0).max(log_time));
        if std::mem::take(&mut self.opens) {
            self.damaged_ns += length_ns;
            return self.close(log_time);
        }
        while self.gaps.pop_back_if(|gap| gap.length_ns <= length_ns).is_some() {}
        self.gaps.push_back(Gap { end_ns: log_time, length_ns });
        if self.gaps.len() > KEPT {
            self.gaps.pop_front();
        }
        // Another topic may have told of the same hole, and a message of one that lost nothing may come first behind it.
        let Some(since_ns) = jumped_since_ns.filter(|since_ns| *since_ns >= self.hole_end_ns) else { return };
        if let Some(hole) = self.gaps.iter().find(|gap| gap.end_ns > since_ns).copied() {
            self.taken_out_ns += hole.length_ns;
            self.close(hole.end_ns);
        }
    }

    fn close(&mut self, end_ns: u64) {
        self.hole_end_ns = end_ns;
        self.gaps.retain(|gap| gap.end_ns > end_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::Holes;

    /// Messages as log times, and the time since which their topic jumped.
    fn holes(messages: &[(u64, Option<u64>)]) -> Holes {
        let mut holes = Holes::default();
        messages.iter().for_each(|(at, since)| holes.message(*at, *since));
        holes
    }

    /// Behind the hole from 20 to 60, a topic that lost nothing comes first, as a report may; two others tell of the hole.
    #[test]
    fn regress_a_message_of_a_topic_that_lost_nothing_hides_no_hole() {
        let before = [(10, None), (15, None), (20, None), (20, None)];
        let behind = [(60, None), (61, Some(20)), (61, Some(20)), (66, None), (71, None)];
        assert_eq!(holes(&[&before[..], &behind].concat()).taken_out_ns, 40);
        // A second hole, and a slow topic that lost a message in both.
        let second = [(90, Some(71)), (90, Some(71)), (91, Some(15))];
        assert_eq!(holes(&[&before[..], &behind, &second].concat()).taken_out_ns, 40 + 19);
    }

    #[test]
    fn prop_damage_counts_once() {
        let mut holes = holes(&[(10, None), (15, None)]);
        holes.opens = true;
        holes.message(40, None);
        holes.message(41, Some(15));
        assert_eq!((holes.damaged_ns, holes.taken_out_ns), (25, 0));
    }
}
