//! Every key of a scene file. The validation takes ranges and defaults from here; so does the scene reference.

use super::key::Default::{Absent, Derived, Required, Value};
use super::key::{Boolean, Count, Default, Form, Key, KeyRow, Number, Table, Word};
use super::types::{IntegratorKind, ModelKind, PulseShape};

/// The words for models in scene files.
pub const MODELS: [(&str, ModelKind); 5] = [
    ("rigid", ModelKind::Rigid),
    ("incremental", ModelKind::Incremental),
    ("modal", ModelKind::Modal),
    ("finite-element", ModelKind::FiniteElement),
    ("mass-spring", ModelKind::MassSpring),
];

/// The words for integrators in scene files.
pub const INTEGRATORS: [(&str, IntegratorKind); 4] = [
    ("two-point", IntegratorKind::TwoPoint),
    ("generalized-alpha", IntegratorKind::GeneralizedAlpha),
    ("runge-kutta", IntegratorKind::RungeKutta),
    ("esdirk", IntegratorKind::Esdirk),
];

/// The words for pulse shapes in scene files, the default first.
pub const SHAPES: [(&str, PulseShape); 2] =
    [("rectangular", PulseShape::Rectangular), ("raised-cosine", PulseShape::RaisedCosine)];

const NUMBER: &str = "number";
const EACH: &str = "list, one number for each mass";
/// Most masses of an oscillator.
pub(super) const MASSES: usize = 100;

const fn number(
    name: &'static str,
    unit: &'static str,
    [low, high]: [f64; 2],
    default: Default<f64>,
    meaning: &'static str,
) -> Number {
    Number { name, form: NUMBER, unit, low, high, default, meaning }
}

const fn size(name: &'static str, meaning: &'static str) -> Number {
    number(name, "m", [1e-9, 1e3], Absent, meaning)
}

pub(super) const LENGTH: Number = number("length_m", "m", [1e-9, 1e6], Required, "length between the pins, undeformed");
const SECTION: Form = Form {
    name: "section",
    form: "table",
    unit: "",
    is_required: false,
    range: "`{ shape = \"rectangle\", width_m, height_m }`, `{ shape = \"round\", diameter_m }` or \
            `{ shape = \"tube\", outer_m, inner_m }`",
    meaning: "section; instead of `area_m2` and `second_moment_m4`",
};
pub(super) const AREA: Number = number("area_m2", "m²", [1e-18, 1e6], Absent, "area of the section");
pub(super) const SECOND_MOMENT: Number =
    number("second_moment_m4", "m⁴", [1e-30, 1e6], Absent, "second moment of area of the section; a rigid link needs none");
pub(super) const DENSITY: Number = number("density_kg_per_m3", "kg/m³", [1e-6, 1e9], Absent, "density; needed with a section");
pub(super) const YOUNGS_MODULUS: Number =
    number("youngs_modulus_pa", "Pa", [1.0, 1e18], Absent, "Young's modulus; a flexible link needs it");
pub(super) const ELEMENTS: Count = Count {
    name: "elements",
    low: 1,
    high: 1000,
    default: Value(1),
    meaning: "beam elements for models with a mesh; also the intervals between published nodes, for every model: with 1, \
              pictures show no bending",
};
pub(super) const MODES: Count =
    Count { name: "modes", low: 1, high: 20, default: Value(2), meaning: "bending modes, for `modal`" };
pub(super) const AXIAL: Boolean = Boolean { name: "axial", default: false, meaning: "whether `modal` lets the link stretch" };
pub(super) const DAMPING: Number = number(
    "damping_s",
    "s",
    [0.0, 1e6],
    Value(0.0),
    "stiffness-proportional damping: c in σ = E (ε + c dε/dt); not with `incremental`",
);
pub(super) const RIGID: Boolean = Boolean { name: "rigid", default: false, meaning: "whether the link is rigid, for any model" };
pub(super) const LINK_MASS: Number =
    number("mass_kg", "kg", [0.0, 1e9], Absent, "mass of a rigid link; instead of section and density");
pub(super) const CENTRE_OF_MASS: Number = number(
    "centre_of_mass_m",
    "m",
    [-1e6, 1e6],
    Derived("half the length"),
    "distance of the centre of mass from the first pin; with `mass_kg`",
);
pub(super) const INERTIA: Number = number(
    "inertia_kg_m2",
    "kg·m²",
    [0.0, 1e12],
    Derived("a uniform bar's"),
    "moment of inertia about the centre of mass; with `mass_kg`",
);
const SECTION_SHAPE: Word = Word {
    name: "shape",
    words: || vec!["rectangle", "round", "tube"],
    default: Required,
    meaning: "shape of the section; it needs all of its sizes, and has no others",
};
pub(super) const WIDTH: Number = size("width_m", "width of a rectangle, across the plane of motion");
pub(super) const HEIGHT: Number = size("height_m", "height of a rectangle, in the plane of motion");
pub(super) const DIAMETER: Number = size("diameter_m", "diameter of a round bar");
pub(super) const OUTER: Number = size("outer_m", "outer diameter of a tube");
pub(super) const INNER: Number = size("inner_m", "inner diameter of a tube; less than `outer_m`");

