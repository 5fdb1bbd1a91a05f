//! Models and integrators that cells are run with.

use crate::scene::{IntegratorKind, ModelKind};

/// A model and its integrator, as overrides of a scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct Method {
    /// Name in maps; default: model and integrator.
    label: Option<&'static str>,
    pub model: ModelKind,
    pub integrator: IntegratorKind,
    /// Elements of each link; default: the scene's.
    elements: Option<usize>,
    /// Weight ϑ; default: the scene's.
    weight: Option<f64>,
}

impl Method {
    /// Model and integrator as the maps of extremes run them: two elements a link, so that the middle of the rod is seen.
    const fn labelled(label: &'static str, model: ModelKind, integrator: IntegratorKind) -> Self {
        Method { label: Some(label), model, integrator, elements: Some(2), weight: None }
    }

    /// Every model with every integrator that a scene may name for it, on the scene's own mesh.
    pub fn all() -> impl Iterator<Item = Method> {
        [ModelKind::Rigid, ModelKind::Incremental, ModelKind::Modal, ModelKind::FiniteElement]
            .into_iter()
            .flat_map(|model| model.integrators().iter().map(move |&integrator| Method::of(model, integrator)))
    }

    /// A pair on the scene's own mesh; the incremental model has one element a link.
    pub fn of(model: ModelKind, integrator: IntegratorKind) -> Self {
        let elements = (model == ModelKind::Incremental).then_some(1);
        Method { label: None, model, integrator, elements, weight: None }
    }

    /// Another scheme that suits the model, as an independent reference. The incremental model has one scheme only.
    pub fn other_scheme(self) -> Self {
        let integrator = match self.integrator {
            _ if self.model == ModelKind::Incremental => self.integrator,
            IntegratorKind::Esdirk => IntegratorKind::GeneralizedAlpha,
            IntegratorKind::TwoPoint | IntegratorKind::GeneralizedAlpha | IntegratorKind::RungeKutta => IntegratorKind::Esdirk,
        };
        Method { integrator, ..self }
    }

    /// The same method with this many elements per link.
    pub fn meshed(self, elements: usize) -> Self {
        Method { elements: Some(elements), ..self }
    }

    pub fn overrides(&self) -> Vec<String> {
        let mut overrides: Vec<String> =
            self.elements.iter().flat_map(|count| ["crank", "rod"].map(|link| format!("{link}.elements={count}"))).collect();
        overrides.push(format!("solver.model={}", self.model.as_str()));
        overrides.push(format!("solver.integrator={}", self.integrator.as_str()));
        overrides.extend(self.weight.map(|weight| format!("solver.weight={weight:?}")));
        overrides
    }

    /// The end of a map's name.
    pub fn name(&self) -> String {
        let both = || format!("{}-{}", self.model.as_str(), self.integrator.as_str());
        self.label.map_or_else(both, |label| label.replace(' ', "-"))
    }

    /// The end of a map's title.
    pub fn title(&self) -> String {
        format!("{} model, {}", self.model.as_str(), self.integrator.as_str())
    }
}

pub(super) const RIGID: Method = Method::labelled("rigid", ModelKind::Rigid, IntegratorKind::RungeKutta);
pub(super) const RIGID_TWO_POINT: Method = Method::labelled("rigid two-point", ModelKind::Rigid, IntegratorKind::TwoPoint);
pub(super) const INCREMENTAL: Method = Method {
    elements: Some(1),
    weight: Some(0.55),
    ..Method::labelled("incremental", ModelKind::Incremental, IntegratorKind::TwoPoint)
};
pub(super) const MODAL: Method = Method::labelled("modal", ModelKind::Modal, IntegratorKind::GeneralizedAlpha);
pub(super) const MODAL_EXPLICIT: Method = Method::labelled("modal explicit", ModelKind::Modal, IntegratorKind::RungeKutta);
pub(super) const MODAL_TWO_POINT: Method = Method::labelled("modal", ModelKind::Modal, IntegratorKind::TwoPoint);
pub(super) const MODAL_ESDIRK: Method = Method::labelled("modal esdirk", ModelKind::Modal, IntegratorKind::Esdirk);
pub(super) const FINITE_ELEMENT: Method =
    Method::labelled("finite-element", ModelKind::FiniteElement, IntegratorKind::GeneralizedAlpha);
pub(super) const FINITE_ELEMENT_TWO_POINT: Method =
    Method::labelled("finite-element", ModelKind::FiniteElement, IntegratorKind::TwoPoint);
pub(super) const FINITE_ELEMENT_ESDIRK: Method =
    Method::labelled("finite-element esdirk", ModelKind::FiniteElement, IntegratorKind::Esdirk);
