//! What happens on a panic: none is expected, so it ends the program with a failure.

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    crate::report::report(&crate::report::Line::of_text(&["the runner panicked"]));
    end()
}

#[cfg(target_family = "wasm")]
fn end() -> ! {
    core::arch::wasm32::unreachable()
}

#[cfg(not(target_family = "wasm"))]
fn end() -> ! {
    unsafe extern "C" {
        fn abort() -> !;
    }
    // SAFETY: C's `abort` may be called at any time.
    unsafe { abort() }
}
