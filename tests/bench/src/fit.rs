//! Straight lines through points in logarithmic axes.

/// One point; both coordinates are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Abscissa: CPU seconds, voxels …
    pub x: f64,
    /// Ordinate: error, cost …
    pub y: f64,
    /// Relative standard error of `y`.
    pub relative: f64,
}

/// y = c x^slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Exponent.
    pub slope: f64,
    /// Its standard error, by the points' stated errors or their scatter, whichever is larger.
    pub slope_error: f64,
    /// ln c.
    log_factor: f64,
}

impl PowerLaw {
    /// Weighted least squares of ln y over ln x; `None` for fewer than two different abscissae.
    pub fn fit(points: &[Point]) -> Option<Self> {
        let usable = |p: &&Point| p.x > 0.0 && p.y > 0.0 && p.x.is_finite() && p.y.is_finite();
        let points: Vec<&Point> = points.iter().filter(usable).collect();
        // A point that claims to be exact must not decide alone.
        let weight = |p: &Point| 1.0 / p.relative.max(0.005).powi(2);
        let total: f64 = points.iter().map(|p| weight(p)).sum();
        let mean = |f: &dyn Fn(&Point) -> f64| {
            points.iter().map(|p| weight(p) * f(p)).sum::<f64>() / total
        };
        let (x, y) = (mean(&|p| p.x.ln()), mean(&|p| p.y.ln()));
        let xx = mean(&|p| (p.x.ln() - x).powi(2));
        if points.len() < 2 || xx <= 1e-12 {
            return None;
        }
        let slope = mean(&|p| (p.x.ln() - x) * (p.y.ln() - y)) / xx;
        let rest = mean(&|p| (p.y.ln() - y - slope * (p.x.ln() - x)).powi(2));
        let stated = 1.0 / (total * xx);
        let scattered = match points.len() {
            2 => 0.0,
            n => rest / xx / (n - 2) as f64,
        };
        Some(Self {
            slope,
            slope_error: stated.max(scattered).sqrt(),
            log_factor: y - slope * x,
        })
    }

    /// y at an abscissa.
    pub fn at(&self, x: f64) -> f64 {
        (self.log_factor + self.slope * x.ln()).exp()
    }

    /// The abscissa where y is reached; `None` if the line does not fall.
    pub fn reaches(&self, y: f64) -> Option<f64> {
        (self.slope < -0.05).then(|| ((y.ln() - self.log_factor) / self.slope).exp())
    }
}

/// Mean of logarithms with its standard error, and the number of values less one.
pub fn log_mean(values: &[f64]) -> Option<(f64, f64, f64)> {
    let logs: Vec<f64> = values
        .iter()
        .filter(|v| **v > 0.0 && v.is_finite())
        .map(|v| v.ln())
        .collect();
    let n = logs.len() as f64;
    if logs.len() < 2 {
        return None;
    }
    let mean = logs.iter().sum::<f64>() / n;
    let square = logs.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    Some((mean, (square / (n - 1.0) / n).sqrt(), n - 1.0))
}

#[cfg(test)]
mod tests {
    use super::{Point, PowerLaw, log_mean};

    fn line(slope: f64, noise: &[f64]) -> Vec<Point> {
        let y = |x: f64, e: f64| 3.0 * x.powf(slope) * (1.0 + e);
        noise
            .iter()
            .enumerate()
            .map(|(i, e)| (2f64.powi(i as i32), *e))
            .map(|(x, e)| Point {
                x,
                y: y(x, e),
                relative: 0.02,
            })
            .collect()
    }

    #[test]
    fn finds_a_power_law() {
        let fit = PowerLaw::fit(&line(-1.0, &[0.0; 5])).unwrap();
        assert!((fit.slope + 1.0).abs() < 1e-12);
        assert!((fit.at(10.0) - 0.3).abs() < 1e-12);
        assert!((fit.reaches(0.01).unwrap() - 300.0).abs() < 1e-9);
        // Stated errors of 2 % over x = 1 … 16: σ²/Σ(ln x − mean)².
        let expected = 0.02 / (10f64.sqrt() * 2f64.ln());
        assert!((fit.slope_error / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn scatter_shows_in_the_error() {
        let fit = PowerLaw::fit(&line(-1.0, &[0.3, -0.3, 0.3, -0.3, 0.3])).unwrap();
        assert!(fit.slope_error > 0.1, "{}", fit.slope_error);
    }

    #[test]
    fn too_little_is_no_line() {
        assert_eq!(PowerLaw::fit(&line(-1.0, &[0.0])), None);
        assert_eq!(PowerLaw::fit(&[]), None);
        let same = [line(-1.0, &[0.0])[0]; 3];
        assert_eq!(PowerLaw::fit(&same), None);
        assert_eq!(log_mean(&[1.0]), None);
    }

    #[test]
    fn mean_of_logarithms() {
        let (mean, error, freedom) = log_mean(&[1.0, 4.0]).unwrap();
        assert!((mean - 2f64.ln()).abs() < 1e-12);
        assert!((error - 2f64.ln()).abs() < 1e-12);
        assert_eq!(freedom, 1.0);
    }
}
