//! The IR's attributes of meshes and textures of materials, and the images that these name.
use std::collections::HashMap;
use std::ops::Range;

use numpy::{PyArrayDyn, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::Rows;
use super::render::Table;
use crate::render::attributes::{Attribute, Attributes, NORMALS, Name};
use crate::render::detail::{Channels, Detail, Parameter, Source, Texture, Textured};
use crate::render::material::Parameters;
use crate::render::texture::{Image, Texels, Wrap};

/// Numbers of the names of attributes.
struct Names<'a, 'py> {
    ir: &'a Bound<'py, PyAny>,
    numbers: HashMap<String, Name>,
}

impl Names<'_, '_> {
    fn number(&mut self, text: i32) -> PyResult<Name> {
        let name: String = self.ir.call_method1("text", (text,))?.extract()?;
        let next = self.numbers.len() as Name;
        Ok(*self.numbers.entry(name).or_insert(next))
    }
}

/// What varies over the surfaces of an IR; None where nothing does. `images` are as
/// `runtime._kernel.Kernel` has them. With it, the bytes that had to be copied.
pub fn detail(
    ir: &Bound<'_, PyAny>,
    images: &Bound<'_, PyAny>,
    materials: &[Parameters],
) -> PyResult<(Option<Detail>, usize)> {
    let (of_meshes, of_materials) = (ir.getattr("mesh_attributes")?, ir.getattr("textures")?);
    if of_meshes.len()? == 0 && of_materials.len()? == 0 {
        return Ok((None, 0));
    }
    let mut copied = 0;
    let mut names = Names {
        ir,
        numbers: HashMap::from([("normals".into(), NORMALS)]),
    };
    let attributes = attributes(ir, &Table(&of_meshes), &mut names, &mut copied)?;
    let textured = textured(&of_materials, images, materials, &mut names, &mut copied)?;
    Ok((Some(Detail::new(attributes, textured)), copied))
}

fn attributes(
    ir: &Bound<'_, PyAny>,
    table: &Table,
    names: &mut Names,
    copied: &mut usize,
) -> PyResult<Attributes> {
    let columns = ["mesh", "name", "width"].map(|name| table.integers(name));
    let [meshes, texts, widths] = columns;
    let (meshes, texts, widths) = (meshes?, texts?, widths?);
    let (values, corners) = (table.wholes("first_value")?, table.wholes("first_corner")?);
    // Stretches by mesh, whatever the order in the table.
    let mut order: Vec<usize> = (0..meshes.len()).collect();
    order.sort_by_key(|&row| meshes[row]);
    let mut attributes = Vec::with_capacity(order.len());
    let mut stretches: HashMap<i64, Range<usize>> = HashMap::new();
    for row in order {
        let number = attributes.len();
        let stretch = stretches
            .entry(i64::from(meshes[row]))
            .or_insert(number..number);
        stretch.end = number + 1;
        attributes.push(Attribute {
            name: names.number(texts[row])?,
            width: usize::try_from(widths[row])?,
            first_value: usize::try_from(values[row])?,
            first_corner: usize::try_from(corners[row]).ok(),
        });
    }
    let kinds = Rows::<u8>::of(ir, "prototype_kind")?;
    let data = Rows::<i64>::of(ir, "prototype_data")?;
    let mesh = crate::shapes::ShapeKind::ALL.len();
    let prototypes = kinds.rows().iter().zip(data.rows());
    let prototypes = prototypes.map(|(&kind, data)| {
        let own = stretches.get(data).filter(|_| usize::from(kind) == mesh);
        own.cloned().unwrap_or_default()
    });
    let prototypes = prototypes.collect();
    let (values, bytes) = Rows::<f32>::of(ir, "attribute_values")?.buffer();
    let (corners, more) = Rows::<i32>::of(ir, "attribute_corners")?.buffer();
    *copied += bytes + more;
    Ok(Attributes::new(values, corners, attributes, prototypes))
}

fn textured(
    table: &Bound<'_, PyAny>,
    images: &Bound<'_, PyAny>,
    materials: &[Parameters],
    names: &mut Names,
    copied: &mut usize,
) -> PyResult<Vec<Option<Textured>>> {
    let texts = Table(table).integers("file")?;
    let count = texts.len();
    let table = Table(table);
    let integers = |name: &str| table.integers(name);
    let (owners, parameters) = (integers("material")?, integers("parameter")?);
    let (attributes, channels) = (integers("attribute")?, integers("channels")?);
    let (wrap_s, wrap_t) = (integers("wrap_s")?, integers("wrap_t")?);
    let spaces = integers("color_space")?;
    let rows = |name: &str| -> PyResult<Vec<f64>> {
        let column: PyReadonlyArray2<f64> = table.0.get_item(name)?.extract()?;
        Ok(column.as_array().iter().copied().collect())
    };
    let (scale, bias, fallback) = (rows("scale")?, rows("bias")?, rows("fallback")?);
    let matrix = rows("matrix")?;
    let four = |column: &[f64], row: usize| std::array::from_fn(|i| column[4 * row + i]);
    let given = images.len()?;
    let mut textured: Vec<Option<Textured>> = materials.iter().map(|_| None).collect();
    for row in 0..count {
        let wrong = |what: &str| PyValueError::new_err(format!("texture {row} has no such {what}"));
        // What is beyond the list is not for shading: displacement, occlusion.
        let parameter = usize::try_from(parameters[row])?;
        let Some(&parameter) = Parameter::ALL.get(parameter) else {
            continue;
        };
        let material = usize::try_from(owners[row])?;
        let own = textured
            .get_mut(material)
            .ok_or_else(|| wrong("material"))?;
        let file: String = names.ir.call_method1("text", (texts[row],))?.extract()?;
        let source = if file.is_empty() {
            Source::Attribute
        } else if row < given {
            source(&images.get_item(row)?, spaces[row], copied)?
        } else {
            Source::Missing
        };
        let texture = Texture {
            parameter,
            source,
            attribute: names.number(attributes[row])?,
            channels: match channels[row] {
                channel @ 0..=3 => Channels::One(channel as usize),
                _ => Channels::Rgb,
            },
            wrap: [wrap_s[row], wrap_t[row]].map(|wrap| match wrap {
                1 => Wrap::Clamp,
                2 => Wrap::Repeat,
                3 => Wrap::Mirror,
                // The metadata of pictures hardly ever say; then it is black.
                _ => Wrap::Black,
            }),
            scale: four(&scale, row),
            bias: four(&bias, row),
            fallback: four(&fallback, row),
            matrix: [0, 3].map(|i| std::array::from_fn(|j| matrix[6 * row + i + j])),
        };
        own.get_or_insert_with(|| Textured {
            parameters: materials[material],
            textures: Vec::new(),
        })
        .textures
        .push(texture);
    }
    Ok(textured)
}

/// An array, a dict of arrays by tile, or None.
fn source(given: &Bound<'_, PyAny>, space: i32, copied: &mut usize) -> PyResult<Source> {
    if given.is_none() {
        return Ok(Source::Missing);
    }
    if let Ok(tiles) = given.downcast::<PyDict>() {
        let tiles = tiles.iter().map(|(tile, given)| {
            let tile: [i64; 2] = tile.extract()?;
            Ok((tile, image(&given, space, copied)?))
        });
        return Ok(Source::Tiles(tiles.collect::<PyResult<_>>()?));
    }
    Ok(Source::Image(image(given, space, copied)?))
}

/// The image of an array; `space` is its index in `compiler.ir.COLOR_SPACES`. The bytes that had to
/// be copied are added to `copied`.
pub fn image(given: &Bound<'_, PyAny>, space: i32, copied: &mut usize) -> PyResult<Image> {
    let wrong = || PyValueError::new_err("an image is (h, w, c), uint8 or float32, c from 1 to 4");
    let shape: Vec<usize> = given.getattr("shape")?.extract().map_err(|_| wrong())?;
    let [height, width, channels] = shape[..] else {
        return Err(wrong());
    };
    // A view: C-contiguous, and read-only if the array is.
    let flat = given.call_method1("reshape", (-1,))?;
    let texels = if given.downcast::<PyArrayDyn<u8>>().is_ok() {
        let (values, bytes) = Rows::<u8>::new("image", &flat)?.buffer();
        *copied += bytes;
        // "auto" takes bytes for sRGB if they are colours.
        let srgb = space == 2 || (space == 0 && channels >= 3);
        Texels::Bytes { values, srgb }
    } else {
        let (values, bytes) = Rows::<f32>::new("image", &flat)?.buffer();
        *copied += bytes;
        Texels::Floats(values)
    };
    Image::new(width, height, channels, texels).ok_or_else(wrong)
}
