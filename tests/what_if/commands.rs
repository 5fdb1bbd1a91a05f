//! What-ifs with steps of other sizes, of recordings with commands.

use flexcrank::bus::{Topic, client};
use flexcrank::runtime::Pace;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, control::Action};

use crate::common::{Listener, Outcome, Service, scene};

/// The recorded reset kept the number of the original's step, and `verify` called the what-if wrong.
#[test]
fn regress_a_reset_has_its_own_step_with_other_steps() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(10.0), None, PublishRate::Hz(100.0))?;
    let listener = Listener::new(&service.client, &service.name)?;
    for count in [10, 30] {
        listener.wait_for(Topic::Angles, count, std::time::Duration::from_secs(30))?;
        let reset = wire::Control { id: String::new(), action: Some(Action::Reset(wire::Reset {})) };
        assert!(client::control(&service.client, &service.name, &reset)?.accepted);
    }
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    for step_s in ["5e-4", "1e-3", "3e-3", "4e-3"] {
        let (_, verified) = super::changed(&file, &format!("{step_s}.mcap"), &format!("solver.step_s={step_s}"))?;
        assert_eq!(verified.findings, [], "{step_s}");
    }
    Ok(())
}
