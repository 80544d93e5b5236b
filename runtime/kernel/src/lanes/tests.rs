//! Every instruction set against the portable one, and the portable one against the scalars.
use std::collections::BTreeMap;

use proptest::prelude::*;

use super::{InstructionSet, Isa, Lanes, MAX_WIDTH, Mask, Task, dispatch};
use crate::scalar::Scalar;

const COUNT: usize = 2 * MAX_WIDTH;

/// Bits of a number; all NaN are one.
fn bits<S: Scalar>(x: S) -> u64 {
    if x.to_f64().is_nan() {
        u64::MAX
    } else {
        x.to_bits()
    }
}

type Answers = BTreeMap<&'static str, Vec<u64>>;

#[inline(always)]
fn note<L: Lanes>(answers: &mut Answers, name: &'static str, x: L) {
    let mut lanes = [L::Scalar::default(); MAX_WIDTH];
    x.store(&mut lanes);
    answers
        .entry(name)
        .or_default()
        .extend(lanes[..L::WIDTH].iter().map(|&x| bits(x)));
}

#[inline(always)]
fn note_mask<M: Mask>(answers: &mut Answers, name: &'static str, mask: M) {
    let lanes = (0..M::WIDTH).map(|i| u64::from(mask.bits() >> i & 1));
    answers.entry(name).or_default().extend(lanes);
}

#[inline(always)]
fn every_operation<L: Lanes>(answers: &mut Answers, a: L, b: L, c: L) {
    note(answers, "add", a + b);
    note(answers, "sub", a - b);
    note(answers, "mul", a * b);
    note(answers, "div", a / b);
    note(answers, "neg", -a);
    note(answers, "mul_add", a.mul_add(b, c));
    note(answers, "neg_mul_add", a.neg_mul_add(b, c));
    note(answers, "sqrt", a.sqrt());
    note(answers, "abs", a.abs());
    note(answers, "min", a.min(b));
    note(answers, "max", a.max(b));
    note(answers, "copy_sign", a.copy_sign(b));
    note(answers, "unit_scale", a.unit_scale());
    note(answers, "select", L::select(a.lt(b), c, a));
    note_mask(answers, "lt", a.lt(b));
    note_mask(answers, "le", a.le(b));
    note_mask(answers, "eq", a.eq(b));
    note_mask(answers, "gt", a.gt(b));
    note_mask(answers, "ge", a.ge(b));
    let (x, y) = (a.lt(b), b.lt(c));
    note_mask(answers, "and", x & y);
    note_mask(answers, "or", x | y);
    note_mask(answers, "not", !x);
    note_mask(answers, "and_not", x.and_not(y));
    assert_eq!(x.any(), x.bits() != 0);
    assert_eq!(x.all(), x.bits() == L::Mask::full().bits());
    assert_eq!(L::Mask::from_bits(x.bits()).bits(), x.bits());
    let packed = a.packed(x);
    for (to, from) in (0..L::WIDTH)
        .filter(|lane| x.bits() >> lane & 1 != 0)
        .enumerate()
    {
        assert_eq!(bits(packed.get(to)), bits(a.get(from)));
    }
    let least = (0..L::WIDTH)
        .map(|i| a.get(i))
        .fold(L::Scalar::INFINITY, |x, y| if y < x { y } else { x });
    assert_eq!(bits(a.horizontal_min()), bits(least + L::Scalar::default()));
}

