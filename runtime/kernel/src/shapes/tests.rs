use super::*;
use crate::lanes::{InstructionSet, Mask, Task, dispatch};

struct Along<'a> {
    shape: &'a Shape<f32>,
    o: [f32; 3],
    d: [f32; 3],
}

impl Task for Along<'_> {
    type Output = Option<f32>;
    #[inline(always)]
    fn run<I: Isa>(self) -> Option<f32> {
        let ray = RayLanes {
            o: self.o.map(I::F32::splat),
            d: self.d.map(I::F32::splat),
            t_min: I::F32::zero(),
            t_max: I::F32::splat(f32::INFINITY),
        };
        let (hit, t) = self.shape.intersect::<I, _>(&ray, Mask::full());
        hit.any().then(|| t.get(0))
    }
}

#[test]
fn simple_shapes_are_hit() {
    for set in InstructionSet::available() {
        for (kind, parameters, t) in [
            (ShapeKind::Sphere, &[1.0][..], 4.0),
            (ShapeKind::Box, &[-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.0], 4.0),
            (ShapeKind::Cylinder, &[1.0, -1.0, 1.0, 0.0], 4.0),
            (ShapeKind::Disc, &[1.0], 5.0),
            (ShapeKind::Rectangle, &[1.0, 1.0], 5.0),
            (ShapeKind::Plane, &[], 5.0),
            (
                ShapeKind::Triangle,
                &[1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 0.0, 0.0, -1.0],
                5.0,
            ),
        ] {
            let shape = Shape::new(kind, parameters).unwrap();
            let hit = dispatch(
                set,
                Along {
                    shape: &shape,
                    o: [0.0, 5.0, 0.0],
                    d: [0.0, -1.0, 0.0],
                },
            );
            assert_eq!(hit, Some(t), "{kind:?}");
            let miss = dispatch(
                set,
                Along {
                    shape: &shape,
                    o: [0.0, 5.0, 0.0],
                    d: [0.0, 1.0, 0.0],
                },
            );
            assert_eq!(miss, None);
        }
    }
}
