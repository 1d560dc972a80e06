//! The C functions, called with whatever C can pass: pointers that are null, misaligned or overlap, lengths that are wrong, numbers that are none,
//! models that are not open. Memory is valid as far as the header asks for it, and no further.
//!
//! All arguments lie in one arena. What a call may not write must be as it was: everything after an error, everything but the outputs otherwise.

use std::mem::MaybeUninit;

use arbitrary::{Arbitrary, Unstructured};
use habitus_core::format::Model;
use habitus_core::generator::{Generator, Weights};
use habitus_ffi::code::{CODES, hab_code, hab_error_detail, hab_error_format};
use habitus_ffi::evaluate::*;
use habitus_ffi::fit::*;
use habitus_ffi::model::*;
use habitus_ffi::prepared::*;
use habitus_ffi::sections::*;

use crate::damage::{Damage, sound_file};
use crate::numbers::Number;

/// What the fuzzer chooses.
#[derive(Debug, Arbitrary)]
struct Program {
    base: u8,
    damaged: bool,
    numbers: [Number; 16],
    calls: Vec<Call>,
}

#[derive(Debug, Arbitrary)]
struct Call {
    function: u8,
    /// Where each argument points, and how long it is said to be.
    places: [u8; 8],
    lengths: [u8; 8],
    numbers: [u8; 3],
    /// Changes of the fit's options.
    options: [u8; 2],
    option: Number,
    detail: u8,
}

/// Bytes of the arena that an argument has to itself.
const SLOT: usize = 6 * 1024;
/// Slots: one for each argument with memory, the last for the detail.
const SLOTS: usize = 9;
/// The options, which every program finds filled in.
const OPTIONS: usize = 7;

struct Arena {
    words: Vec<u64>,
    file: Vec<u8>,
    model: hab_model,
    prepared: hab_prepared,
    /// The arena before the call that is being made.
    before: Vec<u64>,
    /// What the call may write, and what even a refused one may: offsets of bytes.
    outputs: Vec<(usize, usize)>,
    scratch: (usize, usize),
}

/// A pointer to an argument and the number of its elements.
struct Argument<T>(*mut T, usize);

/// Runs the calls that the bytes make.
pub fn check(bytes: &[u8]) {
    let Ok(program) = Program::arbitrary_take_rest(Unstructured::new(bytes)) else { return };
    let sound = sound_file(usize::from(program.base));
    let file = if program.damaged { Damage::file_of(bytes).unwrap_or(sound) } else { sound };
    let mut arena = Arena {
        words: vec![0; SLOT * SLOTS / 8],
        file,
        model: hab_model { opaque: [MaybeUninit::zeroed(); 80] },
        prepared: hab_prepared { opaque: [MaybeUninit::zeroed(); 64] },
        before: Vec::new(),
        outputs: Vec::new(),
        scratch: (0, 0),
    };
    for (position, chunk) in arena.words.iter_mut().enumerate() {
        let pair = [0, 1].map(|k| u64::from(program.numbers[(2 * position + k) % 16].0.to_bits()));
        *chunk = pair[0] | pair[1] << 32;
    }
    for call in program.calls.iter().take(12) {
        arena.run(call);
    }
}

impl Arena {
    fn base(&mut self) -> *mut u8 {
        self.words.as_mut_ptr().cast()
    }

    /// Where argument `k` of a call points: mostly to its own slot.
    fn argument<T>(&mut self, call: &Call, k: usize, right: usize, written: bool) -> Argument<T> {
        let (place, length) = (usize::from(call.places[k % 8]), call.lengths[k % 8]);
        let slot = k % 8;
        let offset = match place {
            0..200 => slot * SLOT,
            200..208 => return Argument(std::ptr::null_mut(), [right, 0][place % 2]),
            208..228 => slot * SLOT + place % 16,
            _ => place % (SLOTS - 1) * SLOT + place % 3 * 4,
        };
        let room = (SLOT * SLOTS - offset) / size_of::<T>();
        let count = match length {
            0..224 => right,
            224..240 => right.wrapping_add(usize::from(length)).wrapping_sub(232),
            240..248 => usize::from(length) - 240,
            _ => (usize::MAX / size_of::<T>()).saturating_add(usize::from(length) - 248),
        };
        // Beyond the arena only what cannot exist: the library must see that for itself.
        let count = if count > room && count < isize::MAX as usize / size_of::<T>() { right.min(room) } else { count };
        if written {
            let bytes = count.saturating_mul(size_of::<T>());
            self.outputs.push((offset, offset.saturating_add(bytes)));
        }
        Argument(self.base().wrapping_add(offset).cast(), count)
    }

