//! Tips in refusals of the command line: a way on from what was given to what was meant.

use std::ffi::OsString;
use std::path::Path;

use clap::ArgAction;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind as Kind};

use super::client_args::file_hint;
use super::other_names::{MEANINGS, Meaning};
use super::values::{finite, rpm_hint, seconds};
use crate::decimal_comma::decimal_comma_hint;
use crate::nearest::nearest;
use crate::recording::begins_as_mcap;
use crate::scene::{builtin, is_key_of_a_scene};

/// Adds a way on to an error of the arguments: the commands there are, the place of files, scenes and options, an option by its name
/// here, an option with two dashes, a decimal point, the commands for a file, or a value in one word.
pub(super) fn with_tips(mut error: clap::Error, root: &clap::Command, words: &[OsString]) -> clap::Error {
    let given = [ContextKind::InvalidSubcommand, ContextKind::InvalidArg].iter().find_map(|kind| error.get(*kind));
    let given = given.map(ToString::to_string).unwrap_or_default();
    // `help control pause` is about `control pause`.
    let before = words.iter().skip(1).skip_while(|word| *word == "help").take_while(|word| **word != *given);
    let innermost = before.fold(root, |command, word| command.find_subcommand(word).unwrap_or(command));
    let command = if innermost.has_subcommands() { innermost } else { root };
    let (is_option, is_root) = (given.starts_with('-'), innermost.get_name() == root.get_name());
    let with_options = if is_root { root.find_subcommand("run").unwrap_or(root) } else { innermost };
    let long = match error.kind() {
        Kind::UnknownArgument if is_option && !given.starts_with("--") => after_one_dash(with_options, words),
        // clap reads `-rate` as `-r` with the value `ate`.
        Kind::ValueValidation => after_one_dash(with_options, words),
        _ => None,
    };
    let first = long.as_deref().unwrap_or(&given);
    let meaning = if error.kind() == Kind::UnknownArgument { other_name_tip(&given, with_options, words) } else { None };
    let option_of_run = || option_of_run(first, root).filter(|_| meaning.is_none());
    let place = if is_root { place_of(first).filter(|_| !first.starts_with('-')).or_else(option_of_run) } else { None };
    let dashes = long.map(|long| format!("a long option has two dashes: {long}"));
    let joined = in_one_word(&given, innermost, words);
    let suggested = error.get(ContextKind::SuggestedArg).map(ToString::to_string);
    if meaning.is_some() || suggested.is_some_and(|option| leads_nowhere(&given, &option, innermost, words)) {
        // clap also shows the usage of what it suggests.
        error.remove(ContextKind::SuggestedArg);
        error.insert(ContextKind::Usage, ContextValue::StyledStr(innermost.clone().render_usage()));
    }
    let tip = match error.kind() {
        Kind::InvalidSubcommand | Kind::UnknownArgument if place.is_some() => {
            // clap suggests a command with a similar name.
            error.remove(ContextKind::SuggestedSubcommand);
            place
        }
        Kind::UnknownArgument if joined.is_some() => joined,
        Kind::UnknownArgument if is_key_of_a_scene(&given) => Some(format!("a key of the scene is changed with --set {given}")),
        Kind::UnknownArgument if dashes.is_some() => dashes,
        Kind::UnknownArgument if meaning.is_some() => meaning.map(str::to_owned),
        // After other arguments, a word that is no command counts as one argument too many.
        Kind::InvalidSubcommand => Some(names(command)),
        Kind::UnknownArgument if !is_option && innermost.has_subcommands() => Some(names(command)),
        // clap's tip, to pass an option as a value, seldom helps.
        Kind::UnknownArgument if is_option && error.get(ContextKind::SuggestedArg).is_none() => Some(String::new()),
        Kind::ValueValidation => error
            .get(ContextKind::InvalidValue)
            .map(ToString::to_string)
            .and_then(|value| {
                let of_file = || file_hint(&value).map(|hint| format!("{value} is {hint}"));
                let given = in_list(&value, words).unwrap_or(&value);
                decimal_comma_hint(given).or_else(|| rpm_hint(&value)).or_else(of_file)
            })
            .or(dashes),
        _ => None,
    };
    match tip {
        Some(_) if error.get(ContextKind::SuggestedSubcommand).is_some() => {}
        Some(tip) if tip.is_empty() => drop(error.remove(ContextKind::Suggested)),
        Some(tip) => {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![StyledStr::from(tip)]));
        }
        None => {}
    }
    error
}

