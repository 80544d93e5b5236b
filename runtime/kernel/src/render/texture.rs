//! Pictures on surfaces: texels by coordinates.
//!
//! As UsdUVTexture has it: coordinates have their origin at the lower left of the picture, texels
//! are points in the middle of their squares, and values between them are bilinear.
use crate::scene::Buffer;
use std::sync::OnceLock;

/// Red, green, blue and alpha.
pub type Rgba = [f32; 4];

/// What is beyond the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Nothing: all channels are 0.
    Black,
    /// The texels of the border.
    Clamp,
    /// The picture again.
    Repeat,
    /// The picture again, every other time mirrored.
    Mirror,
}

/// The numbers of an image.
pub enum Texels {
    /// 0 … 255 stand for 0 … 1. With `srgb`, red, green and blue are encoded so.
    Bytes {
        /// Row by row, channel by channel.
        values: Buffer<u8>,
        /// Whether colours have to be decoded.
        srgb: bool,
    },
    /// Linear numbers, row by row, channel by channel.
    Floats(Buffer<f32>),
}

/// Rows of texels from the top: of one channel (grey), two (grey, alpha), three or four.
pub struct Image {
    width: usize,
    height: usize,
    channels: usize,
    texels: Texels,
}

impl Image {
    /// An image of at least one texel; None if the numbers are not that.
    pub fn new(width: usize, height: usize, channels: usize, texels: Texels) -> Option<Image> {
        let len = match &texels {
            Texels::Bytes { values, .. } => values.len(),
            Texels::Floats(values) => values.len(),
        };
        let fits = (1..=4).contains(&channels)
            && len > 0
            && width.checked_mul(height)?.checked_mul(channels)? == len;
        fits.then_some(Image {
            width,
            height,
            channels,
            texels,
        })
    }

    /// The value at coordinates (u, v).
    pub fn sample(&self, [u, v]: [f64; 2], wrap: [Wrap; 2]) -> Rgba {
        let (x, across) = between(u, self.width, wrap[0]);
        let (y, down) = between(1.0 - v, self.height, wrap[1]);
        let row = |y: Option<usize>| mix(self.texel(x[0], y), self.texel(x[1], y), across);
        mix(row(y[0]), row(y[1]), down)
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The texel in a column and row, from the upper left.
    pub fn at(&self, x: usize, y: usize) -> Rgba {
        self.texel(Some(x), Some(y))
    }

    fn texel(&self, x: Option<usize>, y: Option<usize>) -> Rgba {
        let (Some(x), Some(y)) = (x, y) else {
            return [0.0; 4];
        };
        let start = (y * self.width + x) * self.channels;
        let range = start..start + self.channels;
        match &self.texels {
            Texels::Floats(values) => spread(&values[range], |&x| x, |&x| x),
            Texels::Bytes { values, srgb: true } => {
                spread(&values[range], |&x| decoded()[usize::from(x)], fraction)
            }
            Texels::Bytes { values, .. } => spread(&values[range], fraction, fraction),
        }
    }
}

fn fraction(byte: &u8) -> f32 {
    f32::from(*byte) / 255.0
}

/// The four channels of a texel that has one to four.
#[inline(always)]
fn spread<T>(channels: &[T], color: impl Fn(&T) -> f32, alpha: impl Fn(&T) -> f32) -> Rgba {
    match channels {
        [grey] => [color(grey), color(grey), color(grey), 1.0],
        [grey, a] => [color(grey), color(grey), color(grey), alpha(a)],
        [r, g, b] => [color(r), color(g), color(b), 1.0],
        [r, g, b, a, ..] => [color(r), color(g), color(b), alpha(a)],
        [] => [0.0; 4],
    }
}

/// What bytes mean in sRGB (IEC 61966-2-1).
fn decoded() -> &'static [f32; 256] {
    static DECODED: OnceLock<[f32; 256]> = OnceLock::new();
    DECODED.get_or_init(|| {
        std::array::from_fn(|byte| {
            let x = byte as f64 / 255.0;
            let linear = if x <= 0.04045 {
                x / 12.92
            } else {
                libm::pow((x + 0.055) / 1.055, 2.4)
            };
            linear as f32
        })
    })
}

