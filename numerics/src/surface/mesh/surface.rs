//! Meshes of the surface that a cloud samples, by its signature function or by local regressions.

use super::closedness::{Closedness, OPEN};
use super::fields::interpolant::LevelOf;
use super::fields::local::LocalField;
use super::level_set::{LevelSet, LevelSetRequest, Quality, level_set};
use super::{Bounds, field::Field};
use crate::error::{NumericsError, Result};
use crate::function::interpolant::Interpolant;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::sums::jets::JetOrder;
use crate::surface::Surface;
use crate::surface::orientation::WindingNumbers;

/// Part of the radius of a cloud, and spacings, by which the default box exceeds that of its points.
const MARGIN_OF_RADIUS: f64 = 0.2;
const MARGIN_OF_SPACING: f64 = 4.0;

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
/// `NumericsError::OpenSurface` if they do not and `is_open` does not say so. Also the errors of
/// [`level_set`].
pub fn mesh_of_surface(
    surface: &Surface,
    options: &MeshOptions,
    observer: &dyn Observer,
) -> Result<(LevelSet, Closedness)> {
    let (cloud, sampling) = (surface.cloud(), surface.sampling());
    let mesh = |field: &dyn Field, closedness: Closedness| {
        if closedness.share < OPEN && !options.is_open {
            return Err(NumericsError::OpenSurface { closedness: closedness.share });
        }
        Ok((level_set(&request(field, cloud, sampling, options), observer)?, closedness))
    };
    match surface {
        Surface::Local(local) => {
            let (field, closedness) = LocalField::of(local, options.is_open, observer)?;
            mesh(&field, closedness)
        }
        Surface::Signature(signature) => {
            let normals = signature.normals();
            let winding = WindingNumbers::of(cloud, sampling, normals, observer)?;
            let closedness = Closedness::of(cloud, sampling, normals, winding.as_ref(), observer)?;
            let function = signature.signature();
            mesh(&LevelOf::new(function, mean_level(function, observer)?, 1.0), closedness)
        }
    }
}

/// Meshes a level of a function, where its points are.
///
/// # Errors
/// Those of [`level_set`].
pub fn mesh_of_level(field: LevelOf<'_>, options: &MeshOptions, observer: &dyn Observer) -> Result<LevelSet> {
    let cloud = field.cloud();
    let sampling = Sampling::of(cloud, observer)?;
    level_set(&request(&field, cloud, &sampling, options), observer)
}

/// The level of the surface: the mean of u over the points, which is 1 for α = 0 (errata.md, 13).
fn mean_level(function: &Interpolant, observer: &dyn Observer) -> Result<f64> {
    let cloud = function.solver.cloud();
    let values = function.at(cloud, JetOrder::Value, observer)?.values();
    Ok(values.iter().sum::<f64>() / values.len() as f64)
}

fn request<'a>(
    field: &'a dyn Field,
    cloud: &'a Cloud,
    sampling: &'a Sampling,
    options: &MeshOptions,
) -> LevelSetRequest<'a> {
    let spacing = sampling.scales().spacing;
    let step = options.step.unwrap_or(spacing);
    let margin = MARGIN_OF_RADIUS * cloud.radius() + MARGIN_OF_SPACING * step.max(spacing);
    LevelSetRequest {
        field,
        cloud,
        sampling,
        step,
        bounds: options.bounds.clone().unwrap_or_else(|| Bounds::around(cloud, margin)),
        is_open: options.is_open,
        quality: options.quality,
        max_nodes: options.max_nodes,
    }
}
