//! The log: what the process logs, and what it must never log.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

use crate::running::{Process, curvatures, get, gramian, logged};
use crate::support::{http_client, receive, unpooled};

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
        let request = unpooled().post(process.url("/v1/curvatures?q=0.123456789")).json(&body);
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

#[test]
fn the_log_counts_the_keys_of_a_file_too() {
    let file = std::env::temp_dir().join(format!("gramian-log-keys-{}.toml", std::process::id()));
    let made = ["one", "two"].map(|name| gramian().args(["key", name]).output().unwrap().stdout);
    std::fs::write(&file, made.concat()).unwrap();
    for (keys, n_keys) in [(None, 2), (Some("three"), 3)] {
        let mut command = gramian();
        command.args(["--bind", "127.0.0.1:0"]).env("GRAMIAN_KEYS_FILE", &file);
        command.envs(keys.map(|keys| ("GRAMIAN_API_KEYS", keys)));
        let process = Process::of(&mut command);
        process.terminate();
        assert_eq!(logged(&process.finish().1, "listening")["n_api_keys"], n_keys);
    }
    std::fs::remove_file(file).unwrap();
}

#[test]
fn the_log_counts_keys_and_names_unknown_settings() {
    for (keys, n_keys) in [(None, 0), (Some("one,two"), 2)] {
        let mut command = gramian();
        command.args(["--bind", "127.0.0.1:0"]).env("GRAMIAN_API_KEY", "mistyped");
        command.envs(keys.map(|keys| ("GRAMIAN_API_KEYS", keys)));
        let process = Process::of(&mut command);
        process.terminate();
        let lines = process.finish().1;
        assert_eq!(logged(&lines, "listening")["n_api_keys"], n_keys);
        let unknown = logged(&lines, "no such setting");
        assert_eq!(
            (&unknown["name"], &unknown["nearest"]),
            (&json!("GRAMIAN_API_KEY"), &json!("GRAMIAN_API_KEYS"))
        );
        assert!(!lines.join("\n").contains("mistyped"));
    }
}

#[tokio::test]
async fn the_log_has_an_address_to_open() {
    let process = Process::of(gramian().args(["--bind", "0.0.0.0:0"]).env("GRAMIAN_ALLOW_ANONYMOUS", "1"));
    let port = process.address().rsplit(':').next().unwrap().to_owned();
    let url = logged(&process.lines.lock().unwrap(), "listening")["url"].as_str().unwrap().to_owned();
    assert_eq!(url, format!("http://127.0.0.1:{port}/"));
    assert_eq!(receive(unpooled().get(url)).await.status, 200);
}

#[tokio::test]
async fn lines_of_the_log_are_short_whatever_clients_send() {
    let process = Process::start(&[]);
    // A quote that JSON must escape, and an encoded newline that must not split the line.
    let long = "\"%0a".repeat(5000);
    for request in [
        format!("GET /{long} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"),
        format!(
            "GET /v1/clouds?{long} HTTP/1.1\r\nHost: x\r\nConnection: close\r\nX-Request-Id: {long}\r\n\r\n"
        ),
        format!("{} / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n", "M".repeat(20_000)),
        format!("GET /v1/kernels HTTP/1.1\r\nHost: {long}\r\nConnection: close\r\n\r\n"),
    ] {
        let mut stream = std::net::TcpStream::connect(process.address()).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 "), "{answer}");
    }
    process.terminate();
    let lines = process.finish().1;
    let requests = lines.iter().filter(|line| line.contains("duration_ms"));
    // hyper refuses the quotes in the query by itself, so that request has no line.
    assert!(requests.count() >= 3, "{lines:#?}");
    for line in &lines {
        serde_json::from_str::<Value>(line).unwrap();
        // Method and path stand twice in a line. They are cut to 35 and 203 bytes, which escapes at most
        // double. The rest takes less than 450 bytes.
        assert!(line.len() <= 1400, "{} bytes: {line}", line.len());
    }
}

#[tokio::test]
async fn out_of_file_descriptors_is_logged_rarely_and_survived() {
    let binary = env!("CARGO_BIN_EXE_gramian");
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -n 60; exec {binary} --bind 127.0.0.1:0 --max-connections 1000")]);
    let process = Process::of(&mut command);
    let idle: Vec<_> = (0..200).map(|_| std::net::TcpStream::connect(process.address()).unwrap()).collect();
    // Idle connections make room for this one.
    assert_eq!(get(&process, "/health/live").await.0, 200);
    drop(idle);
    assert_eq!(get(&process, "/health/ready").await.0, 200);
    process.terminate();
    let lines = process.finish().1;
    let n_lines = lines.iter().filter(|line| line.contains("cannot accept")).count();
    // A failure every 200 ms (`BACK_OFF`) is logged every ten seconds at most (`LOG_INTERVAL`).
    assert!((1..20).contains(&n_lines), "{n_lines}");
}

#[tokio::test]
async fn requests_do_not_wait_for_a_log_reader_that_stalls() {
    let mut child = gramian().args(["--bind", "127.0.0.1:0"]).stderr(Stdio::piped()).spawn().unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("listening") {
        line.clear();
        assert!(log.read_line(&mut line).unwrap() > 0);
    }
    let entry: Value = serde_json::from_str(&line).unwrap();
    let url = format!("http://{}/v1/kernels", entry["fields"]["address"].as_str().unwrap());
    // More lines than the pipe (64 KiB) and the queue of the log (4,096 lines) hold, and nobody reads them.
    let client = http_client().timeout(Duration::from_secs(20)).build().unwrap();
    for _ in 0..6000 {
        assert_eq!(client.get(&url).send().await.unwrap().status(), 200);
    }
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    log.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    // Lines may be lost, but each written line is whole.
    assert!(rest.lines().all(|line| serde_json::from_str::<Value>(line).is_ok()));
    assert!(rest.contains("/v1/kernels"));
}
