//! The thesis's problems against figures computed from its listings and from first principles (`tests/data/README.md`).

mod beam;
mod crank_slider;
mod limits;
mod oscillators;
mod reference;
