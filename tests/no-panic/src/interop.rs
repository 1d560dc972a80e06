//! `interop.rs` of the kernel: placements and workspaces in the types of other crates. `workspace.rs` too.

use crate::memory::{Output, status};
use habitus_core::rotation::similarity::Similarity;
use habitus_core::workspace::{Requirement, Workspace};

#[unsafe(no_mangle)]
extern "C" fn check_glam(scale: f32, rotation: [[f32; 3]; 3], translation: [f32; 3], point: [f32; 3]) -> f32 {
    let placement = Similarity { scale, rotation, translation };
    let affine = glam::Affine3A::from(placement).transform_point3(point.into());
    let matrix = glam::Mat4::from(placement).transform_point3(point.into());
    affine.x + affine.y + matrix.z
}

#[unsafe(no_mangle)]
extern "C" fn check_nalgebra(scale: f32, rotation: [[f32; 3]; 3], translation: [f32; 3], point: [f32; 4]) -> f32 {
    let matrix = nalgebra::Matrix4::from(Similarity { scale, rotation, translation });
    (matrix * nalgebra::Vector4::from(point)).sum()
}

#[unsafe(no_mangle)]
extern "C" fn check_heapless(numbers: usize) -> i32 {
    match Requirement::of(numbers).bounded::<64>() {
        Ok(memory) => memory.len() as i32,
        Err(error) => error.code() as i32,
    }
}

/// Pieces of any length.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_workspace(memory: Output<f32>, first: usize, second: usize) -> i32 {
    // SAFETY: the caller's promise.
    let mut workspace = Workspace::new(unsafe { memory.slice() });
    let taken = workspace.take(first).and_then(|_| workspace.take(second));
    let needed = Requirement::of(first).and(Requirement::of(second)).or(Requirement::NONE);
    status(taken).wrapping_add(needed.f32_bytes() as i32).wrapping_add(workspace.rest().len() as i32)
}