    fn run(&mut self, call: &Call) {
        self.outputs.clear();
        self.scratch = (0, 0);
        self.before.clone_from(&self.words);
        let detail = match call.detail {
            0..64 => std::ptr::null_mut(),
            64..192 => self.base().wrapping_add((SLOTS - 1) * SLOT),
            other => self.base().wrapping_add(usize::from(other) % SLOTS * SLOT + usize::from(other) % 5),
        }
        .cast::<hab_error_detail>();
        let (code, reported) = self.called(call, detail);
        assert!(CODES.iter().any(|(known, ..)| *known == code) && code != hab_code::HAB_INTERNAL, "{code:?}");
        let place = detail.addr().wrapping_sub(self.base().addr());
        let may_write = if code == hab_code::HAB_OK {
            self.outputs.clone()
        } else if reported && !detail.is_null() {
            vec![(place, place + size_of::<hab_error_detail>()), self.scratch]
        } else {
            vec![self.scratch]
        };
        let changed = self.before.iter().zip(&self.words).enumerate().filter(|(_, (a, b))| a != b);
        let bytes = changed.flat_map(|(word, (a, b))| {
            let pairs = a.to_ne_bytes().into_iter().zip(b.to_ne_bytes()).enumerate();
            pairs.filter(|(_, (a, b))| a != b).map(move |(byte, _)| 8 * word + byte)
        });
        let stray = { bytes }.find(|at| !may_write.iter().any(|(from, to)| (*from..*to).contains(at)));
        assert!(stray.is_none(), "byte {stray:?} was written by {call:?}, which returned {code:?}");
    }