/// The list in which a value stands among the words, which clap splits at its commas: `0,1` of the value `0`.
fn in_list<'a>(value: &str, words: &'a [OsString]) -> Option<&'a str> {
    let lists = words.iter().filter_map(|word| word.to_str()).map(|word| word.split_once('=').map_or(word, |(_, list)| list));
    lists.filter(|list| list.contains(',')).find(|list| list.split(',').any(|entry| entry == value))
}

/// The tip for an option by a name that another program has for it, if the command has the option, and it is not given already.
fn other_name_tip(name: &str, command: &clap::Command, words: &[OsString]) -> Option<&'static str> {
    let has = |option: &str| command.get_arguments().any(|arg| arg.get_long() == option.strip_prefix("--"));
    let is_meant = |meaning: &&Meaning| {
        let is_here = meaning.command.is_none_or(|only| only == command.get_name());
        let is_open = |option: &str| has(option) && (option == "--set" || !is_given(option, words));
        // `--steps` of trade is nearer than the scene's key.
        let has_plural = name.starts_with("--") && has(&format!("{name}s"));
        meaning.names.contains(&name) && !has_plural && is_here && meaning.option.is_none_or(is_open)
    };
    MEANINGS.iter().find(is_meant).map(|meaning| meaning.tip)
}

/// Whether an option that clap suggests is far from the one given, is hidden, or is given already and stands only once.
fn leads_nowhere(given: &str, option: &str, command: &clap::Command, words: &[OsString]) -> bool {
    let suggested = command.get_arguments().find(|arg| arg.get_long() == option.strip_prefix("--"));
    let stands_once = |arg: &clap::Arg| !matches!(arg.get_action(), ArgAction::Append | ArgAction::Count);
    let name = |option: &str| option.split('=').next().unwrap_or_default().trim_start_matches('-').to_owned();
    let is_far = nearest(&name(given), [name(option).as_str()]).is_none();
    suggested.is_some_and(|arg| is_far || arg.is_hide_set() || stands_once(arg) && is_given(option, words))
}

/// Whether an option is among the words, by itself or with its value: `--until=3`.
fn is_given(option: &str, words: &[OsString]) -> bool {
    words.iter().filter_map(|word| word.to_str()).any(|word| word.split('=').next() == Some(option))
}

/// The place of a first word that is no command: a recording, a table, a scene, or an option of a run.
fn place_of(word: &str) -> Option<String> {
    let path = Path::new(word);
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if ending == "mcap" || begins_as_mcap(path) {
        return Some(format!("a recording stands after a command: flexcrank info {word}, plot {word} or replay {word}"));
    }
    if ending == "csv" {
        return Some(format!("a table stands after a command: flexcrank plot {word}"));
    }
    let is_file = word.contains(['.', '/', '\\']) && !path.is_dir() || path.is_file();
    (is_file || builtin::find(word).is_ok()).then(|| after_run(word))
}

/// The place of an option of `run`, or of one whose name is near, where no command was given.
fn option_of_run(word: &str, root: &clap::Command) -> Option<String> {
    let given = word.split('=').next()?.strip_prefix("--")?;
    let of = |command: &clap::Command| -> Vec<String> {
        command.get_arguments().filter(|arg| !arg.is_hide_set()).filter_map(clap::Arg::get_long).map(str::to_owned).collect()
    };
    let (own, of_run) = (of(root), of(root.find_subcommand("run")?));
    // A slip in an option of every command has clap's tip.
    let near = nearest(given, own.iter().chain(&of_run).map(String::as_str))?;
    of_run.iter().find(|option| *option == near && !own.contains(option)).map(|option| after_run(&format!("--{option}")))
}

fn after_run(word: &str) -> String {
    format!("scenes and options of a run stand after `run`: flexcrank run {word}")
}

