//! A sky with a picture: radiance by direction, and directions drawn where it is bright.
//!
//! The picture is a latitude-longitude map as OpenEXR and UsdLux define it: with (x, y, z) a unit
//! vector in the dome's own space, the place from the left edge is s = 1/2 - atan2(x, z) / 2π and
//! that from the top edge t = acos(y) / π. The solid angle of ds dt is 2π² sin(π t) ds dt.
//!
//! For drawing the picture is cut into cells of texels. The probability of a cell is the integral
//! of the luminance over it; within a cell directions are uniform in s and cos(π t), which is
//! uniform in solid angle. Radiance is bilinear between the middles of texels: averaged over a
//! texel's square it is 1/8, 6/8, 1/8 of the texel before, this one and the next, in s and in t.
//! So the density is above zero wherever there is light, and no light is missed.
use super::direction::sin_cos_turns;
use super::texture::{Image, Wrap};
use super::vector::Vec3;
use std::f64::consts::{PI, TAU};

/// Cells of a dome: more would cost more memory than they spare samples.
const MOST_CELLS: usize = 1 << 21;

/// Around the dome the picture goes on at its other edge; beyond a pole there is none.
const WRAPS: [Wrap; 2] = [Wrap::Repeat, Wrap::Clamp];

/// Light from all around by a picture.
pub struct Dome {
    image: Image,
    /// What the picture is multiplied by.
    radiance: Vec3,
    /// The dome's own x, y and z, orthonormal.
    axes: [Vec3; 3],
    cells: Cells,
}

impl Dome {
    /// The dome of a picture; `axes` are its own in world space.
    pub fn new(image: Image, radiance: Vec3, axes: [Vec3; 3]) -> Dome {
        let cells = Cells::new(&image, radiance);
        Dome {
            image,
            radiance,
            axes,
            cells,
        }
    }

    /// What arrives from a direction of any length but zero.
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let [s, t] = self.place(direction.normalized());
        let [r, g, b, _] = self.image.sample([s, 1.0 - t], WRAPS);
        let texel = Vec3::new(r.into(), g.into(), b.into());
        positive(texel * self.radiance)
    }

    /// A unit vector, and its density per solid angle.
    #[inline]
    pub fn draw(&self, [u, v]: [f64; 2]) -> (Vec3, f64) {
        let ([s, cos], density) = self.cells.draw([u, v]);
        let turns = 0.5 - s;
        let (x, z) = sin_cos_turns(turns - turns.floor());
        let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
        let [right, up, front] = self.axes;
        (right * (x * sin) + up * cos + front * (z * sin), density)
    }

    /// The density with which [`Dome::draw`] gives a unit vector.
    #[inline]
    pub fn density(&self, direction: Vec3) -> f64 {
        self.cells.density(self.place(direction))
    }

    /// Where in the picture a unit vector points: parts of the way from its left and top edges.
    #[inline]
    fn place(&self, direction: Vec3) -> [f64; 2] {
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction));
        let turns = libm::atan2(x, z) * (1.0 / TAU);
        [0.5 - turns, libm::acos(y.clamp(-1.0, 1.0)) * (1.0 / PI)]
    }
}

fn positive(color: Vec3) -> Vec3 {
    Vec3::new(color.x.max(0.0), color.y.max(0.0), color.z.max(0.0))
}

/// A distribution over the cells of a picture.
struct Cells {
    columns: usize,
    rows: usize,
    /// cos(π t) at the upper edge of each row, and at the lower edge of the last.
    cosines: Vec<f64>,
    /// The probability of all rows above, of each row and beyond the last.
    above: Vec<f64>,
    /// Of each row: the probability within it of all cells to the left, `columns + 1` of them.
    left: Vec<f64>,
}

impl Cells {
    fn new(image: &Image, radiance: Vec3) -> Cells {
        let (width, height) = (image.width(), image.height());
        let block = (1..)
            .find(|block| width.div_ceil(*block) * height.div_ceil(*block) <= MOST_CELLS)
            .unwrap_or(1);
        // Where blocks do not fit, the edges of cells are between those of texels: each texel
        // counts for the cells that it touches, which keeps the density above zero.
        let (columns, rows) = (width.div_ceil(block), height.div_ceil(block));
        let cosine = |row: usize| libm::cos(PI * row as f64 / rows as f64);
        let cosines: Vec<f64> = (0..=rows).map(cosine).collect();
        let luminance = Luminance { image, radiance };
        let mut left = Vec::with_capacity(rows * (columns + 1));
        let mut above = vec![0.0];
        let mut of_cells = vec![0.0; columns];
        let mut lines = Lines::new(&luminance);
        let mut total = 0.0;
        for row in 0..rows {
            of_cells.fill(0.0);
            for y in texels(row, rows, height) {
                let line = lines.averaged(y);
                for (column, cell) in of_cells.iter_mut().enumerate() {
                    *cell += texels(column, columns, width).map(|x| line[x]).sum::<f64>();
                }
            }
            let sum = accumulate(&of_cells, &mut left);
            total += sum * (cosines[row] - cosines[row + 1]);
            above.push(total);
        }
        if total > 0.0 && total.is_finite() {
            above.iter_mut().for_each(|sum| *sum /= total);
        } else {
            // Black, or beyond numbers: the same from everywhere.
            above.clear();
            above.extend(cosines.iter().map(|cos| 0.5 - 0.5 * cos));
        }
        Cells {
            columns,
            rows,
            cosines,
            above,
            left,
        }
    }

