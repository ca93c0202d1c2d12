//! Clouds in tiles: hyperparameters of the whole, coarse clouds, regions and their sides.

use serde_json::{Value, json};

use crate::support::{Server, fibonacci_sphere, numbers};

/// The part of a sphere on one side of a plane, with a margin beyond it, and the positions of its own points.
fn cap(points: &[[f64; 3]], side: f64) -> (Vec<[f64; 3]>, Vec<usize>) {
    let part: Vec<[f64; 3]> = points.iter().copied().filter(|x| side * x[2] > -0.5).collect();
    let own = (0..part.len()).filter(|&at| side * part[at][2] > 0.0).collect();
    (part, own)
}

#[tokio::test]
async fn a_part_with_the_hyperparameters_of_the_whole_answers_as_the_whole() {
    let server = Server::start().await;
    let points = fibonacci_sphere(3000);
    let (part, own) = cap(&points, 1.0);
    let queries: Vec<_> = own.iter().map(|&at| part[at]).collect();
    let ask = |cloud: &[[f64; 3]]| json!({"cloud": {"points": cloud}, "solver": "local", "include": ["std"], "queries": queries});
    let whole = server.post("/v1/curvatures", &ask(&points)).await.expect_ok();
    let known = &whole["diagnostics"]["hyperparameters"];
    assert_eq!((&known["means"], &whole["diagnostics"]["reach"]), (&json!([]), &json!(152)));
    let mut body = ask(&part);
    body["hyperparameters"] = known.clone();
    let answer = server.post("/v1/curvatures", &body).await.expect_ok();
    assert_eq!(&answer["diagnostics"]["hyperparameters"], known);
    for member in ["normals", "mean_curvatures", "mean_curvature_std"] {
        let (of_part, of_whole) = (numbers(&answer[member]), numbers(&whole[member]));
        // Rounding of neighbours at equal distances, which the two trees visit in different orders.
        assert!(of_part.iter().zip(&of_whole).all(|(a, b)| (a - b).abs() < 1e-9), "{member}");
    }
}

#[tokio::test]
async fn hyperparameters_out_of_range_are_refused_by_their_place() {
    let server = Server::start().await;
    let cloud = json!({"points": fibonacci_sphere(100)});
    let body = json!({"cloud": cloud, "solver": "local"});
    let answer = server.post("/v1/normals", &body).await.expect_ok();
    let known = answer["diagnostics"]["hyperparameters"].clone();
    let with = |member: &str, value: Value| {
        let mut changed = known.clone();
        changed[member] = value;
        json!({"cloud": cloud, "solver": "local", "hyperparameters": changed})
    };
    let level = |points_per_mean: usize, n_shares: usize| {
        let shares = vec![0.1; n_shares];
        json!({"points_per_mean": points_per_mean, "noise_ratios": [], "flat_noise_ratios": [],
            "normal_bias_shares": shares, "curvature_bias_shares": vec![0.1; 9]})
    };
    let ratio = |ratio: f64, log_share: f64| json!({"ratio": ratio, "log_share": log_share});
    let cases = [
        (with("means", json!([level(1, 9)])), "means/0/points_per_mean"),
        (with("means", json!([level(8, 9), level(15, 9)])), "means/1/points_per_mean"),
        (with("means", json!([level(8, 8)])), "means/0/normal_bias_shares"),
        (with("means", json!(vec![level(8, 9); 7])), "means"),
        (with("noise_deviation", json!(-1.0)), "noise_deviation"),
        (with("radius", json!(0.0)), "radius"),
        (with("noise_ratios", json!([ratio(0.0, -1.0), ratio(-1.0, -1.0)])), "noise_ratios/1"),
        (with("flat_noise_ratios", json!([ratio(0.0, 1.0)])), "flat_noise_ratios/0"),
        (with("quartic_noise_ratios", json!([ratio(-1.0, 0.0)])), "quartic_noise_ratios/0"),
        (with("noise_ratios", json!(vec![ratio(0.0, 0.0); 9])), "noise_ratios"),
    ];
    for (body, member) in cases {
        let problem = server.post("/v1/normals", &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], format!("/hyperparameters/{member}"));
    }
    for path in ["/v1/normals", "/v1/curvatures"] {
        let body = json!({"cloud": cloud, "surface_model": "signature", "hyperparameters": known});
        let problem = server.post(path, &body).await.expect_problem(422, "unsupported-by-solver");
        assert_eq!(problem["errors"][0]["pointer"], "/hyperparameters", "{path}");
    }
    let mut both = with("radius", json!(1.0));
    both["sites"] = json!([[0.0, 0.0, 1.0]]);
    let problem = server.post("/v1/normals", &both).await.expect_problem(422, "invalid-request");
    assert_eq!(problem["errors"][0]["pointer"], "/sites");
}

