//! Bodies of requests and answers: JSON, safetensors, npy and PLY, compressed or not, whole or streamed.

use std::collections::HashMap;
use std::io::Write;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::all_routes::{ROUTES, Route, route_of};
use crate::document::contract::{AnswerParts, decompressed};
use crate::support::{Server, fibonacci_sphere, numbers, receive};

const JSON: &str = "application/json";
const SAFETENSORS: &str = "application/x-safetensors";
const NPY: &str = "application/x-npy";
const PLY: &str = "model/ply";

async fn post(
    server: &Server,
    path: &str,
    headers: &[(&str, &str)],
    body: impl Into<reqwest::Body>,
) -> AnswerParts {
    let mut request = server.client.post(server.url(path)).body(body);
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    receive(request).await
}

/// Returns the answer to a JSON request in the media type `accept`.
async fn ask(server: &Server, path: &str, body: &Value, accept: &str) -> AnswerParts {
    let headers = [("content-type", JSON), ("accept", accept)];
    let answer = post(server, path, &headers, body.to_string()).await;
    assert_eq!(answer.status, 200, "{path}: {}", String::from_utf8_lossy(&answer.bytes));
    assert_eq!((answer.header("content-type"), answer.header("vary")), (accept, "accept, accept-encoding"));
    answer
}

fn float64s(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks(8).map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap())).collect()
}

/// Returns the numbers of nested arrays with this shape, row-major. NaN stands for null.
fn flat(value: &Value, shape: &[usize]) -> Vec<f64> {
    match (value, shape.split_first()) {
        (Value::Null, _) => vec![f64::NAN; shape.iter().product()],
        (Value::Number(number), None) => vec![number.as_f64().unwrap()],
        (Value::Array(items), Some((&length, rest))) => {
            assert_eq!(items.len(), length);
            items.iter().flat_map(|item| flat(item, rest)).collect()
        }
        other => panic!("{other:?}"),
    }
}

fn are_same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
}

/// Returns a request with one query on the surface and one at which the normal is undefined.
fn with_null(route: &Route) -> Value {
    let mut request = route.with("/queries", &json!([[0, 0, 1], [0, 0, 0]]));
    if route.is_geometry() {
        request["kernel"] = json!({"family": "gauss", "length_scale": 2});
        request["alpha"] = json!(1e-6);
    }
    if !route.has_geometry && route.is_geometry() {
        request["surface_model"] = json!("signature");
    }
    if route.has_geometry {
        request["surface"] = json!({"model": "signature"});
    }
    request
}

#[tokio::test]
async fn safetensors_answers_hold_what_json_answers_hold() {
    let server = Server::start().await;
    for route in &ROUTES {
        let request = with_null(route);
        let mut json =
            serde_json::from_str::<Value>(ask(&server, route.path, &request, JSON).await.text()).unwrap();
        let answer = ask(&server, route.path, &request, SAFETENSORS).await;
        let tensors = SafeTensors::deserialize(&answer.bytes).unwrap();
        let members = json.as_object_mut().unwrap();
        let mut n_nulls = 0;
        for (name, tensor) in tensors.iter() {
            let expected = flat(&members.remove(name).unwrap(), tensor.shape());
            assert_eq!(tensor.dtype(), Dtype::F64);
            assert!(are_same(&float64s(tensor.data()), &expected), "{} {name}", route.path);
            n_nulls += expected.iter().filter(|x| x.is_nan()).count();
        }
        assert_eq!(n_nulls > 0, route.is_geometry(), "{}: {json}", route.path);
        let (_, metadata) = SafeTensors::read_metadata(&answer.bytes).unwrap();
        let rest: Value = serde_json::from_str(&metadata.metadata().as_ref().unwrap()["response"]).unwrap();
        assert_eq!(rest, json, "{}", route.path);
    }
}