    /// s and cos(π t) of a place, and the density there.
    #[inline]
    fn draw(&self, [u, v]: [f64; 2]) -> ([f64; 2], f64) {
        let (row, down) = pick(&self.above, u);
        let line = self.line(row);
        let (column, across) = pick(line, v);
        let s = (column as f64 + across) / self.columns as f64;
        let cos = self.cosines[row] + (self.cosines[row + 1] - self.cosines[row]) * down;
        ([s, cos], self.density_of(row, column))
    }

    #[inline]
    fn density(&self, [s, t]: [f64; 2]) -> f64 {
        // Conversion saturates: what rounding puts beyond an edge belongs to the cell there.
        let row = ((t * self.rows as f64) as usize).min(self.rows - 1);
        let column = ((s * self.columns as f64) as usize).min(self.columns - 1);
        self.density_of(row, column)
    }

    #[inline]
    fn line(&self, row: usize) -> &[f64] {
        &self.left[row * (self.columns + 1)..][..=self.columns]
    }

    #[inline]
    fn density_of(&self, row: usize, column: usize) -> f64 {
        let line = self.line(row);
        let probability =
            (self.above[row + 1] - self.above[row]) * (line[column + 1] - line[column]);
        let solid_angle = (self.cosines[row] - self.cosines[row + 1]) * (TAU / self.columns as f64);
        probability / solid_angle
    }
}

/// The texels, of `count`, that a cell touches in one direction.
fn texels(cell: usize, cells: usize, count: usize) -> std::ops::Range<usize> {
    cell * count / cells..((cell + 1) * count).div_ceil(cells)
}

/// Appends the parts of a row's sum to the left of each cell, from 0 to 1; its sum.
fn accumulate(of_cells: &[f64], left: &mut Vec<f64>) -> f64 {
    let sum: f64 = of_cells.iter().sum();
    let (mut so_far, scale) = (0.0, 1.0 / sum);
    left.push(0.0);
    for (column, cell) in of_cells.iter().enumerate() {
        so_far += cell;
        let even = (column + 1) as f64 / of_cells.len() as f64;
        left.push(if scale.is_finite() {
            so_far * scale
        } else {
            even
        });
    }
    sum
}

/// The interval of ascending `edges` that `u` in [0, 1) falls into, and where in it.
#[inline]
fn pick(edges: &[f64], u: f64) -> (usize, f64) {
    let end = edges.partition_point(|&edge| edge <= u);
    let interval = end.clamp(1, edges.len() - 1) - 1;
    let (from, to) = (edges[interval], edges[interval + 1]);
    let inside = if to > from {
        (u - from) / (to - from)
    } else {
        0.5
    };
    (interval, inside.clamp(0.0, 1.0))
}

/// The luminance of a dome's texels.
struct Luminance<'a> {
    image: &'a Image,
    radiance: Vec3,
}

impl Luminance<'_> {
    /// That of a row of texels, averaged over their squares in s.
    fn line(&self, y: usize) -> Vec<f64> {
        let of_texel = |x: usize| {
            let [r, g, b, _] = self.image.at(x, y);
            positive(Vec3::new(r.into(), g.into(), b.into()) * self.radiance).luminance()
        };
        let texels: Vec<f64> = (0..self.image.width()).map(of_texel).collect();
        let count = texels.len();
        (0..count)
            .map(|x| {
                let (before, after) = (texels[(x + count - 1) % count], texels[(x + 1) % count]);
                0.125 * (before + after) + 0.75 * texels[x]
            })
            .collect()
    }
}

/// The last three rows of texels that were asked for, which are asked for in order.
struct Lines<'a> {
    of: &'a Luminance<'a>,
    kept: [(usize, Vec<f64>); 3],
}

