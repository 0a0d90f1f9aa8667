//! What lies on top of the base: a coat of varnish, and fuzz on it.

use crate::tilt::Tilt;
use crate::{Parameters, sheen};
use resolvent_api::math::warp;
use resolvent_api::microfacet::exits::{self, Curve, NODES, Packed};
use resolvent_api::microfacet::{Interface, Reflector, SMOOTH_BELOW, alpha, fresnel};
use resolvent_api::{Spectrum, Vec3};

/// Coat and fuzz at a point.
#[derive(Clone, Copy, Debug)]
pub struct Layers {
    /// They are on both sides.
    pub two_sided: bool,
    pub coat: f32,
    pub coat_eta: f32,
    /// Facets of the coat; `None`: smooth.
    pub coat_rough: Option<Reflector>,
    /// Normal of the coat in the shading frame, if it has one of its own.
    pub coat_tilt: Tilt,
    /// Logarithm of the colour that light has after two passages along the normal; 0 if clear.
    absorbs: Spectrum,
    pub fuzz: Spectrum,
    pub fuzz_roughness: f32,
    /// The mean of h over exits from the base's facets, so that h = T/this, see [`exits::passage`]: along the axes x and y.
    under: [Packed; 2],
    /// Squares of the base's widths along x and y over the larger one.
    widths: [f32; 2],
    /// Share of the light from inside that passes the body's facets which is then sent back by the layers.
    inside: Packed,
    /// 1/π over the mean of that share for diffuse light.
    inside_norm: f32,
}

/// What the layers do to light from one direction.
#[derive(Clone, Copy)]
pub struct Passed {
    /// The direction in the coat's frame.
    pub coat_way: Vec3,
    /// Transmittance of the fuzz, and of fuzz and coat, T.
    pub fuzz: f32,
    pub above: f32,
    /// h: reflection below them is weighted by h(ωo) h(ωi).
    pub reflects: f32,
    /// Factor by the coat's colour.
    pub tint: Spectrum,
}

impl Layers {
    pub fn new(p: &Parameters, outside: f32, two_sided: bool, lanes: u32) -> Self {
        let eta = p.clearcoat_ior / outside;
        let coat_eta = eta.max(1.0 / eta);
        let average = Spectrum::splat(fresnel::dielectric_average(coat_eta));
        let coat_rough = (p.clearcoat > 0.0 && p.clearcoat_roughness >= SMOOTH_BELOW)
            .then(|| Reflector::new(alpha(p.clearcoat_roughness, 0.0), average, lanes));
        Self {
            two_sided,
            coat: p.clearcoat,
            coat_eta,
            coat_rough,
            coat_tilt: p.clearcoat_normal.map_or(Tilt::NONE, Tilt::new),
            absorbs: p
                .clearcoat_color
                .map(|c| (1.0 + p.clearcoat * (c - 1.0)).max(1e-6).ln()),
            fuzz: p.sheen_color * p.sheen,
            fuzz_roughness: p.sheen_roughness,
            under: [Packed::new(&[1.0; NODES]); 2],
            widths: [1.0; 2],
            inside: Packed::new(&[0.0; NODES]),
            inside_norm: 0.0,
        }
    }

    /// True if there are none.
    #[inline(always)]
    pub fn is_bare(&self) -> bool {
        self.coat == 0.0 && self.fuzz.is_zero()
    }

    /// True if they are on the side of `w`.
    #[inline(always)]
    pub fn covers(&self, w: Vec3) -> bool {
        self.two_sided || w.z > 0.0
    }

    /// Takes in what lies below: facets of given widths (`None`: smooth) that reflect, and those of a transparent `body`.
    pub fn over(&mut self, widths: Option<[f32; 2]>, body: Option<&Interface>) {
        if self.is_bare() {
            return;
        }
        let t: Curve = core::array::from_fn(|k| {
            let [fuzz, coat] = self.transmittances(exits::mu_at(k));
            fuzz * coat
        });
        let over = |w: f32| Packed::new(&exits::passage(&t, &exits::mirrors(w.min(1.0))));
        match widths {
            Some([x, y]) if x == y => self.under = [over(x); 2],
            Some(widths) => {
                self.under = widths.map(over);
                let widest = widths[0].max(widths[1]);
                self.widths = widths.map(|w| (w / widest).powi(2));
            }
            None => self.under = [Packed::new(&t.map(f32::sqrt)); 2],
        }
        let Some(body) = body.filter(|b| !self.two_sided && !b.is_smooth()) else {
            return;
        };
        let Some(passing) = body.passing() else {
            return;
        };
        let back = |row: &Curve| row.iter().zip(&t).map(|(m, t)| m * (1.0 - t)).sum();
        self.inside = Packed::new(&core::array::from_fn(|k| back(&passing[k])));
        const N: u32 = 24;
        self.inside_norm = 1.0;
        let mean: f32 = (0..N)
            .map(|i| {
                let w = warp::around_z(-((i as f32 + 0.5) / N as f32).sqrt(), 0.125);
                self.sent_back(w, body)
            })
            .sum();
        self.inside_norm = core::f32::consts::FRAC_1_PI * N as f32 / mean.max(1e-9);
    }

