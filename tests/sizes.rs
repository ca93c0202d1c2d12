//! Memory of large clouds on their way in and large answers on their way out, as multiples of the bytes of
//! their arrays. Also the memory of learning from values and of the seeds of meshes, against their prices.
//!
//! This is a process of its own, because its allocator counts, and a single test, since the count covers all
//! threads. Figures for 100,000 points hold for a million, since everything is proportional.

use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

use axum::response::Response;
use gramian::http::fields::limits::{Limits, unobserved};
use gramian::http::problem::Problem;
use gramian::store::clouds::CloudStore;
use gramian_host::compute::Compute;
use gramian_host::memory::Owner;
use gramian_host::memory::budget::Budget;
use gramian_host::wire::negotiation::{AnswerEncoding, BodyFormat, Coding, Format};
use gramian_host::wire::read::body::RequestBody;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::answer::{Answer, Member, Parts};
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::encode::EncodedAnswer;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::mesh::fields::interpolant::LevelOf;
use gramian_numerics::mesh::price::{MeshSize, Within};
use gramian_numerics::mesh::surface::{MeshOptions, mesh_of_level};
use gramian_numerics::mesh::{Bounds, Quality};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::selection::{Noise, ObservedCloud, learn, learning_price};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;
use http_body_util::BodyExt;
use peak_alloc::PeakAlloc;
use safetensors::Dtype;
use safetensors::tensor::TensorView;
use serde::Deserialize;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

const N: usize = 100_000;
const OWNER: Owner = Owner(0);

/// Bytes that any request may take, however small.
const BASE_BYTES: usize = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    points: Points,
    #[serde(default, deserialize_with = "present_unless_empty")]
    normals: Option<Points>,
}

/// Runs a job, and returns its result and its peak bytes beyond those at the beginning.
fn peak_of<T>(job: impl FnOnce() -> T) -> (T, usize) {
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let result = job();
    (result, ALLOCATOR.peak_usage().saturating_sub(before))
}

/// Returns numbers that need all their digits.
fn numbers(n: usize) -> Vec<f64> {
    (0..n).map(|i| (i as f64 * 0.618_033_988_749_894_9).fract() - 0.5).collect()
}

fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn json(points: &[f64], normals: bool) -> Vec<u8> {
    let rows: Vec<&[f64]> = points.chunks(3).collect();
    let rows = serde_json::to_string(&rows).unwrap();
    let normals = if normals { format!(",\"normals\":{rows}") } else { String::new() };
    format!("{{\"points\":{rows}{normals}}}").into_bytes()
}

fn npy(points: &[f64]) -> Vec<u8> {
    let header =
        format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 3), }}\n", points.len() / 3);
    let length = (header.len() as u16).to_le_bytes();
    [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), &bytes(points)].concat()
}

fn safetensors(points: &[f64]) -> Vec<u8> {
    let data = bytes(points);
    let view = || TensorView::new(Dtype::F64, vec![points.len() / 3, 3], &data).unwrap();
    safetensors::serialize([("points", view()), ("normals", view())], None).unwrap()
}

fn ply(format: &str, kind: &str, n: usize, data: &[u8]) -> Vec<u8> {
    let names = ["x", "y", "z", "nx", "ny", "nz"];
    let properties: String = names.iter().map(|name| format!("property {kind} {name}\n")).collect();
    let head = format!("ply\nformat {format} 1.0\nelement vertex {n}\n{properties}end_header\n");
    [head.as_bytes(), data].concat()
}

fn ply_in_text(points: &[f64]) -> Vec<u8> {
    let mut text = Vec::new();
    for x in points.chunks(3) {
        writeln!(text, "{} {} {} {} {} {}", x[0], x[1], x[2], x[0], x[1], x[2]).unwrap();
    }
    ply("ascii", "float", points.len() / 3, &text)
}

