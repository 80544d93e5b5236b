//! What trees are built over: boxes by vectors of four, so that plain Rust compiles to vector code.
use super::NormalBounds;

/// A vector of three, in four lanes: the compiler makes single instructions of what follows.
pub type Vector = [f32; 4];

#[inline(always)]
fn least(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
}

#[inline(always)]
fn greatest(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
}

/// A box; the fourth lanes mean nothing.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Cuboid {
    pub lower: Vector,
    pub upper: Vector,
}

impl Cuboid {
    /// Holds nothing.
    pub const EMPTY: Cuboid = Cuboid {
        lower: [f32::INFINITY; 4],
        upper: [f32::NEG_INFINITY; 4],
    };

    /// Grows around another box.
    #[inline(always)]
    pub fn add(&mut self, other: &Cuboid) {
        self.lower = least(&self.lower, &other.lower);
        self.upper = greatest(&self.upper, &other.upper);
    }

    /// Grows around a point.
    #[inline(always)]
    pub fn add_point(&mut self, p: &Vector) {
        self.lower = least(&self.lower, p);
        self.upper = greatest(&self.upper, p);
    }

    /// Half of the surface.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        self.bounds().half_area()
    }

    /// Without the fourth lanes.
    #[inline(always)]
    pub fn bounds(&self) -> NormalBounds {
        let Cuboid { lower, upper } = self;
        NormalBounds {
            lower: [lower[0], lower[1], lower[2]],
            upper: [upper[0], upper[1], upper[2]],
        }
    }
}

/// An item to be built over: its box, with its number in the fourth lane.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Item(pub Cuboid);

impl Item {
    /// Makes a normal f32 of a number below 2²⁸, since others are slow to compute with.
    const TAG: u32 = 1 << 30;

    /// Of a number below 2²⁸.
    pub fn new(bounds: &NormalBounds, index: u32) -> Item {
        let ([a, b, c], [x, y, z]) = (bounds.lower, bounds.upper);
        Item(Cuboid {
            lower: [a, b, c, 0.0],
            upper: [x, y, z, f32::from_bits(index | Item::TAG)],
        })
    }

    /// Its number.
    pub fn index(&self) -> u32 {
        self.0.upper[3].to_bits() & !Item::TAG
    }

    /// Twice the centre.
    #[inline(always)]
    pub fn center(&self) -> Vector {
        std::array::from_fn(|i| self.0.lower[i] + self.0.upper[i])
    }
}
