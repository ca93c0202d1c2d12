//! Settings of the process: variables, flags and refusals.

use std::io::{BufRead, BufReader};
use std::process::{Output, Stdio};

use serde_json::json;

use crate::running::{Process, curvatures, get, gramian};
use crate::support::{receive, unpooled};

#[tokio::test]
async fn every_setting_has_a_variable_and_a_flag_which_wins() {
    let help = gramian().args(["serve", "--help"]).env("GRAMIAN_API_KEYS", "secret-key").output().unwrap();
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

/// Returns what a process that ends at once writes to standard error.
fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn the_help_shows_commands_first_and_settings_under_serve() {
    let help = gramian().arg("--help").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let commands = ["normals", "curvatures", "mesh", "ask", "serve", "health", "key", "completions"];
    let places = commands.map(|command| help.find(&format!("\n  {command} ")).expect(command));
    assert!(places.is_sorted(), "{help}");
    assert!(help.contains("gramian serve --help") && !help.contains("--bind"), "{help}");
    for shell in ["bash", "zsh", "fish"] {
        let completions = gramian().args(["completions", shell]).output().unwrap();
        let text = String::from_utf8(completions.stdout).unwrap();
        assert!(completions.status.success() && text.contains("curvatures"), "{shell}: {text}");
    }
}

#[tokio::test]
async fn sizes_and_localhost_are_understood_by_serve() {
    let mut command = gramian();
    command.args(["serve", "--bind", "localhost:0", "--memory-bytes", "1G", "--max-body-bytes", "1.5k"]);
    let process = Process::of(command.env("GRAMIAN_CACHE_BYTES", "128MiB"));
    let answer = receive(unpooled().post(process.url("/v1/curvatures")).json(&curvatures(300))).await;
    assert_eq!((answer.status, &answer.json().unwrap()["limit"]), (413, &json!(1536)));
}

#[test]
fn mistyped_settings_are_answered_with_the_nearest_and_values_with_an_example() {
    let option = told(&gramian().args(["--max-point", "5"]).output().unwrap());
    assert!(option.contains("'--max-points'"), "{option}");
    let command = told(&gramian().arg("serv").output().unwrap());
    assert!(command.contains("'serve'"), "{command}");
    for (name, value, example) in [
        ("BIND", "8080", "localhost:8080"),
        ("BIND", "example.org:8080", "0.0.0.0:8080"),
        ("CACHE_BYTES", "much", "512MiB or 4G"),
        ("MEMORY_BYTES", "1M", "4G"),
        ("STORE_BYTES", "4 apples", "512MiB or 4G"),
    ] {
        let text = told(&gramian().env(format!("GRAMIAN_{name}"), value).output().unwrap());
        assert!(text.contains(example) && text.contains(&format!("variable GRAMIAN_{name}")), "{text}");
        let flag = format!("--{}", name.to_lowercase().replace('_', "-"));
        let text = told(&gramian().args([&flag, value]).output().unwrap());
        assert!(text.contains(example) && !text.contains("variable GRAMIAN"), "{text}");
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
