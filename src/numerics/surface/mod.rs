//! The surface that a cloud samples: its signature function, and what its points say about it by themselves.

pub mod degeneracy;
pub mod geometry;
pub mod operators;

mod confirmation;
pub(crate) mod curvature;
mod offset;
mod orientation;
mod serving;

use std::sync::OnceLock;

use rayon::prelude::*;

use super::defaults::{Scales, median};
use super::error::NumericsError;
use super::observer::Observer;
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::numerics::machine::vector::{dot, norm, unit};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::duplicates::count_duplicates;
use crate::numerics::points::neighbours::Neighbours;
use crate::numerics::points::patch::{LocalFit, Patch, n_quadric_neighbours};
use crate::numerics::sums::jets::{JetOrder, Jets};
use degeneracy::{is_rounding, is_too_rough, turns_within_spacing};
use orientation::{Directions, consistent_signs};

/// Neighbours that define the sampling distance.
pub(crate) const SPACING_NEIGHBOURS: usize = 4;

/// Points up to which the diagonal of the inverse is computed: it costs three factorizations.
const MAX_LEFT_OUT: usize = 512;

/// Cosine between ∇u and the normal of a reliable local fit below which ∇u is not normal to the surface at all.
const OBLIQUE: f64 = 0.5;

/// Step of the difference quotient along a local normal, in spacings, for kernels without a gradient at the points.
const DIFFERENCE_STEP: f64 = 0.25;

/// A signature function with local fits and consistently oriented normals at the points, d ≥ 2.
///
/// Made once per factorization: it costs one evaluation at all points, and a quadric through the neighbours of each.
pub struct Surface {
    signature: Interpolant,
    neighbours: Neighbours,
    /// At the points; absent for kernels with a kink there.
    jets: Option<Jets>,
    spacings: Vec<f64>,
    fits: Vec<Option<LocalFit>>,
    /// Outward unit normals at the points, `[n, d]`; zero where nothing is known.
    normals: Vec<f64>,
    orientation: SurfaceOrientation,
    is_too_rough: bool,
    radius: f64,
    has_consistent_signs: bool,
    left_out_misses: OnceLock<Option<Vec<f64>>>,
}

/// How the signs of normals were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SurfaceOrientation {
    /// Points whose gradient pointed inward.
    pub n_flipped: usize,
    /// Whether part of the surface has a rim, so that outward has no meaning there.
    pub is_open: bool,
    /// Whether the signs are those of normals that came with the cloud.
    pub is_given: bool,
}

/// What the nearest positions say about a point.
struct Surroundings {
    /// Mean distance to those that define the sampling distance; 0 for one position alone.
    spacing: f64,
    nearest: Option<f64>,
    fit: Option<LocalFit>,
}

impl Surroundings {
    fn of(cloud: &Cloud, neighbours: &Neighbours, point: usize) -> Self {
        let x = cloud.point(point);
        let found = neighbours.nearest_positions(cloud, x, n_quadric_neighbours(cloud.dimension()));
        let squared_distances = found.iter().map(|found| found.squared_distance);
        let elsewhere = squared_distances.filter(|&squared| squared > 0.0).take(SPACING_NEIGHBOURS);
        let distances: Vec<f64> = elsewhere.map(f64::sqrt).collect();
        let spacing = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
        Self { spacing, nearest: distances.first().copied(), fit: LocalFit::of(cloud, x, &found) }
    }
}

