//! What surfaces with microscopic facets are made of, shared by the BSDF plugins: Fresnel's equations, the GGX distribution of
//! facets, and the energy that single scattering between facets loses.
//!
//! All directions are in the shading frame and point away from the surface; the facets' normal `h` has z > 0.

pub mod boundary;
pub mod coating;
pub mod energy;
pub mod exits;
pub mod facets;
pub mod film;
pub mod fresnel;
mod ggx;
mod grain;
mod interface;
mod reflector;

pub use boundary::Boundary;
pub use coating::{Bare, Coating};
pub use film::Film;
pub use ggx::Ggx;
pub use grain::Grain;
pub use interface::Interface;
pub use reflector::Reflector;

/// Roughness below which a surface counts as smooth: with α = roughness² = 10⁻⁴ a lobe is as narrow as single precision can
/// tell directions apart and still hold its density.
pub const SMOOTH_BELOW: f32 = 0.01;

/// The widths α along x and y for a roughness in [0, 1] and an anisotropy in [0, 1], at constant mean square slope
/// (OpenPBR 1.1, "Anisotropic roughness"): α = roughness² where isotropic, and anisotropy 1 leaves no width along y.
pub fn alpha(roughness: f32, anisotropy: f32) -> [f32; 2] {
    let narrow = 1.0 - anisotropy.clamp(0.0, 1.0);
    let x = roughness * roughness * (2.0 / (1.0 + narrow * narrow)).sqrt();
    [x, x * narrow]
}