fn ply_in_binary(points: &[f64], is_double: bool) -> Vec<u8> {
    let of = |x: &[f64]| -> Vec<u8> {
        let single = || x.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
        if is_double { bytes(x) } else { single() }
    };
    let data: Vec<u8> = points.chunks(3).flat_map(|x| [of(x), of(x)].concat()).collect();
    ply("binary_little_endian", if is_double { "double" } else { "float" }, points.len() / 3, &data)
}

/// Registers the cloud of a body in a store, and returns the bytes that are kept.
fn register(format: BodyFormat, body: Vec<u8>) -> usize {
    let limit = body.len();
    let lists = Limits::NONE.lists();
    let context = unobserved(&lists);
    let request: Request = RequestBody::new(format, Coding::Identity, body, limit)
        .unpack(&context, |_| Ok(()))
        .and_then(|body| body.parse(&context))
        .unwrap_or_else(|problem| panic!("{format:?}: {problem:?}"));
    let cloud = |points: Points| Cloud::new(points.coordinates, points.dimension).unwrap();
    let store = CloudStore::<Problem>::new(usize::MAX);
    let (stored, _) = store.register(OWNER, cloud(request.points), request.normals.map(cloud));
    assert_eq!(stored.cloud.n_points(), N);
    stored.n_bytes()
}

fn learning_takes_what_it_is_priced() {
    // The first run is not counted, because matrix products begin by reserving addresses for each thread.
    for (at, (n, d)) in
        [(2000, 3), (300, 2), (2000, 3), (300, 6), (2000, 6), (5000, 6), (20_000, 2), (20_000, 3)]
            .into_iter()
            .enumerate()
    {
        let cloud = Cloud::new(numbers(n * d), d).unwrap();
        let values: Vec<f64> = cloud.points().map(|x| (3.0 * x[0]).sin() + x[1]).collect();
        let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
        let (noise, mean) = (Noise::Unknown, Mean::Linear);
        let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
        let (_, taken) = peak_of(|| learn(observed, &Unobserved).unwrap());
        let priced = learning_price(&cloud, 1).n_bytes;
        println!("learning from {n} values in {d} dimensions: {taken} bytes at the peak, priced {priced}");
        // Grids and scores take some kilobytes in both figures.
        let holds = taken <= priced + BASE_BYTES && priced <= 10 * (taken + BASE_BYTES);
        assert!(at == 0 || holds, "{taken}, {priced}");
    }
}

/// A level between all points and their neighbours, with a step so short that each point has hundreds of
/// seeds, in a box in which next to nothing is followed.
fn seeds_take_what_they_are_priced() {
    let n = 40_000;
    let part = |k: usize, of: f64| (k as f64 * of).fract() - 0.5;
    let point =
        |k: usize| [part(k, 0.754_877_666_2), part(k, 0.569_840_290_9), 1e-4 * part(k, 0.618_033_988_7)];
    let cloud = Arc::new(Cloud::new((0..n).flat_map(point).collect(), 3).unwrap());
    let values: Vec<f64> = cloud.points().map(|x| x[2]).collect();
    let kernel = Kernel::new(Family::Gauss, 4.0, 1.0).unwrap();
    let system = System::new(cloud.clone(), kernel, Regularization::Uniform(1e-2)).unwrap();
    let solver = Arc::new(Solver::landmark(system, &Unobserved).unwrap());
    let function = Interpolant::fit_with_mean(solver, &values, Mean::Linear, &Unobserved).unwrap();
    let (step, corner) = (1e-5, cloud.point(0));
    let bounds = Bounds {
        min: corner.iter().map(|x| x - 2.0 * step).collect(),
        max: corner.iter().map(|x| x + 2.0 * step).collect(),
    };
    let spacing = Sampling::of(&cloud, &Unobserved).unwrap().scales().spacing;
    let within = Some(Within::of(&bounds, &cloud, step, true));
    let size = MeshSize { n_points: n, dimension: 3, step: step / spacing, within, quality: Quality::Raw };
    let (step, bounds, max_nodes) = (Some(step), Some(bounds), size.max_nodes());
    let options = MeshOptions { step, bounds, quality: Quality::Raw, is_open: false, max_nodes };
    // Whether a surface is found in the box is of no interest here.
    let (_, taken) = peak_of(|| mesh_of_level(LevelOf::new(&function, 0.0, 1e-4), &options, &Unobserved));
    let priced = size.price(1e4).n_bytes;
    println!("seeds of {n} points: {taken} bytes at the peak, priced {priced}");
    assert!(taken <= priced + BASE_BYTES && priced <= 10 * (taken + BASE_BYTES), "{taken}, {priced}");
}

