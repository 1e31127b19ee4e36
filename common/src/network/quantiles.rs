//! A random variable from one uniform number: the quantile function of a density, tabulated once.

use std::sync::Arc;

/// Points of a table. Between two of them the distribution function is taken as linear, which is off by less than 10⁻⁴.
const POINTS: usize = 4096;

/// The quantile function of a density, as a table; cheap to clone.
///
/// A table and not a formula, because then every draw costs the same few comparisons, takes exactly one uniform number,
/// and never leaves the support.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantiles(Arc<Vec<(f64, f64)>>);

impl Quantiles {
    /// The variable `value(y)` where `y` has this density, up to a factor, on \[low, high\]; `value` must not fall.
    ///
    /// A density that is nowhere positive and finite gives `value(low)`.
    pub fn of_density(density: impl Fn(f64) -> f64, low: f64, high: f64, value: impl Fn(f64) -> f64) -> Quantiles {
        let y = |i: usize| low + (high - low) * i as f64 / (POINTS - 1) as f64;
        let mut sum = 0.0;
        let mut before = density(low);
        let mut table = vec![(0.0, value(low))];
        for i in 1..POINTS {
            let here = density(y(i));
            sum += 0.5 * (before + here);
            before = here;
            table.push((sum, value(y(i))));
        }
        if !(sum > 0.0 && sum.is_finite()) {
            return Quantiles(Arc::new(vec![(0.0, value(low)), (1.0, value(low))]));
        }
        table.iter_mut().for_each(|(share, _)| *share /= sum);
        Quantiles(Arc::new(table))
    }

    /// Normal with this mean and standard deviation, given that it is at least `least`.
    pub fn normal(mean: f64, deviation: f64, least: f64) -> Quantiles {
        // Beyond nine deviations there is less than 10⁻¹⁸. Far below the bound, what is left is close to exponential.
        let z_least = ((least - mean) / deviation).max(-9.0);
        let z_most = if z_least < 8.0 { 9.0 } else { z_least + 40.0 / z_least };
        let density = |z: f64| (-0.5 * (z * z - z_least * z_least)).exp();
        Quantiles::of_density(density, z_least, z_most, |z| (mean + deviation * z).max(least))
    }

    /// `least` plus a gamma variable with shape k and scale θ: mean `least` + kθ, standard deviation √k θ.
    pub fn gamma(shape: f64, scale: f64, least: f64) -> Quantiles {
        // The density of y = ln(x/θ), exp(ky − eʸ), has no singularity at small x and falls off on both sides of y = ln k.
        let centre = shape.ln();
        let density = |y: f64| (shape * (y - centre) - (y.exp() - shape)).exp();
        let spread = 1.0 / shape.sqrt();
        let low = centre - (20.0 / shape + 9.0 * spread);
        let high = (1.0 + 12.0 * spread + 60.0 / shape).ln() + centre;
        Quantiles::of_density(density, low, high, |y| least + scale * y.exp())
    }

    /// The value below which a share `u` ∈ \[0, 1) of the probability lies.
    pub fn at(&self, u: f64) -> f64 {
        let table = &self.0;
        let above = table.partition_point(|(share, _)| *share <= u).clamp(1, table.len() - 1);
        let ((u_0, x_0), (u_1, x_1)) = (table[above - 1], table[above]);
        if u_1 > u_0 { x_0 + (x_1 - x_0) * ((u - u_0) / (u_1 - u_0)).clamp(0.0, 1.0) } else { x_0 }
    }

    /// The least value that can come.
    pub fn least(&self) -> f64 {
        self.0[0].1
    }

    /// The greatest value that can come.
    pub fn greatest(&self) -> f64 {
        self.0[self.0.len() - 1].1
    }
}

#[cfg(test)]
mod tests {
    use super::Quantiles;

    /// Mean and standard deviation by equal shares of probability.
    fn moments(quantiles: &Quantiles) -> (f64, f64) {
        let n = 200_000;
        let draw = |i: i32| quantiles.at((f64::from(i) + 0.5) / f64::from(n));
        let mean = (0..n).map(draw).sum::<f64>() / f64::from(n);
        let variance = (0..n).map(|i| (draw(i) - mean).powi(2)).sum::<f64>() / f64::from(n);
        (mean, variance.sqrt())
    }

    #[test]
    fn a_normal_variable_has_its_known_quantiles() {
        let normal = Quantiles::normal(0.0, 1.0, f64::NEG_INFINITY);
        for (u, z) in
            [(0.5, 0.0), (0.841_344_746, 1.0), (0.977_249_868, 2.0), (0.998_650_102, 3.0), (0.025, -1.959_964)]
        {
            assert!((normal.at(u) - z).abs() < 1e-4, "{u}: {} for {z}", normal.at(u));
        }
    }

    #[test]
    fn a_normal_variable_that_is_cut_off_has_the_mean_of_the_rest() {
        // Half normal: mean √(2/π), standard deviation √(1 − 2/π).
        let (mean, deviation) = moments(&Quantiles::normal(0.0, 1.0, 0.0));
        let half = std::f64::consts::FRAC_2_PI;
        assert!((mean - half.sqrt()).abs() < 1e-4 && (deviation - (1.0 - half).sqrt()).abs() < 1e-4);
        // Cut off far above its mean, about exponential: (mean − bound) ≈ 1/bound − 2/bound³.
        let (mean, _) = moments(&Quantiles::normal(0.0, 1.0, 20.0));
        assert!((mean - 20.0 - (1.0 / 20.0 - 2.0 / 8000.0)).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn a_gamma_variable_has_its_mean_and_deviation() {
        for (shape, scale) in [(0.3, 2.0), (1.0, 1.0), (4.0, 0.25), (400.0, 0.01)] {
            let (mean, deviation) = moments(&Quantiles::gamma(shape, scale, 3.0));
            let wanted = shape.sqrt() * scale;
            assert!((mean - 3.0 - shape * scale).abs() < 2e-3 * wanted, "shape {shape}: mean {mean}");
            assert!((deviation / wanted - 1.0).abs() < 2e-3, "shape {shape}: deviation {deviation}, not {wanted}");
        }
        // With shape 1 it is exponential: median ln 2.
        assert!((Quantiles::gamma(1.0, 1.0, 0.0).at(0.5) - std::f64::consts::LN_2).abs() < 1e-4);
    }

    #[test]
    fn draws_rise_with_the_number_and_stay_within_bounds() {
        for quantiles in [Quantiles::normal(1.0, 0.5, 0.2), Quantiles::gamma(2.0, 0.5, 0.2)] {
            let draws: Vec<f64> = (0..1000).map(|i| quantiles.at(f64::from(i) / 1000.0)).collect();
            assert!(draws.is_sorted());
            assert!(draws.iter().all(|x| (quantiles.least()..=quantiles.greatest()).contains(x) && *x >= 0.2));
        }
    }

    #[test]
    fn silly_densities_give_a_number() {
        for quantiles in [
            Quantiles::of_density(|_| 0.0, 1.0, 2.0, |y| y),
            Quantiles::of_density(|_| f64::NAN, 1.0, 2.0, |y| y),
            Quantiles::of_density(|_| f64::INFINITY, 1.0, 2.0, |y| y),
        ] {
            assert_eq!([0.0, 0.5, 0.999].map(|u| quantiles.at(u)), [1.0; 3]);
        }
    }
}