    /// Makes the call; whether it takes a detail.
    fn called(&mut self, call: &Call, detail: *mut hab_error_detail) -> (hab_code, bool) {
        let [a, b, c] = call.numbers.map(u32::from);
        let closed = hab_model { opaque: [MaybeUninit::zeroed(); 80] };
        let model: *const hab_model = match call.lengths[7] {
            0..248 => &self.model,
            248..252 => &closed,
            _ => std::ptr::null(),
        };
        let prepared: *const hab_prepared = &self.prepared;
        let header = Model::open(&self.file).ok().map(|model| *model.header());
        let (n, di, dp) = header.map_or((3, 1, 1), |header| {
            (header.n_vertices as usize, header.identity_dim as usize, header.pose_dim as usize)
        });
        let fixed_dim = if a % 2 == 0 { di } else { dp };
        let (first, count) = (b as usize % (n + 2), c as usize % (n + 2));
        let (first_block, blocks) = (b % 3, c % 3);
        let numbers = blocks as usize * 48;
        // SAFETY (of all calls below): arguments lie in the arena or are null, lengths stay within the arena or cannot exist, the model's bytes are
        // never handed out, and models and forms are zero or as the library has made them.
        unsafe {
            let code = match call.function % 16 {
                0 => {
                    let (file, len) = (self.file.as_ptr(), self.file.len());
                    let len = if call.lengths[0] < 200 { len } else { len.min(usize::from(call.lengths[0])) };
                    let open = if a % 4 == 0 { hab_model_open_trusted } else { hab_model_open };
                    open(file, len, &mut self.model, detail)
                }
                1 => {
                    let counts = self.argument::<hab_counts>(call, 1, 1, true);
                    if let (true, false) = (a % 8 > 0 && counts.0.is_aligned(), counts.0.is_null()) {
                        (&raw mut (*counts.0).struct_bytes).write(size_of::<hab_counts>() as u32);
                    }
                    self.before.clone_from(&self.words);
                    hab_model_counts(model, counts.0, detail)
                }
                2 | 3 => {
                    let section = self.argument::<hab_section>(call, 1, 1, true);
                    if let (true, false) = (a % 8 > 0 && section.0.is_aligned(), section.0.is_null()) {
                        (&raw mut (*section.0).struct_bytes).write(size_of::<hab_section>() as u32);
                    }
                    let get = if call.function % 16 == 2 { hab_model_section } else { hab_model_find_section };
                    self.before.clone_from(&self.words);
                    get(model, b % 20, section.0, detail)
                }
                4 => {
                    let values = self.argument::<u32>(call, 1, usize::from(call.options[0]), true);
                    hab_model_read_u32(model, a % 20, first, values.0, values.1, detail)
                }
                5 => {
                    let values = self.argument::<f32>(call, 1, usize::from(call.options[0]), true);
                    hab_model_read_f32(model, a % 20, first, values.0, values.1, detail)
                }
                6 => {
                    let text = self.argument(call, 1, 1, true);
                    let bytes = self.argument(call, 2, 1, true);
                    hab_model_text(model, a % 20, b % 16, text.0, bytes.0, detail)
                }
                7 => {
                    let deviations = self.argument(call, 1, fixed_dim, false);
                    let weights = self.argument(call, 2, fixed_dim, true);
                    hab_model_weights(model, a % 3, deviations.0, deviations.1, weights.0, weights.1, detail)
                }
                8 => {
                    let (x, y) = (self.argument(call, 1, di, false), self.argument(call, 2, dp, false));
                    let out = self.argument(call, 3, 3 * n, true);
                    let code = hab_model_evaluate(model, x.0, x.1, y.0, y.1, out.0, out.1, detail);
                    if code == hab_code::HAB_OK {
                        self.compare(&x, &y, &out);
                    }
                    code
                }
                9 => {
                    let (x, y) = (self.argument(call, 1, di, false), self.argument(call, 2, dp, false));
                    let out = self.argument(call, 3, 3 * count, true);
                    let (first, count) = (wild(first, call), count as u32);
                    hab_model_evaluate_range(model, x.0, x.1, y.0, y.1, first, count, out.0, out.1, detail)
                }
                10 => {
                    let (x, y) = (self.argument(call, 1, di, false), self.argument(call, 2, dp, false));
                    let values = self.argument(call, 3, numbers, true);
                    let columns = self.argument(call, 4, numbers * (di + dp), true);
                    let first = wild(first_block as usize, call);
                    hab_model_linearise(
                        model, x.0, x.1, y.0, y.1, first, blocks, values.0, values.1, columns.0, columns.1, detail,
                    )
                }
                11 => {
                    // The workspace has a slot of its own that later calls leave alone, as the header asks.
                    let weights = self.argument(call, 1, fixed_dim, false);
                    let (first, blocks) = if b % 2 == 0 { (0, n.div_ceil(16) as u32) } else { (first_block, blocks) };
                    let workspace = self.argument::<u8>(call, 6, SLOT, true);
                    let prepared = &mut self.prepared;
                    hab_prepared_init(
                        model,
                        a % 3,
                        weights.0,
                        weights.1,
                        first,
                        blocks,
                        workspace.0.cast(),
                        workspace.1,
                        prepared,
                        detail,
                    )
                }
                12 => {
                    let weights = self.argument(call, 1, [di, dp][usize::from(call.options[0] % 2)], false);
                    let out = self.argument(call, 3, 3 * count, true);
                    let first = wild(first, call);
                    hab_prepared_evaluate(prepared, weights.0, weights.1, first, count as u32, out.0, out.1, detail)
                }
                13 => {
                    let free = [di, dp][usize::from(call.options[0] % 2)];
                    let weights = self.argument(call, 1, free, false);
                    let values = self.argument(call, 3, numbers, true);
                    let columns = self.argument(call, 4, numbers * free, true);
                    let first = wild(first_block as usize, call);
                    hab_prepared_linearise(
                        prepared, weights.0, weights.1, first, blocks, values.0, values.1, columns.0, columns.1, detail,
                    )
                }
                14 => return (self.fitted(call, model, [n, di, dp], detail), true),
                _ => {
                    let text = self.argument::<u8>(call, 1, usize::from(call.options[0]), true);
                    let given = hab_error_detail { code: a as i32 * 2, first: b, second: c, argument: 0 };
                    return (hab_error_format(&given, text.0.cast(), text.1), false);
                }
            };
            (code, true)
        }
    }

