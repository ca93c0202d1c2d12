//! Settings of the process: variables, flags and refusals.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use serde_json::json;

use crate::running::{Process, curvatures, get, gramian};
use crate::support::{receive, unpooled};

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
        "MAX_DENSE_POINTS",
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
        let request = unpooled().post(process.url("/v1/curvatures")).bearer_auth("two");
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
        "MAX_DENSE_POINTS",
        "MAX_QUERIES",
        "MAX_DIMENSION",
        "MAX_BODY_BYTES",
        "MAX_RESPONSE_BYTES",
        "MAX_CONNECTIONS",
        "MAX_JOBS",
        "STORE_JOB_BYTES",
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
        // On a free port, in case the process starts after all.
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
