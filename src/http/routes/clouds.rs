//! `/v1/clouds`: clouds registered under the hash of their content.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use axum::Extension;
use axum::body::{Body, HttpBody};
use axum::extract::{Path, RawQuery, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::fields::schemas::{CloudIdSchema, CursorSchema};
use crate::http::openapi::responses::{DescribeProblems, ListProblems, LookUpProblems, RegisterProblems};
use crate::http::problem::Problem;
use crate::http::serve::durable::{find_cloud, forget_cloud, keep, list_clouds as list_of};
use crate::http::serve::planner::{Planner, unknown_cloud};
use crate::http::serve::sampling::find_sampling;
use crate::http::state::app::App;
use crate::http::state::app::CLOUD_HEADER;
use crate::store::clouds::{CloudPage, ListedCloud, RegisteredCloud};
use crate::store::key::CloudId;
use crate::store::objects::cloud_object::CloudHead;
use crate::store::objects::{CloudPlace, ListWindow};
use gramian_host::compute::{Admission, JobObserver, Work};
use gramian_host::memory::Owner;
use gramian_host::operation::intake::read_body;
use gramian_host::wire::etag::if_none_match;
use gramian_host::wire::negotiation::BodyFormat;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::encode::holding;
use gramian_host::wire::write::json::{Json, timestamp};
use gramian_numerics::points::sampling::{NearestRange, Scales, sampling_price};

/// Default number of clouds in a page.
const DEFAULT_PAGE: usize = 50;
/// Largest number of clouds in a page.
const MAX_PAGE: usize = 1000;

/// Points to register.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloudRequest {
    /// The points, one row of coordinates each. All rows have the same length.
    #[schema(value_type = Vec<Vec<f64>>, min_items = 1)]
    pub points: Points,
    /// Normals at the points, one row each.
    ///
    /// They may have any length but 0. The side they point to is outward. An empty list counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    #[schema(value_type = Option<Vec<Vec<f64>>>)]
    pub normals: Option<Points>,
}

/// The smallest box around a cloud.
#[derive(Serialize, ToSchema)]
pub struct BoundingBox {
    /// The smallest value of each coordinate.
    min: Vec<f64>,
    /// The largest value of each coordinate.
    max: Vec<f64>,
}

/// Statistics of the distance from each point to the nearest point elsewhere.
#[derive(Serialize, ToSchema)]
pub struct Spacing {
    /// The smallest distance.
    min: f64,
    /// The median distance.
    median: f64,
    /// The largest distance.
    max: f64,
}

/// A registered cloud.
#[derive(Serialize, ToSchema)]
pub struct Cloud {
    /// The id of the cloud, to refer to it in later requests.
    #[schema(value_type = CloudIdSchema)]
    cloud_id: String,
    /// Number of points, n.
    n_points: usize,
    /// Number of coordinates of each point, d.
    dimension: usize,
    /// The smallest box around the points.
    bounding_box: BoundingBox,
    /// Distances between nearest points.
    ///
    /// Absent if all points coincide. A list of clouds has it only once a kernel was chosen for the cloud, or
    /// the cloud was registered or described by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    spacing: Option<Spacing>,
    /// Number of points that coincide with an earlier point.
    n_duplicates: usize,
    /// The time of registration, in UTC.
    #[schema(format = DateTime)]
    created_at: String,
}

impl From<&RegisteredCloud> for Cloud {
    fn from(stored: &RegisteredCloud) -> Self {
        let nearest = stored.scales().and_then(Scales::nearest_range);
        let spacing = nearest.map(|NearestRange { min, median, max }| Spacing { min, median, max });
        Self { spacing, ..Self::of_head(stored.id, stored.head()) }
    }
}

impl Cloud {
    /// Describes a cloud by its head in the store, which knows no spacing.
    fn of_head(id: CloudId, head: CloudHead) -> Self {
        let (min, max) = head.bounding_box;
        Self {
            cloud_id: id.to_string(),
            n_points: head.n_points,
            dimension: head.dimension,
            bounding_box: BoundingBox { min, max },
            spacing: None,
            n_duplicates: head.n_duplicates,
            created_at: timestamp(head.created_at),
        }
    }
}

impl From<ListedCloud> for Cloud {
    fn from(listed: ListedCloud) -> Self {
        match listed {
            ListedCloud::InMemory(stored) => Self::from(stored.as_ref()),
            ListedCloud::InStore(id, head) => Self::of_head(id, head),
        }
    }
}

/// A page of clouds, oldest first.
#[derive(Serialize, ToSchema)]
pub struct CloudList {
    /// The clouds of this page.
    clouds: Vec<Cloud>,
    /// The cursor of the next page. Absent on the last page.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<CursorSchema>)]
    next: Option<String>,
}

