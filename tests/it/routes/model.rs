//! Random operations on clouds, factors and jobs, with restarts, against a simple model of the expected
//! state.

use std::collections::{BTreeMap, BTreeSet};

use reqwest::Method;
use serde_json::{Value, json};

use crate::common::random::Random;
use crate::document::contract::AnswerParts;
use crate::running::Process;
use crate::store::durable::Folder;
use crate::support::{fibonacci_sphere, http_client, receive, unpooled};

const N_OPERATIONS: usize = 10_000;
const N_CLOUDS: usize = 12;
const N_KERNELS: usize = 3;
const KEYS: [&str; 2] = ["one", "other"];

/// Mean number of operations between two restarts.
const BETWEEN_RESTARTS: f64 = 500.0;

/// Indices of a key and of one of its clouds.
type Owned = (usize, usize);

/// The expected state of the service.
#[derive(Default)]
struct Model {
    clouds: BTreeSet<Owned>,
    /// Jobs by path, each with its key, cloud and kernel.
    jobs: BTreeMap<String, (Owned, usize)>,
    /// Values by cloud and kernel, as first answered.
    values: BTreeMap<(usize, usize), Value>,
}

struct World {
    random: Random,
    model: Model,
    ids: Vec<String>,
    folder: Folder,
    process: Process,
    n_done: BTreeMap<&'static str, usize>,
}

/// Returns points that no other cloud has.
fn points(cloud: usize) -> Value {
    let shift = cloud as f64;
    json!(fibonacci_sphere(6 + cloud).iter().map(|x| [x[0] + shift, x[1], x[2]]).collect::<Vec<_>>())
}

fn fit(kernel: usize, cloud: usize, by: Value) -> Value {
    let values: Vec<f64> = (0..6 + cloud).map(|i| (i as f64).sin()).collect();
    let length_scale = [0.5, 1.0, 1.5][kernel];
    let kernel = json!({"family": "matern", "length_scale": length_scale});
    json!({"cloud": by, "values": values, "kernel": kernel, "alpha": 1e-6, "queries": [[0.1, 0.2, 0.3]]})
}

fn start(folder: &Folder) -> Process {
    let flags = [&folder.flags()[..], &["--api-keys", "one,other", "--threads", "2"]].concat();
    Process::start(&flags)
}

impl World {
    fn new(seed: u64) -> Self {
        let folder = Folder::new("model");
        let process = start(&folder);
        let random = Random(seed);
        Self { random, model: Model::default(), ids: Vec::new(), folder, process, n_done: BTreeMap::new() }
    }

    fn below(&mut self, n: usize) -> usize {
        (self.random.uniform() * n as f64) as usize
    }

    fn did(&mut self, what: &'static str) {
        *self.n_done.entry(what).or_default() += 1;
    }

    async fn ask(&self, key: usize, method: Method, path: &str, body: Option<&Value>) -> AnswerParts {
        let request = unpooled().request(method, self.process.url(path)).bearer_auth(KEYS[key]);
        receive(match body {
            Some(body) => request.json(body),
            None => request,
        })
        .await
    }

    fn path(&self, cloud: usize) -> String {
        format!("/v1/clouds/{}", self.ids[cloud])
    }

    async fn step(&mut self) {
        let owned = (self.below(KEYS.len()), self.below(N_CLOUDS));
        let kernel = self.below(N_KERNELS);
        match self.below(100) {
            0..15 => self.register(owned).await,
            15..27 => self.describe(owned).await,
            27..40 => self.delete(owned).await,
            40..45 => self.list(owned.0).await,
            45..75 => self.interpolate(owned, kernel).await,
            75..80 => self.interpolate_points(owned, kernel).await,
            80..86 => self.start_job(owned, kernel).await,
            86..96 => self.fetch_job(owned.0).await,
            _ => self.forget_job(owned.0).await,
        }
        if self.random.uniform() < 1.0 / BETWEEN_RESTARTS {
            self.restart();
        }
    }

    async fn register(&mut self, owned: Owned) {
        let body = json!({"points": points(owned.1)});
        let answer = self.ask(owned.0, Method::POST, "/v1/clouds", Some(&body)).await;
        let expected = if self.model.clouds.insert(owned) { 201 } else { 200 };
        assert_eq!(answer.status, expected, "registering {owned:?}");
        assert_eq!(answer.json().unwrap()["cloud_id"], self.ids[owned.1].as_str());
        self.did("register");
    }

    async fn describe(&mut self, owned: Owned) {
        let answer = self.ask(owned.0, Method::GET, &self.path(owned.1), None).await;
        let is_there = self.model.clouds.contains(&owned);
        assert_eq!(answer.status, if is_there { 200 } else { 404 }, "describing {owned:?}");
        if is_there {
            assert_eq!(answer.json().unwrap()["n_points"], 6 + owned.1);
        }
        self.did("describe");
    }

    async fn delete(&mut self, owned: Owned) {
        let answer = self.ask(owned.0, Method::DELETE, &self.path(owned.1), None).await;
        let was_there = self.model.clouds.remove(&owned);
        assert_eq!(answer.status, if was_there { 204 } else { 404 }, "deleting {owned:?}");
        self.did("delete");
    }

