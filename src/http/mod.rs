//! HTTP interface of the service. This page lists every route and the order of middleware.

pub mod fields;
pub mod openapi;
pub mod problem;
mod renamed;
mod routes;
pub mod serve;
pub mod state;

use std::sync::Arc;

use axum::Router;
use axum::http::{HeaderName, HeaderValue, Method, header};
use axum::middleware::{from_fn, from_fn_with_state};
use axum::routing::{MethodRouter, get};
use tokio::net::TcpListener;
use tower::util::option_layer;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::cors::{AllowOrigin, CorsLayer};
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use gramian_host::around::{authentication, middleware};
use gramian_host::jobs::{self, Runner};
use gramian_host::server;
use gramian_host::state::settings::Origins;
use openapi::version_3_0;
use routes::pages::{documentation, viewer};
pub use routes::reading;
pub use routes::surface::level_set::VertexSupport;
use routes::surface::{curvatures, laplace_beltrami, level_set, normals, surface_gradient};
use routes::tiles::{coarse, regions, sides};
use routes::values::{interpolation, model_selection, posterior};
use routes::{clouds, estimate, jobs as job_routes, kernels, pages, process};
use state::app::App;

/// Serves until `stop` resolves, then drains and returns.
///
/// # Errors
/// Returns the errors of [`server::serve`].
pub async fn serve(
    app: Arc<App>,
    listener: TcpListener,
    stop: impl Future<Output = ()> + Send + 'static,
) -> std::io::Result<()> {
    let (router, runner) = router(app);
    server::serve(runner, router, listener, stop).await
}

/// Returns the service as one router, and the runner of its jobs.
pub fn router(app: Arc<App>) -> (Router, Runner) {
    let Parts { at_once, long, probes, document } = parts();
    let recover = || CatchPanicLayer::custom(middleware::recover as fn(_) -> _);
    let runner =
        Runner { host: app.host.clone(), routes: long.clone().layer(recover()).with_state(app.clone()) };
    let document = openapi::to_value(&document);
    let document_3_1 = serve_json(openapi::to_text(&document).into());
    let document_3_0 = serve_json(openapi::to_text(&version_3_0::derive(document)).into());
    let deadline = || from_fn_with_state(app.host.clone(), middleware::meet_deadline);
    let router = long
        .layer(deadline())
        .layer(from_fn_with_state(runner.clone(), jobs::respond_async))
        .merge(at_once.layer(deadline()))
        .layer(from_fn_with_state(app.host.clone(), authentication::authenticate))
        .merge(probes)
        .route("/page/{*path}", get(viewer::get_page_file))
        .route("/openapi.json", document_3_1)
        .route("/openapi-3.0.json", document_3_0)
        .route("/docs", get(documentation::get_documentation))
        .route("/docs/", get(documentation::get_documentation_page))
        .route("/docs/{*path}", get(documentation::get_documentation_file))
        .fallback(renamed::not_found)
        .method_not_allowed_fallback(middleware::method_not_allowed)
        .layer(recover())
        .layer(option_layer(app.settings.cors_origins.as_ref().map(cors)))
        .layer(from_fn_with_state(app.host.clone(), middleware::name_and_log))
        .with_state(app);
    (router, runner)
}

/// The paths under `/v1` that answer requests with a body, without that beginning.
pub fn operations() -> Vec<String> {
    let paths = parts().document.paths.paths.into_iter().filter(|(_, item)| item.post.is_some());
    paths.filter_map(|(path, _)| path.strip_prefix("/v1/").map(str::to_owned)).collect()
}

/// Returns a route that serves a document.
fn serve_json(text: bytes::Bytes) -> MethodRouter<Arc<App>> {
    get(move || async move { ([(header::CONTENT_TYPE, "application/json")], text) })
}

/// Returns the OpenAPI document of this version, as JSON.
pub fn openapi_json() -> String {
    openapi::to_text(&openapi::to_value(&parts().document))
}

/// Returns the OpenAPI document in version 3.0, as JSON, for generators that do not know 3.1.
pub fn openapi_3_0_json() -> String {
    openapi::to_text(&version_3_0::derive(openapi::to_value(&parts().document)))
}

