//! The surface made of local regressions, with one side chosen for all of it.

mod bend;
pub mod coarse;
mod edges;
mod rows;
mod runs;
mod serving;
pub(crate) mod smoothed;
pub mod sure;
mod tree_order;

use std::sync::Arc;

use rayon::prelude::*;

use crate::error::NumericsError;
use crate::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::machine::vector::{dot, norm};
use crate::observer::{Observer, Stage};
use crate::orientation::tiles::{LabelledRegions, SignedPoints, Tile, regions_of};
use crate::orientation::{CloudWithNeighbours, Directions, OrientedNormals, SurfaceOrientation};
use crate::patches::{PatchGeometry, PatchHyperparameters, Patches};
use crate::points::cloud::Cloud;
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::sampling::Sampling;
use bend::Bend;
use coarse::outward_directions;
use smoothed::{SampledCloud, SmoothedCloud, is_noisy};
use sure::least_ratio;
use tree_order::TreeOrder;

/// Cosine between a normal and the gradient of the coarse function above which the sign of the normal is
/// known.
const SAYS_SIGN: f64 = 0.2;

/// Hyperparameters of a surface by local regressions, learned of the whole cloud.
///
/// A part of the cloud that is given them has the surface of the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceHyperparameters {
    pub regression: PatchHyperparameters,
    /// Half the diagonal of the bounding box, unit L. Surfaces that bend less than this says count as flat.
    pub radius: f64,
    /// Least ratio of a curvature to its deviation at which the curvature counts as known. Infinite if none
    /// is known.
    pub least_ratio: f64,
}

/// Source of the hyperparameters of local regressions, other than points all over the cloud.
#[derive(Debug, Clone, PartialEq)]
pub enum Learning {
    /// Neighbourhoods of sites, `[s, d]`; see [`Patches::learned_at`].
    AtSites(Arc<Cloud>),
    /// Nothing is learned.
    Known(Arc<SurfaceHyperparameters>),
}

/// Optional knowledge of a surface beside its points.
#[derive(Clone, Copy, Default)]
pub struct LocalInputs<'a> {
    /// Normals of the points, `[n, d]`, of any length but 0. They determine the outward side.
    pub normals: Option<&'a Cloud>,
    pub learning: Option<&'a Learning>,
}

/// Local regressions of a cloud with consistently oriented normals, d ≥ 2.
///
/// ```
/// use std::sync::Arc;
///
/// use gramian_numerics::observer::Unobserved;
/// use gramian_numerics::points::cloud::Cloud;
/// use gramian_numerics::points::sampling::Sampling;
/// use gramian_numerics::surface::Surface;
/// use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
/// use gramian_numerics::surface::local::{LocalInputs, LocalSurface};
///
/// // 500 points of a circle of radius 2, for which nothing is chosen: no kernel, no noise.
/// let angles = (0..500).map(|i| std::f64::consts::TAU * f64::from(i) / 500.0);
/// let points = angles.flat_map(|t| [2.0 * t.cos(), 2.0 * t.sin()]).collect();
/// let cloud = Arc::new(Cloud::new(points, 2)?);
/// let sampling = Arc::new(Sampling::of(&cloud, &Unobserved)?);
/// let given = LocalInputs { normals: None, learning: None };
/// let surface: Surface = LocalSurface::of(cloud.clone(), sampling, given, &Unobserved)?.into();
/// let geometry = Geometry::of(&surface, &cloud, &GeometryRequest::CURVATURES, &Unobserved)?;
/// assert!(geometry.curvatures(&Unobserved)?.mean.iter().all(|mean| (mean - 0.5).abs() < 1e-3));
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
pub struct LocalSurface {
    cloud: Arc<Cloud>,
    sampling: Arc<Sampling>,
    /// The points as the work goes over them. What belongs to points here is in their order.
    ordered: TreeOrder,
    patches: Patches,
    /// Geometry of the patches at the ordered points, normals outward.
    at_points: PatchGeometry,
    orientation: SurfaceOrientation,
    /// True if normals of neighbours agree so well as lines that their signs can be compared.
    is_consistent: bool,
    /// True where the evidence for the side of an ordered point is contradictory, `[n]`.
    is_ambiguous: Vec<bool>,
    radius: f64,
    /// Least ratio of a curvature to its deviation at which the curvature counts as known.
    least_ratio: f64,
}