    /// Share of the light from `w`, inside a rough `body`, that comes back from the layers.
    #[inline(always)]
    pub fn sent_back(&self, w: Vec3, body: &Interface) -> f32 {
        if self.inside_norm == 0.0 {
            return 0.0;
        }
        let eta = (1.0 / body.eta()).min(1.0);
        (self.inside.at_place(w.z, eta) * body.passes(w)).max(0.0)
    }

    /// Value of the lobe that sends it back, from the shares of both directions.
    #[inline(always)]
    pub fn back(&self, o: f32, i: f32) -> f32 {
        o * i * self.inside_norm
    }

    /// Transmittances of fuzz and coat at a cosine with the normal of both.
    #[inline(always)]
    pub fn transmittances(&self, mu: f32) -> [f32; 2] {
        [self.fuzz_passes(mu), self.coat_passes(mu)]
    }

    #[inline(always)]
    fn fuzz_passes(&self, mu: f32) -> f32 {
        if self.fuzz.is_zero() {
            1.0
        } else {
            1.0 - self.fuzz.max_lane() * sheen::albedo(mu, self.fuzz_roughness)
        }
    }

    #[inline(always)]
    fn coat_passes(&self, mu: f32) -> f32 {
        if self.coat == 0.0 {
            1.0
        } else {
            1.0 - self.coat * self.coat_share(mu)
        }
    }

    /// Albedo of a coat that is fully there.
    #[inline(always)]
    fn coat_share(&self, mu: f32) -> f32 {
        match &self.coat_rough {
            None => fresnel::dielectric(mu, self.coat_eta).0,
            Some(r) => {
                let w = warp::around_z(mu, 0.0);
                (r.width().reflected(w, self.coat_eta) + r.returned(w)[0]).min(1.0)
            }
        }
    }

    #[inline(always)]
    pub fn passed(&self, w: Vec3) -> Passed {
        if self.is_bare() || !self.covers(w) {
            return Passed {
                coat_way: w,
                fuzz: 1.0,
                above: 1.0,
                reflects: 1.0,
                tint: Spectrum::ONE,
            };
        }
        let coat_way = self.coat_tilt.enter(w);
        let mu = coat_way.z.abs();
        let fuzz = self.fuzz_passes(w.z.abs());
        let above = fuzz * self.coat_passes(mu);
        Passed {
            coat_way,
            fuzz,
            above,
            reflects: above / self.under(w, mu).max(1e-6),
            tint: self.tint(mu),
        }
    }

    /// The mean of h over exits of light from `w`, at the cosine `mu` with the coat's normal. Between the axes the width that faces
    /// the light counts, as for masking.
    #[inline(always)]
    fn under(&self, w: Vec3, mu: f32) -> f32 {
        let [along, across] = &self.under;
        let [x, y] = self.widths;
        if x == y {
            return along.at(mu);
        }
        let (x2, y2) = (w.x * w.x, w.y * w.y);
        let facing = ((x * x2 + y * y2) / (x2 + y2).max(1e-12)).sqrt();
        let (rx, ry) = (x.sqrt(), y.sqrt());
        let f = ((facing - ry) / (rx - ry)).clamp(0.0, 1.0);
        along.at(mu) * f + across.at(mu) * (1.0 - f)
    }

    /// Half a passage's worth of the coat's colour at normal incidence, longer the more obliquely light crosses the coat.
    #[inline(always)]
    fn tint(&self, mu: f32) -> Spectrum {
        if self.absorbs.is_zero() {
            return Spectrum::ONE;
        }
        let sin2 = (1.0 - mu * mu).max(0.0) / (self.coat_eta * self.coat_eta);
        let within = (1.0 - sin2).max(1e-4).sqrt();
        (self.absorbs * (0.5 / within)).exp()
    }
}

/// OpenPBR's darkening of a base of albedo `e` by what a coat of index `eta` reflects back down to it (OpenPBR 1.1, "Coat
/// darkening"): (1 − K)/(1 − e K), with K the reflectance of the coat's inside for diffuse light.
pub fn darkening(e: Spectrum, eta: f32) -> Spectrum {
    let k = fresnel::dielectric_average(1.0 / eta);
    e.map(|e| (1.0 - k) / (1.0 - e.min(1.0) * k))
}
