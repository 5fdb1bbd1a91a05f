//! Animations of the mechanism.

use std::f64::consts::TAU;
use std::fs::{read_to_string, write};

use flexcrank::plot::{Format, MechanismPicture, Named, Picture as _};
use flexcrank::study::Table;

use super::recording::record;
use super::{complaint, plot};

/// The positions of a beam of length 2 that makes so many `turns` up to a time, bent to the left by 1 % of its length.
pub(super) fn turning(turns: impl Fn(f64) -> f64, for_s: f64, intervals: u32) -> [Named; 1] {
    beam([[0.0, 0.0], [1.0, 0.02], [2.0, 0.0]], turns, for_s, intervals)
}

/// The positions of a beam with its nodes at these places along it and beside it.
fn beam(nodes: [[f64; 2]; 3], turns: impl Fn(f64) -> f64, for_s: f64, intervals: u32) -> [Named; 1] {
    let times: Vec<f64> = (0..=intervals).map(|k| for_s * f64::from(k) / f64::from(intervals.max(1))).collect();
    let mut table = Table::default();
    table.push("stamp.sim_time_s".to_owned(), times.clone());
    let angles: Vec<f64> = times.iter().map(|time| TAU * turns(*time)).collect();
    for (index, [along, aside]) in nodes.into_iter().enumerate() {
        let x = angles.iter().map(|angle| along * angle.cos() - aside * angle.sin()).collect();
        let y = angles.iter().map(|angle| along * angle.sin() + aside * angle.cos()).collect();
        table.push(format!("nodes.beam.{index}.x_m"), x);
        table.push(format!("nodes.beam.{index}.y_m"), y);
    }
    [Named { name: "displacements".to_owned(), table, ..Named::default() }]
}

/// The shapes of the first link in the pictures of an animation.
fn pictures(svg: &str) -> Vec<String> {
    let values = svg.split("attributeName=\"d\"").nth(1).and_then(|rest| rest.split("values=").nth(1)).unwrap();
    values.split('"').nth(1).unwrap().split(';').map(str::to_owned).collect()
}

#[test]
fn regress_the_rounding_of_a_rigid_link_is_no_bending() {
    let straight = beam([[0.0, 0.0], [0.7, 0.0], [2.1, 0.0]], |time| time, 1.0, 100);
    let animation = MechanismPicture::animation("straight", &straight, Some(0.5)).unwrap();
    assert_eq!(animation.caption(), "1.00 s at 0.5 times the real speed");
}

#[test]
fn prop_bending_is_magnified_and_the_time_kept() {
    let evenly = turning(|time| time, 1.0, 100);
    let animation = MechanismPicture::animation("turning", &evenly, Some(0.5)).unwrap();
    assert_eq!(
        animation.caption(),
        "1.00 s at 0.5 times the real speed, bending from the chord drawn 10 times as large",
        "1 % is drawn as 10 %"
    );
    let svg = animation.to_svg();
    assert!(svg.contains("dur=\"2.00s\""), "a second at half speed");
    assert_eq!(pictures(&svg).len(), 31, "15 pictures a second, both ends included");
    assert_eq!(animation.formats(&[Format::Png]), [Format::Svg]);
}

#[test]
fn regress_the_bending_of_several_files_is_magnified_by_one_factor() {
    let pictures_of = |aside: f64| {
        let file = beam([[0.0, 0.0], [1.0, aside], [2.0, 0.0]], |time| 0.2 * time, 1.0, 100);
        let strobe = MechanismPicture::strobe("beam", &file).unwrap();
        [strobe, MechanismPicture::animation("beam", &file, Some(0.5)).unwrap()]
    };
    let factor = |picture: &MechanismPicture| {
        let caption = picture.caption();
        let words = caption.split("bending from the chord drawn ").nth(1).unwrap_or("1 times");
        words.split(' ').next().unwrap().parse::<u32>().unwrap()
    };
    // A stiff beam, a soft one, and a rigid one.
    let mut pictures: Vec<MechanismPicture> = [0.002, 0.02, 0.0].into_iter().flat_map(pictures_of).collect();
    assert_eq!(pictures.iter().map(factor).collect::<Vec<_>>(), [100, 100, 10, 10, 1, 1]);
    let before = pictures.clone();
    MechanismPicture::magnify_alike(pictures.iter_mut());
    assert_eq!(pictures.iter().map(factor).collect::<Vec<_>>(), [10, 10, 10, 10, 1, 1]);
    let is_drawn_as_before = |(after, before): (&MechanismPicture, &MechanismPicture)| after.to_svg() == before.to_svg();
    let drawn: Vec<bool> = pictures.iter().zip(&before).map(is_drawn_as_before).collect();
    assert_eq!(drawn, [false, false, true, true, true, true]);
}

