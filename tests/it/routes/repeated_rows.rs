//! Rows that repeat, as exported tables have them: what they change, and the warning that counts them.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::{Server, fibonacci_sphere, numbers, warnings_of};

/// Returns a request with x₃ on the unit sphere and noise of a tenth. The first `n_copies` rows are sent
/// twice.
fn measured(n: usize, n_copies: usize) -> Value {
    let (mut points, mut random) = (fibonacci_sphere(n), Random(5));
    let mut values: Vec<f64> = points.iter().map(|x| x[2] + 0.1 * random.normal()).collect();
    points.extend_from_within(..n_copies);
    values.extend_from_within(..n_copies);
    json!({"cloud": {"points": points}, "values": values, "queries": [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]})
}

fn repeated(answer: &Value) -> Vec<String> {
    warnings_of(answer, "repeated_rows")
}

#[tokio::test]
async fn copies_change_nothing_and_are_counted_whichever_solver_answers() {
    let server = Server::start().await;
    for solver in ["auto", "dense", "local"] {
        let of = |n_copies: usize| {
            let mut body = measured(400, n_copies);
            body["solver"] = json!(solver);
            body["include"] = json!(["std"]);
            body
        };
        let plain = server.post("/v1/interpolation", &of(0)).await.expect_ok();
        let copied = server.post("/v1/interpolation", &of(60)).await.expect_ok();
        assert_eq!(repeated(&plain), Vec::<String>::new(), "{solver}");
        let found = repeated(&copied);
        assert!(found.len() == 1 && found[0].contains(": 60;"), "{solver}: {copied}");
        // Points come in another order to the search for hyperparameters, so it may end in a cell beside.
        for (a, b) in numbers(&plain["values"]).iter().zip(numbers(&copied["values"])) {
            assert!((a - b).abs() < 0.02, "{solver}: {a} without copies, {b} with them");
        }
    }
}

#[tokio::test]
async fn copies_of_a_given_noise_are_measurements() {
    let server = Server::start().await;
    let mut body = measured(200, 30);
    body["alpha"] = json!(0.01);
    let answer = server.post("/v1/interpolation", &body).await.expect_ok();
    assert_eq!(repeated(&answer), Vec::<String>::new());
    assert_eq!(answer["diagnostics"]["n_merged_duplicates"], 0);
}
