//! API keys in a file, their limits, and services without keys.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use serde_json::json;

use crate::document::contract::AnswerParts;
use crate::running::{Process, gramian, logged};
use crate::support::{http_client, pause, receive, unpooled};
use crate::wire::limits::slow_request;

/// A temporary file of keys, removed when dropped.
struct KeysFile(PathBuf);

impl KeysFile {
    fn new(name: &str, lines: &[&str]) -> Self {
        let file =
            Self(std::env::temp_dir().join(format!("gramian-keys-{name}-{}.toml", std::process::id())));
        file.write(lines);
        file
    }

    /// Replaces the file atomically, as an operator should, so that readers always see a whole file.
    fn write(&self, lines: &[&str]) {
        let next = self.0.with_extension("next");
        fs::write(&next, lines.concat()).unwrap();
        fs::rename(next, &self.0).unwrap();
    }

    fn start(&self) -> Process {
        Process::start(&["--keys-file", self.0.to_str().unwrap()])
    }
}

impl Drop for KeysFile {
    fn drop(&mut self) {
        fs::remove_file(&self.0).ok();
    }
}

/// Returns a new key and its lines for the file, as the binary makes them.
fn key(name: &str, more: &str) -> (String, String) {
    let made = gramian().args(["key", name]).output().unwrap();
    let told = String::from_utf8(made.stderr).unwrap();
    let key = told.split_whitespace().last().unwrap().to_owned();
    let lines = String::from_utf8(made.stdout).unwrap();
    assert!(made.status.success() && !lines.contains(&key) && key.len() > 40);
    (key, format!("{lines}{more}\n"))
}

async fn list(process: &Process, key: &str) -> AnswerParts {
    receive(unpooled().get(process.url("/v1/clouds")).bearer_auth(key)).await
}

#[tokio::test]
async fn keys_of_a_file_are_replaced_without_a_restart() {
    let (old, lines_of_old) = key("lab", "");
    let (other, lines_of_other) = key("other", "");
    let (new, lines_of_new) = key("lab-next", "view = \"lab\"");
    let file = KeysFile::new("rotation", &[&lines_of_old, &lines_of_other]);
    let process = file.start();
    let posting = unpooled().post(process.url("/v1/clouds")).bearer_auth(&old);
    assert_eq!(receive(posting.json(&json!({"points": [[0, 1], [1, 0]]}))).await.status, 201);
    assert_eq!((list(&process, &other).await.status, list(&process, &new).await.status), (200, 401));
    file.write(&[&lines_of_other, &lines_of_old, &lines_of_new]);
    while list(&process, &new).await.status == 401 {
        pause().await;
    }
    // Holders of the old or the new key see the same clouds, and nobody else does.
    for (key, n_clouds) in [(&old, 1), (&new, 1), (&other, 0)] {
        let clouds = list(&process, key).await.json().unwrap();
        assert_eq!(clouds["clouds"].as_array().unwrap().len(), n_clouds);
    }
    file.write(&[&lines_of_new]);
    while list(&process, &old).await.status == 200 {
        pause().await;
    }
    assert_eq!((list(&process, &other).await.status, list(&process, &new).await.status), (401, 200));
    // An invalid file changes nothing.
    file.write(&[&lines_of_old, "oops"]);
    let refused = async {
        while !process.lines.lock().unwrap().iter().any(|line| line.contains("was not reloaded")) {
            pause().await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), refused).await.expect("the file is refused in the log");
    assert_eq!((list(&process, &old).await.status, list(&process, &new).await.status), (401, 200));
    process.terminate();
    let text = process.finish().1.join("\n");
    assert!(text.contains("\"key\":\"lab-next\""), "{text}");
    for secret in [&old, &new, &other] {
        assert!(!text.contains(secret.as_str()));
    }
    assert!(!text.contains("oops"));
}

