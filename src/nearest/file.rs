//! The file that a name of none is most like.

use std::path::Path;

use super::{nearest, question};

/// Most files of a folder that are looked at.
const FILES: usize = 10_000;

/// A question to end a refusal of a file that is not there with, if one of the same folder and ending has a name that is like it; else
/// nothing.
pub(crate) fn did_you_mean_file(given: &Path) -> String {
    file_like(given).map(|near| question(&near)).unwrap_or_default()
}

fn file_like(given: &Path) -> Option<String> {
    let (name, ending) = (given.file_stem()?.to_str()?, given.extension()?);
    let folder = given.parent().filter(|folder| !folder.as_os_str().is_empty());
    let files =
        std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?.take(FILES).filter_map(|entry| Some(entry.ok()?.path()));
    let names: Vec<String> = files
        .filter(|file| file.extension() == Some(ending) && file.is_file())
        .filter_map(|file| Some(file.file_stem()?.to_str()?.to_owned()))
        .collect();
    let near = format!("{}.{}", nearest(name, names.iter().map(String::as_str))?, ending.to_str()?);
    Some(folder.map_or(near.clone(), |folder| folder.join(&near).display().to_string()))
}

#[cfg(test)]
mod tests {
    use super::did_you_mean_file;

    #[test]
    fn prop_a_file_of_the_same_ending_whose_name_is_near_is_suggested() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        for name in ["paper.toml", "paper.mcap", "shaker.2.toml"] {
            std::fs::write(folder.path().join(name), "")?;
        }
        std::fs::create_dir(folder.path().join("press1.toml"))?;
        for (given, near) in [
            ("papr.toml", Some("paper.toml")),
            ("papr.mcap", Some("paper.mcap")),
            ("shakr.2.toml", Some("shaker.2.toml")),
            ("press.toml", None),
            ("papr", None),
            ("none/papr.toml", None),
        ] {
            let near = near.map_or(String::new(), |near| format!("; did you mean `{}`?", folder.path().join(near).display()));
            assert_eq!(did_you_mean_file(&folder.path().join(given)), near, "{given}");
        }
        Ok(())
    }
}