/// All routes, and the document of them.
struct Parts {
    /// Routes behind keys whose work takes no longer than receiving the body. They ignore that a job is
    /// preferred.
    at_once: Router<Arc<App>>,
    /// The other routes behind keys.
    long: Router<Arc<App>>,
    /// Routes for everyone.
    probes: Router<Arc<App>>,
    document: utoipa::openapi::OpenApi,
}

fn parts() -> Parts {
    let at_once = OpenApiRouter::with_openapi(openapi::Document::openapi())
        .routes(routes!(clouds::create_cloud, clouds::list_clouds))
        .routes(routes!(clouds::get_cloud, clouds::check_cloud, clouds::delete_cloud))
        .routes(routes!(kernels::list_kernels))
        .routes(routes!(estimate::estimate))
        .routes(routes!(coarse::choose_coarse_cloud))
        .routes(routes!(sides::choose_sides))
        .routes(routes!(job_routes::get_job, job_routes::delete_job))
        .layer(from_fn(middleware::negotiate));
    // They compute or return computed results, and negotiate formats themselves.
    let long = OpenApiRouter::new()
        .routes(routes!(job_routes::follow_job))
        .routes(routes!(job_routes::get_job_result))
        .routes(routes!(interpolation::compute_interpolation))
        .routes(routes!(interpolation::compute_interpolation_batch))
        .routes(routes!(posterior::compute_posterior))
        .routes(routes!(posterior::compute_posterior_batch))
        .routes(routes!(model_selection::select_model))
        .routes(routes!(regions::compute_regions))
        .routes(routes!(normals::compute_normals))
        .routes(routes!(level_set::compute_level_set))
        .routes(routes!(curvatures::compute_curvatures))
        .routes(routes!(surface_gradient::compute_surface_gradient))
        .routes(routes!(surface_gradient::assemble_surface_gradient_matrix))
        .routes(routes!(surface_gradient::assemble_surface_gradient_sparse_matrix))
        .routes(routes!(laplace_beltrami::compute_laplace_beltrami))
        .routes(routes!(laplace_beltrami::assemble_laplace_beltrami_matrix))
        .routes(routes!(laplace_beltrami::assemble_laplace_beltrami_sparse_matrix));
    let probes = OpenApiRouter::new()
        .routes(routes!(process::check_live))
        .routes(routes!(process::check_ready))
        .routes(routes!(process::get_metrics))
        .routes(routes!(process::get_version))
        .routes(routes!(viewer::get_start_page))
        .routes(routes!(pages::list_problem_pages))
        .routes(routes!(pages::get_problem_page));
    let (at_once, mut document) = at_once.split_for_parts();
    let (long, of_long) = long.split_for_parts();
    let (probes, mut of_probes) = probes.split_for_parts();
    document.merge(of_long);
    openapi::set_security(&mut document, true);
    openapi::set_security(&mut of_probes, false);
    document.merge(of_probes);
    openapi::complete(&mut document);
    Parts { at_once, long, probes, document }
}

/// CORS headers, added only where origins are configured. Without them, OPTIONS is a method that no path
/// allows.
fn cors(origins: &Origins) -> CorsLayer {
    let exposed = [
        "x-request-id",
        "server-timing",
        "cache-status",
        "gramian-cloud",
        "location",
        "preference-applied",
        "retry-after",
        "etag",
    ];
    let layer = CorsLayer::new()
        .allow_methods([Method::GET, Method::HEAD, Method::POST, Method::DELETE])
        .allow_headers([
            header::AUTHORIZATION,
            header::CONTENT_TYPE,
            header::CONTENT_ENCODING,
            header::IF_NONE_MATCH,
            HeaderName::from_static("x-request-id"),
            HeaderName::from_static("gramian-cloud"),
            HeaderName::from_static("prefer"),
            jobs::IDEMPOTENCY_KEY,
            HeaderName::from_static("traceparent"),
        ])
        .expose_headers(exposed.map(HeaderName::from_static));
    layer.allow_origin(match origins {
        Origins::Any => AllowOrigin::any(),
        Origins::Listed(listed) => {
            AllowOrigin::list(listed.iter().filter_map(|origin| HeaderValue::from_str(origin).ok()))
        }
    })
}
