//! Clouds and factors that survive the process, in a store on disk.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::common::random::Random;
use crate::running::Process;
use crate::support::{fibonacci_sphere, http_client, pause, receive, unpooled};

/// A temporary folder, removed at the end of the test.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("gramian-{name}-{}", std::process::id()));
        fs::remove_dir_all(&path).ok();
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    pub fn flags(&self) -> [&str; 2] {
        ["--store", self.0.to_str().unwrap()]
    }

    /// Returns all files in the folder and its subfolders.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        let mut folders = vec![self.0.clone()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
        files
    }

    fn object(&self, id: &str) -> PathBuf {
        let is_meant = |path: &Path| path.file_name().is_some_and(|name| name == id);
        self.files().into_iter().find(|path| is_meant(path)).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).ok();
    }
}

fn points(shift: f64, n: usize) -> Value {
    let moved = |x: &[f64; 3]| [x[0] + shift, x[1], x[2]];
    json!(fibonacci_sphere(n).iter().map(moved).collect::<Vec<_>>())
}

async fn post(process: &Process, path: &str, body: &Value) -> (u16, Value) {
    let client = http_client().build().unwrap();
    let answer = receive(client.post(process.url(path)).json(body)).await;
    (answer.status, serde_json::from_slice(&answer.bytes).unwrap())
}

async fn get(process: &Process, path: &str) -> (u16, Value) {
    let answer = receive(unpooled().get(process.url(path))).await;
    (answer.status, serde_json::from_slice(&answer.bytes).unwrap())
}

fn kill(mut process: Process) {
    process.child.kill().unwrap();
    process.child.wait().unwrap();
}

#[tokio::test]
async fn clouds_are_there_after_the_process_was_killed() {
    let folder = Folder::new("killed");
    let process = Process::start(&folder.flags());
    let (status, first) =
        post(&process, "/v1/clouds", &json!({"points": points(0.0, 50), "normals": points(0.0, 50)})).await;
    assert_eq!(status, 201);
    // Points inside a request are registered as well.
    let values: Vec<f64> = (0..40).map(f64::from).collect();
    let body = json!({"cloud": {"points": points(1.0, 40)}, "values": values, "kernel": {"family": "gauss"}});
    let (status, answer) = post(&process, "/v1/interpolation", &body).await;
    assert_eq!(status, 200);
    let inline = answer["diagnostics"]["cloud_id"].as_str().unwrap().to_owned();
    kill(process);

    let process = Process::start(&folder.flags());
    let id = first["cloud_id"].as_str().unwrap();
    let (_, list) = get(&process, "/v1/clouds").await;
    let listed: Vec<&Value> =
        list["clouds"].as_array().unwrap().iter().map(|cloud| &cloud["cloud_id"]).collect();
    assert_eq!(listed, [&json!(id), &json!(inline)]);
    assert_eq!(list["clouds"][0]["created_at"], first["created_at"]);
    let (status, again) = get(&process, &format!("/v1/clouds/{id}")).await;
    assert_eq!((status, &again), (200, &first));
    let by_id = json!({"cloud": {"id": inline}, "values": values, "kernel": {"family": "gauss"}});
    let (status, other) = post(&process, "/v1/interpolation", &by_id).await;
    assert_eq!((status, &other["values"]), (200, &answer["values"]));
    // Points that are already stored are recognised.
    let (status, known) = post(&process, "/v1/clouds", &json!({"points": points(1.0, 40)})).await;
    assert_eq!((status, &known["cloud_id"]), (200, &json!(inline)));
    let deleted = receive(unpooled().delete(process.url(&format!("/v1/clouds/{id}")))).await;
    assert_eq!(deleted.status, 204);
    kill(process);

    let process = Process::start(&folder.flags());
    assert_eq!(get(&process, &format!("/v1/clouds/{id}")).await.0, 404);
    assert!(!folder.files().iter().any(|path| path.to_str().unwrap().contains(id)), "{:?}", folder.files());
}

