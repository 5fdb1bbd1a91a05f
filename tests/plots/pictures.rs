//! Figures and maps drawn from numbers.

use std::f64::consts::PI;

use flexcrank::plot::{Axis, Figure, Format, HeatMap, Key, Mark, Picture as _};

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
    let svg = three_sines().to_svg();
    let texts = texts(&svg);
    for expected in
        ["Sines & <others>", "angle θ (rad)", "height (m)", "λ = 0.1", "λ = 0.25", "λ = 0.5", "0", "π", "3π/2", "2π", "−0.4"]
    {
        assert!(texts.iter().any(|text| text == expected), "{expected} in {texts:?}");
    }
    assert_eq!(texts.iter().filter(|text| text.starts_with("λ")).count(), 3);
}

#[test]
fn prop_one_curve_needs_no_legend() {
    let figure = Figure::new("One", Axis::new("time", "s"), Axis::new("x", "m")).line("alone", &[0.0, 1.0], &[0.0, 1.0]);
    assert!(!texts(&figure.to_svg()).contains(&"alone".to_owned()));
}

#[test]
fn prop_the_legend_is_above_the_data() {
    let svg = three_sines().to_svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let height = |text: &str| {
        let node =
            document.descendants().find(|node| node.has_tag_name("text") && node.text().unwrap_or_default().trim() == text);
        node.and_then(|node| node.attribute("y")).and_then(|y| y.parse::<f64>().ok()).unwrap()
    };
    assert!(height("λ = 0.1") > height("Sines & <others>") && height("λ = 0.1") < height("0.4"));
}

