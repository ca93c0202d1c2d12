//! Bodies as an attacker writes them. Each is read or refused in seconds and without a panic. Its memory is
//! at most three times its size, besides what the limits let a request keep.
//!
//! These tests are a process of their own, because its allocator counts. They run one at a time, since the
//! count covers all threads.

// The lint keeps locks and waits off the threads of pools. The threads of tests belong to no pool.
#![allow(clippy::disallowed_methods)]

use std::collections::HashMap;
use std::io::Write;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use gramian::http::fields::limits::{Limits, unobserved};
use gramian::http::problem::Problem;
use gramian_host::wire::negotiation::{BodyFormat, Coding};
use gramian_host::wire::read::body::RequestBody;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use safetensors::Dtype;
use safetensors::tensor::TensorView;
use serde::Deserialize;
use serde_json::Value;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Bytes that any request may take, however small: tables of decoders, messages, a header of tensors.
const BASE_BYTES: usize = 2 << 20;

/// Size limit of bodies, three quarters of the default, so that the bodies here can be smaller.
const LIMIT_BYTES: usize = 48 << 20;

const LIMITS: Limits = Limits { max_points: 2000, max_queries: 3000, max_dimension: 16 };

/// A request with every kind of member.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "it is parsed and dropped")]
struct Request {
    cloud: Cloud,
    kernel: Option<Kernel>,
    values: Option<Vec<f64>>,
    #[serde(default, deserialize_with = "present_unless_empty")]
    noise_variances: Option<Vec<f64>>,
    queries: Option<Points>,
    include: Option<Vec<Family>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "it is parsed and dropped")]
struct Cloud {
    id: Option<String>,
    points: Option<Points>,
    #[serde(default, deserialize_with = "present_unless_empty")]
    normals: Option<Points>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "it is parsed and dropped")]
