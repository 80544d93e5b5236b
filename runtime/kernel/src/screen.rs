//! What a screen shows of linear colours: 8 bits a channel, and files of them.
use std::sync::LazyLock;

use jpeg_encoder as jpeg;
use png::{BitDepth, ColorType, DeflateCompression, Encoder, EncodingError, SrgbRenderingIntent};

/// Of zlib: four times as fast as level 4, for a fifth to a half more bytes.
const PNG_LEVEL: u8 = 1;
/// Of 100: no difference is seen.
const JPEG_QUALITY: u8 = 95;

/// How linear values become the bytes of a screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Display {
    /// Light, multiplied by a factor, clipped to 1 and encoded by the sRGB curve.
    Light(f32),
    /// Data: neither multiplied nor encoded.
    Data,
}

/// Red, green, blue, coverage of linear colours that are premultiplied by their fourth, the
/// coverage; what is returned is not. NaN is shown as 0.
pub fn show(color: &[[f32; 4]], display: Display) -> Vec<[u8; 4]> {
    let curve = &*CURVE;
    let pixel = |&[r, g, b, a]: &[f32; 4]| {
        let coverage = clipped(a);
        if coverage == 0.0 {
            return [0; 4];
        }
        let byte = |x: f32| match display {
            Display::Light(factor) => curve.byte(x / coverage * factor),
            Display::Data => rounded(x / coverage),
        };
        [byte(r), byte(g), byte(b), rounded(coverage)]
    };
    color.iter().map(pixel).collect()
}

/// Clipped to 0 … 1; NaN and -0 are 0.
fn clipped(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// The nearest of 0 … 255 to 255 times what is clipped to 0 … 1.
fn rounded(x: f32) -> u8 {
    (clipped(x) * 255.0 + 0.5) as u8
}

/// The sRGB curve (IEC 61966-2-1) to bytes, correctly rounded.
///
/// Numbers that share exponent and the first seven bits of their mantissa lie so close together
/// that the curve rises by less than one byte among them: a table of the least of their bytes, and
/// one comparison with where the next byte begins, give the answer.
struct Curve {
    /// The least number that has each byte; infinity after the last.
    begins: [f32; 257],
    /// The byte of the least number with these leading bits, counted from `FIRST`.
    least: Vec<u8>,
}

/// Bits of a float below exponent and leading mantissa.
const REST: u32 = 16;
/// Leading bits of 2⁻¹³, below which all is byte 0.
const FIRST: u32 = (127 - 13) << (23 - REST);
/// Leading bits of 1.
const LAST: u32 = 127 << (23 - REST);

static CURVE: LazyLock<Curve> = LazyLock::new(|| {
    let mut begins = [f32::INFINITY; 257];
    begins[0] = 0.0;
    for (byte, begin) in begins[..256].iter_mut().enumerate().skip(1) {
        let shown = (byte as f64 - 0.5) / 255.0;
        let linear = if shown <= 0.04045 {
            shown / 12.92
        } else {
            libm::pow((shown + 0.055) / 1.055, 2.4)
        };
        let nearest = linear as f32;
        let below = f64::from(nearest) < linear;
        *begin = if below { nearest.next_up() } else { nearest };
    }
    let byte = |x: f32| (begins.partition_point(|&begin| begin <= x) - 1) as u8;
    let least = (FIRST..=LAST).map(|bits| byte(f32::from_bits(bits << REST)));
    let least = least.collect();
    Curve { begins, least }
});

impl Curve {
    /// The byte of a number, clipped to 0 … 1.
    fn byte(&self, x: f32) -> u8 {
        let x = clipped(x);
        let leading = (x.to_bits() >> REST).clamp(FIRST, LAST);
        let least = self.least[(leading - FIRST) as usize];
        least + u8::from(x >= self.begins[usize::from(least) + 1])
    }
}

/// A PNG file of rows of so many pixels, without the fourth channel where everything is covered.
/// Fails where there are no pixels, or more in a row or a column than the format has numbers for.
pub fn png(pixels: &[[u8; 4]], width: usize) -> Result<Vec<u8>, EncodingError> {
    let height = pixels.len().checked_div(width).unwrap_or(0);
    let side = |length: usize| u32::try_from(length).unwrap_or(0);
    let covered = pixels.iter().all(|&[.., coverage]| coverage == 255);
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, side(width), side(height));
    encoder.set_depth(BitDepth::Eight);
    encoder.set_color(if covered {
        ColorType::Rgb
    } else {
        ColorType::Rgba
    });
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_deflate_compression(DeflateCompression::Level(PNG_LEVEL));
    let mut writer = encoder.write_header()?;
    if covered {
        let opaque: Vec<[u8; 3]> = pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        writer.write_image_data(opaque.as_flattened())?;
    } else {
        writer.write_image_data(pixels.as_flattened())?;
    }
    writer.finish()?;
    Ok(file)
}

