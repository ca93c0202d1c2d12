//! The way of a request, with an operation that adds numbers.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Extension, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::Response;
use axum::routing::post;
use futures_util::future::join_all;
use safetensors::SafeTensors;
use serde::Deserialize;
use serde_json::{Value, json};
use tower::ServiceExt;

use super::{AnyOperation, Operation, operation, serve};
use crate::answer;
use crate::compute::JobObserver;
use crate::jobs::requests::{parse, result};
use crate::jobs::{Runner, respond_async};
use crate::memory::Owner;
use crate::problem::{Problem, catalogue};
use crate::state::host::Host;
use crate::testing::host;
use crate::wire::write::array::Array;
use gramian_observer::{Observer, Price};

const OWNER: Owner = Owner(0);

/// Additions that wait until they are cancelled, and those that were.
static BEGUN: AtomicUsize = AtomicUsize::new(0);
static CANCELLED: AtomicUsize = AtomicUsize::new(0);

/// Numbers to add.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Addition {
    values: Vec<f64>,
    /// Bytes and flops that the addition claims to take.
    #[serde(default)]
    n_bytes: usize,
    #[serde(default)]
    flops: f64,
    /// Whether it never ends by itself.
    #[serde(default)]
    is_endless: bool,
}

answer! {
    /// Sums of numbers.
    pub struct Sums {
        /// The sum of the first numbers, for each number.
        partial: Array as Vec<f64>,
        sum: f64,
    }
}

impl Operation for Addition {
    const NAME: &'static str = "add";
    type Answer = Sums;
    type Context = ();

    fn plan(&self, (): &()) -> Result<Price, Problem> {
        if self.values.is_empty() {
            return Err(Problem::invalid_request("/values", "there is nothing to add"));
        }
        Ok(Price { n_bytes: self.n_bytes, flops: self.flops })
    }

    fn compute(self, (): &(), observer: &JobObserver) -> Result<Sums, Problem> {
        if self.is_endless {
            BEGUN.fetch_add(1, SeqCst);
            while !observer.is_cancelled() {
                std::thread::yield_now();
            }
            CANCELLED.fetch_add(1, SeqCst);
            return Err(Problem::cancelled());
        }
        let mut sum = 0.0;
        let partial: Vec<f64> = self.values.iter().map(|x| (sum += x, sum).1).collect();
        let shape = [partial.len()];
        Ok(Sums { partial: Array::new(partial, &shape), sum })
    }
}

async fn add(
    State(host): State<Arc<Host>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    let operation: AnyOperation = operation::<Addition>(());
    serve(host, owner, request, operation).await
}

/// The routes of a service that adds.
fn routes(host: &Arc<Host>) -> Router {
    Router::new().route("/add", post(add)).with_state(host.clone())
}

fn request(body: &Value) -> Request {
    let mut request = Request::post("/add").body(Body::from(body.to_string())).unwrap();
    request.headers_mut().insert(header::CONTENT_TYPE, "application/json".parse().unwrap());
    request.extensions_mut().insert(OWNER);
    request
}

async fn ask(host: &Arc<Host>, body: &Value) -> Response {
    routes(host).oneshot(request(body)).await.unwrap()
}

fn refusal(response: &Response) -> &'static str {
    response.extensions().get::<Problem>().map_or("none", |problem| problem.slug().as_str())
}

async fn json_of(response: Response) -> Value {
    serde_json::from_slice(&to_bytes(response.into_body(), usize::MAX).await.unwrap()).unwrap()
}

