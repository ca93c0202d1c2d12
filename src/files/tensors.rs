//! Clouds of files as safetensors, the form in which they are registered.

use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

use super::read::FileCloud;

pub const MEDIA_TYPE: &str = "application/x-safetensors";

/// The points and normals of a cloud as the body that registers it.
///
/// # Errors
/// Says what the library of the format refuses.
pub fn of(cloud: &FileCloud) -> Result<Vec<u8>, String> {
    let shape = vec![cloud.n_points(), cloud.dimension];
    let view = |numbers| {
        let bytes = bytemuck::cast_slice::<f64, u8>(numbers);
        TensorView::new(Dtype::F64, shape.clone(), bytes).map_err(|error| error.to_string())
    };
    let mut tensors = vec![("points", view(&cloud.points)?)];
    if let Some(normals) = &cloud.normals {
        tensors.push(("normals", view(normals)?));
    }
    serialize(tensors, None).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use safetensors::SafeTensors;

    use super::super::read::read;
    use super::of;

    #[test]
    fn a_table_becomes_a_file_of_tensors() {
        let file = of(&read("scan.csv", b"x;y;nx;ny\n1,5;2;0;1\n3;4;1;0\n").unwrap()).unwrap();
        let found = SafeTensors::deserialize(&file).unwrap();
        for (name, expected) in [("points", [1.5, 2.0, 3.0, 4.0]), ("normals", [0.0, 1.0, 1.0, 0.0])] {
            let tensor = found.tensor(name).unwrap();
            let numbers = tensor.data().chunks_exact(8);
            let numbers = numbers.map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()));
            assert_eq!((tensor.shape(), numbers.collect::<Vec<_>>()), (&[2, 2][..], expected.to_vec()));
        }
    }
}
