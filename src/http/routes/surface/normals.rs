//! `POST /v1/normals`: unit normals of the surface that a cloud samples.

use super::common::{GeometryWork, geometry_request, plan_geometry};
use crate::http::fields::{
    Diagnostics, Fit, Flag, GeometryAttribute, OrientationChoice, SurfaceModelChoice, SurfaceModelUsed,
    request,
};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::answers::place::shape_of_points;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::planner::Planner;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::model::Shape;
use gramian_numerics::kernel::defaults::Purpose;

request! {
    /// A cloud that samples a hypersurface, and queries at which to compute its normals.
    pub struct NormalsRequest taking hyperparameters {
        /// The points to compute at, one row of coordinates each. Default: the points of the cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The function whose level set is the surface. Default: `auto`.
        pub surface_model: Option<SurfaceModelChoice>,
        /// The direction of normals. Default: `outward`.
        pub orientation: Option<OrientationChoice>,
        /// Optional parts of the answer. Default: none.
        pub include: Option<Vec<GeometryAttribute>>,
        /// At most 192 points of the cloud, where `"solver": "local"` learns noise and shape of the surface.
        ///
        /// Default: 96 to 191 points that the solver chooses.
        #[serde(default, deserialize_with = "present_unless_empty")]
        #[schema(value_type = Option<Vec<Vec<f64>>>, max_items = 192)]
        pub sites: Option<Points>,
    }
}

answer! {
    /// Unit normals of the surface at the queries.
    pub struct NormalsResponse {
        /// The normal at each query, of length 1. Null where there is none.
        normals: Array as Vec<Option<Vec<f64>>>,
        /// |∇u| at each query for the function in `surface_models`: unit 1/length for `signature`, about 1
        /// for `offset`.
        gradient_norms: Array as Vec<f64>,
        /// The signature function at each query: 1 on the surface, usually more inside a closed one.
        levels: Array as Vec<f64>,
        /// The function whose level surface was used at each query. It is `signature` where there is no
        /// answer.
        surface_models: Vec<SurfaceModelUsed>,
        /// Standard deviation of the angle of the normal at each query, radians.
        ///
        /// 95 % of the angles lie within 1.96 standard deviations. Null where there is no answer or the
        /// deviation is not known.
        normal_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// The normals of the two sheets that meet at each query, if it is at a sharp edge. Null elsewhere.
        edge_normals: Option<Array> as Option<Vec<Option<Vec<Vec<f64>>>>>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
        /// The queries, for model/ply.
        #[schema(ignore)]
        shape: Shape,
    }
}

operation! {
/// Compute normals
///
/// Returns the unit normals ν = −∇u/|∇u| (outward) of the level surface of the signature function u, the
/// interpolant of the constant 1. The cloud needs no mesh and no neighbourhoods. Signs are checked against
/// the neighbours and repaired. Where ∇u vanishes, the nearest points and copies shifted by ±δ along their
/// normals are interpolated instead (the offset model).
pub async fn compute_normals(NormalsRequest) -> NormalsResponse;
path: "/v1/normals", tag: "geometry", answer: "Normals at the queries"
}

impl Operation for NormalsRequest {
    type Work = GeometryWork;
    const FORMATS: &[Format] = &[Format::Json, Format::Safetensors, Format::Ply];

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<GeometryWork>, Problem> {
        let fit = Fit { sites: self.sites.take(), ..self.take_fit() };
        let request = geometry_request(self.surface_model, self.orientation, false, self.include.as_deref());
        plan_geometry(planner, fit, self.queries, request, Purpose::Normals, |d| d + 3)
    }

    fn compute(work: GeometryWork, fits: &Fits, observer: &JobObserver) -> Result<NormalsResponse, Problem> {
        let surface = fits.geometry(&work.queries, &work.request, observer)?;
        let geometry = &surface.geometry;
        let (m, d) = (geometry.n_queries(), geometry.dimension());
        Ok(NormalsResponse {
            normals: surface.per_query(geometry.normals().to_vec(), &[m, d]),
            gradient_norms: Array::new(geometry.gradient_norms().to_vec(), &[m]),
            levels: Array::new(geometry.levels().to_vec(), &[m]),
            surface_models: surface.surface_models(),
            edge_normals: surface.edge_normals(),
            flags: surface.flags(),
            normal_std: surface.deviations().map(|deviations| deviations.normal),
            diagnostics: surface.diagnostics(fits),
            shape: shape_of_points(work.queries),
        })
    }
}
