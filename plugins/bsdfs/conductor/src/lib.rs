//! BSDF `conductor`: metals, smooth or rough.
//!
//! | name | type | unit | default | range | meaning |
//! |---|---|---|---|---|---|
//! | `metal` | choice | | | | Ag, Al, Au, Be, Cr, Cu, Hg, Ir, Li, V, W: measured indices |
//! | `eta` | spectrum | | | ≥ 0 | index of refraction, real part; with `k` in place of `metal` |
//! | `k` | spectrum | | | ≥ 0 | index of refraction, imaginary part |
//! | `roughness` | float | | 0 | [0, 1] | square root of the facets' width α; below 0.01 a mirror |
//! | `anisotropy` | float | | 0 | [0, 1] | stretches highlights across x, at the same mean square slope |
//! | `reflectance` | spectrum | | 1 | [0, 1] | factor of what is reflected; 1 for real metals |
//! | `thin_film` | float | | 0 | [0, 1] | presence of a thin film on the metal |
//! | `thin_film_thickness` | float | nm | 500 | ≥ 0 | thickness of the film |
//! | `thin_film_ior` | float | | 1.4 | [1, 5] | the film's index of refraction |
//!
//! Light is reflected with Fresnel's reflectance for the complex index η + ik, on both sides. Rough metals have facets with the GGX
//! distribution; light that meets several is returned by a second lobe ([`resolvent_api::microfacet::Reflector`] has the equations),
//! so that a metal that reflects everything loses nothing. In a medium of another index only the ratio counts. x follows ∂p/∂u.
//!
//! ```json
//! "materials": { "gold": { "plugin": "conductor", "params": { "metal": "Au", "roughness": 0.25 } } }
//! ```

mod metals;
#[cfg(test)]
mod tests;

use resolvent_api::microfacet::film::{self, Film};
use resolvent_api::microfacet::{Bare, Reflector, SMOOTH_BELOW, alpha, fresnel};
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::surface::bsdf_traits;
use resolvent_api::{
    Bsdf, Decl, Either, Error, Mode, ParamDecl, Params, Plugin, Scatter, ScatterDraws, ScatterEval,
    ScatterSample, Slot, Spectrum, Stored, SurfacePoint, Vec3,
};

/// The plugin.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    eta: Spectrum,
    k: Spectrum,
    roughness: f32,
    anisotropy: f32,
    reflectance: Spectrum,
    /// Weight, thickness and index of its film, if it has one.
    film: Option<[f32; 3]>,
    /// Mean reflectance for diffuse light in vacuum: it takes a quadrature, which vertices are spared.
    average: Spectrum,
}

/// What a metal reflects: with nothing on it, or under a film.
pub trait Reflectance: Copy + Send + Sync + 'static {
    /// At cosine `cos`, from the index against the outside.
    fn at(&self, cos: f32, eta: Spectrum, k: Spectrum) -> Spectrum;
    /// Mean for diffuse light.
    fn average(&self, eta: Spectrum, k: Spectrum) -> Spectrum;
}

impl Reflectance for Bare {
    #[inline(always)]
    fn at(&self, cos: f32, eta: Spectrum, k: Spectrum) -> Spectrum {
        eta.zip(k, |eta, k| fresnel::conductor(cos, eta, k))
    }

    /// By the midpoint rule over μ².
    fn average(&self, eta: Spectrum, k: Spectrum) -> Spectrum {
        const N: u32 = 64;
        let mut sum = Spectrum::ZERO;
        for i in 0..N {
            let mu = ((i as f32 + 0.5) / N as f32).sqrt();
            sum += self.at(mu, eta, k);
        }
        sum * (1.0 / N as f32)
    }
}

impl Reflectance for Film {
    #[inline]
    fn at(&self, cos: f32, eta: Spectrum, k: Spectrum) -> Spectrum {
        let squares = [0, 1, 2].map(|i| film::square(eta[i], k[i]));
        self.metal(cos, Bare.at(cos, eta, k), squares)
    }

    fn average(&self, eta: Spectrum, k: Spectrum) -> Spectrum {
        let adds = |cos| self.at(cos, eta, k) - Bare.at(cos, eta, k);
        Bare.average(eta, k) + Film::average(adds)
    }
}

/// A metal at a point.
#[derive(Clone, Copy, Debug)]
pub struct Surface<R> {
    reflectance: R,
    eta: Spectrum,
    k: Spectrum,
    tint: Spectrum,
    /// Rough facets; `None`: a mirror.
    rough: Option<Reflector>,
}