/// Replaces the file by one of equal length and modification time, as with a secret mounted in a container.
#[tokio::test]
async fn a_file_of_the_same_length_and_time_is_another_if_its_keys_are() {
    let ((old, lines_of_old), (new, lines_of_new)) = (key("lab", ""), key("lab", ""));
    assert_eq!(lines_of_old.len(), lines_of_new.len());
    let file = KeysFile::new("same-time", &[&lines_of_old]);
    let since = fs::metadata(&file.0).unwrap().modified().unwrap();
    let process = file.start();
    assert_eq!((list(&process, &old).await.status, list(&process, &new).await.status), (200, 401));
    let next = file.0.with_extension("next");
    fs::write(&next, &lines_of_new).unwrap();
    fs::File::options().append(true).open(&next).unwrap().set_modified(since).unwrap();
    fs::rename(&next, &file.0).unwrap();
    while list(&process, &new).await.status == 401 {
        pause().await;
    }
    assert_eq!(list(&process, &old).await.status, 401);
}

#[tokio::test]
async fn events_count_among_the_requests_at_once_until_they_end() {
    let (one, lines_of_one) = key("one", "concurrent_requests = 1");
    let file = KeysFile::new("events", &[&lines_of_one]);
    let process = file.start();
    let client = http_client().build().unwrap();
    let asking = client.post(process.url("/v1/normals")).bearer_auth(&one).header("prefer", "respond-async");
    let job: serde_json::Value = asking.json(&slow_request()).send().await.unwrap().json().await.unwrap();
    let path = format!("/v1/jobs/{}", job["job_id"].as_str().unwrap());
    let following =
        client.get(process.url(&format!("{path}/events"))).bearer_auth(&one).send().await.unwrap();
    assert_eq!((following.status(), list(&process, &one).await.status), (200.try_into().unwrap(), 429));
    drop(following);
    while list(&process, &one).await.status == 429 {
        pause().await;
    }
    assert_eq!(receive(client.delete(process.url(&path)).bearer_auth(&one)).await.status, 204);
}

#[tokio::test]
async fn beyond_its_rate_a_key_is_told_when_to_come_back() {
    let (slow, lines_of_slow) = key("slow", "requests_per_minute = 6\nburst = 3");
    let (fast, lines_of_fast) = key("fast", "");
    let file = KeysFile::new("rate", &[&lines_of_slow, &lines_of_fast]);
    let process = file.start();
    for _ in 0..3 {
        assert_eq!(list(&process, &slow).await.status, 200);
    }
    let refused = list(&process, &slow).await;
    let problem: serde_json::Value = refused.json().unwrap();
    assert_eq!((refused.status, &problem["type"]), (429, &json!("/problems/rate-limited")));
    let seconds: u64 = refused.headers["retry-after"].to_str().unwrap().parse().unwrap();
    assert!((1..=10).contains(&seconds), "{seconds}");
    for _ in 0..20 {
        assert_eq!(list(&process, &fast).await.status, 200);
    }
    let metrics = receive(unpooled().get(process.url("/metrics"))).await;
    assert!(String::from_utf8_lossy(&metrics.bytes).contains("\ngramian_rate_limited_total 1\n"));
}

#[test]
fn without_keys_nobody_else_is_served_unless_that_is_meant() {
    let ended = gramian().args(["--bind", "0.0.0.0:0"]).output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr);
    assert!(!ended.status.success() && told.contains("GRAMIAN_ALLOW_ANONYMOUS"), "{told}");
    let process = Process::of(gramian().args(["--bind", "0.0.0.0:0"]).env("GRAMIAN_ALLOW_ANONYMOUS", "1"));
    process.terminate();
    logged(&process.finish().1, "no keys are configured");
    let (_, lines) = key("one", "");
    let file = KeysFile::new("exposed", &[&lines]);
    let process =
        Process::of(gramian().args(["--bind", "0.0.0.0:0", "--keys-file", file.0.to_str().unwrap()]));
    process.terminate();
    assert!(!process.finish().1.join("").contains("no keys are configured"));
}

#[test]
fn a_file_of_keys_that_is_none_ends_the_start() {
    let (key, _) = key("one", "");
    let file = KeysFile::new("none", &[&format!("[[key]]\nname = \"one\"\nhash = \"{key}\"\n")]);
    for path in [file.0.to_str().unwrap(), "/no/such/file"] {
        let mut command: Command = gramian();
        let ended = command.args(["--bind", "127.0.0.1:0", "--keys-file", path]).output().unwrap();
        let told = String::from_utf8_lossy(&ended.stderr);
        assert!(
            !ended.status.success() && told.contains("GRAMIAN_KEYS_FILE") && !told.contains(&key),
            "{told}"
        );
    }
}