#[tokio::test]
async fn matrices_come_as_npy_and_nothing_else_does() {
    let server = Server::start().await;
    for route in &ROUTES {
        let request = with_null(route);
        let member = match route.path {
            "/v1/laplace-beltrami/matrix" => "matrix",
            "/v1/surface-gradient/matrix" => "matrices",
            _ => {
                let refused = [("content-type", JSON), ("accept", NPY)];
                assert_eq!(post(&server, route.path, &refused, request.to_string()).await.status, 406);
                continue;
            }
        };
        let json: Value =
            serde_json::from_str(ask(&server, route.path, &request, JSON).await.text()).unwrap();
        let answer = ask(&server, route.path, &request, NPY).await;
        let n_header = 10 + usize::from(u16::from_le_bytes(answer.bytes[8..10].try_into().unwrap()));
        let header = str::from_utf8(&answer.bytes[10..n_header]).unwrap();
        let shape = if member == "matrix" { vec![2, 20] } else { vec![3, 2, 20] };
        let shown = if member == "matrix" { "(2, 20,)" } else { "(3, 2, 20,)" };
        let expected = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shown}, }}");
        assert_eq!(header.trim_end(), expected);
        let expected = flat(&json[member], &shape);
        assert!(expected.iter().any(|x| x.is_nan()));
        assert!(are_same(&float64s(&answer.bytes[n_header..]), &expected));
        assert_eq!(answer.header("content-length"), answer.bytes.len().to_string());
        assert!(answer.header("server-timing").contains("encode;dur="));
    }
}

/// Returns the request as safetensors: arrays of numbers as tensors, the rest as metadata.
fn as_safetensors(request: &Value) -> Vec<u8> {
    let mut rest = request.clone();
    let mut tensors = Vec::new();
    for name in
        ["values", "queries", "cloud.points", "surface.cloud.points", "noise_variances", "points", "normals"]
    {
        let (parent, member) = name.rsplit_once('.').unwrap_or(("", name));
        let pointer =
            if parent.is_empty() { String::new() } else { format!("/{}", parent.replace('.', "/")) };
        let Some(parent) = rest.pointer_mut(&pointer).and_then(Value::as_object_mut) else { continue };
        let Some(array) = parent.remove(member) else { continue };
        let n = array.as_array().unwrap().len();
        let numbers = numbers(&array);
        let shape = if array[0].is_array() { vec![n, numbers.len() / n] } else { vec![n] };
        tensors.push((name, shape, numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()));
    }
    let views = tensors
        .iter()
        .map(|(name, shape, data)| (*name, TensorView::new(Dtype::F64, shape.clone(), data).unwrap()));
    let metadata = HashMap::from([("request".to_owned(), rest.to_string())]);
    safetensors::serialize(views, Some(metadata)).unwrap()
}

#[tokio::test]
async fn safetensors_requests_are_answered_as_json_requests() {
    let server = Server::start().await;
    for route in &ROUTES {
        let mut request = route.with("/queries", &json!([[0.5, 0.5, 2.0]]));
        request.as_object_mut().unwrap().remove("alpha");
        request["noise_variances"] = json!((0..20).map(|i| 1e-6 * f64::from(1 + i)).collect::<Vec<_>>());
        if route.has_geometry {
            request["surface"] = json!({"cloud": {"points": fibonacci_sphere(30)}, "alpha": 1e-8});
        }
        let first = ask(&server, route.path, &request, JSON).await;
        let second =
            post(&server, route.path, &[("content-type", SAFETENSORS)], as_safetensors(&request)).await;
        assert_eq!(second.header("cache-status"), "gramian; hit", "{}: {}", route.path, second.text());
        assert_eq!(first.text(), second.text());
        request["values"] = json!([1, 2]);
        request["frobnicate"] = json!(1);
        let refused =
            post(&server, route.path, &[("content-type", SAFETENSORS)], as_safetensors(&request)).await;
        assert_eq!(refused.status, 422, "{}", refused.text());
    }
    let cloud = json!({"points": fibonacci_sphere(5), "normals": fibonacci_sphere(5)});
    let json = server.post("/v1/clouds", &cloud).await;
    let known = post(&server, "/v1/clouds", &[("content-type", SAFETENSORS)], as_safetensors(&cloud)).await;
    assert_eq!((json.status, known.status, json.text.as_str()), (201, 200, known.text()));
}