impl Plugin for Conductor {
    const NAME: &'static str = "conductor";
    const SUMMARY: &'static str = "A metal, smooth or rough (GGX).";
    const PARAMS: &'static [ParamDecl] = &[
        Decl::choice("metal", metals::NAMES, "measured indices of refraction").build(),
        Decl::spectrum("eta", "index of refraction, real part")
            .at_least(0.0)
            .build(),
        Decl::spectrum("k", "index of refraction, imaginary part")
            .at_least(0.0)
            .build(),
        Decl::float(
            "roughness",
            "square root of the facets' width; below 0.01 a mirror",
        )
        .default("0")
        .at_least(0.0)
        .at_most(1.0)
        .build(),
        Decl::float("anisotropy", "stretches highlights across x")
            .default("0")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::spectrum("reflectance", "factor of what is reflected")
            .default("1")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::float("thin_film", "presence of a thin film on the metal")
            .default("0")
            .at_least(0.0)
            .at_most(1.0)
            .build(),
        Decl::float("thin_film_thickness", "thickness of the film")
            .unit("nm")
            .default("500")
            .at_least(0.0)
            .build(),
        Decl::float("thin_film_ior", "the film's index of refraction")
            .default("1.4")
            .at_least(1.0)
            .at_most(5.0)
            .build(),
    ];

    fn create(params: &Params<'_>) -> Result<Self, Error> {
        let given = (
            params.text("metal"),
            params.spectrum("eta"),
            params.spectrum("k"),
        );
        let (eta, k) = match given {
            (Some(symbol), None, None) => metals::METALS
                .iter()
                .find(|m| m.0 == symbol)
                .map(|(_, eta, k)| (rgb(*eta), rgb(*k)))
                .ok_or_else(|| Error::new(format!("'{symbol}' is no metal that was measured")))?,
            (None, Some(eta), Some(k)) => (eta, k),
            _ => {
                return Err(Error::new(
                    "a conductor is given either by 'metal' or by both 'eta' and 'k'",
                ));
            }
        };
        let film = ["thin_film", "thin_film_thickness", "thin_film_ior"];
        let [weight, thickness, ior] = film.map(|name| params.float(name));
        let film = [weight? as f32, thickness? as f32, ior? as f32];
        let film = (film[0] * film[1] > 0.0).then_some(film);
        Ok(Self {
            eta,
            k,
            roughness: params.float("roughness")? as f32,
            anisotropy: params.float("anisotropy")? as f32,
            reflectance: params.spectrum("reflectance").unwrap_or(Spectrum::ONE),
            film,
            average: match film {
                None => Bare.average(eta, k),
                Some(film) => Conductor::film(film, 1.0).average(eta, k),
            },
        })
    }
}

fn rgb(v: [f64; 3]) -> Spectrum {
    Spectrum::rgb(v[0] as f32, v[1] as f32, v[2] as f32)
}

impl Bsdf for Conductor {
    type Closure = Either<Surface<Bare>, Surface<Film>>;

    fn traits(&self) -> u32 {
        bsdf_traits::UNIFORM
    }

    fn closure(&self, at: &SurfacePoint) -> Self::Closure {
        match self.film {
            None => Either::A(self.surface(Bare, at)),
            Some(film) => Either::B(self.surface(Self::film(film, at.outside_ior), at)),
        }
    }

    fn store(&self, at: &SurfacePoint, slot: Slot<'_>) -> Stored {
        match self.film {
            None => slot.put(self.surface(Bare, at)),
            Some(film) => slot.put(self.surface(Self::film(film, at.outside_ior), at)),
        }
    }
}

impl Conductor {
    fn film([weight, thickness, ior]: [f32; 3], outside: f32) -> Film {
        Film::new(weight, thickness, ior, outside)
    }

    #[inline(always)]
    fn surface<R: Reflectance>(&self, reflectance: R, at: &SurfacePoint) -> Surface<R> {
        let per = 1.0 / at.outside_ior;
        let (eta, k) = (self.eta * per, self.k * per);
        let rough = (self.roughness >= SMOOTH_BELOW).then(|| {
            let average = if per == 1.0 {
                self.average
            } else {
                reflectance.average(eta, k)
            };
            let narrowest = SMOOTH_BELOW * SMOOTH_BELOW;
            let alpha = alpha(self.roughness, self.anisotropy).map(|a| a.max(narrowest));
            Reflector::new(alpha, average, at.lanes)
        });
        Surface {
            reflectance,
            eta,
            k,
            tint: self.reflectance,
            rough,
        }
    }
}

impl<R: Reflectance> Scatter for Surface<R> {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, _: Mode) -> ScatterEval {
        let Some(rough) = &self.rough else {
            return ScatterEval::default();
        };
        let mut e = rough.eval(wo, wi, |cos| self.reflectance.at(cos, self.eta, self.k));
        e.f *= self.tint;
        e
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        let Some(rough) = &self.rough else {
            if wo.z == 0.0 {
                return None;
            }
            return Some(ScatterSample {
                weight: self.reflectance.at(wo.z.abs(), self.eta, self.k) * self.tint,
                wi: [-wo.x, -wo.y, wo.z],
                eta: 1.0,
                forward: 1.0,
                reverse: 1.0,
                measure: Measure::Discrete as u32,
                lobe: 0,
            });
        };
        let wi = rough.sample(wo, u)?;
        let e = self.eval(wo, wi, mode);
        (e.forward > 0.0).then(|| ScatterSample {
            weight: e.f * (wi.z.abs() / e.forward),
            wi: wi.into(),
            eta: 1.0,
            forward: e.forward,
            reverse: e.reverse,
            measure: Measure::SolidAngle as u32,
            lobe: 0,
        })
    }

    fn lobes(&self) -> u32 {
        if self.rough.is_some() {
            lobes::SMOOTH
        } else {
            lobes::DELTA
        }
    }
}

resolvent_api::export_plugin!(bsdf, Conductor);