#[tokio::test]
async fn a_sphere_in_two_tiles_is_turned_outward() {
    let server = Server::start().await;
    let points = fibonacci_sphere(1000);
    let body = json!({"points": points, "noise_deviation": 0.0});
    let coarse = server.post("/v1/tiles/coarse", &body).await.expect_ok();
    let chosen: Vec<usize> = serde_json::from_value(coarse["points"].clone()).unwrap();
    assert_eq!((chosen.len(), &coarse["kernel"]["family"]), (600, &json!("laplace")));
    let few = json!({"points": points, "count": 16});
    let few = server.post("/v1/tiles/coarse", &few).await.expect_ok();
    assert_eq!(few["points"].as_array().unwrap().len(), 16);
    for side in [1.0, -1.0] {
        let (mut tiles, mut shared) = (Vec::new(), Vec::new());
        for half in [1.0, -1.0] {
            let (part, own) = cap(&points, half);
            let normals: Vec<_> = part.iter().map(|x| x.map(|c| side * c)).collect();
            let is_coarse = |at: &usize| chosen.iter().any(|&point| points[point] == part[*at]);
            let coarse: Vec<usize> = (0..part.len()).filter(is_coarse).collect();
            let cloud = json!({"points": part, "normals": normals});
            let body = json!({"cloud": cloud, "own": own, "coarse": coarse});
            let answer = server.post("/v1/tiles/regions", &body).await.expect_ok();
            let labels: Vec<i64> = serde_json::from_value(answer["labels"].clone()).unwrap();
            // One region, with the first points beyond it.
            assert!(own.iter().all(|&at| labels[at] == 0) && labels.contains(&-1));
            assert_eq!(answer["regions"][0]["n_points"], own.len());
            shared.push(labels.iter().filter(|label| **label == 0).count() > own.len());
            let members =
                ["regions", "borders", "n_edges"].map(|name| (name.to_owned(), answer[name].clone()));
            tiles.push(Value::Object(members.into_iter().collect()));
        }
        assert_eq!(shared, [true, true]);
        let body = json!({"tiles": tiles, "links": [{"first": 0, "second": 1}]});
        let sides = server.post("/v1/tiles/sides", &body).await.expect_ok();
        assert_eq!(sides, json!({"signs": [side as i8, side as i8], "are_doubtful": [false, false]}));
    }
}

