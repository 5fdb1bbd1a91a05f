//! Frames drawn from a sample recording, without a terminal.

use std::path::Path;

use prost::Message as _;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::draw::draw;
use super::state::{KeyRequest, View};
use crate::bus::Name;
use crate::recording::Messages;
use crate::wire::{Angles, Displacements, Energies, Loads, NodeState, Replay, Shadow, Stamp, Status, status::State};

type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

fn view(signals: &[&str]) -> Outcome<View> {
    let name: Name = "crank".parse()?;
    Ok(View::new(name, signals.iter().map(|&signal| signal.to_owned()).collect()))
}

/// The view after the first `messages` messages of the sample.
fn sampled(signals: &[&str], messages: usize) -> Outcome<View> {
    let mut view = view(signals)?;
    for message in Messages::open(Path::new("recordings/sample-three-pulses.mcap"))?.take(messages) {
        let message = message?;
        let data = message.data.as_ref();
        match message.channel.topic.rsplit('/').next() {
            Some("angles") => view.angles(&Angles::decode(data)?),
            Some("loads") => view.loads(&Loads::decode(data)?),
            Some("displacements") => view.displacements(Displacements::decode(data)?),
            Some("energies") => view.energies(&Energies::decode(data)?),
            Some("status") => view.status(Status::decode(data)?),
            _ => {}
        }
    }
    Ok(view)
}

/// A frame, line by line.
fn picture(view: &mut View, width: u16, height: u16) -> Outcome<Vec<String>> {
    let mut terminal = Terminal::new(TestBackend::new(width, height))?;
    terminal.draw(|frame| draw(frame, view))?;
    let buffer = terminal.backend().buffer();
    let line = |y| (0..width).filter_map(|x| buffer.cell((x, y))).map(|cell| cell.symbol()).collect();
    Ok((0..height).map(line).collect())
}

fn press(view: &mut View, code: KeyCode) -> Option<KeyRequest> {
    view.key(KeyEvent::new(code, KeyModifiers::NONE))
}

/// Number of braille dots in some lines.
fn dots(lines: &[String]) -> u32 {
    let of = |symbol: char| if ('\u{2800}'..='\u{28ff}').contains(&symbol) { (symbol as u32 - 0x2800).count_ones() } else { 0 };
    lines.iter().flat_map(|line| line.chars()).map(of).sum()
}

#[test]
fn prop_state_mechanism_charts_and_keys_fit_small_and_large_terminals() -> Outcome {
    for (width, height) in [(80, 24), (200, 60)] {
        let mut view = sampled(&["crank.rate_rad_per_s", "slider.x_m"], 3000)?;
        let lines = picture(&mut view, width, height)?;
        let all = lines.join("\n");
        for wanted in ["flexcrank/crank", "RUNNING", "balance", "bending drawn", "crank.rate_rad_per_s", "slider.x_m", "q quit"] {
            assert!(all.contains(wanted), "no `{wanted}` at {width}x{height}:\n{all}");
        }
        assert!(dots(&lines) > 200, "{} dots:\n{all}", dots(&lines));
        assert!(!all.contains("not there"), "{all}");
    }
    Ok(())
}

#[test]
fn val_the_mechanism_is_drawn_to_scale() -> Outcome {
    let mut view = sampled(&[], 3)?;
    let node = |link: &str, x_m, y_m| NodeState { link: link.to_owned(), x_m, y_m, ..NodeState::default() };
    let crank = [node("crank", 0.0, 0.0), node("crank", 0.0, 0.5)];
    let rod = [node("rod", 0.0, 0.5), node("rod", 2.0_f64.sqrt(), 0.0)];
    view.displacements(Displacements { nodes: [crank, rod].concat(), ..Displacements::default() });
    // The crank stands upright over half a metre, the rod spans 1.414 m. Pins surround them, and perhaps a slider.
    let [wide, high] = extent(&picture(&mut view, 109, 200)?[3..100]);
    let (per_metre, expected) = ((wide - 6.0) / 2.0_f64.sqrt(), 0.5 * (wide - 6.0) / 2.0_f64.sqrt() + 4.5);
    assert!(per_metre > 50.0 && (high - expected).abs() < 5.0, "{wide} dots by {high}, expected {expected:.1}");
    Ok(())
}

