//! Sharp edges of machined parts: flags, the warning that counts them, and the normals of both sides.

use serde_json::{Value, json};

use crate::support::Server;

/// A cube as a lattice with points on its edges, 9 a side.
fn cube() -> Value {
    let at = |i: usize| i as f64 / 4.0 - 1.0;
    let all = (0..9 * 9 * 9).map(|i| [at(i % 9), at(i / 9 % 9), at(i / 81)]);
    json!(all.filter(|x| x.iter().any(|c| c.abs() == 1.0)).collect::<Vec<_>>())
}

/// The middle of an edge, and the middle of a face.
fn queries() -> Value {
    json!([[1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
}

#[tokio::test]
async fn normals_of_both_sides_of_an_edge_are_answered_where_they_are_asked_for() {
    let server = Server::start().await;
    let body = json!({"cloud": {"points": cube()}, "queries": queries(), "include": ["edge_normals"]});
    for path in ["/v1/normals", "/v1/curvatures"] {
        let answer = server.post(path, &body).await.expect_ok();
        let flags = answer["flags"].as_array().unwrap();
        assert!(flags.len() == 1 && flags[0]["query"] == 0 && flags[0]["reason"] == "edge", "{flags:?}");
        let edges = answer["edge_normals"].as_array().unwrap();
        assert!(edges.len() == 2 && edges[1].is_null(), "{edges:?}");
        let normal = |side: usize, c: usize| edges[0][side][c].as_f64().unwrap();
        let sums: Vec<f64> = (0..3).map(|c| normal(0, c) + normal(1, c)).collect();
        assert!(sums.iter().zip([1.0, 1.0, 0.0]).all(|(sum, of)| (sum - of).abs() < 1e-6), "{sums:?}");
        let diagnostics = &answer["diagnostics"];
        assert_eq!(diagnostics["solver"], "local", "{diagnostics}");
        let warnings = diagnostics["warnings"].as_array().unwrap();
        let of_edges = warnings.iter().filter(|warning| warning["code"] == "sharp_edges");
        let details: Vec<&str> = of_edges.map(|warning| warning["detail"].as_str().unwrap()).collect();
        assert!(details.len() == 1 && details[0].contains("1 of 2"), "{details:?}");
    }
    // Not asked for, they are absent.
    let body = json!({"cloud": {"points": cube()}, "queries": queries(), "solver": "local"});
    let answer = server.post("/v1/normals", &body).await.expect_ok();
    assert!(answer["edge_normals"].is_null() && answer["flags"][0]["reason"] == "edge", "{answer}");
}

#[tokio::test]
async fn a_function_of_all_points_has_no_edges() {
    let server = Server::start().await;
    for chosen in [json!({"solver": "dense"}), json!({"alpha": 1e-6}), json!({"surface_model": "signature"})]
    {
        let mut body = json!({"cloud": {"points": cube()}, "include": ["edge_normals"]});
        body.as_object_mut().unwrap().extend(chosen.as_object().unwrap().clone());
        let refused = server.post("/v1/normals", &body).await.expect_problem(422, "unsupported-by-solver");
        assert_eq!(refused["errors"][0]["pointer"], "/include", "{refused}");
    }
}
