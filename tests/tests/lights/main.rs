//! Lights: the choice among them, and connections to them against quadrature.
//!
//! Figures are printed with `--nocapture`.

mod build;
mod choice;
mod efficiency;
mod shapes;
