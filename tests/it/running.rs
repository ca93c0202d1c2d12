//! The binary, run as a separate process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use serde_json::{Value, json};

use crate::support::{fibonacci_sphere, pause, receive, unpooled};

/// A running binary on a free port, killed when dropped.
pub struct Process {
    pub child: Child,
    address: String,
    pub lines: Arc<Mutex<Vec<String>>>,
    reader: Option<JoinHandle<()>>,
}

/// Returns the binary as a command, without the settings in the environment of the tests.
pub fn gramian() -> Command {
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

    pub fn of(command: &mut Command) -> Self {
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

    /// Returns the address on which the process listens.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Returns the peak resident memory.
    pub fn peak_resident_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
        let kibibytes: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        kibibytes << 10
    }

    /// Waits until the process has logged a line with this text.
    pub async fn has_logged(&self, text: &str) {
        while !self.lines.lock().unwrap().iter().any(|line| line.contains(text)) {
            pause().await;
        }
    }

    pub fn terminate(&self) {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    }

    /// Waits for the end of the process, and returns its status and its whole log.
    pub fn finish(mut self) -> (ExitStatus, Vec<String>) {
        let status = self.child.wait().unwrap();
        self.reader.take().unwrap().join().unwrap();
        let lines = std::mem::take(&mut *self.lines.lock().unwrap());
        (status, lines)
    }

    pub fn health(&self) -> ExitStatus {
        gramian().arg("health").env("GRAMIAN_BIND", &self.address).stderr(Stdio::null()).status().unwrap()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail if the process has already ended, which is fine.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub async fn get(process: &Process, path: &str) -> (u16, Value) {
    let answer = receive(unpooled().get(process.url(path))).await;
    (answer.status, answer.json().unwrap())
}

pub fn curvatures(n: usize) -> Value {
    let points = fibonacci_sphere(n);
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    json!({"cloud": {"points": points}, "kernel": kernel, "alpha": 1e-6, "queries": points[..1]})
}

/// Returns the fields of the first log line with this text.
pub fn logged(lines: &[String], text: &str) -> Value {
    let line =
        lines.iter().find(|line| line.contains(text)).unwrap_or_else(|| panic!("no {text}: {lines:#?}"));
    serde_json::from_str::<Value>(line).unwrap()["fields"].clone()
}
