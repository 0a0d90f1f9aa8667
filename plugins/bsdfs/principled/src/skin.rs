//! What lies on the base directly: nothing, or a thin film. Surfaces are compiled for either, so that none without a film asks for one.

use crate::Parameters;
use crate::boundary::Boundary;
use resolvent_api::Spectrum;
use resolvent_api::microfacet::film::{self, Film};
use resolvent_api::microfacet::fresnel::Tinted;
use resolvent_api::microfacet::{Bare, Coating, facets};

/// Makes reflectances of those that metal, boundary and body have alone.
pub trait Skin: Copy + Send + Sync + 'static {
    /// As the transparent body has it.
    type Coat: Coating;
    /// It changes nothing.
    const IS_BARE: bool;

    fn new(p: &Parameters, outside: f32, metal: &Tinted) -> Self;
    fn coat(&self) -> &Self::Coat;
    fn metal(&self, metal: &Tinted, cos: f32) -> Spectrum;
    fn metal_average(&self, metal: &Tinted) -> Spectrum;
    /// [`metal`](Self::metal), about: for choosing between lobes.
    fn metal_roughly(&self, metal: &Tinted, cos: f32) -> Spectrum;
    fn boundary(&self, boundary: &Boundary, cos: f32) -> Spectrum;
    fn boundary_average(&self, boundary: &Boundary) -> Spectrum;
    /// What it adds to the boundary's mean reflectance over facets of width `alpha` that are met from `mu`.
    fn adds(&self, boundary: &Boundary, mu: f32, alpha: f32) -> Spectrum;
}

impl Skin for Bare {
    type Coat = Self;
    const IS_BARE: bool = true;

    fn new(_: &Parameters, _: f32, _: &Tinted) -> Self {
        Self
    }

    #[inline(always)]
    fn coat(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn metal(&self, metal: &Tinted, cos: f32) -> Spectrum {
        metal.at(cos)
    }

    #[inline(always)]
    fn metal_average(&self, metal: &Tinted) -> Spectrum {
        metal.average()
    }

    #[inline(always)]
    fn metal_roughly(&self, metal: &Tinted, cos: f32) -> Spectrum {
        metal.at(cos)
    }

    #[inline(always)]
    fn boundary(&self, boundary: &Boundary, cos: f32) -> Spectrum {
        boundary.at(cos)
    }

    #[inline(always)]
    fn boundary_average(&self, boundary: &Boundary) -> Spectrum {
        boundary.average()
    }

    #[inline(always)]
    fn adds(&self, _: &Boundary, _: f32, _: f32) -> Spectrum {
        Spectrum::ZERO
    }
}

/// A thin film.
#[derive(Clone, Copy, Debug)]
pub struct Filmed {
    film: Film,
    /// Real part of the metal's index against what is outside, for red, green and blue.
    metal: [f32; 3],
}

impl Skin for Filmed {
    type Coat = Film;
    const IS_BARE: bool = false;

    fn new(p: &Parameters, outside: f32, metal: &Tinted) -> Self {
        let mut index = [1.0; 3];
        if p.metallic > 0.0 {
            let (f0, f82) = (metal.f0(), metal.at(1.0 / 7.0));
            index = [0, 1, 2].map(|i| film::index(f0[i], f82[i]));
        }
        let [weight, thickness] = [p.thin_film, p.thin_film_thickness];
        Self {
            film: Film::new(weight, thickness, p.thin_film_ior, outside),
            metal: index,
        }
    }

    #[inline(always)]
    fn coat(&self) -> &Film {
        &self.film
    }

    #[inline]
    fn metal(&self, metal: &Tinted, cos: f32) -> Spectrum {
        let f0 = metal.f0();
        let squares = [0, 1, 2].map(|i| film::square_of(f0[i], self.metal[i]));
        self.film.metal(cos, metal.at(cos), squares)
    }

    fn metal_average(&self, metal: &Tinted) -> Spectrum {
        metal.average() + Film::average(|cos| self.metal(metal, cos) - metal.at(cos))
    }

    /// Even what is black by itself reflects under a film.
    #[inline(always)]
    fn metal_roughly(&self, metal: &Tinted, cos: f32) -> Spectrum {
        metal.at(cos).map(|f| 0.1 + 0.9 * f)
    }

    /// The film is on a boundary of full strength, of which `f90` shows.
    #[inline]
    fn boundary(&self, boundary: &Boundary, cos: f32) -> Spectrum {
        let strength = boundary.f90;
        if strength <= 0.0 {
            return Spectrum::ZERO;
        }
        let bare = boundary.at(cos) * (1.0 / strength);
        self.film.plastic(cos, bare, boundary.eta) * strength
    }

    fn boundary_average(&self, boundary: &Boundary) -> Spectrum {
        let adds = |cos| self.boundary(boundary, cos) - boundary.at(cos);
        boundary.average() + Film::average(adds)
    }

    #[inline]
    fn adds(&self, boundary: &Boundary, mu: f32, alpha: f32) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        for (cos, weight) in facets::cosines(mu, alpha) {
            sum += (self.boundary(boundary, cos) - boundary.at(cos)) * weight;
        }
        sum
    }
}