#[tokio::test]
async fn a_sum_is_answered_in_each_format() {
    let host = host(&[]);
    let body = json!({"values": [1, 2, 3.5]});
    let response = ask(&host, &body).await;
    assert_eq!(response.status(), StatusCode::OK);
    assert!(!response.headers().contains_key("cache-status"));
    assert!(response.headers()["server-timing"].to_str().unwrap().starts_with("parse;dur="));
    assert_eq!(json_of(response).await, json!({"partial": [1.0, 3.0, 6.5], "sum": 6.5}));
    let mut tensors = request(&body);
    tensors.headers_mut().insert(header::ACCEPT, "application/x-safetensors".parse().unwrap());
    let response = routes(&host).oneshot(tensors).await.unwrap();
    let bytes = to_bytes(response.into_body(), usize::MAX).await.unwrap();
    let found = SafeTensors::deserialize(&bytes).unwrap();
    let bytes = found.tensor("partial").unwrap().data();
    let partial: Vec<f64> = bytes.chunks(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect();
    assert_eq!(partial, [1.0, 3.0, 6.5]);
    let mut picture = request(&body);
    picture.headers_mut().insert(header::ACCEPT, "image/png".parse().unwrap());
    assert_eq!(refusal(&routes(&host).oneshot(picture).await.unwrap()), "not-acceptable");
}

#[tokio::test]
async fn work_of_any_size_has_the_same_answer() {
    let host = host(&[]);
    let asked = |flops: f64| json!({"values": [1, 2], "n_bytes": 1 << 20, "flops": flops});
    for flops in [0.0, 1e8, 1e12] {
        assert_eq!(json_of(ask(&host, &asked(flops)).await).await["sum"], 3.0);
    }
    assert_eq!((host.work.n_held(), host.intake.n_held()), (0, 0));
}

#[tokio::test]
async fn eight_equal_requests_at_once_are_all_answered() {
    let host = host(&[]);
    for flops in [0.0, 1e9] {
        // Together they want twice the memory that there is, so some wait for what others give back.
        let body = json!({"values": [1, 2], "n_bytes": 8 << 20, "flops": flops});
        let asked = (0..8).map(|_| async { json_of(ask(&host, &body).await).await });
        for answer in join_all(asked).await {
            assert_eq!(answer["sum"], 3.0, "{answer}");
        }
    }
    assert_eq!((host.work.n_held(), host.intake.n_held()), (0, 0));
}

#[tokio::test]
async fn what_is_wrong_is_refused_where_it_is_noticed() {
    let host = host(&["--max-queue", "0"]);
    let too_long = json!({"values": vec![0; 100_001]});
    for (body, refused) in [
        (json!({"values": []}), "invalid-request"),
        (json!({"values": [1], "more": 1}), "invalid-request"),
        (json!({"values": [1], "n_bytes": 1_usize << 40}), "problem-too-large"),
        (too_long, "problem-too-large"),
    ] {
        assert_eq!(refusal(&ask(&host, &body).await), refused);
    }
    let _only_place = host.compute.admit(OWNER).unwrap();
    assert_eq!(refusal(&ask(&host, &json!({"values": [1]})).await), "overloaded");
}

#[tokio::test]
async fn work_that_would_end_too_late_is_refused_beside_other_work() {
    let host = host(&["--deadline-seconds", "1"]);
    let long = json!({"values": [1], "flops": 1e15});
    // An idle host tries it.
    assert_eq!(ask(&host, &long).await.status(), StatusCode::OK);
    let endless = tokio::spawn({
        let host = host.clone();
        async move { ask(&host, &json!({"values": [1], "flops": 1e12, "is_endless": true})).await }
    });
    let n_begun = BEGUN.load(SeqCst);
    while BEGUN.load(SeqCst) == n_begun && host.compute.load().lanes.iter().all(|lane| lane.n_running == 0) {
        tokio::task::yield_now().await;
    }
    let fresh = json!({"values": [1], "flops": 1e18});
    let response = ask(&host, &fresh).await;
    assert_eq!(refusal(&response), catalogue::DEADLINE_EXCEEDED.as_str());
    endless.abort();
}

#[tokio::test]
async fn who_leaves_cancels_the_work_and_gives_everything_back() {
    let host = host(&[]);
    let body = json!({"values": [1], "n_bytes": 1 << 20, "flops": 1e12, "is_endless": true});
    let (n_begun, n_cancelled) = (BEGUN.load(SeqCst), CANCELLED.load(SeqCst));
    let mut asking = Box::pin(ask(&host, &body));
    while BEGUN.load(SeqCst) == n_begun {
        assert!(futures_util::poll!(&mut asking).is_pending());
        tokio::task::yield_now().await;
    }
    assert!(host.work.n_held() >= 1 << 20);
    drop(asking);
    while CANCELLED.load(SeqCst) == n_cancelled
        || host.work.n_held() > 0
        || host.compute.load().n_admitted > 0
    {
        tokio::task::yield_now().await;
    }
    assert_eq!(host.intake.n_held(), 0);
}

#[tokio::test]
async fn a_job_adds_and_keeps_its_sum() {
    let host = host(&[]);
    let runner = Runner { host: host.clone(), routes: routes(&host) };
    let service = Router::new()
        .route("/add", post(add))
        .layer(from_fn_with_state(runner, respond_async))
        .with_state(host.clone());
    let mut asked = request(&json!({"values": [2, 3], "flops": 1e12}));
    asked.headers_mut().insert("prefer", "respond-async".parse().unwrap());
    let accepted = service.oneshot(asked).await.unwrap();
    assert_eq!(accepted.status(), StatusCode::ACCEPTED);
    let id = parse(json_of(accepted).await["job_id"].as_str().unwrap()).unwrap();
    assert_eq!(json_of(result(&host, OWNER, id).await.unwrap()).await["sum"], 5.0);
    assert_eq!(host.work.n_held(), 0);
}
