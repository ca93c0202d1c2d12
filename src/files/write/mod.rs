//! Files of answers. The service writes its own formats, and those of models are written as it does. What is
//! written here alone is rows of numbers, and files for viewers: CSV, npy, VTP and STL.

mod answer;
mod csv;
mod formats;
mod npy;
mod stl;
mod table;
mod vtp;

pub use answer::Answer;
pub use formats::{Content, FORMATS, Format, as_endings, endings};

use super::read::FileCloud;
use formats::Writer;
use table::Table;

impl Format {
    /// The bytes of a file with an answer about a cloud.
    ///
    /// # Errors
    /// Says why the format cannot hold it.
    pub fn write(&self, answer: Answer, cloud: &FileCloud) -> Result<Vec<u8>, String> {
        match self.writer {
            Writer::Service => Ok(answer.bytes.into()),
            Writer::Model(format) => answer.model(cloud)?.write(format),
            Writer::Csv => Ok(csv::write(&Table::of(&answer, cloud)?)),
            Writer::Npy => Ok(npy::write(&Table::of(&answer, cloud)?)),
            Writer::Vtp => Ok(vtp::write(&Table::of(&answer, cloud)?)),
            Writer::Stl => stl::write(&Table::of(&answer, cloud)?),
        }
    }
}
