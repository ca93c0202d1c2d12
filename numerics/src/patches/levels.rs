//! Levels of larger and larger means, weighed at each place.
//!
//! A level of larger means has less noise, but misses what is smaller than its neighbourhoods: fine detail,
//! and the ends of fillets and planes. Its own deviations do not say so. The finest level, whose deviations
//! are honest, tells: let a and c be the estimates of a quantity by a fine and a coarse level, with variances
//! σ_a² > σ_c². If the coarse one has no bias, `Δ = a − c` has the variance `V = σ_a² − σ_c²`, since c makes
//! the better use of the same points (Hausman 1978). With a bias of variance b² it has `V + b²`, and the best
//! estimate is `c + λΔ`, `λ = b²/(b² + V)`, of variance `σ_c² + λV`.
//!
//! How large b² is differs between places. The mixture of ratios b²/V that makes the differences at the sites
//! most likely is learned for the whole cloud (Laird 1978), and each place weighs them by its own difference.

use super::answers::{CurvatureDeviations, PatchGeometry};
use super::estimate::normal_variance;
use super::pooled::{mixture_shares, normalized};
use crate::machine::heap::vec_bytes;
use crate::machine::vector::{dot, norm};
use crate::points::sampling::median;

/// Number of ratios that an [`Agreement`] has shares of.
pub const N_BIASES: usize = 9;

/// Ratios of the variance of the bias to that of the difference without it.
const EXCESSES: [f64; N_BIASES] = [0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0];

/// Least ratio that is a bias. Smaller ones are variances that are somewhat off. A few tenths of V may be
/// many times the variance of the coarser level, and would make the bars of smooth surfaces longer.
const LEAST_BIAS: f64 = 1.0;

/// Share of the places below which a ratio is left out: what single places have may as well be a fine level
/// that is off by more than it says.
const LEAST_SHARE: f64 = 0.01;

/// Least variance of a difference, as a share of that of the finer level.
const LEAST_VARIANCE: f64 = 0.05;

/// Shares of the places in which a level is off the finer ones by each of nine ratios.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    pub normals: Vec<f64>,
    pub curvatures: Vec<f64>,
}

/// Difference of a fine and a coarse level in one quantity at one place.
#[derive(Clone, Copy)]
struct Discrepancy {
    /// |a − c|², over the variance of one of its components without a bias.
    excess: f64,
    n_components: f64,
}

/// The weight λ of the finer level, and the variance of that weight.
#[derive(Clone, Copy, Default)]
struct Weight {
    mean: f64,
    variance: f64,
}

impl Agreement {
    /// Bytes held on the heap.
    pub(super) fn n_bytes(&self) -> usize {
        vec_bytes(&self.normals) + vec_bytes(&self.curvatures)
    }

    /// Learns how far a coarser level is off at places where both were asked.
    pub(super) fn of(fine: &PatchGeometry, coarse: &PatchGeometry, dimension: usize) -> Self {
        let known = (0..fine.is_known.len()).filter(|&at| fine.is_known[at] && coarse.is_known[at]);
        let known: Vec<Difference> = known.map(|at| Difference::at(fine, coarse, at, dimension)).collect();
        let shares = |quantity: &dyn Fn(&Difference) -> Discrepancy| {
            let logs: Vec<Vec<f64>> = known.iter().map(|of| quantity(of).log_likelihoods()).collect();
            common(mixture_shares(EXCESSES.len(), &logs))
        };
        Self { normals: shares(&|of| of.normal), curvatures: shares(&|of| of.curvature) }
    }
}

/// Leaves out the ratios that few places have.
fn common(mut shares: Vec<f64>) -> Vec<f64> {
    shares.iter_mut().filter(|share| **share < LEAST_SHARE).for_each(|share| *share = 0.0);
    let total: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= total);
    shares
}

/// Returns the median of the squared differences of normals, each over the variance that it has without a
/// bias.
pub(super) fn median_excess(fine: &PatchGeometry, refined: &PatchGeometry, dimension: usize) -> f64 {
    let known = (0..fine.is_known.len()).filter(|&at| fine.is_known[at] && refined.is_known[at]);
    let excesses = known.map(|at| Difference::at(fine, refined, at, dimension).normal.excess);
    median(excesses.collect()).unwrap_or(0.0)
}

impl Discrepancy {
    fn of(square: f64, variances: [f64; 2], n_components: f64) -> Self {
        let [fine, coarse] = variances;
        let variance = (fine - coarse).max(LEAST_VARIANCE * fine);
        let excess = if square > 0.0 { square / variance } else { 0.0 };
        Self { excess, n_components }
    }

    fn log_likelihoods(&self) -> Vec<f64> {
        let log = |ratio: f64| -0.5 * (self.excess / (1.0 + ratio) + self.n_components * (1.0 + ratio).ln());
        EXCESSES.map(log).to_vec()
    }

