//! NumPy arrays in, checked for dtype, shape and layout.
use std::ptr::NonNull;
use std::sync::Arc;

use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods, dtype};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::scene::{Buffer, SceneArrays};

/// Rows of N numbers in the layout of the array they come from.
///
/// # Safety
///
/// Implementors are `repr(transparent)` or arrays over LENGTHS.product() values of `Number`.
pub(super) unsafe trait Row: Copy + Send + Sync + 'static {
    type Number: Element;
    /// Sizes of the axes after the first.
    const AXES: &'static [usize];
}

macro_rules! rows {
    ($($row:ty: $number:ty, $axes:expr;)*) => {$(
        // SAFETY: the row is an array of as many numbers as the axes say.
        unsafe impl Row for $row {
            type Number = $number;
            const AXES: &'static [usize] = &$axes;
        }
    )*};
}

rows! {
    u8: u8, [];
    u32: u32, [];
    i32: i32, [];
    i64: i64, [];
    f32: f32, [];
    f64: f64, [];
    [i64; 2]: i64, [2];
    [i64; 4]: i64, [4];
    [i32; 3]: i32, [3];
    [f32; 3]: f32, [3];
    [f32; 4]: f32, [4];
    [u8; 4]: u8, [4];
    [f64; 3]: f64, [3];
    [[f64; 4]; 3]: f64, [3, 4];
}

/// A C-contiguous, aligned array of rows, held.
pub(super) struct Rows<'py, R: Row> {
    array: Bound<'py, PyArrayDyn<R::Number>>,
    len: usize,
}

impl<'py, R: Row> Rows<'py, R> {
    /// Checks an argument of that name.
    pub fn new(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Rows<'py, R>> {
        let wrong = || {
            let axes: Vec<_> = R::AXES.iter().map(usize::to_string).collect();
            PyValueError::new_err(format!(
                "{name} is not a C-contiguous {} array of shape (n{})",
                dtype::<R::Number>(value.py()),
                axes.iter()
                    .map(|axis| format!(", {axis}"))
                    .collect::<String>()
            ))
        };
        let array = value
            .downcast::<PyArrayDyn<R::Number>>()
            .map_err(|_| wrong())?;
        let shape = array.shape();
        let fits = !shape.is_empty() && shape[1..] == *R::AXES && array.is_c_contiguous();
        if !fits || !(array.data() as usize).is_multiple_of(align_of::<R>()) {
            return Err(wrong());
        }
        Ok(Rows {
            array: array.clone(),
            len: shape[0],
        })
    }

    /// The attribute of that name.
    pub fn of(owner: &Bound<'py, PyAny>, name: &str) -> PyResult<Rows<'py, R>> {
        Rows::new(name, &owner.getattr(name)?)
    }

    fn start(&self) -> NonNull<R> {
        NonNull::new(self.array.data().cast()).unwrap_or(NonNull::dangling())
    }

    /// The rows. Whoever calls `trace` does not write to its arguments meanwhile.
    pub fn rows(&self) -> &[R] {
        // SAFETY: `new` has checked that the memory is len rows; `array` keeps it alive.
        unsafe { std::slice::from_raw_parts(self.start().as_ptr(), self.len) }
    }

    /// The rows to keep: where they are if the array is read-only, else a copy; and the bytes of
    /// the copy.
    pub fn buffer(self) -> (Buffer<R>, usize) {
        // SAFETY: the array object is alive; flags is a plain field of it.
        let flags = unsafe { (*self.array.as_array_ptr()).flags };
        if flags & numpy::npyffi::NPY_ARRAY_WRITEABLE == 0 {
            let start = self.start();
            let owner = Arc::new(self.array.unbind());
            // SAFETY: `new` has checked the memory; NumPy lets nobody write to it through this
            // array, and the IR's contract is that nobody does otherwise.
            return (unsafe { Buffer::borrowed(start, self.len, owner) }, 0);
        }
        let copy = self.rows().to_vec();
        let bytes = size_of_val(copy.as_slice());
        (copy.into(), bytes)
    }
}

/// The arrays that tracing needs of a `SceneIR`, and how many bytes of them had to be copied.
pub(super) fn scene_arrays(ir: &Bound<'_, PyAny>) -> PyResult<(SceneArrays, usize)> {
    let mut copied = 0;
    let mut count = |bytes: usize| copied += bytes;
    macro_rules! keep {
        ($name:literal) => {{
            let (buffer, bytes) = Rows::of(ir, $name)?.buffer();
            count(bytes);
            buffer
        }};
    }
    let arrays = SceneArrays {
        prototype_kind: Rows::of(ir, "prototype_kind")?.rows().to_vec(),
        prototype_data: Rows::of(ir, "prototype_data")?.rows().to_vec(),
        shape_parameters: Rows::of(ir, "shape_parameters")?.rows().to_vec(),
        mesh_ranges: Rows::of(ir, "mesh_ranges")?.rows().to_vec(),
        mesh_points: keep!("mesh_points"),
        mesh_triangles: keep!("mesh_triangles"),
        group_ranges: Rows::of(ir, "group_ranges")?.rows().to_vec(),
        instance_target: keep!("instance_target"),
        world_from_object: keep!("world_from_object"),
        object_from_world: keep!("object_from_world"),
        translation_low: keep!("translation_low"),
        instance_material: keep!("instance_material"),
        material_count: ir.getattr("materials")?.len()?,
    };
    Ok((arrays, copied))
}
