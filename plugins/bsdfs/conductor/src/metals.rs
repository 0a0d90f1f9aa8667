//! Measured indices of refraction of metals.

/// A metal: its symbol, η and k for red, green and blue.
pub type Metal = (&'static str, [f64; 3], [f64; 3]);

/// Symbols as a choice parameter lists them.
pub const NAMES: &str = "Ag|Al|Au|Be|Cr|Cu|Hg|Ir|Li|V|W";

/// Spectra of the SOPRA and Palik collections, projected to linear sRGB with the CIE 1931 observer; the figures are those
/// published with the Tungsten renderer (Bitterli 2014, `ComplexIorData`), rounded to five digits.
pub const METALS: [Metal; 11] = [
    ("Ag", [0.15526, 0.11672, 0.13838], [4.8283, 3.1222, 2.1470]),
    ("Al", [1.6575, 0.88037, 0.52123], [9.2239, 6.2695, 4.8370]),
    ("Au", [0.14312, 0.37496, 1.4425], [3.9832, 2.3857, 1.6032]),
    ("Be", [4.1851, 3.1851, 2.7841], [3.8354, 3.0101, 2.8690]),
    ("Cr", [4.3697, 2.9167, 1.6547], [5.2064, 4.2314, 3.7549]),
    ("Cu", [0.20044, 0.92403, 1.1022], [3.9129, 2.4528, 2.1422]),
    ("Hg", [2.3989, 1.4400, 0.90955], [6.3276, 4.3719, 3.4218]),
    ("Ir", [3.0864, 2.0822, 1.6179], [5.5922, 4.0672, 3.2673]),
    ("Li", [0.26579, 0.19561, 0.22092], [3.5402, 2.3111, 1.6686]),
    ("V", [4.2775, 3.5132, 2.7611], [3.4912, 2.8894, 3.1117]),
    ("W", [4.3707, 3.3003, 2.9983], [3.5007, 2.6049, 2.2732]),
];
