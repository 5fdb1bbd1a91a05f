//! Recordings with resets, each of which begins simulated time again.

use std::fs::read_to_string;
use std::time::Duration;

use flexcrank::bus::client;
use flexcrank::plot::{Figure, MechanismPicture, Named, add_session_time, cut, figure, recorded, time_column};
use flexcrank::runtime::Pace;
use flexcrank::scene::SceneSource;
use flexcrank::simulation::PublishRate;
use flexcrank::study::Table;
use flexcrank::wire::{self, control::Action};
use tempfile::TempDir;

use super::common::{self, Outcome, Service};
use super::{complaint, plot, texts};

/// Wall clock at the start of the recording, s since 1970.
const STARTED_S: f64 = 1_790_000_000.25;
/// Samples of an epoch, and the time between them, s.
const SAMPLES: u32 = 50;
const APART_S: f64 = 0.02;
/// Time since the recording began at which an epoch begins, s.
const RESETS_S: [f64; 3] = [0.0, 0.98, 1.96];
/// Longest wait for the answer to an advance.
const PATIENCE: Duration = Duration::from_secs(30);

/// A beam that turns by half a radian in each of the first epochs, without session time.
fn beam(epochs: usize) -> Vec<Named> {
    let samples = || (0..epochs).flat_map(|epoch| (0..SAMPLES).map(move |sample| (epoch, APART_S * f64::from(sample))));
    let column = |value: &dyn Fn(usize, f64) -> f64| samples().map(|(epoch, time_s)| value(epoch, time_s)).collect::<Vec<f64>>();
    let mut table = Table::default();
    table.push("log_time", column(&|epoch, time_s| STARTED_S + RESETS_S[epoch] + time_s));
    table.push("stamp.sim_time_s", column(&|_, time_s| time_s));
    table.push("stamp.epoch", column(&|epoch, _| epoch as f64));
    for (node, radius_m) in [(0, 0.0), (1, 1.0)] {
        table.push(format!("nodes.beam.{node}.x_m"), column(&|_, time_s| radius_m * (0.5 * time_s).cos()));
        table.push(format!("nodes.beam.{node}.y_m"), column(&|_, time_s| radius_m * (0.5 * time_s).sin()));
    }
    table.push("nodes.beam.1.dx_m", column(&|_, time_s| 0.1 * time_s));
    table.push("nodes.beam.1.dy_m", column(&|_, time_s| 0.2 * time_s));
    vec![Named { name: "flexcrank/beam/displacements".to_owned(), table, ..Named::default() }]
}

/// The beam with the times that its figures go by.
fn with_session_time(epochs: usize) -> Vec<Named> {
    let mut topics = beam(epochs);
    add_session_time(&mut topics);
    topics
}

/// The figures of topics, and the figure of a column over the time of the recording.
fn figures(topics: &[Named]) -> Vec<Figure> {
    let asked = figure(topics, Some(time_column(topics)), &["nodes.beam.1.dx_m".to_owned()]).unwrap();
    recorded(topics).into_iter().map(|(_, figure)| figure).chain([asked]).collect()
}

/// Points that curves have, and the gaps in them.
fn counts(figure: &Figure) -> Vec<[usize; 2]> {
    let of_curve = |ys: &[f64]| {
        let gaps = ys.iter().filter(|value| value.is_nan()).count();
        [ys.len() - gaps, gaps]
    };
    figure.panels.iter().flat_map(|panel| &panel.series).map(|series| of_curve(&series.ys)).collect()
}

#[test]
fn regress_all_figures_of_a_recording_with_resets_go_by_the_time_since_it_began() {
    let figures = figures(&with_session_time(3));
    assert_eq!(figures.len(), 3, "of the displacement, of the path, and of what was asked for");
    for drawn in figures {
        assert!(counts(&drawn).iter().all(|count| *count == [150, 2]), "{}: {:?}", drawn.title, counts(&drawn));
        if drawn.x.unit != "s" {
            continue;
        }
        assert_eq!(drawn.x.label, "time since the recording began", "{}", drawn.title);
        for series in drawn.panels.iter().flat_map(|panel| &panel.series) {
            assert!(series.xs.is_sorted(), "{}: time runs back", drawn.title);
            assert_eq!([series.xs[0], series.xs[series.xs.len() - 1]], [0.0, 2.94], "{}", drawn.title);
        }
    }
}

#[test]
fn prop_a_recording_of_one_epoch_goes_by_simulated_time() {
    assert_eq!(with_session_time(1), beam(1));
    let figures = figures(&with_session_time(1));
    assert!(figures.iter().all(|drawn| drawn.x.unit == "m" || drawn.x.label == "time"));
    assert!(figures.iter().flat_map(counts).all(|count| count == [50, 0]));
}

