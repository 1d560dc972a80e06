//! The board: start-up, semihosting, the memory left to the program, and the measurement of stack.
//!
//! The only file here with `unsafe`: everything else in this package, and the whole kernel, does without.

use core::arch::asm;
use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut, read_volatile, write_volatile};
use core::sync::atomic::{AtomicBool, Ordering};

/// Names the program's entry: `entry!(run)` with `fn run()`. Returning from it exits with status 0.
#[macro_export]
macro_rules! entry {
    ($run:path) => {
        // SAFETY: the name is unique in the program; `board::start` declares it with this signature.
        #[unsafe(no_mangle)]
        extern "Rust" fn application() {
            $run()
        }
    };
}

/// A model file, in a section of its own: the linker script places it in the memory for models.
#[macro_export]
macro_rules! include_model {
    ($path:expr) => {{
        // SAFETY: the linker script keeps `.models` apart from what is written; the static is immutable.
        #[unsafe(link_section = ".models")]
        static MODEL: [u8; include_bytes!($path).len()] = *include_bytes!($path);
        // As if it came from elsewhere: code must not depend on what the file says.
        ::core::hint::black_box(&MODEL)
    }};
}

unsafe extern "Rust" {
    fn application();
}

unsafe extern "C" {
    // Addresses from link.ld; the values of these statics are never read.
    static mut _stack_bottom: u32;
    static _stack_top: u32;
    static mut _data_start: u32;
    static _data_end: u32;
    static _data_load: u32;
    static mut _bss_start: u32;
    static _bss_end: u32;
    static mut _memory_start: MaybeUninit<f32>;
    static _memory_end: MaybeUninit<f32>;
}

#[repr(C)]
union Vector {
    address: *const u32,
    handler: extern "C" fn() -> !,
}
// SAFETY: the table is read by the processor only and never written.
unsafe impl Sync for Vector {}

// SAFETY: the linker script puts this section at address 0, where the processor looks for its vectors:
// initial stack pointer, reset, and fourteen exceptions, none of which may happen here.
#[unsafe(link_section = ".vectors")]
#[unsafe(no_mangle)]
static VECTORS: [Vector; 16] = {
    const FAULT: Vector = Vector { handler: fault };
    let mut table = [FAULT; 16];
    table[0] = Vector { address: addr_of!(_stack_top) };
    table[1] = Vector { handler: reset };
    table
};

/// Enables the floating-point unit, then starts. No floating point here: its prologue would save
/// registers of a unit that is still off, which faults.
// SAFETY: the name is unique in the program; the linker script names it as its entry.
#[unsafe(no_mangle)]
extern "C" fn reset() -> ! {
    const CPACR: *mut u32 = 0xE000_ED88 as *mut u32;
    // SAFETY: CPACR is the coprocessor access register of every Cortex-M4 and M7; bits 20-23 grant CP10 and CP11.
    // The barriers make the grant hold before the next instruction.
    unsafe {
        write_volatile(CPACR, read_volatile(CPACR) | 0xF << 20);
        asm!("dsb", "isb");
    }
    start()
}

/// Initialises static memory and runs the program.
#[inline(never)]
fn start() -> ! {
    // SAFETY: the linker script aligns these bounds to 4 bytes and orders them; no reference to a static
    // exists yet.
    unsafe {
        let (mut to, mut from) = (addr_of_mut!(_data_start), addr_of!(_data_load));
        while to.cast_const() < addr_of!(_data_end) {
            write_volatile(to, read_volatile(from));
            (to, from) = (to.add(1), from.add(1));
        }
        let mut to = addr_of_mut!(_bss_start);
        while to.cast_const() < addr_of!(_bss_end) {
            write_volatile(to, 0);
            to = to.add(1);
        }
    }
    // SAFETY: defined by `entry!` with this signature; a program without it does not link.
    unsafe { application() };
    exit(0)
}

extern "C" fn fault() -> ! {
    write(b"fault: the stack overflowed or an address was wrong\n\0");
    exit(102)
}

