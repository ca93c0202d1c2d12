//! The binary itself: settings, readiness, logs, and how it ends.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::contract::{self, Received};
use crate::support::{fibonacci_sphere, receive};

/// The binary, serving on a port of its own; killed when dropped.
pub struct Process {
    child: Child,
    address: String,
    lines: Arc<Mutex<Vec<String>>>,
    reader: Option<JoinHandle<()>>,
}

/// The binary without the settings of whoever runs the tests.
fn gramian() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gramian"));
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GRAMIAN_") || name == "RUST_LOG") {
        command.env_remove(name);
    }
    command
}

impl Process {
    pub fn start(flags: &[&str]) -> Self {
        Self::of(gramian().args(["--bind", "127.0.0.1:0"]).args(flags))
    }

    fn of(command: &mut Command) -> Self {
        let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let (mut first, mut address) = (Vec::new(), None);
        while address.is_none() {
            let mut line = String::new();
            assert!(stderr.read_line(&mut line).unwrap() > 0, "ended before it listened: {first:?}");
            let entry: Value = serde_json::from_str(&line).unwrap_or_else(|_| panic!("no JSON: {line}"));
            address = entry["fields"]["address"].as_str().map(str::to_owned);
            first.push(line);
        }
        let lines = Arc::new(Mutex::new(first));
        let sink = lines.clone();
        let reader = std::thread::spawn(move || {
            for line in stderr.lines() {
                sink.lock().unwrap().push(line.unwrap());
            }
        });
        Self { child, address: address.unwrap(), lines, reader: Some(reader) }
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Where it listens.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// The most memory it ever had.
    pub fn peak_resident_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
        let kibibytes: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        kibibytes << 10
    }

    fn terminate(&self) {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    }

    /// Waits for its end; answers with its status and everything it logged.
    fn finish(mut self) -> (ExitStatus, Vec<String>) {
        let status = self.child.wait().unwrap();
        self.reader.take().unwrap().join().unwrap();
        let lines = std::mem::take(&mut *self.lines.lock().unwrap());
        (status, lines)
    }

    fn health(&self) -> ExitStatus {
        gramian().arg("health").env("GRAMIAN_BIND", &self.address).stderr(Stdio::null()).status().unwrap()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail if it has ended, which is as well.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

async fn get(process: &Process, path: &str) -> (u16, Value) {
    let answer = receive(reqwest::Client::new().get(process.url(path))).await;
    (answer.status, answer.json().unwrap())
}

fn spawn_post(process: &Process, path: &str, body: &Value) -> tokio::task::JoinHandle<(u16, Value)> {
    let request = reqwest::Client::new().post(process.url(path)).json(body);
    tokio::spawn(async move {
        let answer = receive(request).await;
        (answer.status, answer.json().unwrap())
    })
}

fn curvatures(n: usize) -> Value {
    let points = fibonacci_sphere(n);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6, "queries": points[..1]})
}