#[tokio::test]
async fn no_moment_to_be_killed_at_loses_what_was_acknowledged() {
    let folder = Folder::new("moments");
    let mut random = Random(1);
    let mut acknowledged: Vec<(String, Value)> = Vec::new();
    for moment in 0..100 {
        let process = Process::start(&folder.flags());
        // An earlier cloud must be complete and correct.
        if let Some((id, points)) = acknowledged.get((random.uniform() * acknowledged.len() as f64) as usize)
        {
            let n = points.as_array().unwrap().len();
            let body = json!({"cloud": {"id": id}, "values": vec![1.0; n], "kernel": {"family": "gauss"}});
            let (status, by_id) = post(&process, "/v1/interpolation", &body).await;
            assert_eq!(status, 200, "{moment}: {by_id}");
            assert_eq!(by_id["diagnostics"]["cloud_id"], json!(id));
        }
        let url = process.url("/v1/clouds");
        let mut posting = tokio::spawn(async move {
            let mut done = Vec::new();
            for k in 0..40 {
                let points = points(f64::from(100 * moment + k), 60);
                let request = unpooled().post(&url).json(&json!({"points": points}));
                let Ok(answer) = request.send().await else { break };
                let Ok(text) = answer.text().await else { break };
                let Ok(cloud) = serde_json::from_str::<Value>(&text) else { break };
                done.push((cloud["cloud_id"].as_str().unwrap().to_owned(), points));
            }
            done
        });
        let until = std::time::Duration::from_micros((random.uniform() * 60e3) as u64);
        let in_time = tokio::time::timeout(until, &mut posting).await;
        kill(process);
        let done = match in_time {
            Ok(done) => done,
            Err(_) => posting.await,
        };
        acknowledged.extend(done.unwrap());
    }
    println!("{} clouds were acknowledged before 100 ends", acknowledged.len());
    assert!(acknowledged.len() > 100, "{}", acknowledged.len());
    let process = Process::start(&folder.flags());
    let (mut listed, mut cursor) = (Vec::new(), String::new());
    loop {
        let (_, page) = get(&process, &format!("/v1/clouds?limit=1000{cursor}")).await;
        listed.extend(
            page["clouds"].as_array().unwrap().iter().map(|c| c["cloud_id"].as_str().unwrap().to_owned()),
        );
        let Some(next) = page["next"].as_str() else { break };
        cursor = format!("&cursor={next}");
    }
    for (id, _) in &acknowledged {
        assert!(listed.contains(id), "{id} is lost");
    }
}

/// Returns a request whose factor is large enough to be stored.
fn large_fit() -> Value {
    let kernel = json!({"family": "matern", "length_scale": 0.3});
    let values: Vec<f64> = (0..4000).map(|i| f64::from(i).sin()).collect();
    json!({"cloud": {"points": points(0.0, 4000)}, "values": values, "kernel": kernel, "alpha": 1e-6})
}

/// Returns how many solvers of a kind a process has prepared, and how many damaged objects it found.
async fn counts(process: &Process, kind: &str) -> (String, String) {
    let metrics = receive(unpooled().get(process.url("/metrics"))).await;
    let text = String::from_utf8(metrics.bytes).unwrap();
    let value = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap();
        line.rsplit_once(' ').unwrap().1.to_owned()
    };
    let of_kind = format!("gramian_solvers_prepared_total{{kind=\"{kind}\",of=\"both\"}}");
    (value(&of_kind), value("gramian_store_damaged_total"))
}

#[tokio::test]
async fn a_factor_is_read_instead_of_made_again() {
    let folder = Folder::new("factors");
    let factors = || {
        let is_factor = |path: &PathBuf| path.to_str().unwrap().contains("/factors/");
        // Unfinished files have a different name.
        let is_whole = |path: &PathBuf| !path.to_str().unwrap().contains('#');
        folder.files().into_iter().filter(|path| is_factor(path) && is_whole(path)).collect::<Vec<_>>()
    };
    let wait_for_factor = async || {
        while factors().is_empty() {
            pause().await;
        }
    };
    let process = Process::start(&folder.flags());
    let (status, first) = post(&process, "/v1/interpolation", &large_fit()).await;
    assert_eq!((status, counts(&process, "dense").await.0.as_str()), (200, "1"));
    wait_for_factor().await;
    kill(process);

    let began = std::time::Instant::now();
    let process = Process::start(&folder.flags());
    let (status, again) = post(&process, "/v1/interpolation", &large_fit()).await;
    println!("answered from the store {:.3} s after the start", began.elapsed().as_secs_f64());
    assert_eq!((status, &again), (200, &first), "to the last bit");
    assert_eq!(counts(&process, "restored").await, ("1".to_owned(), "0".to_owned()));
    kill(process);

    // After one flipped byte, the factor is computed again, stored again, and the damage is counted.
    let path = factors().pop().unwrap();
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    let process = Process::start(&folder.flags());
    let (status, again) = post(&process, "/v1/interpolation", &large_fit()).await;
    assert_eq!((status, &again), (200, &first));
    assert_eq!(counts(&process, "dense").await, ("1".to_owned(), "1".to_owned()));
    wait_for_factor().await;

    let id = first["diagnostics"]["cloud_id"].as_str().unwrap();
    let deleted = receive(unpooled().delete(process.url(&format!("/v1/clouds/{id}")))).await;
    assert_eq!((deleted.status, factors()), (204, vec![]));
}

