//! Measures the table of hostile clouds in docs/reliability.md: times of whole requests, against random
//! points.
//!
//! `cargo run --release --example hostile_clouds -- 60000`

use std::time::Instant;

use clap::Parser;
use gramian::config::Config;
use gramian::http::serve;
use gramian::http::state::app::App;
use serde_json::{Value, json};
use tokio::net::TcpListener;

#[path = "../numerics/tests/common/mod.rs"]
mod common;

use common::hostile::{HOSTILE, Hostile};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Requests about each cloud, sent once it is registered.
const REQUESTS: [(&str, &str); 2] = [
    ("/v1/normals", "{}"),
    (
        "/v1/interpolation",
        r#"{"solver": "local", "kernel": {"family": "matern", "length_scale": 0.1}, "alpha": 0.01, "duplicates": "merge"}"#,
    ),
];

/// Largest dimension in which all requests are timed. Beyond it random points take minutes.
const MAX_DIMENSION: usize = 3;

#[derive(Parser)]
struct Flags {
    /// Points of each cloud.
    n_points: usize,
    /// Only clouds whose names contain this.
    #[arg(long, default_value = "")]
    named: String,
    #[command(flatten)]
    config: Config,
}

struct Server {
    url: String,
    client: reqwest::Client,
}

/// Time and status of an answer.
#[derive(Clone, Copy)]
struct TimedAnswer {
    milliseconds: f64,
    status: u16,
}

impl Server {
    async fn start(config: Config) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let url = format!("http://{}", listener.local_addr().expect("an address"));
        let app = App::new(config).await.expect("a service");
        tokio::spawn(serve(app, listener, std::future::pending()));
        Self { url, client: reqwest::Client::new() }
    }

    async fn post(&self, path: &str, body: &Value) -> (TimedAnswer, Value) {
        let request = self.client.post(format!("{}{path}", self.url)).json(body);
        let start = Instant::now();
        let answer = request.send().await.expect("an answer");
        let status = answer.status().as_u16();
        let bytes = answer.bytes().await.expect("all of it");
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();
        (TimedAnswer { milliseconds, status }, serde_json::from_slice(&bytes).expect("JSON"))
    }

    /// Returns the least times of three for registering a cloud and for each request. Above
    /// [`MAX_DIMENSION`], the cloud is registered once and no requests follow.
    async fn time(&self, hostile: &Hostile, n_points: usize) -> Vec<TimedAnswer> {
        let cloud = hostile.cloud(n_points);
        let points: Vec<&[f64]> = cloud.points().collect();
        let values: Vec<f64> = (0..n_points).map(|i| (i as f64 * 1e-3).sin()).collect();
        let mut best: Vec<TimedAnswer> = Vec::new();
        let n_times = if hostile.dimension > MAX_DIMENSION { 1 } else { 3 };
        for _ in 0..n_times {
            let (registered, answer) = self.post("/v1/clouds", &json!({"points": points})).await;
            let id = answer["cloud_id"].as_str().expect("an id").to_owned();
            let mut times = vec![registered];
            let n_requests = if hostile.dimension > MAX_DIMENSION { 0 } else { REQUESTS.len() };
            for (path, members) in &REQUESTS[..n_requests] {
                let mut body: Value = serde_json::from_str(members).expect("JSON");
                body["cloud"] = json!({"id": id});
                if *path == "/v1/interpolation" {
                    body["values"] = json!(values);
                }
                times.push(self.post(path, &body).await.0);
            }
            let deleted = self.client.delete(format!("{}/v1/clouds/{id}", self.url)).send().await;
            assert!(deleted.expect("an answer").status().is_success());
            if best.is_empty() {
                best = times;
            } else {
                let least = |(best, time): (&mut TimedAnswer, TimedAnswer)| {
                    best.milliseconds = best.milliseconds.min(time.milliseconds);
                };
                best.iter_mut().zip(times).for_each(least);
            }
        }
        best
    }
}

#[tokio::main]
async fn main() {
    let Flags { n_points, named, config } = Flags::parse();
    let server = Server::start(config).await;
    let mut random: Vec<(usize, Vec<TimedAnswer>)> = Vec::new();
    println!("| {n_points} points | d | register, ms | over random | normals | interpolation |");
    println!("|---|---|---|---|---|---|");
    for hostile in HOSTILE.iter().filter(|hostile| hostile.name.contains(&named)) {
        if !random.iter().any(|(dimension, _)| *dimension == hostile.dimension) {
            random.push((hostile.dimension, server.time(&hostile.ordinary(), n_points).await));
        }
        let ordinary = random.iter().find(|(d, _)| *d == hostile.dimension).map(|(_, times)| times);
        let times = server.time(hostile, n_points).await;
        let ratios =
            times.iter().zip(ordinary.into_iter().flatten()).map(|(time, ordinary)| match time.status {
                200 | 201 => format!("{:.2}", time.milliseconds / ordinary.milliseconds),
                status => format!("{status}: {:.2}", time.milliseconds / ordinary.milliseconds),
            });
        let ratios: Vec<String> = ratios.collect();
        println!(
            "| {} | {} | {:.0} | {} |",
            hostile.name,
            hostile.dimension,
            times[0].milliseconds,
            ratios.join(" | ")
        );
    }
    for (dimension, times) in random {
        let times: Vec<String> =
            times.iter().map(|t| format!("{:.0} ({})", t.milliseconds, t.status)).collect();
        println!("random points, d = {dimension}: {} ms", times.join(", "));
    }
}