#[tokio::test(flavor = "multi_thread")]
async fn the_probe_of_the_container_says_whether_the_server_is_ready() {
    let process = Process::start(&["--threads", "1", "--max-queue", "0"]);
    assert_eq!(process.health().code(), Some(0));
    let slow = spawn_post(&process, "/v1/curvatures", &curvatures(12_000));
    while get(&process, "/health/ready").await.0 == 200 {}
    assert!(!process.health().success());
    slow.abort();
    while get(&process, "/health/ready").await.0 != 200 {}
    assert_eq!(process.health().code(), Some(0));
    let address = process.address.clone();
    process.terminate();
    assert_eq!(process.finish().0.code(), Some(0));
    // Nothing listens any more.
    let health = gramian().args(["--bind", &address, "health"]).output().unwrap();
    assert!(health.status.code().is_some_and(|code| code != 0));
    assert!(!health.stderr.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_under_way_is_finished_before_the_process_ends() {
    let process = Process::start(&[]);
    let slow = spawn_post(&process, "/v1/curvatures", &curvatures(5000));
    // It is under way once its cloud is registered.
    while get(&process, "/v1/clouds").await.1["clouds"][0].is_null() {}
    process.terminate();
    let (status, answer) = slow.await.unwrap();
    assert_eq!(status, 200);
    assert!((answer["mean_curvatures"][0].as_f64().unwrap() - 1.0).abs() < 0.05, "{answer}");
    let (status, lines) = process.finish();
    assert_eq!(status.code(), Some(0));
    let position = |text: &str| lines.iter().position(|line| line.contains(text)).unwrap();
    assert!(position("draining") < position("POST /v1/curvatures 200"), "{lines:#?}");
}

#[tokio::test]
async fn a_client_that_never_finishes_its_request_does_not_hold_the_process() {
    for stalled in [
        "GET /health/live HT",
        "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{",
    ] {
        let mut process = Process::start(&["--deadline-seconds", "1"]);
        let mut connection = std::net::TcpStream::connect(&process.address).unwrap();
        connection.write_all(stalled.as_bytes()).unwrap();
        // Connections are accepted in order: the stalled one is there once this one is answered.
        assert_eq!(get(&process, "/health/live").await.0, 200);
        process.terminate();
        let began = Instant::now();
        while process.child.try_wait().unwrap().is_none() {
            assert!(began.elapsed() < Duration::from_secs(10), "still running after {stalled:?}");
            std::thread::yield_now();
        }
        assert_eq!(process.finish().0.code(), Some(0));
    }
}

#[tokio::test]
async fn the_log_names_requests_and_never_shows_what_they_carry() {
    let process = Process::of(
        gramian().args(["--bind", "127.0.0.1:0", "--api-keys", "secret-key"]).env("RUST_LOG", "trace"),
    );
    let mut body = curvatures(20);
    body["cloud"]["points"][7] = json!([0.123456789, 0.987654321, 0.555444333]);
    let mut bad = body.clone();
    bad["cloud"]["points"][9] = json!([0.123456789, 0.987654321, "0.555444333"]);
    let mut twins = body.clone();
    twins["cloud"]["points"][8] = twins["cloud"]["points"][7].clone();
    twins["alpha"] = json!(0);
    for (body, id, status) in [(body, "good-1", 200), (bad, "bad-1", 422), (twins, "twins-1", 422)] {
        let request = reqwest::Client::new().post(process.url("/v1/curvatures?q=0.123456789")).json(&body);
        let request = request.header("x-request-id", id).bearer_auth("secret-key");
        assert_eq!(receive(request).await.status, status);
    }
    process.terminate();
    let lines = process.finish().1;
    let text = lines.join("\n");
    for hidden in ["123456789", "987654321", "555444333", "secret-key"] {
        assert!(!text.contains(hidden), "{hidden} in {text}");
    }
    for (id, status) in [("good-1", 200), ("bad-1", 422), ("twins-1", 422)] {
        let line = lines.iter().find(|line| line.contains(id)).unwrap();
        let fields = serde_json::from_str::<Value>(line).unwrap()["fields"].clone();
        assert_eq!((&fields["request_id"], &fields["status"]), (&json!(id), &json!(status)));
        assert_eq!((&fields["method"], &fields["path"]), (&json!("POST"), &json!("/v1/curvatures")));
        assert!(fields["duration_ms"].as_f64().unwrap() > 0.0);
    }
}

#[tokio::test]
async fn every_setting_has_a_variable_and_a_flag_which_wins() {
    let help = gramian().arg("--help").env("GRAMIAN_API_KEYS", "secret-key").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    for name in [
        "BIND",
        "THREADS",
        "MEMORY_BYTES",
        "CACHE_BYTES",
        "CLOUD_BYTES",
        "MAX_POINTS",
        "MAX_QUERIES",
        "MAX_DIMENSION",
        "MAX_BODY_BYTES",
        "MAX_RESPONSE_BYTES",
        "MAX_QUEUE",
        "MAX_CONNECTIONS",
        "DEADLINE_SECONDS",
        "BODY_SECONDS",
        "IDLE_SECONDS",
        "SEND_SECONDS",
        "DRAIN_SECONDS",
        "API_KEYS",
        "CORS_ORIGINS",
    ] {
        let flag = format!("--{} ", name.to_lowercase().replace('_', "-"));
        assert!(help.contains(&format!("GRAMIAN_{name}")) && help.contains(&flag), "{name}: {help}");
    }
    assert!(!help.contains("secret-key"));

    let settings = [
        ("BIND", "127.0.0.1:0"),
        ("THREADS", "2"),
        ("MAX_POINTS", "5"),
        ("API_KEYS", "one,two"),
        ("CORS_ORIGINS", "https://one.example"),
    ];
    let mut command = gramian();
    command.envs(settings.map(|(name, value)| (format!("GRAMIAN_{name}"), value)));
    for (flags, threads) in [(&[][..], 2), (&["--threads", "1"], 1)] {
        let process = Process::of(command.args(flags));
        assert_eq!(get(&process, "/version").await.1["threads"], threads);
        assert_eq!(get(&process, "/v1/kernels").await.0, 401);
        let request = reqwest::Client::new().post(process.url("/v1/curvatures")).bearer_auth("two");
        let request = request.header("origin", "https://one.example").json(&curvatures(6));
        let answer = receive(request).await;
        assert_eq!(answer.header("access-control-allow-origin"), "https://one.example");
        assert_eq!((answer.status, &answer.json().unwrap()["limit"]), (413, &json!(5)));
    }
}

#[test]
fn a_setting_that_makes_no_sense_ends_the_process_with_its_name() {
    let never = [
        ("BIND", "nowhere"),
        ("THREADS", "-1"),
        ("THREADS", "99999"),
        ("MAX_QUEUE", "-1"),
        ("MEMORY_BYTES", "1000"),
    ];
    let counts = [
        "MAX_POINTS",
        "MAX_QUERIES",
        "MAX_DIMENSION",
        "MAX_BODY_BYTES",
        "MAX_RESPONSE_BYTES",
        "MAX_CONNECTIONS",
    ];
    let counts = counts.iter().flat_map(|name| ["0", "-1", "many", "1e30"].map(|value| (*name, value)));
    let seconds = ["DEADLINE_SECONDS", "BODY_SECONDS", "IDLE_SECONDS", "SEND_SECONDS", "DRAIN_SECONDS"];
    let seconds =
        seconds.iter().flat_map(|name| ["0", "NaN", "inf", "-1", "1e30"].map(|value| (*name, value)));
    let blank = [
        "BIND",
        "THREADS",
        "MEMORY_BYTES",
        "CACHE_BYTES",
        "CLOUD_BYTES",
        "MAX_POINTS",
        "MAX_QUEUE",
        "DEADLINE_SECONDS",
        "API_KEYS",
        "CORS_ORIGINS",
    ];
    let blank = blank.iter().flat_map(|name| ["", " "].map(|value| (*name, value)));
    let lists = [
        ("API_KEYS", ","),
        ("API_KEYS", "one,,two"),
        ("CORS_ORIGINS", "https://a.example, *"),
        ("CORS_ORIGINS", "a.example"),
    ];
    for (name, value) in never.into_iter().chain(counts).chain(seconds).chain(blank).chain(lists) {
        // On a port of its own, should it start after all.
        let mut command = gramian();
        command.env("GRAMIAN_BIND", "127.0.0.1:0").env(format!("GRAMIAN_{name}"), value);
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let mut text = String::new();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        while !text.contains("listening") && stderr.read_line(&mut text).unwrap() > 0 {}
        child.kill().ok();
        assert_eq!(child.wait().unwrap().code(), Some(2), "{name}={value}: {text}");
        let flag = format!("--{}", name.to_lowercase().replace('_', "-"));
        assert!(text.contains(&flag), "{name}={value}: {text}");
    }
}

#[test]
fn a_busy_port_is_named_with_its_setting() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let output = gramian().env("GRAMIAN_BIND", &address).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains(&address) && text.contains("GRAMIAN_BIND"), "{text}");
}

