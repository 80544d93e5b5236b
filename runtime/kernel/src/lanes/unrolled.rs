//! Small arrays of vectors, element by element, without closures.

/// `[e(0), e(1), e(2)]`: as `std::array::from_fn`, without a closure.
///
/// A closure is a function of its own. It is compiled for the instruction set only where the
/// compiler happens to inline it, and else is slower by a factor of a hundred: vectors do not go
/// through closures, nor through functions of the standard library that take them.
macro_rules! axes {
    (|$i:ident| $each:expr) => {{
        let x = {
            let $i = 0usize;
            $each
        };
        let y = {
            let $i = 1usize;
            $each
        };
        let z = {
            let $i = 2usize;
            $each
        };
        [x, y, z]
    }};
}
pub(crate) use axes;

/// `[e(v[0]), e(v[1]), e(v[2])]`: as `v.map(…)`, without a closure; see [`axes`].
macro_rules! each {
    ($vector:expr, |$component:pat_param| $each:expr) => {{
        let [x, y, z] = $vector;
        let x = {
            let $component = x;
            $each
        };
        let y = {
            let $component = y;
            $each
        };
        let z = {
            let $component = z;
            $each
        };
        [x, y, z]
    }};
}
pub(crate) use each;

/// `[e(0), e(1)]`; see [`axes`].
macro_rules! halves {
    (|$i:ident| $each:expr) => {{
        let low = {
            let $i = 0usize;
            $each
        };
        let high = {
            let $i = 1usize;
            $each
        };
        [low, high]
    }};
}
pub(crate) use halves;
