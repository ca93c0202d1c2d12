//! The way of requests without a server: plans, flights, memory, refusals.

use std::sync::Arc;

use axum::body::Body;
use axum::http::Request;
use axum::response::Response;
use clap::Parser;
use http_body_util::BodyExt;
use serde_json::{Value, json};

use super::operation::AnyOperation;
use super::plan::Lack;
use super::planner::{GivenValues, Planner};
use super::steps::{estimate, serve};
use crate::config::Config;
use crate::http::fields::{CloudInput, Fit, SolverChoice};
use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use crate::http::routes::surface::normals::NormalsRequest;
use crate::http::routes::values::interpolation::InterpolationRequest;
use crate::http::state::app::App;
use gramian_host::memory::CacheOutcome;
use gramian_host::memory::Owner;
use gramian_host::operation::REQUEST_FORMATS;
use gramian_host::operation::intake::read_body;
use gramian_host::wire::read::points::Points;
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::surface::geometry::GeometryRequest;

const OWNER: Owner = Owner(0);

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    config: Config,
}

async fn app(flags: &[&str]) -> Arc<App> {
    let flags = ["gramian", "--threads", "2"].iter().chain(flags);
    App::new(Flags::parse_from(flags).config).await.unwrap()
}

/// Points on a circle.
fn circle(n: usize) -> Vec<[f64; 2]> {
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
    (0..n).map(|i| [angle(i).cos(), angle(i).sin()]).collect()
}

fn request(body: &Value) -> Request<Body> {
    let request = Request::post("/").header("content-type", "application/json");
    request.body(Body::from(body.to_string())).unwrap()
}

fn interpolation(n: usize) -> Value {
    let values: Vec<f64> = circle(n).iter().map(|x| x[0]).collect();
    let kernel = json!({"family": "gauss", "length_scale": 0.3});
    json!({"cloud": {"points": circle(n)}, "values": values, "kernel": kernel, "alpha": 1e-6})
}

async fn interpolated(app: &Arc<App>, body: &Value) -> Result<Response, Problem> {
    serve(app.clone(), OWNER, request(body), AnyOperation::of::<InterpolationRequest>()).await
}

fn outcome(response: &Response) -> CacheOutcome {
    *response.extensions().get().unwrap()
}

fn fit(n: usize, solver: SolverChoice) -> Fit {
    let points = Points { n_rows: n, dimension: 2, coordinates: circle(n).concat(), ragged: None };
    Fit { cloud: CloudInput { points: Some(points), ..CloudInput::default() }, solver, ..Fit::default() }
}

#[tokio::test]
async fn the_solver_follows_the_request_and_the_limit_of_the_dense_one() {
    let app = app(&["--max-dense-points", "1000"]).await;
    let plan = |n: usize, solver| {
        let planner = Planner::new(&app, OWNER);
        let values = GivenValues::one(vec![0.0; n]);
        planner.values_fit(fit(n, solver), values, None).map(|(planned, _)| planned.solver)
    };
    assert_eq!(plan(1000, SolverChoice::Auto).unwrap(), SolverKind::Dense);
    assert_eq!(plan(1001, SolverChoice::Auto).unwrap(), SolverKind::Local);
    assert_eq!(plan(10, SolverChoice::Local).unwrap(), SolverKind::Local);
    let refused = plan(1001, SolverChoice::Dense).unwrap_err();
    assert_eq!(refused.slug(), catalogue::PROBLEM_TOO_LARGE);
}

#[tokio::test]
async fn a_fit_lacks_what_it_would_have_to_choose() {
    let app = app(&[]).await;
    let planner = Planner::new(&app, OWNER);
    let values = GivenValues::one(vec![0.0; 20]);
    let (planned, _) = planner.values_fit(fit(20, SolverChoice::Auto), values, None).unwrap();
    assert_eq!(planned.lack(), Some(Lack::Learned));
    let request = GeometryRequest::CURVATURES;
    let surface = |fit| planner.surface_fit(fit, Purpose::Normals, &request).unwrap();
    assert_eq!(surface(fit(20, SolverChoice::Dense)).lack(), Some(Lack::Scales));
    assert_eq!(surface(fit(20, SolverChoice::Local)).lack(), None);
    let short = planner.values_fit(fit(20, SolverChoice::Auto), GivenValues::one(vec![0.0; 19]), None);
    assert_eq!(short.err().unwrap().slug(), catalogue::LENGTH_MISMATCH);
}

