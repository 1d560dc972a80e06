//! What the firmware's programs share: the board, and a console that prints without formatting machinery.
//!
//! Each program in `src/bin` is complete in itself and small enough to copy. None of them has a heap: no
//! allocator exists here, so one that asked for memory would not link.
#![no_std]

pub mod board;
pub mod cases;
pub mod console;
pub mod measured;
mod panic;
