//! Draws docs/defaults.svg: accuracy of the bunny's normals for parameters around the default rule.
//!
//! `cargo run --release --example defaults_sweep`.
//!
//! Both panels show the median angle to the normals of the mesh. Left: exact points, against ℓ, one curve per
//! √ε ℓ. Right: against α, one curve per noise of the points. Rings mark the service's default.

#[path = "../tests/common/mod.rs"]
mod common;

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use common::clouds::noisy;
use common::fits;
use common::random::Random;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Multiples of the rule's ℓ and, below, of its √ε ℓ, and values of α.
const LENGTHS: [f64; 7] = [0.25, 0.35, 0.5, 0.7, 1.0, 1.8, 3.2];
const SMOOTHINGS: [f64; 4] = [0.25, 1.0, 2.5, 7.5];
const ALPHAS: [f64; 8] = [1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0, 3.0];
/// Standard deviations of the noise over half the diagonal of the bounding box.
const NOISES: [f64; 4] = [0.0, 0.002, 0.005, 0.01];
const COLOURS: [&str; 4] = ["#1b6ca8", "#c2571a", "#3a8f4d", "#7b4ea3"];

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bunny = Cloud::new(read(&root.join("tests/data/bunny.xyz"))?, 3)?;
    let truth = read(&root.join("tests/data/bunny.normals"))?;
    let mut svg = String::new();
    writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 900 380\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"900\" height=\"380\" fill=\"white\"/>"
    )?;

    let exact = Scan { cloud: bunny.clone(), truth: &truth };
    let (kernel, alpha) = exact.rule();
    let (length, smoothing) = (kernel.length_scale(), smoothing_length(&kernel)?);
    let left = Panel { x: 60.0, title: "exact points: ℓ over the rule's", log_x: (0.22, 3.7), max_y: 6.0 };
    left.frame(&mut svg, &LENGTHS)?;
    for (curve, factor) in SMOOTHINGS.iter().enumerate() {
        let mut line = Vec::new();
        for multiple in LENGTHS {
            line.push((multiple, exact.median_angle(multiple * length, factor * smoothing, alpha)?));
        }
        report(&format!("√ε ℓ of {factor} rules"), &line);
        left.curve(&mut svg, curve, &line, &format!("√ε ℓ: {factor} ×"))?;
        if *factor == 1.0 {
            left.ring(&mut svg, curve, 1.0, line[4].1)?;
        }
    }

    let right = Panel { x: 500.0, title: "α, for points with noise", log_x: (6e-5, 5.0), max_y: 18.0 };
    right.frame(&mut svg, &ALPHAS)?;
    for (curve, noise) in NOISES.iter().enumerate() {
        let scan = Scan { cloud: noisy(&bunny, noise * bunny.radius(), &mut Random(1)), truth: &truth };
        let (kernel, alpha) = scan.rule();
        let (length, smoothing) = (kernel.length_scale(), smoothing_length(&kernel)?);
        let mut line = Vec::new();
        for alpha in ALPHAS {
            line.push((alpha, scan.median_angle(length, smoothing, alpha)?));
        }
        report(&format!("noise {noise}, rule α {alpha:.3}"), &line);
        right.curve(&mut svg, curve, &line, &format!("noise {:.1} %", 100.0 * noise))?;
        right.ring(&mut svg, curve, alpha, scan.median_angle(length, smoothing, alpha)?)?;
    }
    svg.push_str("</svg>\n");
    std::fs::write(root.join("../docs/defaults.svg"), svg)?;
    Ok(())
}

/// A cloud with the true normals.
struct Scan<'a> {
    cloud: Cloud,
    truth: &'a [f64],
}

impl Scan<'_> {
    fn rule(&self) -> (Kernel, f64) {
        fits::default_kernel_and_alpha(&self.cloud, Purpose::Normals)
    }

    /// Median angle in degrees between normals as lines. Signs are not compared.
    fn median_angle(&self, length: f64, smoothing: f64, alpha: f64) -> Result<f64> {
        let kernel = fits::kernel(Family::Laplace { epsilon: (smoothing / length).powi(2) }, length);
        let surface = fits::surface(&fits::factorize(&self.cloud, kernel, alpha));
        let model = SurfaceModel::Signature;
        let request = GeometryRequest { model, checks_curvatures: false, ..GeometryRequest::CURVATURES };
        let geometry = Geometry::of(&surface, &self.cloud, &request, &Unobserved)?;
        let mut angles: Vec<f64> = (0..self.cloud.n_points())
            .map(|point| {
                let truth = &self.truth[3 * point..][..3];
                let cosine: f64 = geometry.normal(point).iter().zip(truth).map(|(a, b)| a * b).sum();
                cosine.abs().min(1.0).acos().to_degrees()
            })
            .collect();
        angles.sort_by(f64::total_cmp);
        Ok(angles[angles.len() / 2])
    }
}

