//! How much memory a request takes.

use serde_json::json;

use crate::process::Process;
use crate::support::fibonacci_sphere;

#[tokio::test]
async fn a_cold_factorization_takes_little_more_than_its_matrix() {
    let n = 8000;
    let server = Process::start(&[]);
    let points = fibonacci_sphere(n);
    let request = json!({
        "cloud": {"points": points},
        "kernel": {"family": "matern", "length_scale": 0.3},
        "alpha": 1e-8,
        "queries": points[..10],
    });
    let response =
        reqwest::Client::new().post(server.url("/v1/curvatures")).json(&request).send().await.unwrap();
    assert_eq!(response.status(), 200);
    let peak = server.peak_resident_bytes();
    let limit = 1.6 * 8.0 * (n * n) as f64;
    assert!((peak as f64) < limit, "{peak} bytes at the peak, {limit} allowed");
}
