//! How much memory a request takes.

use serde_json::{Value, json};

use crate::process::Process;
use crate::support::{fibonacci_sphere, receive};

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

/// Bytes that a cold request adds to the idle process at its peak. Whatever its size it takes 34 to 80 MB on two threads:
/// packing buffers of matrix products, two lanes of threads that each have their own, and pages that the allocator has begun.
async fn peak(path: &str, request: &Value) -> f64 {
    // Every thread has buffers of its own.
    let server = Process::start(&["--threads", "2"]);
    let idle = server.peak_resident_bytes();
    let answer = receive(reqwest::Client::new().post(server.url(path)).json(request)).await;
    assert_eq!(answer.status, 200);
    (server.peak_resident_bytes() - idle) as f64
}

#[tokio::test]
async fn a_cold_factorization_takes_half_its_matrix_and_little_more() {
    let (small, large) = (4000, 8000);
    let matrix = |n: usize| 8.0 * (n * n) as f64;
    for (path, of) in [("/v1/curvatures", request as fn(usize) -> Value), ("/v1/posterior", posterior)] {
        let [at_small, at_large] = [peak(path, &of(small)).await, peak(path, &of(large)).await];
        // What is paid once drops out of the difference, which is the cost of the points alone: half the matrix, and 18 MB of
        // surface for 4,000 points more.
        let (grown, limit) = (at_large - at_small, 0.6 * (matrix(large) - matrix(small)));
        assert!(grown <= limit, "{path}: {grown} more bytes from {small} to {large} points, {limit} allowed");
        let limit = 0.75 * matrix(large);
        assert!(at_large <= limit, "{path}: {at_large} bytes at the peak, {limit} allowed");
    }
}