struct EveryOperation<'a> {
    singles: [&'a [f32]; 3],
    doubles: [&'a [f64]; 3],
}

impl Task for EveryOperation<'_> {
    type Output = [Answers; 3];

    #[inline(always)]
    fn run<I: Isa>(self) -> [Answers; 3] {
        let mut singles = Answers::new();
        let mut doubles = Answers::new();
        let mut both = Answers::new();
        for start in (0..COUNT).step_by(I::F32::WIDTH) {
            let [a, b, c] = self.singles.map(|x| I::F32::load(&x[start..]));
            every_operation(&mut singles, a, b, c);
            let (low, high) = I::widen(a);
            note(&mut both, "widen", low);
            note(&mut both, "widen", high);
            let (low, high) = I::split(a.lt(b));
            note_mask(&mut both, "split", low);
            note_mask(&mut both, "split", high);
            note_mask(&mut both, "join", I::join(low, high));
            let [low, high] =
                [0, I::F64::WIDTH].map(|i| I::F64::load(&self.doubles[0][start + i..]));
            note(&mut both, "narrow", I::narrow(low, high));
        }
        let [mut eights, mut fours, mut double_fours] = [const { Answers::new() }; 3];
        for start in (0..COUNT).step_by(I::F32UpTo8::WIDTH) {
            let [a, b, c] = self.singles.map(|x| I::F32UpTo8::load(&x[start..]));
            every_operation(&mut eights, a, b, c);
        }
        for start in (0..COUNT).step_by(I::F32x4::WIDTH) {
            let [a, b, c] = self.singles.map(|x| I::F32x4::load(&x[start..]));
            every_operation(&mut fours, a, b, c);
            let rows = I::transposed([a, b, c, a]);
            for (i, column) in [a, b, c, a].into_iter().enumerate() {
                for (j, row) in rows.iter().enumerate() {
                    assert_eq!(bits(row.get(i)), bits(column.get(j)));
                }
            }
        }
        for start in (0..COUNT).step_by(I::F64UpTo4::WIDTH) {
            let [a, b, c] = self.doubles.map(|x| I::F64UpTo4::load(&x[start..]));
            every_operation(&mut double_fours, a, b, c);
        }
        for start in (0..COUNT).step_by(I::F64::WIDTH) {
            let [a, b, c] = self.doubles.map(|x| I::F64::load(&x[start..]));
            every_operation(&mut doubles, a, b, c);
        }
        assert_eq!(
            [&singles, &singles, &doubles],
            [&eights, &fours, &double_fours]
        );
        [singles, doubles, both]
    }
}

fn spicy_f32() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        -4.0f32..4.0,
        prop::sample::select(vec![
            0.0,
            -0.0,
            1.0,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MIN_POSITIVE,
            1e-45,
            -1e-40,
            f32::MAX,
        ]),
    ]
}

fn spicy_f64() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        -4.0f64..4.0,
        spicy_f32().prop_map(f64::from),
        prop::sample::select(vec![f64::MIN_POSITIVE, 5e-324, f64::MAX, 3.5e38, 1e-46]),
    ]
}

fn three<T: std::fmt::Debug + Clone>(
    number: impl Strategy<Value = T> + Clone,
) -> impl Strategy<Value = [Vec<T>; 3]> {
    let numbers = prop::collection::vec(number, COUNT);
    [numbers.clone(), numbers.clone(), numbers]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_set_computes_as_the_scalars(singles in three(spicy_f32().boxed()), doubles in three(spicy_f64().boxed())) {
        let task = || EveryOperation {
            singles: [&singles[0], &singles[1], &singles[2]],
            doubles: [&doubles[0], &doubles[1], &doubles[2]],
        };
        let mut expected = [Answers::new(), Answers::new()];
        for i in 0..COUNT {
            every_operation(&mut expected[0], singles[0][i], singles[1][i], singles[2][i]);
            every_operation(&mut expected[1], doubles[0][i], doubles[1][i], doubles[2][i]);
        }
        let portable = dispatch(InstructionSet::Portable, task());
        prop_assert_eq!(&portable[..2], &expected[..]);
        let narrow: Vec<u64> = doubles[0].iter().map(|&x| bits(x as f32)).collect();
        prop_assert_eq!(&portable[2]["narrow"], &narrow);
        let widened: Vec<u64> = singles[0].iter().map(|&x| bits(f64::from(x))).collect();
        prop_assert_eq!(&portable[2]["widen"], &widened);
        prop_assert_eq!(&portable[2]["join"], &expected[0]["lt"]);
        prop_assert_eq!(&portable[2]["split"], &expected[0]["lt"]);
        for set in InstructionSet::available() {
            prop_assert_eq!(&dispatch(set, task()), &portable, "{}", set.name());
        }
    }
}

