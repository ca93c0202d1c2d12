//! `POST /v1/estimate`: the cost of a request of another operation.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use serde::{Deserialize, Serialize};
use utoipa::openapi::schema::{AdditionalProperties, RefBuilder, Schema, SchemaType, Type};
use utoipa::openapi::{ObjectBuilder, RefOr};
use utoipa::{PartialSchema, ToSchema};

use super::surface::curvatures::CurvaturesRequest;
use super::surface::laplace_beltrami::{
    LaplaceBeltramiMatrixRequest, LaplaceBeltramiRequest, LaplaceBeltramiSparseMatrixRequest,
};
use super::surface::level_set::LevelSetRequest;
use super::surface::normals::NormalsRequest;
use super::surface::surface_gradient::{
    SurfaceGradientMatrixRequest, SurfaceGradientRequest, SurfaceGradientSparseMatrixRequest,
};
use super::tiles::regions::RegionsRequest;
use super::values::interpolation::{InterpolationBatchRequest, InterpolationRequest};
use super::values::model_selection::ModelSelectionRequest;
use super::values::posterior::{PosteriorBatchRequest, PosteriorRequest};
use crate::http::compute::{Admission, JobObserver};
use crate::http::fields::SolverUsed;
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::routes::clouds::CloudRequest;
use crate::http::serve::intake::{ReceivedBody, read_body};
use crate::http::serve::operation::{self, Declared, REQUEST_FORMATS};
use crate::http::state::app::App;
use crate::http::wire::read::body::UnpackedBody;
use crate::http::wire::read::limits::ParseContext;
use crate::http::wire::write::json::Json;
use crate::store::Owner;

/// A request of another operation, with the name of that operation as a further member.
pub struct EstimateRequest;

impl PartialSchema for EstimateRequest {
    fn schema() -> RefOr<Schema> {
        let operation = RefBuilder::new()
            .ref_location_from_schema_name("OperationName")
            .description(Some("The operation whose request this is."));
        let request = ObjectBuilder::new()
            .description(Some(
                "The members of a request of this operation, and `operation` beside them: see the schema of that request.",
            ))
            .property("operation", operation)
            .required("operation")
            .additional_properties(Some(AdditionalProperties::FreeForm(true)));
        request.into()
    }
}

impl ToSchema for EstimateRequest {
    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((OperationName::name().into_owned(), OperationName::schema()));
    }
}

/// The schema of the name of an operation.
struct OperationName;

impl PartialSchema for OperationName {
    fn schema() -> RefOr<Schema> {
        let text = "An operation that computes, by its `operationId`.";
        let names = ObjectBuilder::new().schema_type(SchemaType::Type(Type::String));
        names.enum_values(Some(NAMES.iter().copied())).description(Some(text)).into()
    }
}

impl ToSchema for OperationName {}

/// The expected cost of a request.
#[derive(Serialize, ToSchema)]
pub struct EstimateResponse {
    /// The operation, repeated.
    operation: &'static str,
    /// The solver that would be used.
    solver: SolverUsed,
    /// Number of floating-point operations, counted beforehand.
    #[schema(minimum = 0.0)]
    flops: f64,
    /// Memory that the request would need beside what is held already, bytes.
    bytes: u64,
    /// Expected seconds from the request's turn in the queue to its answer.
    ///
    /// They are learned from what ran on this machine since the server started.
    #[schema(minimum = 0.0)]
    seconds: f64,
    /// True if all factorizations that the request needs are there.
    cached: bool,
    /// True if memory and time suffice for the request when nothing else runs.
    admissible: bool,
}

/// Estimate a request
///
/// Returns the cost of another request before it is sent. The body is that of the other request, with
/// `operation` as a further member. Nothing is factorized. Points in the body are registered and their
/// neighbours are searched, as the request itself would do. A request that would be refused is refused here
/// with the same problem. Times are learned from what ran on this machine.
#[utoipa::path(
    post,
    path = "/v1/estimate",
    tag = "process",
    request_body = EstimateRequest,
    responses((status = 200, description = "The estimate", body = EstimateResponse), ComputeProblems)
)]
pub async fn estimate(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Json<EstimateResponse>, Problem> {
    let (parts, body) = request.into_parts();
    let intake = read_body(&app, owner, &parts.headers, body, &REQUEST_FORMATS).await?;
    let admission = app.compute.admit(owner)?;
    let (shared, flops) = (app.clone(), intake.body.flops_to_parse());
    let named = move |observer: &JobObserver| name_of(intake, &shared, observer);
    let (operation, intake) = app.compute.run(&admission, flops, named).await?.0?;
    estimate_of(&operation, &app, &admission, intake).await
}

/// A request of any operation, whose members are skipped.
#[derive(Deserialize)]
struct AnyRequest {}

/// Returns the name of the operation, and the body to be read again as a request of that operation.
fn name_of(
    intake: ReceivedBody,
    app: &App,
    observer: &JobObserver,
) -> Result<(String, ReceivedBody), Problem> {
    let (body, memory) = intake.unpack(app, observer)?;
    let named = body.parse_with_operation::<AnyRequest>(&ParseContext::new(&app.config, observer))?;
    let missing = || Problem::invalid_request("/operation", "name the operation whose request this is");
    let operation = named.operation.ok_or_else(missing)?;
    Ok((operation, ReceivedBody { body: body.into_request(app.memory.body), memory }))
}

macro_rules! operations {
    ($($request:ty),* $(,)?) => {
        /// Names of all operations that can be estimated.
        pub const NAMES: &[&str] = &[$(<$request as Declared>::NAME),*];

        async fn estimate_of(
            operation: &str,
            app: &Arc<App>,
            admission: &Arc<Admission>,
            intake: ReceivedBody,
        ) -> Result<Json<EstimateResponse>, Problem> {
            $(if operation == <$request as Declared>::NAME {
                let estimate = operation::estimate::<$request>(app, admission, intake).await?;
                return Ok(EstimateResponse::of(<$request as Declared>::NAME, estimate));
            })*
            let detail = format!("no operation of this name can be estimated; there are {}", NAMES.join(", "));
            Err(Problem::invalid_request("/operation", detail))
        }

        /// Parses a body as a request of an operation, and drops the request. Any name outside [`NAMES`]
        /// means the registration of a cloud.
        ///
        /// # Errors
        /// Returns the problem that the request would be refused with.
        pub fn read_as(operation: &str, body: &UnpackedBody, context: &ParseContext<'_>) -> Result<(), Problem> {
            $(if operation == <$request as Declared>::NAME {
                return body.parse::<$request>(context).map(drop);
            })*
            body.parse::<CloudRequest>(context).map(drop)
        }
    };
}

operations!(
    InterpolationRequest,
    InterpolationBatchRequest,
    PosteriorRequest,
    PosteriorBatchRequest,
    ModelSelectionRequest,
    NormalsRequest,
    CurvaturesRequest,
    LevelSetRequest,
    SurfaceGradientRequest,
    SurfaceGradientMatrixRequest,
    SurfaceGradientSparseMatrixRequest,
    LaplaceBeltramiRequest,
    LaplaceBeltramiMatrixRequest,
    LaplaceBeltramiSparseMatrixRequest,
    RegionsRequest,
);

impl EstimateResponse {
    fn of(operation: &'static str, estimate: operation::Estimate) -> Json<Self> {
        let operation::Estimate { solver, outlook, seconds, is_admissible } = estimate;
        Json(Self {
            operation,
            solver: solver.into(),
            flops: outlook.flops,
            bytes: outlook.n_bytes as u64,
            seconds,
            cached: outlook.is_cached,
            admissible: is_admissible,
        })
    }
}
