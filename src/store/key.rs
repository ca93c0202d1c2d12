//! Keys of clouds, factorizations and values: hashes of canonical bytes.

use std::fmt;

use gramian_host::memory::Owner;
use gramian_host::wire::digest::update_with_floats;
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::model::Recipe;
use gramian_numerics::patches::{NoiseRatio, PatchKernel};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::duplicates::RowCopy;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::local::{Learning, SurfaceHyperparameters};

/// Id of a cloud: a BLAKE3 hash, written as 64 hexadecimal digits.
///
/// The hash covers d and n as u64 little-endian, then the points row major as f64 little-endian (−0.0 as
/// 0.0). Normals follow in the same form, if given.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CloudId([u8; 32]);

impl CloudId {
    /// Computes the id of a cloud. Normals, if any, are `[n, d]`.
    pub fn of(cloud: &Cloud, normals: Option<&Cloud>) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(cloud.dimension() as u64).to_le_bytes());
        hasher.update(&(cloud.n_points() as u64).to_le_bytes());
        update_with_floats(&mut hasher, cloud.coordinates());
        if let Some(normals) = normals {
            update_with_floats(&mut hasher, normals.coordinates());
        }
        Self(hasher.finalize().into())
    }

    /// Parses 64 lower-case hexadecimal digits.
    pub fn parse(text: &str) -> Option<Self> {
        let is_digit = |c: u8| matches!(c, b'0'..=b'9' | b'a'..=b'f');
        if text.len() != 64 || !text.bytes().all(is_digit) {
            return None;
        }
        blake3::Hash::from_hex(text).ok().map(|hash| Self(hash.into()))
    }
}

impl fmt::Display for CloudId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&blake3::Hash::from(self.0).to_hex())
    }
}

impl fmt::Debug for CloudId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Key of a factorization. It covers everything that the factorization depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FitKey {
    pub owner: Owner,
    pub cloud_id: CloudId,
    /// BLAKE3 hash of kernel, regularization, solver and whether duplicates were merged.
    fit: [u8; 32],
    /// Bits of the tolerance, if the solver iterates.
    tolerance: Option<u64>,
}

/// Points that are merged before a fit.
#[derive(Clone, Copy)]
pub enum Merging<'a> {
    Nothing,
    /// All that coincide.
    Duplicates,
    /// Rows that repeat earlier ones.
    Copies(&'a [RowCopy]),
}

impl FitKey {
    /// Returns the key without owner and cloud, as 64 hexadecimal digits.
    pub fn fit_name(&self) -> String {
        blake3::Hash::from(self.fit).to_string()
    }

    /// Computes the key of the model that a recipe makes of a cloud, with points merged or not.
    pub fn of(owner: Owner, cloud_id: CloudId, recipe: &Recipe, merging: Merging<'_>) -> Self {
        let mut hasher = blake3::Hasher::new();
        match recipe.solver() {
            SolverKind::Dense => {}
            SolverKind::Landmark => {
                hasher.update(b"landmark");
            }
            SolverKind::Iterative => {
                hasher.update(b"iterative");
            }
            SolverKind::Local => {
                hasher.update(b"local");
            }
        }
        if let Some((kernel, regularization)) = recipe.process() {
            update_with_merging(&mut hasher, merging);
            update_with_kernel(&mut hasher, kernel);
            update_with_regularization(&mut hasher, regularization);
        }
        match recipe.learning() {
            None => {}
            Some(Learning::AtSites(sites)) => update_with_floats(&mut hasher, sites.coordinates()),
            Some(Learning::Known(known)) => update_with_hyperparameters(&mut hasher, known),
        }
        let tolerance = recipe.tolerance().map(f64::to_bits);
        Self { owner, cloud_id, fit: hasher.finalize().into(), tolerance }
    }

    /// Returns whether both are of one system, which is iterated to one tolerance or another.
    pub fn is_iterated_like(&self, other: &Self) -> bool {
        self.tolerance.is_some() && Self { tolerance: other.tolerance, ..*self } == *other
    }
}

fn update_with_merging(hasher: &mut blake3::Hasher, merging: Merging<'_>) {
    match merging {
        Merging::Nothing => {
            hasher.update(&[0]);
        }
        Merging::Duplicates => {
            hasher.update(&[1]);
        }
        Merging::Copies(copies) => {
            hasher.update(&[2]);
            let numbers = copies.iter().flat_map(|copy| [copy.row, copy.of]);
            [2 * copies.len()].into_iter().chain(numbers).for_each(|number| {
                hasher.update(&(number as u64).to_le_bytes());
            });
        }
    }
}

