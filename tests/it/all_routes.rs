//! Routes that compute, each with a request that it answers.

use serde_json::{Value, json};

use crate::support::{Answer, Server, fibonacci_sphere};

pub const N_POINTS: usize = 20;

/// A route that computes, with the optional parts of its request.
pub struct Route {
    pub path: &'static str,
    pub has_values: bool,
    pub has_geometry: bool,
}

const fn route(path: &'static str, has_values: bool, has_geometry: bool) -> Route {
    Route { path, has_values, has_geometry }
}

pub const ROUTES: [Route; 8] = [
    route("/v1/interpolation", true, false),
    route("/v1/posterior", true, false),
    route("/v1/normals", false, false),
    route("/v1/curvatures", false, false),
    route("/v1/surface-gradient", true, true),
    route("/v1/surface-gradient/matrix", false, true),
    route("/v1/laplace-beltrami", true, true),
    route("/v1/laplace-beltrami/matrix", false, true),
];

impl Route {
    /// Returns whether the route is about a surface: normals, curvatures or operators.
    pub fn is_geometry(&self) -> bool {
        self.has_geometry || !self.has_values
    }

    /// Returns a request that the route answers.
    pub fn request(&self) -> Value {
        let mut request = json!({
            "cloud": {"points": fibonacci_sphere(N_POINTS)},
            "kernel": {"family": "matern", "length_scale": 1.0},
            "alpha": 1e-8,
        });
        if self.has_values {
            request["values"] = json!((0..N_POINTS).map(|i| (i as f64).sin()).collect::<Vec<_>>());
        }
        request
    }

    /// Returns the request with one member set, or removed if `value` is `"absent"`.
    pub fn with(&self, pointer: &str, value: &Value) -> Value {
        let mut request = self.request();
        let (parent, name) = pointer.rsplit_once('/').unwrap();
        match request.pointer_mut(parent) {
            None => request[parent.trim_start_matches('/')] = json!({name: value}),
            Some(Value::Array(items)) => items[name.parse::<usize>().unwrap()] = value.clone(),
            Some(parent) if value == "absent" => {
                parent.as_object_mut().unwrap().remove(name);
            }
            Some(parent) => parent[name] = value.clone(),
        }
        request
    }

    /// Sends a body that must be refused for one field, then a good one. Returns the problem.
    pub async fn refuses(&self, server: &Server, body: &Value, status: u16, slug: &str, at: &str) -> Value {
        let problem = self.refuses_text(server, &body.to_string(), status, slug).await;
        assert_eq!(problem["errors"][0]["pointer"], at, "{}: {problem}", self.path);
        assert!(!problem["errors"][0]["detail"].as_str().unwrap().is_empty());
        problem
    }

    /// Sends a text that must be refused, then a good body. Returns the problem, which may point anywhere.
    pub async fn refuses_text(&self, server: &Server, body: &str, status: u16, slug: &str) -> Value {
        let shown = |answer: &Answer| format!("{} {:.300} -> {}", self.path, body, answer.text);
        let answer = server.post_text(self.path, body.to_owned()).await;
        assert_eq!(answer.status, status, "{}", shown(&answer));
        let problem = answer.expect_problem(status, slug);
        let good = server.post(self.path, &self.request()).await;
        assert_eq!(good.status, 200, "afterwards {}", shown(&good));
        problem
    }
}

/// Returns the route with this path.
pub fn route_of(path: &str) -> &'static Route {
    ROUTES.iter().find(|route| route.path == path).unwrap()
}

/// Returns `n` points of dimension `d` in the unit cube: fractional parts of multiples of square roots.
pub fn lattice(n: usize, d: usize) -> Vec<Vec<f64>> {
    let coordinate = |i: usize, k: usize| (i as f64 * (k as f64 + 2.0).sqrt()).fract();
    (0..n).map(|i| (0..d).map(|k| coordinate(i + 1, k)).collect()).collect()
}