/// Register a cloud
///
/// Keeps the points under an id, so that later requests need not repeat them. The id is the hash of the
/// coordinates: posting the same points again answers 200 with the same id. Clouds live in a bounded store,
/// which drops the least recently used first.
#[utoipa::path(
    post,
    path = "/v1/clouds",
    tag = "clouds",
    request_body = CloudRequest,
    responses(
        (status = 201, description = "Registered", body = Cloud),
        (status = 200, description = "Known already", body = Cloud),
        RegisterProblems
    )
)]
pub async fn create_cloud(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let formats = [BodyFormat::Json, BodyFormat::Safetensors, BodyFormat::Npy, BodyFormat::Ply];
    let intake = read_body(&app, owner, &parts.headers, body, &formats).await?;
    let admission = app.compute.admit(owner)?;
    let (shared, flops) = (app.clone(), intake.body.flops_to_parse());
    let job = move |observer: &JobObserver| {
        let (request, mut memory) = intake.parse::<CloudRequest>(&shared, observer)?;
        let planner = Planner::new(&shared, owner);
        let (stored, is_new) = planner.register(request.points, request.normals, "")?;
        // The cloud is sampled, which takes memory beside the cloud itself.
        memory.shrink_to(
            stored
                .n_bytes()
                .saturating_add(sampling_price(stored.cloud.n_points(), stored.cloud.dimension()).n_bytes),
        );
        Ok::<_, Problem>((stored, is_new, memory))
    };
    let (stored, is_new, _memory) = app.compute.run(&admission, flops, job).await?.0?;
    // The store decides if there is one. Memory drops clouds, and other processes delete them.
    let is_new_to_store = keep(&app, owner, &stored).await?;
    let is_new = if app.durable.is_some() { is_new_to_store } else { is_new };
    sample(&app, &admission, &stored).await?;
    let cloud = Cloud::from(stored.as_ref());
    let location = format!("/v1/clouds/{}", cloud.cloud_id);
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    let named = [(header::LOCATION, location), (CLOUD_HEADER, cloud.cloud_id.clone())];
    Ok((status, named, Json(cloud)).into_response())
}

/// Describe a cloud
///
/// Returns the size of the cloud, the box around it and the distances between its points, but not the points.
/// `ETag` and `If-None-Match` save the body. The request counts as use, so the cloud is not the next to be
/// dropped.
#[utoipa::path(
    get,
    path = "/v1/clouds/{cloud_id}",
    tag = "clouds",
    params(("cloud_id" = CloudIdSchema, Path, description = "The id of a registered cloud", example = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c")),
    responses(
        (status = 200, description = "The cloud", body = Cloud),
        (status = 304, description = "The client has it already"),
        DescribeProblems
    )
)]
pub async fn get_cloud(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(cloud_id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let stored = find(&app, owner, &cloud_id).await?;
    let etag = etag_of(&stored);
    if if_none_match(&headers, &etag) {
        return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, etag)]).into_response());
    }
    if stored.scales().is_none() {
        sample(&app, &app.compute.admit(owner)?, &stored).await?;
    }
    Ok(([(header::ETAG, etag)], Json(Cloud::from(stored.as_ref()))).into_response())
}

/// Samples a cloud, so that its description has the spacing. Costs nothing if it was sampled before.
async fn sample(app: &Arc<App>, admission: &Arc<Admission>, stored: &RegisteredCloud) -> Result<(), Problem> {
    let (n, d) = (stored.cloud.n_points(), stored.cloud.dimension());
    let work = Work { operation: "describe_cloud", is_cached: false, flops: sampling_price(n, d).flops };
    admission.set_work(work);
    find_sampling(app, admission, stored).await?;
    admission.finish();
    Ok(())
}

