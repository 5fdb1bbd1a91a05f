//! Tables whose numbers have decimal commas.

use super::{complaint, plot};

/// The column was left out without a word. Labels are words.
#[test]
fn regress_quoted_numbers_with_decimal_commas_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let warning = "warning: other.csv: column `p_bar` is taken for words: a number has a decimal point, not a comma: 1.5";
    for (cells, code, warns) in [
        (["\"1,5\",3", "\"3,5\",4"], 0, true),
        (["\"1,5\",3", ",4"], 0, true),
        // Whole numbers have no comma.
        (["\"1,5\",3", "2,4"], 0, true),
        (["\"1,5\",a", "\"3,5\",b"], 2, true),
        (["\"1,3-butadiene\",3", "\"2,4-xylenol\",4"], 0, false),
    ] {
        let text = format!("t_s,p_bar,q\n0,{}\n1,{}\n", cells[0], cells[1]);
        std::fs::write(folder.path().join("other.csv"), text).unwrap();
        let output = plot(folder.path(), &["other.csv", "-o", "out"]);
        assert_eq!((output.status.code(), complaint(&output).contains(warning)), (Some(code), warns), "{}", complaint(&output));
    }
}