#[test]
fn prop_a_table_without_links_is_refused() {
    assert!(MechanismPicture::animation("nothing", &[], Some(1.0)).is_err());
    assert!(MechanismPicture::strobe("nothing", &[Named::default()]).is_err());
}

#[test]
fn regress_an_animation_without_a_speed_plays_at_one_at_which_the_motion_is_seen() {
    let evenly: fn(f64) -> f64 = |time| time;
    for (turns, for_s, intervals, begins, duration, count) in [
        (evenly, 1.0, 100, "1.00 s at 0.5 times", "2.00s", 31),
        (|time| time / 10.0, 4.0, 400, "4.00 s at 1 times", "4.00s", 61),
        // Less than a turn, and fewer samples than pictures.
        (|time| 2.0 * time, 0.05, 10, "0.0500 s at 0.025 times", "2.00s", 31),
        (|time| 50.0 * time, 0.09, 450, "0.0900 s at 0.01 times", "9.00s", 136),
        // Ever faster: at 0.5, there would be three pictures a turn in the end.
        (|time| time * time, 5.0, 5000, "2.50 s at 0.25 times", "10.00s", 151),
    ] {
        let animation = MechanismPicture::animation("turning", &turning(turns, for_s, intervals), None).unwrap();
        assert!(animation.caption().starts_with(begins), "{begins}: {}", animation.caption());
        assert_eq!(animation.warning, None, "{begins}");
        let svg = animation.to_svg();
        assert!(svg.contains(&format!("dur=\"{duration}\"")), "{begins}");
        let pictures = pictures(&svg);
        assert_eq!(pictures.len(), count, "{begins}");
        assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]), "{begins}: it never stops");
    }
}

#[test]
fn regress_a_speed_that_shows_no_motion_is_named_with_one_that_does() {
    let fast = turning(|time| 50.0 * time, 0.1, 500);
    let helps = "; --animation=0.01 shows the motion";
    for (speed, said) in [
        (1.0, Some("at 1 times the real speed, there are only 3 pictures")),
        (0.25, Some("at 0.25 times the real speed, there are only 7 pictures")),
        (0.1, Some("at 0.1 times the real speed, the mechanism turns by up to 2.1 rad from picture to picture")),
        (0.02, None),
    ] {
        let animation = MechanismPicture::animation("fast", &fast, Some(speed)).unwrap();
        assert_eq!(animation.warning, said.map(|said| format!("{said}{helps}")));
        assert!(animation.caption().starts_with("0.10 s"), "the whole: {}", animation.caption());
    }
    let refused = |topics: &[Named], speed| MechanismPicture::animation("fast", topics, speed).unwrap_err().to_string();
    assert_eq!(refused(&fast, Some(2.0)), format!("fast: at 2 times the real speed, there is only one picture{helps}"));
    let still = turning(|time| time, 1.0, 0);
    assert_eq!(refused(&still, None), "fast: only one position was recorded in this time");
}

/// A beam of length 2 that does not turn, with its middle so far from the chord at a time.
fn bending(middle_m: impl Fn(f64) -> f64, for_s: f64) -> [Named; 1] {
    sampled(middle_m, for_s, 5e-4)
}

fn sampled(middle_m: impl Fn(f64) -> f64, for_s: f64, every_s: f64) -> [Named; 1] {
    let times: Vec<f64> = (0..=(for_s / every_s).round() as u32).map(|k| every_s * f64::from(k)).collect();
    let mut table = Table::default();
    table.push("stamp.sim_time_s", times.clone());
    for node in 0..=2_u32 {
        let aside = |time: &f64| if node == 1 { middle_m(*time) } else { 0.0 };
        table.push(format!("nodes.beam.{node}.x_m"), vec![f64::from(node); times.len()]);
        table.push(format!("nodes.beam.{node}.y_m"), times.iter().map(aside).collect());
    }
    [Named { name: "displacements".to_owned(), table, ..Named::default() }]
}

/// A vibration at this frequency from 0.1 s on.
fn vibration(amplitude_m: f64, frequency_hz: f64) -> impl Fn(f64) -> f64 {
    move |time: f64| amplitude_m * (TAU * frequency_hz * (time - 0.1).max(0.0)).sin()
}

