//! Keys that are part of the scene's vocabulary but are not built yet: refused, never ignored.

use super::{SceneError, document::SceneText};

const TABLES: [&str; 4] = ["beam", "tip", "base", "drive"];
const KEYS: [&str; 14] = [
    "crank.rigid",
    "crank.modes",
    "crank.axial",
    "crank.damping_s",
    "rod.rigid",
    "rod.modes",
    "rod.axial",
    "rod.damping_s",
    "slider.friction_n_s_per_m",
    "slider.resistance_table",
    "gravity.x_m_per_s2",
    "gravity.y_m_per_s2",
    "start.static_equilibrium",
    "torque.constant_nm",
];

pub(super) fn refuse(text: &SceneText) -> Result<(), SceneError> {
    let given = TABLES.iter().chain(&KEYS).find(|key| text.has(key));
    match given {
        None => Ok(()),
        Some(key) => Err(SceneError {
            place: text.place(key),
            key: (*key).to_owned(),
            value: text.value(key),
            problem: "not supported yet".to_owned(),
        }),
    }
}