impl LocalSurface {
    /// Regresses the surface at every point and chooses its side.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn of(
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        given: LocalInputs<'_>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        observer.enter(Stage::Evaluate);
        let ordered = TreeOrder::of(&cloud, sampling.clone())?;
        let (own, near) = (ordered.cloud.clone(), ordered.sampling.clone());
        let (patches, known) = match given.learning {
            None => (Patches::of(own, near, observer)?, None),
            Some(Learning::AtSites(sites)) => (Patches::learned_at(sites, own, near, observer)?, None),
            Some(Learning::Known(known)) => {
                (Patches::with(&known.regression, own, near, observer)?, Some(known))
            }
        };
        let mut at_points = patches.at(&ordered.cloud, &|_| true, true, observer)?;
        let d = cloud.dimension();
        let directions = match given.normals {
            Some(normals) => ordered.own_rows(normals.coordinates(), d),
            None => outward_directions(&ordered.cloud, patches.noise(), observer)?,
        };
        let sides = Sides { directions, are_given: given.normals.is_some() };
        let points = SampledCloud { cloud: &ordered.cloud, sampling: &ordered.sampling };
        let smoothed = SmoothedCloud::of_noisy(points, &at_points, patches.noise(), observer)?;
        let on = smoothed.as_ref().map_or(points, SmoothedCloud::placed);
        let oriented = orient(on, &at_points, &sides, observer)?;
        let outward = |point: usize| &oriented.normals[point * d..][..d];
        at_points.turn(|point, normal| if dot(outward(point), normal) < 0.0 { -1.0 } else { 1.0 });
        let OrientedNormals { how: orientation, is_consistent, is_ambiguous, .. } = oriented;
        let (radius, least_ratio) = match known {
            Some(known) => (known.radius, known.least_ratio),
            None => {
                let radius = if cloud.radius() > 0.0 { cloud.radius() } else { 1.0 };
                // Where the surface is flat, there is no curvature to be known to a part of its size. Unknown
                // and bent points are not sure either.
                let ratio = |point| match Bend::of(&at_points, point, d) {
                    Some(bend) if bend.is_flat() => None,
                    bend => Some(bend.and_then(|bend| bend.ratio(radius)).unwrap_or(0.0)),
                };
                let ratios: Vec<f64> = (0..cloud.n_points()).into_par_iter().filter_map(ratio).collect();
                (radius, least_ratio(&ratios))
            }
        };
        Ok(Self {
            cloud,
            sampling,
            ordered,
            patches,
            at_points,
            orientation,
            is_consistent,
            is_ambiguous,
            radius,
            least_ratio,
        })
    }

    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    pub fn orientation(&self) -> SurfaceOrientation {
        self.orientation
    }

    pub(crate) fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// The points in the order of [`LocalSurface::at_points`].
    pub(crate) fn ordered(&self) -> SampledCloud<'_> {
        SampledCloud { cloud: &self.ordered.cloud, sampling: &self.ordered.sampling }
    }

    /// Geometry at the ordered points, with outward normals.
    pub(crate) fn at_points(&self) -> &PatchGeometry {
        &self.at_points
    }

    /// Whether noise is such that only the feet of the points tell their sides.
    pub(crate) fn is_noisy(&self) -> bool {
        is_noisy(self.ordered(), &self.at_points, self.patches.noise())
    }

    /// Returns the outward normals of the points in the order in which they were given.
    pub(crate) fn oriented(&self) -> OrientedNormals {
        let d = self.cloud.dimension();
        OrientedNormals {
            normals: self.ordered.given_rows(&self.at_points.normals, d),
            how: self.orientation,
            is_consistent: self.is_consistent,
            is_ambiguous: self.ordered.given_rows(&self.is_ambiguous, 1),
        }
    }

    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// Returns the feet of the points, unless the points tell their sides as well.
    pub(crate) fn smoothed(&self, observer: &dyn Observer) -> Result<Option<SmoothedCloud>, NumericsError> {
        SmoothedCloud::of_noisy(self.ordered(), &self.at_points, self.patches.noise(), observer)
    }

    /// Returns what the regressions learned, or were given.
    pub fn hyperparameters(&self) -> SurfaceHyperparameters {
        let (radius, least_ratio) = (self.radius, self.least_ratio);
        SurfaceHyperparameters { regression: self.patches.hyperparameters(), radius, least_ratio }
    }

    /// Returns `|h|` of the heights h of the points above the surface, L.
    pub fn misfit(&self) -> f64 {
        norm(&self.at_points.heights)
    }

    /// Returns on how many of the nearest positions an answer at a point depends, at most.
    ///
    /// Regressions see 16, 30 or 50 positions in dimensions 2, 3 and 4, and sides a few more. Neighbourhoods
    /// of means reach as far as twice the points that these have. Rows of sparse operators see four times 13,
    /// 38 or 88 where the nearest lie on one side. The few rows that then look farther are not counted.
    pub fn reach(&self) -> usize {
        let (of_regressions, of_rows) = match self.cloud.dimension() {
            2 => (24, 52),
            3 => (48, 152),
            _ => (96, 352),
        };
        match self.patches.points_per_mean() {
            1 => of_rows,
            group => of_rows.max(group.saturating_mul(2 * of_regressions)),
        }
    }

    /// Finds the regions of a tile. Its directions `[n, d]` are those of the signature function at all of its
    /// points, of any length.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::LengthMismatch`], [`NumericsError::Cancelled`].
    pub fn regions(
        &self,
        tile: &Tile<'_>,
        directions: &Cloud,
        observer: &dyn Observer,
    ) -> Result<LabelledRegions, NumericsError> {
        let (n, d) = (self.cloud.n_points(), self.cloud.dimension());
        self.cloud.check_same_dimension(directions)?;
        if directions.n_points() != n {
            return Err(NumericsError::LengthMismatch { expected: n, found: directions.n_points() });
        }
        let mut normals = self.ordered.given_rows(&self.at_points.normals, d);
        let along = normals.chunks_exact_mut(d).zip(directions.points());
        let has_sign: Vec<bool> = along.map(|(normal, direction)| turn_along(normal, direction)).collect();
        let (cloud, sampling) = (&self.cloud, &self.sampling);
        regions_of(&SignedPoints { cloud, sampling, normals: &normals, has_sign: &has_sign }, tile, observer)
    }

    /// Bytes held on the heap beside the cloud and its sampling.
    pub fn n_bytes(&self) -> usize {
        self.patches.n_bytes()
            + self.ordered.n_bytes()
            + self.at_points.n_bytes()
            + vec_bytes(&self.is_ambiguous)
            + block_bytes(arc_payload::<Self>())
    }
}

