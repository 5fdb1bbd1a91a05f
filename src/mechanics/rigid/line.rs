//! The chain as a line in motion: see [`ChainModel`].

use super::{Rigid, dot, turning};
use crate::mechanics::chain_line::{LinkShape, Place, PlacePoint};
use crate::mechanics::crank_slider::{Path, along};
use crate::mechanics::mechanism::{ChainModel, Input};

impl Rigid {
    /// The path of a place and the direction of its link, at the angle evaluated last.
    fn path(&self, place: &Place) -> (Path, [f64; 2]) {
        let mut at = [[0.0; 2]; 3];
        for (i, (body, link)) in self.last.pose.bodies.iter().zip(&self.chain.links).enumerate() {
            if i == place.link {
                return (along(&at, &body.turn, link.length_m * place.xi), [body.turn.cos, body.turn.sin]);
            }
            at = along(&at, &body.turn, link.length_m);
        }
        (at, [0.0; 2])
    }
}

impl ChainModel for Rigid {
    fn points(&mut self, input: &Input, q: &[f64], v: &[f64], places: &[Place], out: &mut [PlacePoint]) {
        let [theta, rate, _] = self.state(input, q, v, v);
        self.evaluate(theta, rate);
        for (place, point) in places.iter().zip(out) {
            let ([position_m, by_angle, _], slope) = self.path(place);
            *point = PlacePoint { position_m, slope, velocity_m_per_s: by_angle.map(|x| x * rate) };
        }
    }

    fn chord_angles(&mut self, input: &Input, q: &[f64], out: &mut [f64]) {
        let state = self.state(input, q, q, q);
        let pose = self.evaluate(state[0], state[1]).pose;
        for (i, (angle, body)) in out.iter_mut().zip(&pose.bodies).enumerate() {
            [*angle, ..] = turning(i, &body.turn, state);
        }
    }

    fn pull_back(&mut self, input: &Input, q: &[f64], places: &[Place], vectors: &[[f64; 2]], p: &mut [f64]) {
        let [theta, rate, _] = self.state(input, q, q, q);
        self.evaluate(theta, rate);
        let work = |(place, vector): (&Place, &[f64; 2])| dot(&self.path(place).0[1], vector);
        p.fill(places.iter().zip(vectors).map(work).sum());
    }

    fn fit(&mut self, _input: &Input, shapes: &[LinkShape], q: &mut [f64]) {
        if let Some(crank) = shapes.first() {
            q.fill(crank.chord_rad);
        }
    }

    fn momentum(&mut self, input: &Input, q: &[f64], v: &[f64], p: &mut [f64]) {
        let [theta, rate, _] = self.state(input, q, v, v);
        p.fill(self.evaluate(theta, rate).equation.mass * rate);
    }

    fn turn(&mut self, _input: &Input, _q: &[f64], link: usize, v: &mut [f64]) -> bool {
        v.fill(1.0);
        link == 0 && !v.is_empty()
    }
}
