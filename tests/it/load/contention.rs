//! Contention: equal requests at the same moment are computed once, and none waits for ever.

use std::time::Duration;

use futures_util::future::join_all;
use serde_json::{Value, json};

use crate::all_routes::ROUTES;
use crate::support::Server;

/// Concurrent requests in a round.
const N_CLIENTS: usize = 8;

/// Rounds on each route, each with a new cloud.
const N_ROUNDS: usize = 200;

/// Points of a cloud, enough for sums over them to be split between threads.
const N_POINTS: usize = 100;

/// Timeout of all rounds of one route. Some rounds take milliseconds, so that only a hang takes this long.
const TIMEOUT: Duration = Duration::from_secs(240);

/// Returns a sphere that differs for every route and round.
fn cloud(route: usize, round: usize) -> Value {
    let mut points = crate::support::fibonacci_sphere(N_POINTS);
    points[0][0] += 1e-6 * (1 + round + N_ROUNDS * route) as f64;
    json!(points)
}

/// Sends [`N_CLIENTS`] equal requests at once in each round, on every route. They carry no parameters, so the
/// service analyses the cloud to choose them. That planning takes several jobs of the pool, and the other
/// requests arrive during it.
async fn rounds(n_threads: usize) {
    let server = Server::with_flags(&["--threads", &n_threads.to_string()]).await;
    for (index, route) in ROUTES.iter().enumerate() {
        let all = async {
            for round in 0..N_ROUNDS {
                let points = cloud(index, round);
                let mut body = json!({"cloud": {"points": points}, "queries": [points[1], points[2]]});
                if route.has_values {
                    body["values"] = json!(vec![1.0; N_POINTS]);
                }
                let answers = join_all((0..N_CLIENTS).map(|_| server.post(route.path, &body))).await;
                let first = &answers[0];
                assert_eq!(first.status, 200, "{}: {}", route.path, first.text);
                for answer in &answers {
                    assert_eq!(answer.text, first.text, "{} in round {round}", route.path);
                }
            }
        };
        let outcome = tokio::time::timeout(TIMEOUT, all).await;
        assert!(outcome.is_ok(), "{} hangs on {n_threads} threads", route.path);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn equal_requests_at_once_are_answered_on_two_threads() {
    rounds(2).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn equal_requests_at_once_are_answered_on_sixteen_threads() {
    rounds(16).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_cloud_registered_by_many_at_once_is_described_to_all() {
    let server = Server::with_flags(&["--threads", "16"]).await;
    for round in 0..N_ROUNDS {
        let body = json!({"points": cloud(ROUTES.len(), round)});
        let registering = join_all((0..N_CLIENTS).map(|_| server.post("/v1/clouds", &body)));
        let answers = tokio::time::timeout(TIMEOUT, registering).await.expect("hangs");
        let n_created = answers.iter().filter(|answer| answer.status == 201).count();
        assert_eq!(n_created, 1, "round {round}");
        assert!(
            answers
                .iter()
                .all(|answer| answer.text == answers[0].text && answer.json()["spacing"].is_object())
        );
    }
}

/// Points of a unit sphere with noise of about half a spacing.
fn noisy_sphere(n: usize) -> Value {
    let noise = |k: usize| (12.9898 * (k as f64 + 1.0)).sin() * 43_758.545_3 % 1.0 * 0.03;
    let moved = |(at, x): (usize, [f64; 3])| [0, 1, 2].map(|c| x[c] + noise(3 * at + c));
    json!(crate::support::fibonacci_sphere(n).into_iter().enumerate().map(moved).collect::<Vec<_>>())
}

/// A circle of n points with noise of about a third of their distance.
fn noisy_circle(n: usize) -> Value {
    let angle = |at: usize| std::f64::consts::TAU * at as f64 / n as f64;
    let radius = |at: usize| 1.0 + (12.9898 * (at as f64 + 1.0)).sin() * 43_758.545_3 % 1.0 * 3.0 / n as f64;
    json!((0..n).map(|at| [radius(at) * angle(at).cos(), radius(at) * angle(at).sin()]).collect::<Vec<_>>())
}

/// A table of six columns in different units with values of three of them.
fn table() -> Value {
    let column = |row: usize, c: usize| (7.31 * (row + 1) as f64 * (c + 1) as f64).sin().abs();
    let rows: Vec<Vec<f64>> =
        (0..150).map(|row| (0..6).map(|c| 10f64.powi(c as i32) * column(row, c)).collect()).collect();
    let values: Vec<f64> =
        (0..150).map(|row| column(row, 0) + 2.0 * column(row, 1) * column(row, 2)).collect();
    json!({"cloud": {"points": rows}, "values": values, "queries": [rows[3], rows[4]]})
}

/// Levels of means, edges, sides of noisy curves and length scales of columns are found on the pool by each
/// of these.
#[tokio::test(flavor = "multi_thread")]
async fn noisy_surfaces_and_tables_asked_for_by_many_at_once_are_made_once() {
    let surface = json!({"cloud": {"points": noisy_sphere(3000)}, "include": ["std", "edge_normals"]});
    let curve = json!({"cloud": {"points": noisy_circle(1000)}, "include": ["std"], "solver": "dense"});
    let requests = [("/v1/curvatures", surface), ("/v1/interpolation", table()), ("/v1/normals", curve)];
    for n_threads in ["2", "16"] {
        let server = Server::with_flags(&["--threads", n_threads]).await;
        for (path, body) in &requests {
            let all = join_all((0..N_CLIENTS).map(|_| server.post(path, body)));
            let answers = tokio::time::timeout(TIMEOUT, all).await.expect("hangs");
            assert_eq!(answers[0].status, 200, "{path}: {}", answers[0].text);
            assert!(answers.iter().all(|answer| answer.text == answers[0].text), "{path}");
        }
    }
}