pub(super) const SLIDER_MASS: Number = number("mass_kg", "kg", [0.0, 1e9], Value(0.0), "mass of the slider");
pub(super) const RESISTANCE: Number =
    number("resistance_n", "N", [-1e12, 1e12], Value(0.0), "constant resistance, along −x when positive");
const RESISTANCE_TABLE: Form = Form {
    name: "resistance_table",
    form: "list of `[crank_angle_rad, force_n]`",
    unit: "rad, N",
    is_required: false,
    range: "two rows or more; angles from 0 to below 2π, ascending; forces as `resistance_n`",
    meaning: "resistance over one turn of the crank, linear between rows, periodic; instead of `resistance_n`",
};
pub(super) const FRICTION: Number =
    number("friction_n_s_per_m", "N·s/m", [0.0, 1e12], Value(0.0), "viscous friction of the slider");
pub(super) const TIP_MASS: Number = number("mass_kg", "kg", [0.0, 1e9], Required, "point mass at the free end");
pub(super) const BASE_SPRING: Number = number(
    "torsion_spring_nm_per_rad",
    "N·m/rad",
    [0.0, 1e12],
    Value(0.0),
    "torsion spring at the pivot, unstressed at crank angle 0",
);
pub(super) const BASE_DAMPER: Number =
    number("damper_nm_s_per_rad", "N·m·s/rad", [0.0, 1e12], Value(0.0), "viscous damper at the pivot");
pub(super) const GRAVITY_X: Number = number("x_m_per_s2", "m/s²", [-1e9, 1e9], Value(0.0), "acceleration of gravity along x");
pub(super) const GRAVITY_Y: Number =
    number("y_m_per_s2", "m/s²", [-1e9, 1e9], Value(0.0), "acceleration of gravity along y; −9.81 on Earth");
pub(super) const START_ANGLE: Number = number(
    "angle_rad",
    "rad",
    [-1e6, 1e6],
    Value(0.0),
    "crank angle from x, counter-clockwise; the rod of a double pendulum starts in line with the crank; not with `drive.table`",
);
pub(super) const START_RATE: Number = number(
    "rate_rad_per_s",
    "rad/s",
    [-1e6, 1e6],
    Value(0.0),
    "crank rate, also that of the rod of a double pendulum; with `drive.ramp` the rate that it begins with; no other `[drive]` \
     allows another rate",
);
pub(super) const STATIC_EQUILIBRIUM: Boolean = Boolean {
    name: "static_equilibrium",
    default: false,
    meaning: "whether links start bent by weight, constant loads and the slider's resistance there, as in equilibrium; for a beam or \
              a crank-slider, not for an open chain of two links, nor with `incremental`",
};
pub(super) const DRIVE_SPEED: Number =
    number("speed_rad_per_s", "rad/s", [-1e6, 1e6], Absent, "constant speed from the start angle");
const RAMP: Form = Form {
    name: "ramp",
    form: "table",
    unit: "",
    is_required: false,
    range: "`{ to_rad_per_s, over_s }`",
    meaning: "from the start rate to another by a half-cosine, then constant",
};
const DRIVE_TABLE: Form = Form {
    name: "table",
    form: "list of `[time_s, angle_rad]`",
    unit: "s, rad",
    is_required: false,
    range: "two rows or more; times ascending",
    meaning: "angle over time by a cubic spline, instead of `[start]`, natural at its ends, but at rest at an end whose two rows \
              have one angle; before the first and after the last row, the rate there continues",
};
pub(super) const RAMP_TO: Number = number("to_rad_per_s", "rad/s", [-1e6, 1e6], Required, "final speed");
pub(super) const RAMP_OVER: Number = number("over_s", "s", [1e-9, 1e9], Required, "duration of the change");
pub(super) const PULSE_START: Number = number("start_s", "s", [0.0, 1e9], Required, "simulated time at which it begins");
pub(super) const PULSE_TORQUE: Number = number("torque_nm", "N·m", [-1e12, 1e12], Required, "mean torque over its duration");
pub(super) const PULSE_DURATION: Number = number("duration_s", "s", [1e-12, 1e9], Required, "duration");
pub(super) const PULSE_SHAPE: Word = Word {
    name: "shape",
    words: || SHAPES.map(|(word, _)| word).to_vec(),
    default: Value(SHAPES[0].0),
    meaning: "shape; both deliver the impulse torque × duration: rectangular peaks at the torque, raised-cosine at twice that",
};
pub(super) const CONSTANT_TORQUE: Number =
    number("constant_nm", "N·m", [-1e12, 1e12], Required, "constant torque at the pivot; 0 without the table");
