//! The guide, one module per chapter. `flexcrank guide CHAPTER` prints a chapter in the terminal.

use crate::nearest::did_you_mean;

macro_rules! chapters {
    ($($module:ident: $name:literal, $summary:literal;)*) => {
        /// All chapters, in reading order.
        pub const CHAPTERS: &[Chapter] = &[$(Chapter { name: $name, summary: $summary, text: include_str!(concat!($name, ".md")) }),*];

        $(#[doc = include_str!(concat!($name, ".md"))] pub mod $module {})*
    };
}

chapters! {
    concepts: "concepts", "Words; threads and queues; pulses; what is not in flexcrank";
    scenes: "scenes", "Describe a mechanism; every key of a scene";
    models: "models", "Choose model, integrator and step; know whether to trust a run";
    bus: "bus", "Keys, messages, delivery, commands, watch; other machines";
    recordings: "recordings", "Record, verify, resume, repair, replay, export";
    ros2: "ros2", "A service as a node of ROS 2; bags";
    foxglove: "foxglove", "See a run or a replay in Foxglove or Lichtblick, and act on it";
    realtime: "real-time", "Deadlines, waiting, overruns, many services, systemd";
    security: "security", "Encryption, passwords, roles";
    analysis: "analysis", "Figures, cycle, trade, stability";
    campaigns: "campaigns", "Run a scene many times on one machine or many; sensitivity";
    exit_codes: "exit-codes", "The code that each command ends with";
    library: "library", "Three Rust programs; the modules";
    evidence: "evidence", "Measured: beside Exudyn and IDA, lateness, a flood of commands";
    development: "development", "Tests, trials and benchmarks";
}

/// A chapter of the guide.
#[derive(Debug, Clone, Copy)]
pub struct Chapter {
    /// Its name on the command line, and without `.md` that of its file.
    pub name: &'static str,
    /// Its content in one line.
    pub summary: &'static str,
    /// Its Markdown text, with HTML comments for the tests.
    pub text: &'static str,
}

/// There is no chapter of this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{given}: not a chapter of the guide{hint} (`flexcrank guide` lists them)")]
pub struct UnknownChapter {
    given: String,
    hint: String,
}

/// The chapter of this name.
///
/// # Errors
/// [`UnknownChapter`] with the nearest name when there is none.
pub fn find(name: &str) -> Result<&'static Chapter, UnknownChapter> {
    CHAPTERS.iter().find(|chapter| chapter.name == name).ok_or_else(|| {
        let hint = did_you_mean(name, CHAPTERS.iter().map(|chapter| chapter.name));
        UnknownChapter { given: name.to_owned(), hint }
    })
}

impl Chapter {
    /// The text for readers: without HTML comments, and without the lines of Rust programs that rustdoc hides.
    pub fn readable(&self) -> String {
        let mut in_rust = false;
        let shown = self.text.lines().filter(|line| {
            if line.starts_with("```") {
                in_rust = *line == "```rust";
            }
            let hidden = line.starts_with("<!--") || in_rust && line.starts_with("# ");
            !hidden
        });
        shown.map(|line| format!("{line}\n")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{CHAPTERS, find};

    #[test]
    fn prop_a_chapter_is_found_by_its_name_only() {
        assert_eq!(find("bus").map(|chapter| chapter.name), Ok("bus"));
        let refused = find("recording").map(|chapter| chapter.name).unwrap_err().to_string();
        assert!(refused.contains("did you mean `recordings`?"), "{refused}");
    }

    #[test]
    fn prop_readers_see_no_comments_and_no_hidden_lines() {
        for chapter in CHAPTERS {
            let text = chapter.readable();
            assert!(text.starts_with("# ") && !text.contains("<!--"), "{}", chapter.name);
        }
        assert!(!find("library").unwrap().readable().contains("Ok::<()"));
    }
}
