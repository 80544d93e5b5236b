//! The kinds of analytic shape, as `dsl/scene.py` names and numbers them.

/// One kind of analytic shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ShapeKind {
    /// radius
    Sphere,
    /// x0, y0, z0, x1, y1, z1, bevel
    Box,
    /// radius, y0, y1, bevel
    Cylinder,
    /// radius, height, bevel
    Cone,
    /// major, minor
    Torus,
    /// radius
    Disc,
    /// size_x, size_z
    Rectangle,
    /// (no parameters)
    Plane,
    /// ax, ay, az, bx, by, bz, cx, cy, cz
    Triangle,
    /// r0, r1, y0, y1, bevel
    Ring,
    /// r0, r1, y0, y1, phi0, phi1, bevel; angles in degrees
    Wedge,
}

impl ShapeKind {
    /// All kinds, in the order of `dsl.scene.ShapeKind`.
    pub const ALL: [ShapeKind; 11] = [
        Self::Sphere,
        Self::Box,
        Self::Cylinder,
        Self::Cone,
        Self::Torus,
        Self::Disc,
        Self::Rectangle,
        Self::Plane,
        Self::Triangle,
        Self::Ring,
        Self::Wedge,
    ];

    /// The kind of that number in `compiler.ir.KINDS`.
    pub fn from_index(index: u8) -> Option<ShapeKind> {
        Self::ALL.get(usize::from(index)).copied()
    }

    /// How many parameters it has.
    pub fn parameter_count(self) -> usize {
        match self {
            Self::Plane => 0,
            Self::Sphere | Self::Disc => 1,
            Self::Torus | Self::Rectangle => 2,
            Self::Cone => 3,
            Self::Cylinder => 4,
            Self::Ring => 5,
            Self::Box | Self::Wedge => 7,
            Self::Triangle => 9,
        }
    }
}
