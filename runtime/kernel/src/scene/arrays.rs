//! The flat scene as it comes in: the kernel's view of `compiler/ir.py`'s `SceneIR`.
use std::any::Any;
use std::ops::Deref;
use std::ptr::NonNull;
use std::sync::Arc;

/// Numbers that nobody changes any more, owned or kept alive by their owner.
#[derive(Clone)]
pub struct Buffer<T> {
    start: NonNull<T>,
    len: usize,
    _owner: Arc<dyn Any + Send + Sync>,
}

// SAFETY: a buffer only ever gives out shared references, and its owner may move between threads.
unsafe impl<T: Sync> Send for Buffer<T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Buffer<T> {}

impl<T> Buffer<T> {
    /// A view of memory that `owner` keeps alive.
    ///
    /// # Safety
    ///
    /// `len` values of T lie at `start`, initialised and aligned, and stay there unchanged until
    /// `owner` is dropped.
    pub unsafe fn borrowed(
        start: NonNull<T>,
        len: usize,
        owner: Arc<dyn Any + Send + Sync>,
    ) -> Self {
        Buffer {
            start,
            len,
            _owner: owner,
        }
    }
}

impl<T: Send + Sync + 'static> From<Vec<T>> for Buffer<T> {
    fn from(values: Vec<T>) -> Buffer<T> {
        let len = values.len();
        let owner = Arc::new(values);
        Buffer {
            start: NonNull::from(owner.as_slice()).cast(),
            len,
            _owner: owner,
        }
    }
}

impl<T> Deref for Buffer<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: `borrowed` was promised this, and a Vec inside an Arc does not move.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

/// A 3×4 matrix by rows; the fourth column is the translation.
pub type Affine = [[f64; 4]; 3];

/// The arrays of a `SceneIR` that tracing needs; see `compiler/ir.py` for each.
#[derive(Clone)]
#[allow(missing_docs)]
pub struct SceneArrays {
    pub prototype_kind: Vec<u8>,
    pub prototype_data: Vec<i64>,
    pub shape_parameters: Vec<f64>,
    pub mesh_ranges: Vec<[i64; 4]>,
    pub mesh_points: Buffer<[f64; 3]>,
    pub mesh_triangles: Buffer<[i32; 3]>,
    pub group_ranges: Vec<[i64; 2]>,
    pub instance_target: Buffer<i32>,
    pub world_from_object: Buffer<Affine>,
    pub object_from_world: Buffer<Affine>,
    /// Of length n, or 0 where all of them are zero.
    pub translation_low: Buffer<[f32; 3]>,
    pub instance_material: Buffer<i32>,
    /// How many materials there are.
    pub material_count: usize,
}

impl Default for SceneArrays {
    /// The empty scene: a root group of nothing.
    fn default() -> SceneArrays {
        SceneArrays {
            prototype_kind: Vec::new(),
            prototype_data: Vec::new(),
            shape_parameters: Vec::new(),
            mesh_ranges: Vec::new(),
            mesh_points: Vec::new().into(),
            mesh_triangles: Vec::new().into(),
            group_ranges: vec![[0, 0]],
            instance_target: Vec::new().into(),
            world_from_object: Vec::new().into(),
            object_from_world: Vec::new().into(),
            translation_low: Vec::new().into(),
            instance_material: Vec::new().into(),
            material_count: 1,
        }
    }
}