impl<'a> Lines<'a> {
    fn new(of: &'a Luminance<'a>) -> Lines<'a> {
        let kept = [(); 3].map(|()| (usize::MAX, Vec::new()));
        Lines { of, kept }
    }

    /// The averages over the squares of row `y`.
    fn averaged(&mut self, y: usize) -> Vec<f64> {
        let last = self.of.image.height() - 1;
        let mut sum = vec![0.0; self.of.image.width()];
        let around = [
            (y.saturating_sub(1), 0.125),
            (y, 0.75),
            ((y + 1).min(last), 0.125),
        ];
        for (row, weight) in around {
            let kept = &mut self.kept[row % 3];
            if kept.0 != row {
                *kept = (row, self.of.line(row));
            }
            for (sum, value) in sum.iter_mut().zip(&kept.1) {
                *sum += weight * value;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::sampler::PixelKey;
    use super::super::texture::Texels;
    use super::*;
    use proptest::prelude::*;

    const OWN: [Vec3; 3] = [
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::new(0.0, 0.0, 1.0),
    ];

    fn dome(width: usize, height: usize, values: Vec<f32>) -> Dome {
        let image = Image::new(width, height, 1, Texels::Floats(values.into())).unwrap();
        Dome::new(image, Vec3::ONE, OWN)
    }

    /// Mean and greatest of radiance over density, by 2¹⁴ samples.
    fn total(dome: &Dome) -> (f64, f64) {
        let key = PixelKey::new(0, 0, 1);
        let count = 1 << 14;
        let (mut sum, mut greatest) = (0.0, 0f64);
        for i in 0..count {
            let (direction, density) = dome.draw(key.point(i, 0));
            let weight = dome.radiance(direction).x / density;
            sum += weight;
            greatest = greatest.max(weight);
        }
        (sum / f64::from(count), greatest)
    }

    #[test]
    fn a_constant_picture_is_drawn_uniformly() {
        let (mean, greatest) = total(&dome(7, 5, vec![2.0; 35]));
        assert!((mean - 8.0 * PI).abs() < 1e-9 && (greatest - 8.0 * PI).abs() < 1e-9);
    }

    #[test]
    fn one_bright_texel_is_where_openexr_has_it() {
        // The middle of the left half at the equator is +x, that of the picture +z.
        for (column, towards) in [(2, OWN[0]), (4, OWN[2]), (6, -OWN[0]), (0, -OWN[2])] {
            let mut values = vec![0.0; 8 * 3];
            // Two texels wide, so that its middle is an edge of texels.
            values[8 + column] = 1.0;
            values[8 + (column + 7) % 8] = 1.0;
            let dome = dome(8, 3, values);
            assert!(dome.radiance(towards * 3.0).x > 0.999);
            assert!(dome.radiance(-towards).x < 1e-9);
        }
        let mut values = vec![0.0; 8 * 4];
        values[..8].fill(1.0);
        let above = dome(8, 4, values);
        assert!(above.radiance(OWN[1]).x > 0.999 && above.radiance(-OWN[1]).x < 1e-9);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// What is drawn has the density that is said, and adds up to the integral.
        #[test]
        fn densities_are_those_of_what_is_drawn(
            size in (1usize..9, 1usize..9), seed: u64, u in 0.0..1.0f64, v in 0.0..1.0f64,
        ) {
            let mut x = seed;
            let values: Vec<f32> = (0..size.0 * size.1).map(|_| {
                x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                // A third black, the others over four decades.
                let part = (x >> 40) as f32 / (1u64 << 24) as f32;
                if part < 0.33 { 0.0 } else { 10f32.powf(6.0 * part - 4.0) }
            }).collect();
            let dome = dome(size.0, size.1, values);
            let (direction, density) = dome.draw([u, v]);
            prop_assert!((direction.dot(direction) - 1.0).abs() < 1e-7);
            // Next to an edge of cells rounding may choose the neighbour.
            let [s, t] = dome.place(direction);
            let edge = |place: f64, count: usize| {
                let x = place * count as f64;
                (x - x.round()).abs() < 1e-6
            };
            if !edge(s, size.0) && !edge(t, size.1) {
                prop_assert!((dome.density(direction) / density - 1.0).abs() < 1e-9);
            }
            // Midpoints of a fine grid.
            let (columns, rows) = (32 * size.0, 32 * size.1);
            let (mut light, mut one) = (0.0, 0.0);
            for row in 0..rows {
                let t = (row as f64 + 0.5) / rows as f64;
                let (sin, cos) = libm::sincos(PI * t);
                let part = 2.0 * PI * PI * sin / (columns * rows) as f64;
                for column in 0..columns {
                    let (x, z) = libm::sincos(TAU * (0.5 - (column as f64 + 0.5) / columns as f64));
                    let direction = Vec3::new(x * sin, cos, z * sin);
                    light += dome.radiance(direction).x * part;
                    one += dome.density(direction) * part;
                }
            }
            prop_assert!((one - 1.0).abs() < 5e-3, "{one}");
            let (mean, _) = total(&dome);
            prop_assert!((mean - light).abs() <= 0.02 * light, "{mean} {light}");
        }
    }

    #[test]
    fn cells_of_many_texels_miss_no_light() {
        // Wider than cells are allowed, with one bright texel.
        let (width, height) = (1 << 12, 1 << 11);
        let mut values = vec![0.0; width * height];
        values[700 * width + 1234] = 1.0;
        let dome = dome(width, height, values);
        assert!(dome.cells.columns * dome.cells.rows <= MOST_CELLS);
        let s = 1234.5 / width as f64;
        let (sin, cos) = libm::sincos(PI * 700.5 / height as f64);
        let (x, z) = libm::sincos(TAU * (0.5 - s));
        let middle = Vec3::new(x * sin, cos, z * sin);
        assert!(dome.radiance(middle).x > 0.99 && dome.density(middle) > 1e4);
        let expected = 2.0 * PI * PI * sin / (width * height) as f64;
        let (mean, _) = total(&dome);
        assert!((mean / expected - 1.0).abs() < 0.05, "{mean} {expected}");
    }
}
