//! What happens on a panic: nothing may, so the measured build does not even link one.

#[cfg(feature = "link-proof")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    crate::board::undefined_when_panicking()
}

#[cfg(not(feature = "link-proof"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    crate::console::line("panic");
    crate::board::exit(101)
}
