//! Options by the names that other programs have for them.

/// An option by the names that other programs have for it.
pub(super) struct Meaning {
    pub names: &'static [&'static str],
    /// `None` where no option has the meaning, but something else.
    pub option: Option<&'static str>,
    /// The only command in which the names mean the option; `None` for every command that has it.
    pub command: Option<&'static str>,
    pub tip: &'static str,
}

pub(super) const MEANINGS: [Meaning; 28] = [
    Meaning {
        names: &["--duration", "--end", "--time"],
        option: Some("--until"),
        command: None,
        tip: "the option for the end is --until TIME",
    },
    Meaning {
        names: &["--at", "--start", "--begin"],
        option: Some("--delay"),
        command: Some("pulse"),
        tip: "the option for the time until the pulse begins is --delay TIME",
    },
    Meaning {
        names: &["--output", "-o"],
        option: Some("--record"),
        command: None,
        tip: "the option for the recording is --record PATH",
    },
    Meaning {
        names: &["--held", "--free"],
        option: Some("--crank"),
        command: None,
        tip: "the option for the crank is --crank held or --crank free",
    },
    Meaning {
        names: &["--set"],
        option: None,
        command: Some("sweep"),
        tip: "changes of every run stand in the campaign's file: set = [\"KEY=VALUE\"]",
    },
    Meaning {
        names: &["--scene"],
        option: None,
        command: Some("sweep"),
        tip: "the scene stands in the campaign's file: scene = \"mine.toml\"",
    },
    Meaning {
        names: &["--scene"],
        option: None,
        command: Some("what-if"),
        tip: "a recording stands without an option, and has its scene",
    },
    Meaning {
        names: &["--scene"],
        option: Some("--set"),
        command: None,
        tip: "a scene stands without an option, as in `flexcrank run mine.toml`",
    },
    Meaning {
        names: &["--config"],
        option: Some("--zenoh-config"),
        command: None,
        tip: "the option for zenoh's configuration is --zenoh-config FILE",
    },
    Meaning {
        names: &["--rate"],
        option: Some("--pace"),
        command: Some("run"),
        tip: "the option for simulated seconds per second is --pace FACTOR, or --pace max",
    },
    Meaning {
        names: &["--speed", "--pace"],
        option: Some("--rate"),
        command: Some("replay"),
        tip: "the option for recorded seconds per second is --rate FACTOR",
    },
    Meaning {
        names: &["--from", "--start", "--begin"],
        option: Some("--start-offset"),
        command: Some("replay"),
        tip: "the option for the time in the recording to begin at is --start-offset TIME",
    },
    Meaning {
        names: &["--until", "--end", "--to"],
        option: Some("--duration"),
        command: Some("replay"),
        tip: "the option for the part that is replayed is --duration TIME, from --start-offset on",
    },
    Meaning { names: &["--until", "--end"], option: Some("--to"), command: None, tip: "the option for the end is --to TIME" },
    Meaning {
        names: &["--min"],
        option: Some("--from"),
        command: Some("response"),
        tip: "the option for the lowest frequency is --from HZ",
    },
    Meaning {
        names: &["--max"],
        option: Some("--to"),
        command: Some("response"),
        tip: "the option for the highest frequency is --to HZ",
    },
    Meaning {
        names: &["--columns", "--column", "--signals", "--signal"],
        option: Some("--y"),
        command: Some("plot"),
        tip: "the option for the columns of a figure is --y COLUMN",
    },
    Meaning {
        names: &["--topics", "--topic", "--signals", "--signal", "--y"],
        option: Some("--columns"),
        command: Some("export"),
        tip: "the option for what is exported is --columns COLUMN",
    },
    Meaning {
        names: &["--topics", "--topic", "--columns", "--column", "--y"],
        option: Some("--signals"),
        command: Some("watch"),
        tip: "the option for what is shown is --signals SIGNAL",
    },
    Meaning {
        names: &["--modes", "--number"],
        option: Some("--count"),
        command: Some("modes"),
        tip: "the option for the number of modes is --count N",
    },
    Meaning {
        names: &["--dt"],
        option: Some("--steps"),
        command: Some("trade"),
        tip: "the option for the steps to try is --steps TIME,…",
    },
    Meaning {
        names: &["--dt"],
        option: Some("--step"),
        command: Some("linearise"),
        tip: "the option for the step of a model in discrete time is --step TIME",
    },
    Meaning {
        names: &["--count", "--steps", "-n"],
        option: None,
        command: Some("step"),
        tip: "the number of steps stands without an option: flexcrank control NAME step 10",
    },
    Meaning {
        names: &["--pulse", "--pulses"],
        option: Some("--add-pulse"),
        command: Some("what-if"),
        tip: "the option for another pulse is --add-pulse START:TORQUE:DURATION",
    },
    Meaning {
        names: &["--pulse", "--pulses", "--add-pulse"],
        option: Some("--set"),
        command: Some("run"),
        tip: "a pulse is a [[pulse]] of the scene, or is sent to the service: flexcrank pulse NAME --torque NM --duration TIME",
    },
    Meaning {
        names: &["--rpm"],
        option: Some("--speed"),
        command: None,
        tip: "the option for the speed is --speed RAD/S: 60 rpm are 6.2832 rad/s",
    },
    Meaning {
        names: &["--speed", "--rpm"],
        option: Some("--set"),
        command: Some("run"),
        tip: "the speed of the crank is a key: --set drive.speed_rad_per_s=31.4; that of the clock is --pace FACTOR",
    },
    Meaning {
        names: &["--model", "--integrator", "--step", "--dt", "--solver", "--elements", "--modes", "--torque"],
        option: Some("--set"),
        command: None,
        tip: "keys of the scene are changed by --set KEY=VALUE, as in --set solver.model=modal",
    },
];

