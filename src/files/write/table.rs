//! An answer as columns of numbers: positions, normals, all quantities, flags, and what the file had.

use serde_json::Value;

use super::answer::Answer;
use crate::files::read::FileCloud;

/// A row for each point of a cloud, or for each vertex of a mesh.
pub(super) struct Table {
    /// Positions in space, a row each. The third coordinate of the plane is 0.
    pub positions: Vec<f64>,
    /// Coordinates of a position.
    pub dimension: usize,
    /// Unit normals in space.
    pub normals: Option<Vec<f64>>,
    /// Numbers by their names. NaN where there is none.
    pub columns: Vec<(String, Vec<f64>)>,
    /// The column that programs colour by.
    pub quality: Option<String>,
    /// Vertices of each segment or triangle, `dimension` each. Empty for points.
    pub cells: Vec<u32>,
}

/// The column that says which rows have any flag.
const FLAGGED: &str = "flagged";

const COLOURS: [&str; 3] = ["red", "green", "blue"];

impl Table {
    /// # Errors
    /// Refuses an answer with other rows than the cloud has points.
    pub fn of(answer: &Answer, cloud: &FileCloud) -> Result<Self, String> {
        let placed = answer.placed(cloud)?;
        let model = placed.as_model();
        let n = model.n_vertices();
        let numbers = |of: &dyn Fn(usize) -> f64| (0..n).map(of).collect::<Vec<f64>>();
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        for property in model.properties() {
            columns.push((property.name.clone(), numbers(&|vertex| property.number(vertex))));
        }
        for (name, labels) in &placed.shape.labels {
            columns.push(((*name).to_owned(), labels.iter().map(|&label| f64::from(label)).collect()));
        }
        let normals: Option<Vec<[f64; 3]>> = (0..n).map(|vertex| model.normal(vertex)).collect();
        let mut table = Self {
            positions: placed.shape.positions.coordinates().to_vec(),
            dimension: placed.shape.positions.dimension(),
            normals: normals.filter(|normals| !normals.is_empty()).map(|normals| normals.concat()),
            quality: model.quality().map(|property| property.name.clone()),
            columns,
            cells: placed.shape.cells.clone(),
        };
        if !answer.is_mesh() {
            table.columns.extend(flag_columns(&answer.others["flags"], n));
            table.add_own_columns(cloud);
        }
        Ok(table)
    }

    pub fn n_rows(&self) -> usize {
        self.positions.len().checked_div(self.dimension).unwrap_or_default()
    }

    /// All columns with their names: positions and normals, an axis each, and the numbers.
    pub fn all_columns(&self) -> Vec<(String, Column<'_>)> {
        let d = self.dimension;
        let axis_name = |axis: usize| match d {
            2 | 3 => ["x", "y", "z"][axis].to_owned(),
            _ => format!("x{axis}"),
        };
        let positions = (0..d)
            .map(|axis| (axis_name(axis), Column { numbers: &self.positions, stride: d, offset: axis }));
        let normals = self.normals.iter().flat_map(|numbers| {
            (0..d.min(3)).map(move |axis| {
                (format!("n{}", axis_name(axis)), Column { numbers, stride: 3, offset: axis })
            })
        });
        let numbers = self
            .columns
            .iter()
            .map(|(name, numbers)| (name.clone(), Column { numbers, stride: 1, offset: 0 }));
        positions.chain(normals).chain(numbers).collect()
    }

    /// Adds colours and columns of the file. A name that is taken gets a prefix.
    fn add_own_columns(&mut self, cloud: &FileCloud) {
        let colour = |axis: usize| {
            cloud.colours.as_ref().map(|all| all.iter().skip(axis).step_by(3).copied().collect())
        };
        let colours =
            COLOURS.iter().enumerate().filter_map(|(axis, name)| Some(((*name).to_owned(), colour(axis)?)));
        let own: Vec<(String, Vec<f64>)> = colours.chain(cloud.columns.iter().cloned()).collect();
        for (name, numbers) in own {
            let is_taken = self.all_columns().iter().any(|(taken, _)| *taken == name);
            let name = if is_taken { format!("file_{name}") } else { name };
            self.columns.push((name, numbers));
        }
    }
}

/// A column within rows of numbers.
#[derive(Clone, Copy)]
pub(super) struct Column<'a> {
    numbers: &'a [f64],
    stride: usize,
    offset: usize,
}

impl Column<'_> {
    pub fn at(&self, row: usize) -> f64 {
        self.numbers[row * self.stride + self.offset]
    }
}

/// A column of zeros and ones for all flags, and one for each reason that occurs.
fn flag_columns(flags: &Value, n: usize) -> Vec<(String, Vec<f64>)> {
    let mut columns = vec![(FLAGGED.to_owned(), vec![0.0; n])];
    for flag in flags.as_array().into_iter().flatten() {
        let (Some(query), Some(reason)) = (flag["query"].as_u64(), flag["reason"].as_str()) else { continue };
        let name = format!("flag_{reason}");
        if columns.iter().all(|(other, _)| *other != name) {
            columns.push((name.clone(), vec![0.0; n]));
        }
        for (_, numbers) in columns.iter_mut().filter(|(other, _)| *other == FLAGGED || *other == name) {
            if let Some(number) = numbers.get_mut(query as usize) {
                *number = 1.0;
            }
        }
    }
    columns
}
