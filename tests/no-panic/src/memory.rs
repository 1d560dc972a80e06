//! Slices from a C caller's pointer and length, and statuses from results.

use habitus_core::Error;

/// A C caller's elements.
#[repr(C)]
pub struct Input<T> {
    data: *const T,
    length: usize,
}

impl<T> Input<T> {
    /// The elements, or none for a null pointer.
    ///
    /// # Safety
    /// `data` is null, or points to `length` elements that nobody writes while the slice is in use.
    pub unsafe fn slice<'a>(&self) -> &'a [T] {
        if self.data.is_null() {
            return &[];
        }
        // SAFETY: the caller's promise.
        unsafe { core::slice::from_raw_parts(self.data, self.length) }
    }
}

/// A C caller's elements to write to.
#[repr(C)]
pub struct Output<T> {
    data: *mut T,
    length: usize,
}

impl<T> Output<T> {
    /// The elements, or none for a null pointer.
    ///
    /// # Safety
    /// `data` is null, or points to `length` elements that nobody else touches while the slice is in use.
    pub unsafe fn slice<'a>(&self) -> &'a mut [T] {
        if self.data.is_null() {
            return &mut [];
        }
        // SAFETY: the caller's promise.
        unsafe { core::slice::from_raw_parts_mut(self.data, self.length) }
    }
}

/// The code of a result: 0, or the error's.
pub fn status<T>(result: Result<T, Error>) -> i32 {
    match result {
        Ok(_) => 0,
        Err(error) => error.code() as i32,
    }
}