/// Width and height of the braille dots in some lines.
fn extent(lines: &[String]) -> [f64; 2] {
    // Column and row of each bit in its cell.
    const PLACES: [(usize, usize); 8] = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)];
    let mut places = Vec::new();
    for (row, line) in lines.iter().enumerate() {
        for (column, symbol) in line.chars().enumerate().filter(|(_, symbol)| ('\u{2801}'..='\u{28ff}').contains(symbol)) {
            let bits = symbol as u32 - 0x2800;
            let set = PLACES.iter().enumerate().filter(|(bit, _)| bits >> bit & 1 == 1);
            places.extend(set.map(|(_, (x, y))| [2 * column + x, 4 * row + y]));
        }
    }
    let span = |k: usize| {
        let all = || places.iter().map(|place| place[k]);
        (all().max().unwrap_or(0) - all().min().unwrap_or(0) + 1) as f64
    };
    [span(0), span(1)]
}

#[test]
fn prop_any_size_can_be_drawn() -> Outcome {
    let mut view = sampled(&[], 500)?;
    for (width, height) in [(1, 1), (2, 1), (1, 50), (300, 2), (10, 5), (80, 4), (80, 24)] {
        picture(&mut view, width, height)?;
    }
    Ok(())
}

#[test]
fn prop_an_empty_view_and_nan_are_drawn() -> Outcome {
    let mut empty = view(&["no.such_signal"])?;
    assert!(picture(&mut empty, 80, 24)?.join("\n").contains("not there"));
    let mut mistyped = sampled(&["crank.rate_rad_per_z"], 500)?;
    let all = picture(&mut mistyped, 200, 24)?.join("\n");
    assert!(all.contains("crank.rate_rad_per_z: not there; did you mean `crank.rate_rad_per_s`?"), "{all}");
    let mut broken = sampled(&[], 50)?;
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308] {
        let node =
            |x_m| NodeState { link: "crank".to_owned(), x_m, y_m: value, rotation_rad: Some(value), ..NodeState::default() };
        broken.displacements(Displacements { nodes: vec![node(0.0), node(value)], ..Displacements::default() });
        broken.displacements(Displacements { nodes: vec![node(value)], ..Displacements::default() });
        picture(&mut broken, 80, 24)?;
        broken.loads(&Loads { driving_torque_nm: value, ..Loads::default() });
        broken.status(Status { balance_error_j: Some(value), real_time_factor: Some(value), ..Status::default() });
        picture(&mut broken, 80, 24)?;
    }
    broken.displacements(Displacements::default());
    picture(&mut broken, 80, 24)?;
    Ok(())
}

#[test]
fn val_keys_select_signals_and_send_requests() -> Outcome {
    let mut view = sampled(&["slider.x_m", "driving_torque_nm"], 500)?;
    picture(&mut view, 80, 24)?;
    assert_eq!(press(&mut view, KeyCode::Char(' ')), Some(KeyRequest::Pause));
    view.status(Status { state: State::Paused.into(), ..Status::default() });
    assert_eq!(press(&mut view, KeyCode::Char(' ')), Some(KeyRequest::Resume));
    assert_eq!(press(&mut view, KeyCode::Char('p')), Some(KeyRequest::Pulse));
    assert_eq!(press(&mut view, KeyCode::Char('r')), Some(KeyRequest::Reset));
    assert_eq!(press(&mut view, KeyCode::Char('q')), Some(KeyRequest::Quit));
    assert_eq!(view.key(KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL)), Some(KeyRequest::Quit));
    press(&mut view, KeyCode::Tab);
    press(&mut view, KeyCode::Down);
    press(&mut view, KeyCode::Up);
    assert_eq!(view.charts(), ["slider.x_m", "driving_torque_nm"]);
    press(&mut view, KeyCode::Up);
    assert_eq!(view.charts()[0], "slider.x_m");
    assert_ne!(view.charts()[1], "driving_torque_nm", "the chart in focus has changed");
    let factor = view.magnification.factor;
    press(&mut view, KeyCode::Char('+'));
    assert!(view.magnification.factor > factor && !view.magnification.automatic);
    Ok(())
}

