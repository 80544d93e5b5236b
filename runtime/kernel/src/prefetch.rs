//! Memory asked for before it is needed. Without effect but on time.

/// What a processor reads at once.
const LINE: usize = 64;

/// Asks for the line at a byte of an array's element.
#[inline(always)]
fn ask(start: *const u8, byte: usize) {
    // SAFETY: every such CPU has the instruction, which reads nothing and accepts any address.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(byte).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (start, byte);
}

/// Element `index` of an array.
#[inline(always)]
pub fn prefetch<T>(array: &[T], index: usize) {
    let start = array.as_ptr().wrapping_add(index).cast();
    for byte in (0..size_of::<T>()).step_by(LINE) {
        ask(start, byte);
    }
    if size_of::<T>() > align_of::<T>() && align_of::<T>() < LINE {
        ask(start, size_of::<T>() - 1);
    }
}

/// Element `index` of one of two arrays, or as much of it as is in four lines: without a branch,
/// which could not be predicted.
#[inline(always)]
pub fn prefetch_either<A, B>(first: bool, a: &[A], b: &[B], index: usize) {
    let (array, size) = if first {
        (a.as_ptr().cast::<u8>(), size_of::<A>())
    } else {
        (b.as_ptr().cast(), size_of::<B>())
    };
    let start = array.wrapping_add(index * size);
    for line in 0..4 {
        ask(start, line * LINE);
    }
}

/// Four lines at a byte from `start`.
#[inline(always)]
pub fn prefetch_at(start: *const u8, byte: usize) {
    for line in 0..4 {
        ask(start, byte + line * LINE);
    }
}
