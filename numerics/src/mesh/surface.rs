//! Meshes of the surface that a cloud samples, by its signature function or by local regressions.

use std::ops::Range;

use rayon::prelude::*;

use super::closedness::{Closedness, OPEN};
use super::fields::interpolant::LevelOf;
use super::fields::local::LocalField;
use super::lattice::follow::is_inside;
use super::level_set::{LevelSet, LevelSetRequest, Quality, Seeds, level_set};
use super::{Bounds, field::Field};
use crate::error::{NumericsError, Result};
use crate::machine::small::zeros;
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::orientation::WindingNumbers;
use crate::points::neighbours::Neighbour;
use crate::points::sampling::Sampling;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::sums::jets::{JetOrder, Jets};
use crate::surface::Surface;
use crate::surface::curvature::principal_curvatures;
use crate::surface::local::smoothed::SampledCloud;

/// Part of the radius of a cloud, and spacings, by which the default box exceeds that of its points.
const MARGIN_OF_RADIUS: f64 = 0.2;
const MARGIN_OF_SPACING: f64 = 4.0;

/// Share of the vertices far from all points beyond which a mesh is not that of the cloud. Holes that are
/// bridged have a few per cent, sheets through the inside of a body a fifth.
const MOST_FAR: f64 = 0.05;

/// Options of a mesh.
#[derive(Debug, Clone)]
pub struct MeshOptions {
    /// Longest edge of the lattice, L. By default the median spacing h₄ of the points.
    pub step: Option<f64>,
    /// Box that the surface is followed in. By default where the cloud is.
    pub bounds: Option<Bounds>,
    pub quality: Quality,
    /// True if the surface ends where its points end.
    pub is_open: bool,
    /// Bound on the nodes of the lattice that are evaluated.
    pub max_nodes: usize,
}

/// Meshes the surface of a cloud. Also returns how far its points enclose something.
///
/// # Errors
/// `NumericsError::OpenSurface` if they do not and `is_open` does not say so.
/// `NumericsError::UnsupportedMesh` if many vertices are far from all points. Also the errors of
/// [`level_set`].
pub fn mesh_of_surface(
    surface: &Surface,
    options: &MeshOptions,
    observer: &dyn Observer,
) -> Result<(LevelSet, Closedness)> {
    let (cloud, sampling) = (surface.cloud(), surface.sampling());
    let check = |closedness: Closedness| {
        if closedness.share < OPEN && !options.is_open {
            return Err(NumericsError::OpenSurface { closedness: closedness.share });
        }
        Ok(closedness)
    };
    let mesh = |field: &dyn Field, seeds: &Seeds<'_>| {
        let found = level_set(&SampledCloud { cloud, sampling }.request(field, seeds, options), observer)?;
        let share = found.share_far();
        if share > MOST_FAR { Err(NumericsError::UnsupportedMesh { share }) } else { Ok(found) }
    };
    match surface {
        Surface::Local(local) => {
            let (field, closedness) = LocalField::of(local, options.is_open, observer)?;
            let closedness = check(closedness)?;
            let seeds = |points: Range<usize>, _: &dyn Observer| Ok(field.feet_of_points(points));
            Ok((mesh(&field, &seeds)?, closedness))
        }
        Surface::Signature(signature) => {
            let normals = signature.normals();
            let winding = WindingNumbers::of(cloud, sampling, normals, observer)?;
            let closedness = Closedness::of(cloud, sampling, normals, winding.as_ref(), observer)?;
            let closedness = check(closedness)?;
            let function = signature.signature();
            let field = LevelOf::new(function, mean_level(function, observer)?, 1.0);
            let seeds = |points: Range<usize>, observer: &dyn Observer| feet_of(&field, points, observer);
            Ok((mesh(&field, &seeds)?, closedness))
        }
    }
}

/// Meshes a level of a function, where its points are.
///
/// It is followed from the feet of the points, and from between points on different sides of it. So every
/// part that separates points is found.
///
/// # Errors
/// Those of [`level_set`].
pub fn mesh_of_level(field: LevelOf<'_>, options: &MeshOptions, observer: &dyn Observer) -> Result<LevelSet> {
    let cloud = field.cloud();
    let sampling = Sampling::of(cloud, observer)?;
    let sampled = SampledCloud { cloud, sampling: &sampling };
    let values = field.values(cloud.coordinates(), observer)?;
    let step = sampled.step(options);
    let seeds = |points: Range<usize>, observer: &dyn Observer| {
        let mut places = feet_of(&field, points.clone(), observer)?;
        places.extend(sampled.places_between(points, &values, step));
        Ok(places)
    };
    level_set(&sampled.request(&field, &seeds, options), observer)
}