#[test]
fn masks_count_lanes_from_the_first() {
    struct First;
    impl Task for First {
        type Output = ();
        #[inline(always)]
        fn run<I: Isa>(self) {
            assert_eq!(I::F32::WIDTH, 2 * I::F64::WIDTH);
            for n in 0..40 {
                let lanes = n.min(I::F32::WIDTH) as u32;
                assert_eq!(<I::F32 as Lanes>::Mask::first(n).bits().count_ones(), lanes);
                assert_eq!(
                    <I::F32 as Lanes>::Mask::first(n).bits().trailing_ones(),
                    lanes
                );
            }
            let x = I::F64::from_fn(|i| i as f64).with(1, 9.0);
            assert_eq!((x.get(0), x.get(1)), (0.0, 9.0));
        }
    }
    for set in InstructionSet::available() {
        dispatch(set, First);
    }
}

#[test]
fn rows_become_columns_and_vectors_their_least_lanes() {
    struct Moves;
    impl Task for Moves {
        type Output = ();
        #[inline(always)]
        fn run<I: Isa>(self) {
            let mut rows = [[0.0; 3]; MAX_WIDTH];
            for (i, row) in rows.iter_mut().enumerate() {
                *row = [0.0, 100.0, 200.0].map(|x| x + i as f64);
            }
            let columns = I::columns(&rows);
            for (axis, column) in columns.into_iter().enumerate() {
                for (lane, row) in rows[..I::F64::WIDTH].iter().enumerate() {
                    assert_eq!(column.get(lane), row[axis]);
                }
            }
            let width = I::F32::WIDTH;
            let mut vectors = [I::F32::zero(); 8];
            for (i, vector) in vectors.iter_mut().enumerate() {
                let lanes: [f32; MAX_WIDTH] = std::array::from_fn(|lane| {
                    ((7 * lane + 5 * i) % width) as f32 - 0.1 * i as f32
                });
                *vector = I::F32::load(&lanes);
            }
            let ranges = I::ranges(vectors);
            for (vector, [least, greatest]) in vectors.into_iter().zip(ranges) {
                assert_eq!(vector.horizontal_min(), least);
                assert_eq!((-vector).horizontal_min(), -greatest);
            }
        }
    }
    for set in InstructionSet::available() {
        dispatch(set, Moves);
    }
}

#[test]
fn the_least_of_any_eight_is_told_apart() {
    struct AllSets;
    impl Task for AllSets {
        type Output = ();
        #[inline(always)]
        fn run<I: Isa>(self) {
            let distances: [f32; 8] = [3.5, 0.0, 7.0, 0.25, 0.25, 1e-30, f32::INFINITY, 2.0];
            let numbers = [7, 1, u32::MAX, 5, 4, 0, 9, 1 << 31];
            for set in 0..256u32 {
                let mut pairs: Vec<u64> = (0..8)
                    .filter(|i| set >> i & 1 != 0)
                    .map(|i: usize| u64::from(distances[i].to_bits()) << 32 | u64::from(numbers[i]))
                    .collect();
                let mut to = [u64::MAX; 9];
                let (least, others) = I::without_least(set, &distances, &numbers, &mut to);
                pairs.sort_unstable();
                let mut found = to[..others].to_vec();
                found.sort_unstable();
                assert_eq!(to[8], u64::MAX);
                assert_eq!(least, pairs.first().copied().unwrap_or(u64::MAX));
                assert_eq!(found, pairs.get(1..).unwrap_or_default());
            }
        }
    }
    for set in InstructionSet::available() {
        dispatch(set, AllSets);
    }
}

#[test]
fn names_go_both_ways() {
    for set in InstructionSet::available() {
        assert_eq!(InstructionSet::from_name(set.name()), Some(set));
    }
    assert_eq!(InstructionSet::from_name("mmx"), None);
    assert_eq!(
        InstructionSet::available().last(),
        Some(&InstructionSet::Portable)
    );
}