pub(super) const TORQUE_LIMIT: Number = number(
    "torque_limit_nm",
    "N·m",
    [0.0, 1e12],
    Value(1e4),
    "largest mean torque of a pulse from the bus, whose peak is twice that if it is raised-cosine; largest torque of a setpoint",
);
pub(super) const PENDING_LIMIT: Count = Count {
    name: "pending_limit",
    low: 0,
    high: 1_000_000,
    default: Value(1024),
    meaning: "most pulses waiting or acting at once",
};

const fn each(name: &'static str, unit: &'static str, [low, high]: [f64; 2], meaning: &'static str) -> Number {
    Number { name, form: EACH, unit, low, high, default: Value(0.0), meaning }
}
pub(super) const OSCILLATOR_MASSES: Number =
    Number { default: Required, form: "list of 1 to 100 numbers", ..each("masses_kg", "kg", [1e-12, 1e12], "masses on a line") };
pub(super) const SPRING: Number = Number {
    name: "springs",
    form: "list of `[i, j, n_per_m]`",
    unit: "N/m",
    low: 0.0,
    high: 1e18,
    default: Absent,
    meaning: "springs between masses i and j, counted from 1; 0 is ground",
};
pub(super) const OSCILLATOR_FORCES: Number = each("forces_n", "N", [-1e12, 1e12], "constant force on each mass");
pub(super) const OSCILLATOR_START: Number = each("start_m", "m", [-1e12, 1e12], "displacement of each mass at the start");

const MODEL: Word = Word {
    name: "model",
    words: || MODELS.map(|(word, _)| word).to_vec(),
    default: Derived("modal; mass-spring for an oscillator"),
    meaning: "model of the links: see `flexcrank guide models`",
};
const INTEGRATOR: Word = Word {
    name: "integrator",
    words: || INTEGRATORS.map(|(word, _)| word).to_vec(),
    default: Derived("the usual one of the model"),
    meaning: "integrator: see `flexcrank guide models`",
};
pub(super) const STEP: Number = number("step_s", "s", [1e-9, 10.0], Value(1e-3), "step");
pub(super) const WEIGHT: Number = number("weight", "1", [0.0, 1.0], Value(0.5), "weight ϑ of `two-point`");
pub(super) const RHO_INFINITY: Number =
    number("rho_infinity", "1", [0.0, 1.0], Value(0.8), "spectral radius at infinite frequency, for `generalized-alpha`");
pub(super) const TOLERANCE: Number =
    number("tolerance", "1", [1e-15, 1e-2], Value(1e-9), "Newton's tolerance on the residual, relative to the forces at work");
pub(super) const BALANCE_TOLERANCE: Number = number(
    "balance_tolerance",
    "1",
    [1e-15, 1e9],
    Value(1e-2),
    "largest energy balance, over the energy in play, of a run that can be trusted",
);
pub(super) const MAX_ITERATIONS: Count =
    Count { name: "max_iterations", low: 1, high: 1000, default: Value(20), meaning: "most Newton iterations in one step" };
pub(super) const CORRECTIONS: Count = Count {
    name: "corrections",
    low: 0,
    high: 20,
    default: Absent,
    meaning: "steps of fixed cost: every stage gets exactly this many Newton corrections, 0 with a method that does not iterate; \
              steps that leave more than `tolerance` are counted. `run --fixed-cost` finds the number",
};

const LEVEL_NAME: Form = Form {
    name: "name",
    form: "string",
    unit: "",
    is_required: true,
    range: "a word",
    meaning: "name of a level of detail; levels stand from the best to the cheapest, and the first is the scene itself",
};
const LEVEL_CHANGES: Form = Form {
    name: "changes",
    form: "list of `\"KEY=VALUE\"`",
    unit: "",
    is_required: false,
    range: "keys that a running scene can change; none for the first level",
    meaning: "changes of the scene for this level; the steps of all levels divide one another",
};
pub(super) const LEVEL_ERROR: Number =
    number("error_rad", "rad", [0.0, 1e9], Absent, "error of the crank's angle at this level, as `trade` states it");

