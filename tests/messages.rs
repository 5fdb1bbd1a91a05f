//! The generated messages under `proto/generated` are those of the `.proto` files.
//!
//! They are kept with the source, so that a build needs no protobuf compiler and a search finds them. After a change of a
//! `.proto` file, `FLEXCRANK_GENERATE=1 cargo test --test messages` writes them anew.

use std::error::Error;
use std::fs;
use std::path::Path;

use prost::Message as _;

const OWN: &str = "proto/flexcrank.proto";
const VIEWERS: &str = "proto/foxglove/SceneUpdate.proto";

#[test]
fn regress_generated_messages_are_those_of_the_proto_files() -> Result<(), Box<dyn Error>> {
    let fresh = tempfile::tempdir()?;
    for (name, files) in [("flexcrank", vec![OWN]), ("foxglove", vec![VIEWERS]), ("every", vec![OWN, VIEWERS])] {
        let descriptors = protox::compile(&files, ["proto"])?;
        fs::write(fresh.path().join(name).with_extension("bin"), descriptors.encode_to_vec())?;
        if name == "every" {
            prost_build::Config::new().out_dir(fresh.path()).enable_type_names().compile_fds(descriptors)?;
        }
    }
    let kept = Path::new("proto/generated");
    for file in fs::read_dir(fresh.path())? {
        let file = file?;
        let kept = kept.join(file.file_name());
        let generated = fs::read(file.path())?;
        if std::env::var_os("FLEXCRANK_GENERATE").is_some() {
            fs::write(&kept, &generated)?;
        }
        let same = fs::read(&kept).is_ok_and(|kept| kept == generated);
        assert!(same, "{}: run FLEXCRANK_GENERATE=1 cargo test --test messages, and commit", kept.display());
    }
    Ok(())
}
