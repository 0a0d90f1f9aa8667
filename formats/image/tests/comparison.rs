//! The comparison's figures on images whose figures are known, and the z-test's error rates.

use resolvent_image::{BEAUTY, Comparison, Image, compare};

/// A small generator (SplitMix64, Steele et al. 2014), so that every run does the same.
struct Random(u64);

impl Random {
    /// In (0, 1).
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 + 1e-17
    }

    /// Box and Muller 1958.
    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

const SIZE: usize = 64;

/// A smooth picture with noise of the deviation `sigma` × the pixel, and the variance it states.
fn noisy(random: &mut Random, sigma: f64, factor: impl Fn(usize, usize) -> f64) -> Image {
    let mut image = Image::new(SIZE, SIZE);
    let (mut color, mut variance) = ([const { Vec::new() }; 3], [const { Vec::new() }; 3]);
    for i in 0..image.pixels() {
        for c in 0..3 {
            let mean = 0.2 + 0.01 * (i % SIZE) as f64 + 0.1 * c as f64;
            color[c].push((mean * (factor(i % SIZE, i / SIZE) + sigma * random.normal())) as f32);
            variance[c].push((mean * sigma).powi(2) as f32);
        }
    }
    let names = ["R", "G", "B"];
    image.push(BEAUTY, names.into_iter().zip(color));
    if sigma > 0.0 {
        image.push("variance", names.into_iter().zip(variance));
    }
    image
}

fn test(a: &Image, b: &Image) -> Comparison {
    compare(a, b, [8, 8]).unwrap()
}

fn constant(values: [f32; 3], pixels: usize) -> Image {
    let mut image = Image::new(pixels, 1);
    image.push(
        BEAUTY,
        ["R", "G", "B"]
            .into_iter()
            .zip(values.map(|v| vec![v; pixels])),
    );
    image
}

#[test]
fn figures_worked_out_by_hand() {
    let (a, r) = (
        constant([1.5, 2.0, 0.1], 1000),
        constant([1.0, 2.0, 0.0], 1000),
    );
    let c = test(&a, &r);
    assert!((c.mse - (0.25 + 0.01) / 3.0).abs() < 1e-8);
    let rel = (0.25 / 1.01 + 0.01 / 0.01) / 3.0;
    assert!((c.rel_mse - rel).abs() < 1e-8 && (c.rel_mse_untrimmed - rel).abs() < 1e-8);
    assert_eq!(
        (c.mean_ratio[0], c.mean_ratio[1], c.pixels, c.not_finite),
        (1.5, 1.0, 1000, 0)
    );
    assert!(c.mean_ratio[2].is_infinite());
    assert!(c.regions.is_none());
}

/// Two noisy images within the intervals of both, and one within its own of what has none.
#[test]
fn intervals_are_counted() {
    let mut random = Random(5);
    let with_intervals = |random: &mut Random, stated: f32| {
        let mut image = noisy(random, 0.3, |_, _| 1.0);
        assert!(test(&image, &image).within_error_95.is_none());
        let variance = image.layer("variance").unwrap().rgb_or_grey().unwrap();
        let error = variance.map(|v| v.iter().map(|v| stated * 1.96 * v.sqrt()).collect());
        image.push("error_95", ["R", "G", "B"].into_iter().zip(error));
        image
    };
    let mut truth = noisy(&mut random, 0.0, |_, _| 1.0);
    let (a, b) = (
        with_intervals(&mut random, 1.0),
        with_intervals(&mut random, 1.0),
    );
    let narrow = with_intervals(&mut random, 0.5);
    let share = |a: &Image, b: &Image| test(a, b).within_error_95.unwrap();
    // Of 12,288 values 0.2 % is the standard error. Half of the width covers 67.3 %.
    for (x, y, expected) in [(&a, &b, 0.95), (&a, &truth, 0.95), (&truth, &narrow, 0.673)] {
        let share = share(x, y);
        assert!((share - expected).abs() < 0.012, "{share} {expected}");
    }
    // What has no noise does not count.
    truth.layers[0].channels[1].data[..500].fill(70.0);
    let mut quiet = a.clone();
    let before = share(&quiet, &truth);
    quiet.layers[2].channels[1].data[..500].fill(0.0);
    assert!(share(&quiet, &truth) > before + 0.03);
    quiet.layers[2]
        .channels
        .iter_mut()
        .for_each(|c| c.data.fill(0.0));
    assert!(test(&quiet, &truth).within_error_95.is_none());
}

#[test]
fn the_worst_thousandth_is_left_out() {
    let r = constant([1.0; 3], 2001);
    let mut a = r.clone();
    // 2001 pixels: the worst three (rounded up) go, so the third largest error and all above.
    for (i, x) in [(5, 100.0), (50, 200.0), (500, 300.0), (1500, 2.0)] {
        a.layers[0].channels[0].data[i] = x;
    }
    let c = test(&a, &r);
    assert!(
        (c.rel_mse - 1.0 / 1.01 / 3.0 / 1998.0).abs() < 1e-12,
        "{}",
        c.rel_mse
    );
    let all = (99.0f64.powi(2) + 199.0f64.powi(2) + 299.0f64.powi(2) + 1.0) / 1.01 / 3.0 / 2001.0;
    assert!((c.rel_mse_untrimmed / all - 1.0).abs() < 1e-12);
}

