//! What both sides of Resolvent's plugin boundary share.
//!
//! This crate is all that a plugin needs. Read in this order: [`operator`] (K and G, and the data they exchange), then the page
//! of the kind of plugin you write ([`medium`], [`phase`], [`surface`], [`integrator`]), [`params`], and [`export`].
//! [`tracking`] has the loops that make a [`Medium`] out of a [`Field`]; [`abi`] is the C side.
//!
//! Words: σ_t = σ_a + σ_s extinction (1/length), σ_maj majorant, σ_n = σ_maj − σ_t null coefficient, albedo = σ_s/σ_t, g mean
//! cosine, τ optical depth, β throughput. `wo` and `wi` point away from the vertex. `forward` is along the walk, `reverse`
//! against it. A BSDF or phase function value carries no cosine.

pub mod abi;
pub mod closure;
pub mod export;
pub mod extent;
pub mod integrator;
pub mod math;
pub mod medium;
pub mod microfacet;
pub mod nested;
pub mod observer;
pub mod operator;
mod panics;
pub mod params;
pub mod phase;
pub mod rng;
pub mod slot;
pub mod spectrum;
pub mod surface;
pub mod texture;
pub mod tracking;
pub mod vertex;

pub use abi::{ParamDecl, PluginKind};
pub use closure::Closure;
pub use export::Plugin;
pub use extent::Extent;
pub use integrator::{Integrator, Output, SceneView, Stopped, Transport};
pub use math::{Aabb, Affine, Vec3};
pub use medium::{Cell, Field, Medium, MediumInfo};
pub use nested::{NestedBsdf, NestedClosures};
pub use operator::{
    Coefficients, Event, Flight, FlightDraws, Mode, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Segment,
};
pub use params::{Decl, Error, Params};
pub use phase::PhaseFunction;
pub use slot::{Either, Slot, Stored};
pub use spectrum::{Lanes, Spectrum};
pub use surface::{Bsdf, SurfacePoint};
pub use texture::{Textured, TexturedFloat, TexturedSpectrum};
pub use vertex::{Edge, LightSample, Vertex, VertexKind};