#[tokio::test]
async fn what_is_damaged_is_not_served() {
    let folder = Folder::new("damaged");
    let process = Process::start(&folder.flags());
    let (_, cloud) = post(&process, "/v1/clouds", &json!({"points": points(0.0, 30)})).await;
    let id = cloud["cloud_id"].as_str().unwrap();
    kill(process);
    let object = folder.object(id);
    let mut bytes = fs::read(&object).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&object, bytes).unwrap();
    let process = Process::start(&folder.flags());
    let (status, problem) = get(&process, &format!("/v1/clouds/{id}")).await;
    assert_eq!((status, &problem["type"]), (404, &json!("/problems/unknown-cloud")));
    // The cloud can be posted again.
    assert_eq!(post(&process, "/v1/clouds", &json!({"points": points(0.0, 30)})).await.0, 201);
    assert_eq!(get(&process, &format!("/v1/clouds/{id}")).await.0, 200);
    process.terminate();
    let (_, log) = process.finish();
    assert!(log.iter().any(|line| line.contains("an object is damaged") && line.contains(id)), "{log:?}");
}

#[tokio::test]
async fn a_store_that_takes_nothing_leaves_memory_and_catches_up() {
    let folder = Folder::new("full");
    let process = Process::start(&[&folder.flags()[..], &["--store-required", "true"]].concat());
    // A file in the place of the folder makes every write fail, whichever user runs the tests.
    let owner = folder.0.join("everyone");
    fs::write(&owner, b"").unwrap();
    let (status, cloud) = post(&process, "/v1/clouds", &json!({"points": points(0.0, 30)})).await;
    assert_eq!(status, 201);
    let path = format!("/v1/clouds/{}", cloud["cloud_id"].as_str().unwrap());
    assert_eq!(get(&process, &path).await.0, 200);
    assert_eq!(get(&process, "/health/ready").await.0, 503);
    fs::remove_file(&owner).unwrap();
    while get(&process, "/health/ready").await.0 != 200 {
        pause().await;
    }
    kill(process);
    let process = Process::start(&folder.flags());
    assert_eq!(get(&process, &path).await.0, 200);
}

/// Checks that memory keeps clouds that the store does not take. Those acknowledged must survive, and the
/// rest is refused.
#[tokio::test]
async fn what_was_acknowledged_while_the_store_takes_nothing_makes_no_room_for_others() {
    let folder = Folder::new("acknowledged");
    let flags = ["--store-required", "true", "--cloud-bytes", "20000"];
    let process = Process::start(&[&folder.flags()[..], &flags].concat());
    let owner = folder.0.join("everyone");
    fs::write(&owner, b"").unwrap();
    let mut acknowledged = Vec::new();
    let mut n_refused = 0;
    for k in 0..20 {
        let body = json!({"points": points(f64::from(k), 100)});
        match post(&process, "/v1/clouds", &body).await {
            (201, cloud) => acknowledged.push(format!("/v1/clouds/{}", cloud["cloud_id"].as_str().unwrap())),
            (status, problem) => {
                assert_eq!((status, &problem["type"]), (503, &json!("/problems/overloaded")));
                n_refused += 1;
            }
        }
    }
    assert!(acknowledged.len() >= 2 && n_refused > 10, "{} and {n_refused}", acknowledged.len());
    fs::remove_file(&owner).unwrap();
    while get(&process, "/health/ready").await.0 != 200 {
        pause().await;
    }
    kill(process);
    let process = Process::start(&folder.flags());
    for path in &acknowledged {
        assert_eq!(get(&process, path).await.0, 200);
    }
}