/// BLAKE3 hash of the values of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ValuesKey([u8; 32]);

impl ValuesKey {
    pub fn of(values: &[f64]) -> Self {
        Self::with_mean(values, Mean::Zero)
    }

    /// Computes the key of values that are fitted by a function with a mean.
    pub fn with_mean(values: &[f64], mean: Mean) -> Self {
        let mut hasher = blake3::Hasher::new();
        update_with_floats(&mut hasher, values);
        match mean {
            Mean::Zero => {}
            Mean::Constant => {
                hasher.update(b"constant");
            }
            Mean::Linear => {
                hasher.update(b"linear");
            }
        }
        Self(hasher.finalize().into())
    }

    /// Extends the key by the given kernel and noise, on which the results of learning from the values
    /// depend.
    pub fn given(self, kernel: Option<GivenKernel<'_>>, regularization: Option<&Regularization>) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.0);
        match kernel {
            None => {}
            Some(GivenKernel::OfCloud(family, variance)) => {
                let (family, parameter) = family.canonical();
                hasher.update(&[1, family]);
                update_with_floats(&mut hasher, &[parameter, variance]);
            }
            Some(GivenKernel::Whole(kernel)) => {
                hasher.update(&[3]);
                update_with_kernel(&mut hasher, kernel);
            }
        }
        if let Some(regularization) = regularization {
            hasher.update(&[2]);
            update_with_regularization(&mut hasher, regularization);
        }
        Self(hasher.finalize().into())
    }
}

/// Part of a kernel that a request gives.
#[derive(Debug, Clone, Copy)]
pub enum GivenKernel<'a> {
    Whole(&'a Kernel),
    /// Family and variance. The length scale follows from the cloud, so it is always the same.
    OfCloud(Family, f64),
}

/// Returns a key of a kernel with its noise.
pub fn process_key(kernel: &Kernel, regularization: &Regularization) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    update_with_kernel(&mut hasher, kernel);
    update_with_regularization(&mut hasher, regularization);
    hasher.finalize().into()
}

fn update_with_kernel(hasher: &mut blake3::Hasher, kernel: &Kernel) {
    let (family, parameter) = kernel.family().canonical();
    hasher.update(&[family]);
    update_with_floats(hasher, &[parameter, kernel.length_scale(), kernel.variance()]);
    if let Some(length_scales) = kernel.length_scales() {
        hasher.update(&[length_scales.len() as u8]);
        update_with_floats(hasher, length_scales);
    }
}

fn update_with_regularization(hasher: &mut blake3::Hasher, regularization: &Regularization) {
    match regularization {
        Regularization::Uniform(alpha) => {
            hasher.update(&[0]);
            update_with_floats(hasher, &[*alpha]);
        }
        Regularization::PerPoint(variances) => {
            hasher.update(&[1]);
            update_with_floats(hasher, variances);
        }
    }
}

fn update_with_hyperparameters(hasher: &mut blake3::Hasher, known: &SurfaceHyperparameters) {
    let SurfaceHyperparameters { regression, radius, least_ratio } = known;
    let PatchKernel { length_scale, variance } = regression.kernel;
    update_with_floats(
        hasher,
        &[regression.noise, regression.bend_noise, length_scale, variance, *radius, *least_ratio],
    );
    let mixtures = [
        &regression.noise_ratios,
        &regression.rough_noise_ratios,
        &regression.flat_noise_ratios,
        &regression.quartic_noise_ratios,
    ];
    mixtures.into_iter().for_each(|mixture| update_with_mixture(hasher, mixture));
    hasher.update(&[regression.coarser.len() as u8]);
    for level in &regression.coarser {
        hasher.update(&level.points_per_mean.to_le_bytes());
        update_with_mixture(hasher, &level.noise_ratios);
        update_with_mixture(hasher, &level.flat_noise_ratios);
        update_with_floats(hasher, &level.agreement.normals);
        update_with_floats(hasher, &level.agreement.curvatures);
    }
}