/// The product √ε ℓ of a Laplace kernel.
fn smoothing_length(kernel: &Kernel) -> Result<f64> {
    match kernel.family() {
        Family::Laplace { epsilon } => Ok(epsilon.sqrt() * kernel.length_scale()),
        other => Err(format!("the rule for normals chose {other:?}").into()),
    }
}

fn read(path: &Path) -> Result<Vec<f64>> {
    let text = std::fs::read_to_string(path)?;
    Ok(text.split_whitespace().map(str::parse).collect::<std::result::Result<_, _>>()?)
}

fn report(name: &str, line: &[(f64, f64)]) {
    let entries: Vec<String> = line.iter().map(|(x, angle)| format!("{x}: {angle:.2}°")).collect();
    println!("{name:28} {}", entries.join("  "));
}

/// A panel with a logarithmic x axis and angles from 0° up.
struct Panel {
    x: f64,
    title: &'static str,
    log_x: (f64, f64),
    max_y: f64,
}

const WIDTH: f64 = 370.0;
const HEIGHT: f64 = 270.0;
const TOP: f64 = 50.0;

impl Panel {
    fn place(&self, x: f64, angle: f64) -> (f64, f64) {
        let (from, to) = self.log_x;
        let across = (x / from).ln() / (to / from).ln();
        (self.x + WIDTH * across, TOP + HEIGHT * (1.0 - (angle / self.max_y).min(1.0)))
    }

    fn frame(&self, svg: &mut String, ticks: &[f64]) -> Result<()> {
        let (left, bottom) = (self.x, TOP + HEIGHT);
        let middle = left + WIDTH / 2.0;
        writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{TOP}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"none\" stroke=\"#888\"/>"
        )?;
        writeln!(
            svg,
            "<text x=\"{left}\" y=\"{}\">median angle to the normals of the mesh</text>",
            TOP - 12.0
        )?;
        writeln!(
            svg,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 40.0,
            self.title
        )?;
        for tick in ticks {
            let (x, _) = self.place(*tick, 0.0);
            writeln!(svg, "<path d=\"M{x:.1} {bottom}v5\" stroke=\"#888\"/>")?;
            writeln!(svg, "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>", bottom + 18.0)?;
        }
        for step in 0..=self.max_y as usize / 2 {
            let angle = 2.0 * step as f64;
            let (_, y) = self.place(self.log_x.0, angle);
            writeln!(svg, "<path d=\"M{left} {y:.1}h{WIDTH}\" stroke=\"#ddd\"/>")?;
            writeln!(
                svg,
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{angle}°</text>",
                left - 6.0,
                y + 4.0
            )?;
        }
        Ok(())
    }

    fn curve(&self, svg: &mut String, curve: usize, line: &[(f64, f64)], name: &str) -> Result<()> {
        let colour = COLOURS[curve];
        let points: Vec<String> = line
            .iter()
            .map(|&(x, angle)| self.place(x, angle))
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            points.join(" ")
        )?;
        let (x, y) = (self.x + WIDTH - 110.0, TOP + 18.0 + 17.0 * curve as f64);
        writeln!(svg, "<path d=\"M{x} {}h18\" stroke=\"{colour}\" stroke-width=\"2\"/>", y - 4.0)?;
        writeln!(svg, "<text x=\"{}\" y=\"{y}\">{name}</text>", x + 24.0)?;
        Ok(())
    }

    fn ring(&self, svg: &mut String, curve: usize, x: f64, angle: f64) -> Result<()> {
        let (x, y) = self.place(x, angle);
        let colour = COLOURS[curve];
        writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"white\" stroke=\"{colour}\" stroke-width=\"3\"/>"
        )?;
        Ok(())
    }
}