#[tokio::test]
async fn catching_up_brings_nothing_back_that_was_deleted() {
    let folder = Folder::new("deleted");
    let flags = [&folder.flags()[..], &["--store-required", "true"]].concat();
    let [one, two] = [Process::start(&flags), Process::start(&flags)];
    let path_of = |cloud: Value| format!("/v1/clouds/{}", cloud["cloud_id"].as_str().unwrap());
    let deleted = path_of(post(&one, "/v1/clouds", &json!({"points": points(0.0, 30)})).await.1);
    assert_eq!(receive(unpooled().delete(two.url(&deleted))).await.status, 204);
    // The first process has it in memory, and another cloud that the store does not take.
    fs::remove_dir_all(folder.0.join("everyone")).ok();
    fs::write(folder.0.join("everyone"), b"").unwrap();
    let late = path_of(post(&one, "/v1/clouds", &json!({"points": points(1.0, 30)})).await.1);
    fs::remove_file(folder.0.join("everyone")).unwrap();
    while get(&one, "/health/ready").await.0 != 200 {
        pause().await;
    }
    assert_eq!((get(&two, &late).await.0, get(&two, &deleted).await.0), (200, 404));
}

#[tokio::test]
async fn a_damaged_cloud_is_whole_again_once_it_is_posted_again() {
    let folder = Folder::new("again");
    let process = Process::start(&folder.flags());
    let body = json!({"points": points(0.0, 30)});
    let (_, cloud) = post(&process, "/v1/clouds", &body).await;
    let id = cloud["cloud_id"].as_str().unwrap();
    kill(process);
    // Damages a byte of the points, which no listing reads.
    let object = folder.object(id);
    let mut bytes = fs::read(&object).unwrap();
    let last = bytes.len() - 40;
    bytes[last] ^= 1;
    fs::write(&object, &bytes).unwrap();
    let process = Process::start(&folder.flags());
    assert_eq!(post(&process, "/v1/clouds", &body).await.0, 201);
    kill(process);
    let process = Process::start(&folder.flags());
    assert_eq!(get(&process, &format!("/v1/clouds/{id}")).await.0, 200);
    let deleted = receive(unpooled().delete(process.url(&format!("/v1/clouds/{id}")))).await;
    assert_eq!(deleted.status, 204);
    let left: Vec<_> =
        folder.files().into_iter().filter(|file| file.to_string_lossy().contains(id)).collect();
    assert!(left.is_empty(), "also what was put aside: {left:?}");
}

#[tokio::test]
async fn what_another_process_deletes_is_gone_and_can_be_posted_again() {
    let folder = Folder::new("shared");
    let [one, two] = [Process::start(&folder.flags()), Process::start(&folder.flags())];
    let body = json!({"points": points(0.0, 30)});
    let (_, cloud) = post(&one, "/v1/clouds", &body).await;
    let path = format!("/v1/clouds/{}", cloud["cloud_id"].as_str().unwrap());
    assert_eq!(get(&two, &path).await, (200, cloud));
    let deleted = receive(unpooled().delete(two.url(&path))).await;
    assert_eq!((deleted.status, get(&two, &path).await.0), (204, 404));
    // The first process still has it in memory. But its list is the store's, and a new acknowledgement holds.
    assert_eq!(get(&one, "/v1/clouds").await.1["clouds"], json!([]));
    let (status, again) = post(&one, "/v1/clouds", &body).await;
    assert_eq!((status, get(&two, &path).await), (201, (200, again)));
    receive(unpooled().delete(two.url(&path))).await;
    // After ten seconds at most.
    while get(&one, &path).await.0 == 200 {
        pause().await;
    }
}

