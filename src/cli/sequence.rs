//! Files of pulses: parsed completely before the first pulse is sent, with errors by line.

use std::path::Path;

use super::failure::{CommandResult, Failure};
use crate::csv_faults::{broken_row, line_at, no_number, other_separator};
use crate::scene::PulseShape;
use crate::simulation::PulseRequest;
use crate::text_file;

/// Allowed columns; the first two are required.
const COLUMNS: [&str; 5] = ["torque_nm", "duration_s", "delay_s", "shape", "id"];

/// Size limit of a file of pulses, bytes.
const SIZE_LIMIT: usize = 16 * 1024 * 1024;

/// A pulse with its line in the file.
#[derive(Debug, PartialEq)]
pub(super) struct ListedPulse {
    pub line: u64,
    pub id: Option<String>,
    pub request: PulseRequest,
}

/// Reads a file of pulses.
pub(super) fn read(path: &Path) -> CommandResult<Vec<ListedPulse>> {
    let text = text_file::read(path, SIZE_LIMIT).map_err(Failure::file(path))?;
    parse(&text).map_err(|(line, what)| Failure::Usage(format!("{}:{line}: {what}", path.display())))
}

/// Parses pulses, or returns the line and reason of the first error. Lines that begin with # are comments.
fn parse(text: &str) -> Result<Vec<ListedPulse>, (u64, String)> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let line_of = |position: Option<&csv::Position>| position.map_or(1, |position| line_at(text, position.byte(), true));
    let broken = |error: csv::Error| (line_of(error.position()), broken_row(&error));
    let header = reader.headers().map_err(broken)?.clone();
    let line = line_of(header.position());
    if let Some(why) = other_separator(&header) {
        return Err((line, why.to_owned()));
    }
    let unknown = header.iter().find(|column| !COLUMNS.contains(column));
    if let Some(unknown) = unknown {
        return Err((line, format!("unknown column `{unknown}`: columns are {}", COLUMNS.join(", "))));
    }
    if let Some(twice) = COLUMNS.iter().find(|wanted| header.iter().filter(|column| column == *wanted).count() > 1) {
        return Err((line, format!("the column `{twice}` is there twice")));
    }
    if let Some(missing) = COLUMNS[..2].iter().find(|wanted| !header.iter().any(|column| column == **wanted)) {
        return Err((line, format!("the column `{missing}` is missing")));
    }
    let mut pulses = Vec::new();
    for row in reader.records() {
        let row = row.map_err(broken)?;
        let line = line_of(row.position());
        pulses.push(pulse(&header, &row, line).map_err(|what| (line, what))?);
    }
    if pulses.is_empty() { Err((line, "no pulse follows".to_owned())) } else { Ok(pulses) }
}

fn pulse(header: &csv::StringRecord, row: &csv::StringRecord, line: u64) -> Result<ListedPulse, String> {
    let field = |name: &str| {
        let place = header.iter().position(|column| column == name);
        place.and_then(|place| row.get(place)).filter(|field| !field.is_empty())
    };
    let number = |name: &str| {
        let finite = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite());
        field(name).map(|text| finite(text).ok_or_else(|| format!("{name} = `{text}`: {}", no_number(text)))).transpose()
    };
    let needed = |name: &str| number(name)?.ok_or_else(|| format!("{name} is empty"));
    let shape = match field("shape") {
        None | Some("rectangular") => PulseShape::Rectangular,
        Some("raised-cosine") => PulseShape::RaisedCosine,
        Some(other) => return Err(format!("shape = `{other}` does not exist: rectangular or raised-cosine")),
    };
    let request = PulseRequest {
        torque_nm: needed("torque_nm")?,
        duration_s: needed("duration_s")?,
        delay_s: number("delay_s")?.unwrap_or(0.0),
        shape,
    };
    request.check().map_err(|refused| refused.to_string())?;
    Ok(ListedPulse { line, id: field("id").map(str::to_owned), request })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_pulses_are_read_with_their_lines() {
        let text =
            "# two pushes\ntorque_nm, duration_s, delay_s, shape, id\n5, 0.1, , ,\n\n# later\n-2, 0.5, 1, raised-cosine, b\n";
        let first = PulseRequest { torque_nm: 5.0, duration_s: 0.1, delay_s: 0.0, shape: PulseShape::Rectangular };
        let second = PulseRequest { torque_nm: -2.0, duration_s: 0.5, delay_s: 1.0, shape: PulseShape::RaisedCosine };
        let expected = vec![
            ListedPulse { line: 3, id: None, request: first },
            ListedPulse { line: 6, id: Some("b".to_owned()), request: second },
        ];
        assert_eq!(parse(text), Ok(expected));
    }

    #[test]
    fn val_what_is_wrong_is_told_by_line() {
        for (text, line, words) in [
            ("torque,duration_s\n1,1\n", 1, "`torque`"),
            ("torque_nm,duration_s,torque_nm\n1,1,2\n", 1, "`torque_nm` is there twice"),
            ("torque_nm\n1\n", 1, "`duration_s` is missing"),
            ("torque_nm,duration_s\n1,1\n1,x\n", 3, "duration_s = `x`"),
            ("torque_nm,duration_s\n1,1\n,1\n", 3, "torque_nm is empty"),
            ("torque_nm,duration_s\n1,1\nnan,1\n", 3, "torque_nm = `nan`"),
            ("torque_nm,duration_s,shape\n1,1,square\n", 2, "shape = `square`"),
            ("torque_nm,duration_s\n1,1\n1,-0.1\n", 3, "duration_s = -0.1"),
            ("torque_nm,duration_s,delay_s\n1,1,1e9\n", 2, "delay_s = 1000000000"),
            ("torque_nm,duration_s\n1,1\n1\n", 3, "1 value in a table of 2 columns"),
            (
                "torque_nm,duration_s\n2,5,0.1\n",
                2,
                "3 values in a table of 2 columns; if a number was meant, it has a decimal point, not a comma",
            ),
            ("torque_nm,duration_s\n\n# c\n# d\n1\n", 5, "1 value in a table of 2 columns"),
            ("# a; b\n\n# c\ntorque_nm;duration_s\n", 4, "separated by semicolons"),
            ("torque_nm,duration_s\n\"2,5\",0.1\n", 2, "torque_nm = `2,5`: a number has a decimal point, not a comma: 2.5"),
            ("torque_nm;duration_s\n2,5;0,1\n", 1, "separated by semicolons"),
            ("torque_nm,duration_s\n", 1, "no pulse"),
            ("", 1, "missing"),
        ] {
            let Err((at, what)) = parse(text) else { panic!("{text:?}") };
            assert!(at == line && what.contains(words), "{text:?}: {at}: {what}");
        }
    }
}
