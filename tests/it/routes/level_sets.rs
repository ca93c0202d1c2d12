//! `POST /v1/level-set`: meshes in every format, their refusals, and what their vertices know.

use serde_json::{Value, json};

use crate::document::contract::AnswerParts;
use crate::support::{Server, fibonacci_sphere, numbers, receive};

fn circle(n: usize) -> Vec<[f64; 2]> {
    let at = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
    (0..n).map(|i| [at(i).cos(), at(i).sin()]).collect()
}

async fn post_accepting(server: &Server, path: &str, body: &Value, format: &str) -> AnswerParts {
    receive(server.client.post(server.url(path)).header("accept", format).json(body)).await
}

fn lengths(list: &Value) -> Vec<usize> {
    list.as_array().unwrap().iter().map(|row| row.as_array().unwrap().len()).collect()
}

#[tokio::test]
async fn a_sphere_is_a_closed_mesh_with_error_bars() {
    let server = Server::start().await;
    let include = ["curvatures", "std"];
    let body = json!({"cloud": {"points": fibonacci_sphere(600)}, "include": include});
    let answer = server.post("/v1/level-set", &body).await.expect_ok();
    let parts = answer["parts"].as_array().unwrap();
    assert_eq!((parts.len(), &parts[0]["euler_characteristic"]), (1, &json!(2)), "{parts:?}");
    let k = lengths(&answer["vertices"]).len();
    assert!(lengths(&answer["cells"]).iter().all(|n| *n == 3));
    for member in ["normals", "support", "residuals", "mean_curvatures", "position_std"] {
        assert_eq!(answer[member].as_array().unwrap().len(), k, "{member}");
    }
    assert!(numbers(&answer["mean_curvatures"]).iter().all(|mean| (mean - 1.0).abs() < 0.1));
    assert!(answer["support"].as_array().unwrap().iter().all(|support| support == "observed"));
    assert!(answer["closedness"].as_f64().unwrap() > 0.98);
}

#[tokio::test]
async fn a_mesh_is_a_file_of_other_programs() {
    let server = Server::start().await;
    let body = json!({"cloud": {"points": fibonacci_sphere(300)}});
    let answer = server.post("/v1/level-set", &body).await.expect_ok();
    let (n_vertices, n_cells) = (lengths(&answer["vertices"]).len(), lengths(&answer["cells"]).len());
    for (format, begins) in [("model/ply", "ply\n"), ("model/gltf-binary", "glTF"), ("model/obj", "v ")] {
        let found = post_accepting(&server, "/v1/level-set", &body, format).await;
        assert_eq!((found.status, &found.headers["content-type"]), (200, &format.parse().unwrap()));
        assert!(found.bytes.starts_with(begins.as_bytes()), "{format}");
        let text = String::from_utf8_lossy(&found.bytes);
        match format {
            "model/ply" => {
                assert!(text.contains(&format!("element vertex {n_vertices}\n")));
                assert!(text.contains(&format!("element face {n_cells}\n")));
            }
            "model/obj" => assert_eq!(text.lines().filter(|line| line.starts_with("f ")).count(), n_cells),
            _ => assert_eq!(found.bytes[8..12], (found.bytes.len() as u32).to_le_bytes()),
        }
    }
    let normals = post_accepting(&server, "/v1/normals", &body, "model/ply").await;
    let text = String::from_utf8_lossy(&normals.bytes);
    assert!(text.contains("element vertex 300\n") && text.contains("property float nx\n"), "{text}");
}

#[tokio::test]
async fn a_level_of_values_is_a_polyline() {
    let server = Server::start().await;
    // u = x² + y² on a disc: the level ¼ is the circle of radius ½.
    let points: Vec<[f64; 2]> = (1..=6)
        .flat_map(|r| circle(8 * r).into_iter().map(move |[x, y]| [x * r as f64 / 6.0, y * r as f64 / 6.0]))
        .collect();
    let values: Vec<f64> = points.iter().map(|[x, y]| x * x + y * y).collect();
    let body = json!({"cloud": {"points": points}, "values": values, "level": 0.25, "include": ["curvatures", "std"]});
    let answer = server.post("/v1/level-set", &body).await.expect_ok();
    assert_eq!(
        (lengths(&answer["vertices"])[0], &answer["parts"][0]["euler_characteristic"]),
        (2, &json!(0))
    );
    for x in numbers(&answer["vertices"]).chunks_exact(2) {
        assert!((x[0].hypot(x[1]) - 0.5).abs() < 0.01, "{x:?}");
    }
    // u rises outward, so the side where it is greater is the inside.
    assert!(numbers(&answer["mean_curvatures"]).iter().all(|mean| (mean + 2.0).abs() < 0.3), "{answer}");
    assert!(answer.get("closedness").is_none());
}