#[test]
fn prop_a_png_is_twice_the_svg() {
    let picture = three_sines();
    let svg = picture.to_svg();
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
        Figure { equal_aspect: true, ..Figure::new("path", Axis::new("x", "m"), Axis::new("y", "m")).line("", &wide, &small) },
        Figure::new("log", Axis::log("x", "s"), Axis::log("y", "m")).series("", &wide, &wide, Mark::Points),
    ];
    for figure in figures {
        let svg = figure.to_svg();
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

/// The path of what stands still was a line without length, which no picture shows, and a warning of a library.
#[test]
fn regress_a_curve_that_goes_nowhere_is_a_dot() {
    for (ys, dots) in [([2.0, 2.0, 2.0 + 1e-12], 1), ([2.0, 3.0, 2.0], 0)] {
        let svg = Figure::new("Path", Axis::new("x", "m"), Axis::new("y", "m")).line("", &[1.0, 1.0, 1.0], &ys).to_svg();
        assert_eq!(svg.matches("<circle").count(), dots, "{svg}");
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
            for figure in [figure.clone(), Figure { equal_aspect: true, ..figure }] {
                assert!(!figure.render(Format::Png).unwrap().is_empty());
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
    let categories = texts(&map(Key::Categories(vec!["stable".to_owned(), "diverges".to_owned()])).to_svg());
    assert!(
        ["Map", "step (s)", "weight ϑ", "stable", "diverges"].iter().all(|text| categories.iter().any(|other| other == text))
    );
    let quantity = texts(&map(Key::Quantity(Axis::new("spectral radius", ""))).to_svg());
    assert!(quantity.iter().any(|text| text == "spectral radius"), "{quantity:?}");
}

/// Heights of an SVG's frames, which are the closed outlines in the frame's colour, from above.
fn frames(svg: &str) -> Vec<f64> {
    let document = roxmltree::Document::parse(svg).unwrap();
    let outlines = document.descendants().filter_map(|node| node.attribute("points")).filter_map(|points| {
        let corners: Vec<&str> = points.split(' ').collect();
        (corners.len() == 5 && corners[0] == corners[4]).then(|| corners[0].split_once(',').unwrap().1.parse().unwrap())
    });
    outlines.collect()
}

#[test]
fn prop_a_signal_that_would_look_flat_has_a_panel_of_its_own() {
    let times: Vec<f64> = (0..100).map(f64::from).collect();
    let scaled = |factor: f64| times.iter().map(|t| factor * (0.1 * t).sin()).collect::<Vec<_>>();
    let drawn = |signals: bool| {
        let figure = Figure::new("Angles", Axis::new("time", "s"), Axis::new("angle", "rad"));
        let figure = figure.line("crank", &times, &scaled(100.0)).line("rod", &times, &scaled(0.3));
        Figure { signals, ..figure.line("wheel", &times, &scaled(80.0)) }.to_svg()
    };
    assert_eq!(frames(&drawn(false)).len(), 1);
    let svg = drawn(true);
    let places = frames(&svg);
    assert!(places.len() == 2 && places[0] < places[1], "{places:?}");
    let texts = texts(&svg);
    let count = |wanted: &str| texts.iter().filter(|text| *text == wanted).count();
    assert_eq!([count("angle (rad)"), count("rod angle (rad)"), count("time (s)")], [1, 1, 1], "{texts:?}");
    assert_eq!([count("crank"), count("wheel"), count("rod")], [1, 1, 0], "a legend where curves share a panel: {texts:?}");
    let start = Figure { signals: true, ..Figure::new("Many", Axis::new("time", "s"), Axis::new("", "N")) };
    let many = (0..8).fold(start, |figure, number| figure.line(format!("force {number}"), &times, &scaled(1.0)));
    assert_eq!(frames(&many.to_svg()).len(), 2, "colours would repeat");
}

#[test]
fn prop_a_panel_is_as_wide_as_the_others_and_its_curves_lie_in_it() {
    let (xs, ys) = ([0.0, 1.0, 2.0], [1.0, 3.0, 2.0]);
    let figure = Figure::new("Two", Axis::new("time", "s"), Axis::new("torque", "N·m")).line("", &xs, &ys);
    let svg = figure.panel(Axis::new("a much larger number", "N")).line("", &xs, &ys.map(|y| 123_456.0 * y)).to_svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let lines = document.descendants().filter(|node| node.attribute("stroke") == Some("#0072b2"));
    let starts: Vec<&str> = lines.map(|node| node.attribute("points").unwrap().split(',').next().unwrap()).collect();
    assert!(starts.len() == 2 && starts[0] == starts[1], "{starts:?}");
}

#[test]
fn regress_a_long_label_of_a_low_panel_has_two_lines() {
    let start = Figure { panels: Vec::new(), ..Figure::new("Response", Axis::log("frequency", "Hz"), Axis::default()) };
    let labels = ["magnitude of crank angle", "magnitude of crank deflection", "phase"];
    let axes = labels.map(|label| Axis::log(label, "rad per N·m"));
    let figure = axes.into_iter().fold(start, |figure, axis| figure.panel(axis).line("", &[1.0, 10.0], &[1e-8, 1.0]));
    let svg = figure.to_svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let number = |node: &roxmltree::Node<'_, '_>, name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
    let texts: Vec<_> = document.descendants().filter(|node| node.has_tag_name("text")).collect();
    assert!(texts.iter().all(|node| number(node, "font-size") >= 11.0), "{svg}");
    let turned: Vec<_> = texts.iter().filter(|node| node.attribute("transform").is_some()).collect();
    let words: Vec<&str> = turned.iter().filter_map(|node| node.text()).collect();
    assert_eq!(words.join(" "), labels.map(|label| format!("{label} (rad per N·m)")).join(" "));
    let right = turned.iter().map(|node| number(node, "x")).fold(0.0, f64::max);
    let ticks = texts.iter().filter(|node| node.attribute("text-anchor") == Some("end"));
    let room = ticks.map(|node| number(node, "x")).fold(f64::INFINITY, f64::min) - right;
    assert!(words.len() > labels.len() && room > 30.0, "{words:?}, {room} px beside the ticks");
}

#[test]
fn val_ticks_are_round_and_short() {
    let ticks = |x: Axis, ends: [f64; 2]| texts(&Figure::new("", x, Axis::new("y", "")).line("", &ends, &[0.0, 1.0]).to_svg());
    let pi = std::f64::consts::PI;
    let axis = || Axis::new("x", "m");
    for (x, ends, expected) in [
        (axis(), [-0.35, 1.0], ["−0.2", "0", "0.2", "0.4", "0.6", "0.8", "1.0"].as_slice()),
        (axis(), [-0.0018, 0.0018], &["−1.5", "−1.0", "−0.5", "0", "0.5", "1.0", "1.5", "x (10⁻³ m)"]),
        (axis(), [0.499_999_22, 0.5], &["−700", "−100", "0", "x − 0.5 m (10⁻⁹ m)"]),
        (Axis::angle("x"), [0.0, 2.0 * pi], &["0", "π/4", "π/2", "3π/4", "π", "5π/4", "3π/2", "7π/4", "2π"]),
        (Axis::angle("x"), [-pi, pi], &["−π", "−3π/4", "−π/2", "π/2", "π"]),
        (Axis::log("x", "m"), [1e-6, 1.0], &["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]),
    ] {
        let drawn = ticks(x, ends);
        assert!(expected.iter().all(|text| drawn.iter().any(|other| other == text)), "{ends:?}: {drawn:?}");
    }
}

#[test]
fn prop_ticks_lie_inside_and_are_few() {
    for power in -250..250 {
        for (low, high) in [(0.0, 1.0), (-3.0, 7.7), (12.0, 12.5), (1.0, 1.0 + 1e-9)] {
            let ends = [low, high].map(|end| end * 10_f64.powi(power));
            let svg = Figure::new("", Axis::new("", ""), Axis::new("y", "m")).line("", &ends, &[0.0, 1.0]).to_svg();
            let document = roxmltree::Document::parse(&svg).unwrap();
            let number = |node: &roxmltree::Node<'_, '_>, name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
            let texts = document.descendants().filter(|node| node.attribute("text-anchor") == Some("middle"));
            let row: Vec<f64> =
                texts.filter(|node| node.attribute("font-size") == Some("12.5")).map(|node| number(&node, "x")).collect();
            assert!((2..=11).contains(&row.len()), "{ends:?}: {row:?}");
            assert!(row.iter().all(|x| (20.0..=730.01).contains(x)), "{ends:?}: {row:?}");
        }
    }
}