#[tokio::test(flavor = "multi_thread")]
async fn eight_equal_requests_make_one_factorization() {
    let app = app(&[]).await;
    let body = interpolation(1500);
    let asked = (0..8).map(|_| interpolated(&app, &body));
    let answers = futures_util::future::join_all(asked).await;
    let outcomes: Vec<CacheOutcome> =
        answers.iter().map(|answer| outcome(answer.as_ref().unwrap())).collect();
    let n_stored = outcomes.iter().filter(|found| **found == CacheOutcome::Stored).count();
    assert_eq!(n_stored, 1, "{outcomes:?}");
    assert!(outcomes.iter().all(|found| *found != CacheOutcome::NotStored), "{outcomes:?}");
    let again = interpolated(&app, &body).await.unwrap();
    assert_eq!(outcome(&again), CacheOutcome::Hit);
}

#[tokio::test(flavor = "multi_thread")]
async fn those_who_share_a_computation_share_its_failure() {
    let app = app(&[]).await;
    let mut points = circle(300);
    points[7] = points[3];
    let kernel = json!({"family": "gauss", "length_scale": 0.3});
    let inline =
        json!({"cloud": {"points": points}, "values": vec![0.0; 300], "kernel": kernel, "alpha": 0.0});
    let planner = Planner::new(&app, OWNER);
    let rows = Points { n_rows: 300, dimension: 2, coordinates: points.concat(), ragged: None };
    let id = planner.register(rows, None, "").unwrap().0.id.to_string();
    let mut by_id = inline.clone();
    by_id["cloud"] = json!({"id": id});
    let asked = [&inline, &by_id].map(|body| interpolated(&app, body));
    for answer in futures_util::future::join_all(asked).await {
        let problem = answer.err().unwrap();
        assert_eq!(problem.slug(), catalogue::DUPLICATE_POINTS);
        let document = serde_json::to_value(problem.document("")).unwrap();
        assert_eq!(document["point_indices"], json!([3, 7]));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn memory_is_free_again_once_an_answer_is_sent_or_nobody_waits() {
    let app = app(&[]).await;
    let answer = interpolated(&app, &interpolation(400)).await.unwrap();
    answer.into_body().collect().await.unwrap();
    // What is reserved is kept, and weights are kept beside it.
    assert!(app.prepared.n_reserved() <= app.prepared.n_bytes());
    // A client that leaves: its future is dropped at the first wait.
    let body = interpolation(2000);
    let left = tokio::time::timeout(std::time::Duration::ZERO, interpolated(&app, &body)).await;
    assert!(left.is_err());
    // Whoever asks next is served, whatever the other one left behind.
    let answer = interpolated(&app, &body).await.unwrap();
    answer.into_body().collect().await.unwrap();
    assert!(app.prepared.n_reserved() <= app.prepared.n_bytes());
    assert_eq!(app.intake.n_held(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_memory_can_never_hold_is_refused_before_it_is_begun() {
    let app = app(&["--memory-bytes", "134217728"]).await;
    let problem = interpolated(&app, &interpolation(4900)).await.err().unwrap();
    assert_eq!(problem.slug(), catalogue::PROBLEM_TOO_LARGE);
    assert_eq!(app.prepared.n_reserved(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_estimate_computes_nothing_and_sees_what_is_there() {
    let app = app(&[]).await;
    let mut body = interpolation(500);
    let estimated = async |body: &Value| {
        let (parts, body) = request(body).into_parts();
        let intake = read_body(&app, OWNER, &parts.headers, body, &REQUEST_FORMATS).await.unwrap();
        let admission = app.compute.admit(OWNER).unwrap();
        estimate(app.clone(), admission, intake, AnyOperation::of::<InterpolationRequest>()).await.unwrap()
    };
    body["operation"] = json!("compute_interpolation");
    let before = estimated(&body).await;
    assert!(before.is_admissible && !before.outlook.is_cached);
    assert_eq!(app.prepared.n_bytes(), 0);
    interpolated(&app, &interpolation(500)).await.unwrap();
    let after = estimated(&body).await;
    assert!(after.outlook.is_cached && after.outlook.flops < before.outlook.flops);
}

#[tokio::test(flavor = "multi_thread")]
async fn clouds_that_only_the_store_has_are_read_from_it() {
    let folder = std::env::temp_dir().join(format!("gramian-serve-{}", std::process::id()));
    let place = folder.to_str().unwrap();
    let body = json!({"cloud": {"points": circle(64)}, "alpha": 0.01});
    let first = app(&["--store", place]).await;
    let normals = AnyOperation::of::<NormalsRequest>();
    let answer = serve(first, OWNER, request(&body), normals).await.unwrap();
    let id = answer.headers()["gramian-cloud"].to_str().unwrap().to_owned();
    let body = json!({"cloud": {"id": id}, "alpha": 0.01});
    let second = app(&["--store", place]).await;
    serve(second, OWNER, request(&body), normals).await.unwrap();
    let stranger = app(&[]).await;
    let problem = serve(stranger, OWNER, request(&body), normals).await.err().unwrap();
    assert_eq!(problem.slug(), catalogue::UNKNOWN_CLOUD);
    std::fs::remove_dir_all(folder).unwrap();
}
