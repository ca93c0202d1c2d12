#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let client = gramian_client::Client::new(&std::env::var("GRAMIAN_URL")?);
    let angles = (0..8).map(|i| f64::from(i) * std::f64::consts::FRAC_PI_4);
    let points: Vec<_> = angles.map(|angle| vec![angle.cos(), angle.sin()]).collect();
    let cloud = gramian_client::types::CloudInput::builder().points(points);
    let answer = client.compute_curvatures().body_map(|body| body.cloud(cloud)).send().await?;
    println!("{:?}", answer.mean_curvatures);
    Ok(())
}