#[cfg(test)]
mod tests {
    use super::super::argument_tips::tests::refusal;

    /// `run --scene` led to `--scene-updates`, and `modes --modes` to a key of the scene.
    #[test]
    fn regress_an_option_of_another_command_or_program_leads_to_that_of_this_one() {
        let (scene, speed) =
            ("a scene stands without an option, as in `flexcrank run mine.toml`", "--set drive.speed_rad_per_s=31.4");
        for (line, tip) in [
            ("run --scene mine.toml", scene),
            ("--scene mine.toml", scene),
            ("trade --scene mine.toml", scene),
            ("sweep spec.toml --scene mine.toml", "the scene stands in the campaign's file"),
            ("what-if take.mcap --scene mine.toml", "a recording stands without an option, and has its scene"),
            ("run --config gate.json5", "--zenoh-config FILE"),
            ("watch crank --config gate.json5", "--zenoh-config FILE"),
            ("run crank-slider --speed 30", speed),
            ("run --rpm 300", speed),
            ("replay take.mcap --speed 2", "--rate FACTOR"),
            ("replay take.mcap --begin 3", "--start-offset TIME"),
            ("replay take.mcap --until 3", "--duration TIME"),
            ("plot take.mcap --columns angle", "--y COLUMN"),
            ("plot take.mcap --until 3", "--to TIME"),
            ("response --max 100", "--to HZ"),
            ("response --min 1", "--from HZ"),
            ("watch crank --topic angles", "--signals SIGNAL"),
            ("export take.mcap --csv out --topics angles", "--columns COLUMN"),
            ("modes crank-slider --modes 3", "--count N"),
            ("trade --dt 1e-3", "--steps TIME,…"),
            ("linearise --dt 1e-3", "--step TIME"),
            ("pulse crank --torque 1 --duration 1s --start 2", "--delay TIME"),
            ("control crank step --count 10", "flexcrank control NAME step 10"),
            ("what-if take.mcap --pulse 3:5:0.1", "--add-pulse START:TORQUE:DURATION"),
            ("run arm.toml --pulse 5", "flexcrank pulse NAME --torque NM --duration TIME"),
        ] {
            let said = refusal(line);
            assert!(said.contains("tip: ") && said.contains(tip) && said.matches("tip: ").count() == 1, "{line}: {said}");
        }
        for line in ["list --scene mine.toml", "pulse crank --torque 1 --duration 1s --min 2", "verify take.mcap --config x"] {
            assert!(!refusal(line).contains("tip: "), "{line}: {}", refusal(line));
        }
    }
}