#[test]
fn regress_pictures_too_rare_for_a_vibration_are_named_with_a_speed_that_shows_it() {
    let rare = "pictures are too rare for the bending of the beam";
    let helps = "--animation=0.025 shows the motion";
    let of_part = format!("{helps}, with --from and --to at most 0.25 s apart");
    for (for_s, speed, said) in [
        (1.2, None, Some(format!("at 0.5 times the real speed, {rare}; {of_part}"))),
        (1.2, Some(0.5), Some(format!("at 0.5 times the real speed, {rare}; {of_part}"))),
        // Two pictures in a period, four and nine.
        (1.2, Some(0.1), Some(format!("at 0.1 times the real speed, {rare}; {of_part}"))),
        (1.2, Some(0.05), None),
        (1.2, Some(0.025), None),
        (0.5, Some(1.0), Some(format!("at 1 times the real speed, there are only 9 pictures; {of_part}"))),
        (0.25, Some(0.1), Some(format!("at 0.1 times the real speed, {rare}; {helps}"))),
    ] {
        let beam = bending(vibration(0.02, 68.4), for_s);
        let animation = MechanismPicture::animation("beam", &beam, speed).unwrap();
        assert_eq!(animation.warning, said, "{for_s} s at {speed:?}");
    }
}

/// Five pictures in a period at the least speed, and fewer than four: no speed was named.
#[test]
fn regress_the_least_speed_is_named_where_it_shows_a_vibration_or_said_to_show_none() {
    let rare = "at 0.01 times the real speed, pictures are too rare for the bending of the beam";
    let slowest = "--animation=0.001 shows the motion, with --from and --to at most 0.01 s apart";
    for (frequency_hz, advice) in [(3086.0, slowest), (6000.0, "none down to 0.001 shows the bending")] {
        let beam = sampled(|time| 0.02 * (TAU * frequency_hz * time).sin(), 0.5, 2e-5);
        let animation = MechanismPicture::animation("beam", &beam, Some(0.01)).unwrap();
        assert_eq!(animation.warning, Some(format!("{rare}; {advice}")), "{frequency_hz} Hz");
        // Quiet in all that the least speed plays.
        let later = |time: f64| if time < 0.05 { 0.0 } else { 0.02 * (TAU * frequency_hz * time).sin() };
        let animation = MechanismPicture::animation("beam", &sampled(later, 0.5, 2e-5), Some(0.01)).unwrap();
        assert_eq!(animation.warning, Some(format!("{rare}; {advice}")), "{frequency_hz} Hz, from 0.05 s on");
    }
}

#[test]
fn regress_an_animation_without_a_speed_shows_a_vibration_of_a_short_time() {
    let animation = MechanismPicture::animation("beam", &bending(vibration(0.02, 68.4), 0.25), None).unwrap();
    assert!(animation.caption().starts_with("0.25 s at 0.025 times"), "{}", animation.caption());
    assert_eq!(animation.warning, None);
    assert_eq!(pictures(&animation.to_svg()).len(), 151);
}

#[test]
fn prop_slow_and_small_vibrations_and_steady_bending_need_no_more_pictures() {
    let [slow, small, on_bending] = [vibration(0.02, 1.0), vibration(1e-6, 68.4), vibration(0.002, 68.4)];
    for (beam, begins) in [
        (bending(slow, 4.0), "4.00 s at 1 times"),
        (bending(small, 1.2), "1.20 s at 0.5 times"),
        (bending(|time| 0.02 + on_bending(time), 1.2), "1.20 s at 0.5 times"),
    ] {
        let animation = MechanismPicture::animation("beam", &beam, None).unwrap();
        assert!(animation.caption().starts_with(begins), "{begins}: {}", animation.caption());
        assert_eq!(animation.warning, None, "{begins}");
    }
}

/// Its pulses make it vibrate at 68 Hz.
pub(super) const TUBE: &str = r#"
[beam]
length_m = 0.9
section = { shape = "tube", outer_m = 0.02, inner_m = 0.017 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
elements = 8
damping_s = 2e-5

[tip]
mass_kg = 0.35

[[pulse]]
start_s = 0.1
torque_nm = 15.0
duration_s = 0.04

[[pulse]]
start_s = 0.5
torque_nm = -15.0
duration_s = 0.04

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.0005
"#;

#[test]
fn regress_plot_warns_of_pictures_too_rare_for_a_vibration_that_samples_show() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at.join("tube.toml"), TUBE).unwrap();
    record(at, "tube.toml", "1.2", "run.mcap", &[]);
    record(at, "tube.toml", "1.2", "rare.mcap", &["--publish-hz", "200"]);
    let helps = "--animation=0.025 shows the motion, with --from and --to at most 0.25 s apart";
    let rare = |speed: &str| {
        let why = "pictures are too rare for the bending of the beam";
        format!("warning: run: at {speed} times the real speed, {why}; {helps}\n")
    };
    for (words, said) in [
        (&["-o", "out", "--format", "svg"][..], rare("0.5")),
        (&["--list"], String::new()),
        (&["--animation", "-o", "moving.svg"], rare("0.5")),
        (&["--animation=0.1", "-o", "moving.svg"], rare("0.1")),
        (&["--animation=0.025", "--from", "0.1", "--to", "0.35", "-o", "moving.svg"], String::new()),
        (&["--animation", "--from", "0.1", "--to", "0.35", "-o", "moving.svg"], String::new()),
        (
            &["--animation=1", "--from", "0.1", "--to", "0.6", "-o", "moving.svg"],
            format!("warning: run: at 1 times the real speed, there are only 9 pictures; {helps}\n"),
        ),
    ] {
        let output = plot(at, &[&["run.mcap"], words].concat());
        assert_eq!((output.status.code(), complaint(&output)), (Some(0), said), "{words:?}");
    }
    let said = complaint(&plot(at, &["rare.mcap", "-o", "out", "--format", "svg"]));
    assert!(said.contains("samples are too rare for the vibration of the beam") && !said.contains("pictures"), "{said}");
}

