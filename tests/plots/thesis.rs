//! Every figure of the thesis in one go.

use std::collections::BTreeSet;

use super::{complaint, plot, png_size, texts};

#[test]
fn prop_the_page_names_every_figure_and_links_to_files_that_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let output = plot(folder.path(), &["--thesis", "figures"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let folder = folder.path().join("figures");
    let page = std::fs::read_to_string(folder.join("index.html")).unwrap();
    assert!(!page.contains("<script") && !page.contains("http"), "nothing from elsewhere");
    let linked: BTreeSet<&str> = page.split(['"']).filter(|text| text.ends_with(".svg") || text.ends_with(".png")).collect();
    let there: BTreeSet<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "index.html")
        .collect();
    assert_eq!(linked, there.iter().map(String::as_str).collect::<BTreeSet<_>>());
    assert!(complaint(&output).is_empty(), "{}", complaint(&output));
    assert!(
        there.contains("5-06-05-chord-angle-psi.svg") && there.contains("4-30-31-path-of-the-centre-of-mass.svg"),
        "{there:?}"
    );
    assert!(there.len() >= 94, "{} files", there.len());
    for name in &there {
        let path = folder.join(name);
        if name.ends_with(".png") {
            assert_eq!(png_size(&std::fs::read(path).unwrap())[0], 1520);
            continue;
        }
        let texts = texts(&std::fs::read_to_string(path).unwrap());
        assert!(page.contains(&texts[0]), "the page names {}", texts[0]);
        let ratios = texts.iter().filter(|text| text.starts_with("λ = ")).count();
        assert_eq!(ratios, if name.starts_with("4-") { 3 } else { 0 }, "{name}");
        if name.starts_with("4-") && texts.contains(&"crank angle θ (rad)".to_owned()) {
            assert!(["π/2", "π", "2π"].iter().all(|tick| texts.iter().any(|text| text == tick)), "{name}: {texts:?}");
        }
    }
}