struct Numbers(Array);

impl Answer for Numbers {
    fn into_parts(self: Box<Self>) -> Result<Parts, Problem> {
        let mut parts = Parts::default();
        self.0.add_to("principal_directions", &mut parts)?;
        Ok(parts)
    }
}

/// Reads an answer piece by piece, and returns its bytes.
async fn read(response: Response) -> usize {
    let (mut body, mut n_bytes) = (response.into_body(), 0);
    while let Some(frame) = body.frame().await {
        n_bytes += frame.unwrap().into_data().map_or(0, |data| data.len());
    }
    n_bytes
}

#[tokio::test(flavor = "multi_thread")]
async fn clouds_come_in_and_answers_go_out_within_three_times_their_arrays() {
    let points = numbers(3 * N);
    let one = 8 * points.len();
    for (name, format, body, n_arrays, is_binary) in [
        ("JSON", BodyFormat::Json, json(&points, false), one, false),
        ("JSON with normals", BodyFormat::Json, json(&points, true), 2 * one, false),
        ("npy", BodyFormat::Npy, npy(&points), one, true),
        ("safetensors with normals", BodyFormat::Safetensors, safetensors(&points), 2 * one, true),
        ("PLY in text with normals", BodyFormat::Ply, ply_in_text(&points), 2 * one, false),
        ("PLY with normals", BodyFormat::Ply, ply_in_binary(&points, true), 2 * one, true),
        ("PLY of 32 bits with normals", BodyFormat::Ply, ply_in_binary(&points, false), 2 * one, true),
    ] {
        let n_body = body.len();
        let (n_kept, beside) = peak_of(|| register(format, body));
        let ratio = |n: usize| n as f64 / n_arrays as f64;
        let (beside, with) = (ratio(beside), ratio(beside + n_body));
        println!(
            "{name}: body {:.2}, beside it {beside:.2}, with it {with:.2}, kept {:.2}",
            ratio(n_body),
            ratio(n_kept)
        );
        let counted = if is_binary { with } else { beside };
        assert!(counted <= 3.0 + ratio(BASE_BYTES) && beside < 1.5 + ratio(BASE_BYTES), "{name}: {counted}");
    }
    learning_takes_what_it_is_priced();
    seeds_take_what_they_are_priced();
    let compute = Arc::new(Compute::new(2, 8, 1, Duration::from_secs(600)).unwrap());
    let budget = Budget::new(usize::MAX / 4, 1);
    let one = 8 * 20 * N;
    for (format, coding) in [
        (Format::Json, Coding::Identity),
        (Format::Json, Coding::Zstd),
        (Format::Safetensors, Coding::Identity),
        (Format::Safetensors, Coding::Zstd),
    ] {
        let before = ALLOCATOR.current_usage();
        ALLOCATOR.reset_peak_usage();
        let answer = Numbers(Array::new(numbers(20 * N), &[N, 20]));
        let encoded = EncodedAnswer::of(Box::new(answer), AnswerEncoding { format, coding }).ok().unwrap();
        let memory = budget.try_reserve(OWNER, encoded.n_bytes()).unwrap();
        let n_sent = read(encoded.into_response(&compute, memory)).await;
        let ratio = |n: usize| n as f64 / one as f64;
        let peak = ratio(ALLOCATOR.peak_usage().saturating_sub(before));
        println!(
            "{format:?} {coding:?}: sent {:.2}, with the arrays themselves {peak:.2} at the peak",
            ratio(n_sent)
        );
        assert!(n_sent > one / 3 && peak <= 3.0, "{format:?} {coding:?}: {peak}");
    }
}