/// A refusal of a word that `run` read as a scene, but is the value of the option before it, which follows an equals sign.
pub(super) fn detached_value(root: &clap::Command, words: &[OsString]) -> Option<clap::Error> {
    let run = words.get(1).filter(|word| *word == "run").and_then(|word| root.find_subcommand(word))?;
    let optional =
        |option: &str| run.get_arguments().any(|arg| arg.get_long() == option.strip_prefix("--") && arg.is_require_equals_set());
    let is_there = |word: &str| {
        let path = Path::new(word);
        let is_named_as_file = path.extension().is_some_and(|ending| ending == "toml" || ending == "mcap");
        path.exists() || is_named_as_file || builtin::find(word).is_ok()
    };
    (1..words.len()).find_map(|at| {
        let (option, value) = (words[at - 1].to_str()?, words[at].to_str()?);
        let is_detached = option.starts_with("--") && optional(option) && !value.starts_with('-') && !is_there(value);
        let joined = || [&words[..at - 1], &[OsString::from(format!("{option}={value}"))], &words[at + 1..]].concat();
        let is_value = is_detached && root.clone().try_get_matches_from(joined()).is_ok();
        let said =
            format!("{value}: no scene or file of this name\n\n  tip: the value follows an equals sign: {option}={value}\n");
        is_value.then(|| clap::Error::raw(Kind::ValueValidation, said))
    })
}

/// The long option of a command that a word names after one dash: `-until`.
fn after_one_dash(command: &clap::Command, words: &[OsString]) -> Option<String> {
    let names = words.iter().filter_map(|word| word.to_str()?.strip_prefix('-'));
    let mut names = names.map(|name| name.split_once('=').map_or(name, |(name, _)| name));
    let long = names.find(|name| command.get_arguments().any(|arg| arg.get_long() == Some(*name)))?;
    Some(format!("--{long}"))
}

/// A tip for a word that belongs to the one before it: the unit of a time, or a value that needs an equals sign.
fn in_one_word(given: &str, command: &clap::Command, words: &[OsString]) -> Option<String> {
    let needs_equals = |option: &str| {
        let long = option.strip_prefix("--");
        long.is_some() && command.get_arguments().any(|arg| arg.get_long() == long && arg.is_require_equals_set())
    };
    let of_set = |from: usize| {
        let [set, key, value, next] = [0, 1, 2, 3].map(|k| words.get(from + k).and_then(|word| word.to_str()).unwrap_or("VALUE"));
        let value = if value == given { value.strip_prefix('=').unwrap_or(value) } else { return None };
        let value = if value.is_empty() { next } else { value };
        (set == "--set" && !key.contains('=')).then(|| format!("the value follows an equals sign: --set {key}={value}"))
    };
    let of_option = words.windows(2).filter(|pair| pair[1] == *given).find_map(|pair| match pair[0].to_str()? {
        number if finite(number).is_some() && seconds(&format!("{number}{given}")).is_some() => {
            Some(format!("a time is written without a space: {number}{given}"))
        }
        option if needs_equals(option) => Some(format!("the value follows an equals sign: {option}={given}")),
        _ => None,
    });
    of_option.or_else(|| (0..words.len()).find_map(of_set))
}

/// The commands of a command.
fn names(command: &clap::Command) -> String {
    let names: Vec<&str> = command.get_subcommands().filter(|of| !of.is_hide_set()).map(clap::Command::get_name).collect();
    format!("the commands are {}", names.join(", "))
}

#[cfg(test)]
pub(super) mod tests {
    use std::ffi::OsString;

    use super::super::args::Cli;
    use super::{detached_value, with_tips};

    /// The refusal of a line, with its tip; nothing if it is accepted.
    pub(in crate::cli) fn refusal(line: &str) -> String {
        let words: Vec<OsString> = std::iter::once("flexcrank").chain(line.split(' ')).map(OsString::from).collect();
        let mut command = Cli::complete_command();
        let refused = command.try_get_matches_from_mut(&words).err();
        refused.map(|error| with_tips(error, &command, &words).to_string()).unwrap_or_default()
    }