#[tokio::test]
async fn clouds_come_as_npy_too() {
    let server = Server::start().await;
    let points = fibonacci_sphere(5);
    let known = server.post("/v1/clouds", &json!({"points": points})).await;
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (5, 3), }\n";
    let mut body = b"\x93NUMPY\x01\x00".to_vec();
    body.extend((header.len() as u16).to_le_bytes());
    body.extend(header.bytes());
    body.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    let answer = post(&server, "/v1/clouds", &[("content-type", NPY)], body.clone()).await;
    assert_eq!((answer.status, answer.text()), (200, known.text.as_str()));
    let infinite = body.len() - 8;
    body[infinite..].copy_from_slice(&f64::INFINITY.to_le_bytes());
    let refused = post(&server, "/v1/clouds", &[("content-type", NPY)], body).await;
    let problem: Value = serde_json::from_str(refused.text()).unwrap();
    assert_eq!((refused.status, &problem["errors"][0]["pointer"]), (422, &json!("/points/4/2")));
}

/// Returns a PLY file as a scanner writes it: text, or 64-bit numbers in either byte order.
fn scan(format: &str, points: &[[f64; 3]], normals: &[[f64; 3]]) -> Vec<u8> {
    let names = ["x", "y", "z", "nx", "ny", "nz"];
    let properties: String = names.iter().map(|name| format!("property double {name}\r\n")).collect();
    let head = format!(
        "ply\r\nformat {format} 1.0\r\ncomment a scan\r\nelement vertex {}\r\n{properties}element face 1\r\n\
         property list uchar int vertex_indices\r\nend_header\r\n",
        points.len()
    );
    let mut body = head.into_bytes();
    for (x, normal) in points.iter().zip(normals) {
        let numbers = x.iter().chain(normal);
        match format {
            "ascii" => {
                let words: Vec<String> = numbers.map(|x| x.to_string()).collect();
                writeln!(body, "{}", words.join(" ")).unwrap();
            }
            "binary_big_endian" => body.extend(numbers.flat_map(|x| x.to_be_bytes())),
            _ => body.extend(numbers.flat_map(|x| x.to_le_bytes())),
        }
    }
    body.extend(if format == "ascii" { &b"3 0 1 2\n"[..] } else { &[0] });
    body
}

#[tokio::test]
async fn clouds_come_as_scanners_write_them() {
    let server = Server::start().await;
    let (points, normals) = (fibonacci_sphere(5), fibonacci_sphere(5));
    let known = server.post("/v1/clouds", &json!({"points": points, "normals": normals})).await;
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let body = scan(format, &points, &normals);
        let answer = post(&server, "/v1/clouds", &[("content-type", PLY)], body.clone()).await;
        assert_eq!((answer.status, answer.text()), (200, known.text.as_str()), "{format}");
        for coding in ["gzip", "zstd"] {
            let headers = [("content-type", PLY), ("content-encoding", coding)];
            let answer = post(&server, "/v1/clouds", &headers, compressed(coding, &body)).await;
            assert_eq!((answer.status, answer.text()), (200, known.text.as_str()), "{format} {coding}");
        }
    }
    // Only the registration of clouds accepts files.
    let route = route_of("/v1/normals");
    assert_eq!(post(&server, route.path, &[("content-type", PLY)], "").await.status, 415);
}

#[tokio::test]
async fn scans_that_cannot_be_read_are_refused_with_their_place() {
    let server = Server::with_flags(&["--max-points", "5"]).await;
    let (points, normals) = (fibonacci_sphere(5), fibonacci_sphere(5));
    let refused = async |body: Vec<u8>, status: u16, slug: &str| {
        let answer = post(&server, "/v1/clouds", &[("content-type", PLY)], body).await;
        let problem: Value = serde_json::from_str(answer.text()).unwrap();
        assert_eq!(
            (answer.status, &problem["type"]),
            (status, &json!(format!("/problems/{slug}"))),
            "{problem}"
        );
        problem
    };
    for format in ["ascii", "binary_little_endian"] {
        let mut unknown = normals.clone();
        unknown[3] = [0.0; 3];
        let problem = refused(scan(format, &points, &unknown), 422, "invalid-cloud").await;
        assert_eq!(problem["errors"][0]["pointer"], "/normals/3");
        assert!(problem["detail"].as_str().unwrap().contains("leave out this point"), "{problem}");
        let mut missing = points.clone();
        missing[2][1] = f64::NAN;
        let problem = refused(scan(format, &missing, &normals), 422, "invalid-request").await;
        assert_eq!(problem["errors"][0]["pointer"], "/points/2/1");
        let six = (fibonacci_sphere(6), fibonacci_sphere(6));
        let problem = refused(scan(format, &six.0, &six.1), 413, "problem-too-large").await;
        assert_eq!((&problem["limit"], &problem["required"]), (&json!(5), &json!(6)));
        let body = scan(format, &points, &normals);
        let problem = refused(body[..body.len() / 4 * 3].to_vec(), 400, "malformed-body").await;
        assert!(problem["detail"].as_str().unwrap().contains("element vertex"), "{problem}");
        refused(body[1..].to_vec(), 400, "malformed-body").await;
    }
    refused(Vec::new(), 400, "malformed-body").await;
    refused(scan("ascii", &[], &[]), 422, "invalid-cloud").await;
    assert_eq!(server.get("/v1/clouds").await.expect_ok()["clouds"], json!([]));
}