/// Check for a cloud
///
/// Answers like GET on the same path, without the body.
#[utoipa::path(
    head,
    path = "/v1/clouds/{cloud_id}",
    tag = "clouds",
    params(("cloud_id" = CloudIdSchema, Path, description = "The id of a registered cloud", example = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c")),
    responses((status = 200, description = "Registered"), (status = 304, description = "The client has it already"), LookUpProblems)
)]
pub async fn check_cloud(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(cloud_id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let etag = etag_of(find(&app, owner, &cloud_id).await?.as_ref());
    let status = if if_none_match(&headers, &etag) { StatusCode::NOT_MODIFIED } else { StatusCode::OK };
    let json = HeaderValue::from_static("application/json");
    let mut response = (status, [(header::ETAG, etag)]).into_response();
    response.headers_mut().insert(header::CONTENT_TYPE, json);
    Ok(response)
}

/// Delete a cloud
///
/// Deletes the points and everything that was computed from them.
#[utoipa::path(
    delete,
    path = "/v1/clouds/{cloud_id}",
    tag = "clouds",
    params(("cloud_id" = CloudIdSchema, Path, description = "The id of a registered cloud", example = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c")),
    responses((status = 204, description = "Deleted"), LookUpProblems)
)]
pub async fn delete_cloud(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(cloud_id): Path<String>,
) -> Result<StatusCode, Problem> {
    let id = CloudId::parse(&cloud_id).ok_or_else(|| unknown_cloud(&cloud_id))?;
    if forget_cloud(&app, owner, id).await? {
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(unknown_cloud(&cloud_id))
    }
}

/// List clouds
///
/// Returns the clouds registered with this key, oldest first.
#[utoipa::path(
    get,
    path = "/v1/clouds",
    tag = "clouds",
    params(
        ("limit" = Option<usize>, Query, description = "Clouds in a page, 50 if absent", minimum = 1, maximum = 1000, example = 10),
        ("cursor" = Option<CursorSchema>, Query, description = "`next` of the page before")
    ),
    responses((status = 200, description = "A page of clouds", body = CloudList), ListProblems)
)]
pub async fn list_clouds(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    RawQuery(query): RawQuery,
) -> Result<Response, Problem> {
    let window = parse_window(query.as_deref().unwrap_or(""))?;
    let CloudPage { clouds, next } = list_of(&app, owner, window).await?;
    let next = next.map(|place| Cursor(place).to_string());
    let list = CloudList { clouds: clouds.into_iter().map(Cloud::from).collect(), next };
    held(&app, owner, Json(list).into_response())
}

/// Reserves the bytes of an answer until it is sent. A page may be long, and its client may read slowly.
fn held(app: &App, owner: Owner, answer: Response) -> Result<Response, Problem> {
    let n_bytes = usize::try_from(answer.body().size_hint().lower()).unwrap_or(usize::MAX);
    let memory = app.prepared.try_reserve(owner, n_bytes).ok_or_else(|| app.compute.out_of_memory())?;
    let mut answer = answer.map(|body| Body::from_stream(holding(body.into_data_stream(), memory)));
    answer.headers_mut().insert(header::CONTENT_LENGTH, n_bytes.into());
    Ok(answer)
}

/// The place of the last cloud of a page in the order of the list. Opaque to clients.
///
/// A cursor stays valid after its cloud was deleted.
struct Cursor(CloudPlace);

impl Cursor {
    /// Parses a cursor that matches the pattern in the OpenAPI document.
    ///
    /// `from_str_radix` alone would also accept a sign, capitals and any number of zeros.
    fn parse(text: &str) -> Option<Self> {
        let (nanoseconds, id) = text.split_once('-')?;
        let is_plain =
            nanoseconds.len() <= 32 && nanoseconds.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'));
        let nanoseconds = u128::from_str_radix(nanoseconds, 16).ok().filter(|_| is_plain)?;
        // A time beyond u64 nanoseconds lies behind all clouds, so its page is empty.
        let nanoseconds = u64::try_from(nanoseconds).unwrap_or(u64::MAX);
        let since = SystemTime::UNIX_EPOCH + Duration::from_nanos(nanoseconds);
        Some(Self(CloudPlace { since, id: CloudId::parse(id)? }))
    }
}

impl fmt::Display for Cursor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let since_epoch = self.0.since.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        write!(f, "{:x}-{}", since_epoch.as_nanos(), self.0.id)
    }
}

/// Parses the window of the list from a query string.
fn parse_window(query: &str) -> Result<ListWindow, Problem> {
    let mut window = ListWindow { after: None, n: DEFAULT_PAGE };
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
        match name {
            "limit" => {
                let limit = value.parse().ok().filter(|limit| (1..=MAX_PAGE).contains(limit));
                let detail = format!("limit must be an integer from 1 to {MAX_PAGE}");
                window.n = limit.ok_or_else(|| Problem::invalid_request("/limit", detail))?;
            }
            "cursor" => {
                let refused = || Problem::invalid_request("/cursor", "this is no cursor of a page");
                window.after = Some(Cursor::parse(value).ok_or_else(refused)?.0);
            }
            _ => {
                let pointer = format!("/{}", name.chars().take(64).collect::<String>());
                return Err(Problem::invalid_request(pointer, "unknown query parameter"));
            }
        }
    }
    Ok(window)
}

/// Returns the entity tag of a cloud.
///
/// The tag is weak because a cloud that was deleted and posted again has the same points, but another
/// `created_at`.
fn etag_of(stored: &RegisteredCloud) -> String {
    format!("W/\"{}\"", stored.id)
}

async fn find(app: &Arc<App>, owner: Owner, cloud_id: &str) -> Result<Arc<RegisteredCloud>, Problem> {
    let unknown = || unknown_cloud(cloud_id);
    let id = CloudId::parse(cloud_id).ok_or_else(unknown)?;
    find_cloud(app, owner, id).await?.ok_or_else(unknown)
}
