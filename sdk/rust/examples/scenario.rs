//! The scenario that every client runs, against the server at GRAMIAN_URL.

use std::error::Error as StdError;

use gramian_client::types::{self, CloudId, CloudInput, Kernel, KernelFamily, PosteriorQuantity};
use gramian_client::{Client, Error};

/// Eight points of the unit circle.
#[expect(
    clippy::approx_constant,
    reason = "eight digits, so that the id is the same as in the other clients"
)]
const POINTS: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [0.70710678, 0.70710678],
    [0.0, 1.0],
    [-0.70710678, 0.70710678],
    [-1.0, 0.0],
    [-0.70710678, -0.70710678],
    [0.0, -1.0],
    [0.70710678, -0.70710678],
];

const CLOUD_ID: &str = "bd711900da5366ee5d24b56f902cd7e737e487987d5285c2791b2955e124c69c";

type Outcome = Result<(), Box<dyn StdError>>;

#[tokio::main(flavor = "current_thread")]
async fn main() -> Outcome {
    let client = Client::new(&std::env::var("GRAMIAN_URL").expect("GRAMIAN_URL is the server's base URL"));
    let registered = client.create_cloud().body_map(|body| body.points(rows(&POINTS))).send().await?;
    assert_eq!(registered.cloud_id.as_str(), CLOUD_ID);

    let id = &registered.cloud_id;
    curvatures_are_null_at_the_centre(&client, id).await?;
    the_matrix_turns_cosines_into_their_negatives(&client, id).await?;
    the_posterior_has_a_variance(&client, id).await?;
    a_refusal_names_the_field(&client, id).await;
    Ok(())
}

async fn curvatures_are_null_at_the_centre(client: &Client, id: &CloudId) -> Outcome {
    let queries = rows(&[[1.0, 0.0], [0.0, 0.0]]);
    let answer = client
        .compute_curvatures()
        .body_map(|body| body.cloud(cloud(id)).queries(queries).kernel(gauss(2.0)).alpha(0.0))
        .send()
        .await?;
    let on_the_circle = answer.mean_curvatures[0].expect("the circle has a curvature");
    assert!((on_the_circle - 1.0).abs() < 1e-6, "{on_the_circle}");
    assert_eq!(answer.mean_curvatures[1], None);
    assert_eq!(answer.flags[0].query, 1);
    Ok(())
}

async fn the_matrix_turns_cosines_into_their_negatives(client: &Client, id: &CloudId) -> Outcome {
    let answer = client
        .assemble_laplace_beltrami_matrix()
        .body_map(|body| body.cloud(cloud(id)).kernel(gauss(2.0)).alpha(0.0))
        .send()
        .await?;
    assert_eq!(answer.matrix.len(), POINTS.len());
    for (row, cosine) in answer.matrix.iter().zip(cosines()) {
        let row = row.as_ref().expect("every point of the circle has a normal");
        let applied = dot(row, &cosines());
        // Eight points on the circle take a wave of frequency 7 for a cosine, which adds the fraction
        // 48 I_7(1/2)/I_1(1/2) = 2.3e-6. The Bessel functions I_k are the Fourier coefficients of this kernel
        // on the circle, up to a factor.
        assert!((applied + cosine).abs() < 5e-6, "{applied} for {cosine}");
    }
    Ok(())
}

async fn the_posterior_has_a_variance(client: &Client, id: &CloudId) -> Outcome {
    let queries = rows(&[[0.9, 0.1]]);
    let include = vec![PosteriorQuantity::Variances];
    let answer = client
        .compute_posterior()
        .body_map(|body| {
            body.cloud(cloud(id)).values(cosines()).queries(queries).alpha(1e-6).include(include)
        })
        .send()
        .await?;
    assert_eq!(answer.means.len(), 1);
    assert_eq!(answer.variances.len(), 1);
    assert!(answer.variances[0] >= 0.0);
    Ok(())
}

async fn a_refusal_names_the_field(client: &Client, id: &CloudId) {
    let outcome =
        client.compute_curvatures().body_map(|body| body.cloud(cloud(id)).kernel(gauss(-1.0))).send().await;
    let Err(Error::ErrorResponse(problem)) = outcome else {
        panic!("the service should refuse a negative length, but: {outcome:?}")
    };
    assert_eq!(problem.status(), 422);
    assert_eq!(problem.type_, "/problems/invalid-request");
    assert_eq!(problem.errors[0].pointer, "/kernel/length_scale");
}

fn cloud(id: &CloudId) -> types::builder::CloudInput {
    CloudInput::builder().id(Some(id.clone()))
}

/// Returns the Gaussian kernel exp(−r²/ℓ²).
fn gauss(length_scale: f64) -> Kernel {
    let kernel = Kernel::builder().family(KernelFamily::Gauss).length_scale(length_scale);
    kernel.try_into().expect("a kernel needs a family only")
}

fn rows(points: &[[f64; 2]]) -> Vec<Vec<f64>> {
    points.iter().map(|point| point.to_vec()).collect()
}

/// Returns cos θ at the points, their first coordinate.
fn cosines() -> Vec<f64> {
    POINTS.iter().map(|[x, _]| *x).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
