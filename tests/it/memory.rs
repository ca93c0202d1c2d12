//! How much memory a request takes.

use serde_json::{Value, json};

use crate::process::Process;
use crate::support::fibonacci_sphere;

/// What the first request costs whatever its size: packing buffers of matrix products, two lanes of threads that each have
/// their own, and pages that the allocator has begun, in huge pages of 2 MiB. 34 to 67 MB on two threads.
const ONCE: f64 = 80e6;

fn request(n: usize) -> Value {
    let points = fibonacci_sphere(n);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-8})
}

fn posterior(n: usize) -> Value {
    let mut request = request(n);
    request["values"] = json!(vec![1.0; n]);
    request["queries"] = json!(fibonacci_sphere(100));
    request["include"] = json!(["variance"]);
    request
}

/// Bytes that a cold request adds to the idle process at its peak.
async fn peak(path: &str, request: &Value) -> f64 {
    // Every thread has buffers of its own.
    let server = Process::start(&["--threads", "2"]);
    let idle = server.peak_resident_bytes();
    let response = reqwest::Client::new().post(server.url(path)).json(request).send().await.unwrap();
    assert_eq!(response.status(), 200);
    (server.peak_resident_bytes() - idle) as f64
}

#[tokio::test]
async fn a_cold_factorization_takes_its_matrix_and_little_more() {
    let (small, large) = (4000, 8000);
    let matrix = |n: usize| 8.0 * (n * n) as f64;
    for (path, of) in [("/v1/curvatures", request as fn(usize) -> Value), ("/v1/posterior", posterior)] {
        let [at_small, at_large] = [peak(path, &of(small)).await, peak(path, &of(large)).await];
        // What is paid once drops out of the difference, which is the cost of the points alone.
        let (grown, limit) = (at_large - at_small, 1.1 * (matrix(large) - matrix(small)));
        assert!(grown <= limit, "{path}: {grown} more bytes from {small} to {large} points, {limit} allowed");
        let limit = matrix(large) + ONCE;
        assert!(at_large <= limit, "{path}: {at_large} bytes at the peak, {limit} allowed");
    }
}