    #[test]
    fn regress_options_by_other_names_and_speeds_in_rpm_lead_to_those_here() {
        for (line, tip) in [
            ("run --rate 2", "tip: the option for simulated seconds per second is --pace FACTOR"),
            ("run --model rigid", "--set solver.model=modal"),
            ("run --no-bus --torque 0.8", "--set solver.model=modal"),
            ("check --set rod.modes=2 --elements 8", "--set solver.model=modal"),
            ("cycle --rpm 955", "--speed RAD/S: 60 rpm are 6.2832 rad/s"),
            ("cycle --speed 955rpm", "955rpm are 100.007 rad/s"),
            ("run --duration 3", "the option for the end is --until TIME"),
            ("trade --step 1e-3", "a similar argument exists: '--steps'"),
            ("trade --model modal", "a similar argument exists: '--models'"),
            ("trade --integrator esdirk", "a similar argument exists: '--integrators'"),
            ("cycle --ratio 0,1", "a number has a decimal point, not a comma: 0.1\n"),
            ("trade --steps=0,001", "a number has a decimal point, not a comma: 0.001\n"),
            ("cycle --sweep-ratio 0,1:0,6:51", "a number has a decimal point, not a comma: 0.1:0.6:51\n"),
        ] {
            assert!(refusal(line).contains(tip), "{line}: {}", refusal(line));
        }
    }

    #[test]
    fn regress_help_of_an_unknown_command_of_a_command_lists_its_commands() {
        for line in ["help control nosuch", "control crank nosuch"] {
            assert!(refusal(line).contains("tip: the commands are pause, resume, "), "{line}: {}", refusal(line));
        }
    }

    /// The scene was blamed: `10: not a built-in scene, nor a file`.
    #[test]
    fn regress_a_value_after_a_space_is_no_scene() {
        let refused = |line: &str| {
            let words: Vec<OsString> = std::iter::once("flexcrank").chain(line.split(' ')).map(OsString::from).collect();
            detached_value(&Cli::complete_command(), &words).map(|error| error.to_string()).unwrap_or_default()
        };
        for (line, joined) in [
            ("run --scene-updates 10 --no-record", "--scene-updates=10"),
            ("run --foxglove 127.0.0.1:9000", "--foxglove=127.0.0.1:9000"),
            ("run crank-slider --ros2 5", "--ros2=5"),
        ] {
            assert!(
                refused(line).contains(&format!("tip: the value follows an equals sign: {joined}\n")),
                "{line}: {}",
                refused(line)
            );
        }
        for line in
            ["run --foxglove crank-slider", "run --ros2 arm.toml", "run --foxglove=127.0.0.1:9000", "list --wait", "run 10"]
        {
            assert_eq!(refused(line), "", "{line}");
        }
    }

    /// Those of a scene were refused, and the scene itself was not looked at.
    #[test]
    fn regress_the_modes_of_a_service_are_of_no_scene() {
        assert!(refusal("modes nosuch.toml --live crank").contains("cannot be used with"));
        assert_eq!(refusal("modes --live crank"), "");
    }

    /// Checks the tips of lines; an empty one stands for none.
    fn assert_tips(lines: &[(&str, &str)]) {
        for (line, tip) in lines {
            let said = refusal(line);
            let found = said.split_once("tip: ").and_then(|(_, tip)| tip.lines().next()).unwrap_or_default();
            assert_eq!(found, *tip, "{line}: {said}");
            assert!(said.matches("tip: ").count() <= 1, "{line}: {said}");
        }
    }

    #[test]
    fn regress_another_name_of_the_end_leads_to_until() {
        for line in ["run --duration 5", "run arm.toml --time=5", "run --end 5", "trade --duration 1", "response --end 1"] {
            let said = refusal(line);
            assert!(said.contains("tip: the option for the end is --until TIME\n") && !said.contains("--at"), "{line}: {said}");
            assert!(said.contains(" [OPTIONS] [SCENE"), "{line}: {said}");
        }
        assert!(!refusal("info take.mcap --duration 5").contains("--until"));
        assert!(refusal("run --untl 5").contains("'--until'"));
    }

