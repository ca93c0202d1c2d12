//! Clouds that are hard for neighbour searches, on every route: as fast as others, and cancelled at their
//! deadline.

use std::time::{Duration, Instant};

use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use serde_json::{Value, json};

use crate::common::hostile::HOSTILE;
use crate::running::Process;
use crate::support::{http_client, unpooled};

/// Every route that computes, with its members besides cloud, values and kernel.
const REQUESTS: [(&str, &str); 22] = [
    ("/v1/interpolation", r#"{"derivatives": 2}"#),
    ("/v1/interpolation", r#"{"include": ["std"], "duplicates": "merge"}"#),
    ("/v1/interpolation/batch", r#"{}"#),
    (
        "/v1/posterior",
        r#"{"include": ["variances", "gradient_variances"], "solver": "local", "duplicates": "merge"}"#,
    ),
    ("/v1/posterior", r#"{"include": ["log_marginal_likelihood", "covariance"], "alpha": 0.01}"#),
    ("/v1/posterior/batch", r#"{"include": ["variances"], "alpha": 0.01}"#),
    ("/v1/normals", r#"{"surface_model": "offset", "duplicates": "merge"}"#),
    ("/v1/normals", r#"{"surface_model": "signature", "alpha": 0.01}"#),
    ("/v1/curvatures", r#"{"include": ["std"]}"#),
    ("/v1/curvatures", r#"{"surface_model": "regression", "duplicates": "merge"}"#),
    ("/v1/curvatures", r#"{"kernel": {"family": "matern", "nu": 4.5}, "alpha": 0.01}"#),
    ("/v1/surface-gradient", r#"{"include": ["std"]}"#),
    ("/v1/surface-gradient", r#"{"solver": "local"}"#),
    ("/v1/surface-gradient/matrix", r#"{"duplicates": "merge"}"#),
    ("/v1/surface-gradient/sparse-matrix", r#"{}"#),
    ("/v1/laplace-beltrami", r#"{"include": ["std"]}"#),
    ("/v1/laplace-beltrami", r#"{"solver": "local", "duplicates": "merge"}"#),
    ("/v1/laplace-beltrami/matrix", r#"{"alpha": 0.01}"#),
    ("/v1/laplace-beltrami/sparse-matrix", r#"{"duplicates": "merge"}"#),
    ("/v1/model-selection", r#"{"duplicates": "merge"}"#),
    ("/v1/model-selection", r#"{"criterion": "leave_one_out", "alpha": 0.01}"#),
    ("/v1/estimate", r#"{}"#),
];

/// Returns the body of a request.
fn body(path: &str, members: &str, cloud_id: &str, n_points: usize) -> Value {
    let mut body: Value = serde_json::from_str(members).unwrap();
    body["cloud"] = json!({"id": cloud_id});
    let values: Vec<f64> =
        (0..n_points).map(|i| (i as f64 * 0.618).fract() + (i as f64 * 1e-3).sin()).collect();
    match path {
        "/v1/estimate" => body["operation"] = json!("compute_normals"),
        _ if path.ends_with("/batch") => body["values"] = json!([values, values]),
        _ if path.ends_with("matrix") || path == "/v1/normals" || path == "/v1/curvatures" => {}
        _ => body["values"] = json!(values),
    }
    body
}

/// Returns a cloud as npy, compressed with zstd. Repeated positions become small.
fn packed(cloud: &Cloud) -> Vec<u8> {
    let shape = format!("({}, {})", cloud.n_points(), cloud.dimension());
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.as_bytes());
    cloud.coordinates().iter().for_each(|x| npy.extend(x.to_le_bytes()));
    zstd::encode_all(npy.as_slice(), 3).unwrap()
}

/// Returns the processor time that a process has used, s.
fn cpu_seconds(process: &Process) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.child.id())).unwrap();
    // After the name, which may contain blanks, fields 12 and 13 are user and system time in hundredths of a
    // second.
    let fields: Vec<&str> = stat.rsplit_once(") ").unwrap().1.split_whitespace().collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}

/// Returns the processor time until the process is idle, s.
async fn cpu_seconds_until_idle(process: &Process) -> f64 {
    let start = cpu_seconds(process);
    let mut before = start;
    loop {
        tokio::time::sleep(Duration::from_millis(200)).await;
        let now = cpu_seconds(process);
        if now - before < 0.03 || now - start > 20.0 {
            return now - start;
        }
        before = now;
    }
}

async fn register(process: &Process, client: &reqwest::Client, cloud: &Cloud) -> (u16, String) {
    let request = client.post(process.url("/v1/clouds")).header("content-type", "application/x-npy");
    let request = request.header("content-encoding", "zstd").body(packed(cloud));
    let answer = request.send().await.unwrap();
    let status = answer.status().as_u16();
    let answer: Value = answer.json().await.unwrap();
    (status, answer["cloud_id"].as_str().unwrap_or_default().to_owned())
}

/// Sends every request at once, and returns status and path of each answer.
async fn ask_all(
    process: &Process,
    client: &reqwest::Client,
    cloud_id: &str,
    n_points: usize,
) -> Vec<(u16, &'static str)> {
    let ask = |(path, members): (&'static str, &str)| {
        let request = client.post(process.url(path)).json(&body(path, members, cloud_id, n_points));
        async move { (request.send().await.unwrap().status().as_u16(), path) }
    };
    futures_util::future::join_all(REQUESTS.map(ask)).await
}

#[tokio::test]
async fn the_deadline_ends_the_work_on_every_route_whatever_the_cloud() {
    let flags = ["--deadline-seconds", "1", "--threads", "2", "--max-queue", "64"];
    let process = Process::start(&flags);
    let client = http_client().build().unwrap();
    // Too large to be factorized, and well within that limit.
    let large = HOSTILE.iter().map(|hostile| (hostile, 60_000));
    let small = HOSTILE.iter().step_by(4).map(|hostile| (hostile, 4000));
    let (mut n_ended, mut n_unregistered) = (0, 0);
    for (hostile, n_points) in large.chain(small) {
        let (status, id) = register(&process, &client, &hostile.cloud(n_points)).await;
        // On a shared machine, analysing a cloud may exceed the deadline by itself.
        let is_registered = status == 201;
        assert!(is_registered || status == 504, "{}: {status}", hostile.name);
        n_unregistered += usize::from(!is_registered);
        let answers = match is_registered {
            true => ask_all(&process, &client, &id, n_points).await,
            false => Vec::new(),
        };
        n_ended += answers.iter().filter(|(status, _)| *status == 504).count();
        let expected = |status: &u16| matches!(status, 200 | 413 | 422 | 503 | 504);
        assert!(answers.iter().all(|(status, _)| expected(status)), "{}: {answers:?}", hostile.name);
        // The process must be idle after a second. Two threads use at most two seconds of processor time by
        // then.
        let seconds = cpu_seconds_until_idle(&process).await;
        assert!(seconds < 2.0, "{} of {n_points}: {seconds} s of work nobody waits for", hostile.name);
    }
    assert!(n_ended > 100, "{n_ended} requests were cut off, too few to see anything");
    assert!(n_unregistered <= 2, "{n_unregistered} clouds were never asked about");
}

#[tokio::test]
async fn two_points_are_registered_beside_four_clouds_of_few_positions() {
    let process = Process::start(&["--deadline-seconds", "2", "--threads", "2"]);
    let client = http_client().build().unwrap();
    let few_positions = HOSTILE.iter().find(|hostile| hostile.name == "5 positions").unwrap();
    // At least as many clouds as threads, each of another size so that none is known.
    let hostile = [57_000, 58_000, 59_000, 60_000].map(|n_points| few_positions.cloud(n_points));
    let two_points = Cloud::new(vec![0.0, 1.0], 1).unwrap();
    let clouds = hostile.iter().chain([&two_points]);
    let answers =
        futures_util::future::join_all(clouds.map(|cloud| register(&process, &client, cloud))).await;
    let statuses: Vec<u16> = answers.iter().map(|(status, _)| *status).collect();
    assert_eq!(statuses, [201; 5]);
}

/// Returns regions of no point as a body of `/v1/tiles/sides`. With links they are parts of one region.
fn empty_regions(n: usize, are_linked: bool) -> Vec<u8> {
    let region = json!({
        "n_points": 0, "n_signed": 0, "n_coarse": 0, "area": 0, "centre": [0, 0], "spread": 0,
        "normal": [0, 0], "volume": 0, "lower": [0, 0], "upper": [0, 0],
    });
    let tile = json!({"regions": vec![region; n], "borders": [], "n_edges": 0});
    let link = |at: usize| json!({"first": at - 1, "second": at});
    let links: Vec<Value> = (1..n).filter(|_| are_linked).map(link).collect();
    let body = json!({"tiles": [tile], "links": links}).to_string();
    zstd::encode_all(body.as_bytes(), 3).unwrap()
}

async fn join_regions(process: &Process, key: &str, body: Vec<u8>) -> u16 {
    let request = unpooled().post(process.url("/v1/tiles/sides")).bearer_auth(key);
    let request = request.header("content-type", "application/json").header("content-encoding", "zstd");
    request.body(body).send().await.unwrap().status().as_u16()
}

/// Returns the processor time of a request for the sides of regions, s.
async fn cpu_seconds_to_join(process: &Process, body: Vec<u8>) -> f64 {
    let before = cpu_seconds(process);
    assert_eq!(join_regions(process, "greedy", body).await, 200);
    cpu_seconds(process) - before
}

/// Joins regions again and again with the key `greedy`.
async fn join_regions_forever(process: &Process, body: &[u8]) {
    loop {
        join_regions(process, "greedy", body.to_owned()).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn many_empty_regions_take_no_longer_than_their_text_and_leave_another_key_its_turns() {
    let flags = ["--threads", "2", "--deadline-seconds", "120", "--api-keys", "greedy,modest"];
    let process = Process::start(&flags);
    // Regions that are one piece are compared with nothing.
    let one_piece = cpu_seconds_to_join(&process, empty_regions(48_000, true)).await;
    let apart = cpu_seconds_to_join(&process, empty_regions(48_000, false)).await;
    assert!(apart < 3.0 * one_piece, "{apart} s, and {one_piece} s for one piece");

    let body = empty_regions(20_000, false);
    let modest = async {
        let mut seconds = Vec::new();
        for k in 0..21 {
            let points: Vec<[f64; 2]> =
                (0..20).map(|i| [0.3 * i as f64 + k as f64, (i as f64).sin()]).collect();
            let body = json!({"cloud": {"points": points}, "kernel": {"family": "gauss", "length_scale": 1}});
            let request = unpooled().post(process.url("/v1/normals")).bearer_auth("modest");
            let before = cpu_seconds(&process);
            assert_eq!(request.json(&body).send().await.unwrap().status(), 200);
            seconds.push(cpu_seconds(&process) - before);
        }
        seconds.sort_by(f64::total_cmp);
        seconds[seconds.len() / 2]
    };
    let all_greedy = futures_util::future::join_all((0..4).map(|_| join_regions_forever(&process, &body)));
    // Processor time of the whole process, two threads of which work for the other key meanwhile.
    let median = tokio::select! { median = modest => median, _ = all_greedy => f64::NAN };
    assert!(median < 2.0 * one_piece, "{median} s, and {one_piece} s for one piece");
}

/// Returns the time to compute the sampling of a cloud, s: the minimum of three.
fn seconds_to_sample(cloud: &Cloud) -> f64 {
    let time = |_| {
        let start = Instant::now();
        Sampling::of(cloud, &Unobserved).unwrap();
        start.elapsed().as_secs_f64()
    };
    (0..3).map(time).fold(f64::INFINITY, f64::min)
}

#[test]
fn neighbours_of_hostile_clouds_take_no_three_times_as_long_as_those_of_random_ones() {
    for hostile in &HOSTILE {
        // Random points in many dimensions take quadratic time.
        let n_points = if hostile.dimension > 3 { 3000 } else { 20_000 };
        let [hard, ordinary] =
            [hostile, &hostile.ordinary()].map(|of| seconds_to_sample(&of.cloud(n_points)));
        assert!(hard < 3.0 * ordinary, "{}: {hard} s, random points {ordinary} s", hostile.name);
    }
}
