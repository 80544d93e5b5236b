//! Where camera rays start and go.
use super::rays::RayLists;
use super::vector::Vec3;
use crate::lanes::{Isa, Lanes};

/// How the window is seen from the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// All rays from one point.
    Perspective,
    /// All rays in one direction.
    Orthographic,
}

/// A camera as in `compiler.ir.CAMERA`.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Unit vector towards the right of the picture, in world space.
    pub right: Vec3,
    /// Unit vector towards the top of the picture.
    pub up: Vec3,
    /// Unit vector away from what is seen.
    pub back: Vec3,
    /// The eye, in world space.
    pub position: Vec3,
    /// Height of the window: on the plane at distance 1, or in world units if orthographic.
    pub height: f64,
    /// Width over height of the window; NaN takes the picture's.
    pub aspect: f64,
    /// Shift of the window right and up, in fractions of its width and height.
    pub shift: [f64; 2],
    /// Nothing nearer than this along the viewing axis is seen.
    pub near: f64,
    /// Nothing farther than this along the viewing axis is seen.
    pub far: f64,
}

/// A camera fitted to a picture: maps pixels to rays.
///
/// A picture whose aspect differs from the window's shows the whole window and more of the scene
/// on two sides. Along every ray `t` is the distance along the viewing axis.
pub struct View {
    camera: Camera,
    left: f64,
    top: f64,
    pixel_width: f64,
    pixel_height: f64,
}

impl View {
    /// The view of a picture of `width` × `height` pixels.
    pub fn new(camera: Camera, width: u32, height: u32) -> View {
        let (columns, rows) = (f64::from(width), f64::from(height));
        let picture_aspect = columns / rows;
        let aspect = if camera.aspect.is_nan() {
            picture_aspect
        } else {
            camera.aspect
        };
        let window = [camera.height * aspect, camera.height];
        let shown_height = if picture_aspect >= aspect {
            window[1]
        } else {
            window[0] / picture_aspect
        };
        let shown_width = shown_height * picture_aspect;
        View {
            camera,
            left: camera.shift[0] * window[0] - 0.5 * shown_width,
            top: camera.shift[1] * window[1] + 0.5 * shown_height,
            pixel_width: shown_width / columns,
            pixel_height: shown_height / rows,
        }
    }

    /// Origin and direction of rays through the picture at `x` pixels from the left, `y` from the
    /// top.
    #[inline(always)]
    fn ray<L: Lanes<Scalar = f64>>(&self, x: L, y: L) -> [Vec3<L>; 2] {
        let camera = &self.camera;
        let x = L::splat(self.left) + x * L::splat(self.pixel_width);
        let y = L::splat(self.top) - y * L::splat(self.pixel_height);
        let [right, up, back, position] =
            [camera.right, camera.up, camera.back, camera.position].map(Vec3::splat);
        let (right, up) = (right * x, up * y);
        match camera.projection {
            Projection::Perspective => [position, right + up - back],
            Projection::Orthographic => [position + right + up, -back],
        }
    }

    /// Makes `rays` those through so many points of the picture, given by columns.
    #[inline(always)]
    pub fn aim<I: Isa>(&self, [x, y]: &[Vec<f64>; 2], count: usize, rays: &mut RayLists) {
        rays.resize(count);
        for first in (0..count).step_by(I::F64::WIDTH) {
            let (x, y) = (I::F64::load(&x[first..]), I::F64::load(&y[first..]));
            let [origin, direction] = self.ray(x, y);
            origin.store(&mut rays.origin, first);
            direction.store(&mut rays.direction, first);
        }
        rays.t_min.fill(self.camera.near);
        rays.t_max.fill(self.camera.far);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection, aspect: f64) -> Camera {
        Camera {
            projection,
            right: Vec3::new(1.0, 0.0, 0.0),
            up: Vec3::new(0.0, 1.0, 0.0),
            back: Vec3::new(0.0, 0.0, 1.0),
            position: Vec3::new(10.0, 20.0, 30.0),
            height: 2.0,
            aspect,
            shift: [0.0, 0.0],
            near: 0.5,
            far: 9.0,
        }
    }

    fn ray(view: &View, x: f64, y: f64) -> [[f64; 3]; 2] {
        view.ray(x, y).map(Vec3::to_array)
    }

    #[test]
    fn the_top_left_corner_is_up_and_left() {
        let view = View::new(camera(Projection::Perspective, f64::NAN), 400, 200);
        let [origin, direction] = ray(&view, 0.0, 0.0);
        assert_eq!(origin, [10.0, 20.0, 30.0]);
        assert_eq!(direction, [-2.0, 1.0, -1.0]);
    }

    #[test]
    fn another_aspect_shows_the_whole_window_and_more() {
        let wide = View::new(camera(Projection::Perspective, 1.0), 400, 200);
        assert_eq!(ray(&wide, 400.0, 200.0)[1], [2.0, -1.0, -1.0]);
        let tall = View::new(camera(Projection::Perspective, 1.0), 200, 400);
        assert_eq!(ray(&tall, 200.0, 400.0)[1], [1.0, -2.0, -1.0]);
    }

    #[test]
    fn orthographic_rays_are_parallel_and_shifted_with_the_window() {
        let mut shifted = camera(Projection::Orthographic, 2.0);
        shifted.shift = [0.5, -0.25];
        let [origin, direction] = ray(&View::new(shifted, 200, 100), 100.0, 50.0);
        assert_eq!(origin, [12.0, 19.5, 30.0]);
        assert_eq!(direction, [0.0, 0.0, -1.0]);
    }
}
