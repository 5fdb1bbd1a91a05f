//! Reports of a running simulator as messages: replies, actions, missed deadlines, histograms, differences to a second model.

use super::control::Action as ActionMessage;
use super::status::State;
use super::{
    AdvanceReply, CommandReply, Histogram, Level, Miss, MissCause, Overruns, Pause, Reset, Resume, Set, Shadow, StartRecording,
    Steps, Stop, StopRecording, miss::Cause, stamp,
};
use crate::runtime::{self, Action, DurationBins, MissReport, ModelDifference, Reply, Response, RunPhase, StateDifference};
use crate::simulation::{Effective, Stamp};

impl From<Reply> for CommandReply {
    fn from(reply: Reply) -> Self {
        let Reply { id, accepted, reason, effective: Effective { step, sim_time_s }, changed_j } = reply;
        CommandReply { id, accepted, reason, effective_step: step, effective_sim_time_s: sim_time_s, changed_j }
    }
}

impl From<CommandReply> for Reply {
    fn from(reply: CommandReply) -> Self {
        let CommandReply { id, accepted, reason, effective_step, effective_sim_time_s, changed_j } = reply;
        let effective = Effective { step: effective_step, sim_time_s: effective_sim_time_s };
        Reply { id, accepted, reason, effective, changed_j }
    }
}

impl From<Response> for AdvanceReply {
    fn from(Response { reply, state }: Response) -> Self {
        let answer = match &state {
            Some(state) => state.context.state_after(&state.sample),
            None => AdvanceReply::default(),
        };
        AdvanceReply { reply: Some(reply.into()), ..answer }
    }
}

impl From<ActionMessage> for Action {
    fn from(action: ActionMessage) -> Self {
        match action {
            ActionMessage::Pause(Pause {}) => Action::Pause,
            ActionMessage::Resume(Resume {}) => Action::Resume,
            ActionMessage::Step(Steps { count }) => Action::Step { count },
            ActionMessage::Reset(Reset {}) => Action::Reset,
            ActionMessage::Stop(Stop {}) => Action::Stop,
            ActionMessage::StartRecording(StartRecording { name }) => Action::StartRecording { name },
            ActionMessage::StopRecording(StopRecording {}) => Action::StopRecording,
            ActionMessage::Set(Set { changes }) => Action::Set { changes },
            ActionMessage::Level(Level { name }) => Action::Level { name },
        }
    }
}

impl From<Action> for ActionMessage {
    fn from(action: Action) -> Self {
        match action {
            Action::Pause => ActionMessage::Pause(Pause {}),
            Action::Resume => ActionMessage::Resume(Resume {}),
            Action::Step { count } => ActionMessage::Step(Steps { count }),
            Action::Reset => ActionMessage::Reset(Reset {}),
            Action::Stop => ActionMessage::Stop(Stop {}),
            Action::StartRecording { name } => ActionMessage::StartRecording(StartRecording { name }),
            Action::StopRecording => ActionMessage::StopRecording(StopRecording {}),
            Action::Set { changes } => ActionMessage::Set(Set { changes }),
            Action::Level { name } => ActionMessage::Level(Level { name }),
        }
    }
}

impl From<RunPhase> for State {
    fn from(phase: RunPhase) -> Self {
        match phase {
            RunPhase::Running => State::Running,
            RunPhase::Paused => State::Paused,
            RunPhase::Finished => State::Finished,
            RunPhase::Diverged => State::Diverged,
        }
    }
}

impl From<DurationBins> for Histogram {
    fn from(DurationBins { counts, bins_per_doubling }: DurationBins) -> Self {
        Histogram { counts, bins_per_doubling }
    }
}

impl From<runtime::MissCause> for Cause {
    fn from(cause: runtime::MissCause) -> Self {
        match cause {
            runtime::MissCause::Solver => Cause::Solver,
            runtime::MissCause::Scheduler => Cause::Scheduler,
            runtime::MissCause::Queue => Cause::Queue,
            runtime::MissCause::Neighbours => Cause::Neighbours,
        }
    }
}

impl From<&MissReport> for Overruns {
    fn from(report: &MissReport) -> Self {
        let of_cause = |sum: &runtime::CauseCount| MissCause {
            cause: Cause::from(sum.cause).into(),
            count: sum.count,
            worst_s: sum.worst.as_secs_f64(),
        };
        let miss = |miss: &runtime::Miss| Miss {
            step: miss.step,
            late_s: miss.late.as_secs_f64(),
            cause: Cause::from(miss.cause).into(),
        };
        Overruns {
            stamp: Some(stamp(&report.last)),
            first_step: report.first_step,
            count: report.count,
            worst_s: report.worst.as_secs_f64(),
            causes: report.causes.iter().map(of_cause).collect(),
            misses: report.misses.iter().map(miss).collect(),
            given_up_s: report.given_up.as_secs_f64(),
        }
    }
}

/// The difference of a second model at the instant of a stamp.
pub fn shadow(difference: &ModelDifference, at: &Stamp) -> Shadow {
    let ModelDifference { model, state, main_step_s, shadow_step_s } = *difference;
    let StateDifference { angle_rad, end_x_m, joint_force_n, driving_torque_nm } = state;
    Shadow {
        stamp: Some(stamp(at)),
        model: model.as_str().to_owned(),
        angle_rad,
        end_x_m,
        joint_force_n,
        driving_torque_nm,
        main_step_s,
        shadow_step_s,
    }
}
