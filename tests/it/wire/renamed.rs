//! Names that were changed before the first publication are refused with the new ones.

use serde_json::{Value, json};

use crate::support::Server;

/// A request with an old name, the pointer to it, and what the refusal says.
const REFUSED: [(&str, &str, &str, &str); 8] = [
    ("/v1/normals", r#"{"include": ["deviations"]}"#, "/include/0", "`deviations` is called `std`"),
    (
        "/v1/interpolation",
        r#"{"values": [1, 2, 3], "include": ["deviations"]}"#,
        "/include/0",
        "`deviations` is called `std`",
    ),
    ("/v1/normals", r#"{"surface": "offset"}"#, "/surface", "`surface` is called `surface_model`"),
    ("/v1/curvatures", r#"{"surface_model": "local"}"#, "/surface_model", "`local` is called `regression`"),
    ("/v1/laplace-beltrami/matrix", r#"{"geometry": {}}"#, "/geometry", "`geometry` is called `surface`"),
    (
        "/v1/laplace-beltrami/matrix",
        r#"{"surface": {"surface": "local"}}"#,
        "/surface/surface",
        "`surface` is called `model`",
    ),
    (
        "/v1/posterior",
        r#"{"values": [1, 2, 3], "include": ["variance"]}"#,
        "/include/0",
        "`variance` is called `variances`",
    ),
    (
        "/v1/posterior",
        r#"{"values": [1, 2, 3], "include": ["observation_variance"]}"#,
        "/include/0",
        "`observation_variance` is called `observation_variances`",
    ),
];

#[tokio::test]
async fn an_old_name_in_a_request_is_refused_with_the_new_one() {
    let server = Server::start().await;
    for (path, fields, pointer, detail) in REFUSED {
        let mut body: Value = serde_json::from_str(fields).unwrap();
        body["cloud"] = json!({"points": [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]});
        let problem = server.post(path, &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{path}: {problem}");
        assert_eq!(problem["errors"][0]["detail"], detail, "{path}: {problem}");
    }
}

#[tokio::test]
async fn an_old_path_is_refused_with_the_new_one() {
    let server = Server::start().await;
    for name in ["coarse", "regions", "sides"] {
        let problem = server.post(&format!("/v1/{name}"), &json!({})).await.expect_problem(404, "not-found");
        assert_eq!(problem["detail"], format!("/v1/{name} is called /v1/tiles/{name}"));
    }
}
