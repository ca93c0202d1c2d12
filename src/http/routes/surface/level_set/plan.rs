//! Checks and prices of requests for meshes.

use std::sync::Arc;

use super::{LevelSetRequest, MeshAttribute, MeshBounds, MeshQuality};
use crate::http::fields::Fit;
use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use crate::http::routes::surface::common::{check_is_surface, geometry_request};
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::{Cost, FittedCloud, Values};
use crate::http::serve::planner::{GivenValues, Planner, RestrictedQuantity};
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::machine::price::{Price, Sizes};
use gramian_numerics::mesh::price::{MeshSize, Within};
use gramian_numerics::mesh::surface::MeshOptions;
use gramian_numerics::mesh::{Bounds, Quality};
use gramian_numerics::model::price::{function_price, geometry_price, level_set_price};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::geometry::{GeometryRequest, SurfaceModel};
use gramian_numerics::surface::price::{AskedOfSurface, Offsets};

/// A checked request for a mesh.
pub struct LevelSetWork {
    pub of: Subject,
    pub options: MeshOptions,
    pub asked: AskedOfVertices,
}

/// The function whose level is meshed.
pub enum Subject {
    Surface,
    Level(LevelOfValues),
}

/// A level of the function through values.
pub struct LevelOfValues {
    pub values: Arc<Values>,
    /// The median of the values if absent.
    pub level: Option<f64>,
}

/// What a request asks about the vertices of its mesh.
#[derive(Clone, Copy)]
pub struct AskedOfVertices {
    pub geometry: GeometryRequest,
    pub has_curvatures: bool,
}

impl AskedOfVertices {
    /// Numbers of the answer for each vertex, with those of its cells.
    fn n_numbers(self, d: usize) -> usize {
        let n_deviations = if self.geometry.has_deviations { 2 + d } else { 0 };
        let n_curvatures = if self.has_curvatures { d } else { 0 };
        4 * d + 2 + n_deviations + n_curvatures
    }
}

impl LevelSetRequest {
    /// Plans a mesh of the surface of a cloud.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn plan_surface(mut self, planner: &Planner<'_>) -> Result<Plan<LevelSetWork>, Problem> {
        let needs_values = [("/level", self.level.is_some()), ("/mean", self.mean.is_some())];
        if let Some((pointer, _)) = needs_values.into_iter().find(|(_, is_given)| *is_given) {
            return Err(Problem::invalid_request(
                pointer,
                "needs values: the surface of a cloud has neither level nor mean",
            ));
        }
        let asked = self.asked();
        if asked.geometry.model == SurfaceModel::Offset {
            let detail = "the offset model has another function at each query, and so no level set; leave surface_model out";
            return Err(Problem::invalid_request("/surface_model", detail));
        }
        let main = planner.surface_fit(self.take_fit(), Purpose::LevelSets, &asked.geometry)?;
        let size = self.checked_size(&main.on, false)?;
        let sizes = vertices_of(size);
        let of_vertices = if asked.has_curvatures || asked.geometry.has_deviations {
            let of_surface = AskedOfSurface {
                offsets: if asked.has_curvatures { Offsets::Confirmations } else { Offsets::Rescues },
                has_own_quadrics: asked.has_curvatures,
                has_deviations: asked.geometry.has_deviations,
            };
            geometry_price(main.solver(), of_surface, sizes)
        } else {
            Price::default()
        };
        let cost = Cost {
            work: level_set_price(main.solver(), size).and(of_vertices),
            n_numbers: planner.check_answer(sizes.n_queries.checked_mul(asked.n_numbers(size.dimension)))?,
            n_held: 0,
        };
        let work = LevelSetWork { of: Subject::Surface, options: self.options(size), asked };
        Ok(Plan::of_surface(main, work, cost))
    }

    /// Plans a mesh of a level of the function through values.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn plan_values(
        mut self,
        planner: &Planner<'_>,
        values: Vec<f64>,
    ) -> Result<Plan<LevelSetWork>, Problem> {
        let asked = self.asked();
        let restricted = RestrictedQuantity {
            name: "level sets of values",
            pointer: "/values",
            without: &[SolverKind::Local],
        };
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let (main, values) = planner.values_fit(fit, GivenValues::one(values), Some(restricted))?;
        let size = self.checked_size(&main.on, true)?;
        let sizes = vertices_of(size);
        let order = if asked.has_curvatures { 2 } else { 1 };
        let n_deviations = usize::from(asked.geometry.has_deviations);
        let of_vertices = function_price(main.solver, order, n_deviations, sizes);
        let cost = Cost {
            work: level_set_price(SolverKind::Dense, size).and(of_vertices),
            n_numbers: planner.check_answer(sizes.n_queries.checked_mul(asked.n_numbers(size.dimension)))?,
            n_held: main.on.n_points(),
        };
        let of = Subject::Level(LevelOfValues { values, level: self.level });
        let work = LevelSetWork { of, options: self.options(size), asked };
        Ok(Plan::of_values(main, work, cost))
    }

    fn asked(&mut self) -> AskedOfVertices {
        let include = self.include.take().unwrap_or_default();
        let has_curvatures = include.contains(&MeshAttribute::Curvatures);
        let has_deviations = include.contains(&MeshAttribute::Std);
        let geometry = geometry_request(self.surface_model, self.orientation, has_curvatures, None);
        let mut geometry = GeometryRequest { has_deviations, ..geometry };
        if self.open == Some(true) && geometry.model == SurfaceModel::Auto {
            // The level of a signature function goes around the end of a surface.
            geometry.model = SurfaceModel::Regression;
        }
        AskedOfVertices { geometry, has_curvatures }
    }

    /// Checks that there are meshes over a cloud, and how large one is expected to be. `is_of_values` says
    /// that it is a level of values.
    fn checked_size(&self, on: &FittedCloud, is_of_values: bool) -> Result<MeshSize, Problem> {
        let cloud = &on.stored.cloud;
        check_is_meshable(cloud)?;
        if self.step.is_some_and(|step| step <= 0.0) {
            return Err(Problem::invalid_request("/step", "step must be more than 0"));
        }
        let spacing = expected_spacing(on);
        let step = self.step.unwrap_or(spacing);
        let bounds =
            self.bounds.as_ref().map(|bounds| checked_bounds(bounds, cloud.dimension())).transpose()?;
        Ok(MeshSize {
            n_points: on.n_points(),
            dimension: cloud.dimension(),
            step: step / spacing,
            within: bounds.map(|bounds| Within::of(&bounds, cloud, step, is_of_values)),
            quality: match self.quality.unwrap_or_default() {
                MeshQuality::Regular => Quality::Regular,
                MeshQuality::Raw => Quality::Raw,
            },
        })
    }

    /// Options of a mesh whose size was checked.
    fn options(self, size: MeshSize) -> MeshOptions {
        MeshOptions {
            step: self.step,
            bounds: self.bounds.map(|MeshBounds { min, max }| Bounds { min, max }),
            quality: size.quality,
            is_open: self.open.unwrap_or(false),
            max_nodes: size.max_nodes(),
        }
    }
}