/// The fields of the first log line that has this text.
fn logged(lines: &[String], text: &str) -> Value {
    let line =
        lines.iter().find(|line| line.contains(text)).unwrap_or_else(|| panic!("no {text}: {lines:#?}"));
    serde_json::from_str::<Value>(line).unwrap()["fields"].clone()
}

#[test]
fn the_log_says_how_many_keys_there_are_and_which_settings_there_are_not() {
    for (keys, n_keys) in [(None, 0), (Some("one,two"), 2)] {
        let mut command = gramian();
        command.args(["--bind", "127.0.0.1:0"]).env("GRAMIAN_API_KEY", "mistyped");
        command.envs(keys.map(|keys| ("GRAMIAN_API_KEYS", keys)));
        let process = Process::of(&mut command);
        process.terminate();
        let lines = process.finish().1;
        assert_eq!(logged(&lines, "listening")["n_api_keys"], n_keys);
        assert_eq!(logged(&lines, "no such setting")["name"], "GRAMIAN_API_KEY");
        assert!(!lines.join("\n").contains("mistyped"));
    }
}

#[tokio::test]
async fn lines_of_the_log_are_short_whatever_clients_send() {
    let process = Process::start(&[]);
    let long = "\"%0a".repeat(5000);
    for request in [
        format!("GET /{long} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"),
        format!(
            "GET /v1/clouds?{long} HTTP/1.1\r\nHost: x\r\nConnection: close\r\nX-Request-Id: {long}\r\n\r\n"
        ),
        format!("{} / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n", "M".repeat(20_000)),
        format!("GET /v1/kernels HTTP/1.1\r\nHost: {long}\r\nConnection: close\r\n\r\n"),
    ] {
        let mut stream = std::net::TcpStream::connect(&process.address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 "), "{answer}");
    }
    process.terminate();
    let lines = process.finish().1;
    let requests = lines.iter().filter(|line| line.contains("duration_ms"));
    assert!(requests.count() >= 3, "{lines:#?}");
    for line in &lines {
        serde_json::from_str::<Value>(line).unwrap();
        assert!(line.len() <= 1400, "{} bytes: {line}", line.len());
    }
}

/// Asks for an answer of some 10 MB, and reads its beginning.
fn begin_large_answer(process: &Process) -> std::net::TcpStream {
    let mut body = curvatures(700);
    body.as_object_mut().unwrap().remove("queries");
    let body = body.to_string();
    let mut stream = std::net::TcpStream::connect(&process.address).unwrap();
    write!(
        stream,
        "POST /v1/laplace-beltrami/matrix HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    )
    .unwrap();
    let mut beginning = [0; 12];
    stream.read_exact(&mut beginning).unwrap();
    assert_eq!(&beginning, b"HTTP/1.1 200");
    stream
}

#[tokio::test]
async fn readers_are_waited_for_and_then_cut_without_an_end() {
    let process = Process::start(&["--drain-seconds", "2"]);
    let (mut reader, mut sleeper) = (begin_large_answer(&process), begin_large_answer(&process));
    process.terminate();
    let mut received = Vec::new();
    reader.read_to_end(&mut received).unwrap();
    assert!(received.ends_with(b"\r\n0\r\n\r\n"), "{} bytes", received.len());
    let began = Instant::now();
    let (status, lines) = process.finish();
    assert!(began.elapsed() < Duration::from_secs(20));
    assert_eq!(status.code(), Some(0));
    assert_eq!(logged(&lines, "are cut")["n_connections"], 1);
    received.clear();
    let outcome = sleeper.read_to_end(&mut received);
    assert!(outcome.is_err() || !received.ends_with(b"0\r\n\r\n"));
    assert!(received.len() < 8 << 20, "{} bytes", received.len());
}

#[tokio::test]
async fn what_has_not_been_read_is_refused_while_the_server_drains() {
    let process = Process::start(&["--drain-seconds", "60"]);
    // It keeps the process alive.
    let reader = begin_large_answer(&process);
    let head = "POST /v1/normals HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n";
    let mut uploads = [head.to_owned(), format!("{head}{{")].map(|text| {
        let mut stream = std::net::TcpStream::connect(&process.address).unwrap();
        stream.write_all(text.as_bytes()).unwrap();
        stream
    });
    let mut kept = std::net::TcpStream::connect(&process.address).unwrap();
    kept.write_all(b"GET /health/live HTTP/1.1\r\nHost: x\r\n\r\n").unwrap();
    kept.read_exact(&mut [0; 12]).unwrap();
    process.terminate();
    for upload in &mut uploads {
        let mut text = String::new();
        upload.read_to_string(&mut text).unwrap();
        let answer = Received::parse(&text);
        contract::check("POST", "/v1/normals", &answer);
        assert_eq!((answer.status, answer.header("connection")), (503, "close"), "{text}");
        assert_eq!(answer.json().unwrap()["type"], "/problems/overloaded");
    }
    // Idle connections are ended, and nobody is accepted.
    kept.read_to_end(&mut Vec::new()).unwrap();
    assert!(std::net::TcpStream::connect(&process.address).is_err());
    drop(reader);
    assert_eq!(process.finish().0.code(), Some(0));
}

#[tokio::test]
async fn a_second_signal_ends_the_process_at_once() {
    for second in ["-TERM", "-INT"] {
        let mut process = Process::start(&["--drain-seconds", "3600", "--send-seconds", "3600"]);
        let _unread = begin_large_answer(&process);
        process.terminate();
        let has_begun = || process.lines.lock().unwrap().iter().any(|line| line.contains("draining"));
        while !has_begun() {
            std::thread::yield_now();
        }
        assert!(process.child.try_wait().unwrap().is_none());
        let pid = process.child.id().to_string();
        assert!(Command::new("kill").args([second, &pid]).status().unwrap().success());
        let began = Instant::now();
        let (status, _) = process.finish();
        assert!(began.elapsed() < Duration::from_secs(20));
        assert_eq!(status.code(), Some(130));
    }
}

#[tokio::test]
async fn a_process_out_of_files_says_so_briefly_and_goes_on() {
    let binary = env!("CARGO_BIN_EXE_gramian");
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -n 60; exec {binary} --bind 127.0.0.1:0 --max-connections 1000")]);
    let process = Process::of(&mut command);
    let idle: Vec<_> = (0..200).map(|_| std::net::TcpStream::connect(&process.address).unwrap()).collect();
    // Idle connections make room for it, one by one.
    assert_eq!(get(&process, "/health/live").await.0, 200);
    drop(idle);
    assert_eq!(get(&process, "/health/ready").await.0, 200);
    process.terminate();
    let lines = process.finish().1;
    let n_lines = lines.iter().filter(|line| line.contains("cannot accept")).count();
    assert!((1..20).contains(&n_lines), "{n_lines}");
}