#[test]
fn regress_a_range_of_a_recording_with_resets_is_one_stretch() {
    let within = |from_s: f64, to_s: f64| {
        let mut topics = with_session_time(3);
        cut("run.mcap", &mut topics, Some(from_s), Some(to_s)).map(|()| topics)
    };
    // Within an epoch, across a reset, and from a reset on.
    for (range, count) in [([1.5, 1.9], [21, 0]), ([0.9, 1.1], [12, 1]), ([1.96, 2.94], [50, 0])] {
        let topics = within(range[0], range[1]).unwrap();
        for drawn in figures(&topics) {
            assert!(counts(&drawn).iter().all(|other| *other == count), "{range:?}: {:?}", counts(&drawn));
        }
    }
    let refused = within(9.0, 10.0).unwrap_err().to_string();
    assert!(refused.ends_with("the recording covers 0 s to 2.94 s"), "{refused}");
}

#[test]
fn regress_pictures_of_the_mechanism_name_the_reset_at_which_they_end() {
    let captions = |topics: &[Named]| {
        let strobe = MechanismPicture::strobe("run", topics).unwrap().caption();
        let animation = MechanismPicture::animation("run", topics, Some(0.5)).unwrap().caption();
        [strobe, animation]
    };
    let mut topics = with_session_time(3);
    let [strobe, animation] = captions(&topics);
    assert!(strobe.contains("in the recorded time before the reset at 0.98 s, from 0 s (pale)"), "{strobe}");
    assert_eq!(animation, "0.98 s at 0.5 times the real speed, before the reset at 0.98 s");
    cut("run.mcap", &mut topics, Some(1.96), None).unwrap();
    let [strobe, animation] = captions(&topics);
    assert!(strobe.contains("in the recorded time, from 1.96 s (pale)"), "{strobe}");
    assert_eq!(animation, "0.98 s at 0.5 times the real speed");
}

/// A recording `reset.mcap` with a reset at 0.2 s, up to 0.4 s.
fn recorded_reset() -> Outcome<TempDir> {
    let service = Service::start(SceneSource::open("crank-slider", &[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    let say = |action: Action| -> Outcome {
        let command = wire::Control { id: String::new(), action: Some(action) };
        let reply = client::control(&service.client, &service.name, &command)?;
        assert!(reply.accepted, "{}", reply.reason);
        Ok(())
    };
    let advance = wire::Advance { steps: 100, ..wire::Advance::default() };
    let on = || -> Outcome {
        let advanced = client::advance(&service.client, &service.name, &advance, PATIENCE)?;
        assert!(advanced.reply.is_some_and(|reply| reply.accepted));
        Ok(())
    };
    say(Action::StopRecording(wire::StopRecording {}))?;
    say(Action::Pause(wire::Pause {}))?;
    say(Action::Reset(wire::Reset {}))?;
    say(Action::StartRecording(wire::StartRecording { name: "reset".to_owned() }))?;
    on()?;
    say(Action::Reset(wire::Reset {}))?;
    on()?;
    Ok(service.stop()?.1)
}

#[test]
fn regress_the_range_on_the_page_of_a_recording_with_resets_can_be_chosen() -> Outcome {
    let folder = recorded_reset()?;
    let at = folder.path();
    let output = plot(at, &["reset.mcap", "-o", "out", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let page = read_to_string(at.join("out/index.html"))?;
    assert!(page.contains(", 0 s to 0.4 s. "), "{page}");
    let one = ["reset.mcap", "--y", "work_in_j", "--from", "0.3", "--to", "0.4", "-o", "out/one.svg"];
    let output = plot(at, &one);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    for file in ["out/reset-angles.svg", "out/one.svg"] {
        let drawn = texts(&read_to_string(at.join(file))?);
        assert!(drawn.iter().any(|text| text == "time since the recording began (s)"), "{file}: {drawn:?}");
    }
    let svg = read_to_string(at.join("out/one.svg"))?;
    let document = roxmltree::Document::parse(&svg)?;
    let lines = document.descendants().filter_map(|node| node.attribute("points"));
    assert_eq!(lines.map(|points| points.split_whitespace().count()).max(), Some(51), "a sample every 2 ms");
    let refused = plot(at, &["reset.mcap", "--from", "0.5"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complaint(&refused).contains("the recording covers 0 s to 0.4 s"), "{}", complaint(&refused));
    Ok(())
}

/// The axes of time had two names, so that nothing was laid over one another.
#[test]
fn regress_a_recording_with_resets_is_laid_over_one_without() -> Outcome {
    let folder = recorded_reset()?;
    let at = folder.path();
    let (_, plain) = Service::start(common::scene(&[])?, Pace::Max, Some(0.4), PublishRate::Hz(500.0))?.finish()?;
    std::fs::copy(plain.path().join("run.mcap"), at.join("plain.mcap"))?;
    let output = plot(at, &["plain.mcap", "reset.mcap", "--overlay", "-o", "both", "--format", "svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    assert!(at.join("both/overlay-angles.svg").exists() && !at.join("both/overlay-angles-2.svg").exists());
    let output = plot(at, &["plain.mcap", "reset.mcap", "--overlay", "--y", "work_in_j", "-o", "work.svg"]);
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    Ok(())
}
