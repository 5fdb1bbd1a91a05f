//! Solves scenes for whoever asks, timed, without bus or recording: what `versus-exudyn` compares.
//!
//! One request a line on standard input, `SCENE KEY=VALUE…`. One answer a line on standard output: seconds of computing, then the
//! crank's chord angle (rad) every 0.01 s from 0 to 2 s; or `failed` and why. Seconds are the thread's own, so that what else the
//! machine does counts little.

use std::error::Error;
use std::io::stdin;

use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;
use rustix::time::{ClockId, clock_gettime};

const INTERVAL_S: f64 = 0.01;
const INSTANTS: u32 = 200;

fn main() -> Result<(), Box<dyn Error>> {
    for line in stdin().lines() {
        let words: Vec<String> = line?.split_whitespace().map(str::to_owned).collect();
        let Some((scene, overrides)) = words.split_first() else { continue };
        match solve(scene, overrides) {
            Ok(numbers) => println!("{}", numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")),
            Err(error) => println!("failed {error}"),
        }
    }
    Ok(())
}

/// Seconds, then angles. Building the simulation is not timed; looking at it is.
fn solve(scene: &str, overrides: &[String]) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut simulation = Simulation::new(&SceneSource::open(scene, overrides)?.scene)?;
    let steps = (INTERVAL_S / simulation.step_s()).round() as u32;
    if (f64::from(steps) * simulation.step_s() - INTERVAL_S).abs() > 1e-12 {
        return Err(format!("the step must divide {INTERVAL_S} s").into());
    }
    let mut numbers = vec![0.0; INSTANTS as usize + 2];
    let begin_s = thread_s();
    for instant in 1..=INSTANTS {
        for _ in 0..steps {
            simulation.step()?;
        }
        numbers[instant as usize + 1] = simulation.observe()?.links[0].chord_rad;
    }
    numbers[0] = thread_s() - begin_s;
    Ok(numbers)
}

/// Seconds that this thread has computed.
fn thread_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}
