//! Room for large arrays in huge pages.
//!
//! A ray jumps about in the trees it is traced through. Where these are larger than what the
//! processor remembers of the table of pages (some 8 MiB in pages of 4 KiB), jumps wait for that
//! to be read too. Pages of 2 MiB reach five hundred times as far; Linux gives them to those who ask.

/// An empty vector with room for that many items.
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    let room = Vec::<T>::with_capacity(capacity);
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // When it is first touched; at once where the allocator had it in use before.
    let advices = [libc::MADV_HUGEPAGE, libc::MADV_COLLAPSE];
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    advise(
        room.as_ptr().addr(),
        room.capacity() * size_of::<T>(),
        &advices,
    );
    room
}

/// A vector of so many zeros, of which large ones take memory when they are first touched.
pub fn zeros<T: Clone + Default>(count: usize) -> Vec<T> {
    let zeros = vec![T::default(); count];
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    advise(
        zeros.as_ptr().addr(),
        count * size_of::<T>(),
        &[libc::MADV_HUGEPAGE],
    );
    zeros
}

/// Advises of the huge pages that lie within some memory. Whether it helps or not is not told.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn advise(start: usize, len: usize, advices: &[i32]) {
    /// The size on most processors.
    const HUGE_PAGE: usize = 2 << 20;
    let first = start.next_multiple_of(HUGE_PAGE);
    let end = (start + len) & !(HUGE_PAGE - 1);
    if first >= end {
        return;
    }
    for &advice in advices {
        // SAFETY: the bytes are all of one allocation that is ours, and none of the advices given
        // here changes them.
        unsafe { libc::madvise(first as *mut _, end - first, advice) };
    }
}