    async fn list(&mut self, key: usize) {
        let answer = self.ask(key, Method::GET, "/v1/clouds?limit=1000", None).await.json().unwrap();
        let clouds = answer["clouds"].as_array().unwrap();
        let found: BTreeSet<&str> = clouds.iter().map(|cloud| cloud["cloud_id"].as_str().unwrap()).collect();
        let expected = self.model.clouds.iter().filter(|(owner, _)| *owner == key);
        let expected: BTreeSet<&str> = expected.map(|&(_, cloud)| self.ids[cloud].as_str()).collect();
        assert_eq!((found, clouds.len()), (expected.clone(), expected.len()));
        let times: Vec<&str> = clouds.iter().map(|cloud| cloud["created_at"].as_str().unwrap()).collect();
        assert!(times.is_sorted(), "{times:?}");
        self.did("list");
    }

    async fn interpolate(&mut self, owned: Owned, kernel: usize) {
        let request = fit(kernel, owned.1, json!({"id": self.ids[owned.1]}));
        let answer = self.ask(owned.0, Method::POST, "/v1/interpolation", Some(&request)).await;
        if self.model.clouds.contains(&owned) {
            self.check_values(owned.1, kernel, &answer);
        } else {
            assert_eq!(answer.status, 404, "interpolating {owned:?}");
        }
        self.did("interpolate");
    }

    async fn interpolate_points(&mut self, owned: Owned, kernel: usize) {
        let request = fit(kernel, owned.1, json!({"points": points(owned.1)}));
        let answer = self.ask(owned.0, Method::POST, "/v1/interpolation", Some(&request)).await;
        self.check_values(owned.1, kernel, &answer);
        self.model.clouds.insert(owned);
        self.did("interpolate points");
    }

    /// Checks an answer with values: equal requests have equal answers, to the last bit.
    fn check_values(&mut self, cloud: usize, kernel: usize, answer: &AnswerParts) {
        let document = answer.json().unwrap();
        assert_eq!(answer.status, 200, "{document}");
        assert_eq!(document["diagnostics"]["cloud_id"], self.ids[cloud].as_str());
        let values = document["values"].clone();
        let known = self.model.values.entry((cloud, kernel)).or_insert_with(|| values.clone());
        assert_eq!(*known, values, "cloud {cloud}, kernel {kernel}");
    }

    async fn start_job(&mut self, owned: Owned, kernel: usize) {
        let request = fit(kernel, owned.1, json!({"points": points(owned.1)}));
        let client = http_client().build().unwrap();
        let asked = client.post(self.process.url("/v1/interpolation")).bearer_auth(KEYS[owned.0]);
        let answer = asked.header("prefer", "respond-async").json(&request).send().await.unwrap();
        assert_eq!(answer.status(), 202);
        let path = answer.headers()["location"].to_str().unwrap().to_owned();
        // A job registers its points when it runs. Waiting for its result makes sure that this has happened.
        let registered = self.ask(owned.0, Method::GET, &format!("{path}/result"), None).await;
        assert_eq!(registered.status, 200, "{}", String::from_utf8_lossy(&registered.bytes));
        self.model.clouds.insert(owned);
        self.model.jobs.insert(path, (owned, kernel));
        self.did("start job");
    }

    async fn fetch_job(&mut self, key: usize) {
        let Some((path, (owned, kernel))) = self.some_job() else { return };
        let answer = self.ask(key, Method::GET, &format!("{path}/result"), None).await;
        if key == owned.0 {
            self.check_values(owned.1, kernel, &answer);
        } else {
            assert_eq!(answer.status, 404, "a job of another key");
        }
        let answer = self.ask(owned.0, Method::GET, &path, None).await;
        assert_eq!(answer.json().unwrap()["status"], "succeeded");
        self.did("fetch job");
    }

    async fn forget_job(&mut self, key: usize) {
        let Some((path, (owned, _))) = self.some_job() else { return };
        let answer = self.ask(key, Method::DELETE, &path, None).await;
        if key == owned.0 {
            assert_eq!(answer.status, 204);
            assert_eq!(self.ask(key, Method::GET, &path, None).await.status, 404);
            self.model.jobs.remove(&path);
        } else {
            assert_eq!(answer.status, 404, "a job of another key");
        }
        self.did("forget job");
    }

    fn some_job(&mut self) -> Option<(String, (Owned, usize))> {
        let n = self.model.jobs.len();
        let index = self.below(n.max(1));
        self.model.jobs.iter().nth(index).map(|(path, job)| (path.clone(), *job))
    }

    /// Restarts the process, after an orderly end or a kill in the middle of its work.
    fn restart(&mut self) {
        match self.below(2) {
            0 => self.process.terminate(),
            _ => self.process.child.kill().unwrap(),
        }
        self.process.child.wait().unwrap();
        self.process = start(&self.folder);
        self.did("restart");
    }
}

#[tokio::test]
async fn ten_thousand_operations_leave_what_a_simple_model_says() {
    let seed = std::env::var("MODEL_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(15);
    println!("MODEL_SEED={seed}");
    let mut world = World::new(seed);
    for cloud in 0..N_CLOUDS {
        let body = json!({"points": points(cloud)});
        let answer = world.ask(0, Method::POST, "/v1/clouds", Some(&body)).await;
        world.ids.push(answer.json().unwrap()["cloud_id"].as_str().unwrap().to_owned());
        world.model.clouds.insert((0, cloud));
    }
    for _ in 0..N_OPERATIONS {
        world.step().await;
    }
    println!("{:?}", world.n_done);
    assert!(world.n_done["restart"] >= 5 && world.n_done.len() == 10, "{:?}", world.n_done);
}
