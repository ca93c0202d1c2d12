//! Columns of numbers by their names, and which of them are positions, normals and colours.

use super::FileCloud;

/// Names of the columns of positions, normals and colours, as programs write them.
pub const POSITIONS: [&str; 3] = ["x", "y", "z"];
pub const NORMALS: [[&str; 3]; 2] = [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]];
pub const COLOURS: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];

/// Largest colours that files have: fractions, one byte, two bytes.
const COLOUR_SCALES: [f64; 3] = [1.0, 255.0, 65_535.0];

/// Numbers of a file by columns.
pub struct Columns {
    pub names: Vec<String>,
    /// Numbers of each column, all of one length.
    pub numbers: Vec<Vec<f64>>,
    pub places: Places,
}

/// Where the rows stand in the file.
pub enum Places {
    /// In lines of these numbers.
    Lines(Vec<usize>),
    /// One after another. Refusals have this name of a record.
    Records(&'static str),
}

/// The treatment of rows without a position.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Gaps {
    Refused,
    /// Organised scans mark by NaN where nothing was measured.
    LeftOut,
}

impl Columns {
    pub fn n_rows(&self) -> usize {
        self.numbers.first().map_or(0, Vec::len)
    }

    /// Makes a cloud of the columns. Coordinates are `x`, `y` and, if there is one, `z`.
    ///
    /// # Errors
    /// Refuses columns without coordinates, rows without a position unless they are left out, and normals
    /// that are not finite.
    pub fn into_cloud(mut self, gaps: Gaps) -> Result<FileCloud, String> {
        let lower: Vec<String> = self.names.iter().map(|name| name.to_lowercase()).collect();
        let place = |name: &&str| lower.iter().position(|other| other == name);
        let positions: Vec<usize> = POSITIONS.iter().filter_map(place).collect();
        if POSITIONS[..2].iter().any(|axis| place(axis).is_none()) {
            return Err(format!("the file has no columns x and y: {}", self.names.join(", ")));
        }
        if self.n_rows() == 0 {
            return Err("the file has no points".to_owned());
        }
        let d = positions.len();
        let group = |names: &[&str]| names.iter().map(place).collect::<Option<Vec<usize>>>();
        let normals = NORMALS.iter().find_map(|names| group(&names[..d]));
        let colours = COLOURS.iter().find_map(|names| group(names));
        let n_left_out = self.without_gaps(&positions, gaps)?;
        if let Some(normals) = &normals {
            self.check_finite(normals)?;
        }
        let used: Vec<usize> = [Some(&positions), normals.as_ref(), colours.as_ref()]
            .into_iter()
            .flatten()
            .flatten()
            .copied()
            .collect();
        Ok(FileCloud {
            points: self.interleaved(&positions),
            dimension: d,
            normals: normals.map(|columns| self.interleaved(&columns)),
            colours: colours.map(|columns| as_fractions(self.interleaved(&columns))),
            columns: self.into_others(&used),
            n_left_out,
        })
    }

    /// Takes rows without a position out. Returns their number.
    fn without_gaps(&mut self, positions: &[usize], gaps: Gaps) -> Result<usize, String> {
        let n_rows = self.n_rows();
        let has_position = |row: usize| positions.iter().all(|&column| self.numbers[column][row].is_finite());
        let kept: Vec<bool> = (0..n_rows).map(has_position).collect();
        let n_left_out = kept.iter().filter(|&&is_kept| !is_kept).count();
        if n_left_out == 0 {
            return Ok(0);
        }
        if gaps == Gaps::Refused {
            return Err(self.not_finite(positions).unwrap_or_default());
        }
        if n_left_out == n_rows {
            return Err(format!("no point has a position, of {n_rows}"));
        }
        for column in &mut self.numbers {
            let mut is_kept = kept.iter();
            column.retain(|_| is_kept.next().is_some_and(|&is_kept| is_kept));
        }
        if let Places::Lines(lines) = &mut self.places {
            let mut is_kept = kept.iter();
            lines.retain(|_| is_kept.next().is_some_and(|&is_kept| is_kept));
        }
        Ok(n_left_out)
    }

    /// Refuses numbers of these columns that are not finite.
    pub fn check_finite(&self, columns: &[usize]) -> Result<(), String> {
        self.not_finite(columns).map_or(Ok(()), Err)
    }

    /// Says which number is not finite, if one is, and how many rows have such.
    fn not_finite(&self, columns: &[usize]) -> Option<String> {
        let broken = |row: &usize| {
            let is_broken = |&&column: &&usize| !self.numbers[column][*row].is_finite();
            columns.iter().find(is_broken).map(|&column| (*row, column))
        };
        let mut rows = (0..self.n_rows()).filter_map(|row| broken(&row));
        let (row, column) = rows.next()?;
        let is = if self.numbers[column][row].is_nan() { "NaN" } else { "infinite" };
        let others = match rows.count() {
            0 => String::new(),
            n => format!(". {} rows have such numbers", n + 1),
        };
        Some(format!("{}: {} is {is}{others}", self.place_of(row), self.names[column]))
    }

    fn place_of(&self, row: usize) -> String {
        match &self.places {
            Places::Lines(lines) => format!("line {}", lines.get(row).copied().unwrap_or_default()),
            Places::Records(record) => format!("{record} {} of {}", row + 1, self.n_rows()),
        }
    }

    fn interleaved(&self, columns: &[usize]) -> Vec<f64> {
        let rows = 0..self.n_rows();
        rows.flat_map(|row| columns.iter().map(move |&column| self.numbers[column][row])).collect()
    }

    fn into_others(self, used: &[usize]) -> Vec<(String, Vec<f64>)> {
        let all = self.names.into_iter().zip(self.numbers).enumerate();
        all.filter(|(column, _)| !used.contains(column)).map(|(_, column)| column).collect()
    }
}

/// Scales colours by the largest number that their type has, which is guessed from the largest one present.
fn as_fractions(colours: Vec<f64>) -> Vec<f64> {
    let largest = colours.iter().copied().fold(0.0, f64::max);
    let scale = COLOUR_SCALES.into_iter().find(|&scale| largest <= scale).unwrap_or(largest);
    colours.into_iter().map(|x| x / scale).collect()
}