fn compressed(coding: &str, bytes: &[u8]) -> Vec<u8> {
    if coding == "zstd" {
        return zstd::encode_all(bytes, 3).unwrap();
    }
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[tokio::test]
async fn bodies_may_be_compressed_both_ways() {
    let server = Server::start().await;
    for route in &ROUTES {
        let request = route.request().to_string();
        server.post_text(route.path, request.clone()).await.expect_ok();
        let plain = server.post_text(route.path, request.clone()).await.text;
        for coding in ["gzip", "zstd"] {
            let headers = [("content-type", JSON), ("content-encoding", coding), ("accept-encoding", coding)];
            let answer = post(&server, route.path, &headers, compressed(coding, request.as_bytes())).await;
            let is_compressed = answer.header("content-encoding") == coding;
            assert_eq!((answer.status, is_compressed), (200, plain.len() >= 1024), "{}", route.path);
            let found = if is_compressed { decompressed(coding, &answer.bytes) } else { answer.bytes };
            assert_eq!(found, plain.as_bytes());
            let headers = [("content-type", SAFETENSORS), ("content-encoding", coding)];
            let body = compressed(coding, &as_safetensors(&route.request()));
            assert_eq!(post(&server, route.path, &headers, body).await.text(), plain);
        }
    }
}

#[tokio::test]
async fn small_and_binary_answers_are_compressed_only_if_they_must_be() {
    let server = Server::start().await;
    let small =
        json!({"cloud": {"points": [[0], [1]]}, "values": [1, 2], "kernel": {"family": "gauss"}, "alpha": 1});
    let coding = async |path: &str, body: &Value, accept: &str, accept_encoding: &str| {
        let headers = [("content-type", JSON), ("accept", accept), ("accept-encoding", accept_encoding)];
        let answer = post(&server, path, &headers, body.to_string()).await;
        assert_eq!(answer.status, 200);
        answer.header("content-encoding").to_owned()
    };
    assert_eq!(coding("/v1/interpolation", &small, JSON, "gzip, zstd").await, "");
    let route = route_of("/v1/laplace-beltrami/matrix");
    assert_eq!(coding(route.path, &route.request(), NPY, "gzip, zstd").await, "");
    assert_eq!(coding(route.path, &route.request(), NPY, "zstd, identity;q=0.5").await, "zstd");
    assert_eq!(coding(route.path, &route.request(), JSON, "gzip, zstd").await, "zstd");
    assert_eq!(coding(route.path, &route.request(), JSON, "br").await, "");
}

#[tokio::test]
async fn what_decompresses_beyond_the_limit_is_too_large() {
    let server = Server::with_flags(&["--max-body-bytes", "4000"]).await;
    let route = route_of("/v1/interpolation");
    let good = route.request().to_string();
    for coding in ["gzip", "zstd"] {
        let headers = [("content-type", JSON), ("content-encoding", coding)];
        for (length, status) in [(4000, 200), (4001, 413), (10_000_000, 413)] {
            let body = format!("{good}{}", " ".repeat(length - good.len()));
            let answer = post(&server, route.path, &headers, compressed(coding, body.as_bytes())).await;
            assert_eq!(answer.status, status, "{}", answer.text());
        }
    }
}

/// Returns a request for a matrix with more numbers than are encoded at once, and with rows of null.
fn large_request() -> Value {
    let points = fibonacci_sphere(200);
    let mut queries = points.clone();
    queries[3] = [0.0; 3];
    json!({
        "cloud": {"points": points},
        "kernel": {"family": "gauss", "length_scale": 0.5},
        "alpha": 1e-6,
        "queries": queries,
        "surface": {"model": "signature"},
    })
}

#[tokio::test]
async fn large_answers_are_streamed_to_the_same_text() {
    let server = Server::start().await;
    let path = "/v1/surface-gradient/matrix";
    let npy = ask(&server, path, &large_request(), NPY).await;
    let expected = float64s(&npy.bytes[npy.bytes.len() - 8 * 3 * 200 * 200..]);
    let streamed = ask(&server, path, &large_request(), JSON).await;
    assert_eq!((streamed.header("content-length"), streamed.header("transfer-encoding")), ("", "chunked"));
    assert!(!streamed.header("server-timing").contains("encode"));
    let json: Value = serde_json::from_str(streamed.text()).unwrap();
    let found = flat(&json["matrices"], &[3, 200, 200]);
    assert!(are_same(&found, &expected) && json["matrices"][1][3].is_null());
    assert_eq!(json["diagnostics"]["n_queries"], 200);
    for coding in ["gzip", "zstd"] {
        for (accept, plain) in [(JSON, &streamed.bytes), (NPY, &npy.bytes)] {
            let accept_encoding = format!("{coding}, identity;q=0.5");
            let headers = [("content-type", JSON), ("accept", accept), ("accept-encoding", &accept_encoding)];
            let answer = post(&server, path, &headers, large_request().to_string()).await;
            assert_eq!(answer.header("content-encoding"), coding);
            assert!(decompressed(coding, &answer.bytes) == *plain, "{coding} {accept}");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_reads_nothing_holds_no_thread() {
    // Two threads, so that a client has jobs that wait for a thread while others run.
    let server = Server::with_flags(&["--threads", "2", "--max-queue", "0"]).await;
    let points = fibonacci_sphere(1000);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let request = json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6}).to_string();
    let mut stalled = Vec::new();
    for accept_encoding in ["identity", "gzip", "identity", "gzip", "identity", "identity"] {
        let mut stream = TcpStream::connect(server.address).await.unwrap();
        let head = format!(
            "POST /v1/laplace-beltrami/matrix HTTP/1.1\r\nHost: test\r\nContent-Type: {JSON}\r\nConnection: close\r\n\
             Accept-Encoding: {accept_encoding}\r\nContent-Length: {}\r\n\r\n{request}",
            request.len()
        );
        stream.write_all(head.as_bytes()).await.unwrap();
        // The answer, some 20 MB, has begun. The rest waits in the sockets and in the server.
        let mut status = [0; 12];
        stream.read_exact(&mut status).await.unwrap();
        assert_eq!(&status, b"HTTP/1.1 200");
        stalled.push(stream);
    }
    for _ in 0..3 {
        for route in &ROUTES {
            server.post(route.path, &route.request()).await.expect_ok();
        }
    }
    let mut rest = Vec::new();
    stalled[0].read_to_end(&mut rest).await.unwrap();
    assert!(rest.len() > 16 << 20 && rest.ends_with(b"\r\n0\r\n\r\n"), "{} bytes", rest.len());
}

#[tokio::test]
async fn every_documented_media_type_is_served_and_no_other() {
    let server = Server::start().await;
    let document = crate::support::document();
    for route in &ROUTES {
        let operation = &document["paths"][route.path]["post"];
        let documented = |content: &Value, media_type: &str| content.get(media_type).is_some();
        for media_type in [JSON, SAFETENSORS, NPY, PLY] {
            let headers = [("content-type", JSON), ("accept", media_type)];
            let answer = post(&server, route.path, &headers, route.request().to_string()).await;
            let is_served = answer.status == 200 && answer.header("content-type") == media_type;
            let content = &operation["responses"]["200"]["content"];
            assert_eq!(is_served, documented(content, media_type), "{} {media_type}", route.path);
            let sent = post(&server, route.path, &[("content-type", media_type)], "").await;
            let content = &operation["requestBody"]["content"];
            assert_eq!(sent.status != 415, documented(content, media_type), "{} {media_type}", route.path);
        }
    }
    let content = &document["paths"]["/v1/clouds"]["post"]["requestBody"]["content"];
    assert!([JSON, SAFETENSORS, NPY, PLY].iter().all(|media_type| content.get(media_type).is_some()));
}