/// A JPEG file of rows of so many pixels, whose coverage is not looked at. Fails where there are no
/// pixels, or more in a row or a column than the format has numbers for.
pub fn jpeg(pixels: &[[u8; 4]], width: usize) -> Result<Vec<u8>, jpeg::EncodingError> {
    let height = pixels.len().checked_div(width).unwrap_or(0);
    let side = |length: usize| u16::try_from(length).unwrap_or(0);
    let mut file = Vec::new();
    jpeg::Encoder::new(&mut file, JPEG_QUALITY).encode(
        pixels.as_flattened(),
        side(width),
        side(height),
        jpeg::ColorType::Rgba,
    )?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The curve as the standard writes it.
    fn encoded(x: f64) -> f64 {
        if x <= 0.0031308 {
            12.92 * x
        } else {
            1.055 * x.powf(1.0 / 2.4) - 0.055
        }
    }

    fn shown(x: f32, display: Display) -> u8 {
        show(&[[x, 0.0, 0.0, 1.0]], display)[0][0]
    }

    #[test]
    fn every_byte_begins_where_the_curve_is_half_way() {
        for byte in 1..=255_u8 {
            let begin = CURVE.begins[usize::from(byte)];
            assert_eq!(shown(begin, Display::Light(1.0)), byte);
            assert_eq!(shown(begin.next_down(), Display::Light(1.0)), byte - 1);
            let half = 255.0 * encoded(f64::from(begin)) + 0.5;
            assert!((half - f64::from(byte)).abs() < 1e-4, "{byte}: {half}");
        }
    }

    proptest! {
        #[test]
        fn light_is_rounded_on_the_curve(x in 0.0_f32..1.0, small in 0.0_f32..0.01) {
            for x in [x, small] {
                let exact = 255.0 * encoded(f64::from(x));
                let byte = f64::from(shown(x, Display::Light(1.0)));
                // The standard's two pieces leave a gap of 1e-8 where they meet.
                prop_assert!((byte - exact).abs() <= 0.5 + 1e-4, "{x}: {byte}, {exact}");
            }
        }

        #[test]
        fn a_factor_and_the_coverage_are_taken_before_the_curve(
            x in 0.0_f32..1.0, power in -8_i32..8, half in 0.1_f32..1.0,
        ) {
            let factor = 2.0_f32.powi(power);
            let bright = shown(x * factor, Display::Light(1.0));
            prop_assert_eq!(shown(x, Display::Light(factor)), bright);
            let thin = show(&[[x * 0.5, x * half, 0.0, 0.5]], Display::Light(1.0))[0];
            prop_assert_eq!(thin[0], shown(x, Display::Light(1.0)));
            prop_assert_eq!(thin[3], 128);
        }
    }

    #[test]
    fn what_is_no_colour_is_shown_as_some_colour() {
        for x in [f32::NAN, -1.0, f32::NEG_INFINITY, -0.0, 1e-30] {
            for display in [Display::Light(1.0), Display::Light(0.0), Display::Data] {
                assert_eq!(shown(x, display), 0);
            }
        }
        for x in [1.0, 1.0_f32.next_up(), f32::INFINITY] {
            assert_eq!(shown(x, Display::Light(1.0)), 255);
            assert_eq!(shown(x, Display::Data), 255);
        }
        for coverage in [0.0, -1.0, f32::NAN] {
            assert_eq!(show(&[[1.0, 1.0, 1.0, coverage]], Display::Data), [[0; 4]]);
        }
    }

    #[test]
    fn a_file_holds_the_pixels_and_coverage_only_where_needed() {
        let mut pixels: Vec<[u8; 4]> = (0..60_u8).map(|i| [i, 255 - i, 7 * (i % 5), 255]).collect();
        for (coverage, channels) in [(255, 3), (254, 4)] {
            pixels[17][3] = coverage;
            let file = png(&pixels, 12).expect("a picture");
            let decoder = png::Decoder::new(std::io::Cursor::new(file));
            let mut reader = decoder.read_info().expect("a header");
            let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
            let frame = reader.next_frame(&mut bytes).expect("a frame");
            assert_eq!((frame.width, frame.height), (12, 5));
            assert_eq!(frame.color_type.samples(), channels);
            let back: Vec<&[u8]> = bytes.chunks(channels).collect();
            let wanted: Vec<&[u8]> = pixels.iter().map(|pixel| &pixel[..channels]).collect();
            assert_eq!(back, wanted);
        }
    }

    #[test]
    fn a_file_of_nothing_is_refused() {
        for width in [0, 4] {
            assert!(png(&[], width).is_err());
            assert!(jpeg(&[], width).is_err());
        }
    }
}