    fn weight(&self, shares: &[f64]) -> Weight {
        let logs: Vec<f64> =
            self.log_likelihoods().iter().zip(shares).map(|(log, share)| log + share.ln()).collect();
        let posterior = normalized(&logs);
        let moment = |power: i32| -> f64 {
            let biased = posterior.iter().zip(EXCESSES).filter(|(_, ratio)| *ratio >= LEAST_BIAS);
            biased.map(|(p, ratio)| p * (ratio / (1.0 + ratio)).powi(power)).sum()
        };
        let mean = moment(1);
        Weight { mean, variance: (moment(2) - mean * mean).max(0.0) }
    }
}

/// Differences of two levels at one place.
struct Difference {
    /// −1 where the two normals have opposite signs.
    sign: f64,
    normal: Discrepancy,
    curvature: Discrepancy,
}

impl Difference {
    fn at(fine: &PatchGeometry, coarse: &PatchGeometry, at: usize, dimension: usize) -> Self {
        let k = dimension - 1;
        let [a, c] = [fine, coarse].map(|of| &of.normals[at * dimension..][..dimension]);
        let sign = if dot(a, c) < 0.0 { -1.0 } else { 1.0 };
        let square: f64 = a.iter().zip(c).map(|(a, c)| (a - sign * c).powi(2)).sum();
        let variances = [fine, coarse].map(|of| normal_variance(of.normal_std[at], k));
        let [mean_a, mean_c] = [fine, coarse].map(|of| mean_curvature(of, at, dimension));
        let of_means = [fine, coarse].map(|of| deviations(of).map_or(0.0, |own| own.mean[at].powi(2)));
        Self {
            sign,
            normal: Discrepancy::of(square, variances, k as f64),
            curvature: Discrepancy::of((mean_a - sign * mean_c).powi(2), of_means, 1.0),
        }
    }
}

fn deviations(of: &PatchGeometry) -> Option<&CurvatureDeviations> {
    of.curvatures.as_ref()
}

fn mean_curvature(of: &PatchGeometry, at: usize, dimension: usize) -> f64 {
    let shape = &of.shapes[at * dimension * dimension..][..dimension * dimension];
    shape.iter().step_by(dimension + 1).sum::<f64>() / (dimension - 1) as f64
}

/// A query, and the sign that turns the normal of the coarser level to the side of the finer one.
#[derive(Clone, Copy)]
struct Place {
    at: usize,
    dimension: usize,
    sign: f64,
}

impl PatchGeometry {
    /// Weighs the answers with those of a coarser level at the same queries. Queries without an answer take
    /// that of the coarser level.
    pub(super) fn refine(&mut self, coarse: &Self, agreement: &Agreement, dimension: usize) {
        for at in (0..self.is_known.len()).filter(|&at| coarse.is_known[at]) {
            let mut place = Place { at, dimension, sign: 1.0 };
            let (mut normal, mut curvature) = (Weight::default(), Weight::default());
            if self.is_known[at] {
                let found = Difference::at(self, coarse, at, dimension);
                place.sign = found.sign;
                normal = found.normal.weight(&agreement.normals);
                curvature = found.curvature.weight(&agreement.curvatures);
            } else {
                self.is_known[at] = true;
                self.is_at_rim[at] = coarse.is_at_rim[at];
            }
            self.refine_normal(coarse, place, normal);
            self.refine_curvatures(coarse, place, curvature);
        }
    }

    fn refine_normal(&mut self, coarse: &Self, Place { at, dimension: d, sign }: Place, weight: Weight) {
        let own = &mut self.normals[at * d..][..d];
        let mut square = 0.0;
        for (a, c) in own.iter_mut().zip(&coarse.normals[at * d..][..d]) {
            let c = sign * c;
            square += (*a - c).powi(2);
            *a = c + weight.mean * (*a - c);
        }
        let length = norm(own);
        own.iter_mut().for_each(|c| *c /= length);
        let apart = self.heights[at] - sign * coarse.heights[at];
        self.heights[at] = sign * coarse.heights[at] + weight.mean * apart;
        mix(&mut self.height_std[at], coarse.height_std[at], apart * apart, weight);
        mix(&mut self.normal_std[at], coarse.normal_std[at], square, weight);
    }

    fn refine_curvatures(&mut self, coarse: &Self, Place { at, dimension: d, sign }: Place, weight: Weight) {
        let k = d - 1;
        let apart = mean_curvature(self, at, d) - sign * mean_curvature(coarse, at, d);
        let own = self.shapes[at * d * d..][..d * d].iter_mut();
        for (a, c) in own.zip(&coarse.shapes[at * d * d..][..d * d]) {
            *a = sign * c + weight.mean * (*a - sign * c);
        }
        let (Some(own), Some(coarse)) = (&mut self.curvatures, &coarse.curvatures) else { return };
        let square = apart * apart;
        for i in 0..k {
            let other = if sign < 0.0 { k - 1 - i } else { i };
            mix(&mut own.principal[at * k + i], coarse.principal[at * k + other], square, weight);
        }
        mix(&mut own.mean[at], coarse.mean[at], square, weight);
        mix(&mut own.gaussian[at], coarse.gaussian[at], 0.0, weight);
        if own.radii[at] == 0.0 {
            own.radii[at] = coarse.radii[at];
        }
        if weight.mean < 0.5 {
            own.is_bent[at] = coarse.is_bent[at];
        }
    }
}

