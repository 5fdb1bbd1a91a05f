//! One link: length, and what it is made of.

use std::f64::consts::PI;

use super::key::Number;
use super::{SceneError, check::Checker, keys, raw, types::*};

pub(super) fn link(check: &Checker, name: LinkName, raw: &raw::Link, model: ModelKind) -> Link {
    let length_m = check.number_or(&keys::LENGTH, name.as_str(), raw.length_m);
    let rigid = raw.rigid.unwrap_or(keys::RIGID.default);
    let bar_or_mass = bar_or_mass(check, name, raw, length_m, rigid || model == ModelKind::Rigid);
    let link = Link {
        name,
        length_m,
        rigid,
        elements: check.count_or(&keys::ELEMENTS, name.as_str(), raw.elements),
        modes: check.count_or(&keys::MODES, name.as_str(), raw.modes),
        axial: raw.axial.unwrap_or(keys::AXIAL.default),
        damping_s: check.number_or(&keys::DAMPING, name.as_str(), raw.damping_s),
        ..check.noted(bar_or_mass).unwrap_or_else(|| body(f64::NAN, f64::NAN, f64::NAN))
    };
    if model == ModelKind::Incremental {
        refuse_unless_incremental(check, &link);
    }
    link
}

/// Refuses keys of a link that the incremental model does not have.
fn refuse_unless_incremental(check: &Checker, link: &Link) {
    for (part, is_refused) in [("rigid", link.rigid), ("elements", link.elements != 1)] {
        let key = format!("{}.{part}", link.name.as_str());
        if is_refused {
            check.note(|| check.refuse(&key, "the incremental model is the thesis's: flexible links, one element each"));
        }
    }
}

/// Section and material of a link, or the mass that a rigid one may give instead; the rest is filled in by the caller.
fn bar_or_mass(check: &Checker, name: LinkName, raw: &raw::Link, length_m: f64, rigid: bool) -> Result<Link, SceneError> {
    if let Some(mass_kg) = raw.mass_kg {
        refuse_unless_mass_alone(check, name, raw, rigid)?;
        return lumped(check, name, raw, mass_kg, length_m);
    }
    let bar = bar(check, name, raw, rigid)?;
    Ok(Link { bar: Some(bar), ..uniform(length_m, bar.mass_per_length_kg_per_m() * length_m) })
}

/// Mass, centre and inertia of a uniform bar; the rest is filled in by the caller.
fn uniform(length_m: f64, mass_kg: f64) -> Link {
    body(mass_kg, 0.5 * length_m, mass_kg * length_m * length_m / 12.0)
}

fn body(mass_kg: f64, centre_of_mass_m: f64, inertia_kg_m2: f64) -> Link {
    Link {
        name: LinkName::Beam,
        length_m: 0.0,
        mass_kg,
        centre_of_mass_m,
        inertia_kg_m2,
        bar: None,
        rigid: false,
        elements: 1,
        modes: 1,
        axial: false,
        damping_s: 0.0,
    }
}

/// A rigid link given by its mass; centre and inertia are a uniform bar's unless given.
fn lumped(check: &Checker, name: LinkName, raw: &raw::Link, mass_kg: f64, length_m: f64) -> Result<Link, SceneError> {
    let key = |part: &str| format!("{}.{part}", name.as_str());
    let given = |spec: &Number, value| check.number(spec, name.as_str(), value);
    let mass_kg = given(&keys::LINK_MASS, mass_kg);
    let bar = uniform(length_m, mass_kg);
    let centre = raw.centre_of_mass_m.map_or(bar.centre_of_mass_m, |centre| given(&keys::CENTRE_OF_MASS, centre));
    let inertia = raw.inertia_kg_m2.map_or(bar.inertia_kg_m2, |inertia| given(&keys::INERTIA, inertia));
    if mass_kg == 0.0 && inertia > 0.0 {
        return Err(check.refuse(&key("inertia_kg_m2"), "must be 0 for a link without mass"));
    }
    Ok(body(mass_kg, centre, inertia))
}

/// Refuses a mass unless the link is rigid, and has nothing else to get its mass from.
fn refuse_unless_mass_alone(check: &Checker, name: LinkName, raw: &raw::Link, rigid: bool) -> Result<(), SceneError> {
    let key = |part: &str| format!("{}.{part}", name.as_str());
    let sectional =
        raw.section.is_some() || raw.area_m2.is_some() || raw.second_moment_m4.is_some() || raw.density_kg_per_m3.is_some();
    if !rigid {
        let instead = match sectional {
            true => "has its mass from section and density_kg_per_m3, which a mass_kg would replace",
            false => "needs section and density_kg_per_m3",
        };
        let problem = format!("only for a rigid link (rigid = true, or model \"rigid\"): a flexible one {instead}");
        return Err(check.refuse(&key("mass_kg"), problem));
    }
    if sectional {
        let others = ["section", "area_m2", "second_moment_m4", "density_kg_per_m3"].map(key);
        let others = others.each_ref().map(String::as_str);
        let problem = "give mass_kg, or section and density_kg_per_m3, not both";
        return Err(check.refuse_one_of(&key("mass_kg"), &others, problem));
    }
    Ok(())
}