#[test]
fn prop_signals_have_the_names_that_export_gives_them() -> Outcome {
    let view = sampled(&[], 500)?;
    for name in ["crank.chord_rad", "links.crank.chord_rad", "nodes.rod.2.deflection_m", "joints.pivot.fx_n", "driving_torque_nm"]
    {
        assert!(view.signals.find(name).is_some(), "{name}");
    }
    assert_eq!(view.charts().first().map(String::as_str), Some("crank.rate_rad_per_s"));
    Ok(())
}

#[test]
fn prop_energies_come_from_their_own_topic_or_else_from_the_status() -> Outcome {
    let mut view = view(&["kinetic_j"])?;
    let at = |sim_time_s| Some(Stamp { sim_time_s, ..Stamp::default() });
    let now = |view: &View| view.signals.find("kinetic_j").map(|strip| (strip.now, strip.last(10.0).count()));
    view.status(Status { stamp: at(1.0), kinetic_j: Some(5.0), ..Status::default() });
    assert_eq!(now(&view), Some((5.0, 1)), "of an earlier version");
    view.energies(&Energies { stamp: at(1.5), kinetic_j: Some(6.0), ..Energies::default() });
    // An older message that arrives later would restart the chart.
    view.status(Status { stamp: at(1.25), kinetic_j: Some(7.0), ..Status::default() });
    assert_eq!(now(&view), Some((6.0, 2)));
    Ok(())
}

#[test]
fn val_the_difference_of_a_shadow_is_shown_and_can_be_charted() -> Outcome {
    let mut view = sampled(&["shadow.angle_rad"], 500)?;
    assert!(picture(&mut view, 80, 24)?.join("\n").contains("not there"));
    view.shadow(Shadow { model: "modal".to_owned(), angle_rad: -3.2e-3, ..Shadow::default() });
    let lines = picture(&mut view, 80, 24)?;
    assert!(lines[0].contains("shadow modal -3.2e-3 rad"), "{}", lines[0]);
    assert_eq!(view.signals.find("shadow.angle_rad").map(|strip| strip.now), Some(-3.2e-3));
    Ok(())
}

#[test]
fn regress_the_first_line_has_the_time_of_what_is_drawn() -> Outcome {
    let mut view = view(&[])?;
    let at = |step, sim_time_s| Some(Stamp { step, sim_time_s, ..Stamp::default() });
    view.status(Status { stamp: at(100, 1.0), ..Status::default() });
    assert!(picture(&mut view, 80, 24)?[0].contains("  t 1.00 s"));
    view.angles(&Angles { stamp: at(130, 1.3), ..Angles::default() });
    assert!(picture(&mut view, 80, 24)?[0].contains("  t 1.30 s"));
    view.status(Status { stamp: at(132, 1.32), state: State::Paused.into(), ..Status::default() });
    assert!(picture(&mut view, 80, 24)?[0].contains("  t 1.32 s"));
    // The recording begins in the middle of a session.
    let replay = Some(Replay { duration_s: 6.0, ..Replay::default() });
    view.status(Status { stamp: at(0, 0.5), replay, ..Status::default() });
    assert!(picture(&mut view, 80, 24)?[0].contains("  t 0.50 s of 6.00 s"));
    Ok(())
}

#[test]
fn regress_a_long_message_is_shown_whole() -> Outcome {
    let mut view = sampled(&[], 500)?;
    let message =
        "diverged in step 35501 at t = 1.42 s: the energy grew to 1e9 J; before it there were 12.3 J; try a shorter step";
    view.status(Status { state: State::Diverged.into(), message: message.to_owned(), ..Status::default() });
    let all = picture(&mut view, 80, 24)?.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ");
    assert!(all.contains(message), "{all}");
    Ok(())
}

#[test]
fn regress_no_letters_are_left_behind_in_a_small_terminal() -> Outcome {
    let lines = picture(&mut view(&[])?, 20, 5)?;
    assert!(lines.iter().any(|line| line.trim_matches(['─', ' ']) == "nothing to draw yet"), "{lines:?}");
    Ok(())
}
