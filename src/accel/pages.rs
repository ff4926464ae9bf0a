//! Large arrays on large pages: a tree's nodes are read in no order that a table of small pages keeps up with.

/// An empty vector with room for `count`, on pages of 2 MiB where the system has them and the vector fills some.
///
/// This is a wish that changes no value; where it is not granted, nothing is lost but time.
pub(super) fn with_capacity<T>(count: usize) -> Vec<T> {
    let vector = Vec::with_capacity(count);
    #[cfg(all(target_os = "linux", not(miri)))]
    advise(&vector);
    vector
}

/// The same elements in a vector of their number, on such pages.
pub(super) fn moved<T: Copy>(elements: Vec<T>) -> Vec<T> {
    let mut vector = with_capacity(elements.len());
    vector.extend_from_slice(&elements);
    vector
}

#[cfg(all(target_os = "linux", not(miri)))]
fn advise<T>(vector: &Vec<T>) {
    const PAGE: usize = 2 << 20;
    /// `MADV_HUGEPAGE` of `<sys/mman.h>`.
    const HUGE: std::ffi::c_int = 14;
    // SAFETY: the standard library is linked to the C library, which has a function of this name and type.
    #[allow(unsafe_code, reason = "a function of the C library")]
    unsafe extern "C" {
        fn madvise(start: *mut std::ffi::c_void, bytes: usize, advice: std::ffi::c_int) -> std::ffi::c_int;
    }
    let start = (vector.as_ptr() as usize).next_multiple_of(PAGE);
    let end = (vector.as_ptr() as usize + vector.capacity() * size_of::<T>()) / PAGE * PAGE;
    if start < end {
        let first = vector.as_ptr().wrapping_byte_add(start - vector.as_ptr() as usize);
        // SAFETY: whole pages within the vector's own memory; the advice changes neither their content nor their owner. Its
        // result is of no consequence.
        #[allow(unsafe_code, reason = "a call of the C library")]
        unsafe {
            madvise(first.cast_mut().cast(), end - start, HUGE);
        }
    }
}
