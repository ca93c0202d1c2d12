//! OBJ: the vertices of a mesh, with the colours and normals that they may have.

use super::FileCloud;
use super::columns::{Columns, Gaps, NORMALS, Places};
use super::records::number_of;

/// Reads vertices (`v`), and normals (`vn`) if every vertex has one: as many in the same order, or named by
/// the faces. Everything else is skipped.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let mut mesh = Mesh::default();
    // Comments and names may be in any encoding.
    for (at, line) in String::from_utf8_lossy(bytes).lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        let keyword = words.next().unwrap_or_default();
        let refused = |reason| format!("line {}: {reason}", at + 1);
        match keyword {
            "v" => {
                mesh.add_vertex(&words.collect::<Vec<_>>()).map_err(refused)?;
                mesh.lines.push(at + 1);
            }
            "vn" => mesh.add_normal(&words.collect::<Vec<_>>()).map_err(refused)?,
            "f" => mesh.add_face(words),
            _ => {}
        }
    }
    mesh.into_cloud()
}

#[derive(Default)]
struct Mesh {
    /// Numbers of the vertices, `width` for each.
    vertices: Vec<f64>,
    width: usize,
    lines: Vec<usize>,
    normals: Vec<[f64; 3]>,
    /// The normal of each vertex that faces name, by its index.
    normal_of: Vec<Option<usize>>,
    has_faces: bool,
    /// Whether faces give a vertex several normals, or none.
    is_torn: bool,
}

impl Mesh {
    fn add_vertex(&mut self, words: &[&str]) -> Result<(), String> {
        let first = if self.width == 0 { words.len() } else { self.width };
        if !matches!(words.len(), 3 | 4 | 6 | 7) {
            let n = words.len();
            return Err(format!(
                "a vertex has 3 coordinates, and maybe a weight and 3 colours, not {n} numbers"
            ));
        }
        if words.len() != first {
            return Err(format!("{} numbers, where the vertices before have {first}", words.len()));
        }
        self.width = first;
        for word in words {
            self.vertices.push(number_of(word)?);
        }
        Ok(())
    }

    fn add_normal(&mut self, words: &[&str]) -> Result<(), String> {
        let [x, y, z] = words else { return Err(format!("a normal has 3 numbers, not {}", words.len())) };
        self.normals.push([number_of(x)?, number_of(y)?, number_of(z)?]);
        Ok(())
    }

    /// Notes the normals that a face names. They are left out if a face names none, or none that exists.
    fn add_face<'a>(&mut self, corners: impl Iterator<Item = &'a str>) {
        self.has_faces = true;
        self.normal_of.resize(self.lines.len(), None);
        for corner in corners {
            self.is_torn |= self.add_corner(corner).is_none();
        }
    }

    /// Notes the normal of a corner of a face. `None` if the vertex has another one, or the corner none.
    fn add_corner(&mut self, corner: &str) -> Option<()> {
        let mut indices = corner.split('/');
        let vertex = index_of(indices.next()?, self.lines.len())?;
        let normal = index_of(indices.nth(1)?, self.normals.len())?;
        let known = *self.normal_of.get_mut(vertex)?.get_or_insert(normal);
        (self.normals.get(known)? == self.normals.get(normal)?).then_some(())
    }

    /// The normal of each vertex, if each has one.
    fn normals(&self) -> Option<Vec<[f64; 3]>> {
        let n = self.lines.len();
        if !self.has_faces {
            return (self.normals.len() == n && n > 0).then(|| self.normals.clone());
        }
        if self.is_torn || self.normal_of.len() != n {
            return None;
        }
        self.normal_of.iter().map(|normal| self.normals.get((*normal)?).copied()).collect()
    }

    fn into_cloud(self) -> Result<FileCloud, String> {
        let normals = self.normals();
        let named: &[&str] = match self.width {
            6 => &["x", "y", "z", "red", "green", "blue"],
            7 => &["x", "y", "z", "", "red", "green", "blue"],
            _ => &["x", "y", "z"],
        };
        let column = |at: usize| self.vertices.iter().skip(at).step_by(self.width.max(1)).copied().collect();
        let kept = named.iter().enumerate().filter(|(_, name)| !name.is_empty());
        let (mut names, mut numbers): (Vec<String>, Vec<Vec<f64>>) =
            kept.map(|(at, name)| ((*name).to_owned(), column(at))).unzip();
        for (axis, name) in NORMALS[0].iter().enumerate() {
            let Some(normals) = &normals else { break };
            names.push((*name).to_owned());
            numbers.push(normals.iter().map(|normal| normal[axis]).collect());
        }
        Columns { names, numbers, places: Places::Lines(self.lines) }.into_cloud(Gaps::Refused)
    }
}

/// The index that a word names: from 1 on, or back from the last of `n` entries.
fn index_of(word: &str, n: usize) -> Option<usize> {
    let number: i64 = word.parse().ok()?;
    let n = i64::try_from(n).ok()?;
    let index = if number < 0 { n.checked_add(number)? } else { number.checked_sub(1)? };
    usize::try_from(index).ok()
}
