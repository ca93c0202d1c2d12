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
use crate::http::fields::SolverUsed;
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::serve::operation::AnyOperation;
use crate::http::serve::steps::{self, Estimate};
use crate::http::state::app::App;
use gramian_host::compute::JobObserver;
use gramian_host::memory::Owner;
use gramian_host::operation::REQUEST_FORMATS;
use gramian_host::operation::intake::{ReceivedBody, read_body};
use gramian_host::wire::write::json::Json;

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
        names.enum_values(Some(OPERATIONS.map(|operation| operation.name))).description(Some(text)).into()
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
    let operation = find(&operation).ok_or_else(unknown)?;
    let estimate = steps::estimate(app, admission, intake, operation).await?;
    Ok(EstimateResponse::of(operation.name, estimate))
}

/// 422 for a name that is no operation's.
fn unknown() -> Problem {
    let names = OPERATIONS.map(|operation| operation.name).join(", ");
    let detail = format!("no operation of this name can be estimated; there are {names}");
    Problem::invalid_request("/operation", detail)
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
    let named = body.parse_with_operation::<AnyRequest>(&app.context(observer))?;
    let missing = || Problem::invalid_request("/operation", "name the operation whose request this is");
    let operation = named.operation.ok_or_else(missing)?;
    Ok((operation, ReceivedBody { body: body.into_request(app.memory.shares.body), memory }))
}

/// All operations that can be estimated.
pub const OPERATIONS: [AnyOperation; 15] = [
    AnyOperation::of::<InterpolationRequest>(),
    AnyOperation::of::<InterpolationBatchRequest>(),
    AnyOperation::of::<PosteriorRequest>(),
    AnyOperation::of::<PosteriorBatchRequest>(),
    AnyOperation::of::<ModelSelectionRequest>(),
    AnyOperation::of::<NormalsRequest>(),
    AnyOperation::of::<CurvaturesRequest>(),
    AnyOperation::of::<LevelSetRequest>(),
    AnyOperation::of::<SurfaceGradientRequest>(),
    AnyOperation::of::<SurfaceGradientMatrixRequest>(),
    AnyOperation::of::<SurfaceGradientSparseMatrixRequest>(),
    AnyOperation::of::<LaplaceBeltramiRequest>(),
    AnyOperation::of::<LaplaceBeltramiMatrixRequest>(),
    AnyOperation::of::<LaplaceBeltramiSparseMatrixRequest>(),
    AnyOperation::of::<RegionsRequest>(),
];

fn find(name: &str) -> Option<AnyOperation> {
    OPERATIONS.into_iter().find(|operation| operation.name == name)
}

impl EstimateResponse {
    fn of(operation: &'static str, estimate: Estimate) -> Json<Self> {
        let Estimate { solver, outlook, seconds, is_admissible } = estimate;
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