#[tokio::test]
async fn tiles_that_cannot_be_are_refused_by_their_place() {
    let server = Server::start().await;
    let points = fibonacci_sphere(60);
    let bare = json!({"points": points});
    let cloud = json!({"points": points, "normals": points});
    let region = json!({
        "n_points": 1, "n_signed": 1, "n_coarse": 0, "area": 1.0, "centre": [0.0, 0.0], "spread": 0.0,
        "normal": [1.0, 0.0], "volume": 0.0, "lower": [0.0, 0.0], "upper": [0.0, 0.0],
    });
    let tile = |border: usize| {
        let borders = json!([{"first": 0, "second": border, "agreeing": 1.0, "opposing": 0.0}]);
        json!({"regions": [region], "borders": borders, "n_edges": 6})
    };
    let link = |second: usize| json!({"first": 0, "second": second});
    let mut without_points = tile(0);
    without_points["regions"][0]["n_points"] = json!(0);
    let cases = [
        ("/v1/tiles/regions", json!({"cloud": bare, "own": [0]}), "/cloud/normals"),
        ("/v1/tiles/regions", json!({"cloud": cloud, "own": [1, 1]}), "/own/1"),
        ("/v1/tiles/regions", json!({"cloud": cloud, "own": [0], "coarse": [60]}), "/coarse/0"),
        ("/v1/tiles/coarse", json!({"points": points, "count": 0}), "/count"),
        ("/v1/tiles/coarse", json!({"points": points, "noise_deviation": -1.0}), "/noise_deviation"),
        ("/v1/tiles/coarse", json!({"points": points, "noise_deviation": 1e308}), "/noise_deviation"),
        ("/v1/tiles/sides", json!({"tiles": [tile(0), tile(1)], "links": []}), "/tiles/1"),
        ("/v1/tiles/sides", json!({"tiles": [tile(0), tile(0)], "links": [link(1), link(2)]}), "/links/1"),
        ("/v1/tiles/sides", json!({"tiles": [tile(0), without_points], "links": []}), "/tiles/1/regions/0"),
    ];
    for (path, body, pointer) in cases {
        let problem = server.post(path, &body).await.expect_problem(422, "invalid-request");
        assert_eq!(problem["errors"][0]["pointer"], pointer, "{path}");
    }
    let body = json!({"cloud": cloud, "own": [], "alpha": 0.1});
    let problem = server.post("/v1/tiles/regions", &body).await.expect_problem(422, "unsupported-by-solver");
    assert_eq!(problem["errors"][0]["pointer"], "/alpha");
    let empty = server.post("/v1/tiles/regions", &json!({"cloud": cloud, "own": []})).await.expect_ok();
    assert_eq!((&empty["regions"], &empty["n_edges"]), (&json!([]), &json!(0)));
}

/// A request for the regions of the upper half of a sphere, whose points were changed.
fn upper_half(change: impl Fn([f64; 3]) -> [f64; 3]) -> Value {
    // Coordinates of few digits, so that units and offsets change them without rounding.
    let round = |x: [f64; 3]| x.map(|c| (c * 1024.0).round() / 1024.0);
    let points: Vec<_> = fibonacci_sphere(1000).into_iter().map(round).collect();
    let (part, own) = cap(&points, 1.0);
    let changed: Vec<_> = part.iter().map(|x| change(*x)).collect();
    json!({"cloud": {"points": changed, "normals": part}, "own": own})
}

#[tokio::test]
async fn eight_equal_requests_for_regions_have_one_answer() {
    let server = Server::start().await;
    let body = upper_half(|x| x);
    let asked = (0..8).map(|_| server.post("/v1/tiles/regions", &body));
    let answers: Vec<Value> =
        futures_util::future::join_all(asked).await.into_iter().map(|answer| answer.expect_ok()).collect();
    assert!(answers.iter().all(|answer| answer == &answers[0]));
}

#[tokio::test]
async fn regions_follow_units_and_offsets() {
    let server = Server::start().await;
    let plain = server.post("/v1/tiles/regions", &upper_half(|x| x)).await.expect_ok();
    let first = &plain["regions"][0];
    for (unit, offset) in [(1.0 / 4096.0, 0.0), (1048576.0, 0.0), (1.0, 1024.0)] {
        let body = upper_half(|x| x.map(|c| unit * c + offset));
        let moved = server.post("/v1/tiles/regions", &body).await.expect_ok();
        assert_eq!(moved["labels"], plain["labels"]);
        let region = &moved["regions"][0];
        assert_eq!(region["n_points"], first["n_points"]);
        let area = |region: &Value| region["area"].as_f64().unwrap();
        // Rounding of the squares of coordinates up to the offset.
        let relative = 1e-9 * (1.0 + offset * offset);
        assert!((area(region) / (unit * unit) - area(first)).abs() <= relative * area(first), "{region}");
        for (now, before) in numbers(&region["centre"]).iter().zip(numbers(&first["centre"])) {
            assert!(((now - offset) / unit - before).abs() <= 1e-9 * (1.0 + offset), "{now} {before}");
        }
    }
}
