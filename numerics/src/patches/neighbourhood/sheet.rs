//! Separation of two sheets that are nearer to each other than their points.
//!
//! The nearest points of a thin plate come from both of its faces, and the principal axes of all of them
//! describe neither face. At least half of them belong to the face of the query, though. Planes are laid
//! through the query and some of its neighbours. The plane with the least median distance of the points is
//! the face (least median of squares: Rousseeuw 1984). The heights of the other points form a separate group.

use smallvec::SmallVec;

use crate::machine::vector::{dot, norm};

/// Number of nearest points that are examined.
const LOOKED_AT: usize = 16;

/// Number of neighbours that the planes are laid through.
const CANDIDATES: usize = 8;

/// Greatest height, relative to the distance of the farthest point, up to which there is only one sheet.
/// Planes are then not searched for.
const FLAT: f64 = 0.25;

/// Least ratio of the heights beyond a gap to those before it, if there are two sheets. In one sheet with
/// noise successive heights follow each other closely.
const APART: f64 = 3.0;

/// The sheet of a query.
pub(super) struct Sheet<const D: usize> {
    pub(super) normal: [f64; D],
    /// Height up to which points belong to the sheet, unit L.
    pub(super) reach: f64,
}

impl<const D: usize> Sheet<D> {
    /// Finds the sheet of the query if there are two among the nearest of these arms. Returns `None` if there
    /// is one.
    ///
    /// `arms` is `[count, D]`, ascending by length. `normal` is the normal that all of them together suggest.
    pub(super) fn of_two(arms: &[f64], normal: &[f64; D]) -> Option<Self> {
        let arms = &arms.as_chunks::<D>().0;
        let arms = &arms[..arms.len().min(LOOKED_AT)];
        let farthest = arms.last().map_or(0.0, |arm| norm(arm));
        if arms.len() < LOOKED_AT || arms.iter().all(|arm| dot(arm, normal).abs() <= FLAT * farthest) {
            return None;
        }
        let mut best: Option<([f64; D], [f64; LOOKED_AT])> = None;
        for candidate in candidates(arms, farthest) {
            let mut heights = [0.0; LOOKED_AT];
            heights.iter_mut().zip(arms).for_each(|(height, arm)| *height = dot(arm, &candidate).abs());
            heights.sort_unstable_by(f64::total_cmp);
            if best.as_ref().is_none_or(|(_, least)| heights[LOOKED_AT / 2] < least[LOOKED_AT / 2]) {
                best = Some((candidate, heights));
            }
        }
        let (normal, heights) = best?;
        // Heights below the floor are rounding.
        let floor = 1e-6 * farthest;
        let gap =
            (LOOKED_AT / 2..LOOKED_AT - 1).find(|&at| heights[at + 1] > APART * heights[at].max(floor))?;
        Some(Self { normal, reach: 0.5 * (heights[gap] + heights[gap + 1]) })
    }
}

/// Normals of planes through the query and its nearest neighbours: lines for D = 2, and none for D = 4.
fn candidates<const D: usize>(arms: &[[f64; D]], farthest: f64) -> SmallVec<[[f64; D]; 32]> {
    let apart = arms.iter().filter(|arm| norm(*arm) > 1e-6 * farthest);
    let near: SmallVec<[&[f64; D]; CANDIDATES]> = apart.take(CANDIDATES).collect();
    let mut normals = SmallVec::new();
    for (i, a) in near.iter().enumerate() {
        match D {
            2 => normals.extend(unit(|c| if c == 0 { -a[1] } else { a[0] }, farthest)),
            3 => {
                for b in &near[..i] {
                    let across = |c: usize| a[(c + 1) % D] * b[(c + 2) % D] - a[(c + 2) % D] * b[(c + 1) % D];
                    normals.extend(unit(across, farthest * farthest));
                }
            }
            _ => {}
        }
    }
    normals
}

/// Returns the vector scaled to length 1, or `None` if it is negligible against `size`.
fn unit<const D: usize>(component: impl Fn(usize) -> f64, size: f64) -> Option<[f64; D]> {
    let vector: [f64; D] = std::array::from_fn(component);
    let length = norm(&vector);
    (length > 1e-9 * size).then(|| vector.map(|c| c / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Arms from a point in the middle of a face of a plate, ascending. Its thickness is in spacings. The
    /// points have noise.
    fn plate(thickness: f64, noise: f64, random: &mut Random) -> Vec<f64> {
        let mut arms: Vec<[f64; 3]> = Vec::new();
        for face in [0.0, thickness] {
            for _ in 0..100 {
                let mut within = || 10.0 * (random.uniform() - 0.5);
                let (x, y) = (within(), within());
                arms.push([x, y, face + noise * random.normal()]);
            }
        }
        arms.sort_by(|a, b| norm(a).total_cmp(&norm(b)));
        arms.truncate(30);
        arms.concat()
    }

    #[test]
    fn the_face_of_a_thin_plate_is_found() {
        let mut random = Random(1);
        for thickness in [0.5, 0.75, 1.0, 1.5, 2.0] {
            for noise in [0.0, 0.05 * thickness] {
                let n_right = (0..100)
                    .filter(|_| {
                        let arms = plate(thickness, noise, &mut random);
                        let found = Sheet::of_two(&arms, &[0.6, 0.0, 0.8]);
                        found.is_some_and(|sheet: Sheet<3>| {
                            sheet.normal[2].abs() > 0.9 && sheet.reach < 0.9 * thickness
                        })
                    })
                    .count();
                // Faces less than a spacing apart are told apart at half of the points, other faces at three
                // quarters.
                let least = if thickness < 1.0 { 30 } else { 55 };
                assert!(n_right >= least, "{thickness}, {noise}: {n_right}");
            }
        }
    }

    #[test]
    fn one_sheet_is_no_two() {
        let mut random = Random(2);
        for noise in [0.0, 0.1, 0.3] {
            let n_two = (0..200)
                .filter(|_| {
                    let arms: Vec<f64> = plate(20.0, noise, &mut random);
                    Sheet::of_two(&arms, &[0.0, 0.0, 1.0]).is_some()
                })
                .count();
            assert!(n_two <= 2, "{noise}: {n_two}");
        }
    }
}
