//! Rays in an order in which neighbours point alike, so that they go as packets.
//!
//! Directions are mapped onto the octahedron, which unfolds into a square (Cigolle et al., "A
//! survey of efficient representations for independent unit vectors", JCGT 3(2) 2014), and the
//! cells of the square are visited along Morton's curve. What points alike keeps its order.

/// Cells of the square along each side, as a power of two.
const LEVELS: u32 = 6;

/// How many cells there are.
const CELLS: usize = 1 << (2 * LEVELS);

/// The number of the cell that a direction of any length points to; any cell if it is not finite.
#[inline(always)]
pub fn cell([x, y, z]: [f64; 3]) -> u16 {
    let [x, y, z] = [x as f32, y as f32, z as f32];
    let unit = 1.0 / (x.abs() + y.abs() + z.abs());
    let (u, v) = (x * unit, y * unit);
    let (far_u, far_v) = ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v));
    let below = z < 0.0;
    let u = column(if below { far_u } else { u });
    let v = column(if below { far_v } else { v });
    (spread(u) | spread(v) << 1) as u16
}

/// Which column of cells holds `x` in [-1, 1].
#[inline(always)]
fn column(x: f32) -> u32 {
    const COLUMNS: u32 = 1 << LEVELS;
    /// Its last bit counts ones, so that adding it rounds to integers.
    const ROUNDER: f32 = (1u32 << 23) as f32;
    let half = 0.5 * COLUMNS as f32;
    let place = x * half + (half - 0.5);
    (place.max(0.0).min((COLUMNS - 1) as f32) + ROUNDER).to_bits() & (COLUMNS - 1)
}

/// Moves bit `i` to `2 i`, of eight bits.
#[inline(always)]
fn spread(x: u32) -> u32 {
    let x = (x | x << 4) & 0x0f0f;
    let x = (x | x << 2) & 0x3333;
    (x | x << 1) & 0x5555
}

/// The memory to order things by their cells.
#[derive(Default)]
pub struct Order {
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Order {
    /// The numbers of `cells` in the order of the cells, equal ones in their own.
    pub fn of(&mut self, cells: &[u16]) -> &[u32] {
        self.starts.clear();
        self.starts.resize(CELLS + 1, 0);
        for &cell in cells {
            self.starts[usize::from(cell) + 1] += 1;
        }
        let mut start = 0;
        for count in &mut self.starts {
            start += *count;
            *count = start;
        }
        self.order.resize(cells.len(), 0);
        for (number, &cell) in cells.iter().enumerate() {
            let place = &mut self.starts[usize::from(cell)];
            self.order[*place as usize] = number as u32;
            *place += 1;
        }
        &self.order
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn everything_is_ordered_once(cells in prop::collection::vec(0..CELLS as u16, 0..200)) {
            let mut order = Order::default();
            let mut last = (0, 0);
            let mut seen = vec![false; cells.len()];
            for &number in order.of(&cells) {
                let next = (cells[number as usize], number);
                prop_assert!(last <= next && !std::mem::replace(&mut seen[number as usize], true));
                last = next;
            }
            prop_assert!(seen.into_iter().all(|seen| seen));
        }

        /// A cell is narrow: what shares it differs by less than a tenth.
        #[test]
        fn what_shares_a_cell_points_alike(a: [i16; 3], b: [i16; 3]) {
            let near: [f64; 3] = std::array::from_fn(|i| f64::from(a[i]) + f64::from(b[i]) * 0.03);
            let far = a.map(f64::from);
            let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            prop_assume!(length(near) > 0.0 && length(far) > 0.0 && cell(near) == cell(far));
            let apart = std::array::from_fn(|i| near[i] / length(near) - far[i] / length(far));
            prop_assert!(length(apart) < 0.1);
        }
    }

    #[test]
    fn any_direction_has_a_cell() {
        for x in [0.0, -0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
            for y in [0.0, -1.0, 1.0, f64::NEG_INFINITY] {
                assert!(usize::from(cell([x, y, -1.0])) < CELLS);
                assert!(usize::from(cell([x, y, 0.0])) < CELLS);
            }
        }
    }
}
