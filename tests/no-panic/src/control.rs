//! Functions that do panic and allocate: the check must catch each of these, or it would miss the like in the kernel.

extern crate alloc;

use crate::memory::Input;
use alloc::vec::Vec;
use core::alloc::{GlobalAlloc, Layout};

/// Indexes without a proof.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_control_index(data: Input<f32>, index: usize) -> f32 {
    // SAFETY: the caller's promise.
    let data = unsafe { data.slice() };
    data[index]
}

/// Panics two calls deep, through a function that is not inlined.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_control_deep(data: Input<f32>, at: usize) -> f32 {
    // SAFETY: the caller's promise.
    let data = unsafe { data.slice() };
    split_sum(data, at)
}

#[inline(never)]
fn split_sum(data: &[f32], at: usize) -> f32 {
    let (before, after) = data.split_at(at);
    before.iter().sum::<f32>() - after.iter().sum::<f32>()
}

/// Allocates.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_control_heap(data: Input<f32>) -> usize {
    // SAFETY: the caller's promise.
    let copy: Vec<f32> = unsafe { data.slice() }.iter().map(|value| value + 1.0).collect();
    copy.iter().filter(|value| value.is_finite()).count()
}

struct Malloc;

unsafe extern "C" {
    fn malloc(bytes: usize) -> *mut u8;
    fn free(data: *mut u8);
}

// SAFETY: malloc and free of C, for alignments up to that of `malloc`; this is never run.
unsafe impl GlobalAlloc for Malloc {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: any size is allowed.
        unsafe { malloc(layout.size()) }
    }

    unsafe fn dealloc(&self, data: *mut u8, _: Layout) {
        // SAFETY: `data` came from `malloc`.
        unsafe { free(data) }
    }
}

#[global_allocator]
static ALLOCATOR: Malloc = Malloc;