fn update_with_mixture(hasher: &mut blake3::Hasher, mixture: &[NoiseRatio]) {
    hasher.update(&[mixture.len() as u8]);
    mixture.iter().for_each(|of| update_with_floats(hasher, &[of.ratio, of.log_share]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cloud_id_is_the_hash_of_the_documented_bytes() {
        let cloud = Cloud::new(vec![-0.0, 1.0, 2.0, 3.5], 2).unwrap();
        let mut bytes = Vec::new();
        bytes.extend(2u64.to_le_bytes());
        bytes.extend(2u64.to_le_bytes());
        for x in [0.0f64, 1.0, 2.0, 3.5] {
            bytes.extend(x.to_le_bytes());
        }
        let id = CloudId::of(&cloud, None);
        assert_eq!(id.to_string(), blake3::hash(&bytes).to_hex().to_string());
        assert_eq!(CloudId::parse(&id.to_string()), Some(id));
        assert_eq!(CloudId::parse(&id.to_string().to_uppercase()), None);
        assert_ne!(CloudId::of(&cloud, Some(&cloud)), id);
    }

    #[test]
    fn every_ingredient_of_a_fit_changes_its_key() {
        let cloud = Cloud::new(vec![0.0, 1.0], 1).unwrap();
        let id = CloudId::of(&cloud, None);
        let kernel = |family, length_scale, variance| Kernel::new(family, length_scale, variance).unwrap();
        let alpha = Regularization::Uniform;
        let recipe = |solver, kernel: &Kernel, regularization: &Regularization| {
            Recipe::of_values(solver, kernel.clone(), regularization.clone())
        };
        let of = |owner, kernel: &Kernel, regularization: &Regularization, merging| {
            let recipe = recipe(SolverKind::Dense, kernel, regularization);
            FitKey::of(Owner(owner), id, &recipe, merging)
        };
        let of_local = |recipe| FitKey::of(Owner(0), id, &recipe, Merging::Nothing);
        let gauss = kernel(Family::Gauss, 1.0, 1.0);
        let keys = [
            of(0, &gauss, &alpha(0.0), Merging::Nothing),
            of(1, &gauss, &alpha(0.0), Merging::Nothing),
            of(0, &gauss, &alpha(0.0), Merging::Duplicates),
            of(0, &gauss, &alpha(0.0), Merging::Copies(&[RowCopy { row: 1, of: 0 }])),
            of(0, &gauss, &alpha(0.0), Merging::Copies(&[RowCopy { row: 2, of: 0 }])),
            of(0, &gauss, &alpha(1e-3), Merging::Nothing),
            of(0, &gauss, &Regularization::PerPoint(vec![0.0, 0.0]), Merging::Nothing),
            of(0, &kernel(Family::Gauss, 2.0, 1.0), &alpha(0.0), Merging::Nothing),
            of(0, &kernel(Family::Gauss, 1.0, 2.0), &alpha(0.0), Merging::Nothing),
            of(0, &Kernel::of_axes(Family::Gauss, &[1.0], 1.0).unwrap(), &alpha(0.0), Merging::Nothing),
            of(0, &Kernel::of_axes(Family::Gauss, &[1.0, 2.0], 1.0).unwrap(), &alpha(0.0), Merging::Nothing),
            of(0, &kernel(Family::InverseMultiquadric, 1.0, 1.0), &alpha(0.0), Merging::Nothing),
            of(0, &kernel(Family::Laplace { epsilon: 0.0 }, 1.0, 1.0), &alpha(0.0), Merging::Nothing),
            of(0, &kernel(Family::Laplace { epsilon: 1.0 }, 1.0, 1.0), &alpha(0.0), Merging::Nothing),
            of_local(recipe(SolverKind::Local, &gauss, &alpha(0.0))),
            of_local(recipe(SolverKind::Landmark, &gauss, &alpha(0.0))),
            of_local(recipe(SolverKind::Iterative, &gauss, &alpha(0.0))),
            of_local(recipe(SolverKind::Iterative, &gauss, &alpha(0.0)).with_tolerance(1e-6)),
            of_local(Recipe::LocalSurface { learning: None }),
            of_local(Recipe::LocalSurface { learning: Some(Learning::AtSites(cloud.clone().into())) }),
        ];
        let iterated = |tolerance: f64, alpha: f64| {
            of_local(
                recipe(SolverKind::Iterative, &gauss, &Regularization::Uniform(alpha))
                    .with_tolerance(tolerance),
            )
        };
        assert!(iterated(1e-6, 0.0).is_iterated_like(&iterated(1e-9, 0.0)));
        assert!(!iterated(1e-6, 0.0).is_iterated_like(&iterated(1e-6, 1.0)));
        assert!(!keys[0].is_iterated_like(&keys[0]));
        let distinct: std::collections::HashSet<_> = keys.iter().collect();
        assert_eq!(distinct.len(), keys.len());
    }
}