/// The RAM behind the program's statics, zeroed. The first call gets it; later ones get an empty slice.
pub fn memory() -> &'static mut [f32] {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    if TAKEN.swap(true, Ordering::Relaxed) {
        return &mut [];
    }
    let start = addr_of_mut!(_memory_start);
    let length = (addr_of!(_memory_end) as usize - start as usize) / size_of::<f32>();
    // SAFETY: the linker script aligns the region and keeps it free of anything else; `TAKEN` makes this the
    // only reference; every element is written before it is seen as `f32`.
    unsafe {
        let region = core::slice::from_raw_parts_mut(start, length);
        for element in region.iter_mut() {
            element.write(0.0);
        }
        core::slice::from_raw_parts_mut(start.cast::<f32>(), length)
    }
}

/// Runs `work` on a painted stack and returns its result with the most bytes of stack it used.
///
/// Measured from this function's own frame, so the caller's variables do not count. Paint that a callee
/// reserved but did not write is not seen, as in every measurement of this kind.
#[inline(never)]
pub fn stack_used<T>(work: impl FnOnce() -> T) -> (T, u32) {
    const PAINT: u32 = 0xC5A1_17ED;
    let bottom = addr_of_mut!(_stack_bottom);
    let top: *mut u32;
    // SAFETY: reads a register.
    unsafe { asm!("mov {}, sp", out(reg) top) };
    let mut at = bottom;
    while at < top {
        // SAFETY: between the bottom of the stack and the stack pointer lies nothing in use.
        unsafe {
            write_volatile(at, PAINT);
            at = at.add(1);
        }
    }
    let result = apart(work);
    let mut at = bottom;
    // SAFETY: as above; the memory was written just now.
    while at < top && unsafe { read_volatile(at) } == PAINT {
        // SAFETY: `at` is below `top`.
        at = unsafe { at.add(1) };
    }
    (result, top as u32 - at as u32)
}

/// Runs `work` and returns its result with the instructions that it took, as QEMU counts them.
///
/// With `-icount shift=6` an instruction takes 64 ns of the board's time, and the timer of 25 MHz, 40 ns a tick, counts eight for five of them.
#[inline(never)]
pub fn instructions<T>(work: impl FnOnce() -> T) -> (T, u32) {
    // CMSDK timer 0, which counts down: control, value, reload.
    const TIMER: [*mut u32; 3] = [0x4000_0000 as *mut u32, 0x4000_0004 as *mut u32, 0x4000_0008 as *mut u32];
    let [control, value, reload] = TIMER;
    // SAFETY: registers of a peripheral of this board, at every access one aligned word.
    let before = unsafe {
        write_volatile(reload, u32::MAX);
        write_volatile(value, u32::MAX);
        write_volatile(control, 1);
        read_volatile(value)
    };
    let result = apart(work);
    // SAFETY: as above.
    let after = unsafe { read_volatile(value) };
    (result, (u64::from(before.wrapping_sub(after)) * 5 / 8) as u32)
}

/// A frame of its own for `work`, so that it lies wholly below the painted boundary.
#[inline(never)]
fn apart<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Prints bytes up to the first zero (semihosting SYS_WRITE0).
///
/// Bytes without a zero are not printed.
pub fn write(bytes: &[u8]) {
    if bytes.contains(&0) {
        semihost(0x04, bytes.as_ptr() as usize);
    }
}

/// Ends the emulation with a status (semihosting SYS_EXIT_EXTENDED).
pub fn exit(status: u32) -> ! {
    const APPLICATION_EXIT: u32 = 0x20026;
    let block = [APPLICATION_EXIT, status];
    loop {
        semihost(0x20, block.as_ptr() as usize);
    }
}

fn semihost(operation: usize, argument: usize) {
    // SAFETY: the debugger (QEMU) handles this breakpoint. It reads the memory that `argument` points to,
    // which both callers keep alive and terminated, and changes r0 only.
    unsafe { asm!("bkpt 0xAB", inout("r0") operation => _, in("r1") argument, options(nostack)) };
}

#[cfg(feature = "link-proof")]
pub(crate) fn undefined_when_panicking() -> ! {
    unsafe extern "C" {
        fn habitus_panic_path_survived() -> !;
    }
    // SAFETY: never runs, because a program that contains this call does not link.
    unsafe { habitus_panic_path_survived() }
}
