//! Paths sampled from both ends (Lafortune & Willems 1993; Veach 1997, ch. 10), through surfaces and media alike.
//!
//! [`Subpath`] walks from the sensor or a light; [`Bidirectional`] connects two of them by any strategy and weighs the
//! result against all others ([`crate::mis::Strategies`]). [`mod@path`] does the same sums from scratch, and [`verify`] is the switch that holds
//! one against the other.

mod connect;
mod depth;
mod draws;
mod every;
pub mod path;
mod subpath;
pub mod verify;

pub use connect::{Bidirectional, Splat, target};
pub use draws::{Draws, End, NetDraws};
pub use every::{Found, Pairs};
pub use subpath::{Node, Subpath};