    #[test]
    fn regress_another_name_of_an_option_leads_to_it_unless_it_is_given() {
        let (record, delay) =
            ("the option for the recording is --record PATH", "the option for the time until the pulse begins is --delay TIME");
        assert_tips(&[
            ("run crank-slider --output x.mcap", record),
            ("run crank-slider -o x.mcap", record),
            ("what-if take.mcap --output=x.mcap", record),
            ("pulse crank --torque 3 --duration 10ms --at 0.1", delay),
            ("pulse crank --torque 3 --duration 10ms --delay 0.2 --at 0.1", ""),
            ("run crank-slider --record=x.mcap -o y.mcap", ""),
            ("sweep spec.toml --set rod.modes=1", "changes of every run stand in the campaign's file: set = [\"KEY=VALUE\"]"),
        ]);
        assert!(!refusal("replay take.mcap --at 3").contains("pulse begins"));
    }

    /// clap looks for a similar option among all of a command, hidden ones and those that are given.
    #[test]
    fn regress_no_hidden_option_is_suggested_and_none_that_is_given_already() {
        assert_tips(&[
            ("run crank-slider --sleep 30", ""),
            ("run --supervise --supervised-recor x.mcap", ""),
            ("run --until 5 --untl 6", ""),
            ("run --untl 6", "a similar argument exists: '--until'"),
            ("run --set solver.step_s=1e-3 --sett rod.modes=3", "a similar argument exists: '--set'"),
        ]);
        assert!(refusal("run --count 2 --conut 3").contains(" [OPTIONS] [SCENE]..."));
    }

    #[test]
    fn regress_a_value_in_two_words_is_refused_with_the_word_to_write() {
        assert_tips(&[
            ("pulse crank --torque 5 --duration 50 ms", "a time is written without a space: 50ms"),
            ("trade crank-slider --budget 4 m", "a time is written without a space: 4m"),
            ("run crank-slider --until 1.5 min --no-record", ""),
            ("setpoint crank --hold 10 ms --torque 5", "a time is written without a space: 10ms"),
            ("list --wait 3s", "the value follows an equals sign: --wait=3s"),
            ("control crank pause --wait 3s", "the value follows an equals sign: --wait=3s"),
            ("check arm.toml --set rod.length_m 0.3", "the value follows an equals sign: --set rod.length_m=0.3"),
            ("check arm.toml --set rod.length_m = 0.3", "the value follows an equals sign: --set rod.length_m=0.3"),
            ("check arm.toml --set rod.length_m =0.3", "the value follows an equals sign: --set rod.length_m=0.3"),
            ("pulse crank --torque 5 Nm --duration 1", ""),
            ("guide bus ms", ""),
        ]);
    }

    #[test]
    fn regress_a_file_or_a_scene_as_first_word_is_told_its_place() {
        for scene in ["cutter.toml", "crank-slider", "models/cutter", r"models\cutter", "LICENSE-MIT"] {
            let tip = format!("scenes and options of a run stand after `run`: flexcrank run {scene}");
            for line in [scene.to_owned(), format!("{scene} --until 3"), format!("{scene} run"), format!("-q {scene}")] {
                assert_tips(&[(line.as_str(), tip.as_str())]);
            }
        }
        assert_tips(&[
            (
                "control.mcap",
                "a recording stands after a command: flexcrank info control.mcap, plot control.mcap or replay control.mcap",
            ),
            ("turn.csv", "a table stands after a command: flexcrank plot turn.csv"),
            ("chek", "a similar subcommand exists: 'check'"),
            ("--quite", "a similar argument exists: '--quiet'"),
            ("--versoin", "a similar argument exists: '--version'"),
        ]);
    }

    #[test]
    fn regress_a_long_option_with_one_dash_is_refused_with_two() {
        assert_tips(&[
            ("run -until 3", "a long option has two dashes: --until"),
            ("run cutter.toml -record=take.mcap", "a long option has two dashes: --record"),
            ("info take.mcap -quiet", "a long option has two dashes: --quiet"),
            ("replay take.mcap -rate 2", "a long option has two dashes: --rate"),
            ("-until 3", "scenes and options of a run stand after `run`: flexcrank run --until"),
            ("--until 3", "scenes and options of a run stand after `run`: flexcrank run --until"),
            ("--untill 3", "scenes and options of a run stand after `run`: flexcrank run --until"),
            ("--nonsense 3", ""),
            ("run -u 3", ""),
        ]);
    }
}
