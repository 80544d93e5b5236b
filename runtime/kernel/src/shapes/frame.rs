//! The space a shape is traced in.

/// Maps object space to shape space: p ↦ (p − center)·scale.
///
/// Shape space holds the shape within coordinates of magnitude 2, so that squares neither over- nor
/// underflow, and near the origin, so that rounding to f32 costs ulps of its size and not of its
/// distance. `scale` is a power of two. `center` is zero unless the shape lies more than two sizes
/// off, and has so few digits that subtracting it from a coordinate of the shape is exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// What object space is moved by, before it is scaled.
    pub center: [f64; 3],
    /// Shape units per object unit.
    pub scale: f64,
}

impl Frame {
    /// Object space itself.
    pub const IDENTITY: Frame = Frame {
        center: [0.0; 3],
        scale: 1.0,
    };

    /// For a shape with these bounds; `None` if its size is zero, not finite, or not within 1e±140.
    pub(super) fn new([low, high]: [[f64; 3]; 2]) -> Option<Frame> {
        let extent = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        if !(1e-140..=1e140).contains(&extent) {
            return None;
        }
        let grid = libm::scalbn(1.0, libm::ilogb(extent) - 2);
        let center = [0, 1, 2].map(|i| {
            let middle = 0.5 * low[i] + 0.5 * high[i];
            if middle.abs() <= 2.0 * extent {
                0.0
            } else {
                (middle / grid).round() * grid
            }
        });
        let reach = (0..3)
            .flat_map(|i| [low[i] - center[i], high[i] - center[i]])
            .fold(0.0, |reach: f64, x| reach.max(x.abs()));
        let scale = libm::scalbn(1.0, -libm::ilogb(reach));
        Some(Frame { center, scale })
    }

    /// A point of object space, in shape space.
    #[inline(always)]
    pub fn shape_from_object(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| (p[i] - self.center[i]) * self.scale)
    }

    /// A point of shape space, in object space.
    #[inline(always)]
    pub fn object_from_shape(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| p[i] / self.scale + self.center[i])
    }
}
