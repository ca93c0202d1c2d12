//! Throughput of bodies. JSON: MB/s of one core for reading points and for writing numbers. npy: time to send
//! a matrix, against a copy of its memory and the write to the socket.
//!
//! `cargo bench --bench bodies`

#![allow(clippy::disallowed_methods)]

#[path = "../numerics/benches/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use axum::Router;
use axum::routing::get;
use clap::Parser;
use gramian::config::Config;
use gramian::http::fields::limits::{Limits, unobserved};
use gramian::http::problem::Problem;
use gramian::http::state::app::App;
use gramian_host::memory::Owner;
use gramian_host::wire::negotiation::{AnswerEncoding, Coding, Format};
use gramian_host::wire::read::parse::parse_json;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::answer::{Answer, Member, Parts};
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::encode::EncodedAnswer;
use support::random;

const N_POINTS: usize = 1_000_000;
const MATRIX_ROWS: usize = 4_000;
const ROUNDS: usize = 9;
const REQUEST: &[u8] = b"GET / HTTP/1.1\r\nHost: bench\r\nConnection: close\r\n\r\n";

fn main() {
    let numbers = random(3 * N_POINTS, 1);
    let json = write(&Array::new(numbers.clone(), &[N_POINTS, 3]));
    let megabytes = json.len() as f64 / 1e6;
    println!(
        "{N_POINTS} random points, {megabytes:.0} MB of JSON, MB per second of one core, best of {ROUNDS}"
    );
    let text = [br#"{"points":"#, json.as_slice(), b"}"].concat();
    let lists = Limits::NONE.lists();
    let context = unobserved(&lists);
    let ours = best(|| parse_json::<Request>(&text, &context).unwrap().points.coordinates);
    let theirs = best(|| serde_json::from_slice::<Vec<[f64; 3]>>(&json).unwrap());
    println!("{:44} {:8.0}", "read into the flat buffer", megabytes / ours);
    println!("{:44} {:8.0}", "the same by serde_json into [f64; 3]", megabytes / theirs);
    let array = Array::new(numbers.clone(), &[N_POINTS, 3]);
    let mut buffer = Vec::with_capacity(json.len());
    let ours = best(|| {
        buffer.clear();
        array.write_json(0..array.n_numbers(), &mut buffer);
    });
    let rows: Vec<&[f64]> = numbers.chunks(3).collect();
    let mut buffer = Vec::with_capacity(json.len());
    let theirs = best(|| {
        buffer.clear();
        serde_json::to_writer(&mut buffer, &rows).unwrap();
    });
    println!("{:44} {:8.0}", "write", megabytes / ours);
    println!("{:44} {:8.0}", "the same by serde_json", megabytes / theirs);
    send_matrix();
}

#[derive(serde::Deserialize)]
struct Request {
    points: Points,
}

/// Measures sending the matrix as npy over loopback by the service's encoder, against a memory copy and a
/// plain write.
fn send_matrix() {
    let matrix = random(MATRIX_ROWS * MATRIX_ROWS, 1);
    let (reference, service) = (plain_server(matrix.clone()), service(matrix));
    let mut received = vec![0; 1 << 20];
    let [of_reference, of_service] =
        [reference, service].map(|address| download(address, usize::MAX, &mut received).1);
    assert!(of_service > of_reference && of_reference == 8 * MATRIX_ROWS * MATRIX_ROWS);
    let (mut theirs, mut ours) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        theirs = theirs.min(download(reference, of_reference, &mut received).0);
        ours = ours.min(download(service, of_service, &mut received).0);
    }
    let (theirs, ours) = (theirs * 1e3, ours * 1e3);
    println!("{MATRIX_ROWS} x {MATRIX_ROWS} matrix over loopback, ms, best of {ROUNDS}");
    println!("{:44} {theirs:8.1}", "memory copy and socket write");
    println!("{:44} {ours:8.1}, {:.2} of it", "npy encoded and sent", ours / theirs);
}

/// Starts a server that copies the matrix and writes the copy, once per connection.
fn plain_server(matrix: Vec<f64>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let mut copy = vec![0u8; 8 * matrix.len()];
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            // Reads the whole request, because unread bytes would turn the end of the connection into a
            // reset.
            stream.read_exact(&mut [0; REQUEST.len()]).unwrap();
            copy.copy_from_slice(bytemuck::cast_slice(&matrix));
            stream.write_all(&copy).unwrap();
        }
    });
    address
}

struct Matrix(Vec<f64>);

impl Answer for Matrix {
    fn into_parts(self: Box<Self>) -> Result<Parts, Problem> {
        let mut parts = Parts::default();
        Array::new(self.0, &[MATRIX_ROWS, MATRIX_ROWS]).add_to("matrix", &mut parts)?;
        Ok(parts)
    }
}

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    config: Config,
}

/// Starts a server that sends the matrix through the encoder. Each answer uses another copy, made beforehand.
fn service(matrix: Vec<f64>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    listener.set_nonblocking(true).unwrap();
    let opening = App::new(Flags::parse_from(["gramian"]).config);
    let app = tokio::runtime::Runtime::new().unwrap().block_on(opening).unwrap();
    let ready = Arc::new(Mutex::new(vec![matrix; ROUNDS + 1]));
    let handler = move || {
        let (app, matrix) = (app.clone(), ready.lock().unwrap().pop().unwrap());
        async move {
            let wanted = AnswerEncoding { format: Format::Npy, coding: Coding::Identity };
            let memory =
                app.prepared.reserve(Owner(0), 2 * size_of_val(&*matrix), || true).await.unwrap().unwrap();
            let encode = move || EncodedAnswer::of(Box::new(Matrix(matrix)), wanted);
            let encoded = app.compute.run_small(Owner(0), encode).await;
            encoded.ok().unwrap().ok().unwrap().into_response(&app.compute, memory)
        }
    };
    std::thread::spawn(move || {
        tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap().block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener).unwrap();
            axum::serve(listener, Router::new().route("/", get(handler))).await.unwrap();
        });
    });
    address
}

/// Returns the seconds from the request until `n_bytes` have come or the connection ends, and the bytes
/// received. Work of the server after its answer, such as freeing memory, is not included.
fn download(address: SocketAddr, n_bytes: usize, buffer: &mut [u8]) -> (f64, usize) {
    let mut stream = TcpStream::connect(address).unwrap();
    let began = Instant::now();
    stream.write_all(REQUEST).unwrap();
    let mut n_received = 0;
    while n_received < n_bytes {
        match stream.read(buffer).unwrap() {
            0 => break,
            n => n_received += n,
        }
    }
    (began.elapsed().as_secs_f64(), n_received)
}

fn write(array: &Array) -> Vec<u8> {
    let mut out = Vec::new();
    array.write_json(0..array.n_numbers(), &mut out);
    out
}

/// Returns the least processor time of [`ROUNDS`] rounds, s.
fn best<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let began = cpu_seconds();
        black_box(work());
        best = best.min(cpu_seconds() - began);
    }
    best
}

/// Returns the time for which this thread has had a core, s, as Linux counts it. Other programs hardly
/// disturb it.
fn cpu_seconds() -> f64 {
    let counters = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    counters.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}
