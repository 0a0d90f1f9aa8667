//! The fit to Lorenz-Mie scattering by water: four numbers for a diameter.
//!
//! Jendersie & d'Eon 2023, "An Approximate Mie Scattering Function for Fog and Cloud Rendering", SIGGRAPH Talks, with its
//! supplement, whose numbers are meant here: eq. 7-10 for 5 to 50 µm, which the talk gives as well; eq. 11-14 up to 0.1 µm, 15-18
//! up to 1.5 µm and 19-22 up to 5 µm. Numbers and constants are those that Blender's Cycles states (phase_mie_fitted_parameters);
//! all but one of five public implementations have the same constants to the digits they give (one has 13.58 for 13.8).

/// The largest diameter of the fit, µm.
pub const LARGEST: f64 = 50.0;

/// The parameters of the blend.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    /// Mean cosine of the Henyey-Greenstein lobe.
    pub g_hg: f64,
    /// Draine's g.
    pub g_d: f64,
    /// Draine's α.
    pub alpha: f64,
    /// Share of Draine's lobe.
    pub w_d: f64,
}

impl Fit {
    /// For droplets of `d` µm diameter, 0 < d ≤ [`LARGEST`].
    pub fn new(d: f64) -> Self {
        let ln = d.ln();
        if d <= 0.1 {
            Self {
                g_hg: 13.8 * d * d,
                g_d: 1.1456 * d * (9.29044 * d).sin(),
                alpha: 250.0,
                w_d: 0.252977 - 312.983 * d.powf(4.3),
            }
        } else if d < 1.5 {
            let inner = (ln - 0.238604) * (ln + 1.00667) / (0.507522 - 0.15677 * ln);
            Self {
                g_hg: 0.862 - 0.143 * ln * ln,
                g_d: 0.379685 * (1.19692 * inner.cos() + 1.37932 * ln + 0.0625835).cos() + 0.344213,
                alpha: 250.0,
                w_d: 0.146209 * (3.38707 * ln + 2.11193).cos() + 0.316072 + 0.0778917 * ln,
            }
        } else if d < 5.0 {
            Self {
                g_hg: 0.0604931 * ln.ln() + 0.940256,
                g_d: 0.500411 - 0.081287 / (-2.0 * ln + ln.tan() + 1.27551),
                alpha: 7.30354 * ln + 6.31675,
                w_d: 0.026914 * (ln - (5.68947 * (ln.ln() - 0.0292149)).cos()) + 0.376475,
            }
        } else {
            Self {
                g_hg: (-0.0990567 / (d - 1.67154)).exp(),
                g_d: (-2.20679 / (d + 3.91029) - 0.428934).exp(),
                alpha: (3.62489 - 8.29288 / (d + 5.52825)).exp(),
                w_d: (-0.599085 / (d - 0.641583) - 0.665888).exp(),
            }
        }
    }

    /// Mean cosine of the blend.
    pub fn mean_cosine(&self) -> f64 {
        (1.0 - self.w_d) * self.g_hg + self.w_d * mean_cosine_of_draine(self.g_d, self.alpha)
    }
}

/// g (1 + α (3 + 2 g²)/5) / (1 + α (1 + 2 g²)/3), from the Legendre moments gⁿ of the Henyey-Greenstein lobe: ⟨cos² θ⟩ =
/// (1 + 2 g²)/3 and ⟨cos³ θ⟩ = (3 g + 2 g³)/5 (Draine 2003, eq. 5-7).
pub fn mean_cosine_of_draine(g: f64, alpha: f64) -> f64 {
    let g2 = g * g;
    g * (1.0 + alpha * (3.0 + 2.0 * g2) / 5.0) / (1.0 + alpha * (1.0 + 2.0 * g2) / 3.0)
}