#[tokio::test]
async fn what_cannot_be_meshed_is_refused_with_a_remedy() {
    let server = Server::start().await;
    let sphere = json!({"points": fibonacci_sphere(200)});
    let sheet: Vec<[f64; 3]> =
        (0..400).map(|i| [(i % 20) as f64 / 20.0, (i / 20) as f64 / 20.0, 0.0]).collect();
    let in_four: Vec<[f64; 4]> = fibonacci_sphere(50).iter().map(|x| [x[0], x[1], x[2], 0.0]).collect();
    let bounds = json!({"min": [0.0, 0.0, 0.0], "max": [1.0, -1.0, 1.0]});
    let cases = [
        (json!({"cloud": {"points": sheet}}), "invalid-request", "/open"),
        (json!({"cloud": {"points": in_four}}), "invalid-cloud", "/cloud/points"),
        (json!({"cloud": sphere, "step": 0.0}), "invalid-request", "/step"),
        (json!({"cloud": sphere, "level": 1.0}), "invalid-request", "/level"),
        (json!({"cloud": sphere, "surface_model": "offset"}), "invalid-request", "/surface_model"),
        (json!({"cloud": sphere, "bounds": bounds}), "invalid-request", "/bounds/max/1"),
        (
            json!({"cloud": sphere, "bounds": {"min": [0.0], "max": [1.0]}}),
            "dimension-mismatch",
            "/bounds/min",
        ),
    ];
    for (body, slug, pointer) in cases {
        let problem = server.post("/v1/level-set", &body).await.expect_problem(422, slug);
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
    }
}

#[tokio::test]
async fn eight_equal_requests_have_one_mesh() {
    let server = Server::start().await;
    let body = json!({"cloud": {"points": fibonacci_sphere(1500)}, "surface_model": "regression", "include": ["std"]});
    let asked = (0..8).map(|_| server.post("/v1/level-set", &body));
    let answers: Vec<Value> =
        futures_util::future::join_all(asked).await.into_iter().map(|answer| answer.expect_ok()).collect();
    for member in ["vertices", "cells", "position_std"] {
        assert!(answers.iter().all(|answer| answer[member] == answers[0][member]), "{member}");
    }
}

#[tokio::test]
async fn meshes_of_values_follow_units_and_offsets() {
    let server = Server::start().await;
    let mesh = async |unit: f64, offset: f64| {
        let points: Vec<[f64; 3]> = fibonacci_sphere(400)
            .into_iter()
            .flat_map(|x| [0.5, 0.75, 1.0].map(|r| x.map(|c| unit * r * c + offset)))
            .collect();
        let values: Vec<f64> = (0..1200).map(|i| [0.25, 0.5625, 1.0][i % 3]).collect();
        let kernel = json!({"family": "gauss", "length_scale": unit});
        let body = json!({"cloud": {"points": points}, "values": values, "kernel": kernel, "alpha": 1e-8,
            "level": 0.49, "step": 0.2 * unit});
        server.post("/v1/level-set", &body).await.expect_ok()
    };
    let plain = mesh(1.0, 0.0).await;
    assert_eq!(plain["parts"][0]["euler_characteristic"], 2, "{}", plain["parts"]);
    for (unit, offset) in [(1.0 / 4096.0, 0.0), (1048576.0, 0.0), (1.0, 1024.0)] {
        let moved = mesh(unit, offset).await;
        assert_eq!(moved["parts"][0]["euler_characteristic"], 2, "{unit} {offset}: {}", moved["parts"]);
        for x in numbers(&moved["vertices"]).chunks_exact(3) {
            let radius = x.iter().map(|c| ((c - offset) / unit).powi(2)).sum::<f64>().sqrt();
            assert!((radius - 0.7).abs() < 0.01, "{unit} {offset}: {radius}");
        }
    }
}

#[tokio::test]
async fn a_curve_that_a_short_kernel_breaks_into_islands_is_warned_of() {
    let server = Server::start().await;
    let kernel = json!({"family": "laplace", "length_scale": 0.157, "epsilon": 0.0064});
    let body = json!({"cloud": {"points": circle(400)}, "kernel": kernel, "alpha": 1e-3});
    let answer = server.post("/v1/level-set", &body).await.expect_ok();
    assert!(!answer["dropped_parts"].as_array().unwrap().is_empty());
    let warnings = answer["diagnostics"]["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|warning| warning["code"] == "parts_dropped"), "{warnings:?}");
}

#[tokio::test]
async fn closed_curves_are_one_part_by_default_whatever_their_density() {
    let server = Server::start().await;
    for n in [12, 50, 100, 200, 400, 1000] {
        let answer = server.post("/v1/level-set", &json!({"cloud": {"points": circle(n)}})).await.expect_ok();
        assert_eq!(answer["parts"].as_array().unwrap().len(), 1, "{n}");
        assert_eq!(answer["dropped_parts"], json!([]), "{n}");
        let length = answer["parts"][0]["area"].as_f64().unwrap();
        // The chords of 12 points are short of the circle by 1 %, finer ones by less.
        assert!((length / std::f64::consts::TAU - 1.0).abs() < 0.02, "{n}: {length}");
        assert_eq!(answer["diagnostics"]["warnings"], json!([]), "{n}");
    }
}

#[tokio::test]
async fn a_mesh_over_a_hole_says_how_much_of_it_is_bridged() {
    let server = Server::start().await;
    let points: Vec<_> = fibonacci_sphere(1000).into_iter().filter(|x| x[2] < 0.9).collect();
    let answer = server.post("/v1/level-set", &json!({"cloud": {"points": points}})).await.expect_ok();
    assert!(answer["support"].as_array().unwrap().iter().any(|support| support == "bridged"));
    let warnings = answer["diagnostics"]["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|warning| warning["code"] == "bridged"), "{warnings:?}");
}