/// Mixes the deviations of a finer and a coarser level whose answers differ by the root of `square`.
fn mix(fine: &mut f64, coarse: f64, square: f64, weight: Weight) {
    let saved = (*fine * *fine - coarse * coarse).max(0.0);
    *fine = (coarse * coarse + weight.mean * saved + weight.variance * square).sqrt();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::random::Random;

    /// Curves whose normals are off (0, 1) by small angles, which have this deviation.
    fn said(angles: &[f64], deviation: f64) -> PatchGeometry {
        let n = angles.len();
        PatchGeometry {
            is_known: vec![true; n],
            normals: angles.iter().flat_map(|a| [a.sin(), a.cos()]).collect(),
            normal_std: vec![deviation; n],
            ..PatchGeometry::unknown(n, 2, false)
        }
    }

    fn refined(fine: &[f64], coarse: &[f64]) -> (PatchGeometry, Agreement) {
        let [mut fine, coarse] = [said(fine, 0.1), said(coarse, 0.02)];
        let agreement = Agreement::of(&fine, &coarse, 2);
        fine.refine(&coarse, &agreement, 2);
        (fine, agreement)
    }

    fn drawn(random: &mut Random, deviation: f64) -> Vec<f64> {
        let mut angles = vec![0.0; 2000];
        random.fill_normal(&mut angles);
        angles.iter().map(|angle| deviation * angle).collect()
    }

    /// Share of the angles that lie within 1.96 deviations, and median deviation.
    fn covered(of: &PatchGeometry) -> (f64, f64) {
        let angles = of.normals.chunks_exact(2).map(|normal| normal[0].asin().abs());
        let n_within = angles.zip(&of.normal_std).filter(|(a, bar)| *a <= 1.96 * **bar).count();
        (n_within as f64 / of.is_known.len() as f64, median(of.normal_std.clone()).unwrap())
    }

    #[test]
    fn levels_that_agree_are_as_sure_as_the_coarser() {
        let mut random = Random::of(1, 0);
        let coarse = drawn(&mut random, 0.02);
        // The coarser level makes better use of the same points, so the difference is independent of it.
        let apart = drawn(&mut random, (0.1f64.powi(2) - 0.02f64.powi(2)).sqrt());
        let fine: Vec<f64> = coarse.iter().zip(&apart).map(|(c, apart)| c + apart).collect();
        let (found, agreement) = refined(&fine, &coarse);
        assert!(agreement.normals[..3].iter().sum::<f64>() > 0.9, "{:?}", agreement.normals);
        let (share, deviation) = covered(&found);
        assert!(share > 0.9 && deviation < 0.045, "{share}, {deviation}");
    }

    #[test]
    fn variances_that_are_somewhat_off_are_no_bias() {
        let mut random = Random::of(3, 0);
        let coarse = drawn(&mut random, 0.02);
        // Fine levels are off by a tenth more than they say, beside the factor 1.07 of their deviations.
        let apart = drawn(&mut random, 1.03 * (0.1f64.powi(2) - 0.02f64.powi(2)).sqrt());
        let fine: Vec<f64> = coarse.iter().zip(&apart).map(|(c, apart)| c + apart).collect();
        let (share, deviation) = covered(&refined(&fine, &coarse).0);
        // It was 0.043 while small ratios counted as biases.
        assert!(share > 0.9 && deviation < 0.035, "{share}, {deviation}");
    }

    #[test]
    fn where_the_coarser_is_wrong_the_finer_stands() {
        let mut random = Random::of(2, 0);
        let fine = drawn(&mut random, 0.1);
        let mut coarse = drawn(&mut random, 0.02);
        // The coarser level misses a detail at every fourth place.
        coarse.iter_mut().step_by(4).for_each(|angle| *angle += 1.0);
        let (found, _) = refined(&fine, &coarse);
        let (share, _) = covered(&found);
        assert!(share > 0.9, "{share}");
        let at_details = found.normals.chunks_exact(2).step_by(4).map(|normal| normal[0].asin().abs());
        let worst = at_details.fold(0.0, f64::max);
        assert!(worst < 0.5, "{worst}");
        // The coarser level alone covers three quarters.
        assert!(covered(&said(&coarse, 0.02)).0 < 0.76);
    }

    #[test]
    fn queries_without_an_answer_take_that_of_the_coarser() {
        let coarse = said(&[0.3, -0.2], 0.02);
        let mut fine = PatchGeometry { is_known: vec![false, true], ..said(&[0.0, -0.2], 0.1) };
        let agreement =
            Agreement { normals: vec![1.0 / 9.0; N_BIASES], curvatures: vec![1.0 / 9.0; N_BIASES] };
        fine.refine(&coarse, &agreement, 2);
        assert!(fine.is_known[0] && (fine.normals[0] - 0.3f64.sin()).abs() < 1e-15);
        assert!((fine.normal_std[0] - 0.02).abs() < 1e-15);
    }
}
