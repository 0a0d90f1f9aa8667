//! Albedo and emission at a point.

use crate::blackbody::Blackbody;
use crate::channel::Channel;
use resolvent_api::Spectrum;

/// What a collision and a stretch of path see beside extinction.
#[derive(Default)]
pub struct Appearance {
    /// Single-scattering albedo.
    pub albedo: Spectrum,
    /// Grids that multiply it.
    pub tints: Vec<Channel>,
    /// Temperature in kelvin, with the factor of its radiance in 1/length.
    pub temperature: Option<(Channel, f32, Blackbody)>,
    /// Emission grid with the factor of its values, W·sr⁻¹·m⁻³.
    pub flame: Option<(Channel, Spectrum)>,
    /// One bit per cell: whether something there may emit.
    pub emitting: Vec<u64>,
}

impl Appearance {
    /// Bytes held.
    pub fn memory(&self) -> usize {
        let tints: usize = self.tints.iter().map(Channel::memory).sum();
        let temperature = self.temperature.as_ref().map_or(0, |t| t.0.memory());
        let flame = self.flame.as_ref().map_or(0, |f| f.0.memory());
        tints + temperature + flame + self.emitting.capacity() * 8
    }

    /// True if there is any emission.
    pub fn is_emissive(&self) -> bool {
        self.temperature.is_some() || self.flame.is_some()
    }

    /// Whether something in the cell may emit; cells beyond the end are uniform regions, of which it isn't known.
    #[inline(always)]
    pub fn emits(&self, cell: usize) -> bool {
        self.emitting
            .get(cell >> 6)
            .is_none_or(|word| word >> (cell & 63) & 1 != 0)
    }

    /// Albedo at a position in the density's local coordinates.
    #[inline(always)]
    pub fn albedo(&self, p: [f32; 3]) -> Spectrum {
        if self.tints.is_empty() {
            return self.albedo;
        }
        self.tinted(p)
    }

    fn tinted(&self, p: [f32; 3]) -> Spectrum {
        let mut albedo = self.albedo;
        for tint in &self.tints {
            let [r, g, b] = tint.sample(p);
            albedo *= Spectrum::rgb(r, g, b);
        }
        albedo
    }

    /// Emission at a position in the density's local coordinates, W·sr⁻¹·m⁻³.
    pub fn emission(&self, p: [f32; 3]) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        if let Some((channel, factor, blackbody)) = &self.temperature {
            let [r, g, b] = blackbody.radiance(channel.sample(p)[0]);
            sum += Spectrum::rgb(r, g, b) * *factor;
        }
        if let Some((channel, colour)) = &self.flame {
            let [r, g, b] = channel.sample(p);
            sum += Spectrum::rgb(r, g, b) * *colour;
        }
        sum
    }
}
