//! `info`: describes recordings.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use bytesize::ByteSize;
use prost::Message as _;
use serde::Serialize;

use super::aligned_table;
use clap_complete::engine::ArgValueCompleter;

use super::completions;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::formatting::counted;
use super::output::{output, print_json};
use super::signals::interruption_leaves_nothing;
use crate::recording::{Overview, RecordingMetadata, TopicOverview};
use crate::scene::SceneSource;
use crate::shown::{shown_name, shown_s, shown_sentence};
use crate::wire::{Status, Topic};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank info recordings/crank.mcap
  flexcrank info recordings/*.mcap --json > recordings.jsonl

Any MCAP file is described. Exit code 3 if a file ends early or is damaged, 1 if one cannot be read; the others are described \
    all the same.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The recordings.
    #[arg(required = true, value_name = "FILE", add = ArgValueCompleter::new(completions::recordings))]
    pub files: Vec<PathBuf>,
    /// Print one JSON object per file.
    #[arg(long)]
    pub json: bool,
}

/// The description of a file.
#[derive(Serialize)]
struct Info {
    file: String,
    size_bytes: u64,
    /// UTC; `None` without messages.
    begin: Option<String>,
    duration_s: f64,
    messages: u64,
    /// The damaged places, and whether the file ends early.
    damage: Option<String>,
    #[serde(skip)]
    ends_early: bool,
    session: Option<Session>,
    topics: Vec<TopicInfo>,
}

/// The facts of a flexcrank session.
#[derive(Serialize)]
struct Session {
    name: String,
    command_line: String,
    version: String,
    commit: String,
    scene: Option<SceneInfo>,
    commands: u64,
    checkpoints: u64,
    /// State and simulated time in the last status.
    state: Option<String>,
    sim_time_s: Option<f64>,
    /// Why the recording ended. A `what-if` records no status.
    end: Option<String>,
}

#[derive(Serialize)]
struct SceneInfo {
    model: &'static str,
    integrator: &'static str,
    step_s: f64,
}

#[derive(Serialize)]
struct TopicInfo {
    topic: String,
    messages: u64,
    /// Messages per second between the first and the last.
    rate_hz: Option<f64>,
    bytes: u64,
    encoding: String,
    schema: String,
}

pub(super) fn info(args: &Args) -> CommandResult {
    interruption_leaves_nothing();
    let (mut gravest, mut is_further) = (ExitStatus::Success, false);
    for file in &args.files {
        let status = match Info::of(file) {
            Ok(info) => {
                match args.json {
                    true => print_json(&info)?,
                    false => info.print(is_further)?,
                }
                is_further = true;
                if info.damage.is_some() { ExitStatus::Lossy } else { ExitStatus::Success }
            }
            Err(failure) => failure.report_file(),
        };
        gravest = gravest.graver(status);
    }
    Ok(gravest)
}

impl Info {
    fn of(file: &Path) -> CommandResult<Self> {
        let overview = Overview::read(file)?;
        let (begin_ns, end_ns) = overview.span_ns();
        let begin = (overview.messages() > 0).then(|| SystemTime::UNIX_EPOCH + Duration::from_nanos(begin_ns));
        let topics = overview.topics.iter().map(|(name, topic)| TopicInfo::new(name, topic)).collect();
        Ok(Info {
            file: file.display().to_string(),
            size_bytes: std::fs::metadata(file).map_or(0, |file| file.len()),
            begin: begin.map(|begin| humantime::format_rfc3339_millis(begin).to_string()),
            duration_s: (end_ns - begin_ns) as f64 * 1e-9,
            messages: overview.messages(),
            damage: damage(&overview),
            ends_early: overview.cut_off.is_some(),
            // Files of other programs have no session.
            session: RecordingMetadata::read(file).ok().map(|metadata| Session::new(&metadata, &overview)),
            topics,
        })
    }

    fn print(&self, further: bool) -> io::Result<()> {
        let mut out = output();
        if further {
            writeln!(out)?;
        }
        let Info { file, size_bytes, begin, duration_s, messages, damage, ends_early, session, topics } = self;
        writeln!(out, "{}: {}, {messages} messages", shown_sentence(file), ByteSize(*size_bytes).display().si())?;
        match begin {
            Some(begin) => writeln!(out, "  recorded      {begin}, {} s", shown_s(*duration_s))?,
            None => writeln!(out, "  recorded      nothing")?,
        }
        if let Some(session) = session {
            let Session { name, command_line, version, commit, scene, commands, checkpoints, state, sim_time_s, end } = session;
            writeln!(out, "  session       {}: {}", shown_name(name), shown_sentence(command_line))?;
            writeln!(out, "  build         flexcrank {}, commit {}", shown_name(version), shown_name(commit))?;
            match scene {
                Some(SceneInfo { model, integrator, step_s }) => {
                    writeln!(out, "  scene         {model} model, {integrator}, step {step_s} s")?;
                }
                None => writeln!(out, "  scene         refused by this build")?,
            }
            writeln!(out, "  contains      {}, {}", counted(*commands, "command"), counted(*checkpoints, "checkpoint"))?;
            match (state, sim_time_s, end) {
                (Some(state), Some(sim_time_s), _) => {
                    writeln!(out, "  last status   {state}, at simulated {} s", shown_s(*sim_time_s))?;
                }
                (_, _, Some(end)) => writeln!(out, "  last status   none: {}", shown_sentence(end))?,
                _ => writeln!(out, "  last status   none")?,
            }
        }
        if session.is_none() && topics.iter().any(|topic| topic.schema.starts_with("flexcrank.")) {
            writeln!(out, "  session       none: metadata and scene are lost")?;
        }
        if let Some(damage) = damage {
            let label = if *ends_early { "ends early" } else { "damaged" };
            writeln!(out, "  {label:<12}  {}", shown_sentence(damage))?;
        }
        if topics.is_empty() {
            return Ok(());
        }
        let heading = ["topic", "type", "messages", "Hz", "size"].map(str::to_owned).to_vec();
        let rows = topics.iter().map(|topic| {
            let rate = topic.rate_hz.map_or(String::new(), |rate| format!("{rate:.1}"));
            // Without its package, so that a line fits a terminal.
            let kind = if topic.schema.is_empty() { &topic.encoding } else { &topic.schema };
            let kind = kind.rsplit(['.', '/']).next().unwrap_or(kind);
            let size = ByteSize(topic.bytes).display().si().to_string();
            vec![topic.topic.clone(), kind.to_owned(), topic.messages.to_string(), rate, size]
        });
        aligned_table::print(&std::iter::once(heading).chain(rows).collect::<Vec<_>>(), 2)
    }
}

/// Describes the damaged places, and whether the file ends early. Everything else is listed.
fn damage(overview: &Overview) -> Option<String> {
    let broken = overview.damage.first().map(|first| {
        let places = counted(overview.damage.len() as u64, "place");
        format!("in {places}, first at byte {}: {}; `flexcrank recover` saves what can be read", first.offset, first.what)
    });
    let cut_off = overview.cut_off.map(|_| {
        let of_cut_chunk = match overview.unchecked {
            0 => String::new(),
            count => format!(", with {} of the chunk that was cut off, which no checksum covers", counted(count, "message")),
        };
        format!("the file is still being recorded, or was cut off; everything before is listed{of_cut_chunk}")
    });
    let both: Vec<String> = cut_off.into_iter().chain(broken).collect();
    (!both.is_empty()).then(|| both.join("; "))
}

impl TopicInfo {
    fn new(name: &str, topic: &TopicOverview) -> Self {
        let span_s = (topic.span_ns.1 - topic.span_ns.0) as f64 * 1e-9;
        TopicInfo {
            topic: name.to_owned(),
            messages: topic.messages,
            rate_hz: (span_s > 0.0).then(|| (topic.messages - 1) as f64 / span_s),
            bytes: topic.bytes,
            encoding: topic.encoding.clone(),
            schema: topic.schema.clone(),
        }
    }
}

impl Session {
    fn new(metadata: &RecordingMetadata, overview: &Overview) -> Self {
        let topic = |topic: Topic| {
            let ours = |(name, _): &(&String, &TopicOverview)| name.rsplit('/').next() == Some(topic.chunk());
            overview.topics.iter().find(ours).map(|(_, topic)| topic)
        };
        let messages = |wanted: Topic| topic(wanted).map_or(0, |topic| topic.messages);
        let status = topic(Topic::Status).and_then(|topic| Status::decode(topic.last.as_slice()).ok());
        let scene = SceneSource::parse("scene.toml", metadata.scene.as_deref().unwrap_or_default(), &[]).ok();
        Session {
            name: metadata.fact("name").to_owned(),
            command_line: metadata.fact("command_line").to_owned(),
            version: metadata.fact("version").to_owned(),
            commit: metadata.fact("commit").to_owned(),
            scene: scene.map(|source| source.scene.solver).map(|solver| SceneInfo {
                model: solver.model.as_str(),
                integrator: solver.integrator.as_str(),
                step_s: solver.step_s,
            }),
            commands: messages(Topic::Commands),
            checkpoints: messages(Topic::Checkpoint),
            state: status.as_ref().map(|status| status.state().as_str_name().to_lowercase()),
            sim_time_s: status.and_then(|status| Some(status.stamp?.sim_time_s)),
            end: overview.end.as_ref().map(|end| end.reason.clone()),
        }
    }
}