/// What says the sides of points.
struct Sides {
    /// Outward directions, `[n, d]`, of any length.
    directions: Vec<f64>,
    /// True if a client gave them, false if they are of a coarse signature function.
    are_given: bool,
}

/// Orients the normals of patches, by whole regions of the points or their feet.
fn orient(
    on: SampledCloud<'_>,
    geometry: &PatchGeometry,
    sides: &Sides,
    observer: &dyn Observer,
) -> Result<OrientedNormals, NumericsError> {
    let SampledCloud { cloud, sampling } = on;
    let d = cloud.dimension();
    let mut normals = geometry.normals.clone();
    let along = normals.chunks_exact_mut(d).zip(sides.directions.chunks_exact(d));
    let has_sign = along.map(|(normal, direction)| turn_along(normal, direction)).collect();
    let count = crate::orientation::n_around(cloud);
    let around = Neighbourhoods::of(sampling.neighbours(), cloud, count, observer)?;
    let directions = Directions { normals, has_sign, is_at_rim: geometry.is_at_rim.clone() };
    let sampled = CloudWithNeighbours { cloud, sampling, around: &around, observer };
    OrientedNormals::of_directions(&sampled, directions, sides.are_given)
}

/// Turns a normal to the side of a direction. Returns whether the direction determines the side.
fn turn_along(normal: &mut [f64], direction: &[f64]) -> bool {
    let along = dot(normal, direction);
    if along < 0.0 {
        normal.iter_mut().for_each(|c| *c = -*c);
    }
    along.abs() > SAYS_SIGN * norm(direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::surface::Surface;
    use crate::surface::geometry::{Geometry, GeometryRequest};
    use crate::testing::fibonacci_sphere;

    fn geometry(cloud: Cloud) -> Geometry {
        let cloud = Arc::new(cloud);
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        let surface = Surface::from(
            LocalSurface::of(cloud.clone(), sampling, LocalInputs::default(), &Unobserved).unwrap(),
        );
        let request = GeometryRequest { has_deviations: true, ..GeometryRequest::CURVATURES };
        Geometry::of(&surface, &cloud, &request, &Unobserved).unwrap()
    }

    #[test]
    fn surfaces_that_leave_nothing_to_regress_have_answers_everywhere() {
        // On a fine sphere the closed form leaves less than rounding, on a plane nothing at all.
        let sphere = geometry(fibonacci_sphere(20_000));
        assert!(sphere.is_null().iter().all(|is_null| !is_null));
        let curvatures = sphere.curvatures(&Unobserved).unwrap();
        assert!(curvatures.principal.iter().all(|kappa| (kappa - 1.0).abs() < 1e-5));
        let grid = (0..400).flat_map(|i| [f64::from(i % 20), f64::from(i / 20), 3.0]).collect();
        let plane = geometry(Cloud::new(grid, 3).unwrap());
        assert!(plane.is_null().iter().all(|is_null| !is_null));
        assert!(plane.normals().chunks_exact(3).all(|normal| normal[2].abs() > 1.0 - 1e-12));
        assert!(plane.curvatures(&Unobserved).unwrap().principal.iter().all(|kappa| kappa.abs() < 1e-9));
    }
}