/// The two texels of `count` that a coordinate lies between, and the part of the second.
fn between(u: f64, count: usize, wrap: Wrap) -> ([Option<usize>; 2], f32) {
    let inside = match wrap {
        Wrap::Black => u,
        Wrap::Clamp => u.clamp(0.0, 1.0),
        Wrap::Repeat => u - u.floor(),
        Wrap::Mirror => {
            let twice = u - 2.0 * (0.5 * u).floor();
            twice.min(2.0 - twice)
        }
    };
    if !inside.is_finite() {
        return ([None; 2], 0.0);
    }
    let place = inside * count as f64 - 0.5;
    let first = place.floor();
    let texel = |x: f64| {
        // Coordinates inside the square are at most one texel outside of the picture.
        let last = count as f64 - 1.0;
        match wrap {
            Wrap::Black => (x >= 0.0 && x <= last).then_some(x as usize),
            Wrap::Repeat if x < 0.0 => Some(count - 1),
            Wrap::Repeat if x > last => Some(0),
            _ => Some(x.max(0.0).min(last) as usize),
        }
    };
    ([texel(first), texel(first + 1.0)], (place - first) as f32)
}

#[inline(always)]
fn mix(a: Rgba, b: Rgba, t: f32) -> Rgba {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ramp(width: usize, height: usize) -> Image {
        let values: Vec<f32> = (0..width * height).map(|i| i as f32).collect();
        Image::new(width, height, 1, Texels::Floats(values.into())).unwrap()
    }

    /// The picture's own texels, continued by the rule of a wrap to all whole numbers.
    fn continued(image: &Image, x: i64, y: i64, wrap: Wrap) -> f32 {
        let inside = |i: i64, count: usize| {
            let count = count as i64;
            match wrap {
                Wrap::Black => (0..count).contains(&i).then_some(i as usize),
                Wrap::Clamp => Some(i.clamp(0, count - 1) as usize),
                Wrap::Repeat => Some(i.rem_euclid(count) as usize),
                Wrap::Mirror => {
                    let i = i.rem_euclid(2 * count);
                    Some(i.min(2 * count - 1 - i) as usize)
                }
            }
        };
        image.texel(inside(x, image.width), inside(y, image.height))[0]
    }

    proptest! {
        #[test]
        fn samples_are_bilinear_between_texels_that_go_on_by_the_wrap(
            u in -4.0..5.0f64,
            v in -4.0..5.0f64,
            size in (1..6usize, 1..6usize),
            wrap in prop::sample::select(vec![Wrap::Black, Wrap::Clamp, Wrap::Repeat, Wrap::Mirror]),
        ) {
            let image = ramp(size.0, size.1);
            let (x, y) = (u * size.0 as f64 - 0.5, (1.0 - v) * size.1 as f64 - 0.5);
            let (left, top) = (x.floor(), y.floor());
            let mut expected = 0.0;
            for (dx, across) in [(0, 1.0 - (x - left)), (1, x - left)] {
                for (dy, down) in [(0, 1.0 - (y - top)), (1, y - top)] {
                    let texel = continued(&image, left as i64 + dx, top as i64 + dy, wrap);
                    expected += across * down * f64::from(texel);
                }
            }
            let got = f64::from(image.sample([u, v], [wrap; 2])[0]);
            prop_assert!((got - expected).abs() < 1e-4, "{got} {expected}");
        }
    }

    #[test]
    fn channels_mean_what_their_number_says() {
        let of = |values: Vec<u8>, srgb| {
            let channels = values.len();
            let values = values.into();
            let image = Image::new(1, 1, channels, Texels::Bytes { values, srgb }).unwrap();
            image.sample([0.5, 0.5], [Wrap::Clamp; 2])
        };
        assert_eq!(of(vec![51], false), [0.2, 0.2, 0.2, 1.0]);
        assert_eq!(of(vec![51, 255], false), [0.2, 0.2, 0.2, 1.0]);
        assert_eq!(of(vec![0, 51, 255], false), [0.0, 0.2, 1.0, 1.0]);
        let [r, g, b, a] = of(vec![0, 128, 255, 128], true);
        assert_eq!((r, b, a), (0.0, 1.0, 128.0 / 255.0));
        assert!((g - 0.215_860_5).abs() < 1e-6, "{g}");
    }

    #[test]
    fn hostile_coordinates_and_sizes_are_harmless() {
        let image = ramp(3, 2);
        for u in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            for wrap in [Wrap::Black, Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
                assert!(image.sample([u, -u], [wrap; 2])[0].is_finite());
            }
        }
        let floats = |count: usize| Texels::Floats(vec![0.0; count].into());
        assert!(Image::new(usize::MAX, 2, 3, floats(6)).is_none());
        assert!(Image::new(0, 2, 3, floats(0)).is_none());
        assert!(Image::new(1, 1, 5, floats(5)).is_none());
    }
}