#[test]
fn regress_a_speed_without_its_equals_sign_is_told_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let why = "error: 0.25: no such file; a speed follows an equals sign: --animation=0.25\n";
    for words in [["run.mcap", "--animation", "0.25"], ["--animation", "0.25", "run.mcap"]] {
        let refused = plot(folder.path(), &words);
        assert_eq!((refused.status.code(), complaint(&refused).as_str()), (Some(2), why), "{words:?}");
    }
}

#[test]
fn regress_a_short_range_is_animated_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record(at, "crank-slider", "1", "run.mcap", &[]);
    let range = |to: &str, more: &str| plot(at, &["run.mcap", "--from", "0.5", "--to", to, "-o", "moving.svg", more]);
    let chosen = range("0.55", "--animation");
    let printed = String::from_utf8_lossy(&chosen.stdout).into_owned();
    assert!(printed.starts_with("moving.svg (0.0500 s at 0.025 times the real speed, bending"), "{printed}");
    assert_eq!((chosen.status.code(), complaint(&chosen).as_str()), (Some(0), ""));
    for (speed, code, said) in [
        ("--animation=0.1", 0, "warning: run: at 0.1 times the real speed, there are only 9 pictures"),
        ("--animation=1", 2, "run: at 1 times the real speed, there is only one picture"),
    ] {
        let output = range("0.55", speed);
        let said = format!("{said}; --animation=0.025 shows the motion");
        assert!(complaint(&output).contains(&said), "{said}: {}", complaint(&output));
        assert_eq!(output.status.code(), Some(code), "{speed}");
    }
    let single = range("0.501", "--animation");
    assert_eq!(single.status.code(), Some(2), "{}", complaint(&single));
    let figures = plot(at, &["run.mcap", "--from", "0.5", "--to", "0.501", "-o", "out", "--format", "svg"]);
    assert_eq!(figures.status.code(), Some(0), "{}", complaint(&figures));
    assert!(at.join("out/run-strobe.svg").exists() && !at.join("out/run-animation.svg").exists());
    let page = read_to_string(at.join("out/index.html")).unwrap();
    assert!(page.contains("run-strobe.svg") && !page.contains("run-animation.svg"), "{page}");
}

/// The positions of a straight chain that turns about its pivot, or rests on the horizontal through it.
fn chain(turns: bool) -> Named {
    let times: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
    let mut table = Table::default();
    table.push("stamp.sim_time_s", times.clone());
    for (node, distance) in [("crank.0", 0.0), ("crank.1", 1.0), ("rod.0", 1.0), ("rod.1", 2.0)] {
        let angle = |time: &f64| if turns { *time } else { 0.0 };
        table.push(format!("nodes.{node}.x_m"), times.iter().map(|time| distance * angle(time).cos()).collect());
        table.push(format!("nodes.{node}.y_m"), times.iter().map(|time| distance * angle(time).sin()).collect());
    }
    Named { name: "displacements".to_owned(), table, ..Named::default() }
}

#[test]
fn regress_the_guide_of_the_slider_is_drawn_only_where_there_is_a_slider() {
    let loads = |column: &str| {
        let mut table = Table::default();
        table.push(column, vec![0.0]);
        Named { name: "loads".to_owned(), table, ..Named::default() }
    };
    for (topics, guides) in [
        (vec![chain(false), loads("resistance_n")], 1),
        (vec![chain(false)], 1),
        (vec![chain(false), loads("driving_torque_nm")], 0),
        (vec![chain(true)], 0),
        (turning(|time| time, 1.0, 100).to_vec(), 0),
    ] {
        let strobe = MechanismPicture::strobe("chain", &topics).unwrap().to_svg();
        let animation = MechanismPicture::animation("chain", &topics, None).unwrap().to_svg();
        let count = |svg: &str| svg.matches("stroke-dasharray").count();
        assert_eq!([count(&strobe), count(&animation)], [guides; 2]);
    }
}
