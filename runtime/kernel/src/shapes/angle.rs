//! Sines of degrees.

/// sin and cos of an angle in degrees, within an ulp and exact at multiples of 90.
///
/// a = 90 k + r with r exact: |r| ≤ 45 and both have the same ulp or a finer one. The product with
/// π/180 is kept in two parts, whose low one goes in by the derivative.
pub fn sin_cos_degrees(angle: f64) -> (f64, f64) {
    // π/180 to 107 bits.
    const HIGH: f64 = 0.017_453_292_519_943_295;
    const LOW: f64 = 2.948_652_270_870_168_7e-19;
    let turn = angle % 360.0;
    let quarter = (turn / 90.0).round();
    let rest = turn - 90.0 * quarter;
    let high = rest * HIGH;
    let low = rest.mul_add(HIGH, -high) + rest * LOW;
    let (sin, cos) = libm::sincos(high);
    let (sin, cos) = (sin + low * cos, cos - low * sin);
    match (quarter as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_are_exact() {
        for turns in [-100_000.0, -1.0, 0.0, 1.0, 100_000.0] {
            assert_eq!(sin_cos_degrees(90.0 + 360.0 * turns), (1.0, 0.0));
            assert_eq!(sin_cos_degrees(180.0 + 360.0 * turns), (0.0, -1.0));
            assert_eq!(sin_cos_degrees(270.0 + 360.0 * turns), (-1.0, 0.0));
            assert_eq!(sin_cos_degrees(360.0 * turns), (0.0, 1.0));
        }
        assert!((sin_cos_degrees(30.0).0 - 0.5).abs() <= f64::EPSILON / 4.0);
        assert!((sin_cos_degrees(-60.0).1 - 0.5).abs() <= f64::EPSILON / 4.0);
    }
}
