//! Points whose coordinates have different units, as tables have them, and the warning that names them.

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::support::Server;

/// A request whose values depend on both coordinates, the second one in units of `1 / factor`.
fn table(factor: f64) -> Value {
    let mut random = Random(3);
    let points: Vec<[f64; 2]> = (0..80).map(|_| [random.uniform(), factor * random.uniform()]).collect();
    let values: Vec<f64> = points.iter().map(|x| (3.0 * x[0]).sin() + x[1] / factor).collect();
    json!({"cloud": {"points": points}, "values": values, "queries": [[0.5, 0.5 * factor]]})
}

/// The details of the warnings of different units in the answer to a request.
async fn warned(server: &Server, body: &Value) -> Vec<String> {
    let answer = server.post("/v1/interpolation", body).await.expect_ok();
    let warnings = answer["diagnostics"]["warnings"].as_array().unwrap().clone();
    let of_units = warnings.iter().filter(|warning| warning["code"] == "units_differ");
    of_units.map(|warning| warning["detail"].as_str().unwrap().to_owned()).collect()
}

#[tokio::test]
async fn coordinates_of_different_units_are_named_where_the_kernel_is_learned() {
    let server = Server::start().await;
    assert_eq!(warned(&server, &table(5.0)).await, Vec::<String>::new());
    // The values decide for a length scale of each coordinate.
    let answer = server.post("/v1/interpolation", &table(1000.0)).await.expect_ok();
    let scales = answer["diagnostics"]["kernel"]["length_scales"].as_array().unwrap().clone();
    assert!(scales[1].as_f64().unwrap() > 100.0 * scales[0].as_f64().unwrap(), "{scales:?}");
    assert_eq!(warned(&server, &table(1000.0)).await, Vec::<String>::new());
    // Values that are noise decide for nothing.
    let mut noise = table(1000.0);
    let mut random = Random(4);
    noise["values"] = (0..80).map(|_| random.uniform()).collect();
    let found = warned(&server, &noise).await;
    assert!(found.len() == 1 && found[0].starts_with("coordinate 1 of the points varies"), "{found:?}");
    assert!(found[0].contains("as coordinate 0") && found[0].contains("length_scales"), "{found:?}");
    // A kernel that is given is a choice. A coordinate that does not vary has no unit.
    let mut given = table(1000.0);
    given["kernel"] = json!({"family": "gauss", "length_scales": [0.3, 300.0]});
    assert_eq!(warned(&server, &given).await, Vec::<String>::new());
    let mut flat = table(5.0);
    for point in flat["cloud"]["points"].as_array_mut().unwrap() {
        point.as_array_mut().unwrap().push(json!(7.0));
    }
    flat["queries"] = json!([[0.5, 2.5, 7.0]]);
    assert_eq!(warned(&server, &flat).await, Vec::<String>::new());
}
