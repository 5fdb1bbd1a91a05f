//! Files for other programs, which `flexcrank files NAME` prints: `cargo install` ships nothing but the program.

use crate::nearest::did_you_mean;

/// A file for another program.
#[derive(Debug, Clone, Copy)]
pub struct File {
    /// Its usual name.
    pub name: &'static str,
    /// Its purpose in one line.
    pub summary: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// All files.
pub const FILES: &[File] = &[
    File {
        name: "flexcrank.service",
        summary: "systemd unit: a scene that starts with the machine",
        text: include_str!("flexcrank.service"),
    },
    File {
        name: "gate.json5",
        summary: "zenoh configuration of the router or service that listens: TLS, passwords, roles",
        text: include_str!("gate.json5"),
    },
    File {
        name: "member.json5",
        summary: "zenoh configuration of the programs that connect to it",
        text: include_str!("member.json5"),
    },
    File {
        name: "foxglove-layout.json",
        summary: "layout for Foxglove and Lichtblick: the mechanism beside charts",
        text: include_str!("foxglove-layout.json"),
    },
    File {
        name: "sweep.toml",
        summary: "campaign for `flexcrank sweep`: sensitivity of joint forces to three keys",
        text: include_str!("sweep.toml"),
    },
    File {
        name: "flexcrank.proto",
        summary: "all messages on the bus and in recordings: their fields, and when each is present",
        text: include_str!("../../proto/flexcrank.proto"),
    },
    File { name: "to-rerun", summary: "Python script: converts a recording for Rerun", text: include_str!("to-rerun") },
];

/// There is no file of this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{given}: no such file in the program{hint} (`flexcrank files` lists them)")]
pub struct UnknownFile {
    given: String,
    hint: String,
}

/// The file of this name.
///
/// # Errors
/// [`UnknownFile`] with the nearest name when there is none.
pub fn find(name: &str) -> Result<&'static File, UnknownFile> {
    FILES.iter().find(|file| file.name == name).ok_or_else(|| {
        let hint = did_you_mean(name, FILES.iter().map(|file| file.name));
        UnknownFile { given: name.to_owned(), hint }
    })
}

#[cfg(test)]
mod tests {
    use super::find;

    #[test]
    fn prop_a_file_is_found_by_its_name_only() {
        assert_eq!(find("gate.json5").map(|file| file.name), Ok("gate.json5"));
        let refused = find("gate.json").map(|file| file.name).unwrap_err().to_string();
        assert!(refused.contains("did you mean `gate.json5`?"), "{refused}");
    }

    /// The guide named a file that came with the source alone.
    #[test]
    fn regress_the_program_prints_the_fields_of_its_messages() {
        let text = find("flexcrank.proto").map(|file| file.text).unwrap();
        for part in ["message Displacements {", "optional double deflection_m", "message Snapshot {"] {
            assert!(text.contains(part), "{part}");
        }
    }
}