#[test]
fn pixels_that_are_not_finite_are_counted_and_left_out() {
    let r = constant([1.0; 3], 100);
    let mut a = r.clone();
    a.layers[0].channels[2].data[7] = f32::NAN;
    a.layers[0].channels[0].data[8] = f32::INFINITY;
    let c = test(&a, &r);
    assert_eq!(
        (c.pixels, c.not_finite, c.mse, c.mean),
        (98, 2, 0.0, [1.0; 3])
    );
    a.layers[0].channels[0].data.fill(f32::NAN);
    assert!(
        compare(&a, &r, [8, 8])
            .unwrap_err()
            .to_string()
            .contains("no pixel is finite")
    );
}

#[test]
fn what_cannot_be_compared() {
    let a = constant([1.0; 3], 100);
    let error = compare(&a, &constant([1.0; 3], 99), [8, 8])
        .unwrap_err()
        .to_string();
    assert_eq!(error, "the image has 100 × 1 pixels, the reference 99 × 1");
    let mut depth = Image::new(100, 1);
    depth.push("depth", [("Z", vec![1.0; 100])]);
    assert_eq!(
        compare(&a, &depth, [8, 8]).unwrap_err().to_string(),
        "the reference has no channels R, G, B"
    );
}

/// Where only noise differs, the corrected p-value is uniform: below 5 % in 5 % of the cases.
#[test]
fn noise_alone_is_accepted_as_often_as_promised() {
    let mut random = Random(11);
    let trials = 400;
    let (mut below, mut failed, mut squares, mut tests) = (0, 0, 0.0, 0);
    for trial in 0..trials {
        let a = noisy(&mut random, 0.3, |_, _| 1.0);
        // Against another noisy image, and against one without noise.
        let b = noisy(
            &mut random,
            if trial % 2 == 0 { 0.5 } else { 0.0 },
            |_, _| 1.0,
        );
        let regions = test(&a, &b).regions.unwrap();
        assert_eq!(regions.tests.len(), 8 * 8 * 3 + 3);
        below += usize::from(regions.p_value < 0.05);
        failed += usize::from(!regions.passed());
        assert_eq!(regions.passed(), regions.max_z <= regions.threshold);
        squares += regions.tests[..192].iter().map(|t| t.z * t.z).sum::<f64>();
        tests += 192;
    }
    // Binomial(400, 0.05): 20 ± 4.4; Binomial(400, 0.01): 4 ± 2. Bounds at 4 standard deviations.
    assert!((3..=37).contains(&below), "{below}");
    assert!(failed <= 12, "{failed}");
    // z is standard normal: the mean of its square is 1 ± √(2/n).
    let spread = 4.0 * (2.0 / f64::from(tests)).sqrt();
    assert!(
        (squares / f64::from(tests) - 1.0).abs() < spread,
        "{}",
        squares / f64::from(tests)
    );
}

#[test]
fn a_bias_of_one_percent_is_found() {
    let mut random = Random(5);
    for _ in 0..20 {
        // 4096 pixels of 10 % noise: the mean is known to 0.16 %, a bias of 1 % is six deviations.
        let a = noisy(&mut random, 0.1, |_, _| 1.01);
        let r = noisy(&mut random, 0.0, |_, _| 1.0);
        let regions = test(&a, &r).regions.unwrap();
        assert!(!regions.passed(), "p = {}", regions.p_value);
        assert_eq!(regions.worst().unwrap().region, [0, 0, SIZE, SIZE]);
    }
}

#[test]
fn a_local_bias_is_found_where_it_is() {
    let mut random = Random(7);
    let patch = |x: usize, y: usize| {
        if (16..24).contains(&x) && (40..48).contains(&y) {
            1.08
        } else {
            1.0
        }
    };
    for _ in 0..20 {
        let (a, r) = (
            noisy(&mut random, 0.05, patch),
            noisy(&mut random, 0.05, |_, _| 1.0),
        );
        let regions = test(&a, &r).regions.unwrap();
        assert!(!regions.passed());
        assert_eq!(regions.worst().unwrap().region, [16, 40, 24, 48]);
    }
}

#[test]
fn no_noise_and_no_difference_passes_and_a_difference_fails() {
    let with_variance = |value: f32| {
        let mut image = constant([value; 3], 64);
        image.push(
            "variance",
            [
                ("R", vec![0.0; 64]),
                ("G", vec![0.0; 64]),
                ("B", vec![0.0; 64]),
            ],
        );
        image
    };
    let regions = test(&with_variance(0.0), &with_variance(0.0))
        .regions
        .unwrap();
    assert!(regions.passed() && regions.max_z == 0.0);
    // The last bit of an f32 is no difference, a thousandth is.
    assert!(
        test(&with_variance(1.0 + f32::EPSILON), &with_variance(1.0))
            .regions
            .unwrap()
            .passed()
    );
    assert!(
        !test(&with_variance(1.001), &with_variance(1.0))
            .regions
            .unwrap()
            .passed()
    );
}
