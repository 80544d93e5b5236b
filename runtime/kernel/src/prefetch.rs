//! Memory asked for before it is needed.

/// What a processor reads at once.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

/// Asks for element `index` of an array, all of it. Without effect but on time.
#[inline(always)]
pub fn prefetch<T>(array: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let start = array.as_ptr().wrapping_add(index).cast::<i8>();
        // SAFETY: every such CPU has the instruction, which reads nothing and accepts any address.
        let ask = |byte| unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(byte)) };
        for byte in (0..size_of::<T>()).step_by(LINE) {
            ask(byte);
        }
        if size_of::<T>() > align_of::<T>() && align_of::<T>() < LINE {
            ask(size_of::<T>() - 1);
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (array, index);
}