impl Surface {
    /// Examines the surface of a signature function; `given` are normals of the points, `[n, d]`, of any length but 0.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    pub fn of(
        signature: Interpolant,
        given: Option<&Cloud>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let factor = &signature.factor;
        let jets = match factor.kernel().has_kink() {
            true => None,
            false => Some(signature.at(factor.cloud(), JetOrder::HessianWithMagnitudes, observer)?),
        };
        Self::with_jets(signature, jets, given, observer)
    }

    /// [`Surface::of`] with what [`Interpolant::signature_with_jets`] found at the points.
    ///
    /// # Errors
    /// Those of [`Surface::of`].
    pub fn with_jets(
        signature: Interpolant,
        jets: Option<Jets>,
        given: Option<&Cloud>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let factor = signature.factor.clone();
        let cloud = factor.cloud();
        if cloud.dimension() < 2 {
            return Err(NumericsError::DimensionTooSmall { found: cloud.dimension() });
        }
        let neighbours = Neighbours::of(cloud);
        let look_around = |point: usize| {
            observer.checkpoint()?;
            Ok(Surroundings::of(cloud, &neighbours, point))
        };
        let surroundings: Vec<Surroundings> =
            (0..cloud.n_points()).into_par_iter().map(look_around).collect::<Result<_, NumericsError>>()?;
        let nearest = median(surroundings.iter().filter_map(|found| found.nearest).collect()).unwrap_or(0.0);
        let (spacings, fits) = surroundings.into_iter().map(|found| (found.spacing, found.fit)).unzip();
        let orientation = SurfaceOrientation { n_flipped: 0, is_open: false, is_given: given.is_some() };
        let is_too_rough = is_too_rough(factor.kernel(), nearest);
        let (normals, left_out_misses) = (Vec::new(), OnceLock::new());
        let radius = if cloud.radius() > 0.0 { cloud.radius() } else { 1.0 };
        let mut this = Self {
            signature,
            neighbours,
            jets,
            spacings,
            fits,
            normals,
            orientation,
            is_too_rough,
            radius,
            has_consistent_signs: false,
            left_out_misses,
        };
        this.orient(given, observer)?;
        Ok(this)
    }

    fn orient(&mut self, given: Option<&Cloud>, observer: &dyn Observer) -> Result<(), NumericsError> {
        let factor = self.signature.factor.clone();
        let (cloud, d) = (factor.cloud(), factor.cloud().dimension());
        let mut directions = self.directions(observer)?;
        if let Some(given) = given {
            directions.normals = given.points().flat_map(unit).collect();
        }
        let found = consistent_signs(cloud, &self.neighbours, &directions);
        self.orientation.is_open = found.is_open;
        self.has_consistent_signs = found.is_resolved;
        self.normals = directions.normals;
        if given.is_none() {
            self.orientation.n_flipped = found.n_flipped;
            for (normal, sign) in self.normals.chunks_exact_mut(d).zip(&found.signs) {
                normal.iter_mut().for_each(|c| *c *= sign);
            }
        }
        // Positions alone give the better direction where the cloud is dense; the signature function has given the sign.
        for (normal, fit) in self.normals.chunks_exact_mut(d).zip(&self.fits) {
            if let Some(fit) = fit.as_ref().filter(|fit| fit.is_reliable() && given.is_none()) {
                let sign = dot(normal, &fit.normal).signum();
                normal.iter_mut().zip(&fit.normal).for_each(|(c, n)| *c = sign * n);
            }
        }
        Ok(())
    }

    /// `−∇u/|∇u|` at the points where it means something, normals of unknown sign elsewhere.
    fn directions(&self, observer: &dyn Observer) -> Result<Directions, NumericsError> {
        let cloud = self.cloud();
        let (n, d) = (cloud.n_points(), cloud.dimension());
        let slopes = match self.jets {
            Some(_) => Vec::new(),
            None => self.slopes_along_fits(observer)?,
        };
        let mut normals = vec![0.0; n * d];
        let mut has_sign = vec![false; n];
        for point in 0..n {
            let slot = &mut normals[point * d..][..d];
            let fit = self.fits[point].as_ref();
            match &self.jets {
                Some(jets) if !self.vanishes(jets, point, self.spacings[point], fit) => {
                    let gradient = jets.gradient(point);
                    let length = norm(gradient);
                    slot.iter_mut().zip(gradient).for_each(|(n, g)| *n = -g / length);
                    has_sign[point] = true;
                }
                Some(_) => slot.copy_from_slice(fit.map_or(&vec![0.0; d], |fit| &fit.normal)),
                None => {
                    let Some(fit) = fit else { continue };
                    let sign = if slopes[point] > 0.0 { -1.0 } else { 1.0 };
                    slot.iter_mut().zip(&fit.normal).for_each(|(n, f)| *n = sign * f);
                    has_sign[point] = slopes[point] != 0.0;
                }
            }
        }
        // The tip of a hairpin looks like the end of a curve; no quadric fits there.
        let is_at_rim =
            |fit: &Option<LocalFit>| fit.as_ref().is_some_and(|fit| fit.is_at_rim && fit.is_reliable());
        let is_at_rim = self.fits.iter().map(is_at_rim).collect();
        Ok(Directions { normals, has_sign, is_at_rim, spacings: self.spacings.clone() })
    }

    /// `u(x + δn) − u(x − δn)` along the normals of the local fits: the kink of the kernel at x is even and drops out.
    fn slopes_along_fits(&self, observer: &dyn Observer) -> Result<Vec<f64>, NumericsError> {
        let cloud = self.cloud();
        let at = |side: f64| -> Result<Vec<f64>, NumericsError> {
            let moved = (0..cloud.n_points()).flat_map(|point| {
                let step = side * DIFFERENCE_STEP * self.spacings[point];
                let normal = self.fits[point].as_ref().map(|fit| fit.normal.as_slice());
                (0..cloud.dimension())
                    .map(move |c| cloud.point(point)[c] + normal.map_or(0.0, |n| step * n[c]))
            });
            let moved = Cloud::new(moved.collect(), cloud.dimension())?;
            Ok(self.signature.at(&moved, JetOrder::Value, observer)?.values())
        };
        Ok(at(1.0)?.iter().zip(at(-1.0)?).map(|(a, b)| a - b).collect())
    }

    /// Whether ∇u is no normal at a query: rounding (T1), no direction at the scale of the sampling (T2), or oblique to a
    /// reliable local fit.
    pub(crate) fn vanishes(&self, jets: &Jets, query: usize, spacing: f64, fit: Option<&LocalFit>) -> bool {
        let gradient = jets.gradient(query);
        let length = norm(gradient);
        if is_rounding(&self.signature, jets, query) || turns_within_spacing(jets, query, spacing) {
            return true;
        }
        fit.filter(|fit| fit.is_reliable())
            .is_some_and(|fit| dot(gradient, &fit.normal).abs() < OBLIQUE * length)
    }

    /// Whether the points around x lie on a line, or span for another reason fewer directions than a surface has.
    pub(crate) fn is_thread(&self, x: &[f64]) -> bool {
        let count = n_quadric_neighbours(self.cloud().dimension());
        let patch = Patch::around(self.cloud(), &self.neighbours, x, count);
        patch.is_some_and(|patch| patch.points.len() == count && patch.is_thread())
    }

    /// The function u whose level surface this is.
    pub fn signature(&self) -> &Interpolant {
        &self.signature
    }

    pub fn cloud(&self) -> &Cloud {
        self.signature.factor.cloud()
    }

    pub fn orientation(&self) -> SurfaceOrientation {
        self.orientation
    }

    /// Whether second derivatives at the points see the cusp of the kernel.
    pub(crate) fn is_too_rough(&self) -> bool {
        self.is_too_rough
    }

    /// Half the diagonal of the bounding box, unit L; 1 for a single position.
    pub(crate) fn radius(&self) -> f64 {
        self.radius
    }

    /// `|λ_i/((K+αI)⁻¹)_ii|`, what u misses at each point when that is left out (Rippa 1999); for small clouds with a Cholesky
    /// factor only.
    pub(crate) fn left_out_misses(&self) -> Option<&[f64]> {
        if self.left_out_misses.get().is_none() {
            // Outside the cell, which a thread that waits for the others would otherwise hold: the job that it takes up
            // meanwhile may ask for the same. A few threads make it twice; the first one puts it in.
            let made = self.compute_left_out_misses();
            let _ = self.left_out_misses.set(made);
        }
        self.left_out_misses.get()?.as_deref()
    }

    fn compute_left_out_misses(&self) -> Option<Vec<f64>> {
        let factor = &self.signature.factor;
        // A repeated observation is predicted by its copy.
        if factor.n_points() > MAX_LEFT_OUT || count_duplicates(factor.cloud()) > 0 {
            return None;
        }
        let diagonal = factor.inverse_diagonal()?;
        Some(self.signature.solution.weights.iter().zip(diagonal).map(|(w, d)| (w / d).abs()).collect())
    }

    pub(crate) fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// Mean distance of a point to its neighbours, unit L.
    pub(crate) fn spacing(&self, point: usize) -> f64 {
        self.spacings[point]
    }

    /// The outward unit normal of a point, zero where unknown.
    pub(crate) fn normal(&self, point: usize) -> &[f64] {
        let d = self.cloud().dimension();
        &self.normals[point * d..][..d]
    }

    /// u, ∇u and D²u at the points, where they were kept.
    pub(crate) fn jets_at_points(&self) -> Option<&Jets> {
        self.jets.as_ref()
    }

    /// The local fit at a point.
    pub(crate) fn fit(&self, point: usize) -> Option<&LocalFit> {
        self.fits[point].as_ref()
    }

    /// The sign that turns ∇u at x into an outward direction: that of the points near x (a narrow kernel makes u a ridge, and −∇u
    /// points inward just inside), −1 on clouds that do not resolve their surface.
    pub(crate) fn outward_sign(&self, x: &[f64], gradient: &[f64]) -> f64 {
        if !self.has_consistent_signs && !self.orientation.is_given {
            return -1.0;
        }
        let nearest = self.neighbours.nearest(self.cloud(), x, SPACING_NEIGHBOURS);
        let along: f64 = nearest
            .iter()
            .map(|found| {
                // Near a thin sheet the point on this side of it decides.
                let weight = 1.0 / (found.squared_distance + 1e-3 * self.spacings[found.point].powi(2));
                weight * dot(self.normal(found.point), gradient)
            })
            .sum();
        if along > 0.0 { 1.0 } else { -1.0 }
    }

    /// Whether ∇u at the points near x goes the way of a direction, +1 or −1; −1, inward, where there is no ∇u.
    pub(crate) fn gradient_side(&self, x: &[f64], outward: &[f64]) -> f64 {
        let Some(jets) = &self.jets else { return -1.0 };
        let nearest = self.neighbours.nearest_positions(self.cloud(), x, SPACING_NEIGHBOURS);
        let along: f64 = nearest.iter().map(|found| dot(jets.gradient(found.point), outward)).sum();
        if along > 0.0 { 1.0 } else { -1.0 }
    }

    /// Bytes that [`Surface::of`] takes at most for n points, those of its work included.
    pub fn n_bytes_needed(n_points: usize, dimension: usize) -> usize {
        // Jets, normals and the quadric with its coefficients at every point, as small vectors that the allocator rounds up,
        // and once more while they are collected: 4.5 kB in three dimensions, as tests/it/memory.rs has measured.
        n_points.saturating_mul(1500 + 400 * dimension * dimension)
    }

    /// Flops of [`Surface::of`]: the sums at the points, and two searches and a quadric at each.
    pub fn flops_needed(n_points: usize, dimension: usize) -> f64 {
        let (n, n_columns) = (n_points as f64, (dimension * (dimension + 1) / 2) as f64);
        60.0 * n * n + 2.0 * Scales::flops_needed(n_points, dimension) + 40.0 * n * n_columns.powi(3)
    }

    /// Bytes held on the heap beside the factor.
    pub fn n_bytes(&self) -> usize {
        let n = self.cloud().n_points();
        let jets = self.jets.as_ref().map_or(0, Jets::n_bytes);
        // Their small vectors lie among short-lived ones, which leave about as much unused.
        let fits: usize = self.fits.iter().flatten().map(|fit| 2 * fit.n_bytes()).sum();
        // Asked for later, if at all.
        let left_out_misses = if n <= MAX_LEFT_OUT { block_bytes(n * size_of::<f64>()) } else { 0 };
        self.signature.solution.n_bytes()
            + self.neighbours.n_bytes()
            + jets
            + vec_bytes(&self.spacings)
            + vec_bytes(&self.fits)
            + fits
            + vec_bytes(&self.normals)
            + left_out_misses
            + block_bytes(arc_payload::<Self>())
    }
}