struct Kernel {
    family: Option<Family>,
    length_scale: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Family {
    Gauss,
    Matern,
}

/// A cloud, as in npy and PLY files.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "it is parsed and dropped")]
struct CloudRequest {
    points: Points,
    #[serde(default, deserialize_with = "present_unless_empty")]
    normals: Option<Points>,
}

/// Accepts every unpacked size.
fn is_room(_n_bytes: usize) -> Result<(), Problem> {
    Ok(())
}

struct Outcome {
    /// Problem document, if the body was refused.
    problem: Option<Value>,
    /// Peak bytes, including the body itself.
    peak: usize,
    took: Duration,
}

fn parse(format: BodyFormat, coding: Coding, body: &[u8]) -> Outcome {
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let began = Instant::now();
    let request = RequestBody::new(format, coding, body.to_vec(), LIMIT_BYTES);
    let lists = LIMITS.lists();
    let context = unobserved(&lists);
    let unpacked = request.unpack(&context, is_room);
    let problem = match (unpacked, format) {
        (Err(problem), _) => Some(problem),
        (Ok(body), BodyFormat::Npy | BodyFormat::Ply) => body.parse::<CloudRequest>(&context).err(),
        (Ok(body), BodyFormat::Json | BodyFormat::Safetensors) => body.parse::<Request>(&context).err(),
    };
    let took = began.elapsed();
    let peak = ALLOCATOR.peak_usage() - before;
    let problem = problem.map(|problem| serde_json::to_value(problem.document("")).unwrap());
    Outcome { problem, peak, took }
}

fn kind(outcome: &Outcome) -> &str {
    outcome.problem.as_ref().map_or("accepted", |problem| problem["type"].as_str().unwrap())
}

/// Parses a body, and checks its outcome, its time and its memory.
fn expect(what: &str, format: BodyFormat, body: &[u8], expected: &str) -> Outcome {
    let outcome = parse(format, Coding::Identity, body);
    assert_eq!(kind(&outcome), expected, "{what}: {:?}", outcome.problem);
    let allowed = 3 * body.len() + BASE_BYTES;
    assert!(outcome.peak <= allowed, "{what}: {} bytes at the peak for {} of body", outcome.peak, body.len());
    assert!(outcome.took < Duration::from_secs(20), "{what}: {:?}", outcome.took);
    outcome
}

const N_BYTES: usize = 8 << 20;

fn repeated(head: &str, text: &str, tail: &str) -> Vec<u8> {
    format!("{head}{}{tail}", text.repeat(N_BYTES / text.len())).into_bytes()
}

fn pointer(outcome: &Outcome) -> &str {
    outcome.problem.as_ref().and_then(|problem| problem["errors"][0]["pointer"].as_str()).unwrap_or("-")
}

#[test]
fn lists_beyond_the_limits_are_counted_but_not_kept() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    for (head, text, tail, at, limit, length) in [
        (r#"{"values":[0"#, ",1", "]}", "/values", 2000, N_BYTES / 2 + 1),
        (r#"{"noise_variances":[0"#, ",0.25", "]}", "/noise_variances", 2000, N_BYTES / 5 + 1),
        (r#"{"cloud":{"points":[[0]"#, ",[1]", "]}}", "/cloud/points", 2000, N_BYTES / 4 + 1),
        (r#"{"cloud":{"points":[[]"#, ",[]", "]}}", "/cloud/points", 2000, N_BYTES / 3 + 1),
        (r#"{"cloud":{"normals":[[]"#, ",[1,2]", "]}}", "/cloud/normals", 2000, N_BYTES / 6 + 1),
        (r#"{"cloud":{"points":[[0"#, ",1", "]]}}", "/cloud/points", 16, N_BYTES / 2 + 1),
        (r#"{"queries":[[0,0]"#, ",[1,2]", "]}", "/queries", 3000, N_BYTES / 6 + 1),
        // An escape sequence leaves the text to the slower parser.
        (r#"{"kernel":{"family":"g\u0061uss"},"values":[0"#, ",1", "]}", "/values", 2000, N_BYTES / 2 + 1),
        (r#"{"kernel":{"family":"g\u0061uss"},"queries":[[0"#, ",1", "]]}", "/queries", 16, N_BYTES / 2 + 1),
    ] {
        let outcome =
            expect(head, BodyFormat::Json, &repeated(head, text, tail), "/problems/problem-too-large");
        let problem = outcome.problem.as_ref().unwrap();
        assert_eq!((pointer(&outcome), &problem["limit"]), (at, &limit.into()), "{problem}");
        assert_eq!(problem["required"], length, "{problem}");
        assert!(outcome.peak < N_BYTES + N_BYTES / 4 + BASE_BYTES, "{head}: {}", outcome.peak);
    }
}

#[test]
fn texts_nesting_and_names_of_megabytes_are_refused_in_bounds() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    for (head, text, tail, expected, at) in [
        (r#"{"values":["#, "[", "", "malformed-json", "-"),
        (r#"{"cloud":{"points":["#, "[", "", "malformed-json", "-"),
        (r#"{"cloud":{"id":"#, r#"{"a":"#, "", "malformed-json", "-"),
        (r#"{"values":[""#, "\u{7f}", r#""]}"#, "invalid-request", "/values/0"),
        (r#"{"values":[""#, r"\u0007", r#""]}"#, "invalid-request", "/values/0"),
        (r#"{"values":""#, "\u{7f}", r#""}"#, "invalid-request", "/values"),
        (r#"{"cloud":""#, "\u{7f}", r#""}"#, "invalid-request", "/cloud"),
        (r#"{"cloud":{"points":[["#, "1", "]]}}", "malformed-json", "-"),
        (r#"{"cloud":{"points":[[0."#, "1", "]]}}", "accepted", "-"),
        (r#"{"kernel":{"family":""#, "\u{7f}", r#""}}"#, "invalid-request", "/kernel/family"),
        (r#"{"kernel":{"length_scale":""#, "\u{7f}", r#""}}"#, "invalid-request", "/kernel/length_scale"),
        (r#"{"cloud":{"id":""#, "0", r#""}}"#, "accepted", "-"),
        (r#"{"include":["gauss""#, r#","gauss""#, r#"],"cloud":{}}"#, "accepted", "-"),
        (r#"{"include":["gauss""#, r#","matern""#, r#",1]}"#, "invalid-request", "/include/932068"),
        (r#"{"cloud":{"points":[[0],[1,2]"#, " ", r#",[3,"x"]]}}"#, "invalid-request", "/cloud/points/2/1"),
    ] {
        let expected = if expected == "accepted" { expected.into() } else { format!("/problems/{expected}") };
        let outcome = expect(head, BodyFormat::Json, &repeated(head, text, tail), &expected);
        if at != "-" {
            assert_eq!(pointer(&outcome), at);
        }
        let n_shown = outcome.problem.map_or(0, |problem| problem.to_string().len());
        assert!(n_shown < 4000, "{head}: {n_shown} bytes of problem");
    }
    let named = expect(
        "a name",
        BodyFormat::Json,
        &repeated(r#"{""#, "\u{7f}", r#"":1}"#),
        "/problems/invalid-request",
    );
    assert!(pointer(&named).len() < 300);
    let n = 1 << 20;
    let nested = format!(r#"{{"cloud":{{"points":[[{}{}]]}}}}"#, "[".repeat(n), "]".repeat(n));
    expect("closed", BodyFormat::Json, nested.as_bytes(), "/problems/malformed-json");
}

/// Returns a safetensors file with this header, as it is.
fn with_header(header: &str, data: &[u8]) -> Vec<u8> {
    [&(header.len() as u64).to_le_bytes(), header.as_bytes(), data].concat()
}

#[test]
fn headers_of_tensors_are_bounded() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let metadata =
        |text: &str| format!(r#"{{"__metadata__":{{"request":{}}}}}"#, serde_json::to_string(text).unwrap());
    let tensor = |name: usize| format!(r#""{name}":{{"dtype":"F64","shape":[0],"data_offsets":[0,0]}}"#);
    let tensors = |n: usize| format!("{{{}}}", (0..n).map(tensor).collect::<Vec<_>>().join(","));
    let refused = |what: &str, header: String, expected: &str| {
        expect(what, BodyFormat::Safetensors, &with_header(&header, &[]), &format!("/problems/{expected}"))
    };
    for text in ["[[[[", "[1,1]", "{}", "\u{7f}"].map(|text| text.repeat(N_BYTES / text.len())) {
        let outcome = refused("a long text", metadata(&text), "body-too-large");
        let problem = outcome.problem.unwrap();
        assert!(problem["limit"].as_u64() < problem["required"].as_u64(), "{problem}");
        assert!(problem["detail"].as_str().unwrap().contains("tensors"), "{problem}");
    }
    refused("200,000 tensors", tensors(200_000), "body-too-large");
    refused("1,000 tensors", tensors(1000), "invalid-request");
    refused("nested", metadata(&"[".repeat(50_000)), "malformed-json");
    let nested = format!(r#"{{"values": {}{}}}"#, "[".repeat(30_000), "]".repeat(30_000));
    refused("nested and closed", metadata(&nested), "malformed-json");
    let deep =
        format!(r#"{{"{}":{{"dtype":"F64","shape":[0],"data_offsets":[0,0]}}}}"#, "cloud.".repeat(10_000));
    refused("a path", deep, "invalid-request");
    let shape =
        format!(r#"{{"values":{{"dtype":"F64","shape":[0{}],"data_offsets":[0,0]}}}}"#, ",1".repeat(30_000));
    assert_eq!(pointer(&refused("a shape", shape, "invalid-request")), "/values");
}

#[test]
fn tensors_beyond_the_limits_are_refused_by_their_shape() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let n = N_BYTES / 4;
    for (name, shape, at, limit, required) in [
        ("values", format!("[{n}]"), "/values", 2000, n),
        ("queries", format!("[{n},1]"), "/queries", 3000, n),
        ("cloud.points", format!("[3,{}]", n / 3), "/cloud/points", 16, n / 3),
        ("cloud.points", format!("[{},3]", n / 3), "/cloud/points", 2000, n / 3),
    ] {
        let n_bytes = if shape.contains(",3") || shape.contains("[3") { n / 3 * 12 } else { 4 * n };
        let header =
            format!(r#"{{"{name}":{{"dtype":"F32","shape":{shape},"data_offsets":[0,{n_bytes}]}}}}"#);
        let body = with_header(&header, &vec![0; n_bytes]);
        let outcome = expect(name, BodyFormat::Safetensors, &body, "/problems/problem-too-large");
        let problem = outcome.problem.as_ref().unwrap();
        assert_eq!((pointer(&outcome), &problem["limit"]), (at, &limit.into()), "{problem}");
        assert_eq!(problem["required"], required, "{problem}");
        assert!(outcome.peak < body.len() + BASE_BYTES);
    }
    for header in ["1,".repeat(N_BYTES / 2), "1,".repeat(30_000), "(".repeat(30_000)] {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({header})}}");
        let mut body = b"\x93NUMPY\x02\x00".to_vec();
        body.extend((header.len() as u32).to_le_bytes());
        body.extend(header.bytes());
        expect("a header of npy", BodyFormat::Npy, &body, "/problems/malformed-body");
    }
}

fn packed(coding: Coding, plain: &[u8]) -> Vec<u8> {
    match coding {
        Coding::Identity => plain.to_vec(),
        Coding::Zstd => zstd::encode_all(plain, 3).unwrap(),
        Coding::Gzip => {
            let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
            encoder.write_all(plain).unwrap();
            encoder.finish().unwrap()
        }
    }
}

#[test]
fn compressed_bodies_take_their_plain_size_at_most() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    for coding in [Coding::Gzip, Coding::Zstd] {
        let mut plain = br#"{"cloud":{}"#.to_vec();
        plain.resize(LIMIT_BYTES, b' ');
        *plain.last_mut().unwrap() = b'}';
        let body = packed(coding, &plain);
        let outcome = parse(BodyFormat::Json, coding, &body);
        assert_eq!(kind(&outcome), "accepted");
        assert!(outcome.peak <= plain.len() + body.len() + BASE_BYTES, "{coding:?}: {}", outcome.peak);
        plain.push(b' ');
        let body = packed(coding, &plain);
        let outcome = parse(BodyFormat::Json, coding, &body);
        assert_eq!(kind(&outcome), "/problems/body-too-large");
        assert!(outcome.peak <= body.len() + BASE_BYTES, "{coding:?}: {}", outcome.peak);
        // A body of nothing but empty compressed members.
        let member = packed(coding, b"");
        let outcome = parse(BodyFormat::Json, coding, &member.repeat((1 << 20) / member.len()));
        assert_eq!(kind(&outcome), "/problems/malformed-json");
        assert!(outcome.took < Duration::from_secs(20), "{coding:?}: {:?}", outcome.took);
    }
}

fn json() -> Vec<u8> {
    let text = r#"{"cloud": {"points": [[0.5, 1, -2e3], [3, 4.25, 5]], "normals": [[1, 0, 0], [0, 1, 0]]},
        "kernel": {"family": "g\u0061uss", "length_scale": 0.5}, "values": [1, 2], "noise_variances": [],
        "queries": [[1, 2, 3]], "include": ["gauss", "matern"]}"#;
    text.as_bytes().to_vec()
}

fn safetensors() -> Vec<u8> {
    let data: Vec<u8> = (0..12).flat_map(|i| f64::from(i).to_le_bytes()).collect();
    let view = |shape: &[usize]| {
        let n_bytes = 8 * shape.iter().product::<usize>();
        TensorView::new(Dtype::F64, shape.to_vec(), &data[..n_bytes]).unwrap()
    };
    let tensors = [("cloud.points", view(&[2, 3])), ("values", view(&[2])), ("queries", view(&[4, 3]))];
    let request = r#"{"kernel": {"family": "matern"}, "cloud": {"normals": []}, "include": ["gauss"]}"#;
    let metadata = HashMap::from([("request".to_owned(), request.to_owned())]);
    safetensors::serialize(tensors, Some(metadata)).unwrap()
}

fn npy() -> Vec<u8> {
    let header = "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }          \n";
    let mut body = b"\x93NUMPY\x01\x00".to_vec();
    body.extend((header.len() as u16).to_le_bytes());
    body.extend(header.bytes());
    body.extend((0..6).flat_map(|i| f64::from(i).to_le_bytes()));
    body
}

fn ply_head(format: &str, n_vertices: usize) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made here\nelement camera 1\nproperty list uchar int views\nelement vertex {n_vertices}\n\
         property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty list uchar short edges\n\
         property float nx\nproperty float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_indices\n\
         end_header\n"
    )
}

fn ply_in_text() -> Vec<u8> {
    format!("{}2 7 8\n0.5 1 -2e3 255 0 1 0 0\n3 4.25 5 0 2 1 0 0 1 0\n3 0 1 0\n", ply_head("ascii", 2))
        .into_bytes()
}

fn ply_in_binary() -> Vec<u8> {
    let mut body = ply_head("binary_big_endian", 2).into_bytes();
    body.extend([1, 0, 0, 0, 7]);
    for edges in [&[][..], &[0, 1, 0, 2]] {
        (0..3).for_each(|i: u8| body.extend(f32::from(i).to_be_bytes()));
        body.extend([255, edges.len() as u8 / 2]);
        body.extend(edges);
        (1..4).for_each(|i: u8| body.extend(f32::from(i).to_be_bytes()));
    }
    body.extend([1, 0, 0, 0, 1]);
    body
}

#[test]
fn files_that_announce_more_than_they_have_take_nothing_for_it() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for count in ["3", "1000000000000", "18446744073709551615"] {
            for what in ["element vertex 2", "element camera 1"] {
                let (name, _) = what.rsplit_once(' ').unwrap();
                let head = ply_head(format, 2).replace(what, &format!("{name} {count}"));
                expect(what, BodyFormat::Ply, head.as_bytes(), "/problems/malformed-body");
            }
        }
    }
    let head = ply_head("binary_little_endian", 2);
    let endless = head.replace("end_header", &"comment 0123456789\n".repeat(N_BYTES / 20));
    expect("a long header", BodyFormat::Ply, endless.as_bytes(), "/problems/malformed-body");
    let names = head.replace("property uchar red\n", &format!("property uchar {}\n", "r".repeat(60_000)));
    expect("a long name", BodyFormat::Ply, names.as_bytes(), "/problems/malformed-body");
    let words = format!("{}1 7\n{}", ply_head("ascii", 2), "x".repeat(N_BYTES));
    let outcome = expect("a long word", BodyFormat::Ply, words.as_bytes(), "/problems/malformed-body");
    assert!(outcome.problem.unwrap().to_string().len() < 1000);
    // Nothing is read beyond the limit of points.
    let many = format!("{}1 7\n{}", ply_head("ascii", 3000), "0 0 0 0 0 1 0 0\n".repeat(3000));
    let outcome = expect("many", BodyFormat::Ply, many.as_bytes(), "/problems/problem-too-large");
    assert!(pointer(&outcome) == "/points" && outcome.problem.unwrap()["required"] == 3000);
}

/// A change of a body at one place.
#[derive(Debug, Clone)]
enum Mutation {
    Set(u8),
    Insert(&'static [u8], usize),
    Remove(usize),
    Repeat(usize, usize),
    Cut,
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let tokens: &[&[u8]] = &[
        b"[",
        b"]",
        b"{",
        b"}",
        b",",
        b":",
        b"\"",
        b"0",
        b"-",
        b"1e",
        b"null",
        b"[1,2],",
        b"\\u",
        b"\xff",
        b"\0",
        b"\"values\":",
        b".",
        b" ",
        b"__metadata__",
        b"18446744073709551615",
        b"\n",
        b"property list uchar int q\n",
        b"element vertex 2000\n",
    ];
    prop_oneof![
        any::<u8>().prop_map(Mutation::Set),
        (proptest::sample::select(tokens), 1_usize..3000).prop_map(|(token, n)| Mutation::Insert(token, n)),
        (1_usize..40).prop_map(Mutation::Remove),
        (1_usize..60, 2_usize..500).prop_map(|(length, n)| Mutation::Repeat(length, n)),
        Just(Mutation::Cut),
    ]
}

fn mutate(body: &mut Vec<u8>, at: proptest::sample::Index, mutation: &Mutation) {
    if body.is_empty() {
        return;
    }
    let at = at.index(body.len());
    let end = |length: usize| body.len().min(at + length);
    match *mutation {
        Mutation::Set(byte) => body[at] = byte,
        Mutation::Insert(token, n) => drop(body.splice(at..at, token.repeat(n))),
        Mutation::Remove(length) => drop(body.drain(at..end(length))),
        Mutation::Repeat(length, n) => {
            let part = body[at..end(length)].repeat(n);
            body.splice(at..at, part);
        }
        Mutation::Cut => body.truncate(at),
    }
}

#[test]
fn mutated_bodies_are_read_or_refused() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let originals = [
        (BodyFormat::Json, json()),
        (BodyFormat::Safetensors, safetensors()),
        (BodyFormat::Npy, npy()),
        (BodyFormat::Ply, ply_in_text()),
        (BodyFormat::Ply, ply_in_binary()),
    ];
    for (format, body) in &originals {
        let outcome = parse(*format, Coding::Identity, body);
        assert_eq!(kind(&outcome), "accepted", "{format:?}: {:?}", outcome.problem);
    }
    let change = || (any::<proptest::sample::Index>(), mutation());
    let strategy = (
        proptest::sample::select(originals.to_vec()),
        proptest::sample::select(vec![Coding::Identity, Coding::Gzip, Coding::Zstd]),
        proptest::collection::vec(change(), 1..4),
        proptest::option::weighted(0.3, change()),
    );
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(9000) };
    let rng = proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha);
    let mut runner = proptest::test_runner::TestRunner::new_with_rng(config, rng);
    let outcome = runner.run(&strategy, |((format, mut plain), coding, changes, change)| {
        changes.iter().for_each(|(at, mutation)| mutate(&mut plain, *at, mutation));
        let mut body = packed(coding, &plain);
        if let Some((at, mutation)) = change {
            mutate(&mut body, at, &mutation);
        }
        let outcome = parse(format, coding, &body);
        // While a list of numbers grows, it takes up to twelve times its text. The limits bound its length.
        let allowed = 16 * plain.len().max(body.len()) + BASE_BYTES;
        prop_assert!(outcome.peak <= allowed, "{} bytes for {}", outcome.peak, plain.len());
        prop_assert!(outcome.took < Duration::from_secs(5), "{:?}", outcome.took);
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{error}"));
}