#[tokio::test]
async fn a_store_that_is_full_lets_the_oldest_go() {
    let folder = Folder::new("retention");
    let flags = [&folder.flags()[..], &["--store-bytes", "8192"]].concat();
    let process = Process::start(&flags);
    // 30 points take 1 KB.
    let mut ids = Vec::new();
    for k in 0..20 {
        let (status, cloud) =
            post(&process, "/v1/clouds", &json!({"points": points(f64::from(k), 30)})).await;
        assert_eq!(status, 201);
        ids.push(cloud["cloud_id"].as_str().unwrap().to_owned());
    }
    let listed = || async {
        let (_, list) = get(&process, "/v1/clouds").await;
        let clouds = list["clouds"].as_array().unwrap();
        clouds.iter().map(|cloud| cloud["cloud_id"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    while listed().await.len() > 9 {
        pause().await;
    }
    let left = listed().await;
    assert!(left.len() >= 5 && ids.ends_with(&left), "{} are left", left.len());
    // Also gone from memory.
    assert_eq!(get(&process, &format!("/v1/clouds/{}", ids[0])).await.0, 404);
    assert_eq!(get(&process, &format!("/v1/clouds/{}", ids[19])).await.0, 200);
}

#[tokio::test]
async fn what_could_not_be_read_again_is_not_kept() {
    let folder = Folder::new("unreadable");
    // A digit of two bytes in JSON becomes a number of eight bytes.
    let digits = |n: usize| {
        let point = |i: usize| (0..16).map(|k| (i >> (2 * k)) % 4).collect::<Vec<_>>();
        json!({"points": (0..n).map(point).collect::<Vec<_>>()})
    };
    let small = [&folder.flags()[..], &["--memory-bytes", "268435456"]].concat();
    let process = Process::start(&small);
    let (status, problem) = post(&process, "/v1/clouds", &digits(100_000)).await;
    assert_eq!((status, &problem["type"]), (413, &json!("/problems/problem-too-large")), "{problem}");
    assert_eq!(get(&process, "/v1/clouds").await.1["clouds"], json!([]));
    let (status, cloud) = post(&process, "/v1/clouds", &digits(50_000)).await;
    assert_eq!(status, 201, "{cloud}");
    kill(process);
    let process = Process::start(&small);
    assert_eq!(get(&process, &format!("/v1/clouds/{}", cloud["cloud_id"].as_str().unwrap())).await.0, 200);
    kill(process);
    // A cloud stored with more memory cannot be read with less. Asking again does not help, and the service
    // does not retry.
    let process = Process::start(&[&folder.flags()[..], &["--memory-bytes", "1073741824"]].concat());
    let (status, cloud) = post(&process, "/v1/clouds", &digits(100_000)).await;
    assert_eq!(status, 201);
    kill(process);
    let process = Process::start(&small);
    let id = cloud["cloud_id"].as_str().unwrap();
    assert_eq!(get(&process, &format!("/v1/clouds/{id}")).await.0, 500);
    let request =
        json!({"cloud": {"id": id}, "kernel": {"family": "matern", "length_scale": 1.0}, "alpha": 1.0});
    let asking = unpooled().post(process.url("/v1/normals")).header("prefer", "respond-async");
    let accepted = asking.json(&request).send().await.unwrap();
    let path = accepted.headers()["location"].to_str().unwrap().to_owned();
    let (status, problem) = get(&process, &format!("{path}/result")).await;
    assert_eq!(status, 500, "{problem}");
}

/// Stores hard links to one cloud under other names. Their heads are intact, and nothing else is read before
/// a request needs it.
#[tokio::test]
async fn ten_thousand_clouds_are_no_reason_to_be_late() {
    let folder = Folder::new("many");
    let process = Process::start(&folder.flags());
    let (_, cloud) = post(&process, "/v1/clouds", &json!({"points": points(0.0, 30)})).await;
    let id = cloud["cloud_id"].as_str().unwrap();
    kill(process);
    let object = folder.object(id);
    for k in 0..10_000 {
        let other = blake3::hash(&u64::to_le_bytes(k)).to_hex();
        fs::hard_link(&object, object.with_file_name(other.as_str())).unwrap();
    }
    // Time from the start to the first answer, which includes the first line of the log.
    let began = std::time::Instant::now();
    let process = Process::start(&folder.flags());
    assert_eq!(get(&process, "/health/ready").await.0, 200);
    let took = began.elapsed();
    println!("ready with 10,000 clouds after {:.3} s", took.as_secs_f64());
    let began = std::time::Instant::now();
    let bare = Process::start(&[]);
    assert_eq!(get(&bare, "/health/ready").await.0, 200);
    println!("with none after {:.3} s", began.elapsed().as_secs_f64());
    // The requirement is a second. The margin is wide, for a machine that is busy with other tests.
    assert!(took < 4 * began.elapsed().max(std::time::Duration::from_millis(250)), "{took:?}");
    let (_, page) = get(&process, "/v1/clouds?limit=1000").await;
    assert_eq!(page["clouds"].as_array().unwrap().len(), 1000);
    assert_eq!(get(&process, &format!("/v1/clouds/{id}")).await.0, 200);
}

#[test]
fn a_place_that_does_not_work_ends_the_start() {
    for place in ["/proc/nothing", "s3://", "http://example.org"] {
        let mut command = crate::running::gramian();
        let ended = command.args(["--bind", "127.0.0.1:0", "--store", place]).output().unwrap();
        assert!(!ended.status.success());
        assert!(
            String::from_utf8_lossy(&ended.stderr).contains("GRAMIAN_STORE")
                || String::from_utf8_lossy(&ended.stderr).contains("--store")
        );
    }
}
