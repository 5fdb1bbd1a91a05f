//! Figures and maps drawn from numbers.

use std::f64::consts::PI;

use flexcrank::plot::{Axis, Figure, Format, HeatMap, Key, Mark, Picture};

use super::{png_size, texts};

fn three_sines() -> Figure {
    let angles: Vec<f64> = (0..=360).map(|k| f64::from(k) * PI / 180.0).collect();
    let figure = Figure::new("Sines & <others>", Axis::angle("angle θ"), Axis::new("height", "m"));
    [0.1, 0.25, 0.5].iter().fold(figure, |figure, size| {
        let sines: Vec<f64> = angles.iter().map(|angle| size * angle.sin()).collect();
        figure.line(format!("λ = {size}"), &angles, &sines)
    })
}

#[test]
fn prop_an_svg_has_title_labels_ticks_and_a_legend_entry_a_curve() {
    let svg = three_sines().to_svg().unwrap();
    let texts = texts(&svg);
    for expected in
        ["Sines & <others>", "angle θ [rad]", "height [m]", "λ = 0.1", "λ = 0.25", "λ = 0.5", "0", "π", "3π/2", "2π", "−0.4"]
    {
        assert!(texts.iter().any(|text| text == expected), "{expected} in {texts:?}");
    }
    assert_eq!(texts.iter().filter(|text| text.starts_with("λ")).count(), 3);
}

#[test]
fn prop_one_curve_needs_no_legend() {
    let figure = Figure::new("One", Axis::new("time", "s"), Axis::new("x", "m")).line("alone", &[0.0, 1.0], &[0.0, 1.0]);
    assert!(!texts(&figure.to_svg().unwrap()).contains(&"alone".to_owned()));
}

#[test]
fn prop_the_legend_is_below_the_data() {
    let svg = three_sines().to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let height = |text: &str| {
        let node =
            document.descendants().find(|node| node.has_tag_name("text") && node.text().unwrap_or_default().trim() == text);
        node.and_then(|node| node.attribute("y")).and_then(|y| y.parse::<f64>().ok()).unwrap()
    };
    assert!(height("λ = 0.1") > height("angle θ [rad]"));
}

#[test]
fn prop_a_png_is_twice_the_svg() {
    let picture = Picture::from(three_sines());
    let svg = picture.to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let size = ["width", "height"].map(|name| document.root_element().attribute(name).unwrap().parse::<f64>().unwrap());
    assert_eq!(png_size(&picture.render(Format::Png).unwrap()), size.map(|px| (2.0 * px).round() as u32));
}

#[test]
fn prop_nothing_is_drawn_off_the_sheet() {
    let wide: Vec<f64> = (0..50).map(|k| 1e-7 * f64::from(k) + 123_456.0).collect();
    let small: Vec<f64> = (0..50).map(|k| -1e-12 * f64::from(k)).collect();
    let long =
        "a label that is so long that it would not fit into any legend, were it not for a smaller size of its letters ".repeat(2);
    let figures = [
        three_sines(),
        Figure::new(long.clone(), Axis::new(long.clone(), "s"), Axis::new(long.clone(), "m"))
            .line(&long, &wide, &small)
            .line(&long, &wide, &wide),
        Figure::new("path", Axis::new("x", "m"), Axis::new("y", "m")).line("", &wide, &small).with_equal_aspect(),
        Figure::new("log", Axis::log("x", "s"), Axis::log("y", "m")).series("", &wide, &wide, Mark::LineAndPoints),
    ];
    for figure in figures {
        let svg = figure.to_svg().unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let sheet: Vec<f64> =
            document.root_element().attribute("viewBox").unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
        for line in document.descendants().filter(|node| node.has_tag_name("polyline")) {
            for point in line.attribute("points").unwrap().split_whitespace() {
                let (x, y) = point.split_once(',').unwrap();
                let (x, y): (f64, f64) = (x.parse().unwrap(), y.parse().unwrap());
                assert!((0.0..=sheet[2]).contains(&x) && (0.0..=sheet[3]).contains(&y), "{}: {point}", figure.title);
            }
        }
    }
}

#[test]
fn prop_bad_numbers_are_gaps() {
    let xs = [0.0, 1.0, f64::NAN, 2.0, f64::INFINITY, 3.0];
    let all_bad = [f64::NAN; 6];
    for ys in
        [[0.0, f64::NAN, 1.0, 2.0, 3.0, f64::NEG_INFINITY], all_bad, [f64::MAX, -f64::MAX, 0.0, 1.0, 2.0, f64::MIN_POSITIVE]]
    {
        for scale in [Axis::new("y", "m"), Axis::log("y", "m"), Axis::angle("y")] {
            let figure = Figure::new("bad", Axis::new("x", "s"), scale).line("", &xs, &ys);
            for figure in [figure.clone(), figure.with_equal_aspect()] {
                assert!(!Picture::from(figure).render(Format::Png).unwrap().is_empty());
            }
        }
    }
}

#[test]
fn prop_maps_show_their_categories_or_their_scale() {
    let map = |key| HeatMap {
        title: "Map".to_owned(),
        x: Axis::log("step", "s"),
        y: Axis::new("weight ϑ", ""),
        xs: vec![1e-3, 1e-2, 1e-1],
        ys: vec![0.5, 1.0],
        values: vec![vec![0.0, 1.0, f64::NAN], vec![1.0, 0.0, 0.0]],
        key,
    };
    let categories = texts(&map(Key::Categories(vec!["stable".to_owned(), "diverges".to_owned()])).to_svg().unwrap());
    assert!(
        ["Map", "step [s]", "weight ϑ", "stable", "diverges"].iter().all(|text| categories.iter().any(|other| other == text))
    );
    let quantity = texts(&map(Key::Quantity(Axis::new("spectral radius", ""))).to_svg().unwrap());
    assert!(quantity.iter().any(|text| text == "spectral radius"), "{quantity:?}");
}
