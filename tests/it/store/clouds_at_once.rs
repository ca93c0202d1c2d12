//! Concurrent posts and deletes of one cloud: its list agrees with its objects, and no file is left over.

use std::path::PathBuf;
use std::time::Duration;

use futures_util::future::join_all;
use reqwest::Method;
use serde_json::{Value, json};

use crate::common::random::Random;
use crate::document::contract::AnswerParts;
use crate::running::Process;
use crate::store::durable::Folder;
use crate::support::{Server, pause, receive, unpooled};

const N_CLIENTS: usize = 8;

/// Requests that each client sends per round, before the state is checked.
const N_REQUESTS: usize = 30;

const N_ROUNDS: usize = 6;

/// Time after which every process must know that another one deleted a cloud. The bound is 10 s. Doubled for
/// busy machines.
const KNOWN_TO_ALL: Duration = Duration::from_secs(20);

/// Returns the points of cloud 0, which all clients post and delete, or of another, which is never deleted.
fn points(cloud: usize) -> Value {
    json!({"points": [[cloud, 0.5], [1.5, 2.5], [3.5, 0.25]]})
}

async fn ask(url: String, method: Method, body: Option<&Value>) -> AnswerParts {
    let request = unpooled().request(method, url);
    receive(match body {
        Some(body) => request.json(body),
        None => request,
    })
    .await
}

/// Returns the ids on all pages of the list, two clouds a page. Only the last page may be empty.
async fn listed(process: &Process) -> Vec<String> {
    let (mut ids, mut cursor) = (Vec::new(), String::new());
    loop {
        let page = ask(process.url(&format!("/v1/clouds?limit=2{cursor}")), Method::GET, None).await;
        let page = page.json().unwrap();
        let clouds = page["clouds"].as_array().unwrap();
        ids.extend(clouds.iter().map(|cloud| cloud["cloud_id"].as_str().unwrap().to_owned()));
        let Some(next) = page["next"].as_str() else { return ids };
        assert!(!clouds.is_empty(), "a page is empty, and there is another one");
        cursor = format!("&cursor={next}");
    }
}

/// Sends one client's requests, each to a random process.
async fn client(processes: &[Process], id: &str, seed: u64) {
    let mut random = Random(seed);
    for _ in 0..N_REQUESTS {
        let process = &processes[(random.uniform() * processes.len() as f64) as usize];
        let cloud = || process.url(&format!("/v1/clouds/{id}"));
        let (answer, expected) = match (random.uniform() * 10.0) as usize {
            0..4 => (ask(process.url("/v1/clouds"), Method::POST, Some(&points(0))).await, &[200, 201][..]),
            4..7 => (ask(cloud(), Method::DELETE, None).await, &[204, 404][..]),
            7..9 => (ask(cloud(), Method::GET, None).await, &[200, 404][..]),
            _ => {
                listed(process).await;
                continue;
            }
        };
        assert!(expected.contains(&answer.status), "{}: {:?}", answer.status, answer.json());
    }
}

/// Returns the files of clouds other than `always`, the clouds that are never deleted.
fn left(folder: &Folder, always: &[String]) -> Vec<PathBuf> {
    let is_of = |file: &PathBuf, id: &String| file.to_string_lossy().contains(id.as_str());
    folder.files().into_iter().filter(|file| !always.iter().any(|id| is_of(file, id))).collect()
}

/// Checks that the process and the store agree on the cloud.
///
/// # Errors
/// Returns what was found if GET, the list and the files disagree, or if a cloud of `always` is not listed
/// exactly once.
async fn agrees(process: &Process, id: &str, folder: &Folder, always: &[String]) -> Result<(), String> {
    let status = ask(process.url(&format!("/v1/clouds/{id}")), Method::GET, None).await.status;
    let ids = listed(process).await;
    let (n_listed, files) = (ids.iter().filter(|listed| *listed == id).count(), left(folder, always));
    let n_expected = usize::from(status == 200);
    let are_all_there = always.iter().all(|id| ids.iter().filter(|listed| *listed == id).count() == 1);
    let is_right = n_listed == n_expected && files.len() == n_expected && are_all_there;
    is_right
        .then_some(())
        .ok_or(format!("GET {status}, listed {n_listed} times, files {files:?}, all {ids:?}"))
}

async fn rounds(processes: &[Process], folder: &Folder) {
    let mut ids = Vec::new();
    for cloud in 0..4 {
        let answer = ask(processes[0].url("/v1/clouds"), Method::POST, Some(&points(cloud))).await;
        assert_eq!(answer.status, 201);
        ids.push(answer.json().unwrap()["cloud_id"].as_str().unwrap().to_owned());
    }
    let (id, always) = ids.split_first().unwrap();
    for round in 0..N_ROUNDS {
        let seed = |client: usize| (100 * round + client + 1) as u64;
        join_all((0..N_CLIENTS).map(|k| client(processes, id, seed(k)))).await;
        let began = std::time::Instant::now();
        for process in processes {
            while let Err(said) = agrees(process, id, folder, always).await {
                let may_not_know_yet = processes.len() > 1 && began.elapsed() < KNOWN_TO_ALL;
                assert!(may_not_know_yet, "round {round}: {said}");
                pause().await;
            }
        }
    }
}

#[tokio::test]
async fn a_list_says_what_its_store_says_whoever_posts_and_deletes_at_once() {
    let folder = Folder::new("at-once");
    rounds(&[Process::start(&folder.flags())], &folder).await;
}

#[tokio::test]
async fn two_processes_on_one_store_agree_on_a_cloud_that_both_post_and_delete() {
    let folder = Folder::new("at-once-two");
    rounds(&[Process::start(&folder.flags()), Process::start(&folder.flags())], &folder).await;
}

/// Deletes one cloud from many clients at once, spread over `urls`, in 20 rounds. Exactly one DELETE must
/// succeed.
async fn delete_at_once(urls: &[String]) {
    for round in 0..20 {
        let created = ask(urls[0].clone(), Method::POST, Some(&points(9))).await;
        assert_eq!(created.status, 201, "round {round}");
        let id = created.json().unwrap()["cloud_id"].as_str().unwrap().to_owned();
        for url in urls {
            // The cloud is now in memory behind every address.
            assert_eq!(ask(format!("{url}/{id}"), Method::GET, None).await.status, 200);
        }
        let deleting =
            (0..N_CLIENTS).map(|k| ask(format!("{}/{id}", urls[k % urls.len()]), Method::DELETE, None));
        let mut statuses: Vec<u16> = join_all(deleting).await.iter().map(|answer| answer.status).collect();
        statuses.sort_unstable();
        assert_eq!((statuses[0], &statuses[1..]), (204, &[404; N_CLIENTS - 1][..]), "round {round}");
    }
}

#[tokio::test]
async fn a_cloud_is_deleted_once() {
    let server = Server::start().await;
    delete_at_once(&[server.url("/v1/clouds")]).await;
}

#[tokio::test]
async fn a_stored_cloud_is_deleted_once_by_all_processes_together() {
    let folder = Folder::new("deleted-once");
    let processes = [Process::start(&folder.flags()), Process::start(&folder.flags())];
    delete_at_once(&[processes[0].url("/v1/clouds"), processes[1].url("/v1/clouds")]).await;
}