/// Section and material.
fn bar(check: &Checker, name: LinkName, raw: &raw::Link, rigid: bool) -> Result<Bar, SceneError> {
    let key = |part: &str| format!("{}.{part}", name.as_str());
    for (part, value) in [("centre_of_mass_m", raw.centre_of_mass_m), ("inertia_kg_m2", raw.inertia_kg_m2)] {
        if value.is_some() {
            return Err(check.refuse(&key(part), "goes with mass_kg: a link with section and density_kg_per_m3 is a uniform bar"));
        }
    }
    let refused = SectionMeasures { area_m2: f64::NAN, second_moment_m4: Some(f64::NAN), extreme_fibre_m: None };
    let SectionMeasures { area_m2, second_moment_m4, extreme_fibre_m } =
        check.noted(section(check, name, raw, rigid)).unwrap_or(refused);
    let needed = |spec: &Number, value: Option<f64>| {
        if rigid && value.is_none() { 0.0 } else { check.number_or(spec, name.as_str(), value) }
    };
    Ok(Bar {
        area_m2,
        second_moment_m4: second_moment_m4.unwrap_or_else(|| needed(&keys::SECOND_MOMENT, None)),
        density_kg_per_m3: match raw.density_kg_per_m3 {
            // It is named with the section.
            None if rigid && raw.section.is_none() && raw.area_m2.is_none() => f64::NAN,
            density => check.number_or(&keys::DENSITY, name.as_str(), density),
        },
        youngs_modulus_pa: needed(&keys::YOUNGS_MODULUS, raw.youngs_modulus_pa),
        extreme_fibre_m,
    })
}

/// Measures of a section, as far as they are known.
struct SectionMeasures {
    area_m2: f64,
    second_moment_m4: Option<f64>,
    extreme_fibre_m: Option<f64>,
}

/// The measures given, or those of the shape.
fn section(check: &Checker, name: LinkName, raw: &raw::Link, rigid: bool) -> Result<SectionMeasures, SceneError> {
    let Some(section) = &raw.section else {
        let missing = match (rigid, raw.second_moment_m4) {
            (true, _) => "missing key `mass_kg`, or `section` (or `area_m2`) and `density_kg_per_m3`",
            (false, None) => "missing keys `area_m2` and `second_moment_m4` (or `section`)",
            (false, Some(_)) => "missing key `area_m2` (or `section`)",
        };
        let area = raw.area_m2.ok_or_else(|| check.refuse(name.as_str(), missing))?;
        let moment = raw.second_moment_m4.map(|moment| check.number(&keys::SECOND_MOMENT, name.as_str(), moment));
        let area_m2 = check.number(&keys::AREA, name.as_str(), area);
        return Ok(SectionMeasures { area_m2, second_moment_m4: moment, extreme_fibre_m: None });
    };
    let table = format!("{}.section", name.as_str());
    if raw.area_m2.is_some() || raw.second_moment_m4.is_some() {
        let [area, moment] = ["area_m2", "second_moment_m4"].map(|part| format!("{}.{part}", name.as_str()));
        let problem = "give section, or area_m2 and second_moment_m4, not both";
        return Err(check.refuse_one_of(&table, &[area.as_str(), moment.as_str()], problem));
    }
    let [area, moment, height] = check.noted(shape(check, &table, section)).unwrap_or([f64::NAN; 3]);
    Ok(SectionMeasures { area_m2: area, second_moment_m4: Some(moment), extreme_fibre_m: Some(0.5 * height) })
}

/// Area, second moment and height of a section. `table` is its path: `rod.section`.
fn shape(check: &Checker, table: &str, section: &raw::Section) -> Result<[f64; 3], SceneError> {
    Ok(match section.shape.ok_or_else(|| check.refuse(table, "missing key `shape`"))? {
        raw::SectionShape::Rectangle => {
            let [b, h] = sizes(check, table, section, [keys::WIDTH, keys::HEIGHT])?;
            [b * h, b * h.powi(3) / 12.0, h]
        }
        raw::SectionShape::Round => {
            let [d] = sizes(check, table, section, [keys::DIAMETER])?;
            [PI * d * d / 4.0, PI * d.powi(4) / 64.0, d]
        }
        raw::SectionShape::Tube => {
            let [outer, inner] = sizes(check, table, section, [keys::OUTER, keys::INNER])?;
            if inner >= outer {
                return Err(check.refuse(&format!("{table}.inner_m"), format!("must be smaller than outer_m = {outer:?}")));
            }
            [PI * (outer.powi(2) - inner.powi(2)) / 4.0, PI * (outer.powi(4) - inner.powi(4)) / 64.0, outer]
        }
    })
}

/// The sizes `own` that a shape has. A size of another shape is refused.
fn sizes<const N: usize>(check: &Checker, table: &str, section: &raw::Section, own: [Number; N]) -> Result<[f64; N], SceneError> {
    let given = [
        (keys::WIDTH.name, section.width_m),
        (keys::HEIGHT.name, section.height_m),
        (keys::DIAMETER.name, section.diameter_m),
        (keys::OUTER.name, section.outer_m),
        (keys::INNER.name, section.inner_m),
    ];
    let is_other = |name: &str| own.iter().all(|spec| spec.name != name);
    if let Some((name, _)) = given.iter().find(|(name, value)| value.is_some() && is_other(name)) {
        let names = own.map(|spec| spec.name).join(" and ");
        let [given, shape] = [*name, "shape"].map(|part| format!("{table}.{part}"));
        if check.is_to_blame(&shape, &given) {
            let whole = format!("this shape has only {names}, and the section has {name}: set the whole of {table}");
            return Err(check.refuse(&shape, whole));
        }
        return Err(check.refuse(&given, format!("this shape has only {names}")));
    }
    let value = |spec: &Number| given.iter().find(|(name, _)| *name == spec.name).and_then(|(_, value)| *value);
    Ok(own.map(|spec| check.number_or(&spec, table, value(&spec))))
}
