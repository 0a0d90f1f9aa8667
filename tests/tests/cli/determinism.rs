//! The same bits, however the work is divided.

use crate::program::{bits, folder, render, scene};

/// Surfaces, several overlapping media, an area light and a sun; walks from lights that fall on any pixel.
const SCENES: [&str; 4] = [
    "overlap/overlap.json",
    "fog-room/fog-room.json",
    "bench/cloud_sun.json",
    "caustic/caustic.json",
];
/// Markov chains: each pass of a piece of work runs its own, so parts are other pictures of the same mean.
const CHAINS: &str = "pinhole/pinhole.json";

#[test]
fn threads_do_not_change_a_bit() {
    let at = folder("threads");
    let to_samples = |name| (name, ["--resolution", "50x34", "--spp", "20"]);
    let to_error = |name| (name, ["--resolution", "36x20", "--error", "0.2"]);
    let all = SCENES.into_iter().chain([CHAINS]).map(to_samples);
    for (name, size) in all.chain([to_error("bench/cloud_sun.json")]) {
        let with = |threads: &str| {
            let aovs = ["--aov", "depth,albedo,normal,variance,samples,orders:3"];
            let options = [&size[..], &aovs, &["--threads", threads]].concat();
            bits(&render(&at, &scene(name), "out.exr", &options))
        };
        let one = with("1");
        assert!(one.len() >= 30, "all layers are there");
        for threads in ["2", "7"] {
            assert!(one == with(threads), "{name}: {threads} threads");
        }
    }
}

/// The film adds in fixed point, so a run and its parts hold the same sums; only each file's rounding to f32 differs. A mean of
/// parts a and b is then off by at most one rounding of each part and one of the whole: 2⁻²⁴ relative each, for values ≥ 0.
#[test]
fn sample_ranges_merge_to_one_run() {
    let at = folder("ranges");
    for name in SCENES {
        let part = |range: &str| {
            let size = ["--resolution", "40x24", "--sample-range", range];
            render(&at, &scene(name), "out.exr", &size)
        };
        let cuts = [0u32, 12, 29, 48];
        let whole = part("0..48");
        let parts: Vec<_> = cuts
            .windows(2)
            .map(|w| (f64::from(w[1] - w[0]), part(&format!("{}..{}", w[0], w[1]))))
            .collect();
        let mut lit = 0;
        for channel in ["R", "G", "B", "A"] {
            let of = |image: &resolvent_image::Image| {
                image
                    .channel("", channel)
                    .map(<[f32]>::to_vec)
                    .unwrap_or_default()
            };
            let expected = of(&whole);
            let parts: Vec<_> = parts.iter().map(|(n, p)| (*n, of(p))).collect();
            for (i, e) in expected.iter().enumerate() {
                let merged: f64 =
                    parts.iter().map(|(n, p)| n * f64::from(p[i])).sum::<f64>() / 48.0;
                let e = f64::from(*e);
                assert!(e >= 0.0);
                assert!(
                    (merged - e).abs() <= 2.0 * 2f64.powi(-24) * e * 1.001,
                    "{name} {channel} {i}: {merged} {e}"
                );
                lit += usize::from(e > 0.0);
            }
        }
        assert!(lit > 500, "{name}: {lit}");
    }
}