/// The vertices of a mesh as queries.
fn vertices_of(size: MeshSize) -> Sizes {
    Sizes { n_points: size.n_points, n_queries: size.n_vertices(), dimension: size.dimension }
}

/// The median spacing of the points, or where it is not known yet, what it would be on a sphere.
fn expected_spacing(on: &FittedCloud) -> f64 {
    match on.stored.scales() {
        Some(scales) => scales.spacing,
        None => {
            let cloud = &on.stored.cloud;
            let (n, d) = (on.n_points() as f64, cloud.dimension());
            let radius = if cloud.radius() > 0.0 { cloud.radius() } else { 1.0 };
            2.0 * radius / n.powf(1.0 / (d - 1) as f64)
        }
    }
}

/// Refuses dimensions without meshes before anything is computed.
fn check_is_meshable(cloud: &Cloud) -> Result<(), Problem> {
    check_is_surface(cloud)?;
    if cloud.dimension() <= 3 {
        return Ok(());
    }
    let detail = format!("level sets are meshed in dimensions 2 and 3, the cloud has {}", cloud.dimension());
    Err(Problem::of_field(catalogue::INVALID_CLOUD, "/cloud/points", detail))
}

fn checked_bounds(bounds: &MeshBounds, dimension: usize) -> Result<Bounds, Problem> {
    let MeshBounds { min, max } = bounds;
    for (list, pointer) in [(min, "/bounds/min"), (max, "/bounds/max")] {
        if list.len() != dimension {
            let detail = format!("expected {dimension} coordinates, found {}", list.len());
            return Err(Problem::of_field(catalogue::DIMENSION_MISMATCH, pointer, detail));
        }
    }
    match min.iter().zip(max).position(|(min, max)| min >= max) {
        None => Ok(Bounds { min: min.clone(), max: max.clone() }),
        Some(axis) => {
            let detail = "must be greater than the coordinate of min";
            Err(Problem::invalid_request(format!("/bounds/max/{axis}"), detail))
        }
    }
}