/// The feet of some points of the cloud of a level, `[m, d]`.
fn feet_of(field: &LevelOf<'_>, points: Range<usize>, observer: &dyn Observer) -> Result<Vec<f64>> {
    let (cloud, d) = (field.cloud(), field.dimension());
    Ok(field.feet(&cloud.coordinates()[points.start * d..points.end * d], observer)?.positions)
}

/// Nearest points of a point that the level may separate it from.
const N_NEAREST: usize = 9;

/// Most steps between two points.
const MAX_BETWEEN: f64 = 32.0;

/// Most bytes of the seeds of a point of a level: its foot, and the places between it and its nearest points.
pub(super) const fn seed_bytes(dimension: usize) -> usize {
    (N_NEAREST * (MAX_BETWEEN as usize + 1) + 1) * dimension * size_of::<f64>()
}

impl<'a> SampledCloud<'a> {
    fn step(self, options: &MeshOptions) -> f64 {
        options.step.unwrap_or(self.sampling.scales().spacing)
    }

    /// Places half a step apart on the way from each point inside, of these, to those outside among its
    /// nearest. `values` are those of all points.
    fn places_between(self, points: Range<usize>, values: &[f64], step: f64) -> Vec<f64> {
        let Self { cloud, sampling } = self;
        let from_point = |found: &mut Vec<Neighbour>, point: usize| {
            let x = cloud.point(point);
            sampling.neighbours().nearest_positions_into(x, N_NEAREST, found);
            let mut places = Vec::new();
            for near in found.iter().filter(|near| !is_inside(values[near.point])) {
                let n_parts = (near.squared_distance.sqrt() / (0.5 * step)).ceil().clamp(1.0, MAX_BETWEEN);
                for part in 0..=n_parts as usize {
                    let t = part as f64 / n_parts;
                    places.extend(x.iter().zip(cloud.point(near.point)).map(|(x, y)| x + t * (y - x)));
                }
            }
            places
        };
        let inside = points.into_par_iter().filter(|&point| is_inside(values[point]));
        inside.map_init(Vec::new, from_point).flatten_iter().collect()
    }

    fn request(
        self,
        field: &'a dyn Field,
        seeds: &'a Seeds<'a>,
        options: &MeshOptions,
    ) -> LevelSetRequest<'a> {
        let Self { cloud, sampling } = self;
        let step = self.step(options);
        let margin =
            MARGIN_OF_RADIUS * cloud.radius() + MARGIN_OF_SPACING * step.max(sampling.scales().spacing);
        LevelSetRequest {
            field,
            sampling,
            seeds,
            step,
            bounds: options.bounds.clone().unwrap_or_else(|| Bounds::around(cloud, margin)),
            is_open: options.is_open,
            quality: options.quality,
            max_nodes: options.max_nodes,
        }
    }
}

/// Computes the principal curvatures `[k, d−1]` and the mean curvatures `[k]` of level surfaces, 1/L,
/// from jets with Hessians. They are 0 where u has no gradient.
///
/// `sign` is −1 for normals along which u falls, as those of a mesh, and +1 for the gradient's direction.
pub fn curvatures_of_level(jets: &Jets, sign: f64) -> (Vec<f64>, Vec<f64>) {
    let d = jets.dimension();
    let (mut principal, mut mean) = (Vec::new(), Vec::new());
    for vertex in 0..jets.n_queries() {
        let (gradient, hessian) = (jets.gradient(vertex), jets.hessian(vertex));
        let of_vertex = if norm(gradient) > 0.0 {
            principal_curvatures(gradient, &hessian, sign).0
        } else {
            zeros(d - 1)
        };
        mean.push(of_vertex.iter().sum::<f64>() / (d - 1) as f64);
        principal.extend(of_vertex);
    }
    (principal, mean)
}

/// The level of the surface: the mean of u over the points, which is 1 for α = 0 (errata.md, 13).
fn mean_level(function: &Interpolant, observer: &dyn Observer) -> Result<f64> {
    let cloud = function.solver.cloud();
    let values = function.at(cloud, JetOrder::Value, observer)?.values();
    Ok(values.iter().sum::<f64>() / values.len() as f64)
}