    /// Both fits, with and without a prepared form.
    unsafe fn fitted(
        &mut self,
        call: &Call,
        model: *const hab_model,
        [n, di, dp]: [usize; 3],
        detail: *mut hab_error_detail,
    ) -> hab_code {
        let options: *mut hab_fit_options = self.base().wrapping_add(OPTIONS * SLOT + 4096).cast();
        // SAFETY: within the arena, aligned.
        unsafe {
            assert_eq!(hab_fit_options_init(options, size_of::<hab_fit_options>()), hab_code::HAB_OK);
            let [which, value] = call.options;
            let words = options.cast::<u32>();
            // A third of the fits has options as they are; the others have one changed.
            match which {
                0..85 => {}
                85..170 => words.add(usize::from(which) % 5).write(u32::from(value % 4)),
                _ => words.add(5 + usize::from(which) % 6).write(call.option.0.to_bits()),
            }
            (*options).max_iterations = (*options).max_iterations.min(8);
        }
        let form: *const hab_prepared =
            if call.numbers[0].is_multiple_of(3) { &self.prepared } else { std::ptr::null() };
        let dims = match (form.is_null(), call.numbers[1] % 2) {
            (true, _) => [di, dp],
            (false, 0) => [0, dp],
            (false, _) => [di, 0],
        };
        let landmarks = n.div_ceil(3);
        let samples = usize::from(call.numbers[2] % 24);
        let identity = self.argument(call, 2, dims[0], true);
        let pose = self.argument(call, 3, dims[1], true);
        let placement = self.argument(call, 4, 1, true);
        let workspace = self.argument::<u8>(call, 5, SLOT - 64, true);
        let workspace = (workspace.0.cast::<core::ffi::c_void>(), workspace.1);
        let report = self.argument(call, 0, 1, true);
        let from = workspace.0.addr().wrapping_sub(self.base().addr());
        if !workspace.0.is_null() {
            self.scratch = (from, from.saturating_add(workspace.1));
        }
        // SAFETY: as for all calls.
        unsafe {
            if call.numbers[1] % 4 < 2 {
                let targets = self.argument::<f32>(call, 1, 3 * landmarks, false);
                let measured = self.argument::<u8>(call, 6, [0, landmarks][samples % 2], false);
                self.before.clone_from(&self.words);
                hab_fit_landmarks(
                    model,
                    form,
                    options,
                    targets.0,
                    targets.1,
                    measured.0,
                    measured.1,
                    identity.0,
                    identity.1,
                    pose.0,
                    pose.1,
                    placement.0,
                    workspace.0,
                    workspace.1,
                    report.0,
                    detail,
                )
            } else {
                let points = self.argument::<hab_sample>(call, 1, samples, false);
                if !points.0.is_null() && points.0.is_aligned() && points.1 == samples {
                    for k in 0..samples {
                        // Vertices that exist, mostly.
                        let vertex = points.0.add(k).cast::<[u32; 3]>();
                        if (*vertex)[0] as usize > 2 * n {
                            vertex.write([k as u32 % n as u32, 0, 0]);
                        }
                    }
                }
                self.before.clone_from(&self.words);
                hab_fit_points(
                    model,
                    form,
                    options,
                    points.0,
                    points.1,
                    identity.0,
                    identity.1,
                    pose.0,
                    pose.1,
                    placement.0,
                    workspace.0,
                    workspace.1,
                    report.0,
                    detail,
                )
            }
        }
    }

    /// The positions have the bits of the kernel.
    fn compare(&mut self, x: &Argument<f32>, y: &Argument<f32>, out: &Argument<f32>) {
        let slice = |argument: &Argument<f32>| match argument.1 {
            0 => vec![],
            // SAFETY: the call has accepted these pointers and lengths.
            len => unsafe { std::slice::from_raw_parts(argument.0, len).to_vec() },
        };
        let (identity, pose, found) = (slice(x), slice(y), slice(out));
        let model = Model::open(&self.file).expect("a file that the library has opened");
        let mut expected = vec![0.0; found.len()];
        let generator = model.generator().expect("a generator");
        let all = 0..generator.vertex_count();
        generator.evaluate(Weights { identity: &identity, pose: &pose }, all, &mut expected).expect("accepted weights");
        assert!(found.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits()), "bits");
    }
}

/// Sometimes a number beside which every sum overflows.
fn wild(number: usize, call: &Call) -> u32 {
    if call.options[1] > 250 { u32::MAX - u32::from(call.options[1] - 251) } else { number as u32 }
}