/// All tables of a scene file.
const TABLES: &[Table] = &[
    Table {
        title: "[crank], [rod] or [beam]",
        keys: &[
            Key::Number(LENGTH),
            Key::Form(SECTION),
            Key::Number(AREA),
            Key::Number(SECOND_MOMENT),
            Key::Number(DENSITY),
            Key::Number(YOUNGS_MODULUS),
            Key::Count(ELEMENTS),
            Key::Count(MODES),
            Key::Boolean(AXIAL),
            Key::Number(DAMPING),
            Key::Boolean(RIGID),
            Key::Number(LINK_MASS),
            Key::Number(CENTRE_OF_MASS),
            Key::Number(INERTIA),
        ],
    },
    Table {
        title: "section",
        keys: &[
            Key::Word(SECTION_SHAPE),
            Key::Number(WIDTH),
            Key::Number(HEIGHT),
            Key::Number(DIAMETER),
            Key::Number(OUTER),
            Key::Number(INNER),
        ],
    },
    Table {
        title: "[slider]",
        keys: &[Key::Number(SLIDER_MASS), Key::Number(RESISTANCE), Key::Form(RESISTANCE_TABLE), Key::Number(FRICTION)],
    },
    Table { title: "[tip]", keys: &[Key::Number(TIP_MASS)] },
    Table { title: "[base]", keys: &[Key::Number(BASE_SPRING), Key::Number(BASE_DAMPER)] },
    Table { title: "[gravity]", keys: &[Key::Number(GRAVITY_X), Key::Number(GRAVITY_Y)] },
    Table { title: "[start]", keys: &[Key::Number(START_ANGLE), Key::Number(START_RATE), Key::Boolean(STATIC_EQUILIBRIUM)] },
    Table { title: "[drive]", keys: &[Key::Number(DRIVE_SPEED), Key::Form(RAMP), Key::Form(DRIVE_TABLE)] },
    Table { title: "ramp", keys: &[Key::Number(RAMP_TO), Key::Number(RAMP_OVER)] },
    Table {
        title: "[[pulse]]",
        keys: &[Key::Number(PULSE_START), Key::Number(PULSE_TORQUE), Key::Number(PULSE_DURATION), Key::Word(PULSE_SHAPE)],
    },
    Table { title: "[torque]", keys: &[Key::Number(CONSTANT_TORQUE)] },
    Table { title: "[commands]", keys: &[Key::Number(TORQUE_LIMIT), Key::Count(PENDING_LIMIT)] },
    Table {
        title: "[oscillator]",
        keys: &[
            Key::Number(OSCILLATOR_MASSES),
            Key::Number(SPRING),
            Key::Number(OSCILLATOR_FORCES),
            Key::Number(OSCILLATOR_START),
        ],
    },
    Table {
        title: "[solver]",
        keys: &[
            Key::Word(MODEL),
            Key::Word(INTEGRATOR),
            Key::Number(STEP),
            Key::Number(WEIGHT),
            Key::Number(RHO_INFINITY),
            Key::Number(TOLERANCE),
            Key::Count(MAX_ITERATIONS),
            Key::Count(CORRECTIONS),
            Key::Number(BALANCE_TOLERANCE),
        ],
    },
    Table { title: "[[level]]", keys: &[Key::Form(LEVEL_NAME), Key::Form(LEVEL_CHANGES), Key::Number(LEVEL_ERROR)] },
];

/// The scene reference: every key of every table, in the order of the guide.
pub fn reference() -> Vec<KeyRow> {
    TABLES.iter().flat_map(|table| table.keys.iter().map(|key| key.row(table.title))).collect()
}

/// The measure of a key, given by its last part or in full: `in m` of `length_m` or `rod.length_m`, `a whole number` of `modes`;
/// `None` of a number without a unit.
pub(super) fn measure(key: &str) -> Option<String> {
    let name = key.rsplit('.').find(|part| part.parse::<usize>().is_err())?;
    let mut keys = TABLES.iter().flat_map(|table| table.keys.iter().map(|key| (key, key.row(table.title))));
    let (key, KeyRow { unit, .. }) = keys.find(|(_, row)| row.key == name)?;
    match (key, unit) {
        (Key::Count(_), _) => Some("a whole number".to_owned()),
        (_, "" | "1") => None,
        _ => Some(format!("in {unit}")),
    }
}

/// Whether a key takes one number.
pub(super) fn is_number(key: &str) -> bool {
    let mut keys = TABLES.iter().flat_map(|table| table.keys.iter().map(|key| key.row(table.title)));
    keys.any(|row| row.key == key && row.kind == "number")
}

/// The scene reference in Markdown, a table of keys for each table of a scene, as the guide has it.
pub fn reference_markdown() -> String {
    let section = |table: &Table| {
        let name = |word: &str| if word.starts_with('[') { format!("`{word}`").replace(",`", "`,") } else { word.to_owned() };
        let title: Vec<String> = table.title.split(' ').map(name).collect();
        let rows = table.keys.iter().map(|key| key.row(table.title));
        let rows: String = rows
            .map(|KeyRow { key, kind, unit, default, range, meaning, .. }| {
                format!("| `{key}` | {kind} | {unit} | {default} | {range} | {meaning} |\n")
            })
            .collect();
        format!("### {}\n\n| key | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n{rows}", title.join(" "))
    };
    TABLES.iter().map(section).collect::<Vec<_>>().join("\n")
}
